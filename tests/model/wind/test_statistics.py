"""Wind statistics: shipped tables, soundings, matrices of one's own, and what they refuse."""

from pathlib import Path

import numpy as np
import pytest

from ascentwind.model.errors import DataError, UnknownNameError
from ascentwind.model.tables import Table
from ascentwind.model.wind.correlation_matrix import (
    NotPositiveSemidefiniteError,
    RepairWarning,
    nearest_correlation_matrix,
)
from ascentwind.model.wind.range_reference import PERIODS, interlevel_kernel, range_reference, shipped_statistics
from ascentwind.model.wind.record import COMPONENTS
from ascentwind.model.wind.soundings.collection import independent_samples, successive_correlation
from ascentwind.model.wind.soundings.read import read_soundings
from ascentwind.model.wind.statistics import WindStatistics, report_standard_deviation, statistics_from_covariance
from ascentwind.runners.wind.correlation_fit import kernel_correlations, measured_pairs, reconstructed_kernel
from ascentwind.runners.wind.fitting.analytic_fits import fit_covariance, fit_deviation

H = np.array([0.0, 1000.0, 2000.0, 4000.0])
SD = np.array([3.0, 6.0, 7.0, 9.0])
R = np.exp(-np.abs(H[:, None] - H) / 5000.0)
SHARED = Path(__file__).parents[4] / "shared" / "data" / "wind"


def statistics(**changes) -> WindStatistics:
    given = {"name": "mine", "altitude": H, "mean": 2 * SD, "standard_deviation": SD, "correlation": R}
    return WindStatistics(**(given | changes))


def test_march_has_the_numbers_of_the_range_reference_atmosphere():
    march = shipped_statistics()
    assert march.altitude.size == 17
    # RCC 361-83, March: 11 km
    i = int(np.flatnonzero(march.altitude == 11000.0)[0])
    assert (march.mean[i], march.standard_deviation[i]) == (38.88, 14.77)
    # measured over 3.14 and 5.83 km in March 2008-2022: 0.817, the four levels within 0.016
    kernel = interlevel_kernel("march", "zonal")
    assert kernel.correlation([3140.0, 5830.0])[0, 1] == pytest.approx(0.817, abs=0.016)


@pytest.mark.parametrize("edition", ["1983", "2006"])
def test_every_month_and_component_is_a_valid_statistic(edition):
    for period in PERIODS:
        for component in COMPONENTS:
            s = shipped_statistics(period, component, edition=edition)
            assert np.linalg.eigvalsh(s.correlation).min() > 1e-3
            assert np.allclose(np.diag(s.covariance), s.standard_deviation**2)


def test_shipped_kernels_are_what_the_fit_gives_and_meet_the_level_pairs():
    for period, component in (("july", "zonal"), ("annual", "meridional")):
        fitted, shipped = reconstructed_kernel(period, component), interlevel_kernel(period, component)
        h = np.linspace(0.0, 16000.0, 9)
        assert np.abs(fitted.correlation(h) - shipped.correlation(h)).max() < 1e-3
        table = range_reference(period)
        deviation = Table("sigma", "m/s", table.altitude, table.standard_deviation[component], "pchip")
        pairs = [p for p in measured_pairs(period, component) if not p.first.startswith("L")]
        error = kernel_correlations(shipped, pairs, deviation) - [p.correlation for p in pairs]
        # twice the sampling error of about 0.03
        assert np.abs(error).max() < 0.06


def test_appendix_a_gives_its_coefficients_back():
    h = np.arange(0.0, 16001.0, 1000.0)
    found = fit_deviation(h, report_standard_deviation(h))
    assert found == pytest.approx([6.64392, 3.63807, -0.157801, 11.379, 121.02, 2.11731, 2.36174], rel=1e-4)


