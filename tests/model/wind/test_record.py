"""One wind: its record, its filter against its statistics, both against the flight, and the command that writes it."""

from __future__ import annotations

import json
import shutil
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ascentwind.model.errors import AscentwindError, DataError, ExtrapolationWarning, OutputFolderError, WindWarning
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.wind.filter_file import filter_text, read_filter
from ascentwind.model.wind.propagation import standard_deviation
from ascentwind.model.wind.range_reference import range_reference, shipped_statistics
from ascentwind.model.wind.record import WindOrigin, WindRecord
from ascentwind.model.wind.shaping_filter import ShapingFilter
from ascentwind.model.wind.soundings.read import read_soundings
from ascentwind.model.wind.statistics import REPORT_SAMPLES, WindModel
from ascentwind.runners.cli.app import app
from ascentwind.runners.construct.build_vehicle import build_vehicle
from ascentwind.runners.wind import apply as wind_apply
from ascentwind.runners.wind.apply import apply_wind
from ascentwind.runners.wind.synthesis.result import SynthesisResult

FILTER, TABLE = "wind_march_zonal_filter.json", "wind_march_zonal.csv"


def quiet(folder: Path):
    """Load a vehicle; a warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load_vehicle(folder)


def spoil_filter(folder: Path, **factors: float) -> None:
    """Multiply arrays of the filter file by factors."""
    file = folder / FILTER
    data = json.loads(file.read_text())
    for key, factor in factors.items():
        data[key] = (factor * np.array(data[key])).tolist()
    file.write_text(json.dumps(data))


def cut_filter(folder: Path, low: float, high: float) -> None:
    file = folder / FILTER
    f = read_filter(file)
    i = (f.altitude >= low) & (f.altitude <= high)
    file.write_text(filter_text(replace(f, altitude=f.altitude[i], F=f.F[i], G=f.G[i], H=f.H[i])))


def remove_record(folder: Path) -> None:
    toml = folder / "vehicle.toml"
    before, _, after = toml.read_text().partition("[wind.record]")
    toml.write_text(before + after[after.index("\n[") + 1 :] if "\n[" in after else before)


@pytest.mark.parametrize("name", ["as504", "falcon1"])
def test_shipped_vehicles_hold_one_wind_and_load_without_a_word(name):
    vehicle = quiet(built_in_vehicles()[name])
    wind = vehicle.wind
    assert isinstance(wind, WindModel)
    assert wind.record is not None
    assert wind.record.origin == wind.shaping_filter.origin
    assert wind.record.independent_samples == REPORT_SAMPLES
    assert wind.standard_deviation is not None
    h = np.linspace(3.0, 30000.0, 61)
    assert standard_deviation(wind.shaping_filter, h) == pytest.approx(wind.standard_deviation.polynomial(h), rel=1e-3)


def test_standard_deviation_on_the_way_up_is_the_closed_form():
    """z' = -z/L + g n from Var 4 at 100 m: Var(h) = g^2 L/2 + (4 - g^2 L/2) exp(-2 (h - 100)/L); held at both ends."""
    length, gain, h = 700.0, 0.15, np.linspace(100.0, 3100.0, 4)
    lag = ShapingFilter(
        "lag", h, np.full((4, 1, 1), -1 / length), np.full((4, 1, 1), gain), np.full((4, 1), 3.0), np.array([[4.0]])
    )
    level = gain**2 * length / 2
    wanted = np.array([5000.0, 50.0, 100.0, 731.0, 2500.0, 3100.0])
    climbed = np.maximum(wanted - 100.0, 0.0)
    expected = 3.0 * np.sqrt(level + (4.0 - level) * np.exp(-2 * climbed / length))
    assert standard_deviation(lag, wanted) == pytest.approx(expected, rel=1e-9)
    assert standard_deviation(lag, 50.0).shape == ()


def test_a_vehicle_without_a_record_loads_with_one_hint(vehicle_folder):
    remove_record(vehicle_folder)
    with pytest.warns(WindWarning, match=r"holds no \[wind.record\].*wind apply") as told:
        vehicle = load_vehicle(vehicle_folder)
    assert sum(warning.category is WindWarning for warning in told) == 1
    assert vehicle.wind.record is None


