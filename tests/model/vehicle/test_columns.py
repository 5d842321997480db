"""Columns of a vehicle's tables stand once: shipped tables, the page in docs/ and new vehicles agree with them."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from ascentwind.model.files.text_file import read_text
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles, find_vehicle
from ascentwind.model.vehicle.table_columns import table_columns
from ascentwind.runners.cli.new_vehicle import copy_vehicle

ROOT = Path(__file__).parents[3]


def head(file: Path) -> list[str]:
    return next(line for line in read_text(file).splitlines() if not line.startswith("#")).split(",")


@pytest.mark.parametrize("name", built_in_vehicles())
def test_shipped_tables_hold_the_columns_and_no_others(name):
    """All that the build writes is read, and all that can be read is written."""
    vehicle = load_vehicle(find_vehicle(name))
    tables = table_columns(vehicle.file)
    assert {file.name for file in (s.file for s in vehicle.sources) if file.suffix == ".csv"} <= set(tables)
    for file, columns in tables.items():
        assert sorted(head(vehicle.folder / file)) == sorted(column.label for column in columns), file


def test_page_is_what_the_columns_say():
    program = runpy.run_path(str(ROOT / "tools" / "write_tables_page.py"))
    page = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
    assert page == program["page"](), "docs/tables.md is out of date: run python tools/write_tables_page.py"


@pytest.mark.parametrize("name", built_in_vehicles())
def test_a_new_vehicle_says_what_its_columns_are(name, tmp_path):
    copy_vehicle(name, tmp_path / "mine")
    vehicle = load_vehicle(tmp_path / "mine")
    for file, columns in table_columns(vehicle.file).items():
        comments = [line for line in read_text(vehicle.folder / file).splitlines() if line.startswith("#")]
        for column in columns:
            assert f"# {column.label}: {column.meaning}" in comments, file
    assert load_vehicle(find_vehicle(name)).tables.keys() == vehicle.tables.keys()


def test_meanings_are_there_and_differ_within_a_table():
    for columns in table_columns(load_vehicle(find_vehicle("as504")).file).values():
        meanings = [column.meaning for column in columns]
        assert all(meanings) and len(set(meanings)) == len(meanings)
