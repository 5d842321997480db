"""The figure of a design: what is designed and limited over the end times, before and after."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ...model.errors import IntegrationError
from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from ..statistics.resultants import labels_of, outputs_of
from .design import DesignResult
from .peaks import three_sigma


def design_figure(result: DesignResult, title: str) -> Figure:
    """Return both sides of the response that was designed and of those with a limit, before and after.

    Parameters
    ----------
    result : DesignResult
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    IntegrationError
        A flight before or after the design is beyond numbers.
    """
    problem = result.problem
    names, times = [problem.response, *problem.peak_limits], np.array(problem.times)
    before, after = (three_sigma(study, names, problem.times) for study in (problem.study, result.study))
    if before is None or after is None:
        raise IntegrationError("a flight of this design is too unstable to integrate, so that it has no figure")
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 2.6 * len(names) + 1.0), layout="constrained")
        panels = figure.subplots(len(names), sharex=True, squeeze=False)[:, 0]
        for r, axes in enumerate(panels):
            limit = problem.peak_limits.get(names[r])
            factor, unit = display(labels_of(problem.study, names[r])[0].unit, [before[r], after[r]])
            of_two = len(outputs_of(problem.study, names[r])) == 2
            for values, color, label in ((before, COLORS["mean"], "before"), (after, COLORS["wind"], "after")):
                axes.plot(times, factor * values[r, 0], color=color, lw=1.8, marker=".", ms=4, label=label)
                if not of_two:
                    axes.plot(times, -factor * values[r, 1], color=color, lw=1.8, marker=".", ms=4)
            if limit is not None:
                for side in (1,) if of_two else (1, -1):
                    axes.axhline(side * factor * limit, color=COLORS["combined"], lw=1.4, ls="--",
                                 label="limit" if side > 0 else None)  # fmt: skip
            if not of_two:
                axes.axhline(0, color="black", lw=0.6)
            what = "level" if of_two else "mean ± 3σ"
            axes.set_ylabel(f"{words(names[r])}\n{what} ({unit})")
            axes.legend(fontsize=9, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        panels[-1].set_xlabel("flight time (s)")
        changed = (f"{name} {result.start[name]:.4g} to {value:.4g}" for name, value in result.values.items())
        figure.suptitle(wrapped(f"{title}\n{', '.join(changed)}"))
    return figure
