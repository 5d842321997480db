"""The command ``sensitivity``: exact derivatives of a response, ranked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..present.terminal import console
from ..statistics.larger_side import LARGER_SIDE
from .job import Job, load_study
from .terminal import Changes, Turbulence, VehicleArgument, refuse_unused, results_folder


def sensitivity(
    context: typer.Context,
    vehicle: VehicleArgument,
    response: Annotated[str | None, typer.Option(help="Response; the vehicle's first without it.")] = None,
    time: Annotated[str, typer.Option(help="End time in s, or 'peak'.")] = "peak",
    source: Annotated[str, typer.Option(help="A noise source, or 'combined'.")] = "combined",
    quantity: Annotated[
        str, typer.Option(help=f"{LARGER_SIDE}, mean_plus_3sigma, mean, std or variance.")
    ] = LARGER_SIDE,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-sensitivity without it.")] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """Which parameter, second of a table and kilometre of wind drives a response: exact derivatives, ranked."""
    from ..case.times import parse_time_or_peak
    from ..sensitivity.report import print_sensitivity, write_sensitivity
    from ..sensitivity.request import Request

    at = parse_time_or_peak(time)
    if quantity == "mean":
        refuse_unused(context, ["source"], "with --quantity mean, to which no noise contributes")
    study = load_study(
        vehicle, changes, ["title"] if at != "peak" else ["title", "default_times"], turbulence=turbulence
    )
    asked = Request.of(study, response or study.system.output_names[0], source, quantity)
    if at != "peak":
        study.checked_times([at])
    job = Job(out or results_folder(vehicle, "sensitivity"))
    with console.status("finding the peak and differentiating" if at == "peak" else "differentiating"):
        found = study.sensitivity(asked.response, at, source=source, quantity=quantity)
    print_sensitivity(found, console)
    job.replace_earlier("sensitivity", study)
    job.written += write_sensitivity(found, job.folder)
    job.end()
