"""|mean| + 3 sigma over the end times for trial values of the parameters, by the sweep, and its exact derivatives.

Trials of a search share the steps of one grid (runners/solvers/fixed_grid.py), which cost a tenth of controlled steps
at the tolerance of a line search and make no noise in it; what they are off is taken from controlled steps at some of
them.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...codegen.nodes.compiled import node_functions_of
from ...codegen.sweep.integrator import CompiledSweep
from ...model.errors import IntegrationError, UnstableSystemWarning
from ...model.system.names import COMBINED
from ..case.shared_grid import shared_rule
from ..sensitivity.gradient import gradient_of
from ..sensitivity.pair import AdjointPair
from ..sensitivity.percentile import two_forms
from ..solvers.fixed_grid import LEAST_TOLERANCE as GRID_TOLERANCE
from ..solvers.fixed_grid import StepRule
from ..solvers.flight_nodes import FlightNodes
from ..solvers.sweep import available_sweep, sweep_member
from ..statistics.larger_side import SIGMAS
from ..statistics.norm import LIKE_3_SIGMA, NormOfNormal
from ..statistics.resultants import outputs_of
from ..statistics.sweep import Sweep

if TYPE_CHECKING:
    from ..study import Study

TOLERANCE = 1e-10  # of the sweep: noise in a line search is then below what ends it
SIGNS = (1.0, -1.0)

Row = tuple[str, float, float]  # response, sign of the mean, end time


def three_sigma(study: Study, responses: list[str], times: tuple[float, ...]) -> NDArray[np.float64] | None:
    """Return 3 sigma + mean and 3 sigma - mean, (responses, 2, times); None where they are beyond numbers.

    The largest over both signs and all times is the peak of |mean| + 3 sigma. Of a resultant it is the level that it
    passes with 1 - Phi(3) at an instant, and the same with the other sign, so that it counts once.
    """
    outputs = list(dict.fromkeys(output for name in responses for output in outputs_of(study, name)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnstableSystemWarning)
        try:
            found = study.response_statistics(times, responses=outputs, engine=_engine(study, responses))
        except IntegrationError:
            return None
    combined, rows = found.dataset.sel(source=COMBINED), []
    for name in responses:
        of = outputs_of(study, name)
        if len(of) == 2:
            level = found.norm(*of).percentile(LIKE_3_SIGMA)
            rows.append([level, -level])
        else:
            mean, std = (combined[quantity].sel(response=name).values for quantity in ("mean", "std"))
            rows.append([SIGMAS * std + sign * mean for sign in SIGNS])
    values = np.array(rows)
    return values if np.isfinite(values).all() else None


class TrialPeaks:
    """The same for trial values of a search, on one grid where that pays.

    Parameters
    ----------
    study : Study
        The numbers that the grid is chosen on.
    responses : list of str
    times : tuple of float
        s.
    """

    def __init__(self, study: Study, responses: list[str], times: tuple[float, ...]):
        self._responses, self._times = responses, times
        self._missing: NDArray[np.float64] | float = 0.0
        self._grid: tuple[CompiledSweep, StepRule] | None = None
        compiled = available_sweep(study.executable)
        if compiled is not None:
            rule = shared_rule(study, times, GRID_TOLERANCE)
            self._grid = None if rule is None else (compiled, rule)

    def __call__(self, study: Study) -> NDArray[np.float64] | None:
        """Return what :func:`three_sigma` does, but for what the grid misses elsewhere than where it was settled."""
        found = self._on_grid(study)
        return self.exact(study) if found is None else found + self._missing

    def exact(self, study: Study) -> NDArray[np.float64] | None:
        """Return it by controlled steps."""
        return three_sigma(study, self._responses, self._times)

    def settle(self, study: Study) -> tuple[NDArray[np.float64] | None, float]:
        """Return it by controlled steps, and take from them what the grid misses from now on.

        Returns
        -------
        values : (responses, 2, times) array or None
        moved : float
            What the grid misses now other than before, relative to the peak of each response.
        """
        exact, on_grid = self.exact(study), self._on_grid(study)
        if exact is None or on_grid is None:
            return exact, 0.0
        before, self._missing = self._missing, exact - on_grid
        largest = np.abs(exact).max(axis=(1, 2), keepdims=True)
        moved = np.abs(self._missing - before) / np.where(largest > 0, largest, 1.0)
        return exact, float(moved.max())

    def leave_grid(self) -> None:
        """Take controlled steps for all trials from now on."""
        self._grid = None

    def _on_grid(self, study: Study) -> NDArray[np.float64] | None:
        if self._grid is None:
            return None
        (compiled, rule), rows = self._grid, [outputs_of(study, name) for name in self._responses]
        try:
            found = sweep_member(
                compiled,
                study.executable,
                self._times,
                relative_tolerance=TOLERANCE,
                responses=[output for of in rows for output in of],
                fill=study.mean.fill,
                rule=rule,
            )
        except IntegrationError:
            return None
        covariance, values = found.covariance.sum(axis=1), []
        for of in rows:
            at = [study.system.output_index(output) for output in of]
            mean, between = found.mean[:, at], covariance[:, at][..., at]
            if len(of) == 2:
                level = NormOfNormal(mean, between).percentile(LIKE_3_SIGMA)
                values.append([level, -level])
            else:
                std = np.sqrt(between[:, 0, 0])
                values.append([SIGMAS * std + sign * mean[:, 0] for sign in SIGNS])
        return np.array(values) if np.isfinite(values).all() else None


def _engine(study: Study, responses: Iterable[str]) -> Sweep | str | None:
    """Return the engine of peaks: of resultants one that gives covariances between responses."""
    if study.executable.shared_library is not None:
        return Sweep(TOLERANCE)
    return "covariance" if any(len(outputs_of(study, name)) == 2 for name in responses) else None


def gradients(study: Study, rows: Iterable[Row], parameters: tuple[str, ...]) -> dict[Row, NDArray[np.float64]]:
    """Return the derivatives of 3 sigma + sign * mean, or of a resultant's level, by adjoint pairs, (n,) each."""
    rows, system = list(rows), study.system
    columns = [system.parameter_names.index(name) for name in parameters]
    functions = node_functions_of(study.executable)
    flight = FlightNodes.until(study.with_means, functions, sorted({time for _, _, time in rows}), keep=len(rows) > 1)
    pairs = {
        (response, time): AdjointPair(flight, system.output_index(response), time, system.sources)
        for response, _, time in rows
        if len(outputs_of(study, response)) == 1
    }
    of_two: dict[tuple[str, float], NDArray[np.float64]] = {}
    for response, time in dict.fromkeys((response, time) for response, _, time in rows):
        if (response, time) in pairs:
            continue
        of = outputs_of(study, response)
        statistics = study.response_statistics([time], responses=of, engine=_engine(study, [response]))
        by_mean, by_covariance = (part[0] for part in statistics.norm(*of).derivatives(LIKE_3_SIGMA))
        forms = two_forms(study, flight, of, time, by_mean, by_covariance)
        of_two[response, time] = np.sum([gradient.parameters[columns] for _, gradient, _ in forms], axis=0)
    found = {}
    for response, sign, time in rows:
        if (response, time) in of_two:
            found[response, sign, time] = sign * of_two[response, time]
            continue
        pair = pairs[response, time]
        found[response, sign, time] = gradient_of(pair, 0.5 * SIGMAS / np.sqrt(pair.variance), sign).parameters[columns]
    return found
