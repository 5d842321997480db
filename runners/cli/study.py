"""The command ``ascentwind study``: a parameter study from a TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..present.terminal import console, errors
from .exit_codes import INTERRUPTED
from .job import Job, load_study, on_terminal, steps
from .terminal import Changes


def study(
    file: Annotated[Path, typer.Argument(help="TOML file of the study (docs/studies.md).")],
    changes: Changes = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for results, FILE-results without it. One that holds a part is continued."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler, such as tcp://host:8786; this machine's cores without it.")
    ] = None,
) -> None:
    """Parameter study: a grid, one parameter at a time, or a dispersion; resumed where a killed run stood."""
    from ..parameter_study.plan import read_plan
    from ..parameter_study.report import report
    from ..parameter_study.run import run_parameter_study

    plan = read_plan(file)
    folder = out or Path(f"{file.stem}-results")
    loaded = load_study(plan.named_vehicle(), changes, () if plan.times else ("default_times",))
    started = False
    try:
        with on_terminal():

            def advance(count: int, total: int) -> None:
                nonlocal started
                if not started and count:
                    console.print(f"{count} of {total} members were stored in {folder} before", style="dim")
                started = True

            result = run_parameter_study(file, folder, study=loaded, scheduler=scheduler, progress=advance)
        with steps("first-order prediction and figures"):
            job = Job(folder)
            job.replace_earlier("study", loaded)
            job.written += [folder / "study.nc", *report(result, folder, console)]
    except KeyboardInterrupt:
        errors.print(f"stopped; members done are stored in {folder}: run the same command again to go on from there")
        raise typer.Exit(INTERRUPTED) from None
    job.end()
