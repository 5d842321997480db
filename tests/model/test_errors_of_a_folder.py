"""All errors of a folder in one go: whatever is wrong in one file hides nothing that is wrong in another."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from ascentwind.model import load_vehicle
from ascentwind.model.construction.construction_file import CONSTRUCTION_FILE, construction_files, load_construction
from ascentwind.model.errors import DataError, SeveralDataErrors
from ascentwind.model.system.array_files import read_arrays
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.runners.construct.build_vehicle import build_vehicle


def spoiled(file: Path) -> None:
    """Put a word where the last row has its first number."""
    lines = file.read_text().rstrip("\n").split("\n")
    cells = lines[-1].split(",")
    at = next(
        i for i, cell in enumerate(cells) if cell.lstrip("-").replace(".", "", 1).replace("e", "", 1)[:1].isdigit()
    )
    cells[at] = "abc"
    file.write_text("\n".join([*lines[:-1], ",".join(cells)]) + "\n")


def told(error: DataError) -> dict[str, int]:
    """Return how many errors each file has."""
    found: dict[str, int] = {}
    for e in error.errors if isinstance(error, SeveralDataErrors) else (error,):
        name = Path(str(e.file)).name
        found[name] = found.get(name, 0) + 1
    return found


def copied(tmp_path: Path, vehicle: str) -> Path:
    folder = tmp_path / "mine"
    shutil.copytree(find_vehicle(vehicle), folder)
    return folder


@pytest.mark.parametrize("vehicle", ["as504", "falcon1"])
def test_every_table_of_a_vehicle_is_told(tmp_path, vehicle):
    folder = copied(tmp_path, vehicle)
    read = {source.file.name for source in load_vehicle(folder).sources if source.file.suffix == ".csv"}
    assert len(read) > 8
    for name in read:
        spoiled(folder / name)
    with pytest.raises(SeveralDataErrors) as found:
        load_vehicle(folder)
    assert told(found.value) == dict.fromkeys(read, 1)


def test_tables_filter_and_keys_of_a_vehicle_are_told_together(tmp_path):
    folder = copied(tmp_path, "as504")
    spoiled(folder / "rigid_body.csv")
    table = folder / "propulsion.csv"
    table.write_text(
        table.read_text().replace("thrust [N]", "thrust [lbf]", 1).replace("control_thrust [N]", "contrl [N]")
    )
    (folder / "wind_march_zonal_filter.json").write_text("{")
    toml = folder / "vehicle.toml"
    text = toml.read_text().replace('events = ["center_engine_cutoff"]', 'events = ["center_engine_cutof"]', 1)
    toml.write_text(text.replace("local_angle_of_attack = false", "local_angle_of_attack = true"))
    (folder / "local_aerodynamics.csv").unlink()
    with pytest.raises(SeveralDataErrors) as found:
        load_vehicle(folder)
    assert told(found.value) == {
        "rigid_body.csv": 1,
        "propulsion.csv": 3,  # unit, a column that is missing, one that is not known
        "wind_march_zonal_filter.json": 1,
        "local_aerodynamics.csv": 1,
    }


@pytest.mark.parametrize("vehicle", ["as504", "falcon1"])
def test_every_file_of_a_construction_is_told(tmp_path, vehicle):
    folder = copied(tmp_path, vehicle)
    files = construction_files(folder)[1:]
    for file in files:
        spoiled(file)
    with pytest.raises(SeveralDataErrors) as found:
        load_construction(folder)
    counts = told(found.value)
    assert set(counts) == {file.name for file in files}
    assert all(count == 1 for count in counts.values())


def test_what_contradicts_in_a_construction_is_told_together(tmp_path):
    folder = copied(tmp_path, "as504")
    toml = folder / CONSTRUCTION_FILE
    text = toml.read_text()
    for old, new in (
        ("liquid_kg = 1444641.0", "liquid_kg = 1600000.0"),
        ("load_stations_m = [25.0]", "load_stations_m = [125.0]"),
        ("sensor_station_m = 82.3", "sensor_station_m = 182.3"),
        ("forward_end_m = 107.696", "forward_end_m = 107.7"),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    toml.write_text(text)
    with pytest.raises(SeveralDataErrors) as found:
        load_construction(folder)
    message = str(found.value)
    for says in ("overfilled", "load station 125 m", "sensor_station_m", "stiffness is given", "the outline is given"):
        assert says in message
    assert told(found.value) == {CONSTRUCTION_FILE: 5}


def test_several_rows_of_a_table_are_told(tmp_path):
    folder = copied(tmp_path, "falcon1")
    file = folder / "construction" / "masses.csv"
    text = file.read_text()
    file.write_text(text.replace(",assumed,", ",guess,"))
    rows = [i for i, line in enumerate(text.split("\n"), start=1) if ",assumed," in line]
    assert len(rows) > 2
    with pytest.raises(SeveralDataErrors) as found:
        load_construction(folder)
    assert [e.row for e in found.value.errors] == rows


def test_both_files_of_a_build_are_told(tmp_path):
    folder = copied(tmp_path, "falcon1")
    toml = folder / "vehicle.toml"
    toml.write_text(toml.read_text().replace("start_time_s", "strt_time_s", 1))
    spoiled(folder / "construction" / "drag.csv")
    spoiled(folder / "construction" / "engine.csv")
    with pytest.raises(SeveralDataErrors) as found:
        build_vehicle(folder, tmp_path / "out")
    assert set(told(found.value)) == {"vehicle.toml", "drag.csv", "engine.csv"}


def test_what_two_files_of_a_build_contradict_is_told_together(tmp_path):
    folder = copied(tmp_path, "falcon1")
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    assert "reference_area_m2 = 2.21793" in text and 'name = "falcon1"' in text
    toml.write_text(
        text.replace("reference_area_m2 = 2.21793", "reference_area_m2 = 2.3").replace('"falcon1"', '"mine"', 1)
    )
    with pytest.raises(SeveralDataErrors) as found:
        build_vehicle(folder, tmp_path / "out")
    assert [e.column for e in found.value.errors] == ["name", "reference_area_m2"]


SYSTEM = {
    "A": 'time [s],"A(1,1)"\n0,-1\n1,x\n2,y\n',
    "B": 'time [s],"B(1,1)"\n0,1\n1,z\n2,1\n',
    "C": 'time [s],"C(1,0)"\n0,1\n2,1\n',
    "u": 'time [s],"u(a)"\n0,1\n2,1\n',
    "names": "kind,number,name\nstate,1,x\nstat,2,y\njump,1,soon\n",
}


def test_every_table_of_a_system_is_told(tmp_path):
    for name, text in SYSTEM.items():
        (tmp_path / f"{name}.csv").write_text(text)
    with pytest.raises(SeveralDataErrors) as found:
        read_arrays(tmp_path)
    assert told(found.value) == {"A.csv": 2, "B.csv": 1, "C.csv": 1, "u.csv": 1, "names.csv": 2}
    assert [e.row for e in found.value.errors if Path(str(e.file)).name == "A.csv"] == [3, 4]


def test_missing_tables_and_other_times_of_a_system_are_told_together(tmp_path):
    (tmp_path / "A.csv").write_text('time [s],"A(1,1)"\n0,-1\n1,-1\n')
    with pytest.raises(SeveralDataErrors, match=r"(?s)holds no B\.csv.*holds no C\.csv"):
        read_arrays(tmp_path)
    for name in ("B", "C", "D"):
        (tmp_path / f"{name}.csv").write_text(f'time [s],"{name}(1,1)"\n0,1\n3,1\n')
    with pytest.raises(SeveralDataErrors) as found:
        read_arrays(tmp_path)
    assert told(found.value) == {"B.csv": 1, "C.csv": 1, "D.csv": 1}


def test_keys_at_fault_hide_no_table(tmp_path):
    """A misspelt key, one of the wrong type, and a table beside them."""
    folder = copied(tmp_path, "as504")
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    for old, new in (("start_time_s = 10.0", "strt_time_s = 10.0"), ("full_coupling = false", 'full_coupling = "no"')):
        assert old in text
        text = text.replace(old, new, 1)
    toml.write_text(text)
    spoiled(folder / "rigid_body.csv")
    spoiled(folder / "propulsion.csv")
    with pytest.raises(SeveralDataErrors) as found:
        load_vehicle(folder)
    assert told(found.value) == {"vehicle.toml": 2, "rigid_body.csv": 1, "propulsion.csv": 1}
    assert "did you mean 'start_time_s'" in str(found.value)


def test_keys_at_fault_hide_no_table_of_a_construction(tmp_path):
    folder = copied(tmp_path, "as504")
    toml = folder / CONSTRUCTION_FILE
    text = toml.read_text().replace("sensor_station_m", "sensr_station_m", 1)
    toml.write_text(text.replace("load_stations_m = [25.0]", 'load_stations_m = ["aft"]', 1))
    spoiled(folder / "construction" / "drag.csv")
    with pytest.raises(SeveralDataErrors) as found:
        load_construction(folder)
    assert told(found.value) == {CONSTRUCTION_FILE: 2, "drag.csv": 1}


def test_a_key_alone_at_fault_is_told_alone(tmp_path):
    """What is loaded without it brings no error of its own, and no vehicle."""
    folder = copied(tmp_path, "falcon1")
    toml = folder / "vehicle.toml"
    toml.write_text(toml.read_text().replace("start_time_s", "strt_time_s", 1))
    with pytest.raises(DataError, match="did you mean 'start_time_s'") as found:
        load_vehicle(folder)
    assert not isinstance(found.value, SeveralDataErrors)
    toml.write_text(toml.read_text().replace("[tables.rigid_body]", "[tables.rigd_body]", 1))
    with pytest.raises(DataError) as found:
        load_vehicle(folder)
    assert told(found.value) == {"vehicle.toml": 2}
