"""The figure of a design wind: the most likely wind behind a load over altitude, and what else makes that load."""

from __future__ import annotations

from matplotlib import rc_context

from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from .design_wind import DesignWind


def design_wind_figure(found: DesignWind, title: str) -> Figure:
    """Return profile, mean wind and the band of winds that make the load over altitude, a panel a component.

    Parameters
    ----------
    found : DesignWind
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    profile = found.profile
    h, corner = profile["altitude"].values / 1000, found.altitude_at_time / 1000
    both = "component" in profile.dims
    components = [str(name) for name in profile["component"].values] if both else [""]
    factor, unit = display(found.unit, found.load)
    of = "all sources" if found.combined else "the wind alone"
    told = f"behind a {words(found.response)} of {factor * found.load:.4g} {unit} at {found.time:g} s"
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0 if both else 6.5, 6.5), layout="constrained")
        panels = figure.subplots(1, len(components), sharey=True, squeeze=False)[0]
        for name, axes in zip(components, panels, strict=True):
            part = profile.sel(component=name) if both else profile
            low, high = part["band"].values.T
            axes.fill_betweenx(h, low, high, color=COLORS["wind"], alpha=0.2, lw=0,
                               label="95 % of the winds that make the load")  # fmt: skip
            axes.plot(part["mean"], h, color=COLORS["mean"], lw=1.4, label="mean wind")
            axes.plot(part["wind"], h, color=COLORS["wind"], lw=2, label="most likely wind")
            axes.axhline(corner, color="black", lw=0.8, ls="--", label=f"vehicle at {found.time:g} s")
            axes.set_xlabel(f"{name} wind (m/s)" if both else "wind along +Y (m/s)")
        panels[0].set(ylabel="altitude (km)", ylim=(float(h[0]), float(h[-1])))
        figure.legend(*panels[0].get_legend_handles_labels(), fontsize=9, loc="outside lower center", ncols=2)
        sigmas = f"mean {'+' if found.sigmas >= 0 else '-'} {abs(found.sigmas):.3g} sigma of {of}"
        figure.suptitle(wrapped(f"{title}\n{told}\n{sigmas}" if found.sigmas else f"{title}\n{told}\nthe mean wind"))
    return figure
