"""Figures after the report's 5-1, 5-6 and 5-7, and families of weighting functions."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib import figure as matplotlib_figure
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.image import imsave
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter

from ...model.system.names import COMBINED, file_name
from .files import write_whole

PIXELS = 150  # an inch, of PNG files
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

    By the canvases themselves: ``savefig`` draws every figure twice, once for its layout. What is found for the first
    file holds for both: the layout, where each legend has room, and how far labels of axes stand from them.
    """
    name = file_name(name)
    _take_dollars_as_written(figure)
    with rc_context(STYLE):
        figure.dpi = PIXELS
        canvas = FigureCanvasAgg(figure)
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.execute(figure)
            figure.set_layout_engine("none")
        _keep_legends(figure)
        canvas.draw()
        image = np.asarray(canvas.buffer_rgba())
        fast = {"compress_level": 1}  # no larger than at the highest by a fifth
        drawn = write_whole(
            folder / f"{name}.png", lambda p: imsave(str(p), image, format="png", dpi=PIXELS, pil_kwargs=fast)
        )
        _keep_labels(figure)
        svg = write_whole(
            folder / f"{name}.svg", lambda p: FigureCanvasSVG(figure).print_svg(str(p), metadata={"Date": None})
        )
    return [drawn, svg]


def _keep_legends(figure: matplotlib_figure.Figure) -> None:
    """Keep legends where they are: one that looks for the best place does so at every question for its extent."""
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend is not None:
            inside, place = legend.get_bbox_to_anchor(), legend.get_window_extent()
            if inside.width > 0 and inside.height > 0:
                legend.set_loc(((place.x0 - inside.x0) / inside.width, (place.y0 - inside.y0) / inside.height))


def _keep_labels(figure: matplotlib_figure.Figure) -> None:
    """Keep labels of axes where they were drawn, which else is found from the extents of all tick labels."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            drawn = axis.label.get_transform().transform(axis.label.get_position())
            axis.set_label_coords(*axes.transAxes.inverted().transform(drawn))


def _take_dollars_as_written(figure: matplotlib_figure.Figure) -> None:
    """Keep titles and names from being read as mathematics, which only the powers of ten on axes are."""
    for text in _titles_and_names(figure):
        text.set_parse_math(False)


def _titles_and_names(artist: Artist) -> Iterator[Text]:
    """Give all texts below an artist but numbers on axes, whose ticks need not be made for it."""
    for child in artist.get_children():
        if isinstance(child, Text):
            yield child
        elif not isinstance(child, Axis):
            yield from _titles_and_names(child)
        else:
            yield child.label
            if isinstance(child.get_major_formatter(), FixedFormatter | FuncFormatter):
                yield from child.get_ticklabels()
