"""Every column of every table of a vehicle: name, unit, sign."""

from __future__ import annotations

from collections.abc import Sequence

SCHEDULE_COLUMNS = (("factor", "1", ""),)


def mode_columns(modes: int) -> tuple[tuple[str, str, str], ...]:
    """Return the columns of a sensor's table of bending modes: name, unit, sign."""
    names = [(f"displacement_{i}", f"slope_{i}") for i in range(1, modes + 1)]
    return tuple(column for y, slope in names for column in ((y, "1", ""), (slope, "1/m", "")))


# columns of a load's table by which the rigid body answers slosh: S_1, S_2
REACTION_COLUMNS = (("first_moment", "kg m", ""), ("second_moment", "kg m2", ""))


def load_columns(modes: int, tanks: Sequence[str]) -> tuple[tuple[str, str, str], ...]:
    """Return the columns of a load's table: name, unit, sign."""
    return (
        ("angle_of_attack", "N m/rad", ""),
        ("engine_angle", "N m/rad", ""),
        *((f"bending_{i}", "N s2", "") for i in range(1, modes + 1)),
        *((f"slosh_{tank}", "N s2", "") for tank in tanks),
    )


PREFIX = "local."


def local_columns(modes: int) -> tuple[tuple[str, str, str], ...]:
    """Return the columns of the table of integrals: name, unit, sign."""
    numbers = range(1, modes + 1)
    return (
        ("arm", "m/rad", ""),
        ("arm_squared", "m2/rad", "0"),
        *((f"arm_displacement_{i}", "m/rad", "") for i in numbers),
        *((f"slope_{i}", "1/m/rad", "") for i in numbers),
        *((f"arm_slope_{i}", "1/rad", "") for i in numbers),
        *((f"displacement_{i}_displacement_{j}", "1/rad", "") for i in numbers for j in numbers if j >= i),
        *((f"displacement_{i}_slope_{j}", "1/m/rad", "") for i in numbers for j in numbers),
    )


def local_load_columns(modes: int) -> tuple[tuple[str, str, str], ...]:
    """Return the columns of a load's table of local terms: name, unit, sign."""
    numbers = range(1, modes + 1)
    return (
        ("attitude_rate", "N m s/rad", ""),
        *((f"bending_displacement_{i}", "N", "") for i in numbers),
        *((f"bending_rate_{i}", "N s", "") for i in numbers),
    )


Column = tuple[str, str, str]  # name, unit, sign


MOVED_LINE: Column = ("center_of_pressure", "N/rad", "")  # of a load: moment for each rad and metre moved


MOVED_MODE: Column = ("normal_force_slope_times_slope", "1/m/rad", "")  # of a mode: int c'_N dY_i/dx dx


SECOND_MOMENT: Column = ("second_moment", "kg m2", "")  # of a load: S_2


# Columns by role: (name, unit, sign). '+' positive, '0' not negative, '' any.
RIGID_BODY = (("mass", "kg", "+"), ("moment_of_inertia", "kg m2", "+"), ("center_of_gravity", "m", ""))


TRAJECTORY = (
    ("altitude", "m", ""),
    ("relative_velocity", "m/s", "+"),
    ("dynamic_pressure", "Pa", "0"),
    ("axial_acceleration", "m/s2", ""),
    ("axial_drag", "N", ""),
)


PROPULSION = (("thrust", "N", "0"), ("control_thrust", "N", "0"))


AERODYNAMICS = (("normal_force_slope", "1/rad", ""), ("center_of_pressure", "m", ""))


GAINS = (("attitude_factor", "1", ""), ("rate_factor", "1", ""))


SLOSH = (("mass", "kg", "+"), ("frequency", "rad/s", "+"), ("attach_point", "m", ""))


WIND = (("mean", "m/s", ""), ("standard_deviation", "m/s", "+"))


def _bending_columns(tanks: list[str]):
    return (
        ("frequency", "rad/s", "+"),
        ("generalized_mass", "kg", "+"),
        ("displacement_at_gimbal", "1", ""),
        ("slope_at_gimbal", "1/m", ""),
        ("slope_at_sensor", "1/m", ""),
        ("normal_force_slope_times_displacement", "1/rad", ""),
        *((f"displacement_at_{tank}", "1", "") for tank in tanks),
        *((f"slope_at_{tank}", "1/m", "") for tank in tanks),
    )
