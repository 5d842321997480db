"""Bad input: typed, one or two sentences, naming file, column, row or time and the way out; exit code 2; nothing half-written."""

from __future__ import annotations

import re
import sys

import pytest

from ascentwind.model.errors import (
    AscentwindError,
    DataError,
    DirectNoiseError,
    IntegrationError,
    OutputFolderError,
    SingularCouplingError,
    TimeRangeError,
    UnknownNameError,
    UnstableSystemWarning,
)
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Cvodes, Study
from ascentwind.runners.case.times import parse_times
from ascentwind.runners.cli.app import main
from ascentwind.runners.cli.new_vehicle import copy_vehicle
from ascentwind.runners.present.files import prepare_folder

RIGID = "rigid_body.csv"


def second_cell(file: str, time: str) -> str:
    """Return what a shipped table holds beside a time."""
    lines = (built_in_vehicles()["as504"] / file).read_text().splitlines()
    return next(line.split(",")[1] for line in lines if line.startswith(f"{time},"))


MASS, MASS_100, ALTITUDE = second_cell(RIGID, "2"), second_cell(RIGID, "100"), second_cell("trajectory.csv", "60")
# (file, what is replaced, by what, what the message must hold)
SPOILED = [
    pytest.param(RIGID, "moment_of_inertia", "moment_of_inertai", r"rigid_body.csv: column 'moment_of_inertia \[kg m2\]' is missing; did you mean 'moment_of_inertai'", id="missing column"),
    pytest.param(RIGID, "mass [kg]", "mass [lb]", r"rigid_body.csv, column 'mass': unit is \[lb\], expected \[kg\]; convert", id="wrong unit"),
    pytest.param(RIGID, "mass [kg]", "mass", r"rigid_body.csv, line 3: header 'mass' has no unit; write it as", id="no unit"),
    pytest.param(RIGID, "mass [kg]", "mass [kg],mass [kg]", r"column 'mass', line 3: stands twice", id="column twice"),
    pytest.param(RIGID, "\n2,", "\n0.5,", r"rigid_body.csv, column 'time', line 5: 0.5 comes after 1; sort the rows", id="unsorted"),
    pytest.param(RIGID, "\n2,", "\n1,", r"rigid_body.csv, column 'time', line 5: 1 repeats the row above", id="repeated"),
    pytest.param(RIGID, f"\n2,{MASS},", "\n2,nan,", r"rigid_body.csv, column 'mass', line 5: 'nan' is not a finite number", id="NaN"),
    pytest.param(RIGID, f"\n2,{MASS},", "\n2,,", r"rigid_body.csv, column 'mass', line 5: '' is not a finite number", id="empty cell"),
    pytest.param(RIGID, f"\n2,{MASS},", f"\n2,-{MASS},", r"rigid_body.csv, column 'mass', line 5: -2.88047e\+06 is not positive", id="negative mass"),
    pytest.param(RIGID, f"\n2,{MASS},", f"\n2,5,{MASS},", r"rigid_body.csv, line 5: has 5 cells where the header has 4", id="extra cell"),
    pytest.param("slosh_sic_lox.csv", "mass [kg]", "mass [kg],level [m]", r"line 4: has 4 cells", id="header longer than rows"),
    pytest.param("vehicle.toml", 'file = "rigid_body.csv"', 'file = "rigid.csv"', r"rigid.csv: cannot be read \(No such file", id="missing file"),
    pytest.param("vehicle.toml", "start_time_s = 10.0", "start_time_s = 0.5", r"vehicle.toml, column 'start_time_s': start_time_s = 0.5 lies before the first row of \w+.csv at 1 s", id="start before tables"),
    pytest.param("vehicle.toml", "start_time_s = 10.0", "start_time_s = 200.0", r"start_time_s = 200 is not before the end of \w+.csv at 150 s", id="start after end"),
    pytest.param("vehicle.toml", "start_time_s = 10.0", "start_tim_s = 10.0", r"start_tim(e)?_s.*(missing|not a key)", id="misspelt key"),
    pytest.param("vehicle.toml", "full_coupling = false", "full_copling = false", r"column 'options.full_copling': is not a key here; did you mean 'full_coupling'", id="misspelt option"),
    pytest.param("vehicle.toml", "damping = 0.01 ", "damping = -0.01 ", r"slosh.0.damping': Input should be greater than or equal to 0 \(found -0.01\)", id="negative damping"),
    pytest.param("vehicle.toml", "correlation_time_s = 1.0 ", "correlation_time_s = 0.0 ", r"correlation_time_s': Input should be greater than 0", id="zero correlation time"),
    pytest.param("vehicle.toml", '"thrust", "control_thrust"', '"thrust", "controll_thrust"', r"noise.thrust': there is no table 'controll_thrust'; did you mean 'control_thrust'", id="unknown noise table"),
    pytest.param("vehicle.toml", 'tables = ["center_of_pressure"]', 'tables = ["relative_velocity"]', r"'relative_velocity' changes the angle of attack or engine angle itself", id="noise on velocity"),
    pytest.param("vehicle.toml", 'tables = ["center_of_pressure"]', 'tables = ["altitude"]', r"deviations of altitude change nothing", id="noise without effect"),
    pytest.param("vehicle.toml", 'tables = ["center_of_pressure"]', 'tables = ["slosh.sic_lox.frequency"]', r"act on more than the mean angle of attack", id="noise on slosh frequency"),
    pytest.param("vehicle.toml", 'events = ["center_engine_cutoff"]', 'events = ["center_engine_cutof"]', r"event 'center_engine_cutof' is not listed under \[events\]; did you mean 'center_engine_cutoff'", id="unknown event"),
    pytest.param("vehicle.toml", "numerator = [1188.87]", "numerator = [1.0, 0.0, 0.0, 1188.87]", r"control.T3': has a numerator of higher order", id="improper transfer function"),
    pytest.param("vehicle.toml", 'name = "sic_rp1"', 'name = "sic_lox"', r"two slosh tanks have the same name", id="same tank twice"),
    pytest.param("vehicle.toml", "value = [0.651,", "value = [1.651,", r"short_fraction between 0 and 1", id="fraction above one"),
    pytest.param("vehicle.toml", "format = 1", "format = [", r"vehicle.toml: is not valid TOML", id="broken TOML"),
    pytest.param("wind_march_zonal.csv", "1000,2.64,6.85", "1000,2.64,-6.85", r"column 'standard_deviation', line 5: -6.85 is not positive", id="negative sigma"),
    pytest.param("trajectory.csv", f"\n60,{ALTITUDE},", "\n60,7992.99,", r"trajectory.csv, column 'altitude', t = 6[01][.\d]* s: does not increase", id="altitude falls"),
    pytest.param(RIGID, f"\n100,{MASS_100},", "\n100,1e12,", r"rigid_body.csv, column 'mass', t = [\d.]+ s: the interpolation between rows is not positive.*pchip", id="overshoot"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new", "message"), SPOILED)
def test_spoiled_vehicle_is_refused(edit, file, old, new, message):
    folder = edit(old, new, file)
    with pytest.raises(DataError, match=message) as caught:
        Study.load(folder, compile=False)
    assert all(len(re.findall(r"[.;](\s|$)", line)) <= 3 for line in str(caught.value).splitlines())


def test_table_that_ends_before_the_time_asked_for(vehicle_folder):
    path = vehicle_folder / "bending_1.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line for line in lines if not re.match(r"(1[0-9][0-9]|9[0-9])", line)) + "\n")
    study = Study.load(vehicle_folder, compile=False)
    with pytest.raises(TimeRangeError, match="end time 100 s lies beyond the last row of bending_1.csv at 89 s"):
        study.response_statistics([100.0])


def test_singular_coupling_names_the_time(vehicle_folder):
    path = vehicle_folder / "bending_1.csv"
    lines = [line.split(",") for line in path.read_text().splitlines()]
    for cells in lines[3:]:
        cells[2] = "500"  # generalised mass, kg, below what the slosh masses weigh in the mode
    path.write_text("\n".join(",".join(cells) for cells in lines) + "\n")
    with pytest.raises(SingularCouplingError, match="at 10 s the mass matrix of bending and slosh is singular"):
        Study.load(vehicle_folder, compile=False)


def test_unstable_loop_is_warned_of_with_time_and_root_and_still_computed(as504):
    study = as504.with_parameters({"control.T1.gain": -0.2, "control.T2.gain": 0.1})
    with pytest.warns(UnstableSystemWarning, match=r"frozen at [\d.]+ s is unstable: root \+[\d.e-]+ .*rad/s in \w+"):
        found = study.response_statistics([40.0])
    assert (found.variance.sel(response=["bending_moment", "angle_of_attack", "engine_angle"]) > 0).all()


def test_white_noise_reaching_the_bending_moment_is_refused(edit):
    edit("sigma = 0.01\ncorrelation_time_s = 1.0 ", "sigma = 0.01\nwhite = true\n# ")
    study = Study.load(edit("format = 1", "format = 1"), compile=False)
    with pytest.raises(DirectNoiseError, match="'thrust' reaches 'bending_moment' directly.*colour the noise"):
        study.response_statistics([30.0])
    found = study.response_statistics([30.0], responses=["angle_of_attack", "engine_angle"])
    assert (found.std.sel(source="thrust") > 0).all()


def test_other_refusals(tmp_path, vehicle_folder):
    with pytest.raises(UnknownNameError, match="no vehicle or folder 'as505'; did you mean 'as504'"):
        Study.load("as505")
    with pytest.raises(DataError, match="holds no vehicle.toml"):
        load_vehicle(tmp_path)
    with pytest.raises(IntegrationError, match="cannot be met"):
        Cvodes(relative_tolerance=1e-16)
    with pytest.raises(IntegrationError, match="method 'rk4' is not known"):
        Cvodes(method="rk4")  # type: ignore[arg-type]
    with pytest.raises(OutputFolderError, match="exists already and is not empty"):
        copy_vehicle("as504", vehicle_folder)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputFolderError, match="cannot be written"):
        prepare_folder(tmp_path / "file" / "results")


def test_integrator_that_gives_up_says_where(as504):
    with pytest.raises(IntegrationError, match=r"more than 50 steps .* between 10 s and 60 s; the fastest root"):
        as504.response_statistics([60.0], engine=Cvodes(max_steps=50))


@pytest.mark.parametrize("text", ["40:100", "a,b", "100:40:5", "40:100:0", "40:100:-5", "nan:1:1", "0:1:1e-9", ""])
def test_bad_times_are_refused(text):
    with pytest.raises(TimeRangeError, match="START:STOP:STEP|larger step"):
        parse_times(text)


def test_times_are_read():
    assert parse_times("40:50:5") == [40.0, 45.0, 50.0]
    assert parse_times("0:0.3:0.1") == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert parse_times("75") == [75.0]
    assert parse_times("70, 60.5") == [70.0, 60.5]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "as505"], "did you mean 'as504'"),
        (["run", "as504", "--times", "5:20:5"], "before the start at 10 s"),
        (["run", "as504", "--times", "x"], "does not name times"),
        (["run", "as504", "--times", "60:70"], "such as 40:100:5"),
        (["equations", "as504", "--by", "mass"], "--by mass needs --of"),
        (["run", "as504", "--method", "euler"], "method 'euler' is not known"),
        (["run", "as504", "--set", "options.ful_coupling=true"], "did you mean 'full_coupling'"),
        (["run", "as504", "--set", "options.full_coupling"], "write KEY=VALUE"),
        (["run", "as504", "--set", "options.full_coupling=yes"], "should be a valid boolean (found 'yes')"),
        (["run", "as504", "--azimuths", "0:400:10"], "370 deg is not between 0 and 360"),
        (["run", "as504", "--azimuths", "0,90"], "an azimuth is of both planes, and 'as504' has one alone"),
        (["run", "falcon1", "--set", "planes=both"], "wind apply VEHICLE --components both"),
        (["run", "as504", "--set", "planes=roll"], "'yaw', 'pitch' or 'both'"),
        (["mean", "as504", "--set", "planes=pitch"], "known for the yaw plane alone"),
        (["wind", "apply", ".", "--azimuth", "72"], "give --component zonal"),
        (
            ["wind", "apply", ".", "--azimuth", "72", "--components", "three"],
            "no choice of components 'three'; known: both",
        ),
        (["run", "as504", "--set", "bending.7.damping=0.01"], "'7' is not an item of a list of 2; count from 0 to 1"),
        (["run", "as504", "--set", "title.x=1"], "it is a value, not a section"),
        (["inspect", "as504", "--time", "6_0"], "'6_0' is not a number"),
        (["inspect", "as504", "--time", "nan"], "'nan' is not a number"),
        (["verify", "as504", "--runs", "5_00"], "'5_00' is not a whole number"),
        (["wind", "fit", "--order", "3.0"], "'3.0' is not a whole number"),
        (["sensitivity", "as504", "--response", "bending_momen"], "did you mean 'bending_moment'"),
        (["sensitivity", "as504", "--source", "winds"], "did you mean 'wind'"),
        (["sensitivity", "as504", "--quantity", "sd"], "quantity 'sd'"),
        (["sensitivity", "as504", "--time", "5"], "before the start at 10 s"),
        (["tolerance", "as504", "--times", "5"], "before the start at 10 s"),
        (["verify", "as504", "--times", "5", "--out", "{tmp}/results"], "before the start at 10 s"),
        (["wind", "plot", "missing.json"], "cannot be read"),
        (["inspect", "as504", "--time", "151"], "beyond the last row"),
        (["new-vehicle", "{tmp}", "--from", "as999"], "no vehicle or folder 'as999'"),
        (["run", "as504", "--out", "{tmp}/file/x"], "cannot be written"),
    ],
)
def test_command_line_ends_with_a_sentence_and_code_2(arguments, message, tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["ascentwind", *(a.replace("{tmp}", str(tmp_path)) for a in arguments)])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    printed = capsys.readouterr()
    assert message in re.sub(r"\s+", " ", printed.err)
    assert "Traceback" not in printed.err + printed.out
    assert [p.name for p in tmp_path.rglob("*")] == ["file"], "something was written before the names were checked"


def test_every_error_is_an_ascentwind_error():
    for error in (
        DataError,
        DirectNoiseError,
        IntegrationError,
        SingularCouplingError,
        TimeRangeError,
        UnknownNameError,
    ):
        assert issubclass(error, AscentwindError)
