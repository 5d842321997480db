"""Readers of soundings: the same winds in all formats, real files with counts taken by hand, and bad input."""

from __future__ import annotations

import datetime
import importlib.util
import zipfile
from typing import Any

import numpy as np
import pytest
import sounding_files as files
import xarray as xr
from scipy.io import netcdf_file
from sounding_files import real_file

from ascentwind.errors import MissingLibraryError
from ascentwind.model.errors import DataError, UnknownNameError
from ascentwind.model.wind.correlation_matrix import RepairWarning
from ascentwind.model.wind.soundings.collection import soundings_text, successive_correlation
from ascentwind.model.wind.soundings.read import read_profiles, read_soundings
from ascentwind.model.wind.soundings.sounding import SoundingError, hypsometric_heights, wind_components

LEVELS = np.array([0.0, 1000.0, 2500.0, 5000.0, 8000.0, 11000.0])


def winds(count: int = 40, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return winds whose levels go together, as of a real atmosphere, at speeds that tenths of m/s show."""
    random = np.random.default_rng(seed)
    common = random.standard_normal((2, count, 1))
    own = random.standard_normal((2, count, LEVELS.size))
    u, v = 0.8 * common + 0.6 * own
    return 12 + LEVELS / 600 + 6 * u, 3 + 5 * v


def rounded(count: int = 40, speed_step: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Return winds of whole degrees and whole steps of speed: formats that round so hold them exactly."""
    s, d = files.polar(*winds(count))
    return wind_components(np.round(s / speed_step) * speed_step, np.round(d))


def test_directions_are_where_the_wind_comes_from():
    u, v = wind_components([10.0] * 5, [0.0, 90.0, 180.0, 270.0, 360.0])
    np.testing.assert_array_equal(u, [0, -10, 0, 10, 0])
    np.testing.assert_array_equal(v, [-10, 0, 10, 0, -10])
    d = np.linspace(0, 360, 721)
    u, v = wind_components(np.full(721, 3.0), d)
    np.testing.assert_allclose(u, -3 * np.sin(np.radians(d)), atol=1e-14)
    np.testing.assert_allclose(v, -3 * np.cos(np.radians(d)), atol=1e-14)


TEXTS = {
    "igra": files.igra_text,
    "fsl": files.fsl_text,
    "own": files.own_text,
    "own, ft and knots": lambda h, u, v: files.own_text(h, u, v, altitude_unit="ft", speed_unit="kt"),
    "own, km and km/h": lambda h, u, v: files.own_text(h, u, v, altitude_unit="km", speed_unit="km/h"),
    "own, direction": lambda h, u, v: files.own_text(h, u, v, by_direction=True, speed_unit="ft/s"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_the_same_profiles_give_the_same_statistics(tmp_path, name):
    """Winds that all formats hold exactly: mean, deviation and correlation to 1e-6 of sigma."""
    u, v = rounded()
    file = tmp_path / "soundings.txt"
    file.write_text(TEXTS[name](LEVELS, u, v))
    found = read_soundings(file, LEVELS).statistics("mine")
    for part, values in ((found.zonal, u), (found.meridional, v)):
        sigma = values.std(axis=0, ddof=1)
        np.testing.assert_allclose(part.mean, values.mean(axis=0), atol=1e-6 * sigma.min())
        np.testing.assert_allclose(part.standard_deviation, sigma, rtol=1e-6)
        np.testing.assert_allclose(part.correlation, np.corrcoef(values, rowvar=False), atol=1e-6)


@pytest.mark.parametrize(("text", "step"), [(files.wyoming_list_text, 1852 / 3600), (files.fsl_text, 1852 / 3600)])
def test_knots_of_text_lists(tmp_path, text, step):
    u, v = rounded(12, step)
    file = tmp_path / "list.txt"
    file.write_text(text(LEVELS, u, v) if text is files.wyoming_list_text else text(LEVELS, u, v, "kt"))
    found = read_soundings(file, LEVELS)
    np.testing.assert_allclose(found.u, u, atol=1e-9)
    np.testing.assert_allclose(found.v, v, atol=1e-9)
    assert found.station == "74794"
    assert found.time[0] == np.datetime64("2003-03-01T12:00")


def test_a_list_in_a_web_page(tmp_path):
    u, v = rounded(11, 1.0)
    text = files.wyoming_list_text(LEVELS, u, v)
    page = text.replace("74794 XMR Cape Canaveral Observations", "<H2>74794 XMR Cape Canaveral Observations")
    page = "<HTML>\n" + page.replace(" 2003\n", " 2003</H2>\n") + "</HTML>\n"
    file = tmp_path / "page.html"
    file.write_text(page)
    (tmp_path / "plain.txt").write_text(text)
    np.testing.assert_array_equal(read_soundings(file, LEVELS).u, read_soundings(tmp_path / "plain.txt", LEVELS).u)


def test_wyoming_csv(tmp_path):
    u, v = (row[0] for row in rounded())
    file = tmp_path / "xmr.csv"
    file.write_text(files.wyoming_csv_text(LEVELS, u, v))
    (found,), _ = read_profiles(file)
    np.testing.assert_allclose(found.u, u, atol=1e-9)
    np.testing.assert_allclose(found.v, v, atol=1e-9)


@pytest.mark.parametrize("new", [True, False])
@pytest.mark.parametrize("engine", ["scipy", "h5netcdf"])
def test_era5_in_both_dialects(tmp_path, new, engine):
    if importlib.util.find_spec(engine) is None:
        pytest.skip(f"{engine} is not installed")
    u, v = winds(12)
    file = tmp_path / "era5.nc"
    files.era5(LEVELS, u, v, new=new).to_netcdf(file, engine=engine)
    found = read_soundings(file, LEVELS[1:-1], largest_gap=4000.0)  # the ends lie at the ends of the field, to rounding
    np.testing.assert_allclose(found.u, u[:, 1:-1], atol=1e-9)
    np.testing.assert_allclose(found.v, v[:, 1:-1], atol=1e-9)


def test_places_in_a_field(tmp_path):
    """Bilinear: exact for a field that is linear in latitude and longitude."""
    u, v = winds(11)
    field = files.era5(LEVELS, u, v, new=True, latitude=(29.0, 28.75, 28.5), longitude=(279.0, 279.5, 280.0))
    field["u"] = field["u"] + 2 * (field["latitude"] - 28.5) + 4 * (field["longitude"] - 279.0)
    field["u"].attrs["units"] = "m s**-1"
    file = tmp_path / "era5.nc"
    field.to_netcdf(file, engine="scipy")
    at: dict[str, Any] = {"latitude": 28.6, "longitude": -80.8}  # 279.2
    bilinear = read_soundings(file, LEVELS[1:-1], point="bilinear", largest_gap=4000.0, **at)
    nearest = read_soundings(file, LEVELS[1:-1], largest_gap=4000.0, **at)
    np.testing.assert_allclose(bilinear.u, u[:, 1:-1] + 0.2 + 0.8, atol=1e-9)
    np.testing.assert_allclose(nearest.u, u[:, 1:-1], atol=1e-9)
    cases: tuple[tuple[dict[str, Any], str], ...] = (
        ({}, "say which with latitude="),
        ({"latitude": 28.6}, "longitude="),
        ({"latitude": 40.0}, "40 deg is not"),
    )
    for wrong, says in cases:
        with pytest.raises(SoundingError, match=says):
            read_soundings(file, LEVELS, **wrong)


def test_real_igra():
    """Soundings of 158 and 157 levels, 4 and 1 of them without wind (counted with awk); the third is cut off."""
    found, quality = read_profiles(real_file("igra_USM00070026-data.txt.zip"))
    assert [s.altitude.size for s in found] == [154, 156]
    assert (quality.read, quality.kept, quality.levels) == (3, 2, 310)
    assert quality.left_out == {"no wind": 5}
    assert "147 levels and 0 follow" in quality.dropped[0][1]
    first, second = found
    assert (first.station, first.time) == ("USM00070026", datetime.datetime(2010, 6, 1))
    for sounding, speed in ((first, 5.1), (second, 7.2)):  # their first lines: 12 m, 20 deg, 51 and 72 tenths
        assert sounding.altitude[0] == 12.0
        d = np.radians(20)
        assert (sounding.u[0], sounding.v[0]) == pytest.approx((-speed * np.sin(d), -speed * np.cos(d)), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "lines", "first", "top", "fastest"),
    [
        ("wyoming_boi_2010120912.csv", 132, (874.0, 240, 1.5), 32309.0, 58.7),
        ("wyoming_oun_2023052212.csv", 256, (345.0, 0, 0.0), 34747.0, 26.2),
    ],
)
def test_real_wyoming(name, lines, first, top, fastest):
    """Every line but the last has a wind; first line, last height with a wind and largest speed by eye and awk."""
    (found,), quality = read_profiles(real_file(name))
    assert found.altitude.size == lines - 1
    assert quality.left_out == {"no wind": 1}
    height, direction, speed = first
    d = np.radians(direction)
    assert (found.altitude[0], found.altitude[-1]) == (height, top)
    assert (found.u[0], found.v[0]) == pytest.approx((-speed * np.sin(d), -speed * np.cos(d)), rel=1e-12)
    assert np.hypot(found.u, found.v).max() == pytest.approx(fastest)


@pytest.mark.parametrize(("name", "count"), [("era5_peniche_2022_10.nc", 40), ("era5_peniche_2023_10.nc", 44)])
def test_real_era5(name, count):
    """Hours and levels by ncdump; the wind at 39.25 N, 9 W as the library that is not xarray reads it."""
    file = real_file(name)
    if name.endswith("2022_10.nc"):
        pytest.importorskip("h5netcdf")
        h5py = pytest.importorskip("h5py")
        with h5py.File(file) as raw:
            values = {x: raw[x][7, :, 3, 0].astype(float) for x in "uvz"}
            assert (float(raw["latitude"][3]), float(raw["longitude"][0])) == (39.25, -9.0)
    else:
        with netcdf_file(file, mmap=False) as raw:
            values = {
                x: raw.variables[x].scale_factor * raw.variables[x][7, :, 3, 0] + raw.variables[x].add_offset
                for x in "uvz"
            }
    found, quality = read_profiles(file, latitude=39.36, longitude=-8.9)
    assert (quality.kept, quality.levels) == (count, 37 * count)
    order = np.argsort(values["z"])
    for have, x, scale in ((found[7].altitude, "z", 9.80665), (found[7].u, "u", 1.0), (found[7].v, "v", 1.0)):
        np.testing.assert_allclose(have, values[x][order] / scale, rtol=1e-6, atol=1e-5)
    assert all(s.altitude.size == 37 and 47e3 < s.altitude[-1] < 49e3 for s in found)
    lowest = [s.altitude[0] for s in found]
    assert -50 < min(lowest) < max(lowest) < 400  # 1000 hPa


def test_missing_codes_and_heights_from_pressure():
    """An isothermal atmosphere: H = R T / g ln(p0 / p) exactly."""
    pressure, temperature = np.array([1000.0, 700.0, 500.0, 300.0]), np.full(4, -23.15)  # 250 K
    exact = 287.05 * 250 / 9.80665 * np.log(1000 / pressure)
    height, made = hypsometric_heights(pressure, temperature, np.where([True, False, True, False], exact, np.nan))
    np.testing.assert_allclose(height, exact, rtol=1e-12)
    assert made.tolist() == [False, True, False, True]
    height, made = hypsometric_heights(
        pressure, np.full(4, np.nan), np.where([True, False, True, False], exact, np.nan)
    )
    assert not made.any() and np.isnan(height[1])


def test_igra_codes_are_counted_apart(tmp_path):
    u, v = rounded(3)
    lines = files.igra_text(LEVELS, u, v).splitlines()
    lines[2] = lines[2][:46] + "-9999" + lines[2][51:]
    lines[3] = lines[3][:46] + "-8888" + lines[3][51:]
    lines[4] = lines[4][:16] + "-9999" + lines[4][21:]
    file = tmp_path / "igra.txt"
    file.write_text("\n".join(lines))
    found, quality = read_profiles(file)
    assert found[0].altitude.tolist() == [0.0, 8000.0, 11000.0]
    assert quality.left_out["no wind"] == 1
    assert quality.left_out["wind removed by the archive's quality control"] == 1
    assert quality.left_out["no height, and no pressure and temperature to compute it"] == 1
    packed = tmp_path / "igra.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        archive.write(file, "USM00074794-data.txt")
    assert [s.altitude.size for s in read_profiles(packed)[0]] == [3, 6, 6]


def test_selection_by_month_hour_and_year(tmp_path):
    u, v = rounded(40)
    file = tmp_path / "igra.txt"
    file.write_text(files.igra_text(LEVELS, u, v))
    assert len(read_soundings(file, LEVELS, months=["april"]).u) == 9  # 31 of March and 9 of April
    assert len(read_soundings(file, LEVELS, months=[3, "april"], hours=[12], years=[2003]).u) == 40
    found = read_soundings(file, LEVELS, months=["march"])
    assert found.quality.selected == {"another month": 9}
    with pytest.raises(SoundingError, match="no sounding is left of 40 read.*another month"):
        read_soundings(file, LEVELS, months=["july"])
    with pytest.raises(UnknownNameError, match="did you mean 'march'"):
        read_soundings(file, LEVELS, months=["marsh"])
    with pytest.raises(SoundingError, match="24 is no hour"):
        read_soundings(file, LEVELS, hours=[24])


def test_levels_and_gaps(tmp_path):
    """Linear between neighbours no farther apart than the gap; nothing beyond the ends."""
    u, v = np.tile(LEVELS / 1000, (2, 1)), np.tile(-LEVELS / 500, (2, 1))
    file = tmp_path / "s.csv"
    file.write_text(files.own_text(LEVELS, u, v))
    found = read_soundings(file, [-10.0, 0.0, 500.0, 3000.0, 4000.0, 11000.0, 11001.0], largest_gap=2500.0)
    np.testing.assert_allclose(found.u[0], [np.nan, 0, 0.5, 3, 4, 11, np.nan], atol=1e-12)
    narrow = read_soundings(file, [500.0, 3000.0], largest_gap=2000.0)
    np.testing.assert_allclose(narrow.u[0], [0.5, np.nan])


def test_partial_soundings_are_used_pair_by_pair(tmp_path):
    """Half of the balloons burst: statistics of the levels below hold all of them, and every matrix is one."""
    u, v = winds(400, seed=3)
    burst = np.arange(400) % 2 == 0
    u[burst, 4:], v[burst, 4:] = np.nan, np.nan
    file = tmp_path / "s.csv"
    file.write_text(files.own_text(LEVELS, u, v))
    read = read_soundings(file, LEVELS)
    both = read.statistics("burst")
    np.testing.assert_allclose(both.zonal.mean[:4], u[:, :4].mean(axis=0))
    np.testing.assert_allclose(both.zonal.mean[4:], np.nanmean(u[:, 4:], axis=0))
    whole, part = np.corrcoef(u[:, :4], rowvar=False), np.corrcoef(u[~burst], rowvar=False)
    np.testing.assert_allclose(both.zonal.correlation[:4, :4], whole, atol=1e-10)
    np.testing.assert_allclose(both.zonal.correlation[4:, 2], part[4:, 2], atol=1e-10)
    assert both.zonal.independent_samples <= 200
    assert "200 of them partly observed, pair by pair" in both.zonal.source
    assert len(read_soundings(file, LEVELS, incomplete="drop").u) == 200


def test_pairs_that_do_not_fit_together_are_repaired_and_said(tmp_path):
    """Three levels, each pair seen by other balloons, with correlations that no wind has together."""
    random = np.random.default_rng(1)
    rows = np.full((90, 3), np.nan)
    for k, (i, j, sign) in enumerate(((0, 1, 1), (1, 2, 1), (0, 2, -1))):
        x = random.standard_normal(30)
        rows[30 * k : 30 * k + 30, i] = 8 * x
        rows[30 * k : 30 * k + 30, j] = 8 * sign * (0.95 * x + 0.3 * random.standard_normal(30))
    file = tmp_path / "s.csv"
    file.write_text(files.own_text([0, 1000, 2000], rows, random.standard_normal(rows.shape) + 0 * rows))
    with pytest.warns(RepairWarning, match="pair by pair: nearest correlation matrix"):
        both = read_soundings(file).statistics("odd")
    assert np.linalg.eigvalsh(both.zonal.correlation).min() > -1e-10
    assert "nearest correlation matrix" in both.zonal.source


def test_a_level_that_never_changes_has_no_statistics(tmp_path):
    u, v = winds(12)
    file = tmp_path / "s.csv"
    file.write_text(files.own_text(LEVELS, u, 0 * v))
    with pytest.raises(SoundingError, match="the meridional wind is the same in all profiles at 0 m"):
        read_soundings(file).statistics("still")


def test_soundings_twice_a_day_are_more_alike_than_days():
    random, x = np.random.default_rng(0), [np.zeros(1)]
    for _ in range(4000):
        x.append(0.8 * x[-1] + 0.6 * random.standard_normal(1))
    values = np.array(x[1:])
    assert successive_correlation(values, np.arange(4000) / 2)[0] == pytest.approx(0.8, abs=0.03)
    assert successive_correlation(values[::2], np.arange(2000.0))[0] == pytest.approx(0.64, abs=0.05)


def test_what_is_written_is_read_back(tmp_path):
    u, v = rounded(12)
    u[3, 5], v[3, 5] = np.nan, np.nan
    first = tmp_path / "igra.txt"
    first.write_text(files.igra_text(LEVELS, u, v))
    read = read_soundings(first, LEVELS)
    again = tmp_path / "again.csv"
    again.write_text(soundings_text(read))
    back = read_soundings(again)
    np.testing.assert_allclose(back.u, read.u, rtol=1e-5)
    assert (back.time == read.time).all() and back.station == read.station


def spoilt_igra(change):
    u, v = rounded(12)
    return change(files.igra_text(LEVELS, u, v).splitlines())


def put(lines, row, first, text):
    lines[row] = lines[row][: first - 1] + text + lines[row][first - 1 + len(text) :]
    return lines


HEAD = "profile,date,altitude [m],speed [m/s],direction [deg]\n"
TWO = "7,2003-03-01,0,5,10\n7,2003-03-01,1000,6,20\n"
# (text, what the message must hold)
BAD = [
    pytest.param("\n".join(spoilt_igra(lambda x: put(x, 2, 41, "  361"))), r"igra.txt, line 3: sounding USM00074794 2003-03-01 12 UTC, 1000 m: 361 deg is no direction", id="direction over 360"),
    pytest.param("\n".join(spoilt_igra(lambda x: put(x, 2, 47, " 5000"))), r"line 3: sounding USM.*500 m/s is more than any wind has; are these knots", id="too fast"),
    pytest.param("\n".join(spoilt_igra(lambda x: put(x, 7, 2, "USM00099999"))), r"station 'USM00099999', and others are of 'USM00074794'; read the stations one by one", id="mixed stations"),
    pytest.param("\n".join(spoilt_igra(lambda x: put(x, 7, 14, "2003 03 01"))), r"line 9: sounding .*2003-03-01 12:00 stands twice; keep one", id="date twice"),
    pytest.param("\n".join(spoilt_igra(lambda x: put(x, 7, 19, "13"))), r"igra.txt, line 8: its date is none", id="no month"),
    pytest.param("\n".join(spoilt_igra(lambda x: put(x, 3, 17, "abcde"))), r"line 4: 'abcde' in columns 17 to 21 is no height", id="no number"),
    pytest.param(HEAD + TWO.replace("20\n", "400\n"), r"line 3: sounding 7, 1000 m: 400 deg is no direction", id="csv direction"),
    pytest.param(HEAD + TWO.replace("6,20", "-6,20"), r"line 3: sounding 7, 1000 m: a speed of -6 m/s is negative", id="negative speed"),
    pytest.param(HEAD + TWO + "7,2003-03-01,500,6,20\n", r"line 4: sounding 7, 500 m: comes after 0 and 1000 m: levels out of order; sort", id="levels out of order"),
    pytest.param(HEAD + TWO + "7,2003-03-02,2000,6,20\n", r"line 4: the date of profile '7' changes from '2003-03-01' to '2003-03-02'", id="date changes"),
    pytest.param(HEAD.replace("[deg]", "[rad]") + TWO, r"line 1: column 'direction' has the unit \[rad\], and units that are known make it 'direction \[deg\]'", id="radians"),
    pytest.param(HEAD.replace("speed [m/s]", "speed") + TWO, r"column 'speed' has no unit, and units that are known make it 'speed \[m/s\]', 'speed \[kt\]'", id="no unit"),
    pytest.param(HEAD.replace("direction", "diretion") + TWO, r"column 'direction \[deg\]' is missing; did you mean 'diretion \[deg\]'", id="misspelt"),
    pytest.param(HEAD.replace("\n", ",u [m/s]\n") + TWO.replace("\n", ",3\n"), r"has both components and speed or direction", id="both"),
    pytest.param("    254     12      1      MAR    2003\n      1  12868  74794\n      3   XMR   99999  mph\n", r"line 3: sounding 74794 2003-03-01 12 UTC: the unit of the wind is 'mph'", id="fsl unit"),
    pytest.param("    254     12      1      MAR    2003\n      4   8500   1400   100    50   270    20\n", r"line 2: a line of type '4' has no place here", id="fsl order"),
    pytest.param("    254     12     32      MAR    2003\n", r"line 1: holds no time", id="fsl date"),
    pytest.param("", r"holds no rows", id="empty"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "says"), BAD)
def test_bad_files_are_refused(tmp_path, text, says):
    file = tmp_path / "igra.txt"
    file.write_text(text)
    with pytest.raises(DataError, match=says):
        read_soundings(file, LEVELS)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: d.drop_vars("u"), "has no variable of u: u or ua"),
        (lambda d: d.drop_vars("z"), "has no variable of geopotential: z"),
        (lambda d: d.assign(u=d["u"].assign_attrs(units="knots")), r"u is in 'knots', expected m s"),
        (lambda d: d.rename(level="layer"), "has no coordinate of pressure level"),
        (lambda d: xr.concat([d, d], "member"), "has 2 entries along 'member'"),
    ],
)
def test_bad_fields_are_refused(tmp_path, change, says):
    file = tmp_path / "era5.nc"
    change(files.era5(LEVELS, *winds(3), new=False)).to_netcdf(file, engine="scipy")
    with pytest.raises(SoundingError, match=says):
        read_soundings(file, LEVELS)


