"""Every column of every table of a vehicle: name, unit, sign and meaning.

The reader, the header that 'ascentwind new-vehicle' writes and docs/tables.md take them from here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Column(NamedTuple):
    """A column: name, unit, what its sign may be ('+' positive, '0' not negative, '' any), meaning."""

    name: str
    unit: str
    sign: str
    meaning: str

    @property
    def label(self) -> str:
        """The column's head in a CSV file."""
        return f"{self.name} [{self.unit}]"


TIME = Column("time", "s", "", "flight time")
ALTITUDE = Column("altitude", "m", "", "above sea level")

RIGID_BODY = (
    Column("mass", "kg", "+", "of the whole vehicle with all liquid"),
    Column("moment_of_inertia", "kg m2", "+", "in pitch and yaw about the centre of gravity, all liquid frozen"),
    Column("center_of_gravity", "m", "", "forward of the gimbal plane"),
)
PRODUCT_OF_INERTIA = Column(
    "product_of_inertia", "kg m2", "", "of the vehicle's planes: sum over the masses of Y_pitch Y_yaw"
)
TRAJECTORY = (
    Column("altitude", "m", "", "above sea level; increases"),
    Column("relative_velocity", "m/s", "+", "speed through air without wind"),
    Column("dynamic_pressure", "Pa", "0", "of that speed"),
    Column("axial_acceleration", "m/s2", "", "(thrust - axial_drag) / mass"),
    Column("axial_drag", "N", "", "air force along the axis, positive aft"),
)
# of the flight without wind itself, by plane
OWN_ANGLE = {
    "pitch": Column("angle_of_attack_pitch", "rad", "", "of the flight without wind, nose over from its path +"),
    "yaw": Column("angle_of_attack_yaw", "rad", "", "of the flight without wind, nose to the right of its path +"),
}
AZIMUTH_CHANGE = Column(
    "azimuth_change", "rad", "", "how far the pitch plane has turned to the right from the azimuth of the flight"
)
PROPULSION = (
    Column("thrust", "N", "0", "of all engines"),
    Column("control_thrust", "N", "0", "of those that are gimballed; lateral force for each rad of engine angle"),
)
AERODYNAMICS = (
    Column("normal_force_slope", "1/rad", "", "C'_N of the whole vehicle on the reference area"),
    Column("center_of_pressure", "m", "", "where it acts, forward of the gimbal plane"),
)
ZERO_ANGLE = Column(
    "normal_force_at_zero_angle",
    "1",
    "",
    "C_N at angle of attack zero, spread as the slope is; where not symmetrical",
)
GAINS = (
    Column("attitude_factor", "1", "", "on T1(s), behind the network"),
    Column("rate_factor", "1", "", "on T2(s), behind the network"),
)
SCHEDULE = (Column("factor", "1", "", "on the gain of a load-relief sensor"),)
SLOSH = (
    Column("mass", "kg", "+", "of the liquid that sloshes, the first lateral mode"),
    Column("frequency", "rad/s", "+", "of that mode at the axial acceleration of the time"),
    Column("attach_point", "m", "", "where it pushes the tank, forward of the gimbal plane"),
)
WIND = (
    Column("mean", "m/s", "", "mean wind in the yaw plane"),
    Column("standard_deviation", "m/s", "+", "of the wind about its mean"),
)
TURBULENCE = (Column("sigma", "m/s", "0", "standard deviation of turbulence"),)
WIND_COMPONENTS = (
    Column("mean_zonal", "m/s", "", "mean wind towards the east"),
    Column("standard_deviation_zonal", "m/s", "+", "of that wind about its mean"),
    Column("mean_meridional", "m/s", "", "mean wind towards the north"),
    Column("standard_deviation_meridional", "m/s", "+", "of that wind about its mean"),
    Column("correlation", "1", "", "of the two at the same altitude"),
)

