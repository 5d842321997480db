"""The loads along the vehicle as files and figures: at one time, over the flight, and where they are largest."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib import rc_context
from matplotlib.axes import Axes

from ...model.construction.construction_file import CONSTRUCTION_FILE, load_construction
from ...model.construction.tank_shape import TankShape
from ...model.equations.station_loads import load_station_loads
from ...model.errors import TimeRangeError
from ...model.system.names import COMBINED
from ...model.vehicle.vehicle import Vehicle
from ..present.files import write_text
from ..present.netcdf import write_netcdf
from ..present.style import COLORS, STYLE, Figure, write_figure
from ..present.wording import display, words
from ..station_loads.loads_along_vehicle import LOADS, every_load_along_vehicle, known_loads
from ..statistics.larger_side import LABEL, larger_side, side

if TYPE_CHECKING:
    from ..study import Study

PEAK = "peak"
COLUMNS = ("time_s", "station_m", "source", "mean", "std", "mean_plus_3sigma")


@dataclass(frozen=True)
class LargestAlong:
    """The largest |mean| + 3 sigma of a load along the vehicle, over all times.

    Attributes
    ----------
    load, unit : str
    value, mean : float
        SI; the mean there with its sign.
    station, time : float
        m, s.
    """

    load: str
    unit: str
    value: float
    mean: float
    station: float
    time: float

    @staticmethod
    def of(found: xr.Dataset) -> LargestAlong:
        """Return that of a load over (time, station)."""
        size, load = _largest(found).values, found.attrs["load"]
        k, n = np.unravel_index(np.argmax(size), size.shape)
        at = found["mean"].values[k, n], found["station"].values[n], found["time"].values[k]
        return LargestAlong(load, LOADS[load], float(size[k, n]), *map(float, at))

    @property
    def side(self) -> str:
        """Name of the side on which it lies."""
        return side(self.mean)


def prepare_along_vehicle(study: Study, text: str) -> float | None:
    """Return a time in s, or None for 'peak', once it is certain that the moment along the vehicle can be computed.

    Raises
    ------
    TimeRangeError, DataError
    """
    if study.vehicle is not None:
        load_station_loads(study.vehicle)
    if text == PEAK:
        return None
    try:
        time = float(text)
    except ValueError:
        raise TimeRangeError(f"'{text}' is not a time; give seconds or '{PEAK}'") from None
    study.checked_times([time])
    return time


def write_along_vehicle(
    study: Study, times: list[float], time: float | None, folder: Path
) -> tuple[list[Path], list[LargestAlong]]:
    """Compute the loads along the vehicle at all times, and write NetCDF, CSV and a figure of each.

    Parameters
    ----------
    times : list of float
        Of the envelope, s.
    time : float or None
        Of the section through the vehicle; None takes the time of the largest bending moment.
    folder : Path
        Made and writable.

    Returns
    -------
    list of Path, list of LargestAlong
        Files, and the largest of each load.
    """
    vehicle = study.vehicle_for("the bending moment along the vehicle")
    every = every_load_along_vehicle(study, sorted({*times, *([] if time is None else [time])}), known_loads(vehicle))
    if time is None:
        time = LargestAlong.of(every[0]).time
    written = []
    for found in every:
        name, text = f"{found.attrs['load']}_along_vehicle", along_csv(found)
        written += [
            write_netcdf(found, folder / f"{name}.nc"),
            write_text(folder / f"{name}.csv", text),
            *write_figure(along_figure(found, time, vehicle), folder, name),
        ]
    return written, [LargestAlong.of(found) for found in every]


def along_csv(found: xr.Dataset) -> str:
    """Return a load as tidy CSV, N m or N."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    numbers = [np.broadcast_to(found["mean"].values[:, :, None], found["std"].shape)]
    numbers += [found[name].values for name in COLUMNS[4:]]
    for k, time in enumerate(found["time"].values):
        for n, station in enumerate(found["station"].values):
            for s, source in enumerate(found["source"].values):
                row = (np.format_float_scientific(values[k, n, s], 9) for values in numbers)
                writer.writerow([f"{time:.12g}", f"{station:.9g}", source, *row])
    return buffer.getvalue()


