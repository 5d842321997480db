"""Zones along a vehicle that enter a gust one after the other, nose first, and what each makes of its own wind.

A table holds the normal force by strips: integrals of c'_N times 1, x and Y_i over each. Zones stand at some of them;
every strip meets the wind that the parabola through its three nearest zones gives it, so that forces, moments and
bending alike are right to the second order of the delays. They stand where straight lines between them would miss the
least, each strip by its share of the normal force and of the bending moments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError
from ..files.csv_table import CsvTable
from ..tables import Table
from .columns import TIME, normal_force_columns
from .vehicle_file import VehicleFile

Array = NDArray[np.float64]

PREFIX = "zones."  # of their tables
AHEAD = f"{PREFIX}ahead"  # altitude of the foremost zone above the vehicle's own, m
LARGEST_RATE = 600.0  # 1/s: delays below 1.7 ms, 0.1 rad of an oscillation at 60 rad/s, are taken as that
DEFAULT = 5  # zones where turbulence is on


def zone_count(file: VehicleFile) -> int:
    """Return the number of gust zones: as chosen, else five where turbulence is on and the strips are known."""
    if file.options.gust_zones is not None:
        return file.options.gust_zones
    return DEFAULT if is_turbulent(file) and file.tables.normal_force_along_vehicle else 1


def is_turbulent(file: VehicleFile) -> bool:
    """Return whether the vehicle flies through turbulence."""
    return file.wind.turbulence is not None and file.wind.turbulence.severity != "off"


@dataclass(frozen=True, eq=False)
class Strips:
    """Normal force of strips along the vehicle, aft first.

    Attributes
    ----------
    time : (t,) array
        s.
    forward_of_gimbal : (k,) array
        Middles, m.
    slope, first_moment : (t, k) arrays
        Integrals of c'_N times 1 and x, 1/rad and m/rad.
    displacement : (modes, t, k) array
        Of c'_N times Y_i, 1/rad.
    interpolation : str
    breaks : tuple of float
        Times at which they may jump, s.
    """

    time: Array
    forward_of_gimbal: Array
    slope: Array
    first_moment: Array
    displacement: Array
    interpolation: str
    breaks: tuple[float, ...]

    @classmethod
    def read(cls, csv: CsvTable, modes: int, interpolation: str, breaks: Sequence[float]) -> Strips:
        """Return the strips of a table, whose rows may be in any order.

        Raises
        ------
        DataError
            A strip is missing at a time, or changes its place.
        """
        time, place = csv.columns[TIME.name], csv.columns["forward_of_gimbal"]
        times, places = np.unique(time), np.unique(place)
        order = np.lexsort((place, time))
        shape = times.size, places.size
        if order.size != times.size * places.size or (place[order].reshape(shape) != places).any():
            raise DataError(
                f"has {order.size} rows for {times.size} times and {places.size} strips; give every strip once at "
                "every time",
                file=csv.file,
            )
        slope, moment, *displacement = (
            csv.columns[column.name][order].reshape(shape) for column in normal_force_columns(modes)
        )
        shapes = np.array(displacement).reshape(modes, *shape)
        return cls(times, places, slope, moment, shapes, interpolation, tuple(breaks))

    def table(self, name: str, unit: str, values: Array) -> Table:
        """Return values (t,) as a table."""
        return Table(name, unit, self.time, values, self.interpolation, self.breaks)


@dataclass(frozen=True, eq=False)
class Zones:
    """Zones, the foremost first, and how the strips meet their winds.

    Attributes
    ----------
    strips : Strips
    member : (n, k) array
        Share of a zone's wind in that of a strip; they sum to one.
    position : (n,) array
        m forward of the gimbal plane, falling.
    """

    strips: Strips
    member: Array
    position: Array

    @property
    def count(self) -> int:
        return self.position.size

    @property
    def distances(self) -> Array:
        """From each zone to the next, m, (n - 1,)."""
        return -np.diff(self.position)

    def rate_tables(self, speed: Array) -> list[Table]:
        """Return the rates of the delays, V/d up to the largest, for speeds (t,) at the times of the strips."""
        rates = (np.minimum(speed / d, LARGEST_RATE) for d in self.distances)
        time, breaks = self.strips.time, self.strips.breaks
        return [Table(f"{PREFIX}rate_{j}", "1/s", time, r, "pchip", breaks) for j, r in enumerate(rates, start=1)]

    def nearest(self, position: float) -> int:
        """Return the number of the zone that is nearest to a point (m forward of the gimbal plane)."""
        return int(np.argmin(np.abs(self.position - position)))

    def tables(self) -> list[Table]:
        """Return what the zones make of their own winds: their parts of C'_N, of its first moment and of modes."""
        strips, found = self.strips, []
        for j, member in enumerate(self.member, start=1):
            found.append(strips.table(f"{PREFIX}normal_force_slope_{j}", "1/rad", strips.slope @ member))
            found.append(strips.table(f"{PREFIX}first_moment_{j}", "m/rad", strips.first_moment @ member))
            for i, shape in enumerate(strips.displacement, start=1):
                found.append(strips.table(f"{PREFIX}displacement_{i}_{j}", "1/rad", shape @ member))
        return found

    def forward(self, station: float, is_shear: bool) -> Array:
        """Return the integrals of c'_N times x - s, or times 1 for a shear force, forward of a station: (t, n).

        Parameters
        ----------
        station : float
            s, m forward of the gimbal plane; strips are cut there.
        is_shear : bool
        """
        strips = self.strips
        ahead = strips.forward_of_gimbal > station
        value = strips.slope if is_shear else strips.first_moment - station * strips.slope
        return (value * ahead) @ self.member.T

    def along(self, times: Array, stations: Array, is_shear: bool) -> Array:
        """Return the same at times (s) for many stations, (times, stations, n)."""
        whole = np.stack([self.forward(float(s), is_shear) for s in stations], axis=1)
        flat = whole.reshape(whole.shape[0], -1).T
        tables = (self.strips.table("forward", "", row) for row in flat)
        return np.array([table.polynomial(times) for table in tables]).T.reshape(times.size, *whole.shape[1:])

    def load_tables(self, output: str, station: float, is_shear: bool) -> list[Table]:
        """Return those integrals as tables of a load, one a zone."""
        unit = "1/rad" if is_shear else "m/rad"
        columns = self.forward(station, is_shear).T
        return [self.strips.table(f"{PREFIX}{output}_{j}", unit, c) for j, c in enumerate(columns, start=1)]