# of a load, by which the rigid body answers slosh
SECOND_MOMENT = Column(
    "second_moment", "kg m2", "", "S_2: mass forward of s times (x - s)(x - X_CG), and rotary inertia"
)
REACTION = (Column("first_moment", "kg m", "", "S_1: mass forward of s times x - s"), SECOND_MOMENT)
# of a load and of a mode, where the centre of pressure deviates
MOVED_LINE = Column(
    "center_of_pressure",
    "N/rad",
    "",
    "dM'_alpha/dX_CP: moment for each rad and metre that the air force moves",
)
MOVED_MODE = Column(
    "normal_force_slope_times_slope", "1/m/rad", "", "what each metre of that move adds to the air force on the mode"
)

# of a load, where the centre of gravity lies beside the thrust
OFFSET_MASS = Column(
    "center_of_gravity_offset",
    "kg",
    "",
    "mass forward of s less S_2 mass / I_ZZ: moment for each m of offset and m/s2 along the axis",
)


def p_delta_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of a load for thrust on the displaced gimbal."""
    return tuple(
        Column(f"p_delta_{i}", "kg", "", f"moment for each m of mode {i} and m/s2 of thrust over mass")
        for i in range(1, modes + 1)
    )


def by_need_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of a bending moment that deviations and P-delta ask for."""
    return (MOVED_LINE, OFFSET_MASS, *p_delta_columns(modes))


def bending_columns(tanks: Sequence[str]) -> tuple[Column, ...]:
    """Return the columns of a bending mode."""
    return (
        Column("frequency", "rad/s", "+", "of the free-free mode, all liquid frozen"),
        Column("generalized_mass", "kg", "+", "of the mode with the displacement scaled as below"),
        Column("displacement_at_gimbal", "1", "", "Y_i at the gimbal plane; any scale, the same in all columns"),
        Column("slope_at_gimbal", "1/m", "", "turn of the section at the gimbal plane"),
        Column("slope_at_sensor", "1/m", "", "turn where attitude and attitude rate are measured"),
        Column("normal_force_slope_times_displacement", "1/rad", "", "sum over the vehicle of c'_N Y_i"),
        *(Column(f"displacement_at_{tank}", "1", "", f"at the attach point of {tank}") for tank in tanks),
        *(Column(f"slope_at_{tank}", "1/m", "", f"turn at the attach point of {tank}") for tank in tanks),
    )


def mode_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of the bending modes at a load-relief sensor."""
    pairs = (
        (
            Column(f"displacement_{i}", "1", "", f"of mode {i} at the sensor"),
            Column(f"slope_{i}", "1/m", "", f"turn of mode {i} at the sensor"),
        )
        for i in range(1, modes + 1)
    )
    return tuple(column for pair in pairs for column in pair)


def load_columns(modes: int, tanks: Sequence[str]) -> tuple[Column, ...]:
    """Return the columns of a load (4-13)."""
    return (
        Column("angle_of_attack", "N m/rad", "", "M'_alpha: moment for each rad of angle of attack"),
        Column("engine_angle", "N m/rad", "", "M'_beta: moment for each rad of engine angle"),
        *(Column(f"bending_{i}", "N s2", "", f"M'_eta: moment for each m/s2 of mode {i}") for i in range(1, modes + 1)),
        *(Column(f"slosh_{tank}", "N s2", "", f"M'_xi: moment for each m/s2 of the slosh in {tank}") for tank in tanks),
    )


PREFIX = "local."  # of the tables of the local angle of attack


def local_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of the integrals of the normal force for the local angle of attack, arms x - X_CG."""
    numbers = range(1, modes + 1)
    return (
        Column("arm", "m/rad", "", "integral of c'_N times arm"),
        Column("arm_squared", "m2/rad", "0", "of c'_N times arm squared"),
        *(Column(f"arm_displacement_{i}", "m/rad", "", f"of c'_N times arm times Y_{i}") for i in numbers),
        *(Column(f"slope_{i}", "1/m/rad", "", f"of c'_N times dY_{i}/dx, the slope of the axis") for i in numbers),
        *(Column(f"arm_slope_{i}", "1/rad", "", f"of c'_N times arm times dY_{i}/dx") for i in numbers),
        *(
            Column(f"displacement_{i}_displacement_{j}", "1/rad", "", f"of c'_N times Y_{i} Y_{j}")
            for i in numbers
            for j in numbers
            if j >= i
        ),
        *(
            Column(f"displacement_{i}_slope_{j}", "1/m/rad", "", f"of c'_N times Y_{i} dY_{j}/dx")
            for i in numbers
            for j in numbers
        ),
    )


