"""Titles of figures are broken into parts of nearly equal length."""

from __future__ import annotations

import pytest

from ascentwind.runners.present.style import TITLE_WIDTH, wrapped


@pytest.mark.parametrize(
    "title",
    [
        "AS-504 (Saturn V, Apollo 9), first stage, yaw plane, March wind over Cape Kennedy",
        "a " * 60,
        "short",
        "x" * (TITLE_WIDTH + 20) + " and more",
        "",
    ],
)
def test_no_word_stands_alone(title):
    parts = wrapped(title).splitlines()
    assert " ".join(parts).replace(" ", "") == title.replace(" ", "")
    assert all(len(part) <= TITLE_WIDTH for part in parts)
    if len(parts) > 1 and "x" not in title:
        assert min(map(len, parts)) > 0.6 * max(map(len, parts))