# what is done to the shipped March zonal wind, and what must be said
REFUSED = {
    "filter of another component": (
        lambda d: shutil.copy(built_in_vehicles()["falcon1"] / "wind_march_meridional_filter.json", d / FILTER),
        "fitted to march meridional.*recorded as those of march zonal",
    ),
    "table of another component": (
        lambda d: shutil.copy(built_in_vehicles()["falcon1"] / "wind_march_meridional.csv", d / TABLE),
        "the mean at 3 m is -0.21 m/s, but the record says march zonal",
    ),
    "record of another month": (
        lambda d: (d / "vehicle.toml").write_text(
            (d / "vehicle.toml").read_text().replace('period = "march"', 'period = "february"')
        ),
        "the record says february zonal",
    ),
    "record of another sign": (
        lambda d: (d / "vehicle.toml").write_text((d / "vehicle.toml").read_text().replace("sign = 1 ", "sign = -1 ")),
        "the mean at 3 m is 0.28 m/s",
    ),
    "record along the path": (
        lambda d: (d / "vehicle.toml").write_text(
            (d / "vehicle.toml").read_text().replace("azimuth_deg = 72.0", "azimuth_deg = 90.0")
        ),
        "blows along a flight path of azimuth 90 deg.*take the meridional",
    ),
    "H = 0": (lambda d: spoil_filter(d, H_m_per_s=0.0), "standard deviation of 0 m/s"),
    "H x 1000": (lambda d: spoil_filter(d, H_m_per_s=1000.0), "two winds, or two units"),
    "H x 2.1": (lambda d: spoil_filter(d, H_m_per_s=2.1), "two winds, or two units"),
    "H / 2.1": (lambda d: spoil_filter(d, H_m_per_s=1 / 2.1), "two winds, or two units"),
    "G x 10": (lambda d: spoil_filter(d, G_per_root_m=10.0), "two winds, or two units"),
    "F x 1e10": (lambda d: spoil_filter(d, F_per_m=1e10), "no finite variance|two winds"),
    "-F": (lambda d: spoil_filter(d, F_per_m=-1.0), "two winds, or two units|no finite variance"),
    "filter in km": (lambda d: spoil_filter(d, altitude_m=1e-3), "covers 0.003 to 30 m.*kilometres"),
    "filter in mm": (lambda d: spoil_filter(d, altitude_m=1e3), "feet or millimetres"),
    "filter of ten samples": (
        lambda d: cut_filter(d, 0.0, 565.0),
        "covers 3 to 563.* m, but the flight is loaded from 1024 .*give levels",
    ),
    "filter above the flight": (lambda d: spoil_filter(d, altitude_m=1.5), "feet or millimetres"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_two_winds_in_one_vehicle_are_refused(vehicle_folder, case):
    spoil, says = REFUSED[case]
    spoil(vehicle_folder)
    with pytest.raises(DataError, match=says):
        load_vehicle(vehicle_folder)


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (lambda h, m, s: (h / 1000, m, s), "kilometres"),
        (lambda h, m, s: (h / 0.3048, m, s), "feet"),
        (lambda h, m, s: (h, m, s / 0.3048), "no wind|any wind has|two winds"),
        (lambda h, m, s: (h, m / 0.3048, s), "more than any wind has"),
        (lambda h, m, s: (h, m, s * 2.2), "any wind has|two winds"),
        (lambda h, m, s: (h[:2], m[:2], s[:2]), "covers 3 to 1000 m, but the flight is loaded from"),
    ],
)
def test_statistics_in_other_units_are_refused(vehicle_folder, rows, says):
    remove_record(vehicle_folder)
    lines = (vehicle_folder / TABLE).read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("altitude")) + 1
    columns = rows(*np.array([[float(c) for c in line.split(",")] for line in lines[start:]]).T)
    body = [",".join(f"{x:.6g}" for x in row) for row in zip(*columns, strict=True)]
    (vehicle_folder / TABLE).write_text("\n".join([*lines[:start], *body]) + "\n")
    with pytest.raises(DataError, match=says), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        load_vehicle(vehicle_folder)


