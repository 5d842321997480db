"""Putting a wind into a vehicle folder: filter, mean, standard deviation and record together, or nothing."""

from __future__ import annotations

import json
import math
import re
import shutil
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...model.construction.construction_entries import ConstructionFile
from ...model.construction.construction_file import CONSTRUCTION_FILE
from ...model.errors import DataError, OutputFolderError
from ...model.files.folder_files import unsafe_to_copy
from ...model.files.toml_file import read_toml
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.trial_load import load_trial
from ...model.wind.filter_file import filter_text, two_component_filter_text
from ...model.wind.range_reference import EDITIONS
from ...model.wind.record import BOTH, COMPONENTS, WindRecord
from ...model.wind.statistics import TwoComponentStatistics, WindStatistics
from ...model.wind.two_components import TwoComponentFilter, wind_correlation
from ..present.files import write_text
from ..solvers.least_squares import FitOptions
from .synthesis.result import SynthesisResult
from .synthesis.synthesise import synthesise
from .two_component_fit import fit_noise_correlation

DECIMALS = 3  # of a table of soundings, m/s, and of their number
AZIMUTH_TOLERANCE = 1e-6  # deg
KEPT = ("turbulence", "components")  # of [wind]: turbulence goes with any wind, two components with both planes

_HEADER = re.compile(r"""^\s*\[\[?\s*(?P<name>[A-Za-z0-9_."'-]+)\s*\]\]?\s*(#.*)?$""")


@dataclass(frozen=True, eq=False)
class AppliedWind:
    """What was put into a vehicle: the record, the fit of its filter and the files written.

    ``unused``: files that the wind before was read from; ``title``: the vehicle's, which may still name that wind.
    """

    record: WindRecord
    fit: SynthesisResult
    files: tuple[Path, ...]
    unused: tuple[str, ...]
    title: str


def flight_azimuth(folder: Path, given: float | None) -> float:
    """Return the azimuth of a vehicle's flight in rad, as given in deg or as construction.toml has it.

    Raises
    ------
    DataError
        Neither is there, or both and they differ.
    """
    file = folder / CONSTRUCTION_FILE
    built = read_toml(file, ConstructionFile).site.azimuth_deg if file.is_file() else given
    if built is None:
        raise DataError(
            "the azimuth of the flight is not known; give --azimuth, deg from north towards east", file=folder
        )
    if given is not None and abs(built - given) > AZIMUTH_TOLERANCE:
        raise DataError(
            f"is {built:g}, but --azimuth {given:g} was given; leave that out or correct the file and build the "
            "vehicle again",
            file=file,
            column="site.azimuth_deg",
        )
    return math.radians(built)


def apply_wind(
    folder: Path,
    statistics: WindStatistics,
    azimuth: float,
    sign: int,
    command: str,
    options: FitOptions | None = None,
) -> AppliedWind:
    """Fit a filter and write it with its table and the [wind] of vehicle.toml.

    The vehicle is loaded with its new wind in a temporary folder before any file changes. New files never overwrite
    others, and vehicle.toml is put in place last and whole: it always names one wind.

    Parameters
    ----------
    folder : Path
        Holds ``vehicle.toml``.
    statistics : WindStatistics
        With their origin.
    azimuth : float
        Of the flight, rad from north towards east.
    sign : {1, -1}
        1 when the component's positive direction is the vehicle's +Y.
    command : str
        For the comments of the files.
    options : FitOptions, optional

    Raises
    ------
    DataError
        A wind that does not fit the vehicle, or a vehicle.toml whose [wind] cannot be replaced.
    OutputFolderError
    """
    assert statistics.origin is not None
    samples = round(float(statistics.independent_samples), DECIMALS)
    highest = float(statistics.altitude[-1])
    record = WindRecord(statistics.origin, azimuth, sign, highest, statistics.source, samples)
    toml = folder / VEHICLE_FILE
    before = _text_of(toml)
    _with_section(
        before, _wind_section(record, "", "", command, before), ("wind",), toml
    )  # told before a fit of a minute
    fit = synthesise(statistics, "state-space", 3, options, noises=2)
    made = replace(fit.shaping_filter, source=f"{fit.shaping_filter.source}; written by '{_line(command)}'")

    def naming(table: str, filter_file: str) -> str:
        return _with_section(before, _wind_section(record, table, filter_file, command, before), ("wind",), toml)

    of = f"wind {statistics.name}"
    texts = _put_in_place(toml, of, _table_text(statistics, record, command), filter_text(made), naming)
    table_file, filter_file, _ = texts
    earlier = [_named(before, key) for key in ("statistics", "filter")]
    unused = tuple(name for name in earlier if name not in ("", table_file.name, filter_file.name))
    return AppliedWind(record, fit, tuple(texts), unused, str(tomllib.loads(texts[toml])["title"]))


