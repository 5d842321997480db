"""Puts the blocks together: vehicle, control, bending, slosh, wind filter and noise as one linear system."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import casadi as ca
import numpy as np

from ..errors import DataError
from ..system.labels import Noise, Output, State
from ..system.linear_system import LinearSystem
from ..system.symbols import ParameterSymbols, TableSymbols
from ..tables import TableGroup
from ..vehicle.columns import MOVED_MODE
from ..vehicle.noise_loads import CENTER_OF_PRESSURE, loading_noises, needed_columns
from ..vehicle.vehicle import Vehicle
from . import bending, load_relief, rigid_body, slosh
from .control import TransferFunction, transfer_function, transfer_function_symbols
from .coupling import accelerations
from .load_components import load_components
from .loads import bending_moment, slosh_reaction, typical_moment
from .local_aerodynamics import local_bending_moment, local_forces
from .noise import NoiseProcess, noise_process
from .noise_loads import moved_modal_force, noise_load
from .wind import wind_block

# tables of the mean response, all in rad, and the output or state that each holds
MEAN_TABLES = {
    "mean.angle_of_attack": ("output", "angle_of_attack"),
    "mean.engine_angle": ("output", "engine_angle"),
    "mean.attitude": ("state", "attitude"),
}
MEAN_SPACING = 0.05  # s, of the tables of the mean response

# Typical sizes: they only weigh the integrators' errors against each other.
SCALES = {
    "lateral_velocity": 10.0,
    "lateral_position": 100.0,
    "angle": 0.02,
    "bending": 0.1,
    "bending_rate": 0.5,
    "slosh": 0.5,
    "slosh_rate": 1.0,
    "dynamic_pressure_times_angle_of_attack": 1e3,
    "bending_acceleration": 3.0,
    "slosh_acceleration": 3.0,
    "relative_deviation": 0.01,
}


def vehicle_tables(vehicle: Vehicle) -> tuple[TableGroup, ...]:
    """Return the table groups of a vehicle: over time, over altitude, and the mean response (zero until computed)."""
    polynomials = [(t.name, t.unit, t.polynomial) for t in vehicle.tables.values()]
    polynomials.append(("altitude_rate", "m/s", vehicle.tables["altitude"].polynomial.derivative()))
    flight = TableGroup.from_polynomials("flight", "time", polynomials, vehicle.start, vehicle.end)
    wind, mean = vehicle.wind.shaping_filter, vehicle.wind.mean
    over_altitude = [(t.name, t.unit, t.polynomial) for t in (mean, *wind.tables())]
    bottom = min(float(wind.altitude[0]), float(mean.argument[0]))
    top = max(float(wind.altitude[-1]), float(mean.argument[-1]))
    wind_group = TableGroup.from_polynomials("wind", "altitude", over_altitude, bottom, top)
    knots = mean_knots(vehicle.start, vehicle.end, vehicle.discontinuities)
    zero = np.zeros((knots.size - 1, 4, len(MEAN_TABLES)))
    mean_group = TableGroup("mean", "time", tuple(MEAN_TABLES), ("rad",) * len(MEAN_TABLES), knots, zero)
    return flight, wind_group, mean_group


def mean_knots(start: float, end: float, discontinuities: Sequence[float]) -> np.ndarray:
    """Return the times (s) at which the mean response is tabulated, discontinuities among them."""
    edges = [start, *discontinuities, end]
    pieces = [
        np.linspace(low, high, max(4, int(np.ceil((high - low) / MEAN_SPACING))) + 1)[:-1]
        for low, high in pairwise(edges)
    ]
    return np.append(np.concatenate(pieces), end)


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
        If a noise source deviates a table that the mean response cannot carry.
    """
    options, tanks, modes = vehicle.file.options, [t.name for t in vehicle.slosh], len(vehicle.bending)
    groups = vehicle_tables(vehicle)
    tables = TableSymbols(tuple(name for group in groups for name in group.names))
    parameters = ParameterSymbols()
    area = parameters.add("reference_area", vehicle.file.reference_area_m2, "m2", "reference area A")
    networks = {n: transfer_function_symbols(n, e, parameters) for n, e in vehicle.transfer_functions.items()}
    bending_damping = ca.vertcat(
        ca.SX(0, 1),
        *(
            parameters.add(f"bending.{i}.damping", m.damping, "1", f"damping ratio of bending mode {i}")
            for i, m in enumerate(vehicle.bending, start=1)
        ),
    )
    slosh_damping = ca.vertcat(
        ca.SX(0, 1),
        *(
            parameters.add(f"slosh.{t.name}.damping", t.damping, "1", f"damping ratio of slosh in {t.name}")
            for t in vehicle.slosh
        ),
    )
    noises = {n: noise_process(n, e, parameters) for n, e in vehicle.noise.items()}
    sigma_scale = parameters.add("wind.sigma_scale", 1.0, "1", "factor on the wind's standard deviation")
    mean_scale = parameters.add("wind.mean_scale", 1.0, "1", "factor on the mean wind")
    sensors = load_relief.sensor_symbols(vehicle.file.control.load_relief, modes, tables, parameters)

    lateral_velocity, attitude, attitude_rate = (
        ca.SX.sym(n) for n in ("lateral_velocity", "attitude", "attitude_rate")
    )
    eta, eta_rate = ca.SX.sym("eta", modes), ca.SX.sym("eta_rate", modes)
    xi, xi_rate = ca.SX.sym("xi", len(tanks)), ca.SX.sym("xi_rate", len(tanks))
    mean_wind = ca.SX.sym("mean_wind")
    wind = wind_block(vehicle.wind.shaping_filter, tables, sigma_scale)

    sensor_slopes = bending.mode_column(tables, modes, "slope_at_sensor")
    measured = attitude + sensor_slopes.T @ eta
    measured_rate = attitude_rate + sensor_slopes.T @ eta_rate
    T1 = transfer_function("T1", *networks["T1"], measured)
    T2 = transfer_function("T2", *networks["T2"], measured_rate)
    alpha_of_state = rigid_body.angle_of_attack(tables, attitude, lateral_velocity, wind.wind + mean_wind)
    alpha, beta = ca.SX.sym("alpha"), ca.SX.sym("beta")
    slopes = bending.slopes(tables, modes, tanks)
    moment = rigid_body.yaw_moment(tables, area, alpha, beta)
    slosh_mass = slosh.tank_column(tables, tanks, "mass")
    if options.full_coupling:
        moment += tables["axial_acceleration"] * ca.sum1(slosh_mass * xi)
    force = rigid_body.lateral_force(tables, area, alpha, beta, attitude)
    modal_force = bending.generalized_force(tables, area, bending_damping, eta, eta_rate, alpha, beta)
    moved = ca.SX.sym("moved")  # m that the normal force moves forward, a deviation: zero in the equations
    if MOVED_MODE in needed_columns(vehicle.file)[1]:
        modal_force += moved_modal_force(tables, area, modes, alpha) * moved
    if options.local_angle_of_attack:
        local = local_forces(tables, area, attitude_rate, eta, eta_rate)
        force, moment, modal_force = force + local.force, moment + local.moment, modal_force + local.modal
    solved = accelerations(
        mass=tables["mass"],
        inertia=tables["moment_of_inertia"],
        modal_mass=bending.mode_column(tables, modes, "generalized_mass"),
        slosh_mass=slosh_mass,
        arms=slosh.attach_arms(tables, tanks),
        displacements=bending.displacements(tables, modes, tanks),
        force=force,
        moment=moment,
        modal_force=modal_force + slosh.slosh_stiffness_force(tables, tanks, slopes, xi),
        slosh_forcing=slosh.slosh_forcing(tables, tanks, slosh_damping, xi, xi_rate, attitude, eta, slopes),
        full=options.full_coupling,
    )
    signals = {}
    if "accelerometer" in sensors:
        signals["accelerometer"] = load_relief.sensed_acceleration(
            tables, sensors["accelerometer"], solved, attitude, eta
        )
    if "angle_of_attack" in sensors:
        signals["angle_of_attack"] = load_relief.sensed_angle_of_attack(
            tables, sensors["angle_of_attack"], alpha, attitude_rate, eta, eta_rate
        )
    relief = {name: sensors[name].feedback(name, signal) for name, signal in signals.items()}
    attitude_factor, rate_factor = tables["control.attitude_factor"], tables["control.rate_factor"]
    command = attitude_factor * T1.output + rate_factor * T2.output
    T3 = transfer_function("T3", *networks["T3"], sum((F.output for F in relief.values()), command))
    beta_of_state = T3.output + bending.mode_column(tables, modes, "slope_at_gimbal").T @ eta
    blocks = [
        (lateral_velocity, solved.lateral, [State("lateral_velocity", "m/s", SCALES["lateral_velocity"])]),
        (attitude, attitude_rate, [State("attitude", "rad", SCALES["angle"])]),
        (attitude_rate, solved.rotation, [State("attitude_rate", "rad/s", SCALES["angle"])]),
        *((T.states, T.derivative, _filter_states(name, T)) for name, T in (("T1", T1), ("T2", T2), ("T3", T3))),
        *((F.states, F.derivative, load_relief.filter_states(name, F)) for name, F in relief.items()),
        (eta, eta_rate, _numbered("bending", modes, "m", SCALES["bending"])),
        (eta_rate, solved.bending, _numbered("bending_rate", modes, "m/s", SCALES["bending_rate"])),
        (xi, xi_rate, [State(f"slosh_{t}", "m", SCALES["slosh"]) for t in tanks]),
        (xi_rate, solved.slosh, [State(f"slosh_rate_{t}", "m/s", SCALES["slosh_rate"]) for t in tanks]),
        (wind.states, wind.derivative, _numbered("wind", wind.states.numel(), "1", 1.0)),
        *((p.state, p.derivative, [State(f"deviation_{n}")] * p.state.numel()) for n, p in noises.items()),
    ]
    loading = loading_noises(vehicle.file)
    outputs: list[tuple[Output, ca.SX]] = []
    for load in vehicle.file.loads:
        value = bending_moment(tables, load.output, tanks, alpha, beta, solved.bending, solved.slosh)
        if options.local_angle_of_attack:
            value += local_bending_moment(tables, load.output, attitude_rate, eta, eta_rate)
        if options.slosh_reaction:
            assert load.forward_of_gimbal_m is not None  # checked by load_vehicle
            value += slosh_reaction(tables, load.output, tanks, load.forward_of_gimbal_m, xi, solved.slosh)
        scale = typical_moment(vehicle.tables[f"loads.{load.output}.angle_of_attack"])
        output = Output(load.output, "N m", scale, f"B.M. at station {load.station_m:g} m")
        outputs.append((output, value))
    outputs.append((Output("angle_of_attack", "rad", SCALES["angle"], "alpha"), alpha))
    outputs.append((Output("engine_angle", "rad", SCALES["angle"], "beta"), beta))
    for extra in dict.fromkeys(options.extra_outputs):
        if extra == "lateral_drift":
            drift = ca.SX.sym("lateral_position")
            blocks.append((drift, lateral_velocity, [State("lateral_position", "m", SCALES["lateral_position"])]))
            outputs.append((Output(extra, "m", SCALES["lateral_position"], "Y"), drift))
        elif extra == "drift_rate":
            outputs.append((Output(extra, "m/s", SCALES["lateral_velocity"], "Y'"), lateral_velocity))
        elif extra == "load_components":
            deviations = {n: noises[n].deviation for n in loading}
            outputs += load_components(
                tanks, SCALES, attitude_rate, eta, eta_rate, solved.bending, xi, solved.slosh, deviations
            )
        else:
            q_alpha = tables["dynamic_pressure"] * alpha
            outputs.append((Output(extra, "Pa rad", SCALES[extra], "q alpha"), q_alpha))

    x = ca.vertcat(*(b[0] for b in blocks))
    derivative = ca.vertcat(*(b[1] for b in blocks))
    output = ca.vertcat(*(o[1] for o in outputs))
    states = tuple(s for b in blocks for s in b[2])
    both = ca.vertcat(derivative, output)
    for name, process in noises.items():
        direct = ca.SX.zeros(both.numel())
        for k, load in enumerate(vehicle.file.loads):  # the first outputs
            coefficients = tables.under(f"loads.{load.output}.")
            direct[x.numel() + k] = noise_load(
                loading.get(name, ()), options.noise_loads, coefficients, tables, area, alpha, beta
            )
        column = _deviation_column(
            vehicle,
            name,
            direct,
            both,
            moved,
            tables,
            x,
            attitude,
            alpha,
            beta,
            ca.vertcat(alpha_of_state, beta_of_state),
        )
        derivative += column[: x.numel()] * process.deviation
        output += column[x.numel() :] * process.deviation
    derivative, output = ca.substitute(
        [derivative, output], [ca.vertcat(alpha, beta, moved)], [ca.vertcat(alpha_of_state, beta_of_state, 0)]
    )
    noise_inputs = [Noise(f"wind_{i + 1}", "wind") for i in range(wind.white.numel())]
    noise_inputs += [Noise(n, n) for n in noises]
    return LinearSystem(
        name=vehicle.name,
        time=ca.SX.sym("t"),
        x=x,
        w=ca.vertcat(wind.white, *(p.white for p in noises.values())),
        u=mean_wind,
        p=parameters.vector,
        v=tables.vector,
        derivative=derivative,
        output=output,
        states=states,
        noises=tuple(noise_inputs),
        outputs=tuple(o[0] for o in outputs),
        parameters=tuple(parameters.parameters),
        input_names=("wind",),
        input_values=mean_scale * tables["wind.mean"],
        tables=groups,
        start_covariance=_start_covariance(states, wind_start_covariance, noises),
        discontinuities=vehicle.discontinuities,
        start=vehicle.start,
        end=vehicle.end,
        coupling_matrix=solved.matrix,
        structure=_structure(vehicle, states, groups),
    )


