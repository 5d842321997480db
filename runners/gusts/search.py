"""The worst discrete gust: over lengths, altitudes and end times, on a grid first and then between its points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.errors import ParameterValueError, UnknownNameError
from ..case.case import Case
from ..case.climb import Climb
from ..case.provenance import provenance
from ..case.times import end_times, parse_times, spread_over
from ..present.netcdf import RULE
from ..present.notebook import html_of
from ..present.progress import each, steps
from .clocking import Quantities, checked_quantities
from .response import check_length, described, gust_products, gust_response
from .shapes import LENGTHS, Gust, GustError, checked_gust
from .weights import WindWeights, wind_weights

LENGTH_COUNT = 13  # from 60 to 300 m every 20 m
TIMES = 21  # end times of a vehicle's default ones, spread evenly
AFTER = 3.0  # s, from the end of a gust to where its response is looked for at first
FARTHEST = 30.0  # s, the most, where the largest response still lies at the end of the search
PERIODS = 8  # starts in a period of the fastest oscillation
MOST_STARTS = 2000
ZOOMS, ZOOM, FINER = 5, 9, 4  # halves of a grid of 9 x 9 points about the worst, each time 4 times finer
TIME_ZOOMS, TIME_POINTS = 2, 9
AROUND, POINTS = (0.5, 4.0), 181  # s before a worst gust is met and after its largest response, and times drawn


@dataclass(frozen=True)
class WorstGust:
    """The gust that makes one response largest.

    Attributes
    ----------
    response, unit : str
    value : float
        Of the response to the gust alone, with the sign that the gust's amplitude gives it.
    time : float
        At which it is reached, s.
    gust : Gust
        With its length.
    start_altitude : float
        m.
    time_met : float
        At which the vehicle meets the gust, s.
    direction : float or None
        Where it blows, rad from north towards east; of a vehicle in both planes.
    """

    response: str
    unit: str
    value: float
    time: float
    gust: Gust
    start_altitude: float
    time_met: float
    direction: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class GustSweep:
    """Responses to gusts of one shape, over lengths, altitudes and end times.

    Attributes
    ----------
    case : Case
    gust : Gust
        The shape, whose length is varied.
    lengths : (q,) array
        m.
    times : (k,) array
        End times, s.
    responses : tuple of str
    """

    case: Case
    gust: Gust
    lengths: NDArray[np.float64]
    times: NDArray[np.float64]
    responses: tuple[str, ...]

    @cached_property
    def climb(self) -> Climb:
        """Altitude over time."""
        return Climb.of(self.case)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Of the responses."""
        return Quantities.of(self.case, self.responses).units

    @property
    def from_any_direction(self) -> bool:
        """Whether the vehicle flies in both planes, where of every gust the worst direction is taken."""
        return len(self.case.wind_inputs("a gust")) > 1

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The largest response to a gust that starts anywhere, over (time, response, length).

        ``largest`` is signed as the amplitude of the gust makes it, the other sign comes with a gust from the other
        side; ``start_altitude`` is where that gust starts, and ``at_edge`` is 1 where the largest response of all
        lengths was found for the earliest start that could be looked at. In both planes gusts blow from any direction:
        ``largest`` is a size, and ``direction`` where that gust blows.
        """
        with steps("weights of the wind"):
            weights_of = self._weights(self.times, self.responses)
        found = [self._at(weights, self.responses) for weights in each(weights_of, f"{self.gust.name} gusts")]
        largest, starts, edge, directions = (np.array(part) for part in zip(*found, strict=True))
        dims = ("time", "response", "length")
        turned = {"units": "rad", "long_name": "where that gust blows, from north towards east"}
        return xr.Dataset(
            {
                "largest": (dims, largest, {RULE: "response", "long_name": "largest response to the gust alone"}),
                "start_altitude": (dims, starts, {"units": "m", "long_name": "altitude at which that gust starts"}),
                **({"direction": (dims, directions, turned)} if self.from_any_direction else {}),
                "at_edge": (dims[:2], edge.astype(int), {"units": "1", "long_name": "1 at the edge of the search"}),
            },
            {
                "time": ("time", self.times, {"units": "s", "long_name": "flight time t2"}),
                "response": list(self.responses),
                "unit": ("response", list(self.units)),
                "length": ("length", self.lengths, {"units": "m", "long_name": "length along altitude"}),
            },
            provenance(self.case) | {k: v for k, v in described(self.gust).items() if k != "length_m"},
        )

    def worst(self, response: str) -> WorstGust:
        """Return the gust that makes a response largest, located between the points of the grid.

        Parameters
        ----------
        response : str
            One of the sweep's.

        Returns
        -------
        WorstGust

        Raises
        ------
        UnknownNameError, IntegrationError
        """
        if response not in self.responses:
            raise UnknownNameError("response of the sweep", response, self.responses)
        return self._worst[response]

    @cached_property
    def _worst(self) -> dict[str, WorstGust]:
        return {name: self._located(name) for name in each(self.responses, f"worst {self.gust.name} gusts")}

    @cached_property
    def longest(self) -> float:
        """How long the vehicle is in the longest gust, at most, s."""
        lengths, climb = float(self.lengths.max()), self.climb
        at = climb.altitude(self.times)
        return float((self.times - climb.time_at(at - lengths)).max())

    def _weights(self, times: Sequence[float] | NDArray[np.float64], responses: Sequence[str]) -> list[WindWeights]:
        outputs = Quantities.of(self.case, responses).outputs
        return wind_weights(self.case, [float(t) for t in times], outputs, self.longest + AFTER)

    def _step(self, time: float) -> float:
        """Return the distance between starts, s."""
        fastest = float(np.linalg.eigvals(self.case.matrices(time)[0]).imag.max())
        return 2 * np.pi / fastest / PERIODS if fastest > 0 else self.longest / PERIODS

    def starts(self, weights: WindWeights) -> NDArray[np.float64]:
        """Return altitudes at which gusts are tried (m), from that at t2 down to where the weights begin."""
        span = weights.time - weights.begin
        count = int(min(MOST_STARTS, np.ceil(span / self._step(weights.time)))) + 1
        return self.climb.altitude(weights.time - np.linspace(0.0, span, count))

    def _at(self, weights: WindWeights, names: Sequence[str]) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Return largest responses and their starts, (r, q), if the search ended too early, (r,), and directions."""
        quantities = Quantities.of(self.case, names)
        time, span, starts = weights.time, weights.time - weights.begin, self.starts(weights)
        products = np.array(
            [gust_products(weights, self.climb, replace(self.gust, length=L), starts) for L in self.lengths]
        )
        found = quantities.sizes(products)
        best = np.abs(found).argmax(axis=1)  # (q, r), of (q, starts, r)
        largest = np.take_along_axis(found, best[:, None], axis=1)[:, 0].T
        of_all = best.T[np.arange(len(names)), np.abs(largest).argmax(axis=1)]
        edge = (of_all >= starts.size - 2) & (np.abs(largest).max(axis=1) > 0)
        earliest = max(self.case.system.start, time - self.longest - FARTHEST)
        if edge.any() and weights.begin > earliest:
            more = wind_weights(self.case, [time], quantities.outputs, min(2 * span, time - earliest))
            return self._at(more[0], names)
        directions = np.zeros_like(largest)
        if self.from_any_direction:
            directions = np.take_along_axis(quantities.directions(products), best[:, None], axis=1)[:, 0].T
        return largest, starts[best].T, edge, directions

    def _located(self, name: str) -> WorstGust:
        at = self.responses.index(name)
        found = np.abs(self.dataset["largest"].values[:, at]).max(axis=1)
        k = int(found.argmax())
        time, beside = float(self.times[k]), np.abs(np.diff(self.times))
        around = max([float(x) for x in beside[max(0, k - 1) : k + 1]], default=0.0)
        low, high = float(self.times[0]), float(self.times[-1])
        best = self._zoomed(self._weights([time], [name])[0], name)
        for _ in range(TIME_ZOOMS if around else 0):
            times = np.unique(np.clip(time + around * np.linspace(-1, 1, TIME_POINTS), low, high))
            for weights in self._weights(times, [name]):
                tried = self._zoomed(weights, name)
                best = tried if abs(tried.value) > abs(best.value) else best
            time, around = best.time, 2 * around / (TIME_POINTS - 1)
        return best

    def _zoomed(self, weights: WindWeights, name: str) -> WorstGust:
        """Return the worst gust for one response at one time."""
        quantities = Quantities.of(self.case, [name])
        largest, starts, _, directions = self._at(weights, [name])
        q = int(np.abs(largest[0]).argmax())
        length, met = float(self.lengths[q]), float(self.climb.time_at(starts[0, q]))
        low, high = float(self.lengths.min()), float(self.lengths.max())
        wide = float(np.diff(self.lengths).max()) if self.lengths.size > 1 else 0.0
        step, value, direction = self._step(weights.time), float(largest[0, q]), float(directions[0, q])
        for _ in range(ZOOMS):
            tries = np.unique(np.clip(length + wide * np.linspace(-1, 1, ZOOM), low, high))
            times = np.unique(np.clip(met + step * np.linspace(-1, 1, ZOOM), weights.begin, weights.time))
            at = self.climb.altitude(times)
            products = np.array([gust_products(weights, self.climb, replace(self.gust, length=L), at) for L in tries])
            found = quantities.sizes(products)[..., 0]
            i, j = np.unravel_index(int(np.abs(found).argmax()), found.shape)
            if abs(found[i, j]) >= abs(value):
                length, met, value = float(tries[i]), float(times[j]), float(found[i, j])
                if self.from_any_direction:
                    direction = float(quantities.directions(products[i, j])[0])
            wide, step = wide / FINER, step / FINER
        unit = self.units[self.responses.index(name)]
        start = float(self.climb.altitude(met))
        gust, toward = replace(self.gust, length=length), direction if self.from_any_direction else None
        return WorstGust(name, unit, value, weights.time, gust, start, met, toward)

    def over_time(self, response: str) -> xr.Dataset:
        """Return a response to its worst gust, from before that is met on.

        Parameters
        ----------
        response : str

        Returns
        -------
        Dataset
            As :meth:`Study.gust_response` returns it.

        Raises
        ------
        UnknownNameError
        """
        worst = self.worst(response)
        low = max(self.case.system.start, worst.time_met - AROUND[0])
        ends = np.linspace(low, min(self.case.system.end, worst.time + AROUND[1]), POINTS)
        return gust_response(self.case, worst.gust, worst.start_altitude, ends, [response], worst.direction)

    def __repr__(self) -> str:
        lines = [
            f"GustSweep of {self.gust.name} gusts of {self.gust.amplitude:g} m/s, {self.lengths.min():g} to "
            f"{self.lengths.max():g} m, {self.times[0]:g} to {self.times[-1]:g} s"
        ]
        for worst in self._worst.values():
            toward = "" if worst.direction is None else f" towards {np.degrees(worst.direction) % 360:.0f} degrees"
            lines.append(
                f"{worst.response}: {worst.value:.5g} {worst.unit} at {worst.time:.5g} s, length "
                f"{worst.gust.length:.4g} m from {worst.start_altitude:.6g} m{toward}"
            )
        return "\n  ".join(lines)

    def _repr_html_(self) -> str:
        return html_of(repr(self))


