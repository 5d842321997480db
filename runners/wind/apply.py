"""Putting a wind into a vehicle folder: filter, mean, standard deviation and record together, or nothing."""

from __future__ import annotations

import json
import math
import re
import shutil
import tempfile
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...model.construction.construction_entries import ConstructionFile
from ...model.construction.construction_file import CONSTRUCTION_FILE
from ...model.errors import DataError, OutputFolderError
from ...model.files.folder_files import unsafe_to_copy
from ...model.files.toml_file import read_toml
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.trial_load import load_trial
from ...model.wind.filter_file import filter_text
from ...model.wind.range_reference import EDITIONS
from ...model.wind.record import WindRecord
from ...model.wind.statistics import WindStatistics
from ..present.files import write_whole
from ..solvers.least_squares import FitOptions
from .synthesis.result import SynthesisResult
from .synthesis.synthesise import synthesise

DECIMALS = 3  # of a table of soundings, m/s, and of their number
AZIMUTH_TOLERANCE = 1e-6  # deg
KEPT = "turbulence"  # of [wind]: it goes with any wind

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
    try:
        before = toml.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"cannot be read ({error})", file=toml) from None
    _with_wind(before, _wind_section(record, "", "", command), toml)  # told before a fit of a minute
    fit = synthesise(statistics, "state-space", 3, options, noises=2)
    made = replace(fit.shaping_filter, source=f"{fit.shaping_filter.source}; written by '{_line(command)}'")
    stem = re.sub(r"[^a-z0-9]+", "_", f"wind {statistics.name}".lower()).strip("_")
    table, coefficients = _table_text(statistics, record, command), filter_text(made)
    table_file = _unused(folder, stem, ".csv", table)
    filter_file = _unused(folder, f"{stem}_filter", ".json", coefficients)
    after = _with_wind(before, _wind_section(record, table_file.name, filter_file.name, command), toml)
    texts = {table_file: table, filter_file: coefficients, toml: after}
    _try(folder, {path.name: text for path, text in texts.items()})
    new = [path for path in texts if not path.exists()]
    try:
        for path, text in texts.items():
            write_whole(path, lambda p, text=text: p.write_text(text, encoding="utf-8"))
    except BaseException:
        if toml.read_text(encoding="utf-8") != after:
            for path in new:
                path.unlink(missing_ok=True)
        raise
    earlier = [_named(before, key) for key in ("statistics", "filter")]
    unused = tuple(name for name in earlier if name not in ("", table_file.name, filter_file.name))
    return AppliedWind(record, fit, tuple(texts), unused, str(tomllib.loads(after)["title"]))


def _try(folder: Path, texts: dict[str, str]) -> None:
    try:
        with tempfile.TemporaryDirectory() as work:
            made = Path(work) / "vehicle"
            shutil.copytree(folder, made, copy_function=shutil.copyfile, ignore=unsafe_to_copy(folder))
            for name, text in texts.items():
                (made / name).write_text(text, encoding="utf-8")
            load_trial(made, folder)
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


def _wind_section(record: WindRecord, table: str, filter_file: str, command: str) -> str:
    origin = record.origin
    entries = {
        "wind": {"filter": filter_file},
        "wind.statistics": {
            "file": table,
            "status": "found" if origin.edition in EDITIONS else "computed",
            "source": record.source,
            "interpolation": "pchip",
        },
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
    lines = []
    for section, values in entries.items():
        lines += [f"[{section}]", *(f"{k} = {json.dumps(v, ensure_ascii=False)}" for k, v in values.items()), ""]
    lines.insert(1, f"# written by '{_line(command)}'; another wind in the same way, not by hand")
    return "\n".join(lines)


def _with_wind(text: str, section: str, file: Path) -> str:
    """Return the text of a vehicle.toml with another [wind] and its parts; turbulence and all else stay as they are."""
    kept: list[str] = []
    dropped: list[str] = []
    place, inside = None, False
    for line in text.splitlines(keepends=True):
        header = _HEADER.match(line)
        if header:
            keys = [key.strip("\"'") for key in header["name"].split(".")]
            inside = keys[0] == "wind" and keys[1:2] != [KEPT]
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
    expected = tomllib.loads(section)
    wind = (before or {}).get("wind")
    if isinstance(wind, dict) and KEPT in wind:
        expected["wind"][KEPT] = wind[KEPT]
    if before is None or _parsed(changed) != before | expected:
        raise DataError(
            "the wind does not stand in [wind] and [wind.NAME] sections of their own in a valid TOML file; write it "
            "so, then apply again",
            file=file,
            column="wind",
        )
    return changed


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
