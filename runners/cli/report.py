"""The command ``report``: one page of what a results folder holds, to hand on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..present.terminal import console
from .job import steps


def report(
    folder: Annotated[Path, typer.Argument(help="A results folder, or one with a wind's filter.")],
    out: Annotated[Path | None, typer.Option(help="The HTML file; FOLDER/report.html without it.")] = None,
) -> None:
    """One self-contained HTML page of what a results folder holds: it opens from disk and asks for nothing."""
    from ..report.library import checked_libraries

    checked_libraries()
    write_report(folder, out)


def write_report(folder: Path, out: Path | None = None) -> Path:
    """Write the page of a folder and say where it is.

    Raises
    ------
    ResultsFolderError, DataError, OutputFolderError
    """
    with steps("writing the report"):
        from ..present.files import prepare_folder, write_text
        from ..present.manifest import PAGE, Manifest
        from ..report.folder import open_folder
        from ..report.page import NAME, page_of

        html = page_of(folder).html()
        path = out or folder / NAME
        prepare_folder(path.parent)
        if out is None:
            manifest = Manifest.begin(folder, PAGE, open_folder(folder).of)
            write_text(path, html)
            manifest.finish([path])
        else:
            write_text(path, html)
    console.print(f"report: {path} ({len(html.encode()) / 1e6:.1f} MB)", soft_wrap=True, markup=False)
    return path
