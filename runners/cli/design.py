"""The command ``design``: gains that lower a peak load, under limits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..present.terminal import console
from .job import Job, checked_changes, on_terminal, steps
from .terminal import Changes, refuse_unused


def design(
    context: typer.Context,
    task: Annotated[
        str, typer.Argument(help="A design file (docs/design.md), or a vehicle whose folder holds design.toml.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for results; NAME-design without it.")] = None,
    trades: Annotated[bool, typer.Option("--trade/--no-trade", help="The trade of the design file too.")] = True,
    changes: Changes = None,
) -> None:
    """Load relief: parameters with the lowest peak load under limits; exit code 1 when none is stationary."""
    from ..design.design import design as run_design
    from ..design.design import recompute_peaks, trade
    from ..design.file import find_design, load_design
    from ..design.report import good, print_design, write_design, write_trade

    file = find_design(task)
    wanted = checked_changes(changes, ["title"])
    with steps("loading"):
        loaded = load_design(file, wanted)
    if loaded.trade is None:
        refuse_unused(context, ["trades"], f"with {file}, which has no [trade]")
    job = Job(out or Path(f"{loaded.problem.study.system.name}-design"))
    with on_terminal():
        found = run_design(loaded.problem)
        recomputed = recompute_peaks(found)
    print_design(found, recomputed, console)
    job.replace_earlier("design", loaded.problem.study)
    job.written += write_design(found, job.folder)
    if trades and loaded.trade is not None:
        points = {}
        with steps("variants", len(loaded.variants)) as bar:
            for name, problem in loaded.variants.items():
                points[name] = trade(problem, loaded.trade.response, loaded.trade.limits)
                bar.done(name)
        job.written += write_trade(points, loaded.trade.response, loaded.title, job.folder)
    job.end()
    if not good(found, recomputed):
        raise typer.Exit(1)