def _filter_states(name: str, T: TransferFunction) -> list[State]:
    return _numbered(name, T.states.numel(), "rad", SCALES["angle"])


def _numbered(name: str, count: int, unit: str, scale: float) -> list[State]:
    return [State(f"{name}_{i + 1}", unit, scale) for i in range(count)]


def _deviation_column(
    vehicle: Vehicle,
    name: str,
    direct: ca.SX,
    both: ca.SX,
    moved: ca.SX,
    tables: TableSymbols,
    x: ca.SX,
    attitude: ca.SX,
    alpha: ca.SX,
    beta: ca.SX,
    alpha_beta_of_state: ca.SX,
) -> ca.SX:
    """Return d(derivative, output)/d ln(factor on the tables) at the mean response.

    ``direct`` is what the tables put into the outputs by coefficients that follow them, ``moved`` how far the normal
    force moves with its centre.
    """
    file, key, deviating = vehicle.folder / "vehicle.toml", f"noise.{name}.tables", vehicle.noise[name].tables
    column = direct
    for table in deviating:
        symbol = tables[table]
        if ca.depends_on(alpha_beta_of_state, symbol):
            raise DataError(
                f"'{table}' changes the angle of attack or engine angle itself and cannot deviate as noise; "
                "choose a table of forces, masses or arms",
                file=file,
                column=key,
            )
        column += ca.jtimes(both, symbol, symbol)
        if table == CENTER_OF_PRESSURE:
            column += ca.jtimes(both, moved, symbol)
    if column.is_zero():
        raise DataError(f"deviations of {', '.join(deviating)} change nothing in the equations", file=file, column=key)
    means = [tables[n] for n in MEAN_TABLES]
    column = ca.substitute(column, ca.vertcat(alpha, beta, attitude, moved), ca.vertcat(*means, 0))
    if ca.depends_on(column, x):
        raise DataError(
            f"deviations of {', '.join(deviating)} act on more than the mean angle of attack, engine angle and "
            "attitude; choose a table of forces or arms",
            file=file,
            column=key,
        )
    return column


