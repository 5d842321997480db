"""What a synthesis of a shaping filter hands back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....model.errors import AscentwindError
from ....model.wind.shaping_filter import ShapingFilter
from ....model.wind.statistics import WindStatistics
from ...present.notebook import html_of
from ..fitting.frozen_poles import largest_pole
from ..fitting.intervals import share_inside


class SynthesisError(AscentwindError):
    """A filter cannot be synthesised from these statistics by this method."""


@dataclass(frozen=True, eq=False, repr=False)
class SynthesisResult:
    """A filter and how well it meets the statistics it was made for.

    Attributes
    ----------
    method : str
    statistics : WindStatistics
    shaping_filter : ShapingFilter
    covariance : (k, k) array
        Of the filter's output at the altitudes of the statistics by the method's own formula, m2/s2.
    converged : bool
        False when the optimiser stalled or ran out of time; the filter is then the best found.
    message : str
    evaluations : int
    seconds : float
    coefficients : mapping of str to (altitudes, values)
        In the method's own terms, such as A, B, psi, alpha_1, alpha_2, omega of (3-10).
    """

    method: str
    statistics: WindStatistics
    shaping_filter: ShapingFilter
    covariance: NDArray[np.float64]
    converged: bool
    message: str = ""
    evaluations: int = 0
    seconds: float = 0.0
    coefficients: Mapping[str, tuple[NDArray, NDArray]] = field(default_factory=dict)

    @property
    def error(self) -> NDArray[np.float64]:
        """Covariance of the filter less that of the data, m2/s2, (k, k)."""
        return self.covariance - self.statistics.covariance

    @property
    def cost(self) -> float:
        """Objective function J of (3-7): sum of the squared errors of the distinct covariances, m4/s4."""
        return float(np.sum(self.error[np.triu_indices(len(self.error))] ** 2))

    @property
    def rms_error(self) -> float:
        """Root mean square error of the distinct covariances, m2/s2."""
        return float(np.sqrt(self.cost / (len(self.error) * (len(self.error) + 1) / 2)))

    @property
    def error_by_altitude(self) -> NDArray[np.float64]:
        """Root mean square error of the covariances with each altitude, m2/s2, (k,)."""
        return np.sqrt(np.mean(self.error**2, axis=1))

    @cached_property
    def largest_pole(self) -> float:
        """Largest real part of the frozen poles between the lowest and the highest altitude, 1/m."""
        return largest_pole(self.shaping_filter)

    def share_inside(self, confidence: float = 0.90) -> float:
        """Return the share of the distinct covariances inside the confidence interval of the data."""
        s = self.statistics
        return share_inside(self.covariance, s.covariance, s.independent_samples, confidence)

    def __repr__(self) -> str:
        made = self.shaping_filter
        lines = [
            f"SynthesisResult of {self.statistics.name} by {self.method}, {'' if self.converged else 'not '}converged",
            f"filter: order {made.order}, {made.noise_count} noises, {made.altitude[0]:g} to {made.altitude[-1]:g} m",
            f"rms error of the covariances: {self.rms_error:.4g} m2/s2",
            f"inside the 90 % interval of the data: {100 * self.share_inside():.1f} %",
        ]
        return "\n  ".join(lines + ([f"message: {self.message}"] if self.message else []))

    def _repr_html_(self) -> str:
        return html_of(repr(self))