@dataclass(frozen=True, eq=False)
class AppliedComponents:
    """What was put into a vehicle: both filters' errors (m2/s2), their winds' correlation and the files written.

    ``correlation_error``: the largest difference of the winds' correlation from the statistics' at equal levels.
    """

    record: WindRecord
    fits: tuple[SynthesisResult, SynthesisResult]
    correlation_error: float
    files: tuple[Path, ...]


def apply_components(
    folder: Path, statistics: TwoComponentStatistics, azimuth: float, command: str, options: FitOptions | None = None
) -> AppliedComponents:
    """Fit filters of both components and write them with their table and [wind.components] of vehicle.toml.

    The [wind] of one plane stays; its ``azimuth_deg`` is written where there is none. Otherwise as :func:`apply_wind`.

    Parameters
    ----------
    folder : Path
        Holds ``vehicle.toml``.
    statistics : TwoComponentStatistics
        With their origins.
    azimuth : float
        Of the flight, rad from north towards east.
    command : str
        For the comments of the files.
    options : FitOptions, optional

    Raises
    ------
    DataError
        A wind that does not fit the vehicle, or a vehicle.toml whose [wind.components] cannot be replaced.
    OutputFolderError
    """
    zonal, meridional = statistics.zonal, statistics.meridional
    assert zonal.origin is not None
    origin = replace(zonal.origin, component=BOTH)
    samples = round(min(float(s.independent_samples) for s in (zonal, meridional)), DECIMALS)
    record = WindRecord(origin, azimuth, 1, float(zonal.altitude[-1]), zonal.source, samples)
    toml = folder / VEHICLE_FILE
    before = _text_of(toml)
    _with_components(before, record, "", "", command, toml)
    fits = tuple(synthesise(s, "state-space", 3, options, noises=2) for s in (zonal, meridional))
    made = [replace(f.shaping_filter, source=f"{f.shaping_filter.source}; by '{_line(command)}'") for f in fits]
    deviations, wanted = (zonal.standard_deviation, meridional.standard_deviation), statistics.intralevel_correlation
    r, start = fit_noise_correlation(made[0], made[1], zonal.altitude, wanted, deviations)
    filters = TwoComponentFilter(made[0], made[1], r, start)
    own = wind_correlation(filters.joint, filters.zonal.order, zonal.altitude)

    def naming(table: str, filter_file: str) -> str:
        return _with_components(before, record, table, filter_file, command, toml)

    table, coefficients = _components_table(statistics, record, command), two_component_filter_text(filters)
    texts = _put_in_place(toml, f"wind {origin.period} components", table, coefficients, naming, {"planes": BOTH})
    return AppliedComponents(record, (fits[0], fits[1]), float(np.abs(own - wanted).max()), tuple(texts))


def _with_components(text: str, record: WindRecord, table: str, filter_file: str, command: str, toml: Path) -> str:
    """Return the text of a vehicle.toml with other [wind.components] and, where there is none, wind.azimuth_deg."""
    azimuth_deg = round(math.degrees(record.azimuth), 9)
    stated = (_parsed(text) or {}).get("wind", {}).get("azimuth_deg")
    if stated is not None and abs(stated - azimuth_deg) > AZIMUTH_TOLERANCE:
        raise DataError(f"is {stated:g}, but the wind is for {azimuth_deg:g}", file=toml, column="wind.azimuth_deg")
    if stated is None:
        text = re.sub(r"(?m)^(\s*\[wind\][^\n]*\n)", rf"\1azimuth_deg = {azimuth_deg}\n", text, count=1)
    if (_parsed(text) or {}).get("wind", {}).get("azimuth_deg") is None:
        raise DataError("holds no section [wind] that azimuth_deg could stand in", file=toml, column="wind")
    origin = record.origin
    section = _section_text(
        {
            "wind.components": {"filter": filter_file},
            "wind.components.statistics": _statistics_entry(record, table),
            "wind.components.record": {
                "site": origin.site,
                "period": origin.period,
                "edition": origin.edition,
                "held_above_m": record.held_above,
                "source": record.source,
                "independent_samples": record.independent_samples,
            },
        },
        command,
    )
    return _with_section(text, section, ("wind", "components"), toml)


