"""How often a month lets a vehicle fly: the chance that a flight passes its limits, by month and launch azimuth.

The wind across the flight path towards azimuth Az is u cos Az - v sin Az in the yaw plane, positive to the right, and
along the heading, u sin Az + v cos Az, in the pitch plane, which takes its own part of it. In both planes a flight that
is turned by d meets the wind (u cos d - v sin d, u sin d + v cos d) as it would u and v. What u and v do at each level
follows from what the winds that are met do, and their joint covariance of the month makes the responses' own. What
deviations of the vehicle do goes with its mean response, so that every month and azimuth has its own mean. A check on
the day of launch is simulated: of days drawn from the season some are stopped, those whose chance of passing given a
sounding lies above the threshold.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import gammaincinv, ndtri

from ...codegen.system.evaluation import MatrixEvaluator
from ...model.errors import ParameterValueError
from ...model.system.names import WIND
from ...model.wind.month_winds import MonthWind, read_months
from ...model.wind.record import COMPONENTS
from ...model.wind.two_components import TwoComponentWind, plane_weights
from ..case.case import Case
from ..case.climb import Climb
from ..case.provenance import provenance
from ..flight_load.limit_table import Limits
from ..flight_load.passage import Passage
from ..flight_load.process import joint_covariance
from ..flight_load.request import DESIGN, checked_draws
from ..flight_load.window import checked_window, window_chain
from ..present.progress import each
from ..solvers.markov_chain import MarkovChain
from ..solvers.time_nodes import interval_before
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import Sides, checked_sides, instant_level
from .conditioning import Measured
from .day_of_launch import matter, worth_while
from .defaults import ERROR
from .level_weights import WINDS
from .limited_loads import LimitedLoads, limited_loads, row_weights, symmetric
from .other_winds import in_mean_winds
from .random_wind import RandomWind, filter_wind, rows_of_components
from .wind_field import WindField, default_persistence

STEPS = 1200  # of the window, at most
MOST_WEIGHTS = 1200  # loads times coarse steps
COARSE = 8  # every so many are looked at, to see where passing is worth while
MOST_VALUES = 3000  # loads and times whose joint covariance is made
MOST = 600  # points of time at which passing is computed
SPACING = 25.0  # m, of the levels
CONFIDENCE = 0.9  # of intervals by the statistics' own sampling
BALLOON = 200.0  # m between levels of the sounding of a check
DAYS, PATHS = 400, 1500  # drawn for a check
CHECK_VALUES = 150  # times and loads, of a check


def availability(
    case: Case,
    limits: str | Path | Limits,
    months: Sequence[str] | None,
    azimuths: Iterable[float] | None,
    winds: str | Path | None,
    window: tuple[float, float] | None,
    check_hours: float | None,
    threshold: float,
    sides: Sides,
    draws: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """See :meth:`Study.availability`."""
    checked_draws(draws, seed)
    chosen, flown = checked_sides(sides), checked_window(case, window)
    if not 0 < threshold < 1:
        raise ParameterValueError(f"threshold = {threshold!r} is no probability; give one between 0 and 1")
    if check_hours is not None and not 0 <= check_hours < np.inf:
        raise ParameterValueError(f"a check {check_hours!r} h before launch; give hours of 0 or more")
    loads = limited_loads(case, limits, None, flown, chosen)
    vehicle = case.vehicle_for("the availability of months")
    angles, turns = _turns(case, azimuths)
    seasons = read_months(None if winds is None else Path(winds), None if months is None else list(months))

    levels = _levels(case, flown, seasons)
    steps = COARSE * int(np.clip(MOST_WEIGHTS // len(loads.rows), 30, STEPS // COARSE))
    season_chain = window_chain(case, flown, steps)
    times, limit = season_chain.times, loads.values(season_chain.times)
    by_level = case.kept(
        ("availability", flown, loads.rows, tuple(levels.tolist())),
        lambda: row_weights(case, loads, season_chain, levels),
    )
    others = [k for k, source in enumerate(case.system.sources) if source != WIND]
    shape = (len(seasons), angles.size)
    found = {
        key: np.full(shape, np.nan) for key in ("probability", "lower", "upper", "standard_error", "spacing_error")
    }
    found |= {key: np.full(shape, np.nan) for key in ("stopped", "remaining_risk")}
    levels_shown = [limit.load for limit in loads.limits]
    count = len(seasons) * len(turns)
    level = np.full((*shape, len(levels_shown)), np.nan)
    for i, month in each(list(enumerate(seasons)), "months"):
        field = WindField(_wind(month, levels))
        for j, turn in each(list(enumerate(turns)), f"azimuths of {month.period}"):
            if progress:
                progress(i * len(turns) + j, count)
            about = _in_mean(case, month, turn)
            chain = window_chain(about, flown, steps)
            row, direct, mean = loads.over(chain, about)
            R = row.shape[1]
            weight = np.einsum("mrck,cd->mrdk", by_level.weight.reshape(times.size, R, len(turn), -1), turn)
            weight, coarse = weight.reshape(times.size, R, -1), slice(None, None, COARSE)
            own_covariance = row[coarse] @ chain.covariance(others)[coarse] @ row[coarse].swapaxes(1, 2)
            seen = weight[coarse]  # one product of matrices, not one a time: the covariance is read once
            by_wind = (seen.reshape(-1, seen.shape[2]) @ field.wind.covariance).reshape(seen.shape) @ seen.swapaxes(
                1, 2
            )
            parts = mean[coarse], symmetric(by_wind), symmetric(own_covariance)
            chance = loads.chances(mean[coarse], parts[1] + parts[2], limit[coarse], chosen)
            first, last = (COARSE * k for k in worth_while(chance))
            some, rows = loads.only(matter(chance))
            most = max(8, min(MOST, MOST_VALUES // len(rows)))
            fine = np.arange(first, last + 1, max(1, -(-(last - first) // most)))
            within = chain.part(slice(first, last + 1))
            own = joint_covariance(within, row[first : last + 1][:, rows], others)[fine - first][:, :, fine - first]
            F = weight[fine][:, rows].reshape(fine.size * len(rows), -1)
            met = np.flatnonzero(F.any(axis=0))  # levels that are reached by then: half of them at greatest q
            F = F[:, met]
            covariance = (F @ field.wind.covariance[np.ix_(met, met)] @ F.T).reshape(own.shape) + own
            through = _direct(case, some, times[fine]) if direct is None else direct[fine][:, rows]
            noise = _noise(case, month, turn, chain, fine, row[fine][:, rows], through, others)
            process = some.process(times[fine], mean[fine][:, rows], covariance, noise)
            shown = [limit.load for limit in some.limits]
            p = Passage(
                case, shown, process, some.values(times[fine]), chosen, DESIGN, draws, seed
            ).probability.extrapolated
            found["probability"][i, j], found["standard_error"][i, j] = p.value, p.standard_error
            found["spacing_error"][i, j] = p.spacing_error
            low, high = _interval(loads, parts, limit[coarse], chosen, month.independent_samples)
            found["lower"][i, j], found["upper"][i, j] = min(1.0, p.value * low), min(1.0, p.value * high)
            for k, limited in enumerate(loads.limits):
                two = list(limited.rows)
                whole = (parts[1] + parts[2])[:, two][:, :, two]
                if len(two) == 2:
                    level[i, j, k] = NormOfNormal(mean[coarse][:, two], whole).percentile(DESIGN).max()
                else:
                    std = np.sqrt(np.maximum(whole[:, 0], 0.0))
                    level[i, j, k] = instant_level(mean[coarse][:, two], std, DESIGN, chosen).max()
            if check_hours is not None:
                which = np.arange(0, fine.size, max(1, fine.size * len(rows) // CHECK_VALUES))
                at = fine[which]
                found["stopped"][i, j], found["remaining_risk"][i, j] = _checked(
                    field, some, weight[at][:, rows], mean[at][:, rows], covariance[which][:, :, which],
                    some.values(times[at]), chosen, check_hours, threshold, seed,
                )  # fmt: skip
    if progress:
        progress(count, count)
    meanings = {
        "probability": "of passing any limit in a flight",
        "lower": "lower end of its 90 % interval, by the statistics' own sampling",
        "upper": "upper end of it",
        "standard_error": "of the importance sampling",
        "spacing_error": "relative: what the grid of times leaves open, estimated from half as many points",
        "stopped": "share of days that a check on the day of launch stops",
        "remaining_risk": "of passing any limit on the days that it lets go",
    }
    dims = ("month", "azimuth")
    kept = [key for key in meanings if check_hours is not None or key not in ("stopped", "remaining_risk")]
    return xr.Dataset(
        {key: (dims, found[key], {"units": "1", "long_name": meanings[key]}) for key in kept}
        | {
            "level": (
                (*dims, "response"),
                level,
                {"long_name": "largest of the flight's instants, passed with 0.00135"},
            )
        },
        {
            "month": [season.period for season in seasons],
            "azimuth": ("azimuth", angles, {"units": "rad", "long_name": "of the launch, from north towards east"}),
            "response": [load.label for load in levels_shown],
            "unit": ("response", [load.unit for load in levels_shown]),
        },
        provenance(case)
        | {
            "plane": vehicle.file.planes,
            "site": seasons[0].site,
            "edition": seasons[0].edition,
            "sides": chosen,
            "draws": draws,
            "seed": seed,
        }
        | ({} if check_hours is None else {"check_hours": check_hours, "threshold": threshold}),
    )


def _levels(case: Case, window: tuple[float, float], seasons: Sequence[MonthWind]) -> NDArray[np.float64]:
    climb = Climb.of(case)
    first, last = float(climb.altitudes[0]), float(climb.altitude(window[1]))
    top = min(last, max(float(month.zonal.altitude[-1]) for month in seasons))
    return np.linspace(first, max(top, first + 10 * SPACING), max(11, int(np.ceil((top - first) / SPACING)) + 1))


def _turns(case: Case, azimuths: Iterable[float] | None) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Return launch azimuths (rad), and for each what the winds that are met are of u and v, (c, 2)."""
    vehicle = case.vehicle_for("the availability of months")
    both = isinstance(vehicle.wind, TwoComponentWind)
    record = vehicle.wind.record
    if both:
        own = case.parameters["wind.azimuth"].value
    elif record is not None:
        own = record.azimuth
    elif azimuths is None:
        raise ParameterValueError("the vehicle does not state its azimuth; give azimuths")
    else:
        own = 0.0
    angles = np.array([own] if azimuths is None else [float(a) for a in azimuths])
    if not angles.size or not np.isfinite(angles).all():
        raise ParameterValueError("azimuths are finite numbers, rad from north towards east")
    if not both:
        return angles, [np.array([plane_weights(float(a), vehicle.file.planes)]) for a in angles]
    for a in angles:
        plane_weights(float(a), "yaw")
    turned = [(np.cos(a - own), np.sin(a - own)) for a in angles]
    return angles, [np.array([[c, -s], [s, c]]) for c, s in turned]


