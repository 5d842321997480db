"""Numbers written as text: what TOML and JSON call a number, and nothing else that Python's float() would take."""

from __future__ import annotations

import re

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


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
