"""Soundings and limits that cannot be used: refused in Python and by the commands, and nothing is written."""

from __future__ import annotations

import datetime
import importlib
import importlib.util

import numpy as np
import pytest
import sounding_files as files

from ascentwind.model.errors import DataError
from ascentwind.model.wind.soundings.read import read_soundings
from ascentwind.runners.cli.app import main

LEVELS = np.array([0.0, 1000.0, 2500.0, 5000.0, 8000.0, 11000.0])
HEAD = "profile,date,altitude [m],u [m/s],v [m/s]\n"
LIMIT = "time [s],bending_moment [N m]\n0,2.3e7\n150,2.3e7\n"


def winds(count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(2)
    return 10 + LEVELS / 500 + random.normal(0, 3, (count, LEVELS.size)), random.normal(0, 3, (count, LEVELS.size))


def own(change=lambda text: text, **more) -> str:
    return change(files.own_text(LEVELS, *winds(), **more))


def igra(**more) -> str:
    return files.igra_text(LEVELS, *winds(), **more)


def with_stations(text: str) -> str:
    """Return our own CSV with a column of stations, the last profile of another one."""
    head, *rows = text.splitlines()
    return "\n".join([f"{head},station", *(f"{row},{'B' if row.startswith('11,') else 'A'}" for row in rows)])


def twice(hours: bool) -> str:
    rows = [f"{{}},2003-03-01{'T12:00' if hours else ''},{h:g},5,0" for h in LEVELS]
    return HEAD + "\n".join(row.format(name) for name in "ab" for row in rows)


def era5(folder, change, engine="scipy"):
    file = folder / "field.nc"
    change(files.era5(LEVELS, *winds(3), new=False)).to_netcdf(file, engine=engine)
    return file


def in_calendar(field, attributes):
    return field.assign_coords(time=("time", np.array([0.0, 1.0, 2.0]), attributes))


def text(name: str, content: str):
    def written(folder):
        (folder / name).write_text(content)
        return folder / name

    return written


def grib(folder):
    (folder / "field.grib").write_bytes(b"GRIB\0\0\0\1")
    return folder / "field.grib"


# what is wrong, the file, and what is told of it: where, and the way out
BAD_FILES = {
    "mixed stations in a file": (
        text("s.csv", own(with_stations)),
        ["s.csv", "sounding 11 of 2003-03-12T12:00", "station 'B'", "'A'", "read the stations one by one"],
    ),
    "a station beside none": (
        text("s.csv", own(with_stations).replace(",A", ",")),
        ["sounding 11", "is of station 'B', and others are of ''", "one by one"],
    ),
    "a date twice": (
        text("s.csv", twice(True)),
        ["s.csv", "line 8", "sounding b", "2003-03-01 12:00 stands twice", "keep one"],
    ),
    "a day twice, without hours": (
        text("s.csv", twice(False)),
        ["line 8", "has the date and the winds of sounding a", "2003-03-01 stands twice", "keep one of the two"],
    ),
    "a date twice in an archive": (
        text("igra.txt", igra(when=[datetime.datetime(2003, 3, 1, 12)] * 12)),
        ["igra.txt", "line 9", "2003-03-01 12:00 stands twice"],
    ),
    "levels out of order": (
        text("s.csv", HEAD + "a,2003-03-01,0,5,0\na,2003-03-01,2000,5,0\na,2003-03-01,1000,5,0\n"),
        ["s.csv, line 4", "sounding a, 1000 m", "comes after 0 and 2000 m", "sort the rows"],
    ),
    "a level twice": (
        text("s.csv", HEAD + "a,2003-03-01,0,5,0\na,2003-03-01,0,6,0\n"),
        ["line 3", "profile 'a' has the level 0 m twice"],
    ),
    "levels out of order in a list": (
        text("list.txt", files.wyoming_list_text(LEVELS[[0, 2, 1, 3]], *(w[:, :4] for w in winds(1)))),
        ["list.txt", "1000 m", "comes after 2500 m", "sort them"],
    ),
    "knots under m/s": (
        text("s.csv", HEAD + "".join(f"a,2003-03-01,{h:g},{5 + h / 60:g},0\n" for h in LEVELS)),
        ["s.csv", "188.333 m/s at 11000 m", "line 7", "are these knots", "outliers='drop'"],
    ),
    "knots under m/s in a list": (
        text("igra.txt", files.igra_text(LEVELS, 20 * winds(1)[0], 20 * winds(1)[1])),
        ["igra.txt, line", "sounding USM00074794 2003-03-01 12 UTC", "are these knots", "correct the file"],
    ),
    "a direction over 360": (
        text("s.csv", "altitude [m],speed [m/s],direction [deg]\n0,5,10\n1000,5,361\n"),
        ["s.csv, line 3", "1000 m", "361 deg is no direction", "0 to 360"],
    ),
    "a direction below zero": (
        text("s.csv", "altitude [m],speed [m/s],direction [deg]\n0,5,-1\n"),
        ["line 2", "-1 deg is no direction"],
    ),
    "no variable of wind": (
        lambda f: era5(f, lambda d: d.drop_vars("u")),
        ["field.nc", "no variable of u", "it has v, z"],
    ),
    "no height": (lambda f: era5(f, lambda d: d.drop_vars("z")), ["no variable of geopotential", "it has u, v"]),
    "another calendar": (
        lambda f: era5(f, lambda d: in_calendar(d, {"units": "days since 2003-03-01", "calendar": "noleap"})),
        ["field.nc", "the calendar 'noleap'", "take a field in the standard calendar"],
    ),
    "times from nowhere": (
        lambda f: era5(f, lambda d: in_calendar(d, {})),
        ["field.nc", "numbers without 'units' such as 'hours since", "say what they count from"],
    ),
    "times without a begin": (
        lambda f: era5(f, lambda d: in_calendar(d, {"units": "hours"})),
        ["numbers without 'units' such as 'hours since"],
    ),
    "a field whose wind is in knots": (
        lambda f: era5(f, lambda d: d.assign(v=d["v"].assign_attrs(units="knots"))),
        ["v is in 'knots', expected m s"],
    ),
    "a field without a unit": (
        lambda f: era5(f, lambda d: d.assign(z=d["z"].drop_attrs())),
        ["geopotential has no unit, expected m**2 s**-2"],
    ),
    "only gaps": (
        text("s.csv", HEAD + "a,2003-03-01,12000,5,0\na,2003-03-01,13000,5,0\n"),
        ["no profile holds any of the 6 levels", "ask for others"],
    ),
    "nothing but a header": (text("s.csv", HEAD), ["s.csv", "no sounding is left of 0 read", "give other files"]),
    "none at all": (lambda f: f / "none.csv", ["none.csv", "cannot be read", "check its name"]),
}


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["ascentwind", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


def refused(monkeypatch, capsys, folder, says, *arguments) -> None:
    """Assert that a command ends with 2, says all parts, shows no traceback, and leaves the folder as it was."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    monkeypatch.chdir(folder)
    assert run(monkeypatch, *arguments) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert "Traceback" not in told
    for part in says:
        assert part in told, told
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_files_are_refused_in_python_and_by_the_command(case, tmp_path, monkeypatch, capsys):
    make, says = BAD_FILES[case]
    file = make(tmp_path)
    with pytest.raises(DataError) as error:
        read_soundings(file, LEVELS)
    assert error.value.file and str(error.value.file).endswith(file.name)
    for part in says:
        assert part in str(error.value), str(error.value)
    levels = ",".join(f"{h:g}" for h in LEVELS)
    refused(monkeypatch, capsys, tmp_path, says, "wind", "read", file, "--levels", levels, "--out", tmp_path / "o.csv")


@pytest.mark.parametrize("broken", [False, True], ids=["missing", "does not start"])
def test_a_library_for_grib_is_named(broken, tmp_path, monkeypatch, capsys):
    """Not installed; installed without what it needs itself."""
    file = grib(tmp_path)
    if broken:
        monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: object())

        real = importlib.import_module

        def fails(name: str, *a):
            if name == "cfgrib":
                raise RuntimeError("Cannot find the ecCodes library")
            return real(name, *a)

        monkeypatch.setattr(importlib, "import_module", fails)
        says = [
            "field.grib",
            "does not start (Cannot find the ecCodes library)",
            "pip install --force-reinstall cfgrib eccodes",
        ]
    else:
        monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: None)
        says = ["field.grib", "is GRIB", "pip install cfgrib", "convert the file"]
    refused(
        monkeypatch, capsys, tmp_path, says, "wind", "read", file, "--levels", "0,1000", "--out", tmp_path / "o.csv"
    )


def ten(text_of_date: str = "2003-03-{:02d}T12:00") -> str:
    u, v = winds(12)
    rows = [
        f"{k},{text_of_date.format(k + 1)},{h:g},{u[k, j]:.3f},{v[k, j]:.3f}"
        for k in range(12)
        for j, h in enumerate(LEVELS)
    ]
    return HEAD + "\n".join(rows) + "\n"


LOW = HEAD + "a,2003-03-01,-50,5,0\na,2003-03-01,-20,6,0\n"
BALLOON = "altitude [m],u [m/s],v [m/s]\n" + "".join(f"{h},{10 + h / 500},0\n" for h in range(300, 13000, 400))
COMMANDS = {
    "fly: mixed stations": (
        ["fly", "as504", "bad.csv"],
        {"bad.csv": own(with_stations)},
        ["station 'B'", "one by one"],
    ),
    "fly: ends below the flight": (
        ["fly", "as504", "bad.csv"],
        {"bad.csv": LOW},
        ["sounding a", "holds -50 to -20 m, and the flight goes from"],
    ),
    "day: mixed stations": (
        [
            "day-of-launch",
            "as504",
            "--sounding",
            "a.csv",
            "--hours-before",
            "6",
            "--sounding",
            "b.csv",
            "--hours-before",
            "2",
        ],
        {
            name: BALLOON.replace("\n", f",{name[0]}\n").replace(f"[m/s],{name[0]}", "[m/s],station")
            for name in ("a.csv", "b.csv")
        },
        ["b.csv", "station 'b'", "of 'a'", "take balloons of one station"],
    ),
    "day: the same balloon again": (
        [
            "day-of-launch",
            "as504",
            "--sounding",
            "a.csv",
            "--hours-before",
            "6",
            "--sounding",
            "a.csv",
            "--hours-before",
            "2",
        ],
        {"a.csv": BALLOON.replace("\n", ",2003-03-01T12:00\n").replace("[m/s],2003-03-01T12:00", "[m/s],date")},
        ["a.csv", "is dated +0 h from", "2 and 6 h before launch make that +4 h", "take the right file"],
    ),
    "day: two soundings": (
        ["day-of-launch", "as504", "--sounding", "bad.csv", "--hours-before", "3"],
        {"bad.csv": ten()},
        ["bad.csv", "holds 12 soundings", "give the one before launch"],
    ),
    "day: ends below the flight": (
        ["day-of-launch", "as504", "--sounding", "bad.csv", "--hours-before", "3"],
        {"bad.csv": LOW},
        ["bad.csv", "sounding a", "and the flight goes from", "give one that is there"],
    ),
    "day: knots": (
        ["day-of-launch", "as504", "--sounding", "bad.csv", "--hours-before", "3"],
        {"bad.csv": "altitude [m],u [m/s],v [m/s]\n500,3,0\n1000,140,0\n"},
        ["bad.csv", "1000 m", "standard deviations from the mean", "is it in knots"],
    ),
    "day: a limit in kN m": (
        ["day-of-launch", "as504", "--sounding", "a.csv", "--hours-before", "3"],
        {"a.csv": BALLOON, "limit.csv": LIMIT.replace("N m", "kN m")},
        ["limit.csv", "[kN m], expected [N m]"],
    ),
    "day: a limit without a unit": (
        ["day-of-launch", "as504", "--sounding", "a.csv", "--hours-before", "3"],
        {"a.csv": BALLOON, "limit.csv": LIMIT.replace(" [N m]", "")},
        ["limit.csv, line 1", "'bending_moment' has no unit"],
    ),
    "availability: a limit in kN m": (
        ["availability", "as504"],
        {"limit.csv": LIMIT.replace("N m", "kN m")},
        ["limit.csv", "[kN m], expected [N m]"],
    ),
    "availability: an empty month": (
        ["availability", "as504", "--winds", "mine", "--months", "may"],
        {"mine/march.json": None},
        ["mine", "holds no may; it has march"],
    ),
    "months: an empty month": (
        ["wind", "months", "--soundings", "s.csv", "--site", "Here", "--months", "july", "--out", "mine"],
        {"s.csv": ten()},
        ["s.csv", "no sounding is left of 12 read", "another month"],
    ),
    "months: too few days": (
        ["wind", "months", "--soundings", "s.csv", "--site", "Here", "--out", "mine"],
        {"s.csv": "".join(ten().splitlines(True)[:49])},
        ["s.csv", "no month has statistics", "8 profiles hold", "statistics need 10"],
    ),
    "months: no dates": (
        ["wind", "months", "--soundings", "s.csv", "--site", "Here", "--out", "mine"],
        {"s.csv": ten("")},
        ["s.csv", "its profiles have no dates", "add a column 'date'"],
    ),
    "read: an empty month": (
        ["wind", "read", "s.csv", "--months", "july", "--out", "o.csv"],
        {"s.csv": ten()},
        ["s.csv", "no sounding is left of 12 read", "12 passed over: another month", "ask for other months"],
    ),
    "stats: a date twice": (
        ["wind", "stats", "--soundings", "s.csv"],
        {"s.csv": twice(True)},
        ["s.csv", "stands twice"],
    ),
    "fit: a date twice": (
        ["wind", "fit", "--soundings", "s.csv", "--out", "f.json"],
        {"s.csv": twice(True)},
        ["s.csv", "stands twice"],
    ),
    "apply: mixed stations": (
        ["wind", "apply", "mine", "--component", "zonal", "--azimuth", "72", "--soundings", "s.csv", "--site", "Here"],
        {"s.csv": own(with_stations), "mine/vehicle.toml": "title = 'x'\n"},
        ["s.csv", "station 'B'"],
    ),
}


@pytest.mark.parametrize("case", COMMANDS)
def test_commands_refuse_what_they_cannot_use(case, cache, tmp_path, monkeypatch, capsys):
    arguments, content, says = COMMANDS[case]
    for name, what in {"limit.csv": LIMIT, **content}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(what or "{}")
    more = ["--limit", "limit.csv"] if arguments[0] in ("day-of-launch", "availability") else []
    refused(monkeypatch, capsys, tmp_path, says, *arguments, *more)
