"""File keys stay inside the folder: nothing is read from outside it, nothing written there, in no way."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from ascentwind.model import load_vehicle
from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.equations.station_loads import load_station_loads
from ascentwind.model.errors import DataError
from ascentwind.model.files import folder_files
from ascentwind.model.files.folder_files import LARGEST
from ascentwind.model.files.toml_file import read_toml
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.cli.new_vehicle import copy_vehicle
from ascentwind.runners.construct.build_vehicle import build_vehicle
from ascentwind.runners.design.file import DesignEntry
from ascentwind.runners.parameter_study.plan import read_plan

AS504 = built_in_vehicles()["as504"]
SECRET = "root:x:0:0 [secret]"
VEHICLE_KEYS = {
    "tables.rigid_body": 'file = "rigid_body.csv"',
    "tables.loads_along_vehicle": 'file = "loads_along_vehicle.csv"',
    "control.gains": 'file = "control_gains.csv"',
    "bending.0.table": 'file = "bending_1.csv"',
    "slosh.0.table": 'file = "slosh_sic_lox.csv"',
    "loads.0.table": 'file = "loads_station_25m.csv"',
    "wind.filter": 'filter = "wind_march_zonal_filter.json"',
    "wind.statistics": 'file = "wind_march_zonal.csv"',
}
CONSTRUCTION_KEYS = ["masses.csv", "stiffness.csv", "drag.csv", "atmosphere.csv", "pitch.csv", "normal_force.csv"]
OUTSIDE = ["/etc/passwd", "../secret.csv", "drag/../../secret.csv", "..", "C:/x.csv", "C:x.csv", "//host/share/x"]
NAMELESS = ["", ".", "a\\nb", "a\\u0000b"]


@pytest.fixture
def secret(tmp_path) -> Path:
    file = tmp_path / "secret.csv"
    file.write_text(f"{SECRET}\n1\n2\n")
    return file


@pytest.mark.parametrize("name", [*OUTSIDE, *NAMELESS, "..\\\\secret.csv"])
@pytest.mark.parametrize("key", VEHICLE_KEYS)
def test_keys_of_vehicle_toml(edit, secret, key, name):
    old = VEHICLE_KEYS[key]
    folder = edit(old, f'{old.split(" = ")[0]} = "{name}"')
    refused = r"leads out of the folder|is not the name of a file|holds a control character"
    with pytest.raises(DataError, match=refused) as caught:
        load_vehicle(folder)
    assert caught.value.column is not None and caught.value.column.startswith(key)
    assert SECRET[:6] not in str(caught.value)


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize("file", CONSTRUCTION_KEYS)
def test_keys_of_construction_toml(edit, file, name):
    folder = edit(f'"construction/{file}"', f'"{name}"', "construction.toml")
    with pytest.raises(DataError, match="leads out of the folder"):
        load_construction(folder)


@pytest.mark.parametrize("name", OUTSIDE)
def test_the_vehicle_of_plans_and_designs(tmp_path, name):
    plan = f'format = 1\ntitle = "t"\nvehicle = "{name}"\n[[grid.quantity]]\nname = "mass"\nvalues = [0.9]\n'
    (tmp_path / "plan.toml").write_text(plan)
    with pytest.raises(DataError, match="'vehicle': leads out of the folder"):
        read_plan(tmp_path / "plan.toml")
    design = f'format = 1\nvehicle = "{name}"\ntimes = "40:50:5"\n[parameters]\ngain = [0, 1]\n'
    (tmp_path / "design.toml").write_text(design)
    with pytest.raises(DataError, match="'vehicle': leads out of the folder"):
        read_toml(tmp_path / "design.toml", DesignEntry)


FILES = ["vehicle.toml", "rigid_body.csv", "wind_march_zonal_filter.json", "wind_march_zonal.csv", "control_gains.csv"]


@pytest.mark.parametrize("file", FILES)
def test_a_link_out(vehicle_folder, secret, file):
    (vehicle_folder / file).unlink()
    (vehicle_folder / file).symlink_to(secret)
    with pytest.raises(DataError, match=rf"{file}.*is a link that leads out of the folder") as caught:
        load_vehicle(vehicle_folder)
    assert SECRET[:6] not in str(caught.value)


@pytest.mark.parametrize("file", ["construction.toml", "construction/masses.csv"])
def test_a_link_out_of_a_construction(vehicle_folder, secret, file):
    (vehicle_folder / file).unlink()
    (vehicle_folder / file).symlink_to(secret)
    with pytest.raises(DataError, match="is a link that leads out of the folder"):
        load_construction(vehicle_folder)


def test_a_folder_that_is_a_link_out(vehicle_folder, tmp_path):
    (vehicle_folder / "construction").rename(tmp_path / "elsewhere")
    (vehicle_folder / "construction").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(DataError, match=r"masses.csv: is a link that leads out of the folder"):
        load_construction(vehicle_folder)


def test_links_inside_the_folder_and_to_the_folder_are_no_harm(vehicle_folder, tmp_path):
    (vehicle_folder / "rigid_body.csv").rename(vehicle_folder / "masses.csv")
    (vehicle_folder / "rigid_body.csv").symlink_to("masses.csv")
    (tmp_path / "here").symlink_to(vehicle_folder)
    load_vehicle(tmp_path / "here")


def test_circles_of_links(vehicle_folder):
    (vehicle_folder / "rigid_body.csv").unlink()
    (vehicle_folder / "rigid_body.csv").symlink_to("rigid_body.csv")
    with pytest.raises(DataError, match=r"rigid_body.csv: cannot be re"):
        load_vehicle(vehicle_folder)


@pytest.mark.parametrize("file", FILES)
def test_what_is_no_regular_file(vehicle_folder, file):
    """A pipe would wait for ever."""
    (vehicle_folder / file).unlink()
    os.mkfifo(vehicle_folder / file)
    with pytest.raises(DataError, match=r"is not a regular file|holds no vehicle.toml"):
        load_vehicle(vehicle_folder)


@pytest.mark.parametrize("file", FILES)
def test_what_is_too_large(vehicle_folder, file):
    with (vehicle_folder / file).open("r+b") as big:
        big.truncate(LARGEST + 1)
    with pytest.raises(DataError, match=rf"{file}: has 64 MB, more than"):
        load_vehicle(vehicle_folder)


def test_the_table_along_the_vehicle_is_read_from_inside_too(vehicle_folder, secret):
    (vehicle_folder / "loads_along_vehicle.csv").unlink()
    (vehicle_folder / "loads_along_vehicle.csv").symlink_to(secret)
    with pytest.raises(DataError, match="is a link that leads out of the folder"):
        load_station_loads(load_vehicle(vehicle_folder))


def test_a_path_of_the_user_may_lie_anywhere(vehicle_folder, tmp_path):
    """As given with --set or in Python; the file's own keys beside it still may not."""
    own = tmp_path / "own.csv"
    shutil.copyfile(vehicle_folder / "rigid_body.csv", own)
    found = load_vehicle(vehicle_folder, {"tables.rigid_body.file": str(own)})
    assert found.sources[0].file == own
    whole = {"file": str(own), "status": "found", "source": "s", "events": ["center_engine_cutoff"]}
    assert load_vehicle(vehicle_folder, {"tables.rigid_body": whole}).sources[0].file == own


