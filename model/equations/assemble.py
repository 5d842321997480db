"""Puts the blocks together: vehicle, control, bending, slosh, wind filter and noise as one linear system."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import casadi as ca
import numpy as np

from ..system.labels import Noise, State, block_of
from ..system.linear_system import LinearSystem
from ..system.names import TURBULENCE, UNDISTURBED, WIND
from ..vehicle.biases import WIND_BIAS, check_biases
from ..vehicle.vehicle import Vehicle
from . import rigid_body
from .block import Block
from .control_law import control_law
from .coupling import Accelerations
from .deviations import Undeviated, deviated
from .forces import Handles, solved_motion
from .motion import Motion
from .noise import NoiseProcess, deviation_block
from .outputs import outputs
from .structure import structure_in_words
from .turbulence import start_covariance, turbulence_block
from .typical_sizes import SCALES
from .vehicle_numbers import Numbers
from .wind import WindBlock, wind_block


def assemble(vehicle: Vehicle, wind_start_covariance: np.ndarray) -> LinearSystem:
    """Return the linear system of a vehicle in its wind.

    Parameters
    ----------
    vehicle : Vehicle
    wind_start_covariance : (n, n) array
        Covariance of the wind filter's states at the altitude where the flight starts.

    Raises
    ------
    DataError
        If a noise source deviates a table that the mean response cannot carry, or a bias has nothing to act on.
    """
    check_biases(vehicle)
    numbers = Numbers.of(vehicle)
    motion, tables, deviations = Motion.of(numbers.modes, numbers.tanks), numbers.tables, numbers.deviations
    mean_wind, handles = ca.SX.sym("mean_wind"), Handles.new()
    winds, start = _winds(vehicle, numbers), {WIND: ca.SX(ca.DM(wind_start_covariance))}
    if vehicle.turbulence and numbers.turbulence:
        start[TURBULENCE] = start_covariance(vehicle.turbulence, numbers.turbulence)
    solved = solved_motion(vehicle, numbers, motion, handles)
    control = control_law(numbers, motion, solved)
    expected = numbers.mean_scale * tables["wind.mean"]
    met = sum((part.wind for part in winds.values()), ca.SX(0)) + mean_wind
    if WIND_BIAS in deviations:
        met += deviations[WIND_BIAS].deviation * expected
    alpha = rigid_body.angle_of_attack(tables, motion.attitude, motion.lateral_velocity, met)
    blocks = [
        *_rigid_body(motion, solved),
        *control.blocks,
        *_bending(motion, solved),
        *_slosh(motion, solved, numbers.tanks),
        *(Block.numbered(source, part.states, part.derivative) for source, part in winds.items()),
        *(deviation_block(name, process) for name, process in deviations.items()),
        *_position(vehicle, motion),
    ]
    responses = outputs(vehicle, numbers, motion, solved, handles)
    states = tuple(state for block in blocks for state in block.states)
    x = ca.vertcat(*(block.symbols for block in blocks))
    equations = Undeviated(
        x,
        rates=ca.vertcat(*(block.rates for block in blocks)),
        outputs=ca.vertcat(*(value for _, value in responses)),
        angles=ca.vertcat(alpha, control.engine_angle),
        responses=tuple(label.name for label, _ in responses),
        handles=handles,
    )
    derivative, output = deviated(vehicle, numbers, motion, equations)
    has_axial = any(load.axial for load in vehicle.file.loads)
    return LinearSystem(
        name=vehicle.name,
        time=numbers.time,
        x=x,
        w=ca.vertcat(*(part.white for part in winds.values()), *(process.white for process in deviations.values())),
        u=ca.vertcat(mean_wind, numbers.undisturbed) if has_axial else mean_wind,
        p=numbers.parameters.vector,
        v=tables.vector,
        derivative=derivative,
        output=output,
        states=states,
        noises=_white_noises(winds, deviations),
        outputs=tuple(label for label, _ in responses),
        parameters=tuple(numbers.parameters.parameters),
        input_names=(WIND, UNDISTURBED) if has_axial else (WIND,),
        input_values=ca.vertcat(expected, 1) if has_axial else expected,
        tables=numbers.groups,
        start_covariance=_start_covariance(states, start, deviations),
        discontinuities=vehicle.discontinuities,
        start=vehicle.start,
        end=vehicle.end,
        coupling_matrix=solved.matrix,
        structure=structure_in_words(vehicle, len(states), numbers.groups),
    )


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


def _position(vehicle: Vehicle, motion: Motion) -> tuple[Block, ...]:
    """Return the lateral position, a state where it is an output."""
    if "lateral_drift" not in vehicle.file.options.extra_outputs:
        return ()
    scale = SCALES["lateral_position"]
    return (Block.of("lateral_position", motion.lateral_position, motion.lateral_velocity, "m", scale),)


def _winds(vehicle: Vehicle, numbers: Numbers) -> dict[str, WindBlock]:
    """Return what is random in the wind that is met, by source."""
    tables, rate = numbers.tables, numbers.tables["altitude_rate"]
    found = {WIND: wind_block(vehicle.wind.shaping_filter, tables, rate, numbers.sigma_scale)}
    if vehicle.turbulence and numbers.turbulence:
        driver = found[WIND].white[0]
        found[TURBULENCE] = turbulence_block(vehicle.turbulence, numbers.turbulence, tables, rate, driver)
    return found


def _white_noises(winds: Mapping[str, WindBlock], deviations: Iterable[str]) -> tuple[Noise, ...]:
    of_winds = (Noise(f"{source}_{i + 1}", source) for source, part in winds.items() for i in range(part.white.numel()))
    return (*of_winds, *(Noise(name, name) for name in deviations))


def _start_covariance(
    states: Sequence[State], winds: Mapping[str, ca.SX], deviations: dict[str, NoiseProcess]
) -> dict[str, ca.SX | np.ndarray]:
    """Return the covariance at the start by source: of the winds' states as given, of a deviation one."""
    found: dict[str, ca.SX | np.ndarray] = {}
    for source, given in winds.items():
        whole, rows = ca.SX(len(states), len(states)), block_of(states, source)
        whole[rows, rows] = given
        found[source] = np.array(ca.evalf(whole)) if whole.is_constant() else whole
    for name, process in deviations.items():
        found[name] = np.zeros((len(states), len(states)))
        for state in deviation_block(name, process).states:
            row = states.index(state)
            found[name][row, row] = 1.0
    return found
