"""The resultants of both planes along the vehicle as files and a figure: at one time, and the largest of the flight."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib import rc_context

from ...model.system.names import COMBINED
from ...model.vehicle.loads import BENDING_MOMENT, SHEAR_FORCE
from ..case.case import Case
from ..present.files import write_text
from ..present.style import COLORS, SHADES, STYLE, Figure, wrapped, write_figure
from ..present.wording import display, words
from ..station_loads.loads_along_vehicle import known_loads, resultant_along_vehicle
from ..statistics.larger_side import SIGMAS


def write_resultants_along(case: Case, times: Sequence[float], time: float | None, folder: Path) -> list[Path]:
    """Write a CSV file and a figure of the resultant of each load across the axis that is known along the vehicle.

    Parameters
    ----------
    case : Case
        Of a vehicle in both planes.
    times : sequence of float
        Of the envelope, s.
    time : float or None
        Of the section, s; None takes that of the largest resultant.
    folder : Path

    Raises
    ------
    DataError, IntegrationError
    """
    vehicle, written = case.vehicle_for("a resultant along the vehicle"), []
    wanted = [float(t) for t in times] + ([] if time is None else [time])
    ends: list[float] = sorted(set(wanted))
    for load in (load for load in (BENDING_MOMENT, SHEAR_FORCE) if load in known_loads(vehicle)):
        found = resultant_along_vehicle(case, ends, load=load)
        at = float(found["time"][int(found["level"].max("station").values.argmax())]) if time is None else time
        name, text = f"resultant_{load}_along_vehicle", resultants_csv(found)
        written.append(write_text(folder / f"{name}.csv", text))
        title = f"{vehicle.title}\nResultant {words(load)} along the vehicle"
        written += write_figure(resultants_along_figure(found, at, title), folder, name)
    return written


def resultants_csv(found: xr.Dataset) -> str:
    """Return resultants along the vehicle as text, one row a time and station."""
    means, level, direction = (found[name].values for name in ("plane_mean", "level", "direction"))
    unit = found["level"].attrs["units"]
    lines = [f"time_s,station_m,unit,level_{found.attrs['probability']!r},direction_rad,mean_pitch,mean_yaw"]
    for k, time in enumerate(found["time"].values):
        for n, station in enumerate(found["station"].values):
            numbers = ",".join(f"{x:.9e}" for x in (level[k, n], direction[k, n], *means[k, n]))
            lines.append(f"{time:.12g},{station:.12g},{unit},{numbers}")
    return "\n".join(lines) + "\n"


def resultants_along_figure(found: xr.Dataset, time: float, title: str) -> Figure:
    """Return the resultant at every station at a time (s), beside each plane alone and the largest of several times."""
    part, station = found.sel(time=time), found["station"].values
    factor, unit = display(found["level"].attrs["units"], found["level"].values)
    mean = part["plane_mean"].values
    covariance = part["plane_covariance"].sel(source=COMBINED).values
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        if found.sizes["time"] > 1:
            envelope = factor * found["level"].max("time")
            axes.fill_between(
                station, 0, envelope, color=COLORS[COMBINED], alpha=0.1, lw=0, label="largest of all times"
            )
        axes.plot(station, factor * part["level"], color=COLORS[COMBINED], lw=2, label=f"resultant at {time:g} s")
        for k, plane in enumerate(found["plane"].values):
            alone = np.abs(mean[:, k]) + SIGMAS * np.sqrt(np.maximum(covariance[:, k, k], 0.0))
            axes.plot(station, factor * alone, "--", color=SHADES[2 + k], lw=1.4, label=f"{plane} alone, |mean| + 3σ")
        size = np.linalg.norm(mean, axis=1)
        axes.plot(station, factor * size, color=COLORS["mean"], lw=1.4, label="resultant of the means")
        axes.set_ylim(bottom=0)
        what = f"resultant {words(found.attrs['load'])} ({unit})"
        told = f"{title}\nlevel passed with {found.attrs['probability']:.3g} at an instant"
        axes.set(xlabel="vehicle station (m)", ylabel=what, title=wrapped(told))
        axes.legend()
    return figure