def test_analytic_derivatives_against_differences():
    fitted = fit_covariance(shipped_statistics().between(1000, 16000))
    assert fitted.rms < 0.05
    for level in (3, 12):
        x = np.array([6.3, 9.1])
        _, slope, bend, _ = fitted.derivatives(level, x)
        d = 1e-4
        up, down = fitted.derivatives(level, x + d), fitted.derivatives(level, x - d)
        assert slope == pytest.approx((up[0] - down[0]) / (2 * d), rel=1e-5)
        assert bend == pytest.approx((up[1] - down[1]) / (2 * d), rel=1e-5, abs=1e-4)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"standard_deviation": SD * 1.944 * 2}, "knots"),
        ({"mean": SD * 30}, "knots"),
        ({"altitude": H / 1000}, "kilometres"),
        ({"altitude": H * 3.2808 * 10}, "feet"),
        ({"mean": np.array([1.0, np.nan, 2.0, 3.0])}, "missing"),
        ({"altitude": H[::-1]}, "increase"),
        ({"standard_deviation": SD[:3]}, "shape"),
        ({"standard_deviation": SD * [1, 0, 1, 1]}, "positive"),
        ({"correlation": R + np.triu(R, 1) * 0.1}, "symmetric"),
        ({"correlation": R * 0.9}, "diagonal"),
        ({"independent_samples": 1.0}, "independent samples"),
    ],
)
def test_bad_statistics_are_refused(changes, says):
    with pytest.raises(DataError, match=says):
        statistics(**changes)


def test_impossible_correlations_are_refused_and_repaired_on_request():
    bad = np.array([[1, 0.9, -0.9, 0], [0.9, 1, 0.9, 0], [-0.9, 0.9, 1, 0], [0, 0, 0, 1.0]])
    covariance = bad * np.outer(SD, SD)
    with pytest.raises(NotPositiveSemidefiniteError, match="repair=True"):
        statistics_from_covariance("mine", H, SD, covariance)
    with pytest.warns(RepairWarning, match="moved"):
        repaired = statistics_from_covariance("mine", H, SD, covariance, repair=True)
    assert np.linalg.eigvalsh(repaired.correlation).min() > -1e-12
    assert "nearest correlation matrix" in repaired.source
    with pytest.raises(UnknownNameError, match="march"):
        shipped_statistics("marc")


def test_nearest_correlation_matrix_of_higham():
    # Higham 2002, section 4: the nearest correlation matrix to tridiag(1 1) of order 3 has 0.7607 and 0.1573
    repair = nearest_correlation_matrix([[1, 1, 0], [1, 1, 1], [0, 1, 1]])
    assert repair.matrix[0, 1] == pytest.approx(0.7607, abs=1e-4)
    assert repair.matrix[0, 2] == pytest.approx(0.1573, abs=1e-4)


def write_profiles(file: Path, count: int, drop: int = -1, levels=(100, 1000, 3000)) -> Path:
    random = np.random.default_rng(1)
    lines = ["profile,date,altitude [m],u [m/s],v [m/s]"]
    state = random.standard_normal((2, len(levels)))
    for i in range(count):
        state = 0.6 * state + 0.8 * random.standard_normal(state.shape)
        for j, h in enumerate(levels):
            if not (i == drop and j == 1):
                day = np.datetime64("2020-01-01") + np.timedelta64(i, "D")
                lines.append(f"p{i},{day},{h},{5 + 3 * state[0, j]:.4f},{2 * state[1, j]:.4f}")
    file.write_text("\n".join(lines) + "\n")
    return file


def test_soundings_give_their_statistics_and_independent_samples(tmp_path):
    soundings = read_soundings(write_profiles(tmp_path / "s.csv", 4000))
    both = soundings.statistics("mine")
    assert both.zonal.mean == pytest.approx([5, 5, 5], abs=0.3)
    assert both.zonal.standard_deviation == pytest.approx([3, 3, 3], rel=0.05)
    assert both.cross_correlation is not None
    assert np.abs(both.cross_correlation).max() < 0.1
    assert successive_correlation(soundings.u, soundings.day) == pytest.approx([0.6] * 3, abs=0.05)
    # first-order process of 0.6: (1 - .36) / (1 + .36) of the profiles
    assert both.zonal.independent_samples == pytest.approx(4000 * 0.64 / 1.36, rel=0.1)


