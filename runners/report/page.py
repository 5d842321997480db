"""The page: which sections a folder gives, what is missing, and all of it as one HTML file that asks for nothing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup as Safe

from ...model.errors import DataError
from ..present.wording import words
from ..statistics.files import NAME as STATISTICS
from ..statistics.results import ResponseStatistics
from . import derivatives, loads, origin, other_files, responses
from .figures import INKS
from .folder import ResultsFolder, open_folder, stored, stored_attributes
from .parts import Figure, Part, Section, Text

NAME = "report.html"
FIRST = {  # command: heading of what it wrote
    "run": "Statistics of the responses",
    "flight-load": "The load of a whole flight",
    "sensitivity": "What drives it",
    "study": "Parameter study",
    "design": "Load relief",
    "day-of-launch": "Day of launch",
    "fly": "Flown through measured winds",
    "availability": "Launch availability",
    "gust": "Discrete gusts",
    "export": "Exported matrices",
    "mean": "The mean flight",
    "wind-plot": "The wind's filter against its data",
}
WANTED = {  # file: what a page of a vehicle's run shows of it, and the command that writes it
    STATISTICS: ("peaks, shares and curves", "ascentwind run {of} --out {folder}"),
    "flight_load.nc": (
        "the load of the whole flight with its exceedance",
        "ascentwind flight-load {of} --out {folder}",
    ),
    "sensitivity.nc": ("sensitivities, ranked", "ascentwind sensitivity {of} --out {folder}"),
    "limits.nc": ("limits and margins", "ascentwind flight-load {of} --limit FILE --out {folder}"),
}
MEANING = (
    "Numbers are of the linear equations about the mean flight: large angles, stalled flow and engines at their stops "
    "are not in them.",
    "|mean| + 3 sigma is of one instant; over a whole flight the largest value passes it more often, and the flight's "
    "level says how often.",
    "Winds are taken as Gaussian with the statistics named here; their tails, and errors of the statistics and of the "
    "vehicle's tables, are not in the probabilities.",
    "Two engines that agree have solved the same equations: that says nothing of the vehicle's data.",
)


@dataclass(frozen=True)
class Page:
    """What stands on a page.

    Attributes
    ----------
    title, question : str
    answer : tuple of str
    sections : tuple of Section
    """

    title: str
    question: str
    answer: tuple[str, ...]
    sections: tuple[Section, ...]

    def html(self) -> str:
        """Return the page, self-contained: scripts, styles, figures and data are inside."""
        from bokeh.resources import Resources

        figures = [part for section in self.sections for part in section.parts if isinstance(part, Figure)]
        items = [_item(figure, f"figure-{k}") for k, figure in enumerate(figures, 1)]
        places = {id(figure): f"figure-{k}" for k, figure in enumerate(figures, 1)}
        environment = Environment(
            loader=PackageLoader(__package__ or "", "templates"), autoescape=True, trim_blocks=True, lstrip_blocks=True
        )
        library = Resources(mode="inline", components=["bokeh"], minified=True).js_raw
        return environment.get_template("report.html").render(
            page=self,
            places=places,
            inks=INKS,
            style=Safe(_template("report.css")),
            script=Safe(_template("report.js")),
            bokeh=Safe("\n".join(library)) if figures else "",
            data=Safe(_json(items)),
            inks_json=Safe(_json(INKS)),
            version=version("ascentwind"),
            id=id,
        )


def page_of(folder: Path) -> Page:
    """Return the page of a results folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    ResultsFolderError, DataError
    """
    found = open_folder(folder)
    attrs = _attributes(found)
    title = str(found.about("title") or attrs.get("title") or attrs.get("system") or found.of)
    statistics = _statistics(found)
    first: list[Section] = []
    shown = {STATISTICS}
    if statistics is not None:
        peaks = [*responses.peak_table(statistics)]
        first.append(Section("peaks", "Peaks, and the level of the flight", peaks))
        if "run" in found.entries and found.about("title") is not None:
            first.append(Section("verdict", "Two engines", responses.verdict(statistics)))
        first.append(Section("shares", "Where the spread comes from", responses.shares(statistics)))
        first.append(responses.curves(statistics))
        shown |= {f"{name}.png" for name in statistics.dataset["response"].values} | {"statistics.csv"}
    first += _flight(found, shown)
    if (path := found.path("sensitivity.nc")) is not None:
        parts = derivatives.sensitivities(_sensitivity(path))
        first.append(Section("sensitivity", "What drives it", parts))
        shown |= {path.name, "sensitivity.csv", "sensitivity_tornado.png"}
    first += _others(found, shown)
    for name in found.filters:
        parts = other_files.wind_filter(folder / name)
        first.append(Section(f"filter-{len(first)}", f"Wind filter {Path(name).stem}", parts, wide=True))
    sections = [*first, _notes(found)]
    if found.entries:
        sections += [s for s in (origin.vehicle(found, attrs), origin.wind(found)) if s is not None and s.parts]
    sections += [_missing(found), origin.made(found, attrs)]
    answer = responses.sentence(statistics) if statistics is not None else []
    return Page(title, _question(found, title, statistics), tuple(answer), tuple(s for s in sections if s.parts))


def _statistics(found: ResultsFolder) -> ResponseStatistics | None:
    path = found.path(STATISTICS)
    if path is None:
        return None
    statistics = ResponseStatistics.open(path)
    if "member" in statistics.dataset.dims:
        raise DataError("is of a batch; a report is of one vehicle, so save one member: stats.sel(member=0)", file=path)
    return statistics


def _attributes(found: ResultsFolder) -> Mapping[str, Any]:
    """Return what the first NetCDF file says it was computed from."""
    names = [name for entry in found.entries.values() for name in entry.files if name.endswith(".nc")]
    return stored_attributes(found.folder / names[0]) if names else {}


def _question(found: ResultsFolder, title: str, statistics: ResponseStatistics | None) -> str:
    if statistics is not None:
        names = [words(str(name)) for name in statistics.dataset["response"].values]
        times = statistics.dataset["time"].values
        shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more responses" if len(names) > 3 else "")
        span = f"between {times[0]:g} and {times[-1]:g} s" if times.size > 1 else f"at {times[0]:g} s"
        return f"How large are {shown} of {title} {span}, with what spread, and from which source?"
    if found.entries:
        asked = ", ".join(FIRST.get(name, name).lower() for name in found.entries)
        return f"{title}: {asked}."
    return "Filters that turn white noise into the wind of given statistics."


def _flight(found: ResultsFolder, shown: set[str]) -> list[Section]:
    sections = []
    limits: list[Part] = []
    if (path := found.path("flight_load.nc")) is not None:
        levels = stored(path)
        sections.append(Section("flight", "The load of a whole flight", loads.levels(levels), wide=True))
        limits += loads.limits_over_time(levels)
        shown |= {path.name, "flight_load.csv", "exceedance.csv"}
        shown |= {f"exceedance_{name}.png" for name in levels["response"].values}
    if (path := found.path("limits.nc")) is not None:
        limits += loads.limits_together(stored(path))
        shown |= {path.name, "limits.csv"}
    return [*sections, Section("limits", "Limits and margins", limits, wide=True)]


def _sensitivity(path: Path) -> Any:
    found = stored(path)
    if not {"parameter", "elasticity", "derivative", "parameter_value"} <= set(found.variables):
        raise DataError("holds no sensitivities of this version; compute them again", file=path)
    return found


def _others(found: ResultsFolder, shown: set[str]) -> list[Section]:
    """Return what each command wrote that stands nowhere yet, the run's own figures last."""
    sections = []
    for command, entry in sorted(found.entries.items(), key=lambda item: item[0] == "run"):
        paths = [found.folder / name for name in entry.files]
        heading = FIRST.get(command, words(command).capitalize())
        if command in ("run", "flight-load", "sensitivity"):
            heading = f"More figures of '{command}'"
        sections.append(other_files.section(f"of-{command}", heading, paths, shown))
        shown |= set(entry.files)
    return sections


