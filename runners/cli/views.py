"""The commands that show a vehicle's equations: ``inspect`` and ``equations``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...model.errors import DataError
from ..present.terminal import console
from .job import load_study
from .terminal import Changes, VehicleArgument, number, refuse_unused


def inspect(
    vehicle: VehicleArgument,
    time: Annotated[float, typer.Option(parser=number, help="Flight time, s.")],
    json: Annotated[bool, typer.Option("--json", help="As JSON instead of tables.")] = False,
    changes: Changes = None,
) -> None:
    """Every table value, the matrices A, B, C, D and the roots at a time."""
    from ..views.inspect_system import inspection, print_inspection

    found = inspection(load_study(vehicle, changes, compile=False), time)
    if json:
        import json as json_module

        typer.echo(json_module.dumps(found, indent=1))
    else:
        print_inspection(found, console)


def equations(
    context: typer.Context,
    vehicle: VehicleArgument = "as504",
    of: Annotated[
        str | None,
        typer.Option(help="'4-1' to '4-13', an output, or a state for its rate; all of 4-1 to 4-13 without."),
    ] = None,
    by: Annotated[str | None, typer.Option(help="The derivative by this table, parameter, state or input.")] = None,
    page: Annotated[Path | None, typer.Option(help="Write 4-1 to 4-13 and their derivatives to this file.")] = None,
    changes: Changes = None,
) -> None:
    """The equations and any derivative of them as LaTeX, with the report's symbols."""
    from ..present.files import write_text
    from ..views.equation_latex import equation_latex, equation_names
    from ..views.equation_page import equations_page

    if by is not None and of is None:
        raise DataError(f"--by {by} needs --of, the equation to differentiate; 4-1 to 4-13, an output or a state")
    if page is not None:
        refuse_unused(context, ["of", "by"], "with --page, which holds all equations")
    study = load_study(vehicle, changes, compile=False)
    if page is not None:
        text = equations_page(study)
        write_text(page, text)
        console.print(f"{page} written", soft_wrap=True)
    elif of is not None:
        typer.echo(equation_latex(study, of, by))
    else:
        for name in equation_names(study):
            if name.startswith("4-"):
                typer.echo(f"{name}: {equation_latex(study, name)}")