def _wind(month: MonthWind, levels: NDArray[np.float64]) -> RandomWind:
    """Return u and v of a month at levels (m)."""
    mean = np.concatenate([month.mean_along(weights, levels) for weights in ((1.0, 0.0), (0.0, 1.0))])
    return filter_wind(month.joint, levels, mean, rows_of_components(month.joint.order, month.zonal.order))


def _in_mean(case: Case, month: MonthWind, turn: NDArray[np.float64]) -> Case:
    """Return a case whose mean winds are a month's, turned."""
    return in_mean_winds(case, lambda number, levels: month.mean_along(tuple(turn[number]), levels))


def _noise(
    case: Case,
    month: MonthWind,
    turn: NDArray[np.float64],
    chain: MarkovChain,
    fine: NDArray[np.intp],
    row: NDArray[np.float64],
    direct: NDArray[np.float64],
    others: list[int],
) -> NDArray[np.float64]:
    """Return what white noise does to loads directly, that of the month's wind and of the vehicle, (m, r, noises)."""
    climb, times, joint = Climb.of(case), chain.times[fine], month.joint
    held = np.clip(climb.altitude(times), joint.altitude[0], joint.altitude[-1])
    _, G, H = joint.at(held)
    first = month.zonal.order
    by_noise = np.stack([H[:, None, :first] @ G[:, :first], H[:, None, first:] @ G[:, first:]], axis=1)[:, :, 0]
    by_noise *= np.sqrt(np.maximum(climb.polynomial(times, 1), 0.0))[:, None, None]  # of u and v, (m, 2, noises)
    winds = [i for i, name in enumerate(case.system.input_names) if name in WINDS]
    own = row @ chain.acting_noise_matrix(others)[fine]
    return np.concatenate([direct[:, :, winds] @ turn @ by_noise, own], axis=2)


