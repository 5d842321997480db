"""The command ``wind read``: soundings of any known format, put on common levels, with a report of their quality."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from ...model.errors import DataError
from ...model.files.numbers import parse_number
from ..present.terminal import console, print_table
from .terminal import number, refuse_unused

MOST = 10_000  # levels


def read(
    context: typer.Context,
    files: Annotated[list[Path], typer.Argument(help="IGRA, Wyoming, FSL, netCDF, GRIB or CSV; of one station.")],
    levels: Annotated[
        str | None, typer.Option(help="START:STOP:STEP or H1,H2,... in m; those of the files without it.")
    ] = None,
    months: Annotated[str | None, typer.Option(help="By name or number, commas between; all without it.")] = None,
    hours: Annotated[str | None, typer.Option(help="UTC, commas between.")] = None,
    years: Annotated[str | None, typer.Option(help="FIRST:LAST, or commas between.")] = None,
    latitude: Annotated[float | None, typer.Option(parser=number, help="Of a place in a field, deg.")] = None,
    longitude: Annotated[float | None, typer.Option(parser=number, help="Of a place in a field, deg.")] = None,
    point: Annotated[str, typer.Option(help="nearest, or bilinear.")] = "nearest",
    largest_gap: Annotated[
        float, typer.Option(parser=number, help="Levels farther apart have no wind between them, m.")
    ] = 2500.0,
    incomplete: Annotated[str, typer.Option(help="Profiles that lack a level: use, drop or refuse.")] = "use",
    outliers: Annotated[str, typer.Option(help="Values that are no wind: refuse or drop.")] = "refuse",
    out: Annotated[Path | None, typer.Option(help="CSV file for the profiles.")] = None,
) -> None:
    """Read soundings, report what was kept and why not, and write them at common levels."""
    from ...model.wind.soundings.collection import soundings_text
    from ...model.wind.soundings.quality import observed_by_level
    from ...model.wind.soundings.read import read_soundings
    from ..present.files import prepare_folder, write_text

    if latitude is None and longitude is None:
        refuse_unused(context, ["point"], "without --latitude and --longitude, which name a place in a field")
    wanted = None if levels is None else parse_levels(levels)
    if out is not None:
        prepare_folder(out.parent)
    found = read_soundings(
        files,
        wanted,
        months=None if months is None else parse_months(months),
        hours=None if hours is None else parse_whole(hours, "hour"),
        years=None if years is None else parse_whole(years, "year"),
        latitude=latitude,
        longitude=longitude,
        point=point,  # pyright: ignore[reportArgumentType]
        largest_gap=largest_gap,
        incomplete=incomplete,  # pyright: ignore[reportArgumentType]
        outliers=outliers,  # pyright: ignore[reportArgumentType]
    )
    for line in found.quality.lines():
        console.print(line, soft_wrap=True, highlight=False, markup=False)
    table = Table("altitude, m", title=f"{found.source}: {len(found.u)} profiles, {found.period}")
    for column in ("profiles with wind", "mean u, m/s", "σ u", "mean v, m/s", "σ v"):
        table.add_column(column, justify="right")
    for k, count in enumerate(observed_by_level(found.u, found.v)):
        row = [f"{found.altitude[k]:g}", str(int(count))]
        for values in (found.u[:, k], found.v[:, k]):
            seen = values[values == values]
            row += [f"{seen.mean():.2f}" if seen.size else "", f"{seen.std(ddof=1):.2f}" if seen.size > 1 else ""]
        table.add_row(*row)
    print_table(table, console)
    if out is not None:
        written = "written over the profiles that stood in" if out.exists() else "written to"
        write_text(out, soundings_text(found))
        console.print(f"{written} {out}", soft_wrap=True)


def parse_levels(text: str) -> list[float]:
    """Return levels (m) from START:STOP:STEP or a list.

    Raises
    ------
    DataError
    """
    form = "write START:STOP:STEP or H1,H2,... in metres, such as 0:16000:500"
    try:
        if ":" not in text:
            return [parse_number(part) for part in text.split(",")]
        start, stop, step = (parse_number(part) for part in text.split(":"))
    except ValueError:
        raise DataError(f"'{text}' names no levels; {form}") from None
    if step <= 0 or stop < start or (stop - start) / step > MOST:
        raise DataError(f"'{text}' names no levels, or more than {MOST}; {form}")
    return [start + k * step for k in range(int((stop - start) / step + 1e-9) + 1)]


def parse_months(text: str) -> list[int | str]:
    """Return months by name or number."""
    return [int(part) if part.strip().isdigit() else part.strip().lower() for part in text.split(",")]


def parse_whole(text: str, what: str) -> list[int]:
    """Return whole numbers from a list or FIRST:LAST.

    Raises
    ------
    DataError
    """
    try:
        if ":" in text:
            first, last = (int(part) for part in text.split(":"))
            if last < first or last - first > MOST:
                raise ValueError
            return list(range(first, last + 1))
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise DataError(f"'{text}' names no {what}; write FIRST:LAST or numbers with commas between") from None
