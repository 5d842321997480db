"""Resultants of both planes by independent roads, held against CVODES; simulated flights by how many pass a level."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, bdtrc

from ..case.case import Case
from ..solvers.adjoint import AdjointSolver
from ..solvers.ensemble import run_ensemble
from .cvodes import Cvodes
from .ensemble import Ensemble
from .norm import NormOfNormal
from .peaks_of_resultants import law_difference, laws_by_adjoint
from .resultants import resultant_pairs
from .results import ResponseStatistics

PROBABILITY = 0.05  # of the level that flights are counted beyond: of 500 flights 25 pass it


@dataclass(frozen=True, eq=False)
class ResultantAgreement:
    """What the engines found of k times and r resultants.

    Attributes
    ----------
    times : list of float
        s.
    resultants, units : list of str
    probability : float
        With which the levels are passed at an instant.
    level : (k, r) array
        By CVODES, SI.
    differences : dict of engine to (k, r) array
        Largest relative difference of mean vector, covariance and level to CVODES.
    passed : (k, r) array of int
        Simulated flights beyond the level,
    flights : int
        of so many.
    confidence : float
        Of the interval that the number is expected in.
    """

    times: list[float]
    resultants: list[str]
    units: list[str]
    probability: float
    level: NDArray[np.float64]
    differences: dict[str, NDArray[np.float64]]
    passed: NDArray[np.intp]
    flights: int
    confidence: float

    @property
    def interval(self) -> tuple[int, int]:
        """Numbers between which as many flights pass as the confidence says, of the binomial law."""
        from scipy.stats import binom  # takes a third of a second to import

        low, high = binom.interval(self.confidence, self.flights, self.probability)
        return int(low), int(high)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether the number of flights lies in the interval, (k, r)."""
        low, high = self.interval
        return (self.passed >= low) & (self.passed <= high)

    def impossible(self, chance: float) -> NDArray[np.bool_]:
        """Return the entries (k, r) that a right result would have with less than a chance, all of them together."""
        each = chance / (2 * self.passed.size)
        below = bdtr(self.passed, self.flights, self.probability)
        above = np.where(self.passed > 0, bdtrc(self.passed - 1, self.flights, self.probability), 1.0)
        return (below < each) | (above < each)


def resultant_agreement(
    case: Case,
    times: list[float],
    statistics: Mapping[str, ResponseStatistics],
    ensemble: Ensemble,
    probability: float = PROBABILITY,
) -> ResultantAgreement | None:
    """Return the agreement of resultants; None for a system without both planes.

    Parameters
    ----------
    case : Case
    times : list of float
        s.
    statistics : mapping of engine to ResponseStatistics
        Of the engines that give covariances those are held against CVODES.
    ensemble : Ensemble
        Whose flights are flown.
    probability : float

    Raises
    ------
    IntegrationError, EnsembleNeedsCompilerError
    """
    pairs = resultant_pairs(case.system.output_names)
    if not pairs:
        return None
    names, solver = list(pairs), AdjointSolver(case.with_means, Cvodes.tight())
    laws = [laws_by_adjoint(case, solver, time, names) for time in times]
    reference = NormOfNormal(np.array([law.mean for law in laws]), np.array([law.covariance for law in laws]))
    level = reference.percentile(probability)
    differences = {}
    for engine, found in statistics.items():
        if "covariance" not in found.dataset:
            continue
        own = [found.norm(*pairs[name]) for name in names]
        law = NormOfNormal(np.stack([n.mean for n in own], axis=1), np.stack([n.covariance for n in own], axis=1))
        differences[engine] = law_difference(law, law.percentile(probability), reference, level)
    flown = run_ensemble(
        case.with_means, times, runs=ensemble.runs, seed=ensemble.seed, substep=ensemble.substep, paths=ensemble.runs,
        path_spacing=float("inf"), threads=ensemble.threads,
    )  # fmt: skip
    at = [int(np.argmin(np.abs(flown.path_times - time))) for time in times]
    rows = [[case.system.output_index(name) for name in pairs[resultant]] for resultant in names]
    sizes = np.linalg.norm(flown.paths[:, at][:, :, np.array(rows)], axis=3)
    units = [case.system.outputs[first].unit for first, _ in rows]
    passed = (sizes > level).sum(axis=0)
    return ResultantAgreement(
        times, names, units, probability, level, differences, passed, ensemble.runs, ensemble.confidence
    )
