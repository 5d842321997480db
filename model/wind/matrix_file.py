"""Wind statistics as a table of one's own: mean and covariance matrix of one component or of both."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import DataError
from ..files.csv_table import read_csv_table
from .correlation_matrix import RepairWarning, nearest_correlation_matrix
from .record import COMPONENTS, WindOrigin
from .statistics import TwoComponentStatistics, WindStatistics, statistics_from_covariance

SYMMETRIC = 1e-6  # of the largest entry, by rounding in the file
MOVED = 1e-9  # of a correlation


def read_matrix(
    file: Path, site: str, period: str, independent_samples: float, repair: bool = False
) -> dict[str, WindStatistics] | TwoComponentStatistics:
    """Read mean and covariance over altitude.

    Parameters
    ----------
    file : Path
        CSV: ``altitude [m]``, ``component`` (zonal or meridional), ``mean [m/s]``, then a column of covariances for
        each row, ``covariance_1 [m2/s2]`` and on, in the order of the rows: zonal levels, then meridional ones, or one
        of the two.
    site, period : str
        Of the record.
    independent_samples : float
        Soundings behind the matrix.
    repair : bool
        Take the nearest valid correlations where no wind has those of the matrix; a RepairWarning says what moved.

    Returns
    -------
    dict of str to WindStatistics, or TwoComponentStatistics
        By component, where the file holds one; of both.

    Raises
    ------
    DataError
        Rows and columns that do not fit together, components apart, a matrix that no wind has.
    """
    table = read_csv_table(file, "altitude", "m", order="any", text=("component",))
    names = table.text["component"]
    for name, line in zip(names, table.lines, strict=True):
        if name not in COMPONENTS:
            raise DataError(f"'{name}' is no component; write {' or '.join(COMPONENTS)}", file=file, row=line)
    count = len(names)
    columns = [f"covariance_{k + 1}" for k in range(count)]
    known = {"altitude", "component", "mean", *columns}
    extra = [name for name in table.columns if name not in known]
    if extra:
        raise DataError(f"column '{extra[0]}' has no place: {count} rows have as many covariances", file=file)
    matrix = np.stack([table.column(name, "m2/s2") for name in columns], axis=1)
    if np.abs(matrix - matrix.T).max() > SYMMETRIC * np.abs(matrix).max():
        i, j = np.unravel_index(int(np.argmax(np.abs(matrix - matrix.T))), matrix.shape)
        raise DataError(
            f"the matrix is not symmetric: {columns[j]} is {matrix[i, j]:g} here, and its mirror {matrix[j, i]:g}",
            file=file, row=table.lines[int(i)],
        )  # fmt: skip
    matrix = 0.5 * (matrix + matrix.T)
    altitude, mean = table.columns["altitude"], table.column("mean", "m/s")
    rows = {name: np.flatnonzero(np.array(names) == name) for name in COMPONENTS if name in names}
    source = f"covariance matrix of {file.name}"
    if len(rows) == 1:
        ((name, _),) = rows.items()
        made = statistics_from_covariance(
            f"{period} {name}", altitude, mean, matrix, independent_samples, source, repair
        )
        return {name: replace(made, origin=WindOrigin(site, name, period, file.name))}
    u, v = (rows[name] for name in COMPONENTS)
    if not np.array_equal(np.concatenate([u, v]), np.arange(count)) or not np.array_equal(altitude[u], altitude[v]):
        raise DataError("zonal rows come first, then meridional ones, at the same altitudes; sort the rows", file=file)
    variance = np.diagonal(matrix)
    if not (variance > 0).all():
        raise DataError(
            "a variance on the diagonal is not positive", file=file, row=table.lines[int(np.argmin(variance > 0))]
        )
    sigma = np.sqrt(variance)
    whole = matrix / np.outer(sigma, sigma)
    np.fill_diagonal(whole, 1.0)
    if repair:
        repaired = nearest_correlation_matrix(whole)
        if repaired.largest_change > MOVED:
            warnings.warn(RepairWarning(f"{source}: {repaired}"), stacklevel=2)
            whole, source = repaired.matrix, f"{source}; {repaired}"
    parts = [
        WindStatistics(
            f"{period} {name}", altitude[u], mean[at], sigma[at], whole[np.ix_(at, at)],
            independent_samples, source, WindOrigin(site, name, period, file.name),
        )
        for name, at in rows.items()
    ]  # fmt: skip
    cross = whole[np.ix_(u, v)]
    return TwoComponentStatistics(parts[0], parts[1], np.diag(cross).copy(), cross)
