"""What every command has beside its own: tables as JSON, and at the end a hint at the next command."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from ..present.terminal import errors, machine_reads

# by command: what is typed next, and what for; in braces its own arguments, and the folder or file that it wrote
NEXT: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (("report {folder}", "one page of it"), ("sensitivity {vehicle}", "what drives the peak")),
    "flight-load": (("report {folder}", "one page of it"), ("flight-load {vehicle} --limit FILE", "what limits leave")),
    "gust": (("run {vehicle}", "the random wind"), ("report {folder}", "one page of it")),
    "fly": (("flight-load {vehicle}", "what the Gaussian wind gives"), ("report {folder}", "one page of it")),
    "day-of-launch": (("report {folder}", "one page of it"),),
    "availability": (("report {folder}", "one page of it"), ("day-of-launch {vehicle}", "the check on the day")),
    "verify": (("run {vehicle}", "tables and figures"),),
    "tolerance": (("run {vehicle} --tolerance T", "with a tolerance of your own"),),
    "sensitivity": (
        ("report {folder}", "one page of it"),
        ("study FILE.toml", "large changes, as docs/studies.md says"),
    ),
    "mean": (("run {vehicle}", "the spread about the mean"),),
    "inspect": (("run {vehicle}", "the statistics over the flight"),),
    "export": (("report {folder}", "what the numbers rest on"),),
    "study": (("report {folder}", "one page of it"),),
    "design": (("report {folder}", "one page of it"),),
    "report": (),
    "vehicles": (("run NAME", "the main job"), ("new-vehicle DIR --from NAME", "one of your own")),
    "new-vehicle": (("build-vehicle {folder}", "its tables, when its numbers are yours"),),
    "import-structure": (("build-vehicle DIR", "with these tables in DIR/construction"),),
    "build-vehicle": (("run {vehicle}", "the main job"), ("inspect {vehicle} --time T", "the numbers at a time")),
    "reproduce": (("run as504", "the same vehicle alone"),),
    "regenerate": (("doctor", "which engine runs it"),),
    "doctor": (("run as504", "the main job"),),
    "cache": (("doctor", "what the cache is used for"),),
    "equations": (("inspect {vehicle} --time T", "their numbers at a time"),),
    "wind apply": (("run {vehicle}", "with this wind"),),
    "wind read": (("wind stats --soundings FILE", "their statistics"),),
    "wind months": (("availability VEHICLE --winds DIR --limit FILE", "the odds of each month"),),
    "wind stats": (("wind fit", "a filter of this wind"),),
    "wind fit": (("wind check {out}", "the filter against its data"), ("report {folder}", "one page of it")),
    "wind check": (("wind plot {filter_file}", "figures of the filter"),),
    "wind plot": (("report {folder}", "one page of it"),),
    "wind compare": (("wind apply DIR --component C", "another wind for a vehicle"),),
}
JSON = "as_json"  # parameter
OWN_TEXT = ("equations", "inspect")  # print LaTeX, or have JSON of their own


Json = Annotated[
    bool, typer.Option("--json", help="Tables and files as JSON on standard output; all else goes to standard error.")
]


def framed(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """Return the function of a command with ``--json`` beside its own options, and with its last line.

    Parameters
    ----------
    function : callable
    name : str
        As it is typed, such as 'wind fit'.
    """

    @functools.wraps(function)
    def run(**given: Any) -> Any:
        machine_reads.folder = None
        if given.pop(JSON, False):
            machine_reads.begin()
        try:
            found = function(**given)
            _print_json()
        except typer.Exit as end:
            if end.exit_code in (0, 1):
                _print_json()
            raise
        finally:
            machine_reads.end()
        _hint(name, given, machine_reads.folder)
        return found

    if name in OWN_TEXT:
        return run
    hints = get_type_hints(function, include_extras=True)
    own = inspect.signature(function)
    taken = [parameter.replace(annotation=hints[name]) for name, parameter in own.parameters.items()]
    option = inspect.Parameter(JSON, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Json)
    run.__signature__ = own.replace(parameters=[*taken, option])  # pyright: ignore
    run.__annotations__ = hints | {JSON: Json}
    return run


def frame_group(group: typer.Typer, name: str) -> None:
    """Frame every command of a group, once however often the command line is made."""
    for command in group.registered_commands:
        assert command.callback is not None
        if JSON in command.callback.__annotations__:
            continue
        command.callback = framed(command.callback, f"{name} {command.name or command.callback.__name__}")


def _print_json() -> None:
    if machine_reads.now is not None:
        typer.echo(json.dumps(machine_reads.now.told(), indent=1, ensure_ascii=False))


def _hint(name: str, given: Mapping[str, Any], folder: Path | None) -> None:
    known = {key: str(value) for key, value in given.items() if value is not None}
    if name in ("new-vehicle", "build-vehicle"):
        known["vehicle"] = known.get("out", known.get("vehicle", ""))
    elif folder is not None:
        known["folder"] = str(folder)
    elif name == "wind fit":
        known["folder"] = str(Path(known["out"]).parent)
    told = []
    for typed, why in NEXT[name]:
        if given.get("report") and typed.startswith("report "):
            continue  # it has just written that page
        try:
            told.append(f"'ascentwind {typed.format(**known)}' for {why}")
        except KeyError:
            continue  # it takes what this run had not, such as a vehicle
    if told:
        errors.print(f"next: {', '.join(told)}", style="dim", soft_wrap=True, markup=False, highlight=False)
