"""The wind ahead of a vehicle from the wind below it (report 1.3): a Kalman filter over altitude.

At each measured level the state of the vehicle's wind filter takes the gain P H' (H P H' + e^2)^-1 of what the wind
there is off its prediction; between levels it is carried by the filter's own transition. Ahead of the last measurement
the prediction and its band follow. Of both components each level gives two measurements. It is the conditional mean and
variance of the Gaussian vector of all levels.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from ...model.errors import ParameterValueError
from ...model.wind.record import COMPONENTS
from ..case.case import Case
from ..case.provenance import provenance
from .random_wind import FARTHEST, random_wind

BAND = 1.645  # holds 90 %


def predict_wind(case: Case, altitude: ArrayLike, wind: ArrayLike, ahead: ArrayLike, error: float) -> xr.Dataset:
    """See :meth:`Study.predict_wind`."""
    measured, wanted = _levels("altitude", altitude), _levels("ahead", ahead)
    components = len(case.vehicle_for("the wind ahead").wind.means)
    values = _winds(wind, measured.size, components)
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
    n, count, whole = field.output.shape[2], measured.size, field.levels.size
    mean = field.mean.reshape(components, whole).T
    spread = np.hypot(field.std.reshape(components, whole).T[:count], error)
    far = np.divide(np.abs(values - mean[:count]), spread, out=np.zeros(spread.shape), where=spread > 0)
    if far.max() > FARTHEST:
        k, c = np.unravel_index(int(np.argmax(far)), far.shape)
        raise ParameterValueError(
            f"a wind of {values[k, c]:.3g} m/s at {measured[k]:g} m is {far[k, c]:.1f} standard deviations from the "
            f"mean of the vehicle's wind, {mean[k, c]:.3g} m/s: is it in knots, or of another season or place?"
        )
    z, P = np.zeros(n), field.start
    gains, predicted, std = (
        np.zeros((count, components, n)),
        np.zeros((whole, components)),
        np.zeros((whole, components)),
    )
    for k in range(whole):
        if k:
            Phi = field.transition[k - 1]
            z, P = Phi @ z, Phi @ P @ Phi.T + field.added[k - 1]
        H = field.output[k]
        predicted[k], std[k] = mean[k] + H @ z, np.sqrt(np.maximum(np.einsum("ci,ij,cj->c", H, P, H), 0.0))
        if k < count:
            gain = P @ H.T @ np.linalg.pinv(H @ P @ H.T + error**2 * np.eye(components), hermitian=True)
            z = z + gain @ (values[k] - predicted[k])
            keep = np.eye(n) - gain @ H
            P = keep @ P @ keep.T + error**2 * gain @ gain.T
            gains[k] = gain.T
    parts = {
        "predicted": ("ahead", predicted[count:], "wind expected ahead"),
        "std": ("ahead", std[count:], "its standard deviation"),
        "one_step": ("altitude", predicted[:count], "wind expected from the levels below"),
        "one_step_std": ("altitude", std[:count], "its standard deviation"),
    }
    found = xr.Dataset(
        {
            name: ((level, "component"), array, {"units": "m/s", "long_name": text})
            for name, (level, array, text) in parts.items()
        },
        {
            "altitude": ("altitude", measured, {"units": "m"}),
            "ahead": ("ahead", wanted, {"units": "m", "long_name": "altitude"}),
            "bound": ["lower", "upper"],
            "state": [f"wind_{k + 1}" for k in range(n)],
        },
        provenance(case) | {"error_m_s": float(error)},
    )
    found["band"] = (
        ("bound", "ahead", "component"), predicted[count:] + BAND * np.multiply.outer([-1, 1], std[count:]),
        {"units": "m/s", "long_name": "holds 90 %"},
    )  # fmt: skip
    found["gain"] = (
        ("altitude", "component", "state"), gains, {"long_name": "Kalman gain, state of the wind filter by m/s"},
    )  # fmt: skip
    return found.squeeze("component") if components == 1 else found.assign_coords(component=list(COMPONENTS))


def _winds(given: ArrayLike, levels: int, components: int) -> NDArray[np.float64]:
    """Return measured winds as (levels, components)."""
    wanted = (levels,) if components == 1 else (levels, components)
    try:
        found = np.asarray(given, float)
    except (TypeError, ValueError):
        raise ParameterValueError(f"wind = {given!r:.60} are no numbers") from None
    if not np.isfinite(found).all():
        raise ParameterValueError(f"wind is an array of finite numbers; {given!r:.60} is not")
    if np.atleast_1d(found).shape != wanted:
        each = "one each" if components == 1 else "one of each component: towards the east, towards the north"
        raise ParameterValueError(f"{found.size} winds at {levels} altitudes; give {each}")
    return found.reshape(levels, components)


def _levels(name: str, given: ArrayLike) -> NDArray[np.float64]:
    try:
        found = np.atleast_1d(np.asarray(given, float))
    except (TypeError, ValueError):
        raise ParameterValueError(f"{name} = {given!r:.60} are no numbers") from None
    if found.ndim != 1 or not found.size or not np.isfinite(found).all():
        raise ParameterValueError(f"{name} is a list of finite numbers; {given!r:.60} is not")
    return found
