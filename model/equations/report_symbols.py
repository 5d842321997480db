"""The report's symbols (Appendix F) for table values, by their full names."""

from __future__ import annotations

import re

_PLAIN = {
    "mass": "m",
    "moment_of_inertia": "I_ZZ",
    "center_of_gravity": "X_CG",
    "altitude": "h",
    "altitude_rate": "v = dh/dt",
    "relative_velocity": "V_RS",
    "dynamic_pressure": "q",
    "axial_acceleration": "A_X",
    "axial_drag": "F_AX",
    "thrust": "F_TX",
    "control_thrust": "F_TCX, F_TCY",
    "normal_force_slope": "C'_N",
    "center_of_pressure": "X_CP",
    "control.attitude_factor": "a0 / T1(0)",
    "control.rate_factor": "a1 / T2(0)",
    "wind.mean": "W mean",
    "mean.angle_of_attack": "alpha mean",
    "mean.engine_angle": "beta mean",
    "mean.attitude": "phi_Z mean",
}
_PATTERNS = (
    (r"bending\.(\d+)\.frequency", r"omega_n{0}"),
    (r"bending\.(\d+)\.generalized_mass", r"T_mu{0}"),
    (r"bending\.(\d+)\.displacement_at_gimbal", r"Y_{0}(X_E)"),
    (r"bending\.(\d+)\.slope_at_gimbal", r"Y'_{0}(X_E)"),
    (r"bending\.(\d+)\.slope_at_sensor", r"Y'_{0}(X_M)"),
    (r"bending\.(\d+)\.normal_force_slope_times_displacement", r"sum_j C'_N Y_{0}j"),
    (r"bending\.(\d+)\.normal_force_slope_times_slope", r"sum_j C'_N Y'_{0}j"),
    (r"bending\.(\d+)\.displacement_at_(\w+)", r"Y_{0}(X_S {1})"),
    (r"bending\.(\d+)\.slope_at_(\w+)", r"Y'_{0}(X_S {1})"),
    (r"slosh\.(\w+)\.mass", r"m_S {0}"),
    (r"slosh\.(\w+)\.frequency", r"omega_S {0}"),
    (r"slosh\.(\w+)\.attach_point", r"X_S {0}"),
    (r"loads\.(\w+)\.angle_of_attack", r"M'_alpha"),
    (r"loads\.(\w+)\.engine_angle", r"M'_beta"),
    (r"loads\.(\w+)\.center_of_pressure", r"dM'_alpha / dX_CP"),
    (r"loads\.(\w+)\.bending_(\d+)", r"M'_eta{1}"),
    (r"loads\.(\w+)\.slosh_(\w+)", r"M'_xi {1}"),
    (r"wind_filter\.([FGH])_(\d+)_(\d+)", r"{0}[{1},{2}]"),
)


def report_symbol(name: str) -> str:
    """Return the report's symbol for a table, '' if it has none."""
    if name in _PLAIN:
        return _PLAIN[name]
    for pattern, form in _PATTERNS:
        if match := re.fullmatch(pattern, name):
            return form.format(*match.groups())
    return ""
