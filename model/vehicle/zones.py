"""Zones along a vehicle that enter a gust one after the other, nose first, and what each makes of its own wind.

A table holds the normal force by strips: integrals of c'_N times 1, x and Y_i over each. Strips in a row make a zone.
They are cut so that the strips lie as close about their zones as can be, each by its share of the normal force and of
the bending moments: what a zone lumps meets the wind at other times than the zone. It stands where the size of its
normal force has its centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
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
    one_plane = file.planes != "both"  # in both planes the whole vehicle feels one wind in each
    return DEFAULT if is_turbulent(file) and one_plane and file.tables.normal_force_along_vehicle else 1


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
    """Strips in zones, the foremost first.

    Attributes
    ----------
    strips : Strips
    member : (n, k) array
        One where a strip belongs to a zone, zero elsewhere.
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
    """Return the zones that spread the least: each strip counts by its share of the normal force and of the moments.

    Parameters
    ----------
    strips : Strips
    count : int
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
    size = weight @ np.abs(strips.slope)
    if count > np.count_nonzero(size):
        raise DataError(
            f"has {np.count_nonzero(size)} strips with a normal force, fewer than options.gust_zones = {count}; take "
            "fewer zones or build finer strips",
            file=file,
        )
    shares = [size / size.sum()]
    for station in stations:
        arm = np.maximum(strips.forward_of_gimbal - station, 0.0)
        moment = size * arm
        if moment.any():
            shares.append(moment / moment.sum())
    of_moments = [np.mean(shares[1:], axis=0)] if shares[1:] else []
    edges = _cuts(np.mean([shares[0], *of_moments], axis=0), strips.forward_of_gimbal, count)
    member = np.zeros((count, size.size))
    position = np.zeros(count)
    for j, (low, high) in enumerate(pairwise(edges)):
        zone = count - 1 - j
        member[zone, low:high] = 1.0
        position[zone] = size[low:high] @ strips.forward_of_gimbal[low:high] / size[low:high].sum()
    return Zones(strips, member, position)


def _cuts(weight: Array, place: Array, count: int) -> list[int]:
    """Return where to cut strips in a row so that their weighted squared distances from their zone's centre are least.

    By dynamic programming: with one strip more the best cut is that of the best one before.
    """
    n = weight.size
    sums = [np.concatenate([[0.0], np.cumsum(weight * place**power)]) for power in (0, 1, 2)]
    best, cut = np.full((count + 1, n + 1), np.inf), np.zeros((count + 1, n + 1), dtype=int)
    best[0, 0] = 0.0
    for parts in range(1, count + 1):
        for end in range(parts, n + 1):
            mass, first, second = (total[end] - total[:end] for total in sums)
            scatter = second - np.divide(first**2, mass, out=np.zeros(end), where=mass > 0)
            cost = best[parts - 1, :end] + np.where(mass > 0, np.maximum(scatter, 0.0), np.inf)
            cut[parts, end] = int(np.argmin(cost))
            best[parts, end] = cost[cut[parts, end]]
    edges = [n]
    for parts in range(count, 0, -1):
        edges.append(int(cut[parts, edges[-1]]))
    return edges[::-1]