@pytest.mark.parametrize(("factor", "told"), [(1.08, False), (0.93, False), (1.12, True), (0.88, True), (1.95, True)])
def test_a_deviation_apart_by_more_than_a_tenth_is_told(vehicle_folder, factor, told):
    spoil_filter(vehicle_folder, H_m_per_s=factor)
    if not told:
        quiet(vehicle_folder)
        return
    with pytest.warns(WindWarning, match="two winds, or two units"):
        load_vehicle(vehicle_folder)


@pytest.mark.parametrize(
    ("low", "high", "says"),
    [(0.0, 16000.0, "above 16000 m from [89]. s on"), (3000.0, 40000.0, "below 3000 m until 4. s")],
)
def test_a_filter_that_ends_on_the_way_is_told(vehicle_folder, low, high, says):
    cut_filter(vehicle_folder, low, high)
    with pytest.warns(ExtrapolationWarning, match=says), warnings.catch_warnings():
        warnings.simplefilter("ignore", WindWarning)
        load_vehicle(vehicle_folder)


def test_data_that_end_where_the_record_says_are_no_surprise_and_others_are(vehicle_folder, edit):
    edit("held_above_m = 30000.0", "held_above_m = 40000.0")
    with pytest.warns(ExtrapolationWarning, match="mean wind and wind filter .* above 30000 m from 11. s"):
        load_vehicle(vehicle_folder)


GAINS = "time [s],attitude_factor [1],rate_factor [1]\n"


@pytest.mark.parametrize(
    ("rows", "interpolation", "says"),
    [
        ("200,1,1\n210,1,1\n", "step", "covers 200 to 210 s, but the flight is loaded from 28 to 133 s"),
        ("0,1,1\n9,1,1\n", "linear", "covers 0 to 9 s, but the flight is loaded"),
        ("60,1,1\n70,1,1\n", "step", ExtrapolationWarning("before its first row at 60 s from 28 s on")),
        ("0,1,1\n80,1,1\n", "linear", ExtrapolationWarning("after its last row at 80 s until 133 s")),
        ("0,1,1\n80,1,1\n", "step", None),
        ("20,1,1\n140,1,1\n", "linear", None),
    ],
)
def test_schedules_cover_the_loaded_flight(vehicle_folder, edit, rows, interpolation, says):
    edit('interpolation = "step"', f'interpolation = "{interpolation}"')
    (vehicle_folder / "control_gains.csv").write_text(GAINS + rows)
    if says is None:
        quiet(vehicle_folder)
    elif isinstance(says, str):
        with pytest.raises(DataError, match=says):
            load_vehicle(vehicle_folder)
    else:
        with pytest.warns(type(says), match=str(says)):
            load_vehicle(vehicle_folder)


def test_a_filter_without_its_mean_is_refused(as504):
    with pytest.raises(DataError, match="a mean and a filter.*ShapingFilter is not"):
        as504.with_wind(as504.vehicle.wind.shaping_filter)
    other = load_vehicle(built_in_vehicles()["falcon1"]).wind
    with pytest.raises(DataError, match="fitted to march meridional"):
        replace(as504.vehicle.wind, shaping_filter=other.shaping_filter)
    for factor in (0.0, 1000.0):
        f = replace(other.shaping_filter, H=factor * other.shaping_filter.H)
        with pytest.raises(DataError, match="which no wind has"):
            as504.with_wind(replace(other, shaping_filter=f, standard_deviation=None))


def test_records_are_checked_when_made():
    origin = WindOrigin("here", "zonal", "march", "1983")
    assert WindRecord(origin, np.deg2rad(72.0), 1, 3e4, "").share_across == pytest.approx(0.309, abs=1e-3)
    for azimuth, sign, top in ((np.pi / 2, 1, 3e4), (0.0, 0, 3e4), (0.0, 2, 3e4), (np.nan, 1, 3e4), (0.0, 1, np.inf)):
        with pytest.raises(DataError):
            WindRecord(origin, azimuth, sign, top, "")
    assert WindRecord(origin, 0.0, 1, 3e4, "").independent_samples is None
    assert WindRecord(origin, 0.0, 1, 3e4, "", 1.5).independent_samples == 1.5
    for samples in (1.0, 0.0, -80.0, np.nan, np.inf):
        with pytest.raises(DataError, match="independent soundings"):
            WindRecord(origin, 0.0, 1, 3e4, "", samples)


