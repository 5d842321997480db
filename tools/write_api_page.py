"""Writes docs/api.md: every public name and every error, for the site to fill in from their docstrings.

python tools/write_api_page.py
"""

from __future__ import annotations

import inspect
from pathlib import Path

import ascentwind
from ascentwind import errors

PAGE = Path(__file__).parents[1] / "docs" / "api.md"
GROUPS = {
    "The study": ("Study", "ResponseStatistics"),
    "Engines": ("Sweep", "Cvodes", "CovarianceEquation", "Ensemble"),
    "Systems and vehicles": ("define_system", "LinearSystem", "read_system", "load_vehicle", "build_vehicle"),
    "Loads of a flight": ("FlightLoad", "Limits", "NormOfNormal"),
}
HEAD = """# Python reference

Every public name, imported when first used: `import ascentwind as aw`. SI throughout; arrays are NumPy's or xarray's,
with names. This page is written by `tools/write_api_page.py`.
"""


def page() -> str:
    """Return the page."""
    public = [name for name in dir(ascentwind) if name not in ("errors", "__version__")]
    grouped = {name for names in GROUPS.values() for name in names}
    groups = {**GROUPS, "Winds, gusts, studies and designs": tuple(n for n in public if n not in grouped)}
    parts = [HEAD]
    for heading, names in groups.items():
        parts.append(f"## {heading}\n")
        parts += [f"::: {address(getattr(ascentwind, name))}\n" for name in names if name in public]
    parts.append("## Errors and warnings\n\n`ascentwind.errors` holds all of them.\n")
    parts += [f"::: {address(getattr(errors, name))}\n" for name in dir(errors)]
    return "\n".join(parts)


def address(thing: object) -> str:
    """Return where a public thing is defined."""
    return f"{inspect.getmodule(thing).__name__}.{thing.__name__}"  # pyright: ignore


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
