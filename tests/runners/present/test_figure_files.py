"""Figures as files: what is drawn once for both of them is what matplotlib's own ``savefig`` draws."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.text import Annotation
from PIL import Image

from ascentwind.runners.present.style import PIXELS, STYLE, Figure, write_figure


def figure_of(anchor=None):
    """Two panels with legends, one of which looks for its place, a bar, names on an axis and powers of ten."""
    x = np.linspace(0, 10, 300)
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        left, right = figure.subplots(1, 2)
        for k in range(3):
            left.plot(x, np.sin(x + k) * (1 + x), label=f"costs ${k} and $more")
        left.set(xlabel="time (s)", ylabel="value (N)", title="of $5")
        left.legend(**({} if anchor is None else {"loc": "upper left", "bbox_to_anchor": anchor}))
        left.annotate("$here", (2, 3))
        right.loglog(x + 1, (x + 1) ** 4, label="powers")
        right.legend()
        right.set(xlabel="argument", ylabel="power")
    return figure


@pytest.mark.parametrize("anchor", [None, (0.0, 0.4), (0.2, 0.1, 0.5, 0.5)], ids=["best", "a point", "a box"])
def test_a_png_is_what_savefig_draws(tmp_path, anchor):
    png_file, _ = write_figure(figure_of(anchor), tmp_path, "once")
    other = figure_of(anchor)
    left = other.axes[0]
    legend = left.get_legend()
    assert legend is not None
    for text in (left.title, *legend.get_texts(), *left.texts):
        text.set_parse_math(False)
    with rc_context(STYLE):
        other.savefig(tmp_path / "other.png", dpi=PIXELS)
    with Image.open(png_file) as mine, Image.open(tmp_path / "other.png") as its:
        assert mine.info["dpi"] == pytest.approx((PIXELS, PIXELS), rel=1e-4)
        np.testing.assert_array_equal(np.asarray(mine), np.asarray(its))


def test_an_svg_is_the_same_again(tmp_path):
    _, first = write_figure(figure_of(), tmp_path, "first")
    _, second = write_figure(figure_of(), tmp_path, "second")
    assert first.read_text() == second.read_text()


def test_dollars_are_kept_and_powers_of_ten_are_not(tmp_path):
    figure = figure_of()
    write_figure(figure, tmp_path, "dollars")
    left, right = figure.axes
    notes = [text for text in left.texts if isinstance(text, Annotation)]
    legend = left.get_legend()
    assert legend is not None
    kept = [left.title, left.xaxis.label, *legend.get_texts(), *notes]
    assert notes and not any(text.get_parse_math() for text in kept)
    assert all(label.get_parse_math() for label in right.get_xticklabels())
