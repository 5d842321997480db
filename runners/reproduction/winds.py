"""The bending moment under other wind models (report section 5.1 and figure 5-2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib import rc_context

from ...model.wind.range_reference import shipped_statistics
from ..case.times import drawn_times
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
    drawn : dict of str to ResponseStatistics
        The same at the times at which curves are drawn.
    """

    statistics: dict[str, ResponseStatistics]
    sensitivity: float
    drawn: dict[str, ResponseStatistics]


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
    finer = drawn_times(times, study.executable.stops(times[-1]).times)
    studies = {"as in the vehicle": study} | {name: study.with_wind(winds[name]) for name in SHOWN}
    found, drawn = {}, {}
    for name, under in studies.items():
        found[name], drawn[name] = (under.response_statistics(t, responses=[BENDING]) for t in (times, finer))
        progress()
    return WindComparison(found, variances[1] / variances[0] - 1, drawn)


def wind_figure(comparison: WindComparison, title: str) -> Figure:
    """Return the mean bending moment and both sides of mean ± 3 sigma, that of the peak thick, under each wind."""
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.4), layout="constrained")
        axes = figure.subplots()
        first = next(iter(comparison.drawn.values()))
        factor, unit = display("N m", larger_sides(first, "wind"))
        mean = first["mean"].sel(response=BENDING, source="wind")
        mean_at_peak = float(mean[int(np.argmax(larger_sides(first, "wind").sel(response=BENDING).values))])
        for k, (name, statistics) in enumerate(comparison.drawn.items()):
            part = statistics.sel(response=BENDING, source="wind")
            style = {"color": f"C{k}", "lw": 2.4 if k == 0 else 1.4}
            toward, away = (part["mean"] + s * sign(mean_at_peak) * SIGMAS * part["std"] for s in (1, -1))
            axes.plot(part["time"], factor * toward, label=name[0].upper() + name[1:], **style)
            axes.plot(part["time"], factor * away, **(style | {"lw": 0.5 * style["lw"]}))
            axes.plot(part["time"], factor * part["mean"], ":", **style)
        axes.axhline(0, color="black", lw=0.6)
        axes.set(xlabel="flight time (s)", ylabel=f"bending moment ({unit})", title=title)
        told = f"from wind alone; thick: {side(mean_at_peak)}, thin: the other side, dotted: mean"
        figure.legend(title=told, fontsize=9, title_fontsize=9, loc="outside lower center", ncols=3)
    return figure
