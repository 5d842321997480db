"""The command ``export``: a vehicle's system for programs without ascentwind."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...model.errors import UnknownNameError
from ..present.terminal import console
from .job import Job, load_study
from .terminal import Changes, Turbulence, VehicleArgument, results_folder

FORMATS = ("c",)


def export(
    vehicle: VehicleArgument,
    format: Annotated[str, typer.Option(help="c: a library with header, sources, numbers and examples.")],
    out: Annotated[Path | None, typer.Option(help="Folder; VEHICLE-FORMAT without it.")] = None,
    times: Annotated[
        str | None, typer.Option(help="Times in s, START:STOP:STEP or T1,T2,...: end times of the library's example.")
    ] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """A vehicle's system with its numbers for others: a C library that needs neither Python nor ascentwind."""
    from ..case.times import parse_times
    from ..export.c_library import c_library, write_texts

    if format not in FORMATS:
        raise UnknownNameError("format", format, FORMATS)
    chosen = None if times is None else parse_times(times)
    study = load_study(vehicle, changes, ["default_times"] if times is None else [], turbulence=turbulence)
    job = Job(out or results_folder(vehicle, format))
    with console.status("statistics, and the sources of the library"):
        texts = c_library(study, chosen)
    job.replace_earlier("export", study.system.name)
    job.written += write_texts(texts, job.folder)
    job.end()
