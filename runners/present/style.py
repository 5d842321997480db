"""Figures after the report's 5-1, 5-6 and 5-7, and families of weighting functions."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib import figure as matplotlib_figure
from matplotlib import rc_context
from matplotlib.axis import Axis, Tick
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter

from ...model.system.names import COMBINED, file_name
from .files import write_whole

PIXELS = 150  # an inch, of PNG files
PACKED = {"compress_level": 1}  # up to a tenth larger than by default, packed in a third of the time
TITLE_WIDTH = 76  # characters across a figure of 8 inches
STYLE: dict[Any, Any] = {
    "figure.figsize": (8.0, 5.0),
    "figure.dpi": 110,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "font.size": 10.5,
    "svg.hashsalt": "ascentwind",
}
COLORS = {"mean": "#444444", "wind": "#1f6fb4", COMBINED: "#c8442c"}
SHADES = ("#1f6fb4", "#c8442c", "#3a8f4d", "#8e5bb5", "#c98a1b", "#444444")  # of curves that stand for no source


class Figure(matplotlib_figure.Figure):
    """A figure that shows itself in a notebook, where those of matplotlib need pyplot for it."""

    def _repr_png_(self) -> bytes:
        _take_dollars_as_written(self)
        image = BytesIO()
        with rc_context(STYLE):
            self.savefig(image, format="png")
        return image.getvalue()


def wrapped(title: str) -> str:
    """Return a title with its long lines broken, so that they stay on the figure, into parts of nearly equal length."""
    return "\n".join("\n".join(_parts(line)) for line in title.splitlines())


def _parts(line: str) -> list[str]:
    longest = wrap(line, TITLE_WIDTH)
    widths = range(max(map(len, line.split()), default=1), TITLE_WIDTH)
    return next((parts for width in widths if len(parts := wrap(line, width)) == len(longest)), longest)


def write_figure(figure: matplotlib_figure.Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG; a dollar sign in a title or name stays one.

    By the canvases themselves: ``savefig`` draws every figure twice, once for its layout.
    """
    name = file_name(name)
    _take_dollars_as_written(figure)
    with rc_context(STYLE):
        figure.dpi = PIXELS
        png = write_whole(folder / f"{name}.png", lambda p: FigureCanvasAgg(figure).print_png(p, pil_kwargs=PACKED))
        figure.set_layout_engine("none")  # what it has found holds for both files
        svg = write_whole(
            folder / f"{name}.svg", lambda p: FigureCanvasSVG(figure).print_svg(str(p), metadata={"Date": None})
        )
    return [png, svg]


def _take_dollars_as_written(figure: matplotlib_figure.Figure) -> None:
    """Keep titles and names from being read as mathematics, which only the powers of ten on axes are."""
    axes = [axis for axis in figure.findobj(Axis) if isinstance(axis, Axis)]
    numbers = set()  # tick labels, and what stands beside them
    for axis in axes:
        numbers.add(axis.offsetText)
        if not isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter):
            numbers |= {label for tick in axis.findobj(Tick) for label in (tick.label1, tick.label2)}
    for text in figure.findobj(Text):
        if text not in numbers:
            text.set_parse_math(False)