def _components_table(statistics: TwoComponentStatistics, record: WindRecord, command: str) -> str:
    z, m = statistics.zonal, statistics.meridional
    names = [f"{name}_{component} [m/s]" for component in COMPONENTS for name in ("mean", "standard_deviation")]
    lines = [
        f"# {_line(z.source)}",
        f"# {record.origin.period}, zonal positive towards the east, meridional towards the north",
        f"# written by '{_line(command)}'",
        ",".join(["altitude [m]", *names, "correlation [1]"]),
    ]
    columns = (z.mean, z.standard_deviation, m.mean, m.standard_deviation)
    for i, h in enumerate(z.altitude):
        values = [f"{round(float(column[i]), DECIMALS) + 0.0:g}" for column in columns]
        lines.append(",".join([f"{h:.10g}", *values, f"{round(float(statistics.intralevel_correlation[i]), 4):g}"]))
    return "\n".join(lines) + "\n"


def _text_of(toml: Path) -> str:
    try:
        return toml.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"cannot be read ({error})", file=toml) from None


def _put_in_place(
    toml: Path,
    name: str,
    table: str,
    coefficients: str,
    naming: Callable[[str, str], str],
    changes: Mapping[str, Any] | None = None,
) -> dict[Path, str]:
    """Write table and filter in files of their own and the vehicle.toml that names them, once it has been tried.

    ``naming`` returns the text of vehicle.toml with the names of both files. Returns what is written, in this order.
    """
    folder, stem = toml.parent, re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    table_file = _unused(folder, stem, ".csv", table)
    filter_file = _unused(folder, f"{stem}_filter", ".json", coefficients)
    texts = {table_file: table, filter_file: coefficients, toml: naming(table_file.name, filter_file.name)}
    _try(folder, {path.name: text for path, text in texts.items()}, changes)
    _write(texts, toml)
    return texts


def _write(texts: dict[Path, str], toml: Path) -> None:
    """Write files whole, vehicle.toml last; new ones go again if it is not reached."""
    new = [path for path in texts if not path.exists()]
    try:
        for path, text in texts.items():
            write_text(path, text)
    except BaseException:
        if toml.read_text(encoding="utf-8") != texts[toml]:
            for path in new:
                path.unlink(missing_ok=True)
        raise


def _try(folder: Path, texts: dict[str, str], changes: Mapping[str, Any] | None = None) -> None:
    try:
        with tempfile.TemporaryDirectory() as work:
            made = Path(work) / "vehicle"
            shutil.copytree(folder, made, copy_function=shutil.copyfile, ignore=unsafe_to_copy(folder))
            for name, text in texts.items():
                (made / name).write_text(text, encoding="utf-8")
            load_trial(made, folder, changes)
    except OSError as error:
        raise OutputFolderError(f"{folder} cannot be copied to try its wind ({error.strerror or error})") from None


def _unused(folder: Path, stem: str, suffix: str, text: str) -> Path:
    """Return a file that is not there yet, or that holds the text already."""
    number, path = 1, folder / f"{stem}{suffix}"
    while path.exists() and not (path.is_file() and path.read_bytes() == text.encode()):
        number += 1
        path = folder / f"{stem}_{number}{suffix}"
    return path


def _table_text(statistics: WindStatistics, record: WindRecord, command: str) -> str:
    towards = {("zonal", 1): "east", ("zonal", -1): "west", ("meridional", 1): "north", ("meridional", -1): "south"}
    plus = towards[record.origin.component, record.sign]
    lines = [
        f"# {_line(statistics.source)}",
        f"# {record.origin.period} {record.origin.component}, positive along the vehicle's +Y, towards the {plus}",
        f"# written by '{_line(command)}'",
        "altitude [m],mean [m/s],standard_deviation [m/s]",
    ]
    for h, mean, sigma in zip(statistics.altitude, statistics.mean, statistics.standard_deviation, strict=True):
        lines.append(f"{h:.10g},{round(record.sign * mean, DECIMALS) + 0.0:g},{round(sigma, DECIMALS):g}")
    return "\n".join(lines) + "\n"