def test_the_number_of_soundings_of_a_vehicles_wind_is_read_and_checked(vehicle_folder):
    toml = vehicle_folder / "vehicle.toml"
    text = toml.read_text()
    line = next(line for line in text.splitlines() if line.startswith("independent_samples = "))
    for written, found in (("independent_samples = 215.5", 215.5), ("", None)):
        toml.write_text(text.replace(line, written))
        record = quiet(vehicle_folder).wind.record
        assert record is not None
        assert record.independent_samples == found
    for value in ("1", "0", "-80", "nan", "inf", '"80"', "true"):
        toml.write_text(text.replace(line, f"independent_samples = {value}"))
        with pytest.raises(DataError, match="independent_samples"):
            load_vehicle(vehicle_folder)


# the command


@pytest.fixture
def falcon(tmp_path) -> Path:
    folder = tmp_path / "mine"
    shutil.copytree(built_in_vehicles()["falcon1"], folder)
    return folder


@pytest.fixture
def no_fit(monkeypatch):
    """Let a fit return the closed form of a lag with the right standard deviation, at once."""

    def synthesise(s, method, order, options, noises):
        h, ones = s.altitude, np.ones(s.altitude.size)
        lag = ShapingFilter(
            "lag", h, -1e-3 * ones[:, None, None], np.sqrt(2e-3) * ones[:, None, None], s.standard_deviation[:, None],
            np.eye(1), (), "lag", s.origin,
        )  # fmt: skip
        return SynthesisResult(method, s, lag, s.covariance, True)

    monkeypatch.setattr(wind_apply, "synthesise", synthesise)


def applied(folder: Path, sign: int = 1, **which: str):
    statistics = shipped_statistics(which.get("period", "march"), which.get("component", "meridional"), top=3e4)
    return apply_wind(folder, statistics, np.pi / 2, sign, "test")


@pytest.mark.slow
def test_the_command_writes_filter_mean_deviation_and_record_of_one_wind(falcon):
    before = tomllib.loads((falcon / "vehicle.toml").read_text())
    arguments = ["wind", "apply", str(falcon), "--component", "meridional", "--period", "february", "--edition", "2006"]
    found = CliRunner().invoke(app, arguments)
    assert found.exit_code == 0, found.output
    assert "no longer used: wind_march_meridional.csv, wind_march_meridional_filter.json" in found.output
    vehicle = quiet(falcon)
    record = vehicle.wind.record
    assert record is not None
    assert record.origin == WindOrigin("Cape Canaveral", "meridional", "february", "2006")
    assert record.independent_samples == REPORT_SAMPLES
    assert (record.azimuth, record.sign, record.held_above) == (pytest.approx(np.pi / 2), 1, 30000.0)
    table = range_reference("february", "2006")
    kilometres = (table.altitude % 1000 == 0) & (table.altitude <= 30000)
    h = table.altitude[kilometres]
    assert isinstance(vehicle.wind, WindModel)
    assert vehicle.wind.mean.polynomial(h) == pytest.approx(table.mean["meridional"][kilometres], abs=6e-4)
    wanted = table.standard_deviation["meridional"][kilometres]
    assert standard_deviation(vehicle.wind.shaping_filter, h) == pytest.approx(wanted, rel=1e-3)
    after = tomllib.loads((falcon / "vehicle.toml").read_text())
    assert before.pop("wind") != after.pop("wind")
    assert before == after


def test_applied_again_nothing_is_added_and_another_wind_overwrites_no_file(falcon, no_fit):
    first = applied(falcon)
    kept = {p.name: p.read_bytes() for p in falcon.iterdir() if p.is_file()}
    assert applied(falcon).files == first.files
    assert {p.name: p.read_bytes() for p in falcon.iterdir() if p.is_file()} == kept
    second = applied(falcon, sign=-1)
    assert second.unused == tuple(p.name for p in first.files[:1])
    for name in kept.keys() - {"vehicle.toml"}:
        assert (falcon / name).read_bytes() == kept[name]
    one, other = load_vehicle(built_in_vehicles()["falcon1"]).wind, quiet(falcon).wind
    assert isinstance(one, WindModel)
    assert isinstance(other, WindModel)
    assert other.mean.values == pytest.approx(-one.mean.values, abs=1e-9)


