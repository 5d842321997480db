"""The equations of a vehicle in one plane: rigid body, control, bending, slosh and outputs, deviations among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ..system.labels import Output
from ..vehicle.biases import WIND_BIAS
from ..vehicle.columns import OWN_ANGLE
from ..vehicle.loads import AXIAL_FORCE, load_name
from ..vehicle.mean_wind import GROUND_VELOCITY, PROGRAMME
from ..vehicle.planes import Plane
from . import rigid_body
from .block import Block
from .control_law import control_law
from .coupling import Accelerations
from .deviations import Undeviated, deviated
from .forces import Handles, solved_motion
from .motion import Motion
from .outputs import outputs
from .penetration import penetration
from .typical_sizes import SCALES
from .vehicle_numbers import Numbers


@dataclass(frozen=True, eq=False)
class Winds:
    """One wind, or its components towards the east and the north.

    Attributes
    ----------
    random : tuple of SX
        Of the filter, m/s.
    mean : tuple of SX
        Known inputs, m/s.
    expected : tuple of SX
        What these are, m/s.
    """

    random: tuple[ca.SX, ...]
    mean: tuple[ca.SX, ...]
    expected: tuple[ca.SX, ...]


@dataclass(frozen=True, eq=False)
class PlaneEquations:
    """Equations of one plane.

    Attributes
    ----------
    blocks, positions : tuple of Block
        States and rates; the lateral position apart, which drives nothing.
    labels : tuple of Output
    output : SX
    matrix : SX
        Of the coupled accelerations, inverted in the equations.
    rotation, couple : SX
        Acceleration of the attitude (rad/s2), and the couple of the other plane (N m) that is to be put in.
    """

    blocks: tuple[Block, ...]
    positions: tuple[Block, ...]
    labels: tuple[Output, ...]
    output: ca.SX
    matrix: ca.SX
    rotation: ca.SX
    couple: ca.SX


def plane_equations(plane: Plane, numbers: Numbers, turbulence: ca.SX, winds: Winds) -> PlaneEquations:
    """Return the equations of a plane; ``turbulence`` (m/s) is across the path in it, beside the wind.

    Raises
    ------
    DataError
        If a noise source deviates a table that the mean response cannot carry.
    """
    vehicle = plane.vehicle
    motion, handles = Motion.of(numbers.modes, numbers.tanks, numbers.zones), Handles.new()
    solved = solved_motion(vehicle, numbers, motion, handles)
    control = control_law(numbers, motion, solved, _programme(plane, numbers))
    met = [random + mean for random, mean in zip(winds.random, winds.mean, strict=True)]
    if WIND_BIAS in numbers.biases:
        deviation = numbers.biases[WIND_BIAS].deviation
        met = [wind + deviation * expected for wind, expected in zip(met, winds.expected, strict=True)]
    across = in_plane(plane, numbers, met) + _of_turned_path(plane, numbers, winds.expected)
    zones = penetration(across + turbulence, numbers.zones, numbers.tables)
    own = _own_angle(plane, numbers)
    alpha = rigid_body.angle_of_attack(numbers.tables, motion.attitude, motion.lateral_velocity, zones.reference) + own
    blocks = [
        *_rigid_body(motion, solved),
        *control.blocks,
        *_bending(motion, solved),
        *_slosh(motion, solved, numbers.tanks),
        *zones.blocks,
    ]
    positions, moving = _position(plane, motion), len(blocks)
    blocks += positions
    responses = outputs(vehicle, numbers, motion, solved, handles)
    equations = Undeviated(
        ca.vertcat(*(block.symbols for block in blocks)),
        rates=ca.vertcat(*(block.rates for block in blocks)),
        outputs=ca.vertcat(*(value for _, value in responses)),
        angles=ca.vertcat(alpha, control.engine_angle, zones.angles),
        responses=tuple(label.name for label, _ in responses),
        handles=handles,
    )
    rates, output = deviated(vehicle, numbers, motion, equations)
    # the flight without wind has turned under that force already: Y is measured from it
    rates[0] -= rigid_body.normal_force_slope(numbers.tables, numbers.area) * own / numbers.tables["mass"]
    blocks = _with_rates(blocks, rates, plane.prefix)
    labels = tuple(_named(plane, label) for label, _ in responses)
    rotation = next(b.rates for b in blocks if b.states[0].name == f"{plane.prefix}attitude_rate")
    return PlaneEquations(
        tuple(blocks[:moving]), tuple(blocks[moving:]), labels, output, solved.matrix, rotation, handles.other_plane
    )


def in_plane(plane: Plane, numbers: Numbers, winds: Sequence[ca.SX]) -> ca.SX:
    """Return the wind across the path in a plane, m/s, of one wind or of what blows towards the east and the north.

    Yaw: u cos Az - v sin Az, the whole of it. Pitch: that along the heading, u sin Az + v cos Az, acts by its part
    normal to the path, times sin gamma = hdot / V; it blows downrange in the direction in which the vehicle pitches
    over.
    """
    if len(winds) == 1:
        return winds[0] if plane.name == "yaw" else _share(plane, numbers) * winds[0]
    along, across = _of_heading(numbers, winds)
    return _in_body(plane, numbers, _share(plane, numbers) * along, across)


def _of_heading(numbers: Numbers, winds: Sequence[ca.SX]) -> tuple[ca.SX, ca.SX]:
    """Return the wind along the heading and to the right of it, m/s."""
    sine, cosine, (u, v) = ca.sin(numbers.azimuth), ca.cos(numbers.azimuth), winds
    return u * sine + v * cosine, u * cosine - v * sine


def _share(plane: Plane, numbers: Numbers) -> ca.SX:
    """Return how much of a wind along the heading is across the path."""
    if plane.vehicle.file.wind.pitch_wind == "horizontal":
        return ca.SX(1)
    return numbers.tables["altitude_rate"] / numbers.tables["relative_velocity"]


def _in_body(plane: Plane, numbers: Numbers, pitch: ca.SX, yaw: ca.SX) -> ca.SX:
    """Return what a vehicle's plane has of something in pitch and in yaw of the flight, from which it may be rolled."""
    own, other = (pitch, yaw) if plane.name == "pitch" else (yaw, -pitch)
    if numbers.roll is None:
        return own
    return ca.cos(numbers.roll) * own + ca.sin(numbers.roll) * other


