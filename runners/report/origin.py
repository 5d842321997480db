"""What results rest on: the vehicle's tables with their origin, the wind, noises, versions and hashes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from .figures import curve_ink, lines
from .folder import ResultsFolder
from .parts import Key, Part, Section, Table, Text

VERSIONS = ("ascentwind", "casadi", "numpy", "python", "engine", "relative_tolerance")
HASHES = ("data_sha256", "code_key")


def vehicle(found: ResultsFolder, attrs: Mapping[str, Any]) -> Section:
    """Return what was found, computed and assumed of the vehicle."""
    tables, parts = found.about("tables"), []
    if tables:
        counts = Counter(str(table["status"]) for table in tables)
        told = ", ".join(f"{count} {status}" for status, count in counts.most_common())
        parts.append(Text(f"{len(tables)} tables over time or altitude: {told}."))
        rows = [(t["file"], t["status"], f"{t['first']:g} to {t['last']:g}", t["source"]) for t in tables]
        parts.append(Table("Where the numbers come from", ("table", "status", "covers", "source"), rows))
    elif "tables" in attrs:
        rows = [line.partition(": ")[::2] for line in str(attrs["tables"]).split("; ")]
        parts.append(Table("Where the numbers come from", ("table", "status"), rows))
    if noises := found.about("noises"):
        rows = [
            (n["name"].replace("_", " "), f"{n['sigma']:g}",
             "white" if n.get("white") else f"{n['correlation_time_s']:g} s", n["of"], n["source"])
            for n in noises
        ]  # fmt: skip
        head = ("noise", "sigma", "correlation time", "relative deviation of", "source")
        parts.append(Table("Noises of the vehicle", head, rows))
    facts = [(key.replace("_", " "), str(attrs[key])) for key in ("structure", "changed_parameters") if key in attrs]
    facts += [(f"option {name}", value) for name, value in (found.about("options") or {}).items()]
    if facts:
        parts.append(Table("Its equations", ("what", "is"), facts))
    return Section("vehicle", "The vehicle, and where its numbers come from", parts)


def wind(found: ResultsFolder) -> Section | None:
    """Return the wind: its statistics, how it is taken, and its mean and sigma over altitude."""
    about = found.about("wind")
    if not about:
        return None
    units = {"azimuth_deg": " deg", "held_above_m": " m"}
    names = ("statistics", "filter", "azimuth_deg", "held_above_m", "independent_samples", "turbulence", "source")
    shown = {"azimuth_deg": "azimuth of the flight", "held_above_m": "last values held above"}
    rows = [
        (
            shown.get(n, n.replace("_", " ")),
            f"{about[n]:g}{units.get(n, '')}" if isinstance(about[n], float) else about[n],
        )
        for n in names
        if n in about
    ]
    parts: list[Part] = [Table("Of which statistics", ("what", "is"), rows)]
    for k, (name, columns) in enumerate(about.get("components", {}).items()):
        altitude = [h / 1000 for h in columns["altitude_m"]]
        mean, key = columns["mean_m_s"], Key("mean", "mean")
        curves, band = [(key, mean)], None
        if sigma := columns.get("standard_deviation_m_s"):
            low, high = ([m + side * s for m, s in zip(mean, sigma, strict=True)] for side in (-1, 1))
            band = Key("mean ± sigma", curve_ink(k), "band"), low, high
        what = "wind" if name == "wind" else f"{name} wind"
        parts.append(
            lines(
                f"{what.capitalize()} over altitude",
                f"Mean of the {what} and one sigma about it over altitude; the mean is at most {max(mean):.3g} m/s.",
                ("altitude (km)", altitude),
                curves,
                f"{what} (m/s)",
                band,
            )
        )
    return Section("wind", "The wind", parts, wide=True)


def made(found: ResultsFolder, attrs: Mapping[str, Any]) -> Section:
    """Return versions, hashes, and the commands that make the results again."""
    parts: list[Part] = []
    for entry in found.entries.values():
        if typed := entry.about.get("typed"):
            parts.append(Text(str(typed), "code"))
    if parts:
        parts.insert(0, Text("The commands that made these results, in a folder where their files are:"))
    rows = [(key.replace("_", " "), str(attrs[key])) for key in (*VERSIONS, *HASHES) if key in attrs]
    if rows:
        parts.append(Table("Versions and hashes", ("what", "is"), rows))
    files = [(name, entry.command, digest) for entry in found.entries.values() for name, digest in entry.hashes.items()]
    if files:
        parts.append(Table("Files, with their SHA-256", ("file", "written by", "SHA-256"), files, folded=True))
    return Section("made", "How to make it again", parts)