def test_comments_and_sections_around_the_wind_stay(falcon, no_fit):
    toml = falcon / "vehicle.toml"
    text = toml.read_text().replace("[options]", "# about options\n[options]")
    toml.write_text(text)
    applied(falcon)
    changed = toml.read_text()
    assert "# about options\n[options]" in changed
    assert changed.partition("[wind]")[0] == text.partition("[wind]")[0]
    assert changed.partition("# about options")[2] == text.partition("# about options")[2]


def test_turbulence_goes_with_any_wind(falcon, no_fit):
    toml, old = falcon / "vehicle.toml", 'severity = "moderate"'
    text = toml.read_text()
    assert old in text
    toml.write_text(text.replace(old, f"length_m = 400.0\n{old}"))
    applied(falcon)
    assert f"length_m = 400.0\n{old}" in toml.read_text()
    turbulence = quiet(falcon).turbulence
    assert turbulence is not None
    assert turbulence.length == 400.0


def test_a_wind_is_written_whole_or_not_at_all(falcon, no_fit, monkeypatch):
    before = {p.name: p.read_bytes() for p in falcon.iterdir() if p.is_file()}
    write = wind_apply.write_text

    def fails_at(name: str):
        def broken(path: Path, text: str):
            if path.suffix == name:
                raise OutputFolderError("disk full")
            return write(path, text)

        return broken

    for suffix in (".csv", ".json", ".toml"):
        monkeypatch.setattr(wind_apply, "write_text", fails_at(suffix))
        with pytest.raises(OutputFolderError, match="disk full"):
            applied(falcon, period="july")
        assert {p.name: p.read_bytes() for p in falcon.iterdir() if p.is_file()} == before


@pytest.mark.parametrize(
    ("spoil", "arguments", "says"),
    [
        (None, ["--component", "zonal"], "blows along a flight path of azimuth 90 deg"),
        (None, ["--component", "meridional", "--azimuth", "80"], "is 90, but --azimuth 80 was given"),
        (None, ["--component", "meridonal"], "did you mean 'meridional'"),
        (None, ["--component", "meridional", "--sign", "3"], "give 1 or -1"),
        (None, ["--component", "meridional", "--site", "here"], "--site is not used without --soundings"),
        (None, ["--component", "meridional", "--soundings", "s.csv"], "give --site"),
        ("no construction", ["--component", "meridional"], "give --azimuth"),
        ("no vehicle", ["--component", "meridional"], "vehicle.toml"),
        ("wind in one line", ["--component", "meridional"], "sections of their own"),
        ("wind as dotted keys", ["--component", "meridional"], "sections of their own"),
        ("broken", ["--component", "meridional"], "sections of their own in a valid TOML file"),
    ],
)
def test_what_the_command_refuses_changes_nothing(falcon, no_fit, spoil, arguments, says):
    toml = falcon / "vehicle.toml"
    head, _, tail = toml.read_text().partition("[wind]\n")
    if spoil == "no construction":
        (falcon / "construction.toml").unlink()
    elif spoil == "no vehicle":
        toml.unlink()
    elif spoil == "wind in one line":
        toml.write_text('wind = { filter = "a.json" }\n' + head + tail[tail.index("[options]") :])
    elif spoil == "wind as dotted keys":
        toml.write_text('wind.filter = "a.json"\n' + head + tail[tail.index("[options]") :])
    elif spoil == "broken":
        toml.write_text(head + "[wind]\n" + tail + "\nx = [\n")
    before = {p.name: p.read_bytes() for p in falcon.iterdir() if p.is_file()}
    found = CliRunner().invoke(app, ["wind", "apply", str(falcon), *arguments])
    assert isinstance(found.exception, AscentwindError), found.output
    assert says in str(found.exception)
    assert {p.name: p.read_bytes() for p in falcon.iterdir() if p.is_file()} == before


def test_a_shipped_vehicle_is_not_changed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = CliRunner().invoke(app, ["wind", "apply", "as504", "--component", "zonal"])
    assert "new-vehicle DIR --from as504" in str(found.exception)


