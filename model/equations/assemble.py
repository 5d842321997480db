"""Puts the planes of a vehicle together with the wind filter and the deviations as one linear system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from ..system.labels import Noise, Output, State, block_of
from ..system.linear_system import LinearSystem
from ..system.names import TURBULENCE, UNDISTURBED, WIND
from ..vehicle.biases import check_biases
from ..vehicle.columns import PRODUCT_OF_INERTIA
from ..vehicle.planes import flown_planes
from ..vehicle.vehicle import Vehicle
from ..wind.record import COMPONENTS
from .block import Block
from .coupled_planes import coupled
from .noise import NoiseProcess, deviation_block
from .plane import PlaneEquations, Winds, plane_equations
from .structure import structure_in_words
from .turbulence import start_covariance, turbulence_block
from .vehicle_numbers import Numbers, Shared
from .vehicle_tables import met_altitude_name
from .wind import WindBlock, wind_block


def assemble(vehicle: Vehicle, wind_start_covariance: np.ndarray) -> LinearSystem:
    """Return the linear system of a vehicle in its wind.

    In both planes it is the equations of each, one after the other, which meet in the wind filter, in the deviations
    that they have in common, and in a product of inertia.

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
    shared, planes = Shared.of(vehicle), flown_planes(vehicle)
    numbers = [Numbers.of(plane, shared) for plane in planes]
    names, tables = _input_names(len(planes)), shared.tables
    met = _winds(vehicle, numbers)
    turbulence = met[TURBULENCE].winds if TURBULENCE in met else (ca.SX(0),) * len(planes)
    winds = Winds(
        met[WIND].winds,
        tuple(ca.SX.sym(f"mean_{name}") for name in names),
        tuple(numbers[0].mean_scale * tables[f"wind.mean{name.removeprefix(WIND)}"] for name in names),
    )
    parts = [plane_equations(*of_plane, winds) for of_plane in zip(planes, numbers, turbulence, strict=True)]
    matrices = [part.matrix for part in parts]
    if PRODUCT_OF_INERTIA.name in tables:
        parts, determinant = coupled(parts[0], parts[1], tables[PRODUCT_OF_INERTIA.name])
        matrices.append(determinant)
    processes = shared.processes
    blocks = [
        *(block for part in parts for block in part.blocks),
        *(Block.numbered(source, part.states, part.derivative) for source, part in met.items()),
        *(deviation_block(name, process) for name, (_, process) in processes.items()),
        *(block for part in parts for block in part.positions),
    ]
    states = tuple(state for block in blocks for state in block.states)
    labels, output = _outputs(parts)
    expected = ca.vertcat(*winds.expected)
    known = any(
        ca.depends_on(ca.vertcat(part.output, *(b.rates for b in part.blocks)), shared.undisturbed) for part in parts
    )
    return LinearSystem(
        name=vehicle.name,
        time=shared.time,
        x=ca.vertcat(*(block.symbols for block in blocks)),
        w=ca.vertcat(*(part.white for part in met.values()), *(process.white for _, process in processes.values())),
        u=ca.vertcat(*winds.mean, shared.undisturbed) if known else ca.vertcat(*winds.mean),
        p=shared.parameters.vector,
        v=tables.vector,
        derivative=ca.vertcat(*(block.rates for block in blocks)),
        output=output,
        states=states,
        noises=_white_noises(met, processes),
        outputs=labels,
        parameters=tuple(shared.parameters.parameters),
        input_names=(*names, UNDISTURBED) if known else names,
        input_values=ca.vertcat(expected, 1) if known else expected,
        tables=shared.groups,
        start_covariance=_start_covariance(states, _of_winds(vehicle, numbers, wind_start_covariance), processes),
        discontinuities=vehicle.discontinuities,
        start=vehicle.start,
        end=vehicle.end,
        coupling_matrix=ca.diagcat(*matrices),
        structure=structure_in_words(vehicle, len(states), shared.groups),
    )


def _input_names(planes: int) -> tuple[str, ...]:
    return (WIND,) if planes == 1 else tuple(f"{WIND}_{component}" for component in COMPONENTS)


def _outputs(parts: Sequence[PlaneEquations]) -> tuple[tuple[Output, ...], ca.SX]:
    """Return the outputs of all planes; what belongs to none, as a force along the axis, stands once."""
    found: dict[Output, ca.SX] = {}
    for part in parts:
        for i, label in enumerate(part.labels):
            found.setdefault(label, part.output[i])
    return tuple(found), ca.vertcat(*found.values())


def _winds(vehicle: Vehicle, numbers: Sequence[Numbers]) -> dict[str, WindBlock]:
    """Return what is random in the wind that is met, by source; turbulence has a wind of its own for each plane."""
    one = numbers[0]
    rate = one.tables[f"{met_altitude_name(vehicle)}_rate"]
    found = {WIND: wind_block(vehicle.wind, one.tables, rate, one.sigma_scale)}
    if vehicle.turbulence and one.turbulence:
        driver = found[WIND].white[0]
        parts = [turbulence_block(vehicle.turbulence, one.turbulence, one.tables, rate, driver) for _ in numbers]
        states, derivative, white = (
            ca.vertcat(*(getattr(part, name) for part in parts)) for name in ("states", "derivative", "white")
        )
        found[TURBULENCE] = WindBlock(states, derivative, white, tuple(part.winds[0] for part in parts))
    return found


def _of_winds(vehicle: Vehicle, numbers: Sequence[Numbers], wind: np.ndarray) -> dict[str, ca.SX]:
    """Return the covariance of the winds' states at the start, by source."""
    found = {WIND: ca.SX(ca.DM(wind))}
    turbulence = numbers[0].turbulence
    if vehicle.turbulence and turbulence:
        found[TURBULENCE] = ca.diagcat(*(start_covariance(vehicle.turbulence, turbulence) for _ in numbers))
    return found


def _white_noises(
    winds: Mapping[str, WindBlock], processes: Mapping[str, tuple[str, NoiseProcess]]
) -> tuple[Noise, ...]:
    of_winds = (Noise(f"{source}_{i + 1}", source) for source, part in winds.items() for i in range(part.white.numel()))
    return (*of_winds, *(Noise(name, source) for name, (source, _) in processes.items()))


def _start_covariance(
    states: Sequence[State], winds: Mapping[str, ca.SX], processes: Mapping[str, tuple[str, NoiseProcess]]
) -> dict[str, ca.SX | np.ndarray]:
    """Return the covariance at the start by source: of the winds' states as given, of a deviation one."""
    found: dict[str, ca.SX | np.ndarray] = {}
    for source, given in winds.items():
        whole, rows = ca.SX(len(states), len(states)), block_of(states, source)
        whole[rows, rows] = given
        found[source] = np.array(ca.evalf(whole)) if whole.is_constant() else whole
    for source in dict.fromkeys(source for source, _ in processes.values()):
        ones = np.zeros(len(states))
        for name, (of, process) in processes.items():
            for state in deviation_block(name, process).states if of == source else ():
                ones[states.index(state)] = 1.0
        found[source] = np.diag(ones)
    return found
