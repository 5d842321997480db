"""Tables on narrow terminals: no word and no number is cut off."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table

from ascentwind.runners.present.terminal import print_table

NAME, VALUE = "equivalent axial load minus y separation", "155.4 kPa deg"


@pytest.mark.parametrize("width", [20, 40, 80, 200])
def test_words_and_numbers_stay_whole(width):
    table = Table("response")
    for column in ("worst instant", "ratio"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_row(NAME, VALUE, "1.133")
    printed = io.StringIO()
    print_table(table, Console(file=printed, width=width))
    lines = printed.getvalue().splitlines()
    assert "…" not in printed.getvalue()
    assert {*NAME.split(), "1.133", "response"} <= set(printed.getvalue().replace("│", " ").replace("┃", " ").split())
    assert VALUE in printed.getvalue() and "worst instant" in printed.getvalue()
    assert len({len(line) for line in lines}) == 1
    assert len(lines[0]) <= max(width, 46)
