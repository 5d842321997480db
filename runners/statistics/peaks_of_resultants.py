"""The peaks of resultants held against another road: mean and covariance of both planes by CVODES's adjoint.

An adjoint run gives variances of linear forms. Of each pair it is run for both responses and for their sum, whose
variance holds the covariance between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.vehicle.planes import PLANES
from ..case.case import Case
from ..present.netcdf import RULE
from ..present.progress import steps
from ..present.wording import display, words
from ..solvers.adjoint import AdjointSolver
from .cvodes import Cvodes
from .norm import NormOfNormal
from .peak_check import LIMIT, in_words
from .resultants import ResultantPeak, Resultants, resultant_pairs
from .results import ResponseStatistics


@dataclass(frozen=True, eq=False)
class ResultantCheck:
    """The peak of every resultant by the run's engine and by CVODES.

    Attributes
    ----------
    peaks : tuple of ResultantPeak
        By the run's engine, one a resultant.
    probability : float
        With which a resultant passes its level there.
    law, reference : NormOfNormal
        Of the resultants at their own peaks (resultants,), by the engine and by CVODES.
    """

    peaks: tuple[ResultantPeak, ...]
    probability: float
    law: NormOfNormal
    reference: NormOfNormal

    @property
    def reference_level(self) -> NDArray[np.float64]:
        """The level passed with the probability by CVODES's mean and covariance, (resultants,)."""
        return self.reference.percentile(self.probability)

    @property
    def difference(self) -> NDArray[np.float64]:
        """The largest relative difference of mean vector, covariance and level, (resultants,)."""
        level = np.array([peak.value for peak in self.peaks])
        return law_difference(self.law, level, self.reference, self.reference_level)

    @property
    def agree(self) -> bool:
        return bool((self.difference <= LIMIT).all())

    def verdict(self) -> str:
        """Return one sentence for people."""
        found = np.where(np.isnan(self.difference), np.inf, self.difference)
        worst = int(np.argmax(found))
        peak, there = self.peaks[worst], float(self.reference_level[worst])
        if self.agree:
            return (
                "Resultants at their peaks again with CVODES, mean and covariance of both planes: they agree to "
                f"{in_words(float(found[worst]))}, {words(peak.resultant)} at {peak.time:g} s the farthest."
            )
        factor, unit = display(peak.unit, peak.value)
        return (
            f"{words(peak.resultant).capitalize()} at its peak, {peak.time:g} s, is passed with {self.probability:.3g} "
            f"at {factor * peak.value:.6g} {unit} here and {factor * there:.6g} {unit} by CVODES on the same system; "
            f"mean, covariance or level are {in_words(float(found[worst]))} apart and {in_words(LIMIT)} is allowed. Do "
            "not trust the resultants: look for a jump that no event declares, or ask for a tighter tolerance."
        )

    def variables(self) -> tuple[dict[str, tuple], dict[str, tuple]]:
        """Return variables over (resultant) for a dataset of statistics, and their coordinates."""
        matrix = ("resultant", "plane", "other_plane")
        both = {RULE: "resultant"}
        variables = {
            "resultant_peak_time": ("resultant", [p.time for p in self.peaks], {"units": "s"}),
            "resultant_peak": (
                "resultant",
                [p.value for p in self.peaks],
                both | {"long_name": f"largest level passed with {self.probability:.6g} at an instant"},
            ),
            "resultant_peak_reference": (
                "resultant",
                self.reference_level,
                both | {"long_name": "the same by CVODES"},
            ),
            "resultant_peak_reference_mean": (
                matrix[:2],
                self.reference.mean,
                both | {"long_name": "mean in each plane at the peak by CVODES"},
            ),
            "resultant_peak_reference_covariance": (
                matrix,
                self.reference.covariance,
                {RULE: "resultant^2", "long_name": "covariance of both planes at the peak by CVODES"},
            ),
            "resultant_peak_difference": (
                "resultant",
                self.difference,
                {"units": "1", "long_name": "largest relative difference of mean, covariance and level"},
            ),
        }
        names, units = zip(*((p.resultant, p.unit) for p in self.peaks), strict=True)
        coordinates = {
            "resultant": ("resultant", list(names)),
            "resultant_unit": ("resultant", list(units)),
            "plane": ("plane", list(PLANES)),
            "other_plane": ("other_plane", list(PLANES)),
        }
        return variables, coordinates


def law_difference(
    law: NormOfNormal, level: NDArray[np.float64], reference: NormOfNormal, reference_level: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the largest relative difference of mean vectors, covariances and levels of norms, (...)."""
    size, variance = reference.rms(), np.trace(reference.covariance, axis1=-2, axis2=-1)
    mean = np.linalg.norm(law.mean - reference.mean, axis=-1) / np.where(size > 0, size, 1.0)
    spread = np.abs(law.covariance - reference.covariance).max(axis=(-2, -1)) / np.where(variance > 0, variance, 1.0)
    by_level = np.abs(level - reference_level) / np.where(reference_level > 0, reference_level, 1.0)
    return np.max([mean, spread, by_level], axis=0)


@steps("resultants again by another road")
def check_resultants(case: Case, resultants: Resultants, engine: Cvodes | None = None) -> ResultantCheck:
    """Compute mean and covariance of both planes at the peak of every resultant again by CVODES.

    Parameters
    ----------
    case : Case
    resultants : Resultants
    engine : Cvodes, optional
        With its default options without it.

    Raises
    ------
    IntegrationError
    """
    found = tuple(resultants.peaks())
    solver = AdjointSolver(case.mean.fill(case.executable), engine or Cvodes())
    here = [resultants.norm(peak.resultant) for peak in found]
    times = [float(t) for t in resultants.dataset["time"].values]
    at = [times.index(peak.time) for peak in found]
    law = NormOfNormal(
        np.array([norm.mean[k] for norm, k in zip(here, at, strict=True)]),
        np.array([norm.covariance[k] for norm, k in zip(here, at, strict=True)]),
    )
    mean, covariance = np.zeros_like(law.mean), np.zeros_like(law.covariance)
    for time in sorted({peak.time for peak in found}):
        which = [r for r, peak in enumerate(found) if peak.time == time]
        there = laws_by_adjoint(case, solver, time, [found[r].resultant for r in which])
        mean[which], covariance[which] = there.mean, there.covariance
    chance = float(resultants.dataset["probability"].values[0])
    return ResultantCheck(found, chance, law, NormOfNormal(mean, covariance))


def laws_by_adjoint(case: Case, solver: AdjointSolver, time: float, resultants: list[str]) -> NormOfNormal:
    """Return the law of resultants at a time by adjoint runs, (resultants,)."""
    pairs = resultant_pairs(case.system.output_names)
    rows = [tuple(case.system.output_index(name) for name in pairs[resultant]) for resultant in resultants]
    mean, covariance = solver.pair_moments(time, rows)
    return NormOfNormal(mean, covariance.sum(axis=1))


def with_resultant_check(statistics: ResponseStatistics, check: ResultantCheck) -> ResponseStatistics:
    """Return statistics with the peaks of resultants and what CVODES gives there.

    Returns
    -------
    ResponseStatistics
        Over (resultant) besides: ``resultant_peak_time``, ``resultant_peak``, ``resultant_peak_reference``, the level
        by CVODES, ``resultant_peak_reference_mean`` (resultant, plane), ``resultant_peak_reference_covariance``
        (resultant, plane, other_plane) and ``resultant_peak_difference``, the largest relative one of all three.
    """
    variables, coordinates = check.variables()
    return ResponseStatistics(statistics.dataset.assign_coords(coordinates).assign(variables))
