"""Gust penetration without an element for its delays: what the rational ones of the equations are held against.

The vehicle does not act on the wind, so that the adjoint of its states alone, lambda, goes back in time as if there
were no delays, and zone j of the vehicle weighs the wind at its own altitude h_j(t) by g_j = E_j' lambda.
Collected over altitude, with the weights G_j of the winds at t2 itself,

    g(h) = sum_j g_j(t_j(h)) dt_j/dh + sum_j G_j delta(h - h_j(t2)),

a second adjoint over altitude takes them through the wind's filter from the top down:

    d mu/dh = -F' mu - H' g,    Var = integral of |G' mu|^2 dh + mu_0' P0 mu_0.

The first adjoint is that of CVODES, in which the vehicle's part knows nothing of the delays.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ...codegen.system.evaluation import MatrixEvaluator
from ...model.equations.penetration import DELAYS
from ...model.errors import DataError
from ...model.system.names import TURBULENCE, WIND
from ...model.vehicle.planes import one_wind
from ...model.vehicle.vehicle import Vehicle
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.turbulence import turbulence_filter
from ..case.case import Case
from ..case.provenance import provenance
from ..case.wind_start import covariance_at
from ..present.netcdf import RULE
from ..present.progress import steps
from ..present.wording import words
from ..solvers.adjoint import AdjointHistory, AdjointSolver
from ..solvers.time_nodes import intervals, time_nodes
from .cvodes import Cvodes

Array = NDArray[np.float64]

SPACING, RADIANS = 0.02, 1.2  # s, and of the fastest oscillation, at most, between points of the weights
COARSE = 0.1  # s, between points of the matrices, which follow the tables
CELLS = (0.5, 4.0)  # m, of altitude, least and most; a third of the way that the spacing takes in between
SAMPLE = 0.01  # s, by which times are found from altitudes
BOUND = 0.01  # of sigma, that the rational delays may miss
GAUSS = 0.5 / np.sqrt(3.0)


@dataclass(frozen=True, eq=False)
class ZoneWeights:
    """Weights of the wind that each zone meets, for all responses at one time.

    Attributes
    ----------
    pieces : tuple of (begin, end, CubicSpline)
        Between jumps of the flight: (responses, zones) by m over time, s.
    direct : (responses, zones) array
        Of the winds at t2.
    time : float
        t2, s.
    """

    pieces: tuple[tuple[float, float, CubicSpline], ...]
    direct: Array
    time: float

    def at(self, times: Array, zone: int) -> Array:
        """Return the weights of a zone at times (k,) before t2, (k, responses)."""
        found = np.zeros((times.size, self.direct.shape[0]))
        for begin, end, spline in self.pieces:
            inside = (times >= begin) & (times <= end)
            found[inside] = spline(times[inside])[:, :, zone]
        return found


@steps("gusts with exact delays")
def check_gust_penetration(case: Case, time: float) -> xr.Dataset:
    """Return sigma of the wind's sources by rational and by exact delays at one time.

    Parameters
    ----------
    case : Case
        Of a vehicle with gust zones.
    time : float
        t2, s.

    Returns
    -------
    xarray.Dataset
        ``rational`` and ``exact`` over (response, source), ``difference`` (response), relative, of all sources
        together, and whether it is below 1 % (``agrees``).

    Raises
    ------
    DataError
        The whole vehicle feels one wind, or turbulence is correlated with it.
    PlanesError
        It flies in both planes, each of which has the delays of one alone.
    NoVehicleError, TimeRangeError, IntegrationError
    """
    vehicle = case.vehicle_for("gust penetration")
    if vehicle.zones is None:
        raise DataError("the whole vehicle feels one wind: it has no gust zones; set options.gust_zones")
    one_wind(vehicle, "gust penetration by exact delays")
    if vehicle.turbulence is not None and vehicle.turbulence.correlation is not None:
        raise DataError("turbulence is correlated with the wind; exact delays take one source after the other")
    (end,) = case.checked_times([time])
    solver = AdjointSolver(case.with_means, Cvodes())
    spacing = _spacing(case, end)
    run, history = solver.run_with_history(end, spacing)
    weights = _zone_weights(case, history, end)
    filters = _filters(case, vehicle)
    rational = np.array([run.variance[:, case.system.sources.index(source)] for source in filters]).T
    exact = np.array([_variance(case, vehicle, weights, f, spacing) for f in filters.values()]).T
    # a response that no wind reaches is exact
    size = np.where(exact.sum(axis=1) > 0, exact.sum(axis=1), 1.0)
    apart = np.where(exact.sum(axis=1) > 0, np.sqrt(np.maximum(rational.sum(axis=1), 0) / size) - 1, 0.0)
    of_response = {RULE: "response"}
    return xr.Dataset(
        {
            "rational": (("response", "source"), np.sqrt(np.maximum(rational, 0.0)), of_response),
            "exact": (("response", "source"), np.sqrt(np.maximum(exact, 0.0)), of_response),
            "difference": ("response", apart, {"units": "1", "long_name": "of sigma by the wind's sources together"}),
            "agrees": ("response", np.abs(apart) <= BOUND, {"long_name": f"within {BOUND:g}"}),
        },
        {
            "response": list(case.system.output_names),
            "source": list(filters),
            "unit": ("response", [o.unit for o in case.system.outputs]),
        },
        provenance(case) | {"t2_s": end, "zones": vehicle.zones.count},
    )


def verdict(found: xr.Dataset) -> tuple[str, bool]:
    """Return one sentence for people on what :func:`check_gust_penetration` found, and whether it is good news."""
    worst = found.isel(response=int(np.argmax(np.abs(found["difference"].values))))
    difference, agree = abs(float(worst["difference"])), bool(found["agrees"].all())
    text = (
        f"Delays of gusts along the vehicle: rational ones in {found.attrs['zones']} zones and exact ones are "
        f"{100 * difference:.2g} % of sigma by the wind apart at {found.attrs['t2_s']:g} s, "
        f"{words(str(worst['response'].item()))} the farthest; {100 * BOUND:g} % is allowed."
    )
    return text if agree else f"{text} Take more gust_zones.", agree


def _spacing(case: Case, time: float) -> float:
    fastest = max(float(np.linalg.eigvals(case.matrices(t)[0]).imag.max()) for t in (0.5 * time, time))
    return min(SPACING, RADIANS / fastest) if fastest > 0 else SPACING


def _zone_weights(case: Case, history: AdjointHistory, time: float) -> ZoneWeights:
    system, executable = case.system, case.with_means
    wind, delays = system.input_names.index(WIND), system.block(DELAYS)
    winds = np.arange(delays.start, delays.stop, 2)
    plant = np.array([s.block not in (WIND, TURBULENCE, DELAYS) for s in system.states])
    evaluate = MatrixEvaluator(executable, ("A", "E"))
    node = float(time_nodes(executable, [time])[0])
    pieces, first = [], 0
    for piece in intervals(executable, system.start, node):
        count = int(np.searchsorted(history.times[first:], piece.end, side="left")) + 1
        at, adjoint = history.times[first : first + count], history.adjoint[first : first + count][:, :, plant]
        first += count
        coarse = np.linspace(at[0], at[-1], max(4, int(np.ceil((at[-1] - at[0]) / COARSE)) + 1))
        into = np.empty((coarse.size, int(plant.sum()), winds.size + 1))
        for k, t in enumerate(coarse):
            A, E = evaluate(float(t), piece.low, piece.high)
            into[k] = np.column_stack([E[plant, wind], A[np.ix_(plant, winds)]])
        values = adjoint @ CubicSpline(coarse, into)(at)
        pieces.append((float(at[0]), float(at[-1]), CubicSpline(at, values)))
    here = intervals(executable, system.start, node)[-1]
    C, G = MatrixEvaluator(executable, ("C", "G"))(node, here.low, here.high)
    return ZoneWeights(tuple(pieces), np.column_stack([G[:, wind], C[:, winds]]), node)


def _filters(case: Case, vehicle: Vehicle) -> dict[str, ShapingFilter]:
    """Return the wind's filter and turbulence's, over altitude, with the factors of the case's parameters."""
    value = {name: parameter.value for name, parameter in case.parameters.items()}
    found = {WIND: _scaled(vehicle.wind.shaping_filter, value["wind.sigma_scale"])}
    turbulence = vehicle.turbulence
    if turbulence is not None:
        table = turbulence.intensity
        low, high = min(0.0, vehicle.start_altitude), float(vehicle.met_altitude(vehicle.end))
        made = turbulence_filter(
            turbulence.form, altitude=(low, max(high, low + 1.0)), length=value["turbulence.length"], intensity=table,
            high_pass=value.get("turbulence.high_pass"),
        )  # fmt: skip
        found[TURBULENCE] = _scaled(made, value["turbulence.sigma_scale"])
    return found