def test_another_calendar_and_damaged_files(tmp_path):
    file = tmp_path / "model.nc"
    field = files.era5(LEVELS, *winds(3), new=False)
    days = ("time", np.array([0.0, 1.0, 2.0]), {"units": "days since 2003-03-01", "calendar": "360_day"})
    field.assign_coords(time=days).to_netcdf(file, engine="scipy")
    with pytest.raises(SoundingError, match="calendar '360_day', whose days are not those of balloons"):
        read_soundings(file, LEVELS)
    file.write_bytes(file.read_bytes()[:200])
    with pytest.raises(SoundingError, match="cannot be read as netCDF"):
        read_soundings(file, LEVELS)
    file.write_bytes(b"PK\3\4 no archive")
    with pytest.raises(SoundingError, match="cannot be unpacked"):
        read_soundings(file, LEVELS)


@pytest.mark.parametrize(("start", "library"), [(b"GRIB\0\0\0\1", "cfgrib"), (b"\x89HDF\r\n\x1a\n", "h5netcdf")])
def test_a_library_that_is_missing_is_named(tmp_path, monkeypatch, start, library):
    file = tmp_path / "field.bin"
    file.write_bytes(start)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingLibraryError, match=f"install it with 'pip install {library}'"):
        read_soundings(file, LEVELS)


