"""Mean, standard deviation and correlation of the wind over altitude, and the report's fit of the second."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from ..tables import Table
from .correlation_matrix import RepairWarning, check_correlation, nearest_correlation_matrix
from .record import WindOrigin, WindRecord
from .shaping_filter import ShapingFilter, TwoPartKernel

FILTER_SPACING = 250.0  # m, of the samples on which a closed-form filter is tabulated
REPORT_SAMPLES = 80  # independent soundings behind the report's March statistics, section 3.2

# No climatology of the lowest 40 km comes near these; knots, feet a second or feet read as SI do.
LARGEST_MEAN, LARGEST_DEVIATION, SMALLEST_RANGE = 100.0, 26.0, 100.0
LOWEST_ALTITUDE, LARGEST_ALTITUDE = -500.0, 40e3


def report_standard_deviation(altitude: ArrayLike) -> NDArray[np.float64]:
    """Return the report's fit of the March standard deviation (m/s), Appendix A, figure A1.

    sigma(h) = B1 + B2 exp(B3 (h - B4)^2) + B5 (h/22)^B6 (1 - h/22)^B7, h in km, valid from 0 to 16 km and held
    above. B3 is printed positive; only the negative sign meets the data (docs/equations.md).
    """
    h = np.clip(np.asarray(altitude, float) / 1000.0, 0.0, 16.0)
    s = h / 22.0
    return 6.64392 + 3.63807 * np.exp(-0.157801 * (h - 11.379) ** 2) + 121.02 * s**2.11731 * (1 - s) ** 2.36174


@dataclass(frozen=True, eq=False)
class WindModel:
    """One wind: the mean over altitude and the filter for its variations, of the same statistics.

    Parameters
    ----------
    mean : Table
        m/s over m.
    shaping_filter : ShapingFilter
    standard_deviation : Table, optional
        m/s over m; what the filter's own is compared with.
    record : WindRecord, optional
        Of which statistics the three are, and how they are taken across the flight.

    Raises
    ------
    DataError
        A filter of other statistics than the record's.
    """

    mean: Table
    shaping_filter: ShapingFilter
    standard_deviation: Table | None = None
    record: WindRecord | None = None

    @property
    def means(self) -> tuple[Table, ...]:
        """The mean alone, as a wind of two components has two."""
        return (self.mean,)

    def __post_init__(self):
        made_for = self.shaping_filter.origin
        if self.record is not None and made_for is not None and made_for != self.record.origin:
            raise DataError(
                f"the filter was fitted to {made_for}, but mean and standard deviation are recorded as those of "
                f"{self.record.origin}; 'ascentwind wind apply' writes filter, mean and record of one wind"
            )


def closed_form_filter(kernel: TwoPartKernel, standard_deviation: Table, top: float | None = None) -> ShapingFilter:
    """Return the exact filter of a kernel for a tabulated standard deviation (m/s over m)."""
    knots = standard_deviation.argument
    low, high = float(knots[0]), float(top if top is not None else knots[-1])
    samples = np.arange(np.ceil(low / FILTER_SPACING), np.floor(high / FILTER_SPACING) + 1) * FILTER_SPACING
    corners = [x for x in (*kernel.kinks, *knots) if low < x < high]
    altitude = np.unique(np.concatenate([[low], samples, corners, [high]]))
    keep = np.concatenate([[True], np.diff(altitude) > 1e-6])
    altitude = altitude[keep]
    sigma = standard_deviation.polynomial(np.clip(altitude, knots[0], knots[-1]))
    return kernel.shaping_filter(altitude, sigma, kinks=[x for x in knots if low < x < high])


@dataclass(frozen=True, eq=False, repr=False)
class WindStatistics:
    """What is known about one component of the wind at a set of altitudes.

    Parameters
    ----------
    name : str
        Such as 'march zonal'.
    altitude : (k,) array
        Increasing, m above mean sea level.
    mean, standard_deviation : (k,) arrays
        m/s.
    correlation : (k, k) array
        Between altitudes.
    independent_samples : float
        Soundings behind the numbers, reduced for their correlation from day to day.
    source : str
    origin : WindOrigin, optional

    Raises
    ------
    DataError
        Shapes that disagree, values that no wind has (knots or feet read as SI), an invalid correlation.
    """

    name: str
    altitude: NDArray[np.float64]
    mean: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]
    correlation: NDArray[np.float64]
    independent_samples: float = REPORT_SAMPLES
    source: str = ""
    origin: WindOrigin | None = None

    def __repr__(self) -> str:
        span = f"{self.altitude[0]:g} to {self.altitude[-1]:g} m"
        return f"WindStatistics '{self.name}': {self.altitude.size} altitudes, {span}"

    def __post_init__(self):
        for label in ("altitude", "mean", "standard_deviation", "correlation"):
            object.__setattr__(self, label, np.asarray(getattr(self, label), float))
        h, k = self.altitude, self.altitude.size
        if h.ndim != 1 or k < 2:
            raise DataError(f"wind statistics '{self.name}' need at least two altitudes")
        for label in ("mean", "standard_deviation"):
            values = getattr(self, label)
            if values.shape != (k,):
                raise DataError(f"wind statistics '{self.name}': {label} has shape {values.shape} for {k} altitudes")
            if not np.isfinite(values).all():
                i = int(np.argmin(np.isfinite(values)))
                raise DataError(
                    f"wind statistics '{self.name}': {label} at {h[i]:g} m is missing; fill or drop the level"
                )
        if not np.isfinite(h).all() or not (np.diff(h) > 0).all():
            raise DataError(f"wind statistics '{self.name}': altitudes must be finite and increase")
        check_plausible(f"wind statistics '{self.name}'", h, self.mean, self.standard_deviation)
        if self.correlation.shape != (k, k):
            raise DataError(f"wind statistics '{self.name}': correlation {self.correlation.shape} for {k} altitudes")
        check_correlation(self.correlation, f"the correlation of wind statistics '{self.name}'")
        if not self.independent_samples > 2:
            raise DataError(f"wind statistics '{self.name}' need more than two independent samples")

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance between altitudes, m2/s2, (k, k)."""
        return self.correlation * np.outer(self.standard_deviation, self.standard_deviation)

    def between(self, low: float, high: float) -> WindStatistics:
        """Return the levels from ``low`` to ``high`` (m), both included.

        Raises
        ------
        DataError
            If fewer than two levels remain.
        """
        i = np.flatnonzero((self.altitude >= low) & (self.altitude <= high))
        if i.size < 2:
            raise DataError(
                f"wind statistics '{self.name}' hold {i.size} levels between {low:g} and {high:g} m; they cover "
                f"{self.altitude[0]:g} to {self.altitude[-1]:g} m"
            )
        return replace(
            self,
            altitude=self.altitude[i],
            mean=self.mean[i],
            standard_deviation=self.standard_deviation[i],
            correlation=self.correlation[np.ix_(i, i)],
        )

    def mean_table(self) -> Table:
        """Return the mean over altitude, monotone cubic between the levels."""
        return Table("wind.mean", "m/s", self.altitude, self.mean, "pchip")

    def standard_deviation_table(self) -> Table:
        """Return the standard deviation over altitude, monotone cubic between the levels."""
        return Table("wind.standard_deviation", "m/s", self.altitude, self.standard_deviation, "pchip")