def test_variance_of_a_persistent_process_is_as_uncertain_as_said():
    random, r, n = np.random.default_rng(2), 0.7, 200
    x = np.empty((3000, n))
    x[:, 0] = random.standard_normal(3000)
    for i in range(1, n):
        x[:, i] = r * x[:, i - 1] + np.sqrt(1 - r * r) * random.standard_normal(3000)
    spread = np.var(np.mean(x**2, axis=1))
    effective = n * (1 - r**2) / (1 + r**2)
    assert spread == pytest.approx(2 / effective, rel=0.1)
    assert independent_samples(x[0][:, None], np.arange(float(n))) == pytest.approx(effective, rel=0.5)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("u [m/s]", "u [mph]", r"'u' has the unit \[mph\], and units that are known make it 'u \[m/s\]', 'u \[kt\]'"),
        ("p3,2020-01-04,100,", "p3,2020-01-04,100,x", "not a finite number"),
        ("p3,2020-01-04", "p3,04/01/2020", "not a date"),
        ("p3,2020-01-04", '"p3,2020-01-04', "a line is a row of cells"),
        ("p3,2020-01-04", "p" * 200_000 + ",2020-01-04", "a line is a row of cells"),
        ("p3,2020-01-04", "p3\0,2020-01-04", "not UTF-8"),
        ("p3,2020-01-04,100,", "p2,2020-01-04,100,", "twice"),
        ("p19,2020-01-20,100", "p1,2020-01-20,100", "goes on"),
    ],
)
def test_bad_soundings_are_refused(tmp_path, old, new, says):
    file = write_profiles(tmp_path / "s.csv", 20)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(DataError, match=says):
        read_soundings(file)


def test_missing_levels_are_refused_or_left_out(tmp_path):
    file = write_profiles(tmp_path / "s.csv", 20, drop=7)
    with pytest.raises(DataError, match="p7.*1000 m"):
        read_soundings(file, incomplete="refuse")
    assert len(read_soundings(file, incomplete="drop").quality.dropped) == 1
    with pytest.raises(DataError, match="at least"):
        read_soundings(write_profiles(tmp_path / "few.csv", 4)).statistics("few")


def test_real_soundings(tmp_path):
    """KXMR, March: correlations and means as computed independently in level_statistics_2008_2022.csv."""
    source = SHARED / "kxmr_soundings_2008_2022.csv"
    if not source.is_file():
        pytest.skip("the soundings have no licence and are not kept in the project")
    import csv

    lines = ["profile,date,altitude [m],u [m/s],v [m/s]"]
    with source.open(encoding="utf-8-sig") as stream:
        for i, row in enumerate(csv.DictReader(stream)):
            if row["Month"] != "3":
                continue
            date = f"{row['Year']}-{int(row['Month']):02d}-{int(row['Day']):02d}"
            for level, h in (("850", 1530), ("700", 3140), ("500", 5830), ("250", 10720)):
                u, v = (row[f"{level}mb Average {c}-Wind Component"] for c in "UV")
                if u and v:
                    lines.append(f"{i},{date},{h},{float(u) * 0.514444},{float(v) * 0.514444}")
    file = tmp_path / "kxmr.csv"
    file.write_text("\n".join(lines))
    both = read_soundings(file, incomplete="drop").statistics("march")
    assert both.zonal.mean == pytest.approx([2.91, 7.64, 16.35, 32.80], abs=0.1)
    assert both.zonal.correlation[0] == pytest.approx([1, 0.772, 0.675, 0.465], abs=0.01)
    assert both.intralevel_correlation == pytest.approx([0.135, 0.169, 0.267, 0.277], abs=0.01)
    # day-to-day correlation .48 to .73: the most persistent level decides
    assert 60 < both.zonal.independent_samples < 270


