"""Shipped wind statistics of Cape Canaveral: Range Reference Atmospheres and reconstructed level correlations.

Means, standard deviations and the correlation of u with v at one level are tabulated by month. Correlations between
levels were measured at four levels and a layer only; the matrices are reconstructions: a two-part kernel fitted to
those by month and component (runners/wind/correlation_fit.py), assumed below 1.5 km and above 10.7 km.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, UnknownNameError
from .record import COMPONENTS as COMPONENTS
from .record import WindOrigin, WindRecord
from .shaping_filter import TwoPartKernel
from .statistics import REPORT_SAMPLES, TwoComponentStatistics, WindStatistics

WIND_DATA = Path(__file__).parent / "data"
MONTHS = (
    "january", "february", "march", "april", "may", "june",
    "july", "august", "september", "october", "november", "december",
)  # fmt: skip
PERIODS = (*MONTHS, "annual")
SITE = "Cape Canaveral"
EDITIONS = ("1983", "2006")
LEVELS = {"850": 1530.0, "700": 3140.0, "500": 5830.0, "250": 10720.0}  # pressure in hPa: altitude in m
LAYER = "L1000_700"  # mean over the layer of 1000 to 700 hPa, 100 to 3100 m
SAME_LEVEL = 0.5  # m
ROUNDING = 0.011  # m/s, of tables with two decimals
KERNELS = "interlevel_kernels.csv"


@dataclass(frozen=True, eq=False)
class RangeReference:
    """One month of a Range Reference Atmosphere, u and v, by level."""

    altitude: NDArray[np.float64]
    mean: dict[str, NDArray[np.float64]]
    standard_deviation: dict[str, NDArray[np.float64]]
    intralevel_correlation: NDArray[np.float64]
    observations: NDArray[np.float64]


def read_rows(file: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file with comment lines, by column."""
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def range_reference(period: str = "march", edition: str = "1983") -> RangeReference:
    """Return the table of a month or 'annual', 0 to 30 km.

    Raises
    ------
    UnknownNameError
    """
    if edition not in EDITIONS:
        raise UnknownNameError("edition of the Range Reference Atmosphere", edition, EDITIONS)
    if period not in PERIODS:
        raise UnknownNameError("month", period, PERIODS)
    rows = [r for r in _edition_rows(edition) if r["month"] == period]

    def column(name: str) -> NDArray[np.float64]:
        return np.array([float(r[name]) for r in rows])

    return RangeReference(
        1000.0 * column("altitude [km]"),
        {"zonal": column("mean_u [m/s]"), "meridional": column("mean_v [m/s]")},
        {"zonal": column("standard_deviation_u [m/s]"), "meridional": column("standard_deviation_v [m/s]")},
        column("correlation_uv [1]"),
        column("observations [1]"),
    )


def check_against_edition(
    record: WindRecord, altitude: NDArray[np.float64], mean: NDArray[np.float64], deviation: NDArray[np.float64]
) -> None:
    """Refuse a mean and standard deviation that a record gives to a shipped edition which has other ones.

    Parameters
    ----------
    record : WindRecord
        Of another site or of soundings: nothing is known to compare with.
    altitude : (k,) array
        m.
    mean, deviation : (k,) arrays
        m/s.

    Raises
    ------
    DataError
    """
    origin = record.origin
    if origin.site != SITE or origin.edition not in EDITIONS:
        return
    table = range_reference(origin.period, origin.edition)
    for what, values, wanted in (
        ("mean", mean, record.sign * table.mean[origin.component]),
        ("standard deviation", deviation, table.standard_deviation[origin.component]),
    ):
        for h, value in zip(altitude, values, strict=True):
            i = int(np.argmin(np.abs(table.altitude - h)))
            if abs(table.altitude[i] - h) > SAME_LEVEL or abs(value - wanted[i]) > ROUNDING:
                has = f"{wanted[i]:g} m/s" if abs(table.altitude[i] - h) <= SAME_LEVEL else "no such level"
                raise DataError(
                    f"the {what} at {h:g} m is {value:g} m/s, but the record says {origin}, which has {has}; write "
                    "another wind with 'ascentwind wind apply', or remove [wind.record] if the table is your own"
                )