def test_wind_of_soundings_carries_their_site_and_days(falcon, no_fit, tmp_path):
    random, file = np.random.default_rng(3), tmp_path / "omelek.csv"
    levels, rows = range(0, 30001, 2000), ["profile,date,altitude [m],u [m/s],v [m/s]"]
    for i in range(40):
        shared = random.standard_normal(2)
        for h in levels:
            u, v = 6 * (0.6 * shared + 0.8 * random.standard_normal(2))
            rows.append(f"{i},2003-01-{1 + i % 31:02d},{h},{u:.3f},{v + 2:.3f}")
    file.write_text("\n".join(rows) + "\n")
    arguments = ["--component", "meridional", "--soundings", str(file), "--site", "Omelek"]
    found = CliRunner().invoke(app, ["wind", "apply", str(falcon), *arguments])
    assert found.exit_code == 0, found.output
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a lag between levels 2 km apart is no fit
        record = load_vehicle(falcon).wind.record
    assert record is not None
    assert record.origin == WindOrigin("Omelek", "meridional", "2003-01-01 to 2003-01-31", "soundings of omelek.csv")
    statistics = read_soundings(file).statistics("omelek").meridional
    assert record.independent_samples == pytest.approx(statistics.independent_samples, abs=1e-3)


def test_building_for_another_azimuth_asks_for_another_wind(falcon):
    file = falcon / "construction.toml"
    file.write_text(file.read_text().replace("azimuth_deg = 90.0", "azimuth_deg = 80.0"))
    with pytest.raises(DataError, match=r"wind.record.azimuth_deg.*is 90, but construction.toml flies towards 80 deg"):
        build_vehicle(falcon)


def test_wind_of_a_matrix_carries_its_record(falcon, no_fit, tmp_path):
    levels = np.arange(0.0, 30001.0, 2000.0)
    matrix = 36.0 * np.exp(-np.abs(levels[:, None] - levels) / 5000.0)
    names = ",".join(f"covariance_{k + 1} [m2/s2]" for k in range(levels.size))
    rows = [f"altitude [m],component,mean [m/s],{names}"]
    rows += [f"{h:g},meridional,2," + ",".join(f"{x:.9g}" for x in row) for h, row in zip(levels, matrix, strict=True)]
    file = tmp_path / "mine.csv"
    file.write_text("\n".join(rows) + "\n")
    asked = ["wind", "apply", str(falcon), "--component", "meridional", "--matrix", str(file), "--site", "Omelek"]
    found = CliRunner().invoke(app, [*asked, "--period", "august", "--samples", "55"])
    assert found.exit_code == 0, found.output
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a lag between levels 2 km apart is no fit
        record = load_vehicle(falcon).wind.record
    assert record is not None
    assert record.origin == WindOrigin("Omelek", "meridional", "august", "mine.csv")
    assert record.independent_samples == 55
    for arguments, says in (
        (asked, "give --site, --period and --samples"),
        ([*asked, "--period", "august", "--samples", "55", "--component", "zonal"], "no component in mine.csv 'zonal'"),
    ):
        found = CliRunner().invoke(app, arguments)
        assert says in str(found.exception)


def test_soundings_give_both_components(falcon, no_fit, tmp_path):
    random, file = np.random.default_rng(5), tmp_path / "omelek.csv"
    rows = ["profile,date,altitude [m],u [m/s],v [m/s]"]
    for i in range(40):
        shared = random.standard_normal(2)
        for h in range(0, 30001, 3000):
            if i == 7 and h > 20000:
                continue  # a burst
            u, v = 6 * (0.6 * shared + 0.8 * random.standard_normal(2))
            rows.append(f"{i},2003-01-{1 + i % 31:02d},{h},{u:.3f},{v + 2:.3f}")
    file.write_text("\n".join(rows) + "\n")
    asked = ["wind", "apply", str(falcon), "--components", "both", "--soundings", str(file), "--site", "Omelek"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = CliRunner().invoke(app, asked)
    assert found.exit_code == 0, found.output or found.exception
    assert "1 of 40 profiles lack levels" in found.output
    assert "[wind.components]" in (falcon / "vehicle.toml").read_text()
