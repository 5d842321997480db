"""Figures of response statistics: what is written on them can be read."""

from __future__ import annotations

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Annotation

from ascentwind.runners.statistics.response_figures import response_figure


@pytest.mark.parametrize(
    "times", [[75.0], [60.0, 75.0], [75.0, 90.0], [40.0, 50.0, 60.0, 70.0], [70.0, 75.0, 80.0, 85.0]]
)
def test_the_note_at_the_peak_stays_inside_the_axes(as504, times):
    figure = response_figure(as504.response_statistics(times).dataset, "bending_moment", "AS-504")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    (axes,) = figure.axes
    (note,) = (text for text in axes.texts if isinstance(text, Annotation))
    inside, written = axes.get_window_extent(), note.get_window_extent(canvas.get_renderer())
    assert inside.x0 <= written.x0 and written.x1 <= inside.x1
    assert inside.y0 <= written.y0 and written.y1 <= inside.y1
