"""Numbers written as text: what TOML and JSON call a number, and nothing else that Python's float() would take."""

from __future__ import annotations

import re
from math import isfinite

_DECIMAL = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER = re.compile(_DECIMAL, re.ASCII)
_ROW = re.compile(rf" *{_DECIMAL} *(?:, *{_DECIMAL} *)*", re.ASCII)


def parse_number(text: str) -> float:
    """Return a number in decimal notation, blanks around it aside.

    Raises
    ------
    ValueError
        For anything else: words, 'nan' and 'inf', digits in groups (1_000), digits of other alphabets, and numbers
        beyond the largest float.
    """
    word = text.strip()
    if not _NUMBER.fullmatch(word):
        raise ValueError(f"'{word}' is not a number")
    value = float(word)
    if value in (float("inf"), float("-inf")):
        raise ValueError(f"'{word}' is beyond the largest number")
    return value


def parse_row(cells: list[str]) -> list[float] | None:
    """Return the numbers of a row, as :func:`parse_number` reads each; None where it refuses one, or may.

    One search for all of them: tables have ten thousands of numbers.
    """
    if not _ROW.fullmatch(",".join(cells)):
        return None
    try:
        values = [float(cell) for cell in cells]
    except ValueError:  # a comma within a cell
        return None
    return values if all(map(isfinite, values)) else None
