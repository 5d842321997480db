"""pyNastran, imported when a deck is read."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ....model.errors import DataError, MissingLibraryError


def pynastran(module: str, name: str) -> Any:
    """Return a class of pyNastran.

    Raises
    ------
    MissingLibraryError
    """
    lent = not hasattr(np, "in1d")
    if lent:
        np.__dict__["in1d"] = np.isin  # pyNastran 1.4 takes it by that name, which NumPy 2.4 has no more
    try:
        return getattr(importlib.import_module(f"pyNastran.{module}"), name)
    except ImportError as error:
        raise MissingLibraryError(
            f"pyNastran cannot be imported ({error}); pip install 'ascentwind[nastran]'"
        ) from None
    finally:
        if lent:
            del np.__dict__["in1d"]


@contextmanager
def reading(file: Path) -> Iterator[None]:
    """Turn whatever pyNastran raises over a file into an error that names it.

    Raises
    ------
    DataError
    """
    if not file.is_file():
        raise DataError("is not there; check its name", file=file)
    try:
        yield
    except (DataError, KeyboardInterrupt):
        raise
    except BaseException as error:  # pyNastran raises anything, SystemExit too
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        why = "; ".join(lines[:3])[:300] or type(error).__name__
        raise DataError(f"cannot be read by pyNastran ({type(error).__name__}: {why})", file=file) from None
