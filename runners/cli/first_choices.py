"""What a new vehicle is given when it is made: name, title, site, azimuth and month of its wind."""

from __future__ import annotations

import math
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from ...model.construction.construction_entries import ConstructionFile
from ...model.construction.construction_file import CONSTRUCTION_FILE
from ...model.errors import DataError, IntegrationError, ModeError, UnknownNameError
from ...model.files.numbers import parse_number
from ...model.files.toml_file import read_toml
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.vehicle_file import read_vehicle_file
from ...model.wind.range_reference import PERIODS
from .job import on_terminal

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
TOP = 30000.0  # m, of the shipped winds


@dataclass(frozen=True)
class Choices:
    """Choices for a new vehicle; None keeps what the vehicle copied has.

    Attributes
    ----------
    name, title : str, optional
    site : str, optional
    latitude : float, optional
        Of the site (deg).
    azimuth : float, optional
        Of the flight, deg from north towards east.
    month : str, optional
        Of the wind.
    """

    name: str | None = None
    title: str | None = None
    site: str | None = None
    latitude: float | None = None
    azimuth: float | None = None
    month: str | None = None

    def __post_init__(self):
        if self.name is not None and not NAME.fullmatch(self.name):
            raise DataError(f"'{self.name[:60]}' is no name; begin with a letter, then letters, digits and _")
        for what, text in (("title", self.title), ("site", self.site)):
            if text is not None and (not text.strip() or not text.isprintable() or '"' in text or "\\" in text):
                raise DataError(f"the {what} is one line of text without quotes and backslashes")
        if self.latitude is not None and not -90 <= self.latitude <= 90:
            raise DataError(f"the site's latitude is {self.latitude:g} deg; give -90 to 90")
        if self.azimuth is not None and not -360 <= self.azimuth <= 360:
            raise DataError(f"the azimuth is {self.azimuth:g} deg; give 0 to 360, from north towards east")
        if self.month is not None and self.month not in PERIODS:
            raise UnknownNameError("month", self.month, PERIODS)


def site_of(text: str | None) -> tuple[str | None, float | None]:
    """Return name and latitude (deg) of 'NAME' or 'NAME,LATITUDE'."""
    if text is None:
        return None, None
    name, comma, latitude = text.rpartition(",")
    if not comma:
        return text.strip(), None
    try:
        return name.strip(), parse_number(latitude)
    except ValueError:
        raise DataError(f"the site is '{text[:60]}'; write NAME or NAME,LATITUDE in degrees") from None


def asked(choices: Choices, folder: Path) -> Choices:
    """Ask for what was not given, where somebody sits at the terminal; a blank answer keeps what is there."""
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        return choices

    def ask(what: str, given: str | None) -> str | None:
        if given is not None:
            return given
        return typer.prompt(f"{what} (blank: as it is)", default="", show_default=False).strip() or None

    azimuth = None if choices.azimuth is None else f"{choices.azimuth:g}"
    name, title = ask(f"name, of {folder.name}", choices.name), ask("title, of figures", choices.title)
    place = ask("site, NAME or NAME,LATITUDE in deg", choices.site)
    site, latitude = (choices.site, choices.latitude) if place == choices.site else site_of(place)
    towards, month = ask("azimuth of the flight, deg", azimuth), ask("month of the wind", choices.month)
    try:
        turned = None if towards is None else parse_number(towards)
    except ValueError:
        raise DataError(f"the azimuth is '{towards}'; give degrees from north towards east") from None
    return Choices(name, title, site, latitude, turned, month)