def _line(text: str) -> str:
    return " ".join(text.split())


def _wind_section(record: WindRecord, table: str, filter_file: str, command: str, before: str) -> str:
    """Return the section of one wind; what turns two components stays as the file before had it."""
    wind = (_parsed(before) or {}).get("wind", {})
    kept = {key: wind[key] for key in ("azimuth_deg", "pitch_wind") if isinstance(wind, dict) and key in wind}
    origin = record.origin
    entries: dict[str, dict[str, Any]] = {
        "wind": {**kept, "filter": filter_file},
        "wind.statistics": _statistics_entry(record, table),
        "wind.record": {
            "site": origin.site,
            "component": origin.component,
            "period": origin.period,
            "edition": origin.edition,
            "azimuth_deg": round(math.degrees(record.azimuth), 9),
            "sign": record.sign,
            "held_above_m": record.held_above,
            "source": record.source,
            "independent_samples": record.independent_samples,
        },
    }
    return _section_text(entries, command)


def _statistics_entry(record: WindRecord, table: str) -> dict[str, str]:
    return {
        "file": table,
        "status": "found" if record.origin.edition in EDITIONS else "computed",
        "source": record.source,
        "interpolation": "pchip",
    }


def _section_text(entries: Mapping[str, Mapping[str, Any]], command: str) -> str:
    lines = []
    for section, values in entries.items():
        lines += [f"[{section}]", *(f"{k} = {json.dumps(v, ensure_ascii=False)}" for k, v in values.items()), ""]
    lines.insert(1, f"# written by '{_line(command)}'; another wind in the same way, not by hand")
    return "\n".join(lines)


def _with_section(text: str, section: str, name: tuple[str, ...], file: Path) -> str:
    """Return the text of a vehicle.toml with another section of a dotted name and its parts; all else stays."""
    kept: list[str] = []
    dropped: list[str] = []
    place, inside = None, False
    for line in text.splitlines(keepends=True):
        header = _HEADER.match(line)
        if header:
            parts = tuple(part.strip("\"'") for part in header["name"].split("."))
            inside = parts[: len(name)] == name and not (len(name) == 1 and parts[1:2] and parts[1] in KEPT)
            if inside:
                place = len(kept) if place is None else place
                dropped = []
            else:
                kept += _last_comments(dropped)
                dropped = []
        (dropped if inside else kept).append(line)
    place = len(kept) if place is None else place
    head, tail = "".join(kept[:place]).rstrip("\n"), "".join(kept[place:])
    changed = f"{head}\n\n{section}\n{tail}" if tail else f"{head}\n\n{section}"
    before = _parsed(text)
    if before is None or _parsed(changed) != _replaced(before, tomllib.loads(section), name):
        raise DataError(
            "the wind does not stand in [wind] and [wind.NAME] sections of their own in a valid TOML file; write it "
            "so, then apply again",
            file=file,
            column="wind",
        )
    return changed


def _replaced(before: dict[str, Any], section: dict[str, Any], name: tuple[str, ...]) -> dict[str, Any]:
    """Return what a file should hold once a section has taken its place."""
    first, rest = name[0], name[1:]
    if rest:
        return before | {first: _replaced(before[first], section[first], rest)}
    wind = before.get(first)
    kept = {k: wind[k] for k in KEPT if name == ("wind",) and isinstance(wind, dict) and k in wind}
    return before | {first: section[first] | kept}


def _last_comments(lines: list[str]) -> list[str]:
    """Return the comment lines at the end, which stand above the next section and belong to it."""
    count = 0
    while count < len(lines) and lines[-1 - count].lstrip().startswith("#"):
        count += 1
    return lines[len(lines) - count :]


def _named(text: str, key: str) -> str:
    """Return the file that the [wind] of a TOML text names as its filter or statistics; empty without one."""
    entry = (_parsed(text) or {}).get("wind", {}).get(key, "")
    return str(entry.get("file", "") if isinstance(entry, dict) else entry)


def _parsed(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return None