def _scaled(f: ShapingFilter, factor: float) -> ShapingFilter:
    return ShapingFilter(f.name, f.altitude, f.F, f.G, factor * f.H, f.start_covariance, f.kinks, f.source)


def _variance(
    case: Case, vehicle: Vehicle, weights: ZoneWeights, shaping_filter: ShapingFilter, spacing: float
) -> Array:
    """Return the variance of every response by one filter, (responses,)."""
    times = np.linspace(case.system.start, weights.time, int(np.ceil((weights.time - case.system.start) / SAMPLE)) + 1)
    climb = np.minimum(
        vehicle.tables["altitude"].polynomial.derivative()(times)
        / vehicle.tables["relative_velocity"].polynomial(times),
        1.0,
    )
    assert vehicle.zones is not None  # its error was raised
    behind = vehicle.zones.position[0] - vehicle.zones.position
    altitudes = vehicle.met_altitude(times) - behind[:, None] * climb
    nodes = altitudes[:, -1]
    low = max(float(altitudes[:, 0].min()), float(shaping_filter.altitude[0]))
    marks = np.unique(np.concatenate([[low], nodes, [x for x in shaping_filter.kinks if low < x < nodes.max()]]))
    cell = float(np.clip(np.gradient(altitudes[0], times)[-1] * spacing / 3, *CELLS))
    edges = np.unique(np.concatenate([np.linspace(a, b, int(np.ceil((b - a) / cell)) + 1) for a, b in pairwise(marks)]))
    step = np.diff(edges)
    points = 0.5 * (edges[:-1] + edges[1:]) + np.array([-GAUSS, GAUSS])[:, None] * step
    force = np.zeros((2, step.size, weights.direct.shape[0]))
    for zone, h in enumerate(altitudes):
        rate = np.gradient(h, times)
        for side in (0, 1):
            inside = (points[side] >= h[0]) & (points[side] <= h[-1])
            t = np.interp(points[side][inside], h, times)
            force[side, inside] += weights.at(t, zone) / np.interp(t, times, rate)[:, None]
    F, G, _ = shaping_filter.at(0.5 * (edges[:-1] + edges[1:]))
    at_points = [shaping_filter.at(points[side])[2] for side in (0, 1)]
    at_nodes = shaping_filter.at(nodes)[2]
    mu, total = np.zeros((shaping_filter.order, weights.direct.shape[0])), np.zeros(weights.direct.shape[0])
    one = np.eye(shaping_filter.order)
    for k in range(step.size - 1, -1, -1):
        for zone in np.flatnonzero(nodes == edges[k + 1]):
            mu = mu + np.outer(at_nodes[zone], weights.direct[:, zone])
        above, turned = G[k].T @ mu, F[k].T * step[k]
        mu = (one + turned @ (one + 0.5 * turned)) @ mu
        for side, share in ((0, 0.5 - GAUSS), (1, 0.5 + GAUSS)):
            mu = mu + (one + share * turned) @ np.outer(0.5 * step[k] * at_points[side][k], force[side, k])
        below = G[k].T @ mu
        total += step[k] / 3 * (above**2 + above * below + below**2).sum(axis=0)
    P = covariance_at(shaping_filter, float(edges[0]))
    return total + np.einsum("ir,ij,jr->r", mu, P, mu)