def _of_turned_path(plane: Plane, numbers: Numbers, expected: Sequence[ca.SX]) -> ca.SX:
    """Return what the expected wind across the path in pitch is more than its deviations' share, m/s.

    The path through the mean wind is turned against that over the ground: a deviation is met by hdot / V_air of it, and
    the mean itself, by the law of sines, by hdot / V_ground. One speed makes both the same.
    """
    tables = numbers.tables
    if GROUND_VELOCITY not in tables or plane.vehicle.file.wind.pitch_wind == "horizontal":
        return ca.SX(0)
    along = expected[0] if len(expected) == 1 else _of_heading(numbers, expected)[0]
    more = (tables["relative_velocity"] / tables[GROUND_VELOCITY] - 1) * _share(plane, numbers) * along
    return _in_body(plane, numbers, more, ca.SX(0)) * numbers.undisturbed


def _programme(plane: Plane, numbers: Numbers) -> tuple[ca.SX, ca.SX] | None:
    """Return attitude and rate of the wind-biased programme, where the vehicle flies it."""
    if PROGRAMME not in numbers.tables or (plane.name == "yaw" and numbers.roll is None):
        return None
    told = numbers.tables[PROGRAMME], numbers.tables[f"{PROGRAMME}_rate"]
    attitude, rate = (_in_body(plane, numbers, of_pitch, ca.SX(0)) * numbers.undisturbed for of_pitch in told)
    return attitude, rate


def _own_angle(plane: Plane, numbers: Numbers) -> ca.SX:
    """Return the angle of attack of the flight without wind itself, rad, where the vehicle's options take it in."""
    if not plane.vehicle.file.options.trajectory_angle_of_attack:
        return ca.SX(0)
    pitch, yaw = (
        numbers.tables[column.name] if column.name in numbers.tables else ca.SX(0) for column in OWN_ANGLE.values()
    )
    return _in_body(plane, numbers, pitch, yaw) * numbers.undisturbed


def _with_rates(blocks: Sequence[Block], rates: ca.SX, prefix: str) -> list[Block]:
    found, first = [], 0
    for block in blocks:
        last = first + block.symbols.numel()
        found.append(Block(block.states, block.symbols, rates[first:last]).named(prefix))
        first = last
    return found


def _named(plane: Plane, label: Output) -> Output:
    """Return an output under its name in the system: what lies along the axis belongs to no plane."""
    along = {load_name(load.output, AXIAL_FORCE) for load in plane.vehicle.file.loads}
    if not plane.prefix or label.name in along:
        return label
    return replace(label, name=plane.prefix + label.name, symbol=f"{label.symbol}, {plane.name}")


def _rigid_body(motion: Motion, solved: Accelerations) -> tuple[Block, ...]:
    return (
        Block.of("lateral_velocity", motion.lateral_velocity, solved.lateral, "m/s", SCALES["lateral_velocity"]),
        Block.of("attitude", motion.attitude, motion.attitude_rate, "rad", SCALES["angle"]),
        Block.of("attitude_rate", motion.attitude_rate, solved.rotation, "rad/s", SCALES["angle"]),
    )


def _bending(motion: Motion, solved: Accelerations) -> tuple[Block, ...]:
    return (
        Block.numbered("bending", motion.eta, motion.eta_rate, "m", SCALES["bending"]),
        Block.numbered("bending_rate", motion.eta_rate, solved.bending, "m/s", SCALES["bending_rate"]),
    )


def _slosh(motion: Motion, solved: Accelerations, tanks: Sequence[str]) -> tuple[Block, ...]:
    names, rates = ([f"{kind}_{tank}" for tank in tanks] for kind in ("slosh", "slosh_rate"))
    return (
        Block.of("slosh", motion.xi, motion.xi_rate, "m", SCALES["slosh"], names),
        Block.of("slosh_rate", motion.xi_rate, solved.slosh, "m/s", SCALES["slosh_rate"], rates),
    )


def _position(plane: Plane, motion: Motion) -> tuple[Block, ...]:
    """Return the lateral position, a state where it is an output."""
    if "lateral_drift" not in plane.vehicle.file.options.extra_outputs:
        return ()
    scale = SCALES["lateral_position"]
    return (Block.of("lateral_position", motion.lateral_position, motion.lateral_velocity, "m", scale),)
