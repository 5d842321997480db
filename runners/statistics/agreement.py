"""The same statistics by independent roads, held against each other, with a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..present.progress import each
from ..solvers.ensemble import mean_interval, std_interval
from .agreement_of_resultants import ResultantAgreement, resultant_agreement
from .cvodes import Cvodes
from .engine import relative_difference
from .engines import ENGINES, response_statistics
from .ensemble import Ensemble
from .results import ResponseStatistics

if TYPE_CHECKING:
    from ..case.case import Case

REFERENCE = Cvodes.name
LIMIT = 1e-6  # relative, between engines that only discretise
SUBSTEP_ERROR = 5e-5  # relative, of an ensemble of infinitely many runs (tests/runners/solvers/test_ensemble.py)
MEAN_SUBSTEP_ERROR = 2e-4  # of the deviation from all sources; Falcon 1 at 30 s: 1.2e-4, with half the substep 0.3e-4
NOTHING = 1e-14  # of the combined deviation: what a solver's rounding makes of a source that does not reach a response
FALSE_ALARM = 1e-3  # chance that a right ensemble is called wrong, all entries together


@dataclass(frozen=True, eq=False)
class Agreement:
    """What the engines found.

    Attributes
    ----------
    statistics : dict of engine to ResponseStatistics
    differences : dict of engine to (times, responses, sources) array
        Relative difference of the standard deviation to the reference, for the engines without noise.
    mean_differences : dict of engine to (times, responses, sources) array
        Of the mean, relative to its size or the deviation from all sources, whichever is larger.
    inside : (times, responses, sources) array of bool
        Whether the reference's standard deviation lies in the ensemble's confidence interval.
    mean_inside : (times, responses, sources) array of bool
    impossible : (times, responses, sources) array of bool
        Entries outside an interval so wide that a right result would leave it once in a thousand ensembles.
    resultants : ResultantAgreement or None
        Of a system in both planes.
    """

    statistics: dict[str, ResponseStatistics]
    differences: dict[str, NDArray[np.float64]]
    mean_differences: dict[str, NDArray[np.float64]]
    inside: NDArray[np.bool_]
    mean_inside: NDArray[np.bool_]
    impossible: NDArray[np.bool_]
    resultants: ResultantAgreement | None = None

    @property
    def agree(self) -> bool:
        return not self.complaints()

    def complaints(self) -> list[str]:
        """Return what disagrees, a sentence each."""
        found = []
        for what, differences in (("standard deviation", self.differences), ("mean", self.mean_differences)):
            for engine, values in differences.items():
                worst = np.unravel_index(np.argmax(np.where(np.isnan(values), np.inf, values)), values.shape)
                if not values[worst] <= LIMIT:
                    found.append(
                        f"{what} by {ENGINES[engine].label} differs by {values[worst]:.1e} in {self._entry(worst)}; "
                        f"{LIMIT:g} is allowed"
                    )
        if self.impossible.any():
            worst = tuple(int(i[0]) for i in np.nonzero(self.impossible))
            found.append(
                f"{int(self.impossible.sum())} of {self.impossible.size} entries lie outside the ensemble by more than "
                f"chance allows, the first in {self._entry(worst)}"
            )
        return found + self._complaints_of_resultants()

    def _complaints_of_resultants(self) -> list[str]:
        of, found = self.resultants, []
        if of is None:
            return found
        for engine, values in of.differences.items():
            k, r = np.unravel_index(np.argmax(np.where(np.isnan(values), np.inf, values)), values.shape)
            if not values[k, r] <= LIMIT:
                found.append(
                    f"mean, covariance or level of {of.resultants[r]} by {ENGINES[engine].label} differs by "
                    f"{values[k, r]:.1e} at {of.times[k]:g} s; {LIMIT:g} is allowed"
                )
        impossible = of.impossible(FALSE_ALARM)
        if impossible.any():
            k, r = (int(i[0]) for i in np.nonzero(impossible))
            found.append(
                f"{of.passed[k, r]} of {of.flights} simulated flights pass the level of {of.resultants[r]} at "
                f"{of.times[k]:g} s, which {of.probability:g} should, by more than chance allows"
            )
        return found

    def verdict(self) -> str:
        """Return one or two sentences for people."""
        complaints = self.complaints()
        if complaints:
            return "The engines DISAGREE: " + "; ".join(complaints) + "."
        worst = max((float(d.max()) for d in self.differences.values()), default=0.0)
        names = ", ".join(ENGINES[e].label for e in (REFERENCE, *self.differences))
        ensemble = self.statistics["ensemble"].attrs
        both = ""
        if self.resultants is not None:
            apart = max((float(d.max()) for d in self.resultants.differences.values()), default=0.0)
            both = (
                f" Resultants agree within {apart:.1e}; of {self.resultants.inside.size} levels "
                f"{self.resultants.inside.sum()} are passed by as many flights as expected."
            )
        return (
            f"The engines agree: standard deviations by {names} within {worst:.1e}; {self.inside.sum()} of "
            f"{self.inside.size} lie in the {ensemble['confidence']:.0%} interval of {ensemble['runs']} simulated "
            f"flights (about {ensemble['confidence'] * self.inside.size:.0f} expected), none beyond chance.{both}"
        )

    def _entry(self, index: tuple) -> str:
        reference = self.statistics[REFERENCE]
        k, r, s = index
        return (
            f"{reference['response'].values[r]} from {reference['source'].values[s]} at "
            f"{reference['time'].values[k]:g} s"
        )


def agreement(case: Case, times: list[float], ensemble: Ensemble) -> Agreement:
    """Compute the statistics with every engine at a tight setting and compare.

    Parameters
    ----------
    case : Case
    times : list of float
        s.
    ensemble : Ensemble

    Raises
    ------
    TimeRangeError, IntegrationError, EnsembleNeedsCompilerError
    """
    statistics = {}
    for name, engine in each(list(ENGINES.items()), "engines"):
        statistics[name] = response_statistics(case, times, engine=engine.tight() or ensemble)
    reference = statistics[REFERENCE]
    std, mean = reference.std.values, reference.mean.values
    combined = std[..., -1:]
    nothing = NOTHING * combined
    differences, mean_differences = {}, {}
    for name, found in statistics.items():
        if name == REFERENCE or ENGINES[name].tight() is None:
            continue
        apart = np.abs(found.std.values - std)
        differences[name] = np.where(apart <= nothing, 0.0, relative_difference(found.std.values, std))
        size = np.maximum(np.maximum(np.abs(mean), combined), np.finfo(float).tiny)
        mean_differences[name] = np.abs(found.mean.values - mean) / size
    sampled = statistics["ensemble"]
    of_mean = (
        MEAN_SUBSTEP_ERROR * combined
    )  # a mean is the same from every source, of which some move it by next to nothing
    wide = 1 - FALSE_ALARM / (2 * std.size)  # Bonferroni: the chances of all entries, means and deviations, add up
    in_std = _inside(std, std_interval(sampled.std.values, ensemble.runs, wide), nothing)
    in_mean = _inside(mean, mean_interval(sampled.mean.values, sampled.std.values, ensemble.runs, wide), of_mean)
    return Agreement(
        statistics,
        differences,
        mean_differences,
        _inside(std, (sampled["std_low"].values, sampled["std_high"].values), nothing),
        _inside(mean, (sampled["mean_low"].values, sampled["mean_high"].values), of_mean),
        ~(in_std & in_mean),
        resultant_agreement(case, times, statistics, ensemble),
    )


def _inside(value: NDArray, interval: tuple[NDArray, NDArray], nothing: NDArray | float = 0.0) -> NDArray[np.bool_]:
    low, high = interval
    slack = SUBSTEP_ERROR * np.abs(value) + nothing  # where nothing is random the interval is a point
    return (low - slack <= value) & (value <= high + slack)