def put_in_place(choices: Choices, folder: Path) -> list[str]:
    """Give a copied vehicle its site, azimuth and wind, and build its tables anew for them; return what to know.

    Raises
    ------
    DataError
        The wind cannot be computed for these choices. Where the flight cannot, its tables stay and what is said tells.
    """
    toml, said = folder / CONSTRUCTION_FILE, []
    built = read_toml(toml, ConstructionFile).site if toml.is_file() else None
    if built is None and choices.latitude is not None:
        raise DataError(f"the latitude of a site is used with {CONSTRUCTION_FILE} alone, which this vehicle lacks")
    turned = built is not None and choices.azimuth is not None and choices.azimuth != built.azimuth_deg
    moved = built is not None and (
        choices.site is not None or (choices.latitude is not None and choices.latitude != built.latitude_deg)
    )
    if built is not None and (turned or moved):
        text = toml.read_text(encoding="utf-8")
        values = {"azimuth_deg": choices.azimuth, "latitude_deg": choices.latitude}
        text = _in_section(text, "site", {k: f"{v:.9g}" for k, v in values.items() if v is not None})
        if choices.site is not None:
            text = _in_section(
                text, "site", {"status": '"assumed"', "source": f'"{choices.site}: as given to new-vehicle"'}
            )
        toml.write_text(text, encoding="utf-8")
    record = read_vehicle_file(folder / VEHICLE_FILE).wind.record
    azimuth = choices.azimuth if choices.azimuth is not None else (built.azimuth_deg if built else None)
    if choices.month is not None or choices.azimuth is not None:
        said += _blow(choices, folder, azimuth)
    if turned or moved:
        from ..construct.build_vehicle import build_vehicle

        try:
            with on_terminal():
                build_vehicle(folder)
            said.append("tables built anew for this flight")
        except (DataError, IntegrationError, ModeError) as error:
            why = getattr(error, "why", error)
            said.append(f"the tables are still of the flight copied: {why}; then 'ascentwind build-vehicle'")
    if choices.site is not None and record is not None and choices.site != record.site:
        said.append(
            f"the wind is still that of {record.site}; 'ascentwind wind apply' takes another by --soundings or --matrix"
        )
    return said


def _blow(choices: Choices, folder: Path, azimuth: float | None) -> list[str]:
    """Fit the winds of the vehicle anew, of the month and across the path."""
    from ...model.wind.range_reference import shipped_statistics, shipped_two_components
    from ..wind.apply import apply_components, apply_wind

    entry = read_vehicle_file(folder / VEHICLE_FILE).wind
    record = entry.record
    if record is None or record.edition is None or azimuth is None:
        raise DataError(
            "the vehicle copied does not say which shipped wind it flies in, so that month and azimuth cannot be "
            "changed here; leave them out and use 'ascentwind wind apply'"
        )
    month = choices.month or record.period
    across, where = math.radians(azimuth), f"--period {month} --edition {record.edition}"
    sign = f"--sign {record.sign} {where}"
    toml = folder / VEHICLE_FILE
    if entry.azimuth_deg is not None:
        text = toml.read_text(encoding="utf-8")
        toml.write_text(_in_section(text, "wind", {"azimuth_deg": f"{azimuth:.9g}"}), encoding="utf-8")
    with on_terminal():
        s = shipped_statistics(month, record.component, edition=record.edition, top=TOP)
        command = f"ascentwind wind apply --component {record.component} --azimuth {azimuth:.9g} {sign}"
        apply_wind(folder, s, across, record.sign, command)
        if entry.components is not None:
            command = f"ascentwind wind apply --components both --azimuth {azimuth:.9g} {where}"
            both = shipped_two_components(month, edition=record.edition, top=TOP)
            apply_components(folder, both, across, command)
    return [f"wind: {record.site}, {month}, {record.component} component across a path towards {azimuth:g} deg"]


def _in_section(text: str, name: str, values: dict[str, str]) -> str:
    """Return a TOML file with other values of keys that stand in a section."""
    begin = re.search(rf"(?m)^\[{name}\].*$", text)
    assert begin is not None  # the file was read with one
    end = re.compile(r"(?m)^\[").search(text, begin.end())
    stop = len(text) if end is None else end.start()
    section = text[begin.end() : stop]
    for key, value in values.items():
        section = re.sub(
            rf"(?m)^(\s*{key}\s*=\s*)(\"[^\"\n]*\"|[^\s#]+)", lambda m, v=value: f"{m[1]}{v}", section, count=1
        )
    return text[: begin.end()] + section + text[stop:]