def along_figure(found: xr.Dataset, time: float, vehicle: Vehicle) -> Figure:
    """Return a load over the stations at a time, its envelope over the flight, and both times and stations."""
    name = words(found.attrs["load"])
    factor, unit = display(LOADS[found.attrs["load"]], _largest(found).values)
    panels = 3 if found.sizes["time"] > 1 else 1
    with rc_context(STYLE):
        figure = Figure(figsize=(8.5, 1.2 + 3.5 * panels), layout="constrained")
        outline, *axes = figure.subplots(1 + panels, sharex=True, height_ratios=[0.18, *[1] * panels])
        _tanks(outline, vehicle.folder)
        _section(axes[0], found.sel(time=time), factor)
        axes[0].set_title(f"at {time:g} s, {_told(LargestAlong.of(found.sel(time=[time])))}", loc="left")
        if panels > 1:
            _envelope(axes[1], found, factor)
            begin, end = found["time"].values[[0, -1]]
            largest = LargestAlong.of(found)
            over = f"from {begin:g} to {end:g} s, {_told(largest)}, {largest.time:g} s"
            axes[1].set_title(over, loc="left")
            mesh = axes[2].pcolormesh(
                found["station"], found["time"], factor * _largest(found), shading="gouraud", rasterized=True
            )
            figure.colorbar(mesh, ax=axes[2], label=f"{LABEL} ({unit})", pad=0.01)
            axes[2].axhline(time, color="white", lw=0.8, ls=":")
            axes[2].grid(False)
            axes[2].set_ylabel("flight time (s)")
        for panel in axes[:2]:
            panel.axhline(0, color="black", lw=0.6)
            panel.set_ylabel(f"{name} ({unit})")
            panel.margins(x=0, y=0.2)
            for n, load in enumerate(vehicle.file.loads):
                label = None if n else "load station of the outputs"
                panel.axvline(load.station_m, color="black", lw=0.8, ls=":", label=label)
            panel.legend(loc="upper center", ncols=4, fontsize=8.5)
        axes[-1].set_xlabel("vehicle station, forward to the right (m)")
        figure.suptitle(f"{vehicle.title}\n{name.capitalize()} along the vehicle, with its answer to slosh")
    return figure


def _tanks(axes: Axes, folder: Path) -> None:
    """Draw the tanks of a vehicle whose construction is in its folder."""
    axes.axis("off")
    if not (folder / CONSTRUCTION_FILE).is_file():
        return
    for tank in load_construction(folder).tanks:
        shape = TankShape.of(tank)
        station = np.linspace(shape.edges[0], shape.edges[-1], 200)
        axes.fill_between(station, -shape.radius(station), shape.radius(station), color="grey", alpha=0.45, lw=0)
        middle = 0.5 * (station[0] + station[-1])
        axes.text(middle, 0, words(tank.name).replace(" ", "\n"), fontsize=7, ha="center", va="center")


def _section(axes: Axes, part: xr.Dataset, factor: float) -> None:
    mean, station = part["mean"], part["station"]
    first = str(part["source"].values[0])
    axes.plot(station, factor * mean, color=COLORS["mean"], lw=2, label="mean")
    for source, color, line in ((first, COLORS["wind"], "-"), (COMBINED, COLORS[COMBINED], "--")):
        sigma = part["std"].sel(source=source)
        label = "all sources" if source == COMBINED else f"{words(source)} alone"
        axes.plot(station, factor * (mean + 3 * sigma), line, color=color, lw=1.8, label=f"mean ± 3σ, {label}")
        axes.plot(station, factor * (mean - 3 * sigma), line, color=color, lw=1.8)


def _envelope(axes: Axes, found: xr.Dataset, factor: float) -> None:
    mean, sigma = found["mean"], found["std"].sel(source=COMBINED)
    high, low = (mean + 3 * sigma).max("time"), (mean - 3 * sigma).min("time")
    axes.fill_between(found["station"], factor * low, factor * high, color=COLORS[COMBINED], alpha=0.12, lw=0)
    axes.plot(found["station"], factor * high, color=COLORS[COMBINED], lw=1.8, label="largest mean + 3σ")
    axes.plot(found["station"], factor * low, "--", color=COLORS[COMBINED], lw=1.8, label="least mean - 3σ")
    for edge, label in ((mean.max("time"), "largest and least mean"), (mean.min("time"), None)):
        axes.plot(found["station"], factor * edge, color=COLORS["mean"], lw=1.5, label=label)


def _told(largest: LargestAlong) -> str:
    factor, unit = display(largest.unit, largest.value)
    return f"{LABEL} up to {factor * largest.value:.4g} {unit} ({largest.side}) at {largest.station:.4g} m"


def _largest(found: xr.Dataset) -> xr.DataArray:
    """Return |mean| + 3 sigma from all sources, (time, station)."""
    return larger_side(found["mean"], found["std"].sel(source=COMBINED))
