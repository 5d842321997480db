"""The report's symbols (Appendix F) for states, tables, parameters and inputs by full name, as text and in LaTeX."""

from __future__ import annotations

import re

# by name: the symbol as text, '' where tables show none, and in LaTeX; both are formats of the words in a name
_PLAIN = {
    "t": ("", "t"),
    "lateral_velocity": ("", r"\dot Y"),
    "lateral_position": ("", "Y"),
    "attitude": ("", r"\varphi_Z"),
    "attitude_rate": ("", r"\dot\varphi_Z"),
    "angle_of_attack": ("", r"\alpha"),
    "engine_angle": ("", r"\beta"),
    "bending_moment": ("", "M_B"),
    "mass": ("m", "m"),
    "moment_of_inertia": ("I_ZZ", "I_{{ZZ}}"),
    "center_of_gravity": ("X_CG", "X_{{CG}}"),
    "altitude": ("h", "h"),
    "altitude_rate": ("v = dh/dt", r"\dot h"),
    "relative_velocity": ("V_RS", "V_{{RS}}"),
    "dynamic_pressure": ("q", "q"),
    "axial_acceleration": ("A_X", "A_X"),
    "axial_drag": ("F_AX", "F_{{AX}}"),
    "thrust": ("F_TX", "F_{{TX}}"),
    "control_thrust": ("F_TCX, F_TCY", "F_{{TCX}}"),
    "normal_force_slope": ("C'_N", "C'_N"),
    "center_of_pressure": ("X_CP", "X_{{CP}}"),
    "reference_area": ("", "A"),
    "control.attitude_factor": ("a0 / T1(0)", "K_1"),
    "control.rate_factor": ("a1 / T2(0)", "K_2"),
    "wind": ("", "W"),
    "wind.mean": ("W mean", r"\bar W"),
    "wind.sigma_scale": ("", r"k_\sigma"),
    "wind.mean_scale": ("", "k_W"),
    "mean.angle_of_attack": ("alpha mean", r"\bar\alpha"),
    "mean.engine_angle": ("beta mean", r"\bar\beta"),
    "mean.attitude": ("phi_Z mean", r"\bar\varphi_Z"),
    "lateral_acceleration": ("", r"\ddot Y"),
    "attitude_acceleration": ("", r"\ddot\varphi_Z"),
    "measured_attitude": ("", r"\varphi_m"),
    "measured_attitude_rate": ("", r"\dot\varphi_m"),
    "s": ("", "s"),
}
_PATTERNS = (
    (r"engine_force_on_mode_(\d+)", "", "Q_{{E {0}}}"),
    (r"aerodynamic_force_on_mode_(\d+)", "", "Q_{{A {0}}}"),
    (r"slosh_force_on_mode_(\d+)", "", "Q_{{S {0}}}"),
    ("input wind", "", r"\bar W"),
    (r"noise (\w+)", "", "w_{{{0}}}"),
    (r"bending_(\d+)", "", r"\eta_{{{0}}}"),
    (r"bending_rate_(\d+)", "", r"\dot\eta_{{{0}}}"),
    (r"bending_acceleration_(\d+)", "", r"\ddot\eta_{{{0}}}"),
    (r"slosh_rate_(\w+)", "", r"\dot\xi_{{{0}}}"),
    (r"slosh_acceleration_(\w+)", "", r"\ddot\xi_{{{0}}}"),
    (r"slosh_(\w+)", "", r"\xi_{{{0}}}"),
    (r"bending\.(\d+)\.frequency", "omega_n{0}", r"\omega_{{{0}}}"),
    (r"bending\.(\d+)\.damping", "", r"\zeta_{{{0}}}"),
    (r"bending\.(\d+)\.generalized_mass", "T_mu{0}", r"T_{{\mu {0}}}"),
    (r"bending\.(\d+)\.displacement_at_gimbal", "Y_{0}(X_E)", "Y_{{{0}}}(X_E)"),
    (r"bending\.(\d+)\.slope_at_gimbal", "Y'_{0}(X_E)", "Y'_{{{0}}}(X_E)"),
    (r"bending\.(\d+)\.slope_at_sensor", "Y'_{0}(X_M)", "Y'_{{{0}}}(X_M)"),
    (r"bending\.(\d+)\.normal_force_slope_times_displacement", "sum_j C'_N Y_{0}j", "(C'_N Y)_{{{0}}}"),
    (r"bending\.(\d+)\.normal_force_slope_times_slope", "sum_j C'_N Y'_{0}j", "(C'_N Y')_{{{0}}}"),
    (r"bending\.(\d+)\.displacement_at_(\w+)", "Y_{0}(X_S {1})", r"Y_{{{0}}}(X_{{S\,{1}}})"),
    (r"bending\.(\d+)\.slope_at_(\w+)", "Y'_{0}(X_S {1})", r"Y'_{{{0}}}(X_{{S\,{1}}})"),
    (r"slosh\.(\w+)\.mass", "m_S {0}", "m_{{{0}}}"),
    (r"slosh\.(\w+)\.frequency", "omega_S {0}", r"\omega_{{{0}}}"),
    (r"slosh\.(\w+)\.damping", "", r"\zeta_{{{0}}}"),
    (r"slosh\.(\w+)\.attach_point", "X_S {0}", r"X_{{S\,{0}}}"),
    (r"loads\.shear_force\w*\.angle_of_attack", "V'_alpha", r"V'_\alpha"),
    (r"loads\.shear_force\w*\.engine_angle", "V'_beta", r"V'_\beta"),
    (r"loads\.shear_force\w*\.center_of_pressure", "dV'_alpha / dX_CP", r"\partial V'_\alpha/\partial X_{{CP}}"),
    (r"loads\.shear_force\w*\.bending_(\d+)", "V'_eta{0}", r"V'_{{\eta {0}}}"),
    (r"loads\.(\w+)\.mass_forward", "m_s", "m_s"),
    (r"loads\.(\w+)\.drag_forward", "d_s", "d_s"),
    (r"loads\.(\w+)\.radius", "R", "R"),
    ("input undisturbed_flight", "", "1"),
    (r"loads\.(\w+)\.angle_of_attack", "M'_alpha", r"M'_\alpha"),
    (r"loads\.(\w+)\.engine_angle", "M'_beta", r"M'_\beta"),
    (r"loads\.(\w+)\.center_of_pressure", "dM'_alpha / dX_CP", r"\partial M'_\alpha/\partial X_{{CP}}"),
    (r"loads\.(\w+)\.bending_(\d+)", "M'_eta{1}", r"M'_{{\eta {1}}}"),
    (r"loads\.(\w+)\.slosh_(\w+)", "M'_xi {1}", r"M'_{{\xi\,{1}}}"),
    (r"control\.T(\d)\.gain", "", "k_{{T{0}}}"),
    (r"control\.T(\d)\.numerator\.s(\d+)", "", "b_{{{0},{1}}}"),
    (r"control\.T(\d)\.denominator\.s(\d+)", "", "a_{{{0},{1}}}"),
    (r"T(\d)_(\d+)", "", "x_{{T{0},{1}}}"),
    (r"T(\d)", "", "y_{{T{0}}}"),
    (r"(\w+)\.(?:sigma|standard_deviation)", "", r"\sigma_{{{0}}}"),
    (r"(\w+)\.correlation_time", "", r"\tau_{{{0}}}"),
    (r"deviation_(\w+)", "", "n_{{{0}}}"),
    (r"wind_filter\.([FGH])_(\d+)_(\d+)", "{0}[{1},{2}]", "{0}_{{{1}{2}}}"),
    (r"wind_(\d+)", "", "z_{{{0}}}"),
)


def report_symbol(name: str) -> str:
    """Return the report's symbol for a table as text, '' if it has none."""
    text, _, words = _symbols(name)
    return text.format(*words)


def latex_symbol(name: str) -> str:
    """Return the symbol of a name in LaTeX; one that the report does not know is set upright.

    A name of words keeps them as an upright subscript: 'slosh.sic_lox.mass' is m with 'sic lox' below.
    """
    _, latex, words = _symbols(name)
    return latex.format(*map(_upright, words)) if latex else _upright(name)


def _symbols(name: str) -> tuple[str, str, tuple[str, ...]]:
    """Return the formats of a name's symbol, as text and in LaTeX, and the words of the name that stand in them."""
    if name in _PLAIN:
        return *_PLAIN[name], ()
    for pattern, text, latex in _PATTERNS:
        if match := re.fullmatch(pattern, name):
            return text, latex, match.groups()
    return "", "", ()


def _upright(text: str) -> str:
    """Return digits and single letters as they are, words upright."""
    if text.isdigit() or len(text) == 1:
        return text
    return r"\mathrm{" + re.sub(r"[_. ]", r"\\,", text) + "}"
