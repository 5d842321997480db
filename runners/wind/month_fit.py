"""Filters of both components of a month, and what joins them, as one wind to keep."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model.wind.month_winds import MonthWind
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.statistics import TwoComponentStatistics
from ..solvers.least_squares import FitOptions
from .synthesis.synthesise import synthesise
from .two_component_fit import fit_noise_correlation

EVERY = 4  # of the fitted samples are kept, 250 m apart: a quarter of the size
OPTIONS = FitOptions(time_limit=1800.0)  # some 40 times what a fit takes: where it ends is no matter of the machine


def fit_month(
    both: TwoComponentStatistics, period: str, site: str, edition: str, options: FitOptions = OPTIONS
) -> MonthWind:
    """Return the wind of a month: third order and two noises for each component, joined by their first noises.

    Parameters
    ----------
    both : TwoComponentStatistics
    period, site, edition : str
    options : FitOptions, optional

    Raises
    ------
    SynthesisError, FitError
    """
    parts = both.zonal, both.meridional
    zonal, meridional = (
        thinned(synthesise(part, "state-space", 3, options, noises=2).shaping_filter) for part in parts
    )
    h = both.zonal.altitude
    correlation, start = fit_noise_correlation(
        zonal, meridional, h, both.intralevel_correlation, (parts[0].standard_deviation, parts[1].standard_deviation)
    )
    mean = np.array([part.mean for part in parts])
    samples = min(part.independent_samples for part in parts)
    return MonthWind(period, site, edition, zonal, meridional, correlation, start, h, mean, samples, both.zonal.source)


def thinned(shaping_filter: ShapingFilter) -> ShapingFilter:
    """Return a filter at every fourth of its samples, its kinks among them."""
    f = shaping_filter
    keep = np.zeros(f.altitude.size, bool)
    keep[::EVERY] = True
    keep[-1] = True
    for kink in f.kinks:
        keep[int(np.argmin(np.abs(f.altitude - kink)))] = True
    return replace(f, altitude=f.altitude[keep], F=f.F[keep], G=f.G[keep], H=f.H[keep])
