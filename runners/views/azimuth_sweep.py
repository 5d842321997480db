"""The resultants of both planes by the azimuth of the flight: nothing is compiled, the azimuth is a parameter."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib import rc_context

from ...model.errors import ParameterValueError, PlanesError
from ..case.case import Case
from ..case.provenance import provenance
from ..present.progress import each
from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from ..statistics.engines import response_statistics
from ..statistics.norm import LIKE_3_SIGMA

AZIMUTH = "wind.azimuth"
ROUNDING = 1e-9  # deg


def checked_azimuths(azimuths: Iterable[float]) -> list[float]:
    """Return azimuths in deg, each once, as they are given.

    Raises
    ------
    ParameterValueError
        None is given, or one is not between 0 and 360.
    """
    found = list(dict.fromkeys(float(a) for a in azimuths))
    if not found:
        raise ParameterValueError("no azimuth was given; give degrees, such as 0:350:10")
    for azimuth in found:
        if not 0 <= azimuth <= 360:
            raise ParameterValueError(f"an azimuth of {azimuth:g} deg is not between 0 and 360")
    return found


def check_turns(case: Case) -> None:
    """Raise where a system has no azimuth to turn.

    Raises
    ------
    PlanesError
    """
    if AZIMUTH not in case.parameters:
        raise PlanesError.of_one("an azimuth", case.system.name)


def azimuth_sweep(
    case: Case, azimuths: Iterable[float], times: Iterable[float], probability: float = LIKE_3_SIGMA
) -> xr.Dataset:
    """Return the largest level of every resultant over end times, by azimuth.

    Parameters
    ----------
    case : Case
    azimuths : iterable of float
        deg, from north towards east, 0 to 360.
    times : iterable of float
        End times, s.
    probability : float
        With which the resultant exceeds its level at one instant.

    Returns
    -------
    xarray.Dataset
        ``level`` in each resultant's ``unit``, ``time`` (s) and ``direction`` (rad, from pitch towards yaw) of its
        peak, over (azimuth, resultant).

    Raises
    ------
    PlanesError
        The system is not of both planes.
    ParameterValueError, TimeRangeError, IntegrationError
    """
    asked, ends = checked_azimuths(azimuths), list(times)
    check_turns(case)
    rows = []
    for azimuth in each(asked, "azimuths"):
        turned = case.with_parameters({AZIMUTH: math.radians(azimuth)})
        rows.append(response_statistics(turned, ends).resultants([probability]).peaks())
    names = [peak.resultant for peak in rows[0]]
    over = ("azimuth", "resultant")
    return xr.Dataset(
        {
            "level": (over, [[peak.value for peak in row] for row in rows]),
            "time": (over, [[peak.time for peak in row] for row in rows], {"units": "s"}),
            "direction": (over, [[peak.direction for peak in row] for row in rows], {"units": "rad"}),
        },
        {
            "azimuth": ("azimuth", asked, {"units": "deg", "long_name": "from north towards east"}),
            "resultant": names,
            "unit": ("resultant", [peak.unit for peak in rows[0]]),
        },
        provenance(case) | {"probability": probability},
    )


def azimuth_csv(found: xr.Dataset) -> str:
    """Return a sweep as text, one row an azimuth and resultant."""
    lines = ["azimuth_deg,resultant,unit,level,time_s,direction_rad"]
    for azimuth in found["azimuth"].values:
        for name in found["resultant"].values:
            at = found.sel(azimuth=azimuth, resultant=name)
            numbers = f"{float(at['level']):.9e},{float(at['time']):.12g},{float(at['direction']):.9e}"
            lines.append(f"{azimuth:.12g},{name},{at['unit'].item()},{numbers}")
    return "\n".join(lines) + "\n"


def azimuth_figure(found: xr.Dataset, resultant: str, flown: float, title: str) -> Figure:
    """Return the peak of a resultant over the azimuth (deg), that of the flight marked; dots are what was computed."""
    part = found.sel(resultant=resultant).sortby("azimuth")
    factor, unit = display(str(part["unit"].item()), part["level"].values)
    azimuth, level = part["azimuth"].values, factor * part["level"].values
    if azimuth.size > 2 and 0 < azimuth[0] + 360 - azimuth[-1] <= np.diff(azimuth).max() + ROUNDING:  # a whole circle
        azimuth, level = np.append(azimuth, azimuth[0] + 360), np.append(level, level[0])
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        axes.plot(azimuth, level, color=COLORS["combined"], lw=0.8, ls=":")
        axes.plot(azimuth, level, color=COLORS["combined"], lw=0, marker="o", ms=5)
        axes.axvline(flown, color=COLORS["mean"], lw=1, ls="--")
        axes.margins(y=0.14)
        axes.annotate(
            "as flown", (flown, 1.0), xycoords=("data", "axes fraction"), xytext=(4, -4), textcoords="offset points",
            va="top",
        )  # fmt: skip
        axes.set_xticks(range(0, 361, 45))
        what = f"{words(resultant)}, passed with {found.attrs['probability']:.3g} ({unit})"
        axes.set(xlabel="azimuth (deg)", ylabel=what, title=wrapped(title))
    return figure
