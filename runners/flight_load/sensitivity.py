"""Derivatives of a flight's level.

All parameters are ranked by the level's envelope: exact derivatives of mean and sigma at the times at which flights
pass, weighed by their shares. That holds the way in which the response moves between those times. For those that lead,
and for those asked for by name, mean and covariance between all times are computed for a little more and a little less,
and the paths that just reach the level move with them (:mod:`pathwise`); the draws are those of the nominal case, so
that no sampling error enters the difference.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr

from ...codegen.nodes.compiled import node_functions_of
from ...codegen.toolchain.interruption import Workers
from ..case.provenance import provenance
from ..sensitivity.many import sensitivities
from ..sensitivity.one import refuse_undefined
from ..sensitivity.percentile import two_forms
from ..sensitivity.request import parameter_rows
from ..solvers.cores import available_cores
from ..solvers.flight_nodes import FlightNodes
from .pathwise import Movement, Reaching
from .probability import Level
from .response import ResponseInWindow

GROUPS = 12  # of the times at which a level is passed
GROUPS_OF_RESULTANT = 4  # the same of both planes, each of two adjoint pairs
LEADING = 12  # parameters that are followed along the paths where none are named
STEP = 1e-3  # relative, of a parameter
TOLERANCE = 1e-9  # of the sweep


def level_sensitivity(
    of: ResponseInWindow, level: Level, moved: Movement, paths: Reaching, parameters: Iterable[str] | None
) -> xr.Dataset:
    """See :meth:`FlightLoad.sensitivity`.

    Parameters
    ----------
    of : ResponseInWindow
    level : Level
    moved : Movement
        How the level moves with mean and covariance of the response.
    paths : Reaching
        That just reach the level.
    parameters : iterable of str or None
    """
    known = of.case.parameters
    times, envelope = (
        _envelope_of_resultant(of, paths, parameters) if of.is_resultant else _envelope(of, level, parameters)
    )
    names = [str(name) for name in envelope["parameter"].values]
    size = np.abs(envelope.values * [known[name].value for name in names])
    chosen = names if parameters is not None else [names[k] for k in np.argsort(-size)[:LEADING]]

    def one(name: str) -> float:
        return _along_paths(of, moved, name)

    with Workers(available_cores()) as pool:
        found = dict(zip(chosen, pool.map(one, chosen), strict=True))
    order = sorted(found, key=lambda name: -abs(found[name] * known[name].value))
    derivative = np.array([found[name] for name in order])
    at = np.array([known[name].value for name in order])
    relative = {"units": "1", "long_name": "percent of the level per percent of the parameter"}
    by_moments = envelope.sel(parameter=order).values * at / level.value
    return xr.Dataset(
        {
            "derivative": ("parameter", derivative, {"long_name": f"derivative of the level [{of.unit}]"}),
            "elasticity": ("parameter", derivative * at / level.value, relative),
            "envelope_elasticity": (
                "parameter",
                by_moments,
                relative | {"comment": "by mean and sigma at the times of passing alone"},
            ),
        },
        {
            "parameter": order,
            "parameter_unit": ("parameter", [known[name].unit for name in order]),
            "parameter_value": ("parameter", at),
        },
        provenance(of.case) | {"response": of.response, "unit": of.unit, "level": level.value, "times_s": times},
    )


def _along_paths(of: ResponseInWindow, moved: Movement, name: str) -> float:
    """Return the derivative of the level by one parameter, as its paths move."""
    value = of.case.parameters[name].value
    step = STEP * abs(value) or STEP**2
    ends = [of.with_parameters({name: value + sign * step}).moments(TOLERANCE) for sign in (1.0, -1.0)]
    return moved.change(*((more - less) / (2 * step) for more, less in zip(*ends, strict=True)))


def _envelope(of: ResponseInWindow, level: Level, parameters: Iterable[str] | None) -> tuple[list[float], xr.DataArray]:
    """Return the times at which a level is passed and its derivatives by the moments there."""
    weight = level.draws.places(level.boundary)[:, 0]  # (m, sides)
    times, share = level.draws.process.seen.times, weight.sum(axis=1) / weight.sum()
    group = np.minimum(((np.cumsum(share) - 0.5 * share) * GROUPS).astype(int), GROUPS - 1)
    used = [at for at in (np.flatnonzero((group == g) & (share > 0)) for g in range(GROUPS)) if at.size]
    at_times = [round(float(times[at] @ share[at] / share[at].sum()), 6) for at in used]
    asked = of.case, [of.response], at_times
    by_mean, by_std = (sensitivities(*asked, "combined", quantity, parameters) for quantity in ("mean", "std"))
    derivative = np.zeros(by_std.sizes["parameter"])
    for number, at in enumerate(used):
        mean, std = (float(found["value"][number, 0]) for found in (by_mean, by_std))
        for side, sign in enumerate((1.0, -1.0)):
            part = weight[at, side].sum() / weight.sum()
            sigmas = (level.value - sign * mean) / std
            dm, ds = (found["derivative"].values[number, 0] for found in (by_mean, by_std))
            derivative += part * (sign * dm + sigmas * ds)
    return at_times, xr.DataArray(derivative, {"parameter": by_std["parameter"].values}, ("parameter",))


def _envelope_of_resultant(
    of: ResponseInWindow, paths: Reaching, parameters: Iterable[str] | None
) -> tuple[list[float], xr.DataArray]:
    """Return times at which a resultant's level is passed and its derivatives by mean vector and covariance there.

    A path that passes along e moves the level by e . dm + k e . dS e / (2 s), s the sigma along e and k sigmas away.
    """
    case, e, share = of.case, paths.direction, paths.share
    rows = parameter_rows(case, parameters)
    covariance = paths.outputs.instant_covariance()[paths.nearest]
    sigma = np.sqrt(np.einsum("kr,krs,ks->k", e, covariance, e))
    away = (paths.level - paths.mean) / sigma
    order = np.argsort(paths.point, kind="stable")
    passed = (np.cumsum(share[order]) - 0.5 * share[order]) * GROUPS_OF_RESULTANT
    group = np.empty(share.size, int)
    group[order] = np.minimum(passed.astype(int), GROUPS_OF_RESULTANT - 1)
    used = [at for at in (np.flatnonzero(group == g) for g in range(GROUPS_OF_RESULTANT)) if at.size]
    times = [round(float(paths.outputs.seen.times[paths.point[at]] @ share[at] / share[at].sum()), 6) for at in used]
    flight = FlightNodes.until(case.with_means, node_functions_of(case.executable), times, keep=True)
    derivative = np.zeros(len(rows))
    for time, at in zip(times, used, strict=True):
        by_mean = share[at] @ e[at]
        by_covariance = np.einsum("k,kr,ks->rs", share[at] * away[at] / (2 * sigma[at]), e[at], e[at])
        for _, gradient, _ in two_forms(case, flight, of.outputs, time, by_mean, by_covariance):
            refuse_undefined(case.system, gradient, rows)
            derivative += gradient.parameters[rows]
    names = [case.system.parameters[i].name for i in rows]
    return times, xr.DataArray(derivative, {"parameter": names}, ("parameter",))
