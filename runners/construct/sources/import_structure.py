"""Writing the tables of a construction from what a loads group has."""

from __future__ import annotations

from pathlib import Path

from ....model.errors import DataError, OutputFolderError
from ...present.files import prepare_folder, write_text
from .nastran import read_nastran
from .structure_lines import structure_tables
from .workbook import workbook_tables


def import_structure(source: Path, out: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Write masses.csv, stiffness.csv and modes.csv, as far as a source holds them.

    Parameters
    ----------
    source : Path
        A mapping file (.toml) that names a NASTRAN deck and its results, or a workbook (.xlsx).
    out : Path
        Folder for the tables; none of them may be there.

    Returns
    -------
    list of Path, tuple of str
        The files, and what was held against what, in sentences.

    Raises
    ------
    DataError
        File, card or sheet, and row of what cannot be used.
    MissingLibraryError
        pyNastran or openpyxl.
    OutputFolderError
    """
    if source.suffix.lower() == ".toml":
        structure = read_nastran(source)
        tables, checks = structure_tables(structure), structure.checks
    elif source.suffix.lower() == ".xlsx":
        tables, checks = workbook_tables(source)
    else:
        raise DataError("is neither a mapping file (.toml) nor a workbook (.xlsx); give one", file=source)
    for name in tables:
        if (out / name).exists():
            raise OutputFolderError(f"{out / name} exists already; choose another folder with --out")
    prepare_folder(out)
    return [write_text(out / name, text) for name, text in tables.items()], checks
