"""Results and vehicles carry no other's name: copies, stations in file names, files of an earlier run."""

from __future__ import annotations

import csv
import json
import shutil
import tomllib
from pathlib import Path

import pytest

from ascentwind.model import load_vehicle
from ascentwind.model.construction.construction_file import construction_files, load_construction
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.cli.new_vehicle import copy_vehicle, sourced, sourced_rows
from ascentwind.runners.construct.build_vehicle import build_vehicle
from ascentwind.runners.present.manifest import MANIFEST, Manifest

SHIPPED = built_in_vehicles()


def sources_in(data) -> list[str]:
    if isinstance(data, list):
        return [s for item in data for s in sources_in(item)]
    if not isinstance(data, dict):
        return []
    own = [v for k, v in data.items() if k.endswith("source") and isinstance(v, str)]
    return own + [s for v in data.values() for s in sources_in(v)]


@pytest.mark.parametrize("origin", SHIPPED)
def test_a_copy_has_its_own_title_and_says_whose_sources_it_has(tmp_path, origin):
    copy_vehicle(origin, tmp_path / "mine")
    vehicle, shipped = load_vehicle(tmp_path / "mine"), load_vehicle(SHIPPED[origin])
    assert vehicle.title == f"mine, started from {origin}"
    assert load_construction(tmp_path / "mine").name == vehicle.name == "mine"
    for file in (tmp_path / "mine").glob("*.toml"):
        sources = sources_in(tomllib.loads(file.read_text()))
        assert all(s.startswith(f"copied from {origin}: ") for s in sources), file.name
        before = sources_in(tomllib.loads((SHIPPED[origin] / file.name).read_text()))
        assert [s.removeprefix(f"copied from {origin}: ") for s in sources] == before
    for file in construction_files(tmp_path / "mine")[1:]:
        rows = list(csv.reader(line for line in file.read_text().splitlines() if not line.startswith("#")))
        column = rows[0].index("source")
        assert all(row[column].startswith(f"copied from {origin}: ") for row in rows[1:])
    assert {n: t.values.tolist() for n, t in vehicle.tables.items()} == {
        n: t.values.tolist() for n, t in shipped.tables.items()
    }


def test_a_copy_of_a_copy_names_the_first(tmp_path):
    copy_vehicle("falcon1", tmp_path / "first")
    copy_vehicle(tmp_path / "first", tmp_path / "second")
    sources = sources_in(tomllib.loads((tmp_path / "second" / "vehicle.toml").read_text()))
    assert all(s.startswith("copied from falcon1: ") for s in sources)
    assert load_vehicle(tmp_path / "second").title == "second, started from first"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('source = "a"', 'source = "copied from x: a"'),
        ('T = { source="a", resource = "b" }', 'T = { source="copied from x: a", resource = "b" }'),
        ('source = ""', 'source = ""'),
        ('source = """a\nb"""', 'source = """a\nb"""'),
        ('source = "copied from y: a"', 'source = "copied from y: a"'),
        ("sources = 1", "sources = 1"),
    ],
)
def test_sources_of_toml(text, expected):
    assert sourced(text, "x") == expected


def test_sources_of_tables():
    text = '# note "a\nmach [1],status,source\n0,found,"a, b"\n'
    assert sourced_rows(text, "x") == '# note "a\nmach [1],status,source\n0,found,"copied from x: a, b"\n'
    assert sourced_rows("a [1],b [1]\n1,2\n", "x") == "a [1],b [1]\n1,2\n"
    over_lines = 'a [1],source\n1,"a\nb"\n'
    assert sourced_rows(over_lines, "x") == over_lines


def test_the_build_refuses_a_file_named_after_another_station(tmp_path):
    folder = tmp_path / "mine"
    shutil.copytree(SHIPPED["falcon1"], folder)
    for name, changes in {
        "vehicle.toml": [("station_m = 10.0 ", "station_m = 9.0 "), ("= 7.46", "= 6.46")],
        "construction.toml": [("[10.0, ", "[9.0, ")],
    }.items():
        text = (folder / name).read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (folder / name).write_text(text)
    with pytest.raises(DataError, match=r"loads_station_10m.csv, but would hold station 9 m"):
        build_vehicle(folder)


def test_the_build_refuses_two_names(tmp_path):
    folder = tmp_path / "mine"
    shutil.copytree(SHIPPED["falcon1"], folder)
    text = (folder / "vehicle.toml").read_text()
    (folder / "vehicle.toml").write_text(text.replace('name = "falcon1"', 'name = "falcon2"'))
    with pytest.raises(DataError, match="'name': is 'falcon2', but construction.toml tells of 'falcon1'"):
        build_vehicle(folder)


def write(folder: Path, *names: str, text: str = "x") -> list[Path]:
    for name in names:
        (folder / name).write_text(text)
    return [folder / name for name in names]


def run(folder: Path, *names: str, command: str = "run") -> list[str]:
    manifest = Manifest.begin(folder, command, "as504")
    return manifest.finish(write(folder, *names))


def test_a_second_run_leaves_nothing_of_the_first(tmp_path):
    assert run(tmp_path, "statistics.csv", "along.csv", "along.png") == []
    assert run(tmp_path, "statistics.csv") == ["removed, of an earlier run: along.csv, along.png"]
    assert {p.name for p in tmp_path.iterdir()} == {"statistics.csv", MANIFEST}
    found = json.loads((tmp_path / MANIFEST).read_text())
    assert found["run"]["complete"] and list(found["run"]["files"]) == ["statistics.csv"]


def test_what_its_user_changed_or_put_there_is_named_and_stays(tmp_path):
    run(tmp_path, "statistics.csv", "along.csv")
    write(tmp_path, "along.csv", text="mine")
    write(tmp_path, "own.csv", "notes.txt")
    assert run(tmp_path, "statistics.csv") == ["not of this run: along.csv, own.csv"]
    assert (tmp_path / "along.csv").read_text() == "mine"


def test_commands_in_one_folder_keep_apart(tmp_path):
    run(tmp_path, "statistics.csv")
    assert run(tmp_path, "design.csv", command="design") == []
    assert run(tmp_path, "statistics.csv") == []
    assert {p.name for p in tmp_path.iterdir()} == {"statistics.csv", "design.csv", MANIFEST}


def test_a_run_that_was_killed_is_not_complete_and_the_next_one_cleans(tmp_path):
    run(tmp_path, "statistics.csv", "along.csv")
    Manifest.begin(tmp_path, "run", "as504")
    assert not json.loads((tmp_path / MANIFEST).read_text())["run"]["complete"]
    assert run(tmp_path, "statistics.csv") == ["removed, of an earlier run: along.csv"]


@pytest.mark.parametrize("text", ["", "[]", "{", '{"run": 1}', '{"run": {"files": 3}}', "\\xff", "[" * 100_000])
def test_a_spoiled_manifest_counts_as_none(tmp_path, text):
    (tmp_path / MANIFEST).write_text(text)
    assert run(tmp_path, "statistics.csv") == []


def test_a_manifest_from_elsewhere_removes_nothing_outside(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    outside = write(tmp_path, "outside.csv")[0]
    (folder / "link.csv").symlink_to(outside)
    digest = "2d711642b726b04401627ca9fbac32f5c8530fb1903cc4db02258717921a4881"  # SHA-256 of x
    files = dict.fromkeys(["../outside.csv", str(outside), "link.csv", "..", "."], digest)
    (folder / MANIFEST).write_text(json.dumps({"run": {"files": files}}))
    run(folder, "statistics.csv")
    assert outside.read_text() == "x" and (folder / "link.csv").is_symlink()