def _direct(case: Case, loads: LimitedLoads, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what known inputs do to responses directly at times (s), (m, r, n_u)."""
    outputs = [row.output for row in loads.rows if row.output is not None]  # all are responses here
    evaluate, found = MatrixEvaluator(case.with_means, ("G",)), []
    for time in times.tolist():
        here = interval_before(case.with_means, time) if time > case.system.start else None
        low, high = (time, time) if here is None else (here.low, here.high)
        found.append(evaluate(time, low, high)[0][outputs])
    return np.array(found)


def _interval(
    loads: LimitedLoads,
    parts: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    limit: NDArray[np.float64],
    sides: Sides,
    samples: float,
) -> tuple[float, float]:
    """Return the factors on a probability that the sampling of the wind's statistics leaves open.

    By the change of the sum of all instants' chances: the wind's variance is chi-square with samples - 1 degrees of
    freedom, its mean load normal with variance wind / samples; both are independent and taken together by the root sum
    square of the logarithms. ``parts`` are the mean and the covariances by wind and by the vehicle.
    """
    mean, wind, vehicle = parts
    error = np.sign(mean) * np.sqrt(np.maximum(np.einsum("mrr->mr", wind), 0.0) / samples)

    def chance(scale: float, shift: float) -> float:
        total = loads.chances(mean + shift * error, scale * wind + vehicle, limit, sides).sum()
        return float(np.log(max(total, np.finfo(float).tiny)))

    nu, tail, here = samples - 1, 0.5 * (1 - CONFIDENCE), chance(1.0, 0.0)
    z = float(ndtri(1 - tail))
    ends = []
    for sign, quantile in ((-1, 1 - tail), (1, tail)):
        by_variance = chance(nu / float(2 * gammaincinv(0.5 * nu, quantile)), 0.0) - here
        by_mean = chance(1.0, sign * z) - here
        ends.append(float(np.exp(sign * np.hypot(by_variance, by_mean))))
    return ends[0], ends[1]


def _checked(
    field: WindField,
    loads: LimitedLoads,
    weight: NDArray[np.float64],
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    limit: NDArray[np.float64],
    sides: Sides,
    hours: float,
    threshold: float,
    seed: int,
) -> tuple[float, float]:
    """Return the share of days that a check stops, and the chance of passing on the others, by drawn days."""
    random, (m, r, _) = np.random.default_rng([seed, 12]), weight.shape
    altitude = np.arange(field.levels[0] + BALLOON, field.levels[-1], BALLOON)
    rows = np.concatenate([field.rows(altitude, component) for component in range(2)])
    now = rows * field.kept(default_persistence(field, COMPONENTS), hours)
    K = Measured(rows @ rows.T + ERROR**2 * np.eye(len(rows)))
    gain = K.whitened((field.waves @ now.T).T @ weight.reshape(m * r, -1).T)
    left = covariance.reshape(m * r, m * r) - gain.T @ gain
    size = np.sqrt(np.maximum(np.diagonal(left), 0.0))
    unit = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(left / np.outer(unit, unit))
    root = size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    flights = random.standard_normal((PATHS, m * r)) @ root.T
    days = mean.ravel() + random.standard_normal((DAYS, len(rows))) @ gain
    chance = np.empty(DAYS)
    for k, day in enumerate(days):
        chance[k] = loads.beyond(limit, (flights + day).reshape(PATHS, m, r), sides).mean()
    go = chance <= threshold
    return float(1 - go.mean()), float(chance[go].mean()) if go.any() else float("nan")