def test_options_that_cannot_be_used(tmp_path):
    file = tmp_path / "s.csv"
    file.write_text(files.own_text(LEVELS, *winds(12)))
    cases: tuple[tuple[dict[str, Any], str], ...] = (
        ({"levels": [3.0, 2.0]}, "increasing"),
        ({"levels": [20000.0]}, "no profile holds any of the 1 levels"),
        ({"largest_gap": 0.0}, "not positive"),
        ({"latitude": 28.0}, "is of one place"),
    )
    for options, says in cases:
        with pytest.raises(SoundingError, match=says):
            read_soundings(file, **options)
    with pytest.raises(UnknownNameError, match="incomplete"):
        read_soundings(file, incomplete="keep")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("name", ["igra", "fsl", "own"])
def test_damaged_files_are_read_or_refused(tmp_path, name):
    """Characters changed, cut and doubled: what is read is finite, and what is not is refused by a typed error."""
    random, text = np.random.default_rng(7), TEXTS[name](LEVELS, *rounded(12))
    letters = list('0123456789 -.,#abZ\n\t[]"\0é')
    file = tmp_path / "damaged.txt"
    for _ in range(40):
        mutant = list(text)
        for _ in range(int(random.integers(1, 6))):
            at = int(random.integers(len(mutant)))
            end = at + int(random.integers(1, 60))
            part = ([str(random.choice(letters))], [], mutant[at:end] * 2)[int(random.integers(3))]
            mutant[at : end if not part else at + 1] = part
        file.write_text("".join(mutant))
        try:
            found = read_soundings(file, LEVELS)
        except DataError:
            continue
        assert not np.isinf(found.u).any() and found.u.shape == found.v.shape


