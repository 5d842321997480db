"""The command ``design``: gains that lower a peak load, under limits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..present.terminal import console, progress_bar
from .terminal import refuse_unused


def design(
    context: typer.Context,
    task: Annotated[
        str, typer.Argument(help="A design file (docs/design.md), or a vehicle whose folder holds design.toml.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for results; NAME-design without it.")] = None,
    trades: Annotated[bool, typer.Option("--trade/--no-trade", help="The trade of the design file too.")] = True,
) -> None:
    """Load relief: parameters with the lowest peak load under limits; exit code 1 when none is stationary."""
    from ..design.design import design as run_design
    from ..design.design import trade, verify_design
    from ..design.file import find_design, load_design
    from ..design.report import good, print_design, write_design, write_trade
    from ..present.files import prepare_folder
    from ..present.manifest import Manifest

    file = find_design(task)
    with console.status("loading and preparing code"):
        loaded = load_design(file)
    if loaded.trade is None:
        refuse_unused(context, ["trades"], f"with {file}, which has no [trade]")
    folder = out or Path(f"{loaded.problem.study.system.name}-design")
    prepare_folder(folder)
    with console.status("designing") as status:
        found = run_design(loaded.problem, progress=lambda peak: status.update(f"designing, peak now {peak:.4g}"))
        status.update("verifying by CVODES")
        verified = verify_design(found)
    print_design(found, verified, console)
    manifest = Manifest.begin(folder, "design", loaded.problem.study.system.name)
    written = write_design(found, folder)
    if trades and loaded.trade is not None:
        points = {}
        with progress_bar() as progress:
            total = len(loaded.variants) * len(loaded.trade.limits)
            bar = progress.add_task("trade", total=total)
            for name, problem in loaded.variants.items():
                progress.update(bar, description=f"trade, {name}")
                points[name] = trade(
                    problem, loaded.trade.response, loaded.trade.limits, lambda _: progress.advance(bar)
                )
        written += write_trade(points, loaded.trade.response, loaded.title, folder)
    console.print(f"{len(written)} files in {folder}: {', '.join(p.name for p in written)}", soft_wrap=True)
    for sentence in manifest.finish(written):
        console.print(sentence, style="dim", soft_wrap=True, markup=False)
    if not good(found, verified):
        raise typer.Exit(1)
