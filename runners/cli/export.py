"""The command ``export``: a vehicle's system for programs without ascentwind."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...model.errors import UnknownNameError
from .job import Job, load_study, on_terminal, steps
from .terminal import Changes, Turbulence, VehicleArgument, results_folder

C = "c"


def export(
    vehicle: VehicleArgument,
    format: Annotated[
        str, typer.Option(help="c, a library; or matrices A, B, C, D, E, G over time: netcdf, mat (MATLAB) or csv.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder; VEHICLE-FORMAT without it.")] = None,
    times: Annotated[
        str | None,
        typer.Option(
            help="START:STOP:STEP or T1,T2,... in s: of matrices, every 0.05 s without it; of the example of c."
        ),
    ] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """A vehicle's system with its numbers for others: a C library, or its matrices over time."""
    from ..case.times import parse_times
    from ..export.c_library import c_library, write_texts
    from ..export.matrix_files import FORMATS, write_matrices

    if format not in (known := (C, *FORMATS)):
        raise UnknownNameError("format", format, known)
    chosen = None if times is None else parse_times(times)
    shown = ["default_times"] if format == C and times is None else []
    study = load_study(vehicle, changes, shown, turbulence=turbulence)
    job = Job(out or results_folder(vehicle, format))
    if format == C:
        with steps("statistics, and the sources of the library"):
            texts = c_library(study, chosen)
        job.replace_earlier("export", study)
        job.written += write_texts(texts, job.folder)
    else:
        with on_terminal():
            grid = study.matrix_grid(chosen)
        job.replace_earlier("export", study)
        job.written += write_matrices(grid, format, job.folder, study.system.name)
    job.end()
