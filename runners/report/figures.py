"""Figures of a page, by bokeh: they zoom, and a pointer reads them off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .parts import Figure, Ink, Key

# By kind of curve, on a light and on a dark page: Okabe and Ito's, which differ for the colour-blind too
INKS: Mapping[Ink, tuple[str, str]] = {
    "mean": ("#3d434b", "#c9d1d9"),
    "wind": ("#0072b2", "#56b4e9"),
    "combined": ("#c04a00", "#f0913f"),
    "third": ("#00805c", "#2fc79a"),
    "fourth": ("#a0508a", "#e39fc5"),
    "fifth": ("#8a6d00", "#e0c341"),
}
ORDER: tuple[Ink, ...] = ("wind", "combined", "third", "fourth", "fifth", "mean")
DASHES = {"line": "solid", "dashed": [6, 4], "band": "solid"}
HEIGHT = 330


def curve_ink(k: int) -> Ink:
    """Return the colour of the k-th curve."""
    return ORDER[k % len(ORDER)]


def lines(
    title: str,
    description: str,
    x: tuple[str, ArrayLike],
    curves: Sequence[tuple[Key, ArrayLike]],
    y_label: str,
    band: tuple[Key, ArrayLike, ArrayLike] | None = None,
    logarithmic: bool = False,
    zero: bool = True,
    range_x: tuple[float, float] | None = None,
    curves_x: Sequence[ArrayLike] | None = None,
) -> Figure:
    """Return curves over one axis, read off by the pointer all at once.

    Parameters
    ----------
    title, description : str
    x : tuple of str and (n,) array
        Label with unit, and values.
    curves : sequence of tuples of Key and (n,) array
    y_label : str
        With unit.
    band : tuple of Key and two (n,) arrays, optional
        Lower and upper edge.
    logarithmic : bool
        Of the upright axis.
    zero : bool
        Whether a line at zero is drawn.
    range_x : tuple of float, optional
        What is shown at first.
    curves_x : sequence of arrays, optional
        Arguments of each curve, where they have their own.
    """
    from bokeh.models import ColumnDataSource, HoverTool, Range1d, Span

    x_label, values = x
    plot = _plot(x_label, y_label, y_axis_type="log" if logarithmic else "linear")
    if range_x is not None:
        plot.x_range = Range1d(start=float(range_x[0]), end=float(range_x[1]))
    keys: list[Key] = []
    if band is not None:
        key, low, high = band
        source = ColumnDataSource({"x": _numbers(values), "low": _numbers(low), "high": _numbers(high)})
        drawn = plot.varea("x", "low", "high", source=source, fill_alpha=0.16, fill_color=INKS[key.ink][0])
        drawn.tags = [key.ink]
        keys.append(key)
    if zero and not logarithmic:
        plot.add_layout(Span(location=0.0, dimension="width", tags=["axis"], line_width=1))
    for k, (key, y) in enumerate(curves):
        own = values if curves_x is None else curves_x[k]
        source = ColumnDataSource({"x": _numbers(own), "y": _numbers(y)})
        look: dict[str, Any] = {"line_color": INKS[key.ink][0], "line_width": 2, "line_dash": DASHES[key.form]}
        drawn = plot.line("x", "y", source=source, **look)
        drawn.tags = [key.ink]
        if len(source.data["x"]) < 3:
            points = plot.scatter("x", "y", source=source, size=8, fill_color=look["line_color"], line_color=None)
            points.tags = [key.ink]
        tips = [(_plain(key.label), "@y{%.4g}"), (_plain(x_label), "@x{%.4g}")]
        formats: Any = {"@y": "printf", "@x": "printf"}
        plot.add_tools(HoverTool(renderers=[drawn], tooltips=tips, formatters=formats, mode="vline"))
        keys.append(key)
    return Figure(title, description, plot, keys)


def bars(
    title: str, description: str, names: Sequence[str], parts: Sequence[tuple[Key, ArrayLike]], x_label: str
) -> Figure:
    """Return bars lying down, one a name, the parts of each end to end; the first name stands at the top.

    Parameters
    ----------
    title, description : str
    names : sequence of str
    parts : sequence of tuples of Key and (n,) array
    x_label : str
        With unit.
    """
    from bokeh.models import ColumnDataSource, DataRange1d, FactorRange, HoverTool, Span

    shown = [_plain(name) for name in names]
    plot = _plot(x_label, "", y_range=FactorRange(factors=shown[::-1]), height=90 + 26 * len(names))
    if all(np.min(values, initial=0.0) >= 0 for _, values in parts):
        plot.x_range = DataRange1d(start=0.0)
    left: NDArray[np.float64] = np.zeros(len(names))
    for key, values in parts:
        right = left + _numbers(values)
        source = ColumnDataSource({"name": shown, "left": left, "right": right, "value": _numbers(values)})
        drawn = plot.hbar(
            y="name", left="left", right="right", height=0.7, source=source,
            fill_color=INKS[key.ink][0], line_color=None,
        )  # fmt: skip
        drawn.tags = [key.ink]
        tips = [("", "@name"), (_plain(key.label), "@value{%.4g}")]
        formats: Any = {"@value": "printf"}
        plot.add_tools(HoverTool(renderers=[drawn], tooltips=tips, formatters=formats))
        left = right
    plot.add_layout(Span(location=0.0, dimension="height", tags=["axis"], line_width=1))
    return Figure(title, description, plot, [key for key, _ in parts] if len(parts) > 1 else ())


def _plot(x_label: str, y_label: str, **settings: Any) -> Any:
    from bokeh.models import PlainText
    from bokeh.plotting import figure

    plot = figure(
        height=settings.pop("height", HEIGHT),
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save",
        active_scroll=None,
        output_backend="svg",
        background_fill_color=None,
        border_fill_color=None,
        outline_line_color=None,
        x_axis_label=PlainText(text=x_label),
        **({"y_axis_label": PlainText(text=y_label)} if y_label else {}),
        **settings,
    )
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    return plot


def _numbers(values: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(values, float)


def _plain(text: str) -> str:
    """Return a text that bokeh reads neither as mathematics nor as a field."""
    return text.replace("$", "$\u200b").replace("@", "@\u200b")
