"""The wind ahead of a vehicle from the wind below it (report 1.3): a Kalman filter over altitude.

At each measured level the state of the vehicle's wind filter takes the gain k = P H / (H' P H + e^2) of what the wind
there is off its prediction; between levels it is carried by the filter's own transition. Ahead of the last measurement
the prediction and its band follow. It is the conditional mean and variance of the Gaussian vector of all levels.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from ...model.errors import ParameterValueError
from ..case.case import Case
from ..case.provenance import provenance
from .random_wind import random_wind

BAND = 1.645  # holds 90 %


def predict_wind(case: Case, altitude: ArrayLike, wind: ArrayLike, ahead: ArrayLike, error: float) -> xr.Dataset:
    """See :meth:`Study.predict_wind`."""
    measured, values, wanted = (
        _levels(name, x) for name, x in (("altitude", altitude), ("wind", wind), ("ahead", ahead))
    )
    if values.shape != measured.shape:
        raise ParameterValueError(f"{values.size} winds at {measured.size} altitudes; give one each")
    for name, levels in (("altitude", measured), ("ahead", wanted)):
        if not (np.diff(levels) > 0).all():
            raise ParameterValueError(f"{name} does not increase; sort the levels and keep each once")
    if wanted[0] <= measured[-1]:
        raise ParameterValueError(
            f"{wanted[0]:g} m is not ahead of the last measurement at {measured[-1]:g} m; ask for altitudes above it"
        )
    if not 0 <= error < np.inf:
        raise ParameterValueError(f"an error of {error!r} m/s cannot be used; give 0 or more")
    field = random_wind(case, np.concatenate([measured, wanted]))
    n, count = field.output.shape[1], measured.size
    z, P = np.zeros(n), field.start
    gains, predicted, std = np.zeros((count, n)), np.zeros(field.levels.size), np.zeros(field.levels.size)
    for k in range(field.levels.size):
        if k:
            Phi = field.transition[k - 1]
            z, P = Phi @ z, Phi @ P @ Phi.T + field.added[k - 1]
        H = field.output[k]
        predicted[k], std[k] = field.mean[k] + H @ z, np.sqrt(max(float(H @ P @ H), 0.0))
        if k < count:
            size = float(H @ P @ H) + error**2
            gains[k] = P @ H / size if size > 0 else 0.0
            z = z + gains[k] * (values[k] - predicted[k])
            keep = np.eye(n) - np.outer(gains[k], H)
            P = keep @ P @ keep.T + error**2 * np.outer(gains[k], gains[k])
    speed = {"units": "m/s"}
    return xr.Dataset(
        {
            "predicted": ("ahead", predicted[count:], speed | {"long_name": "wind expected ahead"}),
            "std": ("ahead", std[count:], speed | {"long_name": "its standard deviation"}),
            "band": (
                ("bound", "ahead"), predicted[count:] + BAND * np.outer([-1, 1], std[count:]),
                speed | {"long_name": "holds 90 %"},
            ),
            "one_step": ("altitude", predicted[:count], speed | {"long_name": "wind expected from the levels below"}),
            "one_step_std": ("altitude", std[:count], speed | {"long_name": "its standard deviation"}),
            "gain": (("altitude", "state"), gains, {"long_name": "Kalman gain, state of the wind filter by m/s"}),
        },
        {
            "altitude": ("altitude", measured, {"units": "m"}),
            "ahead": ("ahead", wanted, {"units": "m", "long_name": "altitude"}),
            "bound": ["lower", "upper"],
            "state": [f"wind_{k + 1}" for k in range(n)],
        },
        provenance(case) | {"error_m_s": float(error)},
    )  # fmt: skip


def _levels(name: str, given: ArrayLike) -> NDArray[np.float64]:
    try:
        found = np.atleast_1d(np.asarray(given, float))
    except (TypeError, ValueError):
        raise ParameterValueError(f"{name} = {given!r:.60} are no numbers") from None
    if found.ndim != 1 or not found.size or not np.isfinite(found).all():
        raise ParameterValueError(f"{name} is a list of finite numbers; {given!r:.60} is not")
    return found
