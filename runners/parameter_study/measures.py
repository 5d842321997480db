"""What is asked of every member: peaks of |mean| + 3 sigma, and the statistics at the time of the nominal peak.

A resultant of both planes has no mean + 3 sigma: it is asked for the level that it passes with a probability.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.system.names import COMBINED
from ..present.wording import display, words
from ..statistics.larger_side import LABEL, LARGER_SIDE, larger_side, side
from ..statistics.norm import NormOfNormal
from .run import ParameterStudy

PEAK, LEVEL = "peak", "level"
OF_RESPONSES = (PEAK, LARGER_SIDE, "mean", "std")
OF_RESULTANTS = (PEAK, LEVEL)
LABELS = {PEAK: "peak", LARGER_SIDE: LABEL, "mean": "mean", "std": "σ", LEVEL: "level"}


def measures(result: ParameterStudy) -> xr.Dataset:
    """Return the measures of the members that have numbers, and of the nominal study.

    Returns
    -------
    xarray.Dataset
        Over responses and resultants, both called response. ``sample`` (measure, response, computed_member) and
        ``nominal`` (measure, response), SI, NaN where one has no such measure; ``peak_time`` (response), the end time
        of the nominal peak, at which all measures but 'peak' are taken; ``member_peak_time``, ``member_peak_side``, of
        a response the larger side, and ``member_peak_direction``, of a resultant the likeliest direction, rad
        (response, computed_member). ``unit`` and ``label``, what peaks are of, are coordinates of the response,
        ``member`` is the number of a member in the study.
    """
    kept = np.flatnonzero(result.computed)
    parts = [_of_responses(result, kept)] if result.data.sizes["response"] else []
    if LEVEL in result.data:
        parts.append(_of_resultants(result, kept))
    found = xr.concat(parts, "response", join="outer", fill_value={"member_peak_side": ""})
    known = [measure for measure in LABELS if measure in found["measure"].values]
    return found.sel(measure=known).assign_coords(member=("computed_member", kept))


def loads(result: ParameterStudy, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what peaks are of over flight time: of all members (members, times), and nothing varied (times,)."""
    data = result.data
    if name not in data["response"].values:
        at = data.sel(resultant=name)
        return at[LEVEL].values, at[f"nominal_{LEVEL}"].values
    at = data.sel(response=name)
    members, nominal = (
        larger_side(at[f"{of}mean"].values, at[f"{of}std"].sel(source=COMBINED).values) for of in ("", "nominal_")
    )
    return members, nominal


def nominal_side(measured: xr.Dataset, response: str) -> str:
    """Return the name of the side on which the nominal peak of a response lies; of a resultant nothing."""
    mean = measured["nominal"].sel(response=response).reindex(measure=["mean"]).item()
    return side(mean) if np.isfinite(mean) else ""


def label(measured: xr.Dataset, response: str) -> str:
    """Return what the peak of a response or resultant is of."""
    return str(measured["label"].sel(response=response).item())


def displayed(measured: xr.Dataset, response: str) -> tuple[float, str]:
    """Return the factor from SI and the unit in which a response is shown, from its nominal peak."""
    return display(str(measured["unit"].sel(response=response).item()), measured["nominal"].sel(response=response)[0])


def timed(measured: xr.Dataset, response: str) -> str:
    """Return the measure at the time of the nominal peak that the peak is the largest of."""
    return OF_RESPONSES[1] if nominal_side(measured, response) else OF_RESULTANTS[1]


def _of_responses(result: ParameterStudy, kept: NDArray[np.int_]) -> xr.Dataset:
    data = result.data
    mean, std = (data[name].values[kept] for name in ("mean", "std"))
    std = std[..., data["source"].values.tolist().index(COMBINED)]
    nominal_mean, nominal_std = data["nominal_mean"].values, data["nominal_std"].sel(source=COMBINED).values
    at = np.argmax(larger_side(nominal_mean, nominal_std), axis=0)
    peak = np.argmax(larger_side(mean, std), axis=1)  # (members, responses)
    mean_there = np.take_along_axis(mean, peak[:, None], axis=1)[:, 0]
    sides = np.array([[side(value) for value in row] for row in mean_there], str).reshape(peak.shape)
    samples = _measures(at, larger_side(mean, std), mean, std)
    nominal = _measures(at, *(x[None] for x in (larger_side(nominal_mean, nominal_std), nominal_mean, nominal_std)))
    found = _dataset(OF_RESPONSES, samples, nominal[0], data["time"].values, at, peak)
    names = [str(name) for name in data["response"].values]
    return found.assign(member_peak_side=(("response", "computed_member"), sides.T)).assign_coords(
        response=names,
        unit=("response", data["unit"].values),
        label=("response", [f"{LABEL} {words(n)}" for n in names]),
    )


def _of_resultants(result: ParameterStudy, kept: NDArray[np.int_]) -> xr.Dataset:
    data = result.data
    level, nominal = data[LEVEL].values[kept], data[f"nominal_{LEVEL}"].values
    at, peak = np.argmax(nominal, axis=0), np.argmax(level, axis=1)
    found = _dataset(
        OF_RESULTANTS, _measures(at, level), _measures(at, nominal[None])[0], data["time"].values, at, peak
    )
    member, resultant = np.arange(kept.size)[:, None], np.arange(at.size)
    mean = data["plane_mean"].values[kept][member, peak, resultant]
    covariance = data["plane_covariance"].sel(source=COMBINED).values[kept][member, peak, resultant]
    direction = NormOfNormal(mean, covariance).direction(level[member, peak, resultant]).most_likely
    names, chance = [str(name) for name in data["resultant"].values], data.attrs["probability"]
    labels = [f"{words(name)} passed with {chance:.3g}" for name in names]
    return found.assign(member_peak_direction=(("response", "computed_member"), direction.T)).assign_coords(
        response=names, unit=("response", data["resultant_unit"].values), label=("response", labels)
    )


def _dataset(
    names: tuple[str, ...],
    samples: NDArray[np.float64],
    nominal: NDArray[np.float64],
    time: NDArray[np.float64],
    at: NDArray[np.int_],
    peak: NDArray[np.int_],
) -> xr.Dataset:
    """Return measures (members, measures, responses) with the times of the nominal peak and of each member's."""
    return xr.Dataset(
        {
            "sample": (("measure", "response", "computed_member"), np.moveaxis(samples, 0, -1)),
            "nominal": (("measure", "response"), nominal),
            "peak_time": ("response", time[at], {"units": "s"}),
            "member_peak_time": (("response", "computed_member"), time[peak].T.reshape(at.size, -1), {"units": "s"}),
        },
        {"measure": list(names)},
    )


def _measures(at: NDArray[np.int_], *quantities: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (members, measures, responses): the peak of the first (members, times, responses), then all at a time."""
    chosen = (x[:, at, np.arange(at.size)] for x in quantities)
    return np.stack([quantities[0].max(axis=1), *chosen], axis=1)
