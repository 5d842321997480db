"""The peaks of a run held against another road: one adjoint run of CVODES back from each, the report's method.

Where CVODES is itself the engine, the covariance equation is the other road. The runs of CVODES give the weighting
functions of the peaks as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..present.netcdf import RULE
from ..present.progress import steps
from ..present.wording import display, words
from ..solvers.adjoint import AdjointHistory, AdjointSolver
from ..solvers.covariance import covariance_equation
from ..solvers.ensemble import std_interval
from .cvodes import Cvodes
from .engine import relative_difference
from .larger_side import larger_side, sign
from .peaks import Peak
from .results import ResponseStatistics
from .weighting import NOISE_RULE, input_units, weighting_dataset

if TYPE_CHECKING:
    from ..case.case import Case

LIMIT = 1e-4  # relative, between engines that only discretise
SPACING = 0.05  # s, of the weighting functions
COVARIANCE_TOLERANCE = 1e-7
FALSE_ALARM = 1e-3  # chance that a right ensemble is called wrong, all responses together
ROUNDING = 1e-15
ROADS = {"cvodes": "CVODES", "covariance": "the covariance equation"}
POWERS = (
    "10", "100", "1000", "10 000", "100 000", "a million", "10 million", "100 million", "a billion", "10 billion",
    "100 billion", "a trillion", "10 trillion", "100 trillion", "a quadrillion",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class PeakCheck:
    """The peak of every response by the run's engine and by another.

    Attributes
    ----------
    reference : {'cvodes', 'covariance'}
    peaks : tuple of Peak
        By the run's engine, one a response.
    mean, std : (responses,) arrays
        By the reference at each response's own peak, SI.
    allowed : float
        Largest relative difference: 1e-4, or what the sampling of an ensemble explains.
    histories : dict of float to AdjointHistory
        By the time of a peak (s); empty where the reference is no adjoint.
    """

    reference: str
    peaks: tuple[Peak, ...]
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    allowed: float
    histories: dict[float, AdjointHistory]

    @property
    def std_difference(self) -> NDArray[np.float64]:
        """Relative difference of the standard deviations, (responses,)."""
        return relative_difference(np.array([p.std for p in self.peaks]), self.std)

    @property
    def peak_difference(self) -> NDArray[np.float64]:
        """Relative difference of |mean| + 3 sigma, (responses,)."""
        return relative_difference(np.array([p.value for p in self.peaks]), larger_side(self.mean, self.std))

    @property
    def agree(self) -> bool:
        return bool((self.std_difference <= self.allowed).all() and (self.peak_difference <= self.allowed).all())

    def verdict(self) -> str:
        """Return one sentence for people."""
        road = ROADS[self.reference]
        differences = np.fmax(self.std_difference, self.peak_difference)
        differences = np.where(np.isnan(differences), np.inf, differences)
        worst = int(np.argmax(differences))
        peak = self.peaks[worst]
        if self.agree:
            at = f", {words(peak.response)} at {peak.time:g} s the farthest" if differences[worst] >= ROUNDING else ""
            method = " by one adjoint run back from each" if self.reference == "cvodes" else ""
            return f"Peaks computed again with {road}{method}: they agree to {in_words(float(differences[worst]))}{at}."
        factor, unit = display(peak.unit, peak.value)
        what, here, there = "standard deviation", peak.std, self.std[worst]
        if self.std_difference[worst] <= self.allowed:
            what, here, there = "mean", peak.mean, self.mean[worst]
        return (
            f"The {what} of {words(peak.response)} at its peak, {peak.time:g} s, is {factor * here:.6g} {unit} here "
            f"and {factor * there:.6g} {unit} by {road} on the same system; the peaks are "
            f"{in_words(float(differences[worst]))} apart and {in_words(self.allowed)} is allowed. Do not trust these "
            "results: look for a jump that no event declares, or ask for a tighter tolerance."
        )


@steps("peaks again by another road")
def check_peaks(case: Case, statistics: ResponseStatistics) -> PeakCheck:
    """Compute the peaks of statistics again by another road.

    Raises
    ------
    IntegrationError
    """
    found = tuple(statistics.peaks())
    rows = [case.system.output_index(peak.response) for peak in found]
    times = sorted({peak.time for peak in found})
    at = [times.index(peak.time) for peak in found]
    histories: dict[float, AdjointHistory] = {}
    if statistics.attrs["engine"] == "cvodes":
        reference, result = "covariance", covariance_equation(case.with_means, times, COVARIANCE_TOLERANCE)
        mean, variance = result.mean, result.variance.sum(axis=2)
    else:
        reference, solver = "cvodes", AdjointSolver(case.mean.fill(case.executable), Cvodes())
        runs = []
        for time in times:
            run, histories[time] = solver.run_with_history(time, SPACING)
            runs.append(run)
        mean, variance = np.array([r.mean for r in runs]), np.array([r.variance.sum(axis=1) for r in runs])
    std = np.sqrt(np.maximum(variance[at, rows], 0.0))
    return PeakCheck(reference, found, mean[at, rows], std, _allowed(statistics, len(found)), histories)


def _allowed(statistics: ResponseStatistics, count: int) -> float:
    if statistics.attrs["engine"] != "ensemble":
        return LIMIT
    confidence = 1 - FALSE_ALARM / (2 * count)  # Bonferroni
    low, high = std_interval(np.ones(1), int(statistics.attrs["runs"]), confidence)
    return float(max(1 - low[0], high[0] - 1))


def with_peak_check(statistics: ResponseStatistics, check: PeakCheck, case: Case) -> ResponseStatistics:
    """Return statistics with their peaks, what another road gives for them, and the weighting functions there.

    Returns
    -------
    ResponseStatistics
        Over (response) besides: ``peak_time``, ``peak`` (|mean| + 3 sigma), ``peak_side`` (1 or -1),
        ``peak_reference_mean``, ``peak_reference_std``, ``peak_std_difference`` and ``peak_difference``, relative;
        where the reference is CVODES ``peak_noise_weighting`` (response, noise, point) and ``peak_input_weighting``
        (response, input, point) of each response at its own peak, ``peak_weighting_time`` (response, point), NaN
        behind the last point.
    """
    by_response = {
        "peak_time": ([p.time for p in check.peaks], {"units": "s", "long_name": "time of the peak"}),
        "peak": (
            [p.value for p in check.peaks],
            {RULE: "response", "long_name": "largest |mean| + 3 sigma over the end times"},
        ),
        "peak_side": (
            np.array([sign(p.mean) for p in check.peaks], np.int8),
            {"units": "1", "long_name": "1: mean + 3 sigma is the larger side at the peak, -1: mean - 3 sigma"},
        ),
        "peak_reference_mean": (
            check.mean,
            {RULE: "response", "long_name": f"mean at the peak by {ROADS[check.reference]}"},
        ),
        "peak_reference_std": (
            check.std,
            {RULE: "response", "long_name": f"standard deviation there by {ROADS[check.reference]}"},
        ),
        "peak_std_difference": (check.std_difference, {"units": "1", "long_name": "of the standard deviations"}),
        "peak_difference": (check.peak_difference, {"units": "1", "long_name": "of |mean| + 3 sigma"}),
    }
    dataset = statistics.dataset
    variables = {name: ("response", values, attrs) for name, (values, attrs) in by_response.items()}
    if check.histories:
        variables |= _weighting(check, case)
        noises = case.system.noises
        dataset = dataset.assign_coords(
            noise=[n.name for n in noises],
            noise_source=("noise", [n.source for n in noises]),
            input=list(case.system.input_names),
        )
    said = {"peak_reference": check.reference, "peak_verdict": check.verdict(), "peaks_agree": int(check.agree)}
    return ResponseStatistics(dataset.assign(variables).assign_attrs(**said))


def _weighting(check: PeakCheck, case: Case) -> dict[str, tuple]:
    rows = [case.system.output_index(peak.response) for peak in check.peaks]
    own = [check.histories[peak.time] for peak in check.peaks]
    points = max(history.times.size for history in own)

    def padded(parts: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Stack (k,) or (k, columns) arrays as (responses, columns, points)."""
        found = np.full((len(parts), *parts[0].shape[1:], points), np.nan)
        for r, part in enumerate(parts):
            found[r, ..., : len(part)] = part.T
        return found

    attributes = {RULE: NOISE_RULE, "long_name": "weighting function of the response at its peak, from white noise"}
    known = input_units(case) | {"long_name": "weighting function of the response at its peak, from the input"}
    return {
        "peak_weighting_time": (
            ("response", "point"),
            padded([h.times for h in own]),
            {"units": "s", "long_name": "time of the impulse"},
        ),
        "peak_noise_weighting": (
            ("response", "noise", "point"),
            padded([h.noise[:, row] for h, row in zip(own, rows, strict=True)]),
            attributes,
        ),
        "peak_input_weighting": (
            ("response", "input", "point"),
            padded([h.inputs[:, row] for h, row in zip(own, rows, strict=True)]),
            known,
        ),
    }


def weighting_at(case: Case, check: PeakCheck | None, time: float) -> xr.Dataset:
    """Return the weighting functions at an end time, those of the check where it is a peak's."""
    history = (check.histories if check else {}).get(time) or AdjointSolver(case.with_means, Cvodes()).history(
        time, SPACING
    )
    return weighting_dataset(case, time, history)


def in_words(difference: float) -> str:
    """Return a relative difference as people say it: '2 parts in 10 million', '3.1 %', 'rounding'."""
    if not math.isfinite(difference):
        return "beyond numbers"
    if difference < ROUNDING:
        return "rounding"
    if difference >= 1e-3:
        return f"{100 * difference:.2g} %"
    power = math.floor(-math.log10(difference)) + 1
    parts = round(difference * 10.0**power)
    if parts == 10:
        parts, power = 1, power - 1
    return f"{parts} part{'' if parts == 1 else 's'} in {POWERS[power - 1]}"
