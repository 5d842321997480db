"""The command ``sensitivity``: exact derivatives of a response, ranked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..present.terminal import console
from ..statistics.larger_side import LARGER_SIDE
from .job import Job, load_study, on_terminal
from .terminal import Changes, Turbulence, VehicleArgument, number, refuse_unused, results_folder


def sensitivity(
    context: typer.Context,
    vehicle: VehicleArgument,
    response: Annotated[
        str | None, typer.Option(help="Response, or resultant of both planes; the vehicle's first response without it.")
    ] = None,
    time: Annotated[str, typer.Option(help="End time in s, or 'peak'.")] = "peak",
    source: Annotated[str, typer.Option(help="A noise source, or 'combined'.")] = "combined",
    quantity: Annotated[
        str, typer.Option(help=f"{LARGER_SIDE}, mean_plus_3sigma, mean, std or variance.")
    ] = LARGER_SIDE,
    probability: Annotated[
        float | None, typer.Option(parser=number, help="Of a resultant: chance to pass its level; 0.00135 without it.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-sensitivity without it.")] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """Which parameter, second of a table and kilometre of wind drives a response: exact derivatives, ranked.

    Of a resultant of both planes it is the level that it passes with a probability at the instant.
    """
    from ..case.times import parse_time_or_peak
    from ..sensitivity.report import print_sensitivity, write_sensitivity
    from ..sensitivity.request import Request
    from ..statistics.norm import LIKE_3_SIGMA
    from ..statistics.percentiles import checked_probabilities
    from ..statistics.resultants import response_or_resultant, resultant_pairs

    at = parse_time_or_peak(time)
    if quantity == "mean":
        refuse_unused(context, ["source"], "with --quantity mean, to which no noise contributes")
    study = load_study(
        vehicle, changes, ["title"] if at != "peak" else ["title", "default_times"], turbulence=turbulence
    )
    name = response_or_resultant(study, response or study.system.output_names[0])
    (chance,) = checked_probabilities(LIKE_3_SIGMA if probability is None else probability)
    of_two = name in resultant_pairs(study.system.output_names)
    if of_two:
        refuse_unused(context, ["source", "quantity"], "with a resultant, whose level is of all sources together")
    else:
        refuse_unused(context, ["probability"], "with a response of one plane; ask for a resultant")
        Request.of(study, name, source, quantity)
    if at != "peak":
        study.checked_times([at])
    job = Job(out or results_folder(vehicle, "sensitivity"))
    with on_terminal():
        if of_two:
            found = study.percentile_sensitivity(name, at, chance)
        else:
            found = study.sensitivity(name, at, source=source, quantity=quantity)
    print_sensitivity(found, console)
    job.replace_earlier("sensitivity", study)
    job.written += write_sensitivity(found, job.folder)
    job.end()