OVERWRITTEN = [
    ("vehicle.toml", "would be written over; name a .csv file"),
    ("wind_march_zonal_filter.json", "would be written over; name a .csv file"),
    ("construction/masses.csv", "is an input of the build"),
    ("./construction/masses.csv", "is an input of the build"),
    ("control_gains.csv", "is written by hand"),
    ("wind_march_zonal.csv", "is written by hand"),
    ("bending_2.csv", "also named by"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "message"), OVERWRITTEN)
def test_the_build_writes_over_nothing_but_its_own_tables(edit, name, message):
    folder = edit('file = "bending_1.csv"', f'file = "{name}"')
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    with pytest.raises(DataError, match=message):
        build_vehicle(folder)
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize("name", OUTSIDE)
def test_the_build_writes_nothing_outside(edit, secret, name):
    folder = edit('file = "rigid_body.csv"', f'file = "{name}"')
    with pytest.raises(DataError, match="leads out of the folder"):
        build_vehicle(folder)
    assert secret.read_text().startswith(SECRET)


def test_the_build_follows_no_link_when_it_writes(edit, tmp_path):
    folder = edit('file = "rigid_body.csv"', 'file = "tables/rigid_body.csv"')
    (tmp_path / "elsewhere").mkdir()
    (folder / "tables").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(DataError, match="is a link that leads out of the folder"):
        build_vehicle(folder)
    assert not list((tmp_path / "elsewhere").iterdir())


def test_a_copy_takes_nothing_from_outside(vehicle_folder, tmp_path, secret):
    (tmp_path / "elsewhere").mkdir()
    shutil.copyfile(secret, tmp_path / "elsewhere" / "more.csv")
    (vehicle_folder / "circle").symlink_to(".")
    (vehicle_folder / "elsewhere").symlink_to(tmp_path / "elsewhere")
    (vehicle_folder / "notes.txt").symlink_to(secret)
    (vehicle_folder / "construction" / "inside.csv").symlink_to("../rigid_body.csv")
    os.mkfifo(vehicle_folder / "pipe")
    copy_vehicle(vehicle_folder, tmp_path / "copy")
    made = {p.name for p in (tmp_path / "copy").rglob("*")}
    assert not made & {"circle", "elsewhere", "notes.txt", "more.csv", "pipe"}
    copied = tmp_path / "copy" / "construction" / "inside.csv"
    assert not copied.is_symlink() and copied.read_bytes() == (vehicle_folder / "rigid_body.csv").read_bytes()


def test_a_shipped_vehicle_may_be_a_folder_of_links(tmp_path, monkeypatch):
    """As 'uv pip install --link-mode symlink' leaves it; anyone else's folder of links is refused."""
    cache, package = tmp_path / "cache" / "as504", tmp_path / "package" / "vehicles" / "as504"
    shutil.copytree(AS504, cache)
    package.mkdir(parents=True)
    for file in cache.rglob("*"):
        linked = package / file.relative_to(cache)
        linked.mkdir() if file.is_dir() else linked.symlink_to(file)
    with pytest.raises(DataError, match="leads out of the folder"):
        load_vehicle(package)
    monkeypatch.setattr(folder_files, "SHIPPED", tmp_path / "package")
    assert load_vehicle(package).tables.keys() == load_vehicle(AS504).tables.keys()
    copy_vehicle(package, tmp_path / "copy")
    assert not any(path.is_symlink() for path in (tmp_path / "copy").rglob("*"))
