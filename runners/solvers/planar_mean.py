"""The mean response in the mean wind from the nonlinear planar equations, beside its linearisation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import INPUTS, OUTPUTS, spline_lookup
from ...model.construction.planar_equations import PlanarLoop, planar_loop
from ...model.equations.vehicle_tables import mean_knots
from ...model.errors import DataError
from ...model.vehicle.vehicle import Vehicle
from .integration import CvodesSettings, Integrator
from .mean_response import equidistant, mean_splines
from .time_nodes import intervals

TOLERANCE = 1e-9
LARGEST_ANGLE = np.deg2rad(45.0)  # beyond, a constant normal-force slope means nothing
PIECE = 20  # points of the mean tables, about a second
RESPONSES = ("angle_of_attack", "engine_angle", "attitude")


@dataclass(frozen=True, eq=False)
class PlanarMean:
    """Mean response of the rigid, controlled vehicle (rad).

    Attributes
    ----------
    times : (k,) array
        s.
    nonlinear, linear : (k, 3) arrays
        Angle of attack, engine angle and attitude of the nonlinear equations and of their linearisation about the
        flight without wind.
    states : (k, n) array
        Of the nonlinear equations, in the order of ``PlanarLoop.states``.
    """

    times: NDArray[np.float64]
    nonlinear: NDArray[np.float64]
    linear: NDArray[np.float64]
    states: NDArray[np.float64]


def planar_mean(vehicle: Vehicle, executable: ExecutableSystem) -> PlanarMean:
    """Fly the yaw plane through the mean wind from the start of the model, at rest, at the times of the mean tables.

    Parameters
    ----------
    vehicle : Vehicle
    executable : ExecutableSystem
        The assembled vehicle: its tables, parameters and discontinuities.

    Raises
    ------
    DataError
        The angle of attack or the attitude grows beyond 45 degrees; names the time.
    IntegrationError
    """
    loop = vehicle_loop(vehicle, executable)
    system, n = executable.system, loop.states.numel()
    scale = np.tile(np.concatenate([[1e3, 10.0], np.full(n - 2, 0.02)]), 2)
    flight = _rate(loop, executable, scale)
    integrator = Integrator(flight.integrand, CvodesSettings(relative_tolerance=TOLERANCE))
    knots = mean_knots(system.start, system.end, system.discontinuities)
    start = flight.start(system.start).full().ravel()
    times, states, responses = [knots[:1]], [start[None]], [flight.outputs(system.start, start).full().T]
    for interval in intervals(executable, system.start, system.end, pulses=False):
        inside = knots[(knots > interval.begin) & (knots <= interval.end)]
        # piece by piece, so that a flight that diverges is told before it tumbles
        runs = np.cumsum([points for _, _, points in equidistant(interval, inside)]).tolist()
        cuts = {cut for cut in (*runs, *range(PIECE, inside.size, PIECE)) if cut < inside.size}
        for piece in np.split(inside, sorted(cuts)):
            begin = times[-1][-1]
            parameters = np.array([begin, piece[-1] - begin, interval.low, interval.high])
            where = f"of the nonlinear mean response from {begin:g} s to {piece[-1]:g} s"
            found, _, _ = integrator.run(states[-1][-1] / scale, parameters, where, piece.size)
            times.append(piece)
            states.append((found * scale[:, None]).T)
            responses.append(flight.outputs.map(piece.size)(np.minimum(piece, interval.high), states[-1].T).full().T)
            _check_angles(piece, responses[-1][:, :3])
    t, x, both = (np.concatenate(parts) for parts in (times, states, responses))
    return PlanarMean(t, both[:, :3], both[:, 3:], x[:, :n])


def vehicle_loop(vehicle: Vehicle, executable: ExecutableSystem) -> PlanarLoop:
    """Return the planar equations of a vehicle with the tables of its assembled system."""
    names = tuple(name for group in executable.groups for name in group.names)
    return planar_loop(names, vehicle.transfer_functions, vehicle.file.reference_area_m2)


@dataclass(frozen=True, eq=False)
class _FlightFunctions:
    """Integrand over pseudo-time; states at the start; outputs of (time, states)."""

    integrand: ca.Function
    start: ca.Function
    outputs: ca.Function


def loop_function(loop: PlanarLoop, executable: ExecutableSystem) -> ca.Function:
    """Return (time, states) -> derivative, outputs, both nonlinear, then both linearised, states on the flight."""
    values = dict(zip(executable.system.parameter_names, executable.parameters, strict=True))
    p = [values[parameter.name] for parameter in loop.parameters.parameters]
    linear = loop.linearised()
    inputs = [loop.states, loop.tables.vector, loop.flight_acceleration, loop.wind, loop.parameters.vector]
    core = ca.Function("planar", inputs, [loop.derivative, loop.outputs, *linear, loop.flight])
    time, states = ca.MX.sym("time"), ca.MX.sym("states", loop.states.numel())
    names = [name for group in executable.groups for name in group.names]
    tables = spline_lookup(executable.groups, time)
    acceleration = ca.jacobian(tables[names.index("relative_velocity")], time)
    wind = values["wind.mean_scale"] * tables[names.index("wind.mean")]
    found = core(states, tables, acceleration, wind, ca.DM(p))
    return ca.Function("planar_flight", [time, states], list(found))


def _rate(loop: PlanarLoop, executable: ExecutableSystem, scale: NDArray[np.float64]) -> _FlightFunctions:
    function, n = loop_function(loop, executable), loop.states.numel()
    s, x, p = ca.MX.sym("t"), ca.MX.sym("x", 2 * n), ca.MX.sym("p", 4)
    z, u = ca.MX.sym("z", 0), ca.MX.sym("u", 0)
    time = ca.fmin(ca.fmax(p[0] + p[1] * s, p[2]), p[3])
    nonlinear = function(time, (x * scale)[:n])[0]
    linear = function(time, (x * scale)[n:])[2]
    rate = p[1] * ca.vertcat(nonlinear, linear) / scale
    t, states = ca.MX.sym("time"), ca.MX.sym("states", 2 * n)
    outputs = ca.vertcat(function(t, states[:n])[1], function(t, states[n:])[3])
    on_flight = function(t, ca.MX.zeros(n))[4]
    return _FlightFunctions(
        ca.Function("planar_mean", [s, x, z, p, u], [rate, z, z, z], list(INPUTS), list(OUTPUTS)),
        ca.Function("planar_start", [t], [ca.vertcat(on_flight, on_flight)]),
        ca.Function("planar_outputs", [t, states], [outputs]),
    )


def _check_angles(times: NDArray[np.float64], responses: NDArray[np.float64]) -> None:
    too_large = np.abs(responses[:, [0, 2]]).max(axis=1) > LARGEST_ANGLE
    if too_large.any():
        i = int(np.argmax(too_large))
        alpha, _, attitude = np.rad2deg(responses[i])
        raise DataError(
            f"the mean flight is unstable: angle of attack {alpha:.0f} deg, attitude {attitude:.0f} deg; check the "
            "control law and its roots with 'ascentwind inspect --time'",
            time=float(times[i]),
        )


def with_nonlinear_mean(vehicle: Vehicle, filled: ExecutableSystem) -> ExecutableSystem:
    """Add the nonlinear part to the tables of the mean response.

    The tables hold the linear mean of the whole model, with bending and slosh; the difference between the nonlinear
    equations and their linearisation, both of the rigid, controlled vehicle, comes on top.

    Raises
    ------
    DataError, IntegrationError
        As :func:`planar_mean`.
    """
    at = next(i for i, group in enumerate(filled.groups) if group.kind == "mean")
    group, found = filled.groups[at], planar_mean(vehicle, filled)
    columns = [RESPONSES.index(what) for _, what in group.sources]
    correction = mean_splines(group, (found.nonlinear - found.linear)[:, columns], filled.system.discontinuities)
    summed = replace(group, coefficients=group.coefficients + correction.coefficients)
    return filled.with_numbers(groups=(*filled.groups[:at], summed, *filled.groups[at + 1 :]))
