"""The most likely wind behind a load: E[w(h) | y(t2) = L], and what else makes that load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtr

from ...codegen.system.evaluation import MatrixEvaluator
from ...model.equations.noise import DEVIATION
from ...model.errors import DataError, ParameterValueError, TimeRangeError
from ...model.system.names import COMBINED, TURBULENCE, WIND
from ...model.vehicle.planes import flown_planes
from ...model.wind.record import COMPONENTS
from ...model.wind.turbulence import INTENSITY
from ..case.case import Case
from ..case.chain import chain_at
from ..case.climb import Climb
from ..case.provenance import provenance
from ..case.times import seconds
from ..flight_load.load import FlightLoad
from ..flight_load.request import NoVarianceError
from ..gusts.weights import WindWeights, weights_of_rows
from ..present.notebook import html_of
from ..present.progress import steps
from ..solvers.time_nodes import interval_before, time_nodes
from ..statistics.engines import engine_with_covariances, response_statistics
from ..statistics.norm import NormOfNormal
from ..statistics.resultants import outputs_of, response_or_resultant
from .files import write_wind
from .profile import WindAtPoints, chosen_levels, wind_at_points

MISSED = 1e-4  # of the load, by straight lines between the levels, before what they miss is added in sigmas
STEP = 0.05  # s, between times of the vehicle's deviations
TOGETHER = 1000  # winds drawn at once
BAND = 1.96  # conditional sigmas to either side, which hold 95 %


@dataclass(frozen=True, eq=False, repr=False)
class DesignWind:
    """The most likely wind that makes a load.

    Attributes
    ----------
    case : Case
    response, unit : str
        In both planes a resultant too, of which :attr:`row` is taken.
    time : float
        t2, s.
    sigmas : float
        k; negative for a load on the other side of the mean. Of a resultant those of its part in ``direction``.
    combined : bool
        Whether the load is mean + k sigma of all sources, of which the wind makes its part, or of the wind alone.
    mean_response : float
        Of the response in the mean wind.
    other_variance : float
        Of the response, by all sources but the wind's filter.
    points : WindAtPoints
    weights : WindWeights
    row : tuple of (str, float)
        Outputs and their factors, whose sum is the response.
    direction : float or None
        Of a resultant at its level, where it most likely points, rad from pitch towards yaw: the response is its part
        there, and all of it in this wind.
    """

    case: Case
    response: str
    unit: str
    time: float
    sigmas: float
    combined: bool
    mean_response: float
    other_variance: float
    points: WindAtPoints
    weights: WindWeights
    row: tuple[tuple[str, float], ...]
    direction: float | None = None

    @property
    def std(self) -> float:
        """Standard deviation of the response: by the wind alone, or by all sources."""
        return math.sqrt(self.points.variance + (self.other_variance if self.combined else 0.0))

    @property
    def load(self) -> float:
        """L = mean + k sigma."""
        return self.mean_response + self.sigmas * self.std

    @property
    def load_by_wind(self) -> float:
        """What the profile alone makes of it: all of it for the wind alone, mean + k sigma_wind^2 / sigma combined."""
        return self.mean_response + self.sigmas * self.points.variance / self.std

    @property
    def norm(self) -> float:
        """Size of the least white noise that makes the load in the wind alone, in sigmas: k, by another integral."""
        return abs(self.sigmas) * math.sqrt(self.points.variance_in_white_noise / self.points.variance)

    @property
    def altitude_at_time(self) -> float:
        """h(t2), m, where the profile has a corner."""
        return float(Climb.of(self.case).altitude(self.time))

    @cached_property
    def mean_wind(self) -> NDArray[np.float64]:
        """Mean wind at all points, or both its components, (m, winds), m/s."""
        return mean_winds(self.case, self.points.altitude)

    def _lines(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return straight lines between the levels' values (levels, winds), at all points."""
        h = self.points.altitude
        return np.stack([np.interp(h, h[self._levels], column) for column in values.T], axis=1)

    @cached_property
    def _deviation(self) -> NDArray[np.float64]:
        return self.points.wind_covariance * (self.sigmas / self.std)

    @cached_property
    def _levels(self) -> NDArray[np.intp]:
        wind, missed = self.mean_wind + self._deviation, MISSED * max(abs(self.load_by_wind), self.std)
        return chosen_levels(self.points, wind, self.altitude_at_time, missed)

    @cached_property
    def added_sigmas(self) -> float:
        """What the deviation at the levels has more, in sigmas, so that straight lines between them make the load."""
        at, points = self._levels, self.points
        of_lines = points.response_to(self._lines(points.wind_covariance[at] / self.std))
        exact = points.response_to(self.mean_wind + self._deviation)
        mean = points.response_to(self._lines(self.mean_wind[at]))
        return (exact - mean) / of_lines - self.sigmas

    @cached_property
    def profile(self) -> xr.Dataset:
        """The wind over (altitude): linear between levels it makes the load, and there is a level at h(t2).

        ``wind``, ``mean``, ``deviation`` and its size in ``local_sigmas`` of the wind there; ``conditional_std`` of
        the winds that make this load, ``band`` (altitude, bound) that holds 95 % of them. In both planes each is over
        (altitude, component), towards the east and towards the north.
        """
        at = self._levels
        deviation = self.points.wind_covariance[at] * ((self.sigmas + self.added_sigmas) / self.std)
        wind, std = self.mean_wind[at] + deviation, self.points.std[at]
        share = np.divide(self.points.wind_covariance[at], std * self.std, out=np.zeros_like(std), where=std > 0)
        conditional = std * np.sqrt(np.maximum(1 - share**2, 0.0))
        local = np.divide(deviation, std, out=np.zeros_like(std), where=std > 0)
        speed = {"units": "m/s"}
        components = COMPONENTS if std.shape[1] > 1 else None
        over = "altitude" if components is None else ("altitude", "component")
        band = wind[..., None] + BAND * conditional[..., None] * np.array([-1.0, 1.0])
        if components is None:
            wind, std, conditional, local, deviation, band = (
                x[:, 0] for x in (wind, std, conditional, local, deviation, band)
            )
        mean = self.mean_wind[at] if components else self.mean_wind[at, 0]
        return xr.Dataset(
            {
                "wind": (over, wind, speed | {"long_name": "most likely wind behind the load"}),
                "mean": (over, mean, speed | {"long_name": "mean wind"}),
                "deviation": (over, deviation, speed | {"long_name": "wind less its mean"}),
                "local_sigmas": (
                    over,
                    local,
                    {"units": "1", "long_name": "deviation in sigmas of the wind there"},
                ),
                "conditional_std": (over, conditional, speed | {"long_name": "std of winds that make the load"}),
                "band": (
                    (*(("altitude",) if components is None else over), "bound"),
                    band,
                    speed | {"long_name": "holds 95 % of the winds that make the load"},
                ),
            },
            {
                "altitude": ("altitude", self.points.altitude[at], {"units": "m", "long_name": "altitude"}),
                "bound": ["lower", "upper"],
                **({} if components is None else {"component": list(components)}),
            },
            provenance(self.case)
            | {"response": self.response, "unit": self.unit, "t2_s": self.time, "sigmas": self.sigmas}
            | {"combined": str(self.combined).lower(), "load": self.load, "load_by_wind": self.load_by_wind}
            | {"altitude_at_t2_m": self.altitude_at_time, "side": self.side}
            | {"added_sigmas": self.added_sigmas}
            | ({} if self.direction is None else {"direction_rad": self.direction}),
        )

    @property
    def side(self) -> str:
        """On which side of the mean the load lies, in words."""
        if not self.sigmas:
            return "the mean itself: the mean wind"
        return "above the mean" if self.sigmas > 0 else "below the mean"

    def draws(self, count: int, seed: int = 0) -> xr.DataArray:
        """Return random winds, each of which makes the load with the vehicle's part of it.

        Parameters
        ----------
        count : int
        seed : int
            The same seed gives the same winds.

        Returns
        -------
        xarray.DataArray
            Over (draw, altitude), in both planes (draw, altitude, component), m/s, at the levels of the profile.

        Raises
        ------
        ParameterValueError
        """
        for name, value, least in (("count", count, 1), ("seed", seed, 0)):
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise ParameterValueError(f"{name} = {value!r} cannot be used; give a whole number of {least} or more")
        random, at, parts = np.random.default_rng(seed), self._levels, []
        gain, load = self.points.wind_covariance[at] / self.std**2, self.sigmas * self.std
        for first in range(0, count, TOGETHER):
            wind = self.points.drawn(random, min(TOGETHER, count - first))
            made = np.einsum("kc,kcd->d", self.points.weight, wind)
            if self.combined:
                made += math.sqrt(self.other_variance) * random.standard_normal(made.size)
            parts.append(self.mean_wind[at, :, None] + wind[at] + gain[..., None] * (load - made))
        found = np.moveaxis(np.concatenate(parts, axis=2), 2, 0)
        profile = self.profile
        what = {"units": "m/s", "long_name": "wind given the load"}
        if "component" not in profile.dims:
            return xr.DataArray(found[..., 0], {"altitude": profile["altitude"]}, ("draw", "altitude"), attrs=what)
        over = {name: profile[name] for name in ("altitude", "component")}
        return xr.DataArray(found, over, ("draw", "altitude", "component"), attrs=what)

    def write(self, path: str | Path) -> Path:
        """Write the profile as CSV: altitude [m], u [m/s] towards the east, v [m/s] towards the north.

        Parameters
        ----------
        path : path

        Returns
        -------
        Path

        Raises
        ------
        DataError
            The vehicle has no record of which component of the wind its own is.
        OutputFolderError
        """
        profile = self.profile
        return write_wind(self.case, profile["altitude"].values, profile["wind"].values, Path(path))

    @cached_property
    def deviations(self) -> xr.Dataset | None:
        """E[deviation | load] of the vehicle's sources over (source, t), to t2; None for the load of the wind alone.

        In the unit of each source's standard deviation; a white source has that of white noise. That of a wind bias is
        a factor on the mean wind, which the profile leaves out; turbulence is a wind in m/s. What each of both planes
        has for itself stands under the source's name and the plane's.
        """
        if not self.combined:
            return None
        system, case = self.case.system, self.case
        node = float(time_nodes(case.with_means, [self.time])[0])
        times = np.linspace(system.start, node, max(2, int(np.ceil((node - system.start) / STEP)) + 1))
        grid = np.unique(time_nodes(case.with_means, times))
        chain = chain_at(case, grid)
        adjoint = [sum(x * chain.output[-1][system.output_index(name)] for name, x in self.row)]
        for Phi in chain.transition[::-1]:
            adjoint.append(adjoint[-1] @ Phi)
        back = np.array(adjoint[::-1])
        flown = [plane.name for plane in flown_planes(case.vehicle_for("deviations"))]
        found: dict[str, NDArray[np.float64]] = {}
        for name in (s for s in system.sources if s != WIND):
            each = {"": name} if len(flown) == 1 else {"": name} | {f"_{plane}": name for plane in flown}
            states = [
                (f"{name}{end}", k)
                for end in each
                for k, s in enumerate(system.states)
                if s.name == f"{DEVIATION}_{name}{end}"
            ]
            if name == TURBULENCE:
                P = chain.covariance([system.sources.index(name)])[:, system.block(name)]
                parts = np.array_split(P, len(flown), axis=1)  # each plane has its own
                for plane, part in zip(flown, parts, strict=True):
                    under = name if len(flown) == 1 else f"{name}_{plane}"
                    found[under] = np.einsum("ki,kin,kn->k", self._turbulence(grid), part, back)
            elif states:
                (sigma,) = (p.value for n, p in case.parameters.items() if n in _sigmas(name))
                P = chain.covariance([system.sources.index(name)])
                found |= {under: sigma * np.einsum("kn,kn->k", P[:, state], back) for under, state in states}
            else:
                for column in system.noise_columns(name):
                    under = system.noise_names[column]
                    found[under] = np.einsum("kn,kn->k", chain.noise_matrix[:, :, column], back)
        values = np.array(list(found.values())).reshape(len(found), grid.size) * (self.sigmas / self.std)
        return xr.Dataset(
            {"deviation": (("source", "t"), values, {"long_name": "most likely deviation behind the load"})},
            {"source": list(found), "t": ("t", grid, {"units": "s", "long_name": "flight time"})},
            provenance(case),
        )

    def _turbulence(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return turbulence (m/s) in terms of its states at times (k,), (k, order)."""
        vehicle = self.case.vehicle_for("turbulence")
        assert vehicle.turbulence is not None  # it is a source
        sigma = np.array([self.case.tables(float(t))[INTENSITY] for t in times])
        scale = self.case.parameters["turbulence.sigma_scale"].value
        return scale * np.outer(sigma, vehicle.turbulence.row)

    def __repr__(self) -> str:
        kind = "of all sources" if self.combined else "of the wind alone"
        if self.direction is not None:
            kind += f", towards {np.degrees(self.direction):.0f} degrees from pitch towards yaw"
        return (
            f"DesignWind behind {self.response} = {self.load:.6g} {self.unit} at {self.time:g} s: mean + "
            f"{self.sigmas:g} sigma {kind} ({self.side})\n  {self.profile.sizes['altitude']} levels, a corner at "
            f"{self.altitude_at_time:.6g} m; the profile alone makes {self.load_by_wind:.6g} {self.unit}"
        )

    def _repr_html_(self) -> str:
        return html_of(repr(self))


def _sigmas(source: str) -> tuple[str, str]:
    return f"{source}.sigma", f"{source}.standard_deviation"


def mean_winds(case: Case, altitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean wind (m/s) that a case's vehicle meets at altitudes (m), or both components, (m, winds)."""
    scale, means = case.parameters["wind.mean_scale"].value, case.vehicle_for("a mean wind").wind.means
    return scale * np.stack([m.polynomial(np.clip(altitude, m.argument[0], m.argument[-1])) for m in means], axis=1)


@steps("the most likely wind")
def design_wind(
    case: Case, response: str | FlightLoad, time: float | None, sigmas: float, combined: bool
) -> DesignWind:
    """See :meth:`Study.design_wind`."""
    if isinstance(response, FlightLoad):
        return _of_flight_load(response, time)
    if time is None:
        raise TimeRangeError("a design wind is of one time: give it in seconds, or the load of a flight")
    if isinstance(sigmas, bool) or not isinstance(sigmas, int | float) or not math.isfinite(sigmas):
        raise ParameterValueError(
            f"a load of {sigmas!r:.60} sigmas is none; give a number, negative for the other side"
        )
    if not isinstance(combined, bool):
        raise ParameterValueError(f"combined = {combined!r:.60} is neither true nor false")
    return _behind(case, _checked_name(case, response), seconds(time), float(sigmas), combined)


def _checked_name(case: Case, response: object) -> str:
    if not isinstance(response, str):
        raise ParameterValueError(
            f"a design wind is of one response by name, or of a flight's load, not {response!r:.60}"
        )
    return response_or_resultant(case, response)


def _behind(
    case: Case, name: str, time: float, sigmas: float, combined: bool, level: float | None = None
) -> DesignWind:
    """Return the wind behind mean + k sigma, or behind a level where one is given."""
    vehicle, climb, system = case.vehicle_for("a design wind"), Climb.of(case), case.system
    if vehicle.turbulence is not None and vehicle.turbulence.correlation is not None:
        raise DataError(
            "turbulence is correlated with the wind, so that one filter does not tell which wind is behind a load; "
            "leave wind.turbulence.correlation out"
        )
    (end,) = case.checked_times([time])
    node = float(time_nodes(case.with_means, [end])[0])
    if not node > system.start:
        raise TimeRangeError(f"at the start at {system.start:g} s nothing has been flown; give a later time")
    outputs = outputs_of(case, name)
    rows = [system.output_index(output) for output in outputs]
    here = interval_before(case.with_means, node)
    C, G, inputs = MatrixEvaluator(case.with_means, ("C", "G", "inputs"))(node, here.low, here.high)
    means = C[rows] @ case.mean_states(np.array([node]))[0] + G[rows] @ inputs[:, 0]
    engine = engine_with_covariances(case) if len(rows) > 1 else None
    found = response_statistics(case, [end], responses=outputs, engine=engine)
    by_source = _covariances(found.dataset, outputs)
    factors, direction = np.ones(1), None
    if len(rows) > 1:
        law = NormOfNormal(means, sum(by_source.values(), np.zeros((1, 1))) if combined else by_source[WIND])
        level = float(law.percentile(float(ndtr(-sigmas)))) if level is None else level
        direction = float(law.direction(level).most_likely)
        factors = np.array([math.cos(direction), math.sin(direction)])
    mean = float(factors @ means)
    winds = case.wind_inputs("a design wind")
    ends = [((factors @ C[rows])[None], (factors @ G[np.ix_(rows, winds)])[None])]
    (weights,) = weights_of_rows(case, [end], ends, node - system.start)
    other = sum(float(factors @ P @ factors) for source, P in by_source.items() if source != WIND)
    top = max(float(m.argument[-1]) for m in vehicle.wind.means)
    points = wind_at_points(case, climb, weights, top)
    if not points.variance > 0:
        raise NoVarianceError(f"the wind does not reach '{name}' at {end:g} s: no wind makes that load")
    if level is not None:
        sigmas = (level - mean) / math.sqrt(points.variance + (other if combined else 0.0))
    row = tuple(zip(outputs, factors.tolist(), strict=True))
    unit = system.outputs[rows[0]].unit
    return DesignWind(case, name, unit, end, sigmas, combined, mean, other, points, weights, row, direction)


def _covariances(found: xr.Dataset, outputs: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
    """Return the covariance (outputs, outputs) of responses at one time by each source."""
    sources = [str(source) for source in found["source"].values if source != COMBINED]
    at = found.isel(time=0)
    if len(outputs) == 1:
        return {s: at["variance"].sel(source=s, response=list(outputs)).values.reshape(1, 1) for s in sources}
    whole = at["covariance"].sel(response=list(outputs), other_response=list(outputs))
    return {s: whole.sel(source=s).transpose("response", "other_response").values for s in sources}


def _of_flight_load(load: FlightLoad, time: float | None) -> DesignWind:
    """Return the combined design wind behind a flight's level, at the time at which flights most likely pass it."""
    if time is not None:
        raise TimeRangeError("the time follows from the load of the flight; leave it out")
    density, level, case = load.time_of_maximum[1], float(load.level[0]), load.of.case
    at = round(float(density["time"][int(np.argmax(density.values))]), 3)
    if len(outputs_of(case, load.response)) > 1:
        return _behind(case, load.response, at, 0.0, True, level)
    mean = _behind(case, load.response, at, 1.0, True).mean_response
    upper = load.sides == "upper" or (load.sides == "both" and mean >= 0)
    return _behind(case, load.response, at, 0.0, True, level if upper else -level)
