"""LaTeX of the report's symbols (Appendix F) for states, tables, parameters and inputs, by their full names."""

from __future__ import annotations

import re

_PLAIN = {
    "t": "t",
    "lateral_velocity": r"\dot Y",
    "lateral_position": "Y",
    "attitude": r"\varphi_Z",
    "attitude_rate": r"\dot\varphi_Z",
    "angle_of_attack": r"\alpha",
    "engine_angle": r"\beta",
    "bending_moment": "M_B",
    "mass": "m",
    "moment_of_inertia": "I_{ZZ}",
    "center_of_gravity": "X_{CG}",
    "altitude": "h",
    "altitude_rate": r"\dot h",
    "relative_velocity": "V_{RS}",
    "dynamic_pressure": "q",
    "axial_acceleration": "A_X",
    "axial_drag": "F_{AX}",
    "thrust": "F_{TX}",
    "control_thrust": "F_{TCX}",
    "normal_force_slope": "C'_N",
    "center_of_pressure": "X_{CP}",
    "reference_area": "A",
    "control.attitude_factor": "K_1",
    "control.rate_factor": "K_2",
    "wind": "W",
    "wind.mean": r"\bar W",
    "wind.sigma_scale": r"k_\sigma",
    "wind.mean_scale": "k_W",
    "mean.angle_of_attack": r"\bar\alpha",
    "mean.engine_angle": r"\bar\beta",
    "mean.attitude": r"\bar\varphi_Z",
    "lateral_acceleration": r"\ddot Y",
    "attitude_acceleration": r"\ddot\varphi_Z",
    "measured_attitude": r"\varphi_m",
    "measured_attitude_rate": r"\dot\varphi_m",
    "s": "s",
}
_PATTERNS = (
    (r"engine_force_on_mode_(\d+)", r"Q_{{E {0}}}"),
    (r"aerodynamic_force_on_mode_(\d+)", r"Q_{{A {0}}}"),
    (r"slosh_force_on_mode_(\d+)", r"Q_{{S {0}}}"),
    (r"input wind", r"\bar W"),
    (r"noise (\w+)", r"w_{{{0}}}"),
    (r"bending_(\d+)", r"\eta_{{{0}}}"),
    (r"bending_rate_(\d+)", r"\dot\eta_{{{0}}}"),
    (r"bending_acceleration_(\d+)", r"\ddot\eta_{{{0}}}"),
    (r"slosh_rate_(\w+)", r"\dot\xi_{{{0}}}"),
    (r"slosh_acceleration_(\w+)", r"\ddot\xi_{{{0}}}"),
    (r"slosh_(\w+)", r"\xi_{{{0}}}"),
    (r"bending\.(\d+)\.frequency", r"\omega_{{{0}}}"),
    (r"bending\.(\d+)\.damping", r"\zeta_{{{0}}}"),
    (r"bending\.(\d+)\.generalized_mass", r"T_{{\mu {0}}}"),
    (r"bending\.(\d+)\.displacement_at_gimbal", r"Y_{{{0}}}(X_E)"),
    (r"bending\.(\d+)\.slope_at_gimbal", r"Y'_{{{0}}}(X_E)"),
    (r"bending\.(\d+)\.slope_at_sensor", r"Y'_{{{0}}}(X_M)"),
    (r"bending\.(\d+)\.normal_force_slope_times_displacement", r"(C'_N Y)_{{{0}}}"),
    (r"bending\.(\d+)\.normal_force_slope_times_slope", r"(C'_N Y')_{{{0}}}"),
    (r"bending\.(\d+)\.displacement_at_(\w+)", r"Y_{{{0}}}(X_{{S\,{1}}})"),
    (r"bending\.(\d+)\.slope_at_(\w+)", r"Y'_{{{0}}}(X_{{S\,{1}}})"),
    (r"slosh\.(\w+)\.mass", r"m_{{{0}}}"),
    (r"slosh\.(\w+)\.frequency", r"\omega_{{{0}}}"),
    (r"slosh\.(\w+)\.damping", r"\zeta_{{{0}}}"),
    (r"slosh\.(\w+)\.attach_point", r"X_{{S\,{0}}}"),
    (r"loads\.(\w+)\.angle_of_attack", r"M'_\alpha"),
    (r"loads\.(\w+)\.engine_angle", r"M'_\beta"),
    (r"loads\.(\w+)\.center_of_pressure", r"\partial M'_\alpha/\partial X_{{CP}}"),
    (r"loads\.(\w+)\.bending_(\d+)", r"M'_{{\eta {1}}}"),
    (r"loads\.(\w+)\.slosh_(\w+)", r"M'_{{\xi\,{1}}}"),
    (r"control\.T(\d)\.gain", r"k_{{T{0}}}"),
    (r"control\.T(\d)\.numerator\.s(\d+)", r"b_{{{0},{1}}}"),
    (r"control\.T(\d)\.denominator\.s(\d+)", r"a_{{{0},{1}}}"),
    (r"T(\d)_(\d+)", r"x_{{T{0},{1}}}"),
    (r"T(\d)", r"y_{{T{0}}}"),
    (r"(\w+)\.sigma", r"\sigma_{{{0}}}"),
    (r"(\w+)\.correlation_time", r"\tau_{{{0}}}"),
    (r"deviation_(\w+)", r"n_{{{0}}}"),
    (r"wind_filter\.([FGH])_(\d+)_(\d+)", r"{0}_{{{1}{2}}}"),
    (r"wind_(\d+)", r"z_{{{0}}}"),
)


def latex_symbol(name: str) -> str:
    """Return the symbol of a name; one that the report does not know is set upright.

    A name of words keeps them as an upright subscript: 'slosh.sic_lox.mass' is m with 'sic lox' below.
    """
    if name in _PLAIN:
        return _PLAIN[name]
    for pattern, form in _PATTERNS:
        if match := re.fullmatch(pattern, name):
            return form.format(*map(_upright, match.groups()))
    return _upright(name)


def _upright(text: str) -> str:
    """Return digits and single letters as they are, words upright."""
    if text.isdigit() or len(text) == 1:
        return text
    return r"\mathrm{" + re.sub(r"[_. ]", r"\\,", text) + "}"
