"""The command ``mean``: the mean response with large angles beside the linear one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from ..present.terminal import console, print_whole
from .job import Job, load_study, on_terminal
from .terminal import Changes, VehicleArgument


def mean(
    vehicle: VehicleArgument,
    out: Annotated[Path | None, typer.Option(help="Folder for the figure; none without it.")] = None,
    changes: Changes = None,
) -> None:
    """The mean response in the mean wind by the nonlinear planar equations, beside the linear one."""
    import numpy as np

    from ..present.style import write_figure
    from ..present.wording import words
    from ..views.mean_comparison import mean_comparison, mean_comparison_figure

    study = load_study(vehicle, changes)
    job = Job(out) if out else None
    with on_terminal():
        found = mean_comparison(study)
    table = Table("response", "linear, peak deg", "at s", "nonlinearity, deg", "at s", "bending and slosh, deg", "at s")
    degrees = found["mean"] * (180 / np.pi)
    for name in found["response"].values:
        part = degrees.sel(response=name)
        rigid = part.sel(model="linear_rigid")
        cells = [words(str(name))]
        for values in (
            part.sel(model="linear"),
            part.sel(model="nonlinear_rigid") - rigid,
            part.sel(model="linear") - rigid,
        ):
            i = int(np.argmax(abs(values.values)))
            cells += [f"{float(values[i]):.4f}", f"{float(found['time'][i]):.1f}"]
        table.add_row(*cells)
    print_whole(table, console)
    if job:
        title = f"{study.system.name}: mean response in the mean wind"
        job.replace_earlier("mean", study)
        job.written += write_figure(mean_comparison_figure(found, title), job.folder, "mean_response")
        job.end()
