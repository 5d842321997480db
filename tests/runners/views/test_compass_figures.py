"""Figures over azimuths: what was computed is marked, and a whole circle closes; on a narrow one all text has room."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from ascentwind.runners.measured_winds.availability_figure import availability_figure, load_rose
from ascentwind.runners.views.azimuth_sweep import azimuth_figure


def sweep(azimuths: list[float]) -> xr.Dataset:
    level = 2e6 + 1e5 * np.cos(np.radians(azimuths))
    return xr.Dataset(
        {"level": (("azimuth", "resultant"), level[:, None])},
        {"azimuth": azimuths, "resultant": ["resultant_bending_moment"], "unit": ("resultant", ["N m"])},
        {"probability": 0.00135},
    )


@pytest.mark.parametrize(
    ("azimuths", "drawn"),
    [
        ([0.0, 90.0, 180.0, 270.0], [0.0, 90.0, 180.0, 270.0, 360.0]),
        ([60.0, 70.0, 100.0], [60.0, 70.0, 100.0]),
        ([72.0], [72.0]),
    ],
)
def test_computed_azimuths_are_marked_and_a_circle_closes(azimuths, drawn):
    axes = azimuth_figure(sweep(azimuths), "resultant_bending_moment", 72.0, "title").axes[0]
    marked = next(line for line in axes.get_lines() if line.get_marker() == "o")
    assert np.asarray(marked.get_xdata()).tolist() == drawn
    assert marked.get_linewidth() == 0  # no line says what was not computed
    values = np.asarray(marked.get_ydata(), float)
    if len(drawn) > len(azimuths):
        assert values[0] == values[-1]


def months(azimuths: list[float]) -> xr.Dataset:
    shape = (2, len(azimuths))
    return xr.Dataset(
        {
            "probability": (("month", "azimuth"), np.array([[1e-3], [1e-19]]) * np.ones(shape)),
            "level": (("month", "azimuth", "response"), np.full((*shape, 1), 2e7)),
        },
        {"month": ["march", "july"], "azimuth": np.radians(azimuths), "response": ["m"], "unit": ("response", ["N m"])},
    )


@pytest.mark.parametrize("azimuths", [[72.0], [0.0, 90.0, 180.0, 270.0]])
def test_the_figure_of_months_has_room_for_its_text(azimuths):
    title = "AS-504 (Saturn V, Apollo 9)\nBoth planes: the months' winds of Cape Canaveral, not the vehicle's own"
    figure = availability_figure(months(azimuths), title)
    figure.draw_without_rendering()
    whole = figure.bbox
    bar = figure.axes[1].yaxis.label
    for text in (figure._suptitle, bar):  # pyright: ignore[reportAttributeAccessIssue]
        box = text.get_window_extent()
        assert whole.x0 <= box.x0 and box.x1 <= whole.x1, text.get_text()
        assert whole.y0 <= box.y0 and box.y1 <= whole.y1, text.get_text()
    said = {text.get_text() for text in figure.axes[0].texts}
    assert said == {"0.001", "< 1e-06"}


def test_a_rose_closes_where_it_is_a_circle():
    line = load_rose(months([0.0, 90.0, 180.0, 270.0]), "m", "title").axes[0].get_lines()[0]
    assert len(np.asarray(line.get_xdata())) == 5
    line = load_rose(months([60.0, 70.0, 80.0]), "m", "title").axes[0].get_lines()[0]
    assert len(np.asarray(line.get_xdata())) == 3
