"""A flight's loads as files: netCDF with one unit a variable, and CSV with units in a column."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ..present.files import write_text
from ..present.netcdf import RULE, one_unit_a_variable, with_conventions, write_netcdf
from ..statistics.results import ResponseStatistics
from .load import FlightLoad
from .passage import Passage

CSV_EVERY = 20  # points of the grid of times in limits.csv
LEVELS = (
    "flight_level", "flight_level_interval", "instant_level", "exceedance_level", "level_without", "wind_interval",
)  # fmt: skip


def write_flight_loads(loads: Sequence[FlightLoad], folder: Path) -> list[Path]:
    """Write flight_load.nc, flight_load.csv (a row a response and probability) and exceedance.csv.

    Parameters
    ----------
    loads : sequence of FlightLoad
        Of one case and window, one a response.
    folder : Path

    Returns
    -------
    list of Path

    Raises
    ------
    OutputFolderError
    """
    texts = {"flight_load.csv": _levels_csv(loads), "exceedance.csv": _exceedance_csv(loads)}
    return [
        write_netcdf(flight_dataset(loads), folder / "flight_load.nc"),
        *(write_text(folder / n, t) for n, t in texts.items()),
    ]


def flight_dataset(loads: Sequence[FlightLoad]) -> xr.Dataset:
    """Return the loads of several responses as files hold them, each variable with its own unit."""
    parts = []
    for load in loads:
        part = load.to_dataset()
        for name in part.data_vars.keys() & set(LEVELS):
            part[name].attrs = {RULE: "response", "long_name": part[name].attrs["long_name"]}
        if load.limits is not None and load.response in load.limits.values:
            passed, left = load.passage.probability, load.passage
            part["limit_passage_probability"] = (
                (),
                passed.value,
                {"units": "1", "long_name": "chance to pass a limit"},
            )
            part["limit_passage_error"] = ((), passed.standard_error, {"units": "1", "long_name": "standard error"})
            part["margin_of_safety"] = ((), left.margin_of_safety, {"units": "1", "long_name": "limit over level, - 1"})
        parts.append(part)
    whole = xr.concat(parts, "response", combine_attrs="drop_conflicts", coords="minimal", compat="override")
    whole = whole.assign_coords(response=[load.response for load in loads])
    return with_conventions(one_unit_a_variable(whole, {"response": [load.unit for load in loads]}))


def with_flight_levels(statistics: ResponseStatistics, loads: Sequence[FlightLoad]) -> ResponseStatistics:
    """Return statistics with the level that flights pass with the first probability, of every response.

    Returns
    -------
    ResponseStatistics
        Over (response) besides: ``flight_level``, ``flight_level_lower`` and ``flight_level_upper``, the ends of the
        95 % interval of the sampling, NaN for a response without a load; ``flight_level_upper_share``, the share of the
        flights that pass it on the upper side. Over (resultant) the first three with ``resultant_`` in front.
    """
    found = {
        load.response: (float(load.level[0]), *load.levels[0].interval, float(load.side_shares.sel(side="upper")[0]))
        for load in loads
    }
    names = [str(name) for name in statistics.dataset["response"].values]
    values = np.array([found.get(name, (np.nan,) * 4) for name in names])
    what = f"that the largest value of a flight passes with probability {loads[0].probabilities[0]:g}"
    labels = {"flight_level": f"level {what}", "flight_level_lower": "lower end", "flight_level_upper": "upper end"}
    variables = {
        name: ("response", values[:, k], {RULE: "response", "long_name": label})
        for k, (name, label) in enumerate(labels.items())
    }
    share = {"units": "1", "long_name": "share of the flights that pass the level which do so on the upper side"}
    variables["flight_level_upper_share"] = ("response", values[:, 3], share)
    if "resultant" in statistics.dataset.dims:
        values = np.array([found.get(str(name), (np.nan,) * 4) for name in statistics.dataset["resultant"].values])
        variables |= {
            f"resultant_{name}": ("resultant", values[:, k], {RULE: "resultant", "long_name": label})
            for k, (name, label) in enumerate(labels.items())
        }
    window = list(loads[0].window)
    of = {"flight_level_window_s": window, "flight_level_probability": loads[0].probabilities[0]}
    return ResponseStatistics(statistics.dataset.assign(variables).assign_attrs(of))


def write_sensitivities(found: Sequence[xr.Dataset], folder: Path) -> Path:
    """Write flight_load_sensitivity.csv, a row a response and parameter, the largest first.

    Parameters
    ----------
    found : sequence of xarray.Dataset
        Of :meth:`FlightLoad.sensitivity`.
    folder : Path

    Raises
    ------
    OutputFolderError
    """
    numbers = ("derivative", "elasticity", "envelope_elasticity")
    rows: list[Sequence[object]] = [
        ("response", "unit", "probability", "level", "parameter", "parameter_unit", "parameter_value", *numbers)
    ]
    for part in found:
        a = part.attrs
        for k, name in enumerate(part["parameter"].values):
            of = str(name), str(part["parameter_unit"].values[k]), f"{float(part['parameter_value'][k]):.9g}"
            values = (f"{float(part[n][k]):.9e}" for n in numbers)
            rows.append((a["response"], a["unit"], f"{a['probability']:g}", f"{a['level']:.9e}", *of, *values))
    text = _csv(rows)
    return write_text(folder / "flight_load_sensitivity.csv", text)


def write_passage(passage: Passage, folder: Path) -> list[Path]:
    """Write limits.nc, of which each load's variables have their own unit, and limits.csv, a row a load and time.

    Returns
    -------
    list of Path

    Raises
    ------
    OutputFolderError
    """
    found = passage.to_dataset()
    for name in ("limit", "level", "margin"):
        found[name].attrs[RULE] = "load"
    labels = [load.label for load in passage.loads]
    whole = found.drop_vars("load_unit").assign_coords(load=labels)
    whole = with_conventions(one_unit_a_variable(whole, {"load": [load.unit for load in passage.loads]}, words={}))
    rows: list[Sequence[object]] = [("load", "unit", "station_m", "time_s", "limit", "level", "margin")]
    values = [found[name].values for name in ("limit", "level", "margin")]
    every = max(1, CSV_EVERY // passage.told.step)
    for r, load in enumerate(passage.loads):
        station = "" if np.isnan(load.station) else f"{load.station:.9g}"
        for k, time in enumerate(found["time"].values[::every]):
            numbers = (f"{part[k * every, r]:.9e}" for part in values)
            rows.append((load.name, load.unit, station, f"{time:.12g}", *numbers))
    text = _csv(rows)
    return [
        write_netcdf(whole, folder / "limits.nc"),
        write_text(folder / "limits.csv", text),
    ]


def _levels_csv(loads: Sequence[FlightLoad]) -> str:
    header = (
        "response", "unit", "sides", "window_begin_s", "window_end_s", "probability", "flight_level", "lower_95",
        "upper_95", "spacing_error", "instant_level", "side", "side_share", "wind_lower_95", "wind_upper_95",
        "independent_samples", "monte_carlo_runs",
    )  # fmt: skip
    rows: list[Sequence[object]] = [header]
    for load in loads:
        known = load.wind_samples is not None
        by_wind = load.wind_interval().values if known else []
        for k, (p, found) in enumerate(zip(load.probabilities, load.levels, strict=True)):
            numbers = found.value, *found.interval, found.probability.spacing_error, float(load.instant_level[k])
            share = f"{float(load.side_shares[k].max()):.6g}" if load.side[k] else ""
            wind = [f"{x:.9e}" for x in by_wind[k]] + [f"{load.wind_samples:g}"] if known else [""] * 3
            rows.append(
                (load.response, load.unit, load.sides, *load.window, f"{p:g}", *(f"{x:.9e}" for x in numbers),
                 load.side[k], share, *wind, load.monte_carlo_runs(p))
            )  # fmt: skip
    return _csv(rows)


def _exceedance_csv(loads: Sequence[FlightLoad]) -> str:
    rows: list[Sequence[object]] = [("response", "unit", "level", "probability", "standard_error")]
    for load in loads:
        curve = load.exceedance
        for level, p, error in zip(curve["level"].values, curve.values, curve["standard_error"].values, strict=True):
            rows.append((load.response, load.unit, *(f"{x:.9e}" for x in (level, p, error))))
    return _csv(rows)


def _csv(rows: Sequence[Sequence[object]]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return buffer.getvalue()
