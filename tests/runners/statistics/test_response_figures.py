"""Figures of response statistics: what is written on them can be read."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Annotation

from ascentwind.runners.case.times import drawn_times
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


def test_both_sides_are_drawn_and_curves_follow_jumps(as504):
    """One of five engines is cut off at 134.34 s: end times of some seconds miss it, the curves do not."""
    ends = [120.0, 130.0, 136.0, 140.0]
    times = drawn_times(ends, as504.executable.stops(140.0).times)
    statistics, drawn = as504.response_statistics(ends), as504.response_statistics(times)
    (axes,) = response_figure(statistics.dataset, "axial_force", "AS-504", drawn.dataset).axes
    lines = {line.get_label(): line for line in axes.lines}
    part = drawn.sel(response="axial_force", source="combined")
    for sign, label in ((3, "mean + 3σ, all sources"), (-3, "mean - 3σ, all sources")):
        expected = (part.mean + sign * part.std) / 1e6
        np.testing.assert_allclose(np.asarray(lines[label].get_ydata()), expected, rtol=1e-12)
    mean = np.asarray(lines["mean"].get_ydata())
    at = int(np.argmax(np.abs(np.diff(mean))))
    assert times[at] == pytest.approx(134.34, abs=1e-9)
    assert times[at + 1] - times[at] < 1e-3
    assert mean[at + 1] / mean[at] == pytest.approx(4 / 5, abs=0.01)


@pytest.mark.parametrize("stops", [[], [5.0], [1.0, 9.0], [0.0, 10.0], [3.0, 3.0 + 1e-9]])
@pytest.mark.parametrize("ends", [[0.0, 10.0], [0.0, 2.5, 10.0], [0.1 * k for k in range(101)]])
def test_drawn_times(ends, stops):
    found = drawn_times(ends, stops)
    assert found == sorted(set(found))
    assert set(ends) <= set(found)
    assert max(np.diff(found)) < 0.06
    for stop in stops:
        assert stop in found
        if 0 < stop < 10:
            assert any(0 < t - stop < 1e-4 for t in found)
            after = [t for t in found if stop <= t <= min(stop + 1.0, 10.0)]
            assert max(np.diff(after)) < 0.0061, "what rings after a stop is drawn finely"


def test_one_time_is_drawn_as_it_is():
    assert drawn_times([75.0], [75.0]) == [75.0]


def test_zero_is_drawn_where_it_is_near(as504):
    statistics = as504.response_statistics([60.0, 75.0, 90.0]).dataset
    for response, near in (("bending_moment", True), ("axial_force", False)):
        (axes,) = response_figure(statistics, response, "AS-504").axes
        assert any(np.array_equal(np.asarray(line.get_ydata()), [0, 0]) for line in axes.lines) == near
