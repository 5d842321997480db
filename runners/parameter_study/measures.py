"""What is asked of every member: peaks of |mean| + 3 sigma, and the statistics at the time of the nominal peak."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...model.system.names import COMBINED
from ..present.style import display
from ..statistics.larger_side import LABEL, LARGER_SIDE, larger_side, side
from .run import ParameterStudy

PEAK = "peak"
MEASURES = (PEAK, LARGER_SIDE, "mean", "std")
LABELS = {PEAK: f"peak of {LABEL}", LARGER_SIDE: LABEL, "mean": "mean", "std": "σ"}


def measures(result: ParameterStudy) -> xr.Dataset:
    """Return the measures of the members that have numbers, and of the nominal study.

    Returns
    -------
    xarray.Dataset
        ``sample`` (measure, response, computed_member) and ``nominal`` (measure, response), SI; ``peak_time``
        (response), the end time of the nominal peak, at which all measures but 'peak' are taken; ``member_peak_time``
        and ``member_peak_side`` (response, computed_member); the coordinate ``member`` is the number of a member in the
        study.
    """
    data, kept = result.data, result.computed
    mean, std = (data[name].values[kept] for name in ("mean", "std"))
    std = std[..., data["source"].values.tolist().index(COMBINED)]
    nominal_mean, nominal_std = data["nominal_mean"].values, data["nominal_std"].sel(source=COMBINED).values
    at = np.argmax(larger_side(nominal_mean, nominal_std), axis=0)
    responses = np.arange(at.size)
    samples = _measures(mean, std, at)
    peak = np.argmax(larger_side(mean, std), axis=1)  # (members, responses)
    mean_there = np.take_along_axis(mean, peak[:, None], axis=1)[:, 0]
    sides = np.array([[side(value) for value in row] for row in mean_there], str).reshape(peak.shape)
    return xr.Dataset(
        {
            "sample": (("measure", "response", "computed_member"), np.moveaxis(samples, 0, -1)),
            "nominal": (("measure", "response"), _measures(nominal_mean[None], nominal_std[None], at)[0]),
            "peak_time": ("response", data["time"].values[at], {"units": "s"}),
            "member_peak_time": (
                ("response", "computed_member"),
                data["time"].values[peak].T.reshape(responses.size, -1),
                {"units": "s"},
            ),
            "member_peak_side": (("response", "computed_member"), sides.T),
        },
        {
            "measure": list(MEASURES),
            "response": data["response"],
            "unit": data["unit"],
            "member": ("computed_member", np.flatnonzero(kept)),
        },
    )


def nominal_side(measured: xr.Dataset, response: str) -> str:
    """Return the name of the side on which the nominal peak lies."""
    return side(measured["nominal"].sel(measure="mean", response=response).item())


def displayed(measured: xr.Dataset, response: str) -> tuple[float, str]:
    """Return the factor from SI and the unit in which a response is shown, from its nominal peak."""
    return display(str(measured["unit"].sel(response=response).item()), measured["nominal"].sel(response=response)[0])


def _measures(mean: np.ndarray, std: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return (members, measures, responses) from (members, times, responses)."""
    larger = larger_side(mean, std)
    chosen = (x[:, at, np.arange(at.size)] for x in (larger, mean, std))
    return np.stack([larger.max(axis=1), *chosen], axis=1)
