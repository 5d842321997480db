"""What a page shows of files that it does not know better: tables, figures and text as they stand; wind filters."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

from ...model.errors import DataError
from ...model.files.text_file import read_text
from ..present.wording import words
from .figures import curve_ink, lines
from .images import images
from .parts import Figure, Key, Markup, Part, Section, Table, Text

ROWS = 60  # of a table of a file
COLUMNS = 14
LONG = 20  # rows beyond which a table opens when asked for


def csv_table(path: Path) -> Table:
    """Return the first rows of a CSV file.

    Raises
    ------
    DataError
    """
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
    except csv.Error as error:
        raise DataError(f"is no table ({error}); compute it again", file=path) from None
    if not rows or any(len(row) != len(rows[0]) for row in rows):
        raise DataError("is no table of rows with the same columns; compute it again", file=path)
    head, body = rows[0][:COLUMNS], [tuple(map(_short, row[:COLUMNS])) for row in rows[1 : ROWS + 1]]
    left = [f"{len(rows) - 1 - ROWS} more rows" if len(rows) - 1 > ROWS else ""]
    left.append(f"{len(rows[0]) - COLUMNS} more columns" if len(rows[0]) > COLUMNS else "")
    told = " and ".join(text for text in left if text)
    note = f"{told} in {path.name}." if told else ""
    return Table(words(path.stem), tuple(map(words, head)), body, note, folded=len(body) > LONG)


def markdown(path: Path) -> Markup:
    """Return a text of ours as HTML; what is HTML in it stays text.

    Raises
    ------
    DataError
    """
    from markdown_it import MarkdownIt

    lines_ = [line for line in read_text(path).splitlines() if not line.startswith("![")]
    deeper = [f"##{line}" if line.startswith("#") else line for line in lines_]
    html = MarkdownIt("commonmark", {"html": False}).disable(["link", "image", "autolink"]).render("\n".join(deeper))
    return Markup(html)


def section(name: str, heading: str, paths: Iterable[Path], shown: Iterable[str] = ()) -> Section:
    """Return what files hold that no other section shows: text, tables, then figures.

    Parameters
    ----------
    name, heading : str
    paths : iterable of Path
    shown : iterable of str
        Names of files that stand elsewhere on the page.

    Raises
    ------
    DataError
    """
    left = [path for path in sorted(paths) if path.name not in set(shown)]
    parts: list[Part] = [markdown(path) for path in left if path.suffix == ".md"]
    parts += [csv_table(path) for path in left if path.suffix == ".csv"]
    drawn, without_room = images([path for path in left if path.suffix == ".png"])
    parts += drawn
    if without_room:
        parts.append(Text(f"In the folder, not on this page: {', '.join(without_room)}.", "note"))
    return Section(name, heading, parts, wide=True)


def wind_filter(path: Path) -> list[Part]:
    """Return what a filter of the wind is and its coefficients over altitude.

    Raises
    ------
    DataError
    """
    from ...model.wind.filter_file import read_filter

    found = read_filter(path)
    rows = [("name", found.name), ("order", str(found.order)), ("white noises", str(found.noise_count))]
    rows += [("covers", f"{found.altitude[0]:g} to {found.altitude[-1]:g} m"), ("source", found.source)]
    if found.origin is not None:
        rows.append(("fitted to", str(found.origin)))
    altitude = found.altitude / 1000
    curves = {
        "F (1/m)": found.F.reshape(altitude.size, -1).T,
        "G (unit of the state / sqrt(m))": found.G.reshape(altitude.size, -1).T,
        "H (m/s by unit of the state)": found.H.reshape(altitude.size, -1).T,
    }
    places = {"F": found.F.shape[1:], "G": found.G.shape[1:], "H": found.H.shape[1:]}
    figures: list[Figure] = []
    for label, values in curves.items():
        letter, shape = label[0], places[label[0]]
        drawn = [
            (Key(f"{letter}{_place(k, shape)}", curve_ink(k)), row) for k, row in enumerate(values) if row.any()
        ]  # fmt: skip
        text = f"Coefficients {letter} of the filter over altitude, those that are not zero."
        figures.append(lines(f"Coefficients {letter}", text, ("altitude (km)", altitude), drawn, label))
    return [Table(f"Wind filter, {path.name}", ("what", "is"), rows), *figures]


def _place(k: int, shape: tuple[int, ...]) -> str:
    columns = shape[-1] if len(shape) > 1 else 1
    return f"{k // columns + 1}{k % columns + 1}" if len(shape) > 1 else f"{k + 1}"


def _short(cell: str) -> str:
    """Return a number of a file with at most six digits."""
    try:
        value = float(cell)
    except ValueError:
        return cell
    return cell if len(cell) <= 9 else f"{value:.6g}"
