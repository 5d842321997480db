"""The wind of a month at a site, both components with their filters; twelve of Cape Canaveral ship with the package."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, UnknownNameError
from ..files.text_file import read_text
from ..tables import Table
from .range_reference import MONTHS, WIND_DATA
from .record import COMPONENTS, WindOrigin
from .shaping_filter import ShapingFilter
from .turbulence import add_filters

FORMAT = 1
DIGITS = 8
FOLDER = WIND_DATA / "months"
EDITION = "1983"
FILTER = ("altitude_m", "F_per_m", "G_per_root_m", "H_m_per_s", "start_covariance", "kinks_m")


@dataclass(frozen=True, eq=False)
class MonthWind:
    """Zonal and meridional wind of one month.

    Parameters
    ----------
    period, site, edition : str
        Edition of the Range Reference Atmosphere, or the soundings.
    zonal, meridional : ShapingFilter
    noise_correlation : Table
        Of their first noises over altitude, m.
    start_correlation : float
        Of the two winds at the lowest altitude.
    altitude : (k,) array
        Of the statistics, m.
    mean : (2, k) array
        Towards the east and the north, m/s.
    independent_samples : float
        Soundings behind them.
    source : str
    """

    period: str
    site: str
    edition: str
    zonal: ShapingFilter
    meridional: ShapingFilter
    noise_correlation: Table
    start_correlation: float
    altitude: NDArray[np.float64]
    mean: NDArray[np.float64]
    independent_samples: float
    source: str

    def mean_along(self, weights: tuple[float, float], levels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean of w_u u + w_v v at levels (m), held beyond the statistics, m/s."""
        at = np.clip(levels, self.altitude[0], self.altitude[-1])
        parts = [Table("wind.mean", "m/s", self.altitude, row, "pchip").polynomial(at) for row in self.mean]
        return weights[0] * parts[0] + weights[1] * parts[1]

    def filter_along(self, weights: tuple[float, float]) -> ShapingFilter:
        """Return the filter of w_u u + w_v v."""
        scaled = [replace(f, H=w * f.H) for f, w in zip((self.zonal, self.meridional), weights, strict=True)]
        if not weights[0]:
            return scaled[1]
        if not weights[1]:
            return scaled[0]
        start = self.start_correlation * float(np.sign(weights[0] * weights[1]))
        return add_filters(scaled[0], scaled[1], self.noise_correlation, start)

    @cached_property
    def joint(self) -> ShapingFilter:
        """The states and noises of both components in one filter, the zonal ones first."""
        return add_filters(self.zonal, self.meridional, self.noise_correlation, self.start_correlation)

    def text(self) -> str:
        """Return it as JSON, with eight digits."""
        r = self.noise_correlation
        parts: dict[str, Any] = {
            "format": FORMAT,
            "period": self.period,
            "site": self.site,
            "edition": self.edition,
            "source": self.source,
            "independent_samples": float(self.independent_samples),
            "statistics": {"altitude_m": _short(self.altitude), "mean_m_per_s": _short(self.mean)},
            "noise_correlation": {"altitude_m": _short(r.argument), "value": _short(r.values)},
            "start_correlation": float(f"{self.start_correlation:.{DIGITS}g}"),
        }
        for name, f in zip(COMPONENTS, (self.zonal, self.meridional), strict=True):
            arrays = (f.altitude, f.F, f.G, f.H, f.start_covariance, np.array(f.kinks))
            parts[name] = {"name": f.name} | {key: _short(a) for key, a in zip(FILTER, arrays, strict=True)}
        return json.dumps(parts, separators=(",", ":")).replace('},"', '},\n"') + "\n"


def read_month(file: Path) -> MonthWind:
    """Read the wind of a month.

    Raises
    ------
    DataError
    """
    try:
        data = json.loads(read_text(file))
        if data["format"] != FORMAT:
            raise DataError(f"has format {data['format']!r}; this version reads {FORMAT}", file=file)
        period, site, edition, source = (str(data[key]) for key in ("period", "site", "edition", "source"))
        filters = []
        for name in COMPONENTS:
            part = data[name]
            altitude, F, G, H, start, kinks = (np.array(part[key], float) for key in FILTER)
            origin = WindOrigin(site, name, period, edition)
            filters.append(
                ShapingFilter(str(part["name"]), altitude, F, G, H, start, tuple(kinks.tolist()), source, origin)
            )
        joined, statistics = data["noise_correlation"], data["statistics"]
        correlation = Table(
            "wind.noise_correlation", "1", np.array(joined["altitude_m"], float), np.array(joined["value"], float),
            "linear",
        )  # fmt: skip
        levels, mean = (np.array(statistics[key], float) for key in ("altitude_m", "mean_m_per_s"))
        if mean.shape != (2, levels.size):
            raise ValueError(f"the mean has shape {mean.shape} at {levels.size} altitudes")
        return MonthWind(
            period, site, edition, filters[0], filters[1], correlation, float(data["start_correlation"]), levels, mean,
            float(data["independent_samples"]), source,
        )  # fmt: skip
    except KeyError as error:
        raise DataError(f"lacks {error}; write months with 'ascentwind wind months'", file=file) from None
    except (ValueError, TypeError, AttributeError, IndexError) as error:
        raise DataError(f"is not the wind of a month: {error}", file=file) from None


def month_file(period: str) -> str:
    """Return the name of a month's file."""
    return f"{period}.json"


def read_months(folder: Path | None, months: list[str] | None = None) -> list[MonthWind]:
    """Return the winds of months, of Cape Canaveral or of a folder.

    Parameters
    ----------
    folder : path or None
        As 'ascentwind wind months' writes it; those shipped without it.
    months : list of str, optional
        All that are there without it.

    Raises
    ------
    DataError, UnknownNameError
        A month that is none, or not there.
    """
    where = FOLDER if folder is None else folder
    for month in months or ():
        if month not in MONTHS:
            raise UnknownNameError("month", month, MONTHS)
    there = [month for month in MONTHS if (where / month_file(month)).is_file()]
    if not there:
        raise DataError("holds no month, such as march.json; write them with 'ascentwind wind months'", file=where)
    missing = [month for month in months or () if month not in there]
    if missing:
        raise DataError(f"holds no {missing[0]}; it has {', '.join(there)}", file=where)
    found = [read_month(where / month_file(month)) for month in MONTHS if month in (months or there)]
    sites = {month.site for month in found}
    if len(sites) > 1:
        raise DataError(
            f"holds months of {' and '.join(sorted(sites))}; keep each site in a folder of its own", file=where
        )
    return found


def _short(values: Any) -> Any:
    """Return numbers as nested lists, with eight digits."""
    if isinstance(values, np.ndarray):
        values = values.tolist()
    return [_short(x) for x in values] if isinstance(values, list) else float(f"{values:.{DIGITS}g}")