def _start_covariance(
    states: Sequence[State], wind: np.ndarray, noises: dict[str, NoiseProcess]
) -> dict[str, np.ndarray]:
    names = [s.name for s in states]
    first = names.index("wind_1")
    matrices = {"wind": np.zeros((len(names), len(names)))}
    matrices["wind"][first : first + wind.shape[0], first : first + wind.shape[0]] = wind
    for name, process in noises.items():
        matrices[name] = np.zeros((len(names), len(names)))
        if process.state.numel():
            i = names.index(f"deviation_{name}")
            matrices[name][i, i] = 1.0
    return matrices


def _structure(vehicle: Vehicle, states: Sequence[State], groups: Sequence[TableGroup]) -> dict[str, str]:
    orders = (f"{n} {len(e.denominator) - 1}" for n, e in vehicle.transfer_functions.items())
    relief = ", ".join(
        f"{n} of order {len(e.filter.denominator) - 1}" for n, e in vehicle.file.control.load_relief.items()
    )
    return {
        **({"load relief": relief} if relief else {}),
        "bending modes": str(len(vehicle.bending)),
        "slosh tanks": ", ".join(t.name for t in vehicle.slosh) or "none",
        "transfer function orders": ", ".join(orders),
        "wind filter": f"order {vehicle.wind.shaping_filter.order}, {vehicle.wind.shaping_filter.noise_count} noises",
        "noise sources": ", ".join(f"{n} ({'white' if e.white else 'coloured'})" for n, e in vehicle.noise.items()),
        "loads": ", ".join(load.output for load in vehicle.file.loads),
        "extra outputs": ", ".join(vehicle.file.options.extra_outputs) or "none",
        "full coupling": str(vehicle.file.options.full_coupling).lower(),
        **({"local angle of attack": "true"} if vehicle.file.options.local_angle_of_attack else {}),
        **({"slosh reaction": "true"} if vehicle.file.options.slosh_reaction else {}),
        **({"noise loads": vehicle.file.options.noise_loads} if vehicle.noise and vehicle.file.loads else {}),
        "states": str(len(states)),
        "table lengths": ", ".join(f"{g.name} {len(g.names)} x {g.knots.size}" for g in groups),
    }
