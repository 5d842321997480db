"""The most likely wind behind a load: E[w(h) | y(t2) = L], and what else makes that load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...codegen.system.evaluation import MatrixEvaluator
from ...model.equations.noise import DEVIATION
from ...model.errors import DataError, ParameterValueError, TimeRangeError
from ...model.system.names import TURBULENCE, WIND
from ...model.vehicle.planes import one_wind
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
from ..solvers.time_nodes import interval_before, time_nodes
from ..statistics.engines import response_statistics
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
    time : float
        t2, s.
    sigmas : float
        k; negative for a load on the other side of the mean.
    combined : bool
        Whether the load is mean + k sigma of all sources, of which the wind makes its part, or of the wind alone.
    mean_response : float
        Of the response in the mean wind.
    other_variance : float
        Of the response, by all sources but the wind's filter.
    points : WindAtPoints
    weights : WindWeights
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
        """Mean wind at all points, m/s."""
        return mean_wind(self.case, self.points.altitude)

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
        h, at = self.points.altitude, self._levels
        unit = self.points.wind_covariance / self.std
        of_lines = self.points.weight @ np.interp(h, h[at], unit[at])
        exact = self.points.weight @ (self.mean_wind + self._deviation)
        mean = self.points.weight @ np.interp(h, h[at], self.mean_wind[at])
        return float((exact - mean) / of_lines - self.sigmas)

    @cached_property
    def profile(self) -> xr.Dataset:
        """The wind over (altitude): linear between levels it makes the load, and there is a level at h(t2).

        ``wind``, ``mean``, ``deviation`` and its size in ``local_sigmas`` of the wind there; ``conditional_std`` of
        the winds that make this load, ``band`` (altitude, bound) that holds 95 % of them.
        """
        at = self._levels
        deviation = self.points.wind_covariance[at] * ((self.sigmas + self.added_sigmas) / self.std)
        wind, std = self.mean_wind[at] + deviation, self.points.std[at]
        share = np.divide(self.points.wind_covariance[at], std * self.std, out=np.zeros(at.size), where=std > 0)
        conditional = std * np.sqrt(np.maximum(1 - share**2, 0.0))
        local = np.divide(deviation, std, out=np.zeros(at.size), where=std > 0)
        speed = {"units": "m/s"}
        return xr.Dataset(
            {
                "wind": ("altitude", wind, speed | {"long_name": "most likely wind behind the load"}),
                "mean": ("altitude", self.mean_wind[at], speed | {"long_name": "mean wind"}),
                "deviation": ("altitude", deviation, speed | {"long_name": "wind less its mean"}),
                "local_sigmas": (
                    "altitude",
                    local,
                    {"units": "1", "long_name": "deviation in sigmas of the wind there"},
                ),
                "conditional_std": ("altitude", conditional, speed | {"long_name": "std of winds that make the load"}),
                "band": (
                    ("altitude", "bound"),
                    wind[:, None] + BAND * np.outer(conditional, [-1.0, 1.0]),
                    speed | {"long_name": "holds 95 % of the winds that make the load"},
                ),
            },
            {
                "altitude": ("altitude", self.points.altitude[at], {"units": "m", "long_name": "altitude"}),
                "bound": ["lower", "upper"],
            },
            provenance(self.case)
            | {"response": self.response, "unit": self.unit, "t2_s": self.time, "sigmas": self.sigmas}
            | {"combined": str(self.combined).lower(), "load": self.load, "load_by_wind": self.load_by_wind}
            | {"altitude_at_t2_m": self.altitude_at_time, "side": self.side}
            | {"added_sigmas": self.added_sigmas},
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
            Over (draw, altitude), m/s, at the levels of the profile.

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
            made = self.points.weight @ wind
            if self.combined:
                made += math.sqrt(self.other_variance) * random.standard_normal(made.size)
            parts.append(self.mean_wind[at, None] + wind[at] + np.outer(gain, load - made))
        found = np.concatenate(parts, axis=1)
        profile = self.profile
        what = {"units": "m/s", "long_name": "wind given the load"}
        return xr.DataArray(found.T, {"altitude": profile["altitude"]}, ("draw", "altitude"), attrs=what)

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
        a factor on the mean wind, which the profile leaves out; turbulence is a wind in m/s.
        """
        if not self.combined:
            return None
        system, case = self.case.system, self.case
        node = float(time_nodes(case.with_means, [self.time])[0])
        times = np.linspace(system.start, node, max(2, int(np.ceil((node - system.start) / STEP)) + 1))
        grid = np.unique(time_nodes(case.with_means, times))
        chain = chain_at(case, grid)
        adjoint = [chain.output[-1][system.output_index(self.response)]]
        for Phi in chain.transition[::-1]:
            adjoint.append(adjoint[-1] @ Phi)
        back = np.array(adjoint[::-1])
        names, values = [s for s in system.sources if s != WIND], []
        for name in names:
            states = [k for k, s in enumerate(system.states) if s.name == f"{DEVIATION}_{name}"]
            if name == TURBULENCE:
                P = chain.covariance([system.sources.index(name)])
                values.append(np.einsum("ki,kin,kn->k", self._turbulence(grid), P[:, system.block(name)], back))
            elif states:
                (sigma,) = (p.value for n, p in case.parameters.items() if n in _sigmas(name))
                P = chain.covariance([system.sources.index(name)])
                values.append(sigma * np.einsum("kn,kn->k", P[:, states[0]], back))
            else:
                (column,) = system.noise_columns(name)
                values.append(np.einsum("kn,kn->k", chain.noise_matrix[:, :, column], back))
        found = np.array(values).reshape(len(names), grid.size) * (self.sigmas / self.std)
        return xr.Dataset(
            {"deviation": (("source", "t"), found, {"long_name": "most likely deviation behind the load"})},
            {"source": names, "t": ("t", grid, {"units": "s", "long_name": "flight time"})},
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
        return (
            f"DesignWind behind {self.response} = {self.load:.6g} {self.unit} at {self.time:g} s: mean + "
            f"{self.sigmas:g} sigma {kind} ({self.side})\n  {self.profile.sizes['altitude']} levels, a corner at "
            f"{self.altitude_at_time:.6g} m; the profile alone makes {self.load_by_wind:.6g} {self.unit}"
        )

    def _repr_html_(self) -> str:
        return html_of(repr(self))


def _sigmas(source: str) -> tuple[str, str]:
    return f"{source}.sigma", f"{source}.standard_deviation"


def mean_wind(case: Case, altitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean wind (m/s) that a case's vehicle meets at altitudes (m)."""
    table = one_wind(case.vehicle_for("a mean wind"), "a mean wind").mean
    held = np.clip(altitude, table.argument[0], table.argument[-1])
    return case.parameters["wind.mean_scale"].value * table.polynomial(held)


def design_wind(
    case: Case, response: str | FlightLoad, time: float | None, sigmas: float, combined: bool
) -> DesignWind:
    """See :meth:`Study.design_wind`."""
    if isinstance(response, FlightLoad):
        return _of_flight_load(response, time)
    if time is None:
        raise TimeRangeError("a design wind is of one time: give it in seconds, or the load of a flight")
    if isinstance(sigmas, bool) or not isinstance(sigmas, int | float) or not math.isfinite(sigmas):
        raise ParameterValueError(f"a load of {sigmas!r} sigmas is none; give a number, negative for the other side")
    one_wind(case.vehicle_for("a design wind"), "a design wind")
    climb = Climb.of(case)
    turbulence = case.vehicle_for("a design wind").turbulence
    if turbulence is not None and turbulence.correlation is not None:
        raise DataError(
            "turbulence is correlated with the wind, so that one filter does not tell which wind is behind a load; "
            "leave wind.turbulence.correlation out"
        )
    (name,) = case.checked_responses([response])
    (end,) = case.checked_times([seconds(time)])
    executable, system = case.with_means, case.system
    node = float(time_nodes(executable, [end])[0])
    if not node > system.start:
        raise TimeRangeError(f"at the start at {system.start:g} s nothing has been flown; give a later time")
    row = system.output_index(name)
    here = interval_before(executable, node)
    C, G, inputs = MatrixEvaluator(executable, ("C", "G", "inputs"))(node, here.low, here.high)
    wind = case.wind_input("a design wind")
    mean = float(C[row] @ case.mean_states(np.array([node]))[0] + G[row] @ inputs[:, 0])
    (weights,) = weights_of_rows(case, [end], [(C[[row]], G[[row], wind])], node - system.start)
    variance = response_statistics(case, [end], responses=[name]).variance
    other = sum(float(variance.sel(source=s).squeeze()) for s in system.sources if s != WIND)
    vehicle = case.vehicle_for("a design wind")
    top = float(one_wind(vehicle, "a design wind").mean.argument[-1])
    points = wind_at_points(case, climb, weights, top)
    if not points.variance > 0:
        raise NoVarianceError(f"the wind does not reach '{name}' at {end:g} s: no wind makes that load")
    return DesignWind(case, name, system.outputs[row].unit, end, float(sigmas), combined, mean, other, points, weights)


def _of_flight_load(load: FlightLoad, time: float | None) -> DesignWind:
    """Return the combined design wind behind a flight's level, at the time at which flights most likely pass it."""
    if time is not None:
        raise TimeRangeError("the time follows from the load of the flight; leave it out")
    density, level = load.time_of_maximum[1], float(load.level[0])
    at = round(float(density["time"][int(np.argmax(density.values))]), 3)
    unit = design_wind(load.of.case, load.response, at, 1.0, True)
    upper = load.sides == "upper" or (load.sides == "both" and unit.mean_response >= 0)
    sigmas = ((level if upper else -level) - unit.mean_response) / unit.std
    return design_wind(load.of.case, load.response, at, sigmas, True)
