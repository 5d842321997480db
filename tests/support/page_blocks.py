"""The blocks of the documentation's pages: what they are, where they stand, and which are not run and why."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
WALKED = ("index.md", "bring-your-own-vehicle.md")  # by tests/first_walk.py, with the wheel alone
BLOCK = re.compile(r"(?:^<!-- not run: (?P<why>[^\n]*?) -->\n)?^```(?P<kind>\w*)\n(?P<text>.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """A block of a page.

    Attributes
    ----------
    page : Path
    line : int
        Of its first line.
    kind : str
        sh, python, toml, math.
    text : str
    why_not : str or None
        Why it is not run, as the page's comment above it says.
    """

    page: Path
    line: int
    kind: str
    text: str
    why_not: str | None


def blocks_of(page: Path) -> list[Block]:
    """Return the blocks of a page in order."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(page, text.count("\n", 0, m.start("text")) + 1, m["kind"], m["text"], m["why"])
        for m in BLOCK.finditer(text)
    ]
