"""Statistics as a matrix of one's own: one component, both, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from ascentwind.model.errors import DataError
from ascentwind.model.wind.correlation_matrix import NotPositiveSemidefiniteError, RepairWarning
from ascentwind.model.wind.matrix_file import read_matrix
from ascentwind.model.wind.record import WindOrigin
from ascentwind.model.wind.statistics import TwoComponentStatistics

H = np.array([0.0, 1000.0, 3000.0])
SIGMA = np.array([4.0, 6.0, 8.0, 3.0, 5.0, 7.0])
MEAN = np.array([1.0, 5.0, 9.0, 0.0, -1.0, 2.0])


def correlation() -> np.ndarray:
    one = np.array([[1, 0.8, 0.5], [0.8, 1, 0.7], [0.5, 0.7, 1]])
    return np.block([[one, 0.2 * one], [0.2 * one, one]])


def text(matrix: np.ndarray, names: list[str], mean: np.ndarray, altitude: np.ndarray) -> str:
    head = ["altitude [m]", "component", "mean [m/s]", *(f"covariance_{k + 1} [m2/s2]" for k in range(len(matrix)))]
    rows = [
        ",".join([f"{h:g}", name, f"{m:g}", *(repr(float(x)) for x in row)])
        for h, name, m, row in zip(altitude, names, mean, matrix, strict=True)
    ]
    return "\n".join([",".join(head), *rows]) + "\n"


def write(file, matrix=None, names=None):
    full = correlation() * np.outer(SIGMA, SIGMA) if matrix is None else matrix
    names = ["zonal"] * 3 + ["meridional"] * 3 if names is None else names
    k = len(full)
    file.write_text(text(full, names[:k], MEAN[:k], np.tile(H, 2)[:k]))
    return file


def test_one_component(tmp_path):
    made = read_matrix(
        write(tmp_path / "m.csv", np.outer(SIGMA[:3], SIGMA[:3]) * correlation()[:3, :3]), "Here", "may", 60.0
    )
    assert isinstance(made, dict)
    (zonal,) = made.values()
    np.testing.assert_allclose(zonal.standard_deviation, SIGMA[:3])
    np.testing.assert_allclose(zonal.correlation, correlation()[:3, :3])
    np.testing.assert_allclose(zonal.mean, MEAN[:3])
    assert zonal.origin == WindOrigin("Here", "zonal", "may", "m.csv")
    assert zonal.independent_samples == 60


def test_both_components(tmp_path):
    both = read_matrix(write(tmp_path / "m.csv"), "Here", "may", 60.0)
    assert isinstance(both, TwoComponentStatistics) and both.cross_correlation is not None
    np.testing.assert_allclose(both.cross_correlation, correlation()[:3, 3:], atol=1e-12)
    np.testing.assert_allclose(both.meridional.standard_deviation, SIGMA[3:])
    assert both.meridional.origin == WindOrigin("Here", "meridional", "may", "m.csv")


def test_an_impossible_matrix_is_refused_or_repaired(tmp_path):
    bad = correlation()
    bad[0, 5] = bad[5, 0] = -0.95
    file = write(tmp_path / "m.csv", bad * np.outer(SIGMA, SIGMA))
    with pytest.raises(NotPositiveSemidefiniteError, match="no wind has it"):
        read_matrix(file, "Here", "may", 60.0)
    with pytest.warns(RepairWarning, match="covariance matrix of m.csv"):
        both = read_matrix(file, "Here", "may", 60.0, repair=True)
    assert isinstance(both, TwoComponentStatistics)
    assert "nearest correlation matrix" in both.zonal.source


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("zonal", "up", "line 2: 'up' is no component; write zonal or meridional"),
        ("covariance_6", "covariance_7", "column 'covariance_7' has no place: 6 rows have as many covariances"),
        ("[m2/s2]", "[kt2]", r"unit is \[kt2\], expected \[m2/s2\]"),
        (",19.2", ",11.0", "line [23].*the matrix is not symmetric"),
        ("0,meridional", "5,meridional", "zonal rows come first, then meridional ones, at the same altitudes"),
        (",16.0,", ",-16.0,", "a variance on the diagonal is not positive"),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path, old, new, says):
    file = write(tmp_path / "m.csv")
    content = file.read_text()
    assert old in content, content
    file.write_text(content.replace(old, new, 1))
    with pytest.raises(DataError, match=says):
        read_matrix(file, "Here", "may", 60.0)
