"""What a page is made of: sections of tables, figures, images and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

Ink = Literal["mean", "wind", "combined", "third", "fourth", "fifth"]


@dataclass(frozen=True)
class Table:
    """A table with its heading; its first column names the rows.

    Attributes
    ----------
    caption : str
    head : sequence of str
    rows : sequence of sequences of str
    note : str
    folded : bool
        Whether it opens when asked for: long ones.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    folded: bool = False
    kind: str = field(default="table", init=False)


@dataclass(frozen=True)
class Key:
    """A curve's name in the legend, its colour, and how it is drawn."""

    label: str
    ink: Ink
    form: Literal["line", "dashed", "band"] = "line"


@dataclass(frozen=True)
class Figure:
    """A figure that can be zoomed and read off.

    Attributes
    ----------
    title : str
    description : str
        What it shows, for those who do not see it.
    model : bokeh.models.Plot
    keys : sequence of Key
    alone : bool
        Whether it takes the whole width where others stand in pairs.
    """

    title: str
    description: str
    model: Any
    keys: Sequence[Key] = ()
    alone: bool = False
    kind: str = field(default="figure", init=False)


@dataclass(frozen=True)
class Image:
    """A figure as it stands in the folder, inside the page."""

    title: str
    data: str
    kind: str = field(default="image", init=False)


@dataclass(frozen=True)
class Text:
    """A sentence; ``tone`` is 'good' or 'bad' where it is a verdict."""

    text: str
    tone: Literal["", "good", "bad", "code", "note"] = ""
    kind: str = field(default="text", init=False)


@dataclass(frozen=True)
class Markup:
    """HTML of our own making."""

    html: str
    kind: str = field(default="markup", init=False)


Part = Table | Figure | Image | Text | Markup


@dataclass(frozen=True)
class Section:
    """A part of the page with its heading; ``wide`` puts figures beside each other."""

    name: str
    heading: str
    parts: Sequence[Part]
    wide: bool = False