def test_grib_is_read_by_its_library(tmp_path):
    """A file that ecCodes writes, of two times, three levels and four places: GRIB's sixteen bits, no index left."""
    pytest.importorskip("cfgrib")
    eccodes = pytest.importorskip("eccodes")
    levels, times = (850, 500, 250), (0, 1200)
    random = np.random.default_rng(3)
    shape = (len(times), len(levels), 4)
    fields = {
        "u": random.normal(10, 8, shape),
        "v": random.normal(0, 8, shape),
        "z": 9.80665 * random.normal(5e3, 9, shape),
    }
    fields["z"] += 9.80665 * np.array([-3500.0, 600.0, 5400.0])[:, None]
    file = tmp_path / "field.grib"
    with file.open("wb") as stream:
        for name, values in fields.items():
            for t, time in enumerate(times):
                for k, level in enumerate(levels):
                    message = eccodes.codes_grib_new_from_samples("regular_ll_pl_grib2")
                    keys = {
                        "shortName": name, "dataDate": 20230522, "dataTime": time, "level": level, "Ni": 2, "Nj": 2,
                        "latitudeOfFirstGridPointInDegrees": 40.0, "latitudeOfLastGridPointInDegrees": 39.0,
                        "longitudeOfFirstGridPointInDegrees": 351.0, "longitudeOfLastGridPointInDegrees": 352.0,
                        "iDirectionIncrementInDegrees": 1.0, "jDirectionIncrementInDegrees": 1.0, "bitsPerValue": 16,
                    }  # fmt: skip
                    for key, value in keys.items():
                        eccodes.codes_set(message, key, value)
                    eccodes.codes_set_values(message, values[t, k])
                    eccodes.codes_write(message, stream)
                    eccodes.codes_release(message)
    found, quality = read_profiles(file, latitude=39.0, longitude=-8.0)  # the last of the four
    assert [s.time and s.time.hour for s in found] == [0, 12]
    assert quality.read == 2
    for t, sounding in enumerate(found):
        np.testing.assert_allclose(sounding.altitude, fields["z"][t, :, 3] / 9.80665, rtol=1e-4)
        np.testing.assert_allclose(sounding.u, fields["u"][t, :, 3], atol=2e-3)
        np.testing.assert_allclose(sounding.v, fields["v"][t, :, 3], atol=2e-3)
    assert [p.name for p in tmp_path.iterdir()] == ["field.grib"]
