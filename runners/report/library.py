"""The libraries of a report, asked for before anything is computed."""

from __future__ import annotations

import importlib.util

from ...model.errors import MissingLibraryError

LIBRARIES = {"bokeh": "bokeh", "markdown_it": "markdown-it-py"}


def checked_libraries() -> None:
    """Make sure that what a report needs is installed.

    Raises
    ------
    MissingLibraryError
    """
    missing = [package for module, package in LIBRARIES.items() if importlib.util.find_spec(module) is None]
    if missing:
        raise MissingLibraryError(
            f"a report needs {' and '.join(missing)}; install it with 'pip install \"ascentwind[report]\"'"
        )
