"""The figure of error and run time against tolerance, and of the variables that pace the step."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib import rc_context
from matplotlib.ticker import NullFormatter, NullLocator

from ..present.style import STYLE, Figure
from .tolerance import Measurement, Pace


def tolerance_figure(measurements: Sequence[Measurement], paces: Sequence[Pace], title: str) -> Figure:
    """Return error and run time against tolerance for each engine, and the steps over flight time with their limit."""
    with rc_context(STYLE):
        figure = Figure(figsize=(13.0, 4.8), layout="constrained")
        error, seconds, steps = figure.subplots(1, 3)
        for k, label in enumerate(dict.fromkeys(m.engine for m in measurements)):
            rows = [m for m in measurements if m.engine == label]
            tolerance = [m.tolerance for m in rows]
            mark = {"marker": "osD^vP"[k % 6], "ms": 4.5, "color": f"C{k}", "label": label}
            error.loglog(tolerance, [m.error for m in rows], **mark)
            seconds.loglog(tolerance, [1e3 * m.seconds for m in rows], **mark)
        ends = sorted({m.tolerance for m in measurements})
        error.loglog(ends, ends, ":", color="black", label="error = tolerance")
        error.set(xlabel="relative tolerance", ylabel="largest relative error of a σ")
        seconds.set(xlabel="relative tolerance", ylabel="run time (ms)")
        for axes in (error, seconds):
            axes.invert_xaxis()
            axes.xaxis.set_minor_locator(NullLocator())
        error.yaxis.set_minor_locator(NullLocator())  # of decades, and grid lines there
        seconds.yaxis.set_minor_formatter(NullFormatter())
        error.legend(fontsize=8.5)
        edges = [paces[0].begin, *(p.end for p in paces)]
        for values, label, color in (
            ([p.newton_step for p in paces], "Adams, Newton", "C0"),
            ([p.functional_step for p in paces], "Adams, functional", "C1"),
            ([p.functional_limit for p in paces], "limit of functional iteration, 2 / |root|", "black"),
        ):
            line = ":" if color == "black" else "-"
            steps.stairs([1e3 * v for v in values], edges, baseline=None, label=label, color=color, ls=line, lw=1.8)
        steps.set(xlabel="flight time (s)", ylabel="mean step of CVODES (ms)")
        steps.set_ylim(0, 1.35e3 * max(max(p.functional_limit, p.newton_step, p.functional_step) for p in paces))
        steps.legend(fontsize=8.5)
        figure.suptitle(title)
    return figure