def make_zones(strips: Strips, count: int, weight: Array, stations: Sequence[float], file: Path) -> Zones:
    """Return the zones whose winds tell the most: each strip counts by its share of normal force and of moments.

    Parameters
    ----------
    strips : Strips
    count : int
        Two or more.
    weight : (t,) array
        By which times count: the dynamic pressure, Pa.
    stations : sequence of float
        Of the bending moments, m forward of the gimbal plane.
    file : Path
        For messages.

    Raises
    ------
    DataError
        More zones than strips that carry a force.
    """
    size, place = weight @ np.abs(strips.slope), strips.forward_of_gimbal
    carrying = size > 0
    if count > np.count_nonzero(carrying):
        raise DataError(
            f"has {np.count_nonzero(carrying)} strips with a normal force, fewer than options.gust_zones = {count}; "
            "take fewer zones or build finer strips",
            file=file,
        )
    moments = [size * np.maximum(place - station, 0.0) for station in stations]
    of_moments = [moment / moment.sum() for moment in moments if moment.any()]
    shares = [size / size.sum(), *([np.mean(of_moments, axis=0)] if of_moments else [])]
    found = _places(np.mean(shares, axis=0)[carrying], place[carrying], count)
    return Zones(strips, _between(place, found)[::-1], found[::-1])


def _places(weight: Array, place: Array, count: int) -> Array:
    """Return places, increasing, among given ones, between which straight lines miss a parabola the least.

    By weighted squares, the outer lines drawn on to the ends; by dynamic programming: with one place more the best is
    that of the best one before.
    """
    n, scaled = place.size, (place - place[0]) / (place[-1] - place[0])

    def missed(a: int, b: int, low: int, high: int) -> float:
        part = scaled[low:high]
        return float(weight[low:high] @ (((part - scaled[a]) * (part - scaled[b])) ** 2))

    best, before = np.zeros(n), []
    for k in range(1, count):
        low, high = (0 if k == 1 else None), (n if k == count - 1 else None)
        cost = np.full((n, n), np.inf)
        for b in range(k, n):
            for a in range(k - 1, b):
                cost[b, a] = best[a] + missed(a, b, a if low is None else low, b if high is None else high)
        before.append(cost.argmin(axis=1))
        best = cost.min(axis=1)
    found = [int(np.argmin(best))]
    for step in before[::-1]:
        found.append(int(step[found[-1]]))
    return place[found[::-1]]


def _between(place: Array, zones: Array) -> Array:
    """Return the weights of zones (n,), increasing, in the parabola through the nearest three, (n, k)."""
    near, found = min(3, zones.size), np.zeros((zones.size, place.size))
    for k, x in enumerate(place):
        first = min(range(zones.size - near + 1), key=lambda i: float(np.abs(zones[i : i + near] - x).sum()))
        chosen = range(first, first + near)
        for j in chosen:
            found[j, k] = np.prod([(x - zones[i]) / (zones[j] - zones[i]) for i in chosen if i != j])
    return found