def gust_sweep(
    case: Case,
    gust: Gust,
    times: Iterable[float] | None,
    responses: Iterable[str] | None,
    lengths: Iterable[float] | None,
) -> GustSweep:
    """See :meth:`Study.gust_sweep`."""
    climb, gust = Climb.of(case), checked_gust(gust)
    names = checked_quantities(case, responses)
    if times is None:
        vehicle = case.vehicle_for("a gust")
        times = spread_over(parse_times(vehicle.file.default_times), TIMES)
    ends = np.array(case.checked_times(end_times(times)))
    found = _checked_lengths(gust, lengths)
    check_length(climb, float(found.max()))
    return GustSweep(case, gust, found, ends, tuple(names))


def _checked_lengths(gust: Gust, lengths: Iterable[float] | None) -> NDArray[np.float64]:
    """Return lengths in increasing order, each of which the shape can have.

    Raises
    ------
    GustError, ParameterValueError
    """
    if lengths is None:
        found = [L for L in np.linspace(*LENGTHS, LENGTH_COUNT) if gust.shortest <= L]
        if not found:
            raise GustError(
                f"no {gust.name} gust is shorter than {gust.shortest:g} m, and {LENGTHS[0]:g} to {LENGTHS[1]:g} m are "
                "tried; give lengths"
            )
        return np.array(found)
    try:
        found = sorted({float(length) for length in lengths})
    except (TypeError, ValueError):
        raise ParameterValueError(
            f"{lengths!r:.60} is no list of lengths; give metres, such as [60, 150, 300]"
        ) from None
    if not found:
        raise ParameterValueError("no length of a gust was given; give metres, such as [60, 150, 300]")
    for length in found:
        replace(gust, length=length)
    return np.array(found)
