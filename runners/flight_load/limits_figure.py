"""The figure of limits over time: what each may be, what it reaches, and how often it passes."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from .passage import Passage

MOST = 4  # of the limits, those passed most often


def limits_figure(passage: Passage, title: str) -> Figure:
    """Return limit and level of the loads whose limits are passed most often, a panel each, over flight time.

    Parameters
    ----------
    passage : Passage
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    chance, times = passage.by_load.values, passage.margin["time"].values
    shown = np.argsort(-chance, kind="stable")[:MOST]
    level, limit, scale = passage.level.values, passage.limit_told, passage.factor.value
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 2.5 * shown.size + 1.0), layout="constrained")
        panels = figure.subplots(shown.size, sharex=True, squeeze=False)[:, 0]
        for r, axes in zip(shown, panels, strict=True):
            load = passage.loads[r]
            factor, unit = display(load.unit, limit[:, r])
            axes.plot(times, factor * limit[:, r], color="black", lw=2, label="limit")
            axes.plot(times, factor * scale * limit[:, r], ":", color="black", lw=1.4,
                      label=f"limits times {scale:.3g}: {passage.design:g} of flights pass one")  # fmt: skip
            axes.plot(times, factor * level[:, r], color=COLORS["combined"], lw=2,
                      label=f"passed with {passage.design:g} at an instant")  # fmt: skip
            axes.set_ylabel(f"{words(str(load)).replace(' at station', chr(10) + 'at station')} ({unit})")
            axes.set_ylim(min(0.0, axes.get_ylim()[0]), None)
            axes.text(0.01, 0.04, f"passed by {chance[r]:.2g} of flights", transform=axes.transAxes)
            if r == shown[0]:
                axes.legend(fontsize=9, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        panels[-1].set(xlabel="flight time (s)", xlim=(float(times[0]), float(times[-1])))
        whole = f"{passage.probability.value:.2g} of flights pass one of {len(passage.loads)} limits"
        figure.suptitle(wrapped(f"{title}\n{whole}"))
    return figure