@lru_cache
def _edition_rows(edition: str) -> list[dict[str, str]]:
    return read_rows(WIND_DATA / f"range_reference_{edition}.csv")


def interlevel_kernel(period: str, component: str, third_order: bool = False) -> TwoPartKernel:
    """Return the kernel fitted to the measured level correlations of a month and component.

    Parameters
    ----------
    third_order : bool
        March zonal only: the variant of smoothness 0.5, which has an exact filter of third order.
    """
    if component not in COMPONENTS:
        raise UnknownNameError("wind component", component, COMPONENTS)
    if period not in PERIODS:
        raise UnknownNameError("month", period, PERIODS)
    wanted = "third_order" if third_order else component
    if third_order and (period, component) != ("march", "zonal"):
        raise UnknownNameError("exact third-order kernel", f"{period} {component}", ["march zonal"])
    knots: dict[str, tuple[list[float], list[float]]] = {}
    for row in read_rows(WIND_DATA / KERNELS):
        if (row["month"], row["component"]) == (period, wanted):
            altitude, value = knots.setdefault(row["quantity"], ([], []))
            altitude.append(float(row["altitude [m]"]))
            value.append(float(row["value"]))
    profiles = ((np.array(knots[q][0]), np.array(knots[q][1])) for q in ("long_scale", "short_scale", "short_fraction"))
    return TwoPartKernel(
        *profiles,
        source="fitted to Cape Canaveral soundings 2008-2022; assumed below 1.5 km and above 10.7 km",
        short_smoothness=0.5 if third_order else 0.7,
    )


def shipped_statistics(
    period: str = "march",
    component: str = "zonal",
    *,
    edition: str = "1983",
    top: float = 16000.0,
    spacing: float = 1000.0,
    third_order: bool = False,
) -> WindStatistics:
    """Return the statistics of a month (or 'annual') and component.

    Parameters
    ----------
    top, spacing : float
        Highest level and least distance of levels, m; the edition of 2006 has levels every 250 m.
    third_order : bool
        March zonal only: with the correlation of the closed-form filter.

    Raises
    ------
    UnknownNameError
    DataError
        A highest level above the table's.
    """
    kernel = interlevel_kernel(period, component, third_order)
    table = range_reference(period, edition)
    if not table.altitude[0] < top <= table.altitude[-1]:
        raise DataError(
            f"the levels of edition {edition} go from {table.altitude[0]:g} to {table.altitude[-1]:g} m; {top:g} m is "
            "not among them, choose another top"
        )
    keep = [0]
    for i, h in enumerate(table.altitude):
        # the first level is the surface at 3 m: the next ones count from round numbers
        if i and h <= top and (h % spacing == 0):
            keep.append(i)
    h = table.altitude[keep]
    return WindStatistics(
        f"{period} {component}",
        h,
        table.mean[component][keep],
        table.standard_deviation[component][keep],
        kernel.correlation(h),
        REPORT_SAMPLES,
        f"Range Reference Atmosphere, {SITE}, edition {edition}; correlation {kernel.source}",
        WindOrigin(SITE, component, period, edition),
    )


def shipped_two_components(
    period: str = "march", *, edition: str = "1983", top: float = 16000.0, spacing: float = 1000.0
) -> TwoComponentStatistics:
    """Return both components of a month with their correlation at equal levels."""
    zonal, meridional = (shipped_statistics(period, c, edition=edition, top=top, spacing=spacing) for c in COMPONENTS)
    table = range_reference(period, edition)
    r = table.intralevel_correlation[np.isin(table.altitude, zonal.altitude)]
    return TwoComponentStatistics(zonal, meridional, r)