def statistics_from_covariance(
    name: str,
    altitude: ArrayLike,
    mean: ArrayLike,
    covariance: ArrayLike,
    independent_samples: float = REPORT_SAMPLES,
    source: str = "given as a matrix",
    repair: bool = False,
) -> WindStatistics:
    """Return statistics from a covariance matrix of one's own.

    Parameters
    ----------
    altitude : (k,) array
        m.
    mean : (k,) array
        m/s.
    covariance : (k, k) array
        m2/s2.
    repair : bool
        Replace correlations that no wind can have by the nearest valid ones; a RepairWarning says what changed.

    Raises
    ------
    NotPositiveSemidefiniteError
        Without ``repair``, if the matrix has a negative eigenvalue.
    """
    matrix = np.asarray(covariance, float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise DataError(f"the covariance of '{name}' has shape {matrix.shape}; give a square matrix")
    variance = np.diag(matrix)
    if not np.isfinite(matrix).all() or (variance <= 0).any():
        i = int(np.argmax(~np.isfinite(matrix).all(axis=1) | ~(variance > 0)))
        raise DataError(
            f"the covariance of '{name}' has a variance or entry in row {i} that is not finite and positive"
        )
    sigma = np.sqrt(variance)
    correlation = matrix / np.outer(sigma, sigma)
    np.fill_diagonal(correlation, 1.0)
    if repair:
        repaired = nearest_correlation_matrix(correlation)
        if repaired.largest_change > 1e-9:
            warnings.warn(RepairWarning(f"wind statistics '{name}': {repaired}"), stacklevel=2)
            correlation, source = repaired.matrix, f"{source}; {repaired}"
    return WindStatistics(
        name, np.asarray(altitude, float), np.asarray(mean, float), sigma, correlation, independent_samples, source
    )


@dataclass(frozen=True, eq=False)
class TwoComponentStatistics:
    """Zonal (towards the east) and meridional (towards the north) wind and their correlation.

    Parameters
    ----------
    zonal, meridional : WindStatistics
        At the same altitudes.
    intralevel_correlation : (k,) array
        Of u and v at the same altitude.
    cross_correlation : (k, k) array, optional
        Of u at the altitude of the row with v at that of the column, where it is known.
    """

    zonal: WindStatistics
    meridional: WindStatistics
    intralevel_correlation: NDArray[np.float64]
    cross_correlation: NDArray[np.float64] | None = None

    def __post_init__(self):
        h, r = self.zonal.altitude, np.asarray(self.intralevel_correlation, float)
        if not np.array_equal(h, self.meridional.altitude) or r.shape != h.shape:
            raise DataError("zonal and meridional wind and their correlation must be given at the same altitudes")
        if not (np.abs(r) <= 1).all():
            raise DataError("a correlation of zonal and meridional wind is not between -1 and 1")
        if self.cross_correlation is not None:
            x = self.cross_correlation
            if x.shape != (h.size, h.size) or not np.allclose(np.diag(x), r, atol=1e-6):
                raise DataError("the cross correlation must be square with the intralevel correlation on its diagonal")
            check_correlation(
                np.block([[self.zonal.correlation, x], [x.T, self.meridional.correlation]]),
                "the joint correlation of zonal and meridional wind",
            )


def check_plausible(where: str, altitude: NDArray, mean: NDArray, deviation: NDArray) -> None:
    """Refuse altitudes (m), means and standard deviations (m/s) that no wind has; ``where`` begins the sentence.

    Raises
    ------
    DataError
    """
    if altitude[0] < LOWEST_ALTITUDE or altitude[-1] > LARGEST_ALTITUDE:
        raise DataError(
            f"{where} run from {altitude[0]:g} to {altitude[-1]:g} m; are these feet? Convert them to metres"
        )
    if altitude[-1] - altitude[0] < SMALLEST_RANGE:
        raise DataError(
            f"{where} span only {altitude[-1] - altitude[0]:g} m; are these kilometres? Convert them to metres"
        )
    if (deviation <= 0).any():
        i = int(np.argmin(deviation))
        raise DataError(
            f"{where}: the standard deviation at {altitude[i]:g} m is {deviation[i]:g}; it must be positive"
        )
    for label, values, limit in (
        ("mean", np.abs(mean), LARGEST_MEAN),
        ("standard deviation", deviation, LARGEST_DEVIATION),
    ):
        if (values > limit).any():
            i = int(np.argmax(values))
            raise DataError(
                f"{where}: a {label} of {values[i]:g} m/s at {altitude[i]:g} m is more than any wind has; "
                "are these knots or feet a second? Convert them to m/s"
            )
