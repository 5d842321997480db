"""The figure of limits along the vehicle: what each station can carry, what it meets, and how often it passes."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from .passage import Passage


def capability_figure(passage: Passage, title: str) -> Figure:
    """Return limit and level of each load over stations, at the time of its least margin, over the chance to pass.

    Parameters
    ----------
    passage : Passage
        Of limits over stations.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    found, chance = passage.to_dataset(), passage.by_load.values
    names = list(dict.fromkeys(load.name for load in passage.loads))
    station = np.array([load.station for load in passage.loads])
    least = found["margin"].values.argmin(axis=0)
    limit, level = (found[name].values[least, np.arange(station.size)] for name in ("limit", "level"))
    scaled = f"limits times {passage.factor.value:.3g}: {passage.design:g} of flights pass one"
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 2.7 * (len(names) + 1) + 1.0), layout="constrained")
        panels = figure.subplots(len(names) + 1, sharex=True)
        for name, axes in zip(names, panels, strict=False):
            of = [k for k, load in enumerate(passage.loads) if load.name == name]
            factor, unit = display(passage.loads[of[0]].unit, limit[of])
            axes.plot(station[of], factor * limit[of], color="black", lw=2, marker=".", label="limit")
            axes.plot(station[of], factor * passage.factor.value * limit[of], ":", color="black", lw=1.4, label=scaled)
            instant = f"passed with {passage.design:g} at an instant"
            axes.plot(station[of], factor * level[of], color=COLORS["combined"], lw=2, marker=".", label=instant)
            axes.set(ylabel=f"{words(name)} ({unit})", ylim=(0, None))
            axes.legend(fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
            shown = np.where(chance[of] > 0, chance[of], np.nan)
            panels[-1].semilogy(station[of], shown, marker=".", label=words(name))
        whole = passage.probability.value
        panels[-1].axhline(whole, color="black", lw=1.4, ls="--", label=f"any of them: {whole:.2g}")
        panels[-1].set(xlabel="vehicle station (m)", ylabel="chance in a flight")
        if whole > 0:
            panels[-1].set_ylim(whole * 1e-4, whole * 3)
        panels[-1].legend(fontsize=9)
        figure.suptitle(wrapped(title))
    return figure
