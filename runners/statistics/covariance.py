"""The covariance equation, forward by SciPy, as an engine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import xarray as xr

from ..case.case import Case
from ..present.progress import steps
from ..solvers.covariance import covariance_equation
from ..solvers.tolerances import check_absolute_part, check_relative_tolerance
from .dataset import statistics_dataset, with_covariance
from .engine import Engine, Progress, begun_anew

LEAST_TOLERANCE = 1e-12  # finer ones lie within the rounding of the right-hand side: steps are refused without end


@dataclass(frozen=True)
class CovarianceEquation(Engine):
    """The covariance equation, forward by SciPy's DOP853; nothing of it uses the adjoint.

    Its statistics hold covariances between responses.

    Parameters
    ----------
    relative_tolerance : float
        Relative, of every covariance, between 1e-12 and 1e-2.
    absolute_part : float
        The absolute tolerance as a part of the relative one, of the sizes that each source gives the states
        (runners/solvers/typical_sizes.py): one that hardly moves the vehicle gives covariances many orders smaller
        than the wind's.
    longest_interval : float
        Intervals between discontinuities are divided so that none is longer, s.

    Raises
    ------
    IntegrationError
    """

    relative_tolerance: float = 1e-9
    absolute_part: float = 1e-4
    longest_interval: float = float("inf")

    name: ClassVar[str] = "covariance"
    label: ClassVar[str] = "covariance equation (SciPy)"

    def __post_init__(self):
        check_relative_tolerance(self.relative_tolerance, LEAST_TOLERANCE)
        check_absolute_part(self.absolute_part)

    def compute(
        self, case: Case, times: list[float], responses: list[str], progress: Progress | None = None
    ) -> xr.Dataset:
        rows = [case.system.output_index(name) for name in responses]
        with steps("end times by the covariance equation", len(times)) as line:

            def heard(time: float) -> None:
                line.done()
                if progress:
                    progress(time)

            found = covariance_equation(
                case.with_means, times, self.relative_tolerance, heard, self.longest_interval, self.absolute_part
            )
        attributes = {"engine": self.name, "relative_tolerance": self.relative_tolerance}
        dataset = statistics_dataset(case, times, responses, found.mean[:, rows], found.variance[:, rows], attributes)
        return with_covariance(dataset, found.covariance, rows)

    def finer(self, flight: float) -> CovarianceEquation:
        settings = begun_anew(self.relative_tolerance, self.absolute_part, self.longest_interval, flight)
        return replace(self, **settings)

    @classmethod
    def tight(cls) -> CovarianceEquation:
        """Return the equation as it is held against other engines."""
        return cls(relative_tolerance=1e-9)
