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
from numpy.typing import NDArray

from ...codegen.toolchain.interruption import Workers
from ..case.provenance import provenance
from ..sensitivity.many import sensitivities
from ..solvers.cores import available_cores
from .load import HALVINGS, FlightLoad
from .pathwise import Movement
from .process import one_output
from .window import window_chain

GROUPS = 12  # of the times at which a level is passed
LEADING = 12  # parameters that are followed along the paths where none are named
STEP = 1e-3  # relative, of a parameter
TOLERANCE = 1e-9  # of the sweep


def level_sensitivity(load: FlightLoad, probability: float | None, parameters: Iterable[str] | None) -> xr.Dataset:
    """See :meth:`FlightLoad.sensitivity`."""
    which = load.number_of(probability)
    times, envelope = _envelope(load, which, parameters)
    names = [str(name) for name in envelope["parameter"].values]
    values = np.array([load.case.parameters[name].value for name in names])
    level = load.levels[which].value
    size = np.abs(envelope.values * values)
    chosen = names if parameters is not None else [names[k] for k in np.argsort(-size)[:LEADING]]
    moved = load.movement(which)

    def one(name: str) -> float:
        return _along_paths(load, moved, name)

    with Workers(available_cores()) as pool:
        found = dict(zip(chosen, pool.map(one, chosen), strict=True))
    order = sorted(found, key=lambda name: -abs(found[name] * load.case.parameters[name].value))
    derivative = np.array([found[name] for name in order])
    at = np.array([load.case.parameters[name].value for name in order])
    relative = {"units": "1", "long_name": "percent of the level per percent of the parameter"}
    return xr.Dataset(
        {
            "derivative": ("parameter", derivative, {"long_name": f"derivative of the level [{load.unit}]"}),
            "elasticity": ("parameter", derivative * at / level, relative),
            "envelope_elasticity": (
                "parameter",
                envelope.sel(parameter=order).values * at / level,
                relative | {"comment": "by mean and sigma at the times of passing alone"},
            ),
        },
        {
            "parameter": order,
            "parameter_unit": ("parameter", [load.case.parameters[name].unit for name in order]),
            "parameter_value": ("parameter", at),
        },
        provenance(load.case)
        | {"response": load.response, "level": level, "probability": load.probabilities[which], "times_s": times},
    )


def _along_paths(load: FlightLoad, moved: Movement, name: str) -> float:
    """Return the derivative of the level by one parameter, as its paths move."""
    value = load.case.parameters[name].value
    step = STEP * abs(value) or STEP**2
    ends = [_moments(load, name, value + sign * step) for sign in (1.0, -1.0)]
    mean, covariance = (0.5 * (more - less) / step for more, less in zip(*ends, strict=True))
    return moved.change(mean, covariance)


def _moments(load: FlightLoad, name: str, value: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean and covariance of the response between the points drawn."""
    case = load.case.with_parameters({name: value})
    chain = window_chain(case, load.window, load.steps // 2**HALVINGS, TOLERANCE)
    row = case.system.output_index(load.response)
    process = one_output(chain, chain.output[:, row], chain.mean[:, row])
    return process.drawn.mean[:, 0], process.covariance


def _envelope(load: FlightLoad, which: int, parameters: Iterable[str] | None) -> tuple[list[float], xr.DataArray]:
    """Return the times at which a level is passed and its derivatives by the moments there."""
    level = load.levels[which]
    weight = level.draws.places(level.boundary)[:, 0]  # (m, sides)
    times, share = load.process.seen.times, weight.sum(axis=1) / weight.sum()
    group = np.minimum(((np.cumsum(share) - 0.5 * share) * GROUPS).astype(int), GROUPS - 1)
    used = [at for at in (np.flatnonzero((group == g) & (share > 0)) for g in range(GROUPS)) if at.size]
    at_times = [round(float(times[at] @ share[at] / share[at].sum()), 6) for at in used]
    asked = load.case, [load.response], at_times
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
