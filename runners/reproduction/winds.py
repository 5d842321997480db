"""The bending moment under other wind models (report section 5.1 and figure 5-2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib import rc_context

from ...model.wind.range_reference import shipped_statistics
from ..present.style import STYLE, Figure
from ..present.wording import display
from ..statistics.larger_side import SIGMAS, side, sign
from ..statistics.results import ResponseStatistics
from ..study import Study
from ..views.wind_comparison import REPORT_ERRORS, TOP, shipped_winds, stretched_to_error
from .predictions import BENDING, TIME, end_times, larger_sides

SHOWN = ("february, fitted", "annual, fitted", "march 2006, fitted", "march, closed form")


@dataclass(frozen=True, eq=False)
class WindComparison:
    """Bending moment from wind alone under several winds.

    Attributes
    ----------
    statistics : dict of str to ResponseStatistics
        By wind; 'as in the vehicle' first.
    sensitivity : float
        Relative change of the variance at 75 s from a filter whose covariances are wrong by 14 m2/s2 rms to one of
        twice the mean squared error.
    """

    statistics: dict[str, ResponseStatistics]
    sensitivity: float


def compare(study: Study, progress: Callable[[], None] = lambda: None) -> WindComparison:
    """Fit the winds and compute the bending moment under each."""
    winds = shipped_winds()
    progress()
    march = shipped_statistics(top=TOP)
    variances = []
    for rms in REPORT_ERRORS:
        fitted = winds["march, fitted"]
        poorer = study.with_wind(replace(fitted, shaping_filter=stretched_to_error(fitted.shaping_filter, march, rms)))
        statistics = poorer.response_statistics([TIME], responses=[BENDING])
        variances.append(float(statistics["variance"].sel(source="wind").item()))
        progress()
    times = end_times(study)
    found = {"as in the vehicle": study.response_statistics(times, responses=[BENDING])}
    for name in SHOWN:
        found[name] = study.with_wind(winds[name]).response_statistics(times, responses=[BENDING])
        progress()
    return WindComparison(found, variances[1] / variances[0] - 1)


def wind_figure(comparison: WindComparison, title: str) -> Figure:
    """Return the mean bending moment, and the side of its peak of |mean| + 3 sigma, over time under each wind."""
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.4), layout="constrained")
        axes = figure.subplots()
        first = next(iter(comparison.statistics.values()))
        factor, unit = display("N m", larger_sides(first, "wind"))
        mean = first["mean"].sel(response=BENDING, source="wind")
        mean_at_peak = float(mean[int(np.argmax(larger_sides(first, "wind").sel(response=BENDING).values))])
        for k, (name, statistics) in enumerate(comparison.statistics.items()):
            part = statistics.sel(response=BENDING, source="wind")
            style = {"color": f"C{k}", "lw": 2.4 if k == 0 else 1.4}
            toward = part["mean"] + sign(mean_at_peak) * SIGMAS * part["std"]
            axes.plot(part["time"], factor * toward, label=name, **style)
            axes.plot(part["time"], factor * part["mean"], ":", **style)
        axes.axhline(0, color="black", lw=0.6)
        axes.set(xlabel="flight time (s)", ylabel=f"bending moment ({unit})", title=title)
        axes.legend(title=f"solid: {side(mean_at_peak)} from wind alone, dotted: mean")
    return figure
