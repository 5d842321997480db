"""Derivatives of a percentile of a resultant: by those of the mean vector and the covariance of its two responses.

A percentile R of the norm of M ~ N(m, S) changes by g . dm + sum_ij G_ij dS_ij (:mod:`..statistics.norm`). In the
principal axes v_1, v_2 of G, with factors c_1, c_2,

    dR = sum_k [ c_k dVar(v_k . M) + (g . v_k) dmean(v_k . M) ]

so that two adjoint pairs, of the linear forms v_k . M, give all derivatives, covariances between the planes included.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...codegen.nodes.compiled import node_functions_of
from ...model.errors import PlanesError, TimeRangeError, UnknownNameError
from ...model.system.names import COMBINED
from ..case.provenance import provenance
from ..solvers.flight_nodes import FlightNodes
from ..solvers.stability import warn_if_unstable
from ..statistics.engines import response_statistics
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import checked_probabilities
from ..statistics.resultants import response_or_resultant, resultant_pairs
from ..statistics.sweep import Sweep
from .gradient import Gradient, gradient_of
from .knots import knot_sensitivities
from .one import parameter_sensitivities, refuse_undefined
from .pair import AdjointPair
from .peak import check_end_time, searched_times
from .request import parameter_rows
from .start import StartShare, start_share
from .tables import TotalDensity, table_sensitivities, total_density

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ..case.case import Case

ROUNDS = 6  # of finer end times about a peak, each five times as fine
ACCURATE = 1e-9  # relative tolerance of mean and covariance, whose derivatives of a percentile are taken


def percentile_sensitivity(
    case: Case,
    resultant: str,
    time: float | Literal["peak"],
    probability: float,
    parameters: Iterable[str] | None = None,
) -> xr.Dataset:
    """See :meth:`Study.percentile_sensitivity`."""
    pairs = resultant_pairs(case.system.output_names)
    if not pairs:
        raise PlanesError.of_one("a percentile of a resultant", case.system.name)
    if resultant not in pairs:
        raise UnknownNameError("resultant", resultant, pairs)
    (probability,) = checked_probabilities(probability)
    names = pairs[resultant]
    response_or_resultant(case, resultant)
    rows = parameter_rows(case, parameters)
    at_peak, at_limit = isinstance(time, str), False
    if isinstance(time, str):
        if time != "peak":
            raise TimeRangeError(f"'{time}' is not a time; give seconds or 'peak'")
        time, at_limit = _peak_time(case, names, probability)
    (time,) = case.checked_times([time])
    check_end_time(case, time)
    warn_if_unstable(case.executable, time)
    law = _law(case, names, time)
    level = float(law.percentile(probability))
    by_mean, by_covariance = law.derivatives(probability)
    flight = FlightNodes.until(case.with_means, node_functions_of(case.executable), [time], keep=True)
    parts = two_forms(case, flight, names, time, by_mean, by_covariance)
    pair, gradient = parts[0][0], _sum_of_gradients([part[1] for part in parts])
    refuse_undefined(case.system, gradient, rows)
    variables, coordinates = parameter_sensitivities(case, gradient, rows, level)
    if any(g.kind == "given" for g in case.system.tables):
        groups = case.with_means.groups
        total = _sum_of_densities([total_density(groups, p, g) for p, g, _ in parts])
        start = _sum_of_starts([start_share(case.vehicle, p, factor) for p, _, factor in parts])
        for more in (table_sensitivities, knot_sensitivities):
            found = more(case, pair, total, start, level)
            variables, coordinates = variables | found[0], coordinates | found[1]
    dataset = xr.Dataset(variables, coordinates)
    direction = law.direction(level)
    dataset.attrs = provenance(case) | {
        "response": resultant,
        "response_unit": case.system.outputs[case.system.output_index(names[0])].unit,
        "source": COMBINED,
        "quantity": f"level passed with {probability:g}",
        "t2_s": time,
        "value": level,
        "at_peak": int(at_peak),
        "peak_at_end_of_range": int(at_limit),
        "probability": probability,
        "direction_rad": float(direction.most_likely),
        "derivative_by_mean": by_mean.tolist(),
        "derivative_by_covariance": by_covariance.ravel().tolist(),
        "engine": "collocation, Gauss-Legendre of order 8",
        "steps": pair.steps,
    }
    return dataset


def two_forms(
    case: Case,
    flight: FlightNodes,
    names: Sequence[str],
    time: float,
    by_mean: NDArray[np.float64],
    by_covariance: NDArray[np.float64],
) -> list[tuple[AdjointPair, Gradient, float]]:
    """Return the two linear forms whose variances and means make g . dm + G : dS: adjoint, gradient, factor c.

    Parameters
    ----------
    case : Case
    flight : FlightNodes
        To ``time`` at least.
    names : sequence of str
        Both responses.
    time : float
        s.
    by_mean : (2,) array
        g.
    by_covariance : (2, 2) array
        G, symmetric.
    """
    factors, axes = np.linalg.eigh(by_covariance)
    forms = np.zeros((2, len(case.system.outputs)))
    forms[:, [case.system.output_index(name) for name in names]] = axes.T
    parts: list[tuple[AdjointPair, Gradient, float]] = []
    for form, factor, along in zip(forms, factors.tolist(), (axes.T @ by_mean).tolist(), strict=True):
        pair = AdjointPair(flight, form, time, case.system.sources)
        parts.append((pair, gradient_of(pair, factor, along), factor))
    return parts


def _law(case: Case, names: tuple[str, str], time: float) -> NormOfNormal:
    law = _laws(case, names, [time])
    return NormOfNormal(law.mean[0], law.covariance[0])


def _laws(case: Case, names: tuple[str, str], times: list[float]) -> NormOfNormal:
    compiled = case.executable.shared_library is not None
    engine = Sweep(relative_tolerance=ACCURATE) if compiled else "covariance"
    return response_statistics(case, times, responses=names, engine=engine).norm(*names)


def _peak_time(case: Case, names: tuple[str, str], probability: float) -> tuple[float, bool]:
    """Return the time of the largest level between output times, and whether it is an end of the range searched.

    The neighbourhood of the largest is cut finer and finer: to 1e-4 of the time between two output times.
    """
    times = searched_times(case)
    first, last = times[0], times[-1]
    best = times[int(np.argmax(_laws(case, names, times).percentile(probability)))]
    if best in (first, last):
        return best, True
    for _ in range(ROUNDS):
        k = times.index(best)
        low, high = times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)]
        times = sorted({*np.linspace(low, high, 11).tolist(), best})
        best = times[int(np.argmax(_laws(case, names, times).percentile(probability)))]
    return best, False


def _sum_of_gradients(parts: list[Gradient]) -> Gradient:
    """Return the sum; a parameter without a derivative in one part has none."""
    first, second = parts
    reach = {i: min(part.reach.get(i, np.inf) for part in parts) for i in {*first.reach, *second.reach}}
    return replace(
        first,
        value=first.value + second.value,
        parameters=first.parameters + second.parameters,
        tables=first.tables + second.tables,
        tables_at_end=first.tables_at_end + second.tables_at_end,
        undefined={**first.undefined, **second.undefined},
        reach=reach,
    )


def _sum_of_densities(parts: list[TotalDensity]) -> TotalDensity:
    along, at_end = (sum((getattr(p, n) for p in parts), np.zeros(1)) for n in ("along", "at_end"))
    return TotalDensity(along, at_end)


def _sum_of_starts(parts: list[StartShare | None]) -> StartShare | None:
    """Return the sum, over the nodes that both have."""
    given = [part for part in parts if part is not None]
    if not given:
        return None
    by_table: dict[str, NDArray[np.float64]] = {}
    for part in given:
        for name, values in part.by_table.items():
            by_table[name] = by_table[name] + values if name in by_table else values
    return replace(given[0], by_table=by_table, by_altitude=sum(part.by_altitude for part in given))