def _notes(found: ResultsFolder) -> Section:
    parts: list[Part] = [
        Text(f"{command}: {text}", "bad") for command, texts in found.each("warnings") for text in texts
    ]
    parts += [Text(f"{command}: {text}") for command, texts in found.each("notes") for text in texts]
    if found.entries:
        parts += [Text(text, "note") for text in MEANING]
    return Section("notes", "Warnings, and what the numbers do not say", parts)


def _missing(found: ResultsFolder) -> Section:
    """Return what a page could show and this folder does not hold, with the command that adds it."""
    parts: list[Part] = []
    if {"run", "flight-load", "sensitivity"} & found.entries.keys() and found.about("tables"):
        for name, (what, command) in WANTED.items():
            if found.path(name) is None:
                parts.append(Text(f"Not here: {what}. To add it: {command.format(of=found.of, folder=found.folder)}"))
    for command in found.unfinished:
        parts.append(Text(f"'ascentwind {command}' began here and did not end; nothing of it is shown.", "bad"))
    for command, entry in found.entries.items():
        if entry.missing:
            told = ", ".join(entry.missing)
            parts.append(Text(f"Written by 'ascentwind {command}', gone or changed since: {told}.", "bad"))
        elif not entry.hashes:
            parts.append(Text("The folder has no manifest: nothing says that its files are of one run.", "bad"))
    if found.others:
        parts.append(Text(f"In the folder and of none of these runs, so not shown: {', '.join(found.others)}.", "bad"))
    return Section("missing", "What is not here", parts)


def _item(part: Figure, place: str) -> dict[str, Any]:
    """Return a figure as bokeh's script embeds it, without the random name that its own json_item would give it."""
    from bokeh.document import Document

    document = Document()
    document.add_root(part.model)
    written: dict[str, Any] = {**document.to_json(deferred=False)}
    return {"target_id": place, "root_id": part.model.id, "doc": written, "version": written["version"]}


def _json(value: Any) -> str:
    """Return JSON that no text in it can end the script of."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")


def _template(name: str) -> str:
    return (Path(__file__).parent / "templates" / name).read_text(encoding="utf-8")