def local_load_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of a load for the local angle of attack."""
    numbers = range(1, modes + 1)
    return (
        Column("attitude_rate", "N m s/rad", "", "moment for each rad/s of turning"),
        *(Column(f"bending_displacement_{i}", "N", "", f"moment for each m of mode {i}") for i in numbers),
        *(Column(f"bending_rate_{i}", "N s", "", f"moment for each m/s of mode {i}") for i in numbers),
    )


def normal_force_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of the normal force by strips along the vehicle."""
    return (
        Column("normal_force_slope", "1/rad", "", "integral of c'_N over a strip about s"),
        Column("first_moment", "m/rad", "", "of c'_N times x"),
        *(Column(f"displacement_{i}", "1/rad", "", f"of c'_N times Y_{i}") for i in _count(modes)),
    )


# of a load's shear force: as of its moment, without the lever arm
SHEAR_REACTION = (
    Column("first_moment", "kg", "0", "S_1 of the shear force: mass forward of s"),
    Column("second_moment", "kg m", "", "S_2 of it: mass forward of s times x - X_CG"),
)
AXIAL = (
    Column("mass_forward", "kg", "0", "mass forward of s with all liquid"),
    Column("drag_forward", "1", "0", "share of the axial drag that acts forward of s"),
)
RADIUS = Column("radius", "m", "0", "of the vehicle's outline at s")


def shear_by_need_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of a shear force that deviations and P-delta ask for."""
    metre = "dV'_alpha/dX_CP: shear force for each rad and metre that the air force moves"
    offset = "-S_2 mass / I_ZZ: shear force for each m of offset and m/s2 along the axis"
    bent = "shear force for each m of mode {} and m/s2 of thrust over mass"
    return (
        Column(MOVED_LINE.name, "N/m/rad", "", metre),
        Column(OFFSET_MASS.name, "kg/m", "", offset),
        *(Column(column.name, "kg/m", "", bent.format(i)) for i, column in enumerate(p_delta_columns(modes), start=1)),
    )


def shear_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of a shear force; slosh acts through the tanks' own tables."""
    return (
        Column("angle_of_attack", "N/rad", "", "V'_alpha: shear force for each rad of angle of attack"),
        Column("engine_angle", "N/rad", "", "V'_beta: shear force for each rad of engine angle"),
        *(Column(f"bending_{i}", "kg", "", f"V'_eta: shear force for each m/s2 of mode {i}") for i in _count(modes)),
    )


def local_shear_columns(modes: int) -> tuple[Column, ...]:
    """Return the columns of a shear force for the local angle of attack."""
    return (
        Column("attitude_rate", "N s/rad", "", "shear force for each rad/s of turning"),
        *(Column(f"bending_displacement_{i}", "N/m", "", f"shear force for each m of mode {i}") for i in _count(modes)),
        *(Column(f"bending_rate_{i}", "N s/m", "", f"shear force for each m/s of mode {i}") for i in _count(modes)),
    )


def _count(modes: int) -> range:
    return range(1, modes + 1)


ALONG_ARGUMENTS = (
    TIME,
    Column("station", "m", "", "of the vehicle"),
    Column("forward_of_gimbal", "m", "", "the same forward of the gimbal plane"),
)


def along_columns(modes: int, tanks: Sequence[str]) -> tuple[Column, ...]:
    """Return the coefficient columns of the bending moment along the vehicle."""
    return (
        *load_columns(modes, tanks),
        *REACTION,
        *by_need_columns(modes),
        *local_load_columns(modes),
    )


def whole_shear_columns(modes: int) -> tuple[Column, ...]:
    """Return the coefficient columns of a table of shear forces, at a station or along the vehicle."""
    return (*shear_columns(modes), *SHEAR_REACTION, *shear_by_need_columns(modes), *local_shear_columns(modes))