CODES = (99.0, -99.0, 99.9, -99.9, 999.0, -999.0, 999.9, -9999.0, 9999.0, -99.99, 32767.0)


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("share", [0.0004, 0.03])
def test_missing_value_codes_are_no_wind(tmp_path, code, share):
    """Profiles with a code are left out or refused: the others' statistics are those of the file without them."""
    lines = write_profiles(tmp_path / "whole.csv", 2500).read_text().splitlines()
    spoilt = {f"p{i}" for i in range(0, 2500, round(1 / share))}
    (tmp_path / "clean.csv").write_text("\n".join(r for r in lines if r.split(",")[0] not in spoilt) + "\n")
    with_codes = [
        ",".join([*r.split(",")[:4], f"{code:g}"]) if r.split(",")[0] in spoilt and ",1000," in r else r for r in lines
    ]
    file = tmp_path / "codes.csv"
    file.write_text("\n".join(with_codes) + "\n")
    with pytest.raises(DataError, match=rf"missing-value codes.*{code:g} m/s at 1000 m \(p0 of 2020-01-01, line 3\)"):
        read_soundings(file, incomplete="refuse")
    read = read_soundings(file, incomplete="drop")
    assert len(read.quality.dropped) == len(spoilt)
    both, wanted = read.statistics("mine"), read_soundings(tmp_path / "clean.csv").statistics("mine")
    assert both.meridional.standard_deviation == pytest.approx(wanted.meridional.standard_deviation, rel=1e-12)
    assert both.meridional.standard_deviation == pytest.approx([2, 2, 2], rel=0.1)


def jet(file: Path, values) -> Path:
    random = np.random.default_rng(5)
    rows = [
        f"{i},{h},{u:.2f},{random.normal(0, 3):.2f}"
        for i, x in enumerate(values)
        for h, u in ((0, np.clip(x / 10, -1, 1)), (9000, x))
    ]
    file.write_text("\n".join(["profile,altitude [m],u [m/s],v [m/s]", *rows]) + "\n")
    return file


def test_a_jet_of_99_metres_a_second_is_wind(tmp_path):
    values = np.random.default_rng(4).normal(70.0, 15.0, 400)
    values[[3, 50, 77]] = 99.0, 99.9, 115.0
    read = read_soundings(jet(tmp_path / "jet.csv", values))
    assert not read.quality.dropped
    assert read.u[:, 1].max() == 115.0


@pytest.mark.parametrize(
    ("row", "value", "says"),
    [
        (7, 160.0, r"no wind: 160 m/s at 9000 m \(7, line 17\)"),
        (7, -513.93, r"-513.93 m/s at 9000 m"),  # -999 knots
        (7, 55.0, r"55 m/s at 9000 m \(7, line 17\)"),
        (slice(0, 8), 55.0, r"and 3 more; are these knots under another unit\? Correct them"),
    ],
)
def test_outliers_are_refused_with_their_lines(tmp_path, row, value, says):
    values = np.random.default_rng(4).normal(0.0, 3.0, 400)
    values[row] = value
    with pytest.raises(DataError, match=says):
        read_soundings(jet(tmp_path / "s.csv", values), incomplete="drop")


def test_a_level_of_nothing_but_codes_and_altitudes_that_are_none(tmp_path):
    with pytest.raises(DataError, match="no profile holds all of the 2 levels"):
        read_soundings(jet(tmp_path / "s.csv", np.full(50, 99.0)), incomplete="drop")
    file = jet(tmp_path / "s.csv", np.random.default_rng(4).normal(0.0, 3.0, 50))
    for wrong in ("-9999", "99999"):
        text = file.read_text().replace("7,9000,", f"7,{wrong},", 1)
        (tmp_path / "t.csv").write_text(text)
        with pytest.raises(DataError, match=f"{wrong} m is no altitude"):
            read_soundings(tmp_path / "t.csv", incomplete="drop")


def test_tops_above_the_tables_are_refused():
    with pytest.raises(DataError, match="from 3 to 30000 m; 40000 m is not among them"):
        shipped_statistics(top=40000.0)
