"""Fixtures: a private cache for compiled code, the shipped vehicle, and a copy of it to spoil."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Study


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        kept = os.environ.get("ASCENTWIND_TEST_CACHE")  # keys hold the source: a library of old code is never found
        folder = Path(kept) if kept else tmp_path_factory.mktemp("cache")
        folder.mkdir(exist_ok=True)
        folder.chmod(0o700)
        patch.setenv("ASCENTWIND_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session")
def as504(cache) -> Study:
    return Study.load("as504")


@pytest.fixture(scope="session")
def closed_form_folder(tmp_path_factory) -> Path:
    """A copy of AS-504 with the closed form of the wind filter in the place of the fitted one."""
    folder = tmp_path_factory.mktemp("closed_form") / "as504"
    shutil.copytree(built_in_vehicles()["as504"], folder)
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    assert 'synthesis = "fitted"' in text
    toml.write_text(text.replace('synthesis = "fitted"', 'synthesis = "closed_form"'))
    return folder


@pytest.fixture(scope="session")
def as504_closed_form(cache, closed_form_folder) -> Study:
    return Study.load(closed_form_folder)


@pytest.fixture
def vehicle_folder(tmp_path) -> Path:
    """A copy of AS-504 that a test may edit."""
    folder = tmp_path / "vehicle"
    shutil.copytree(built_in_vehicles()["as504"], folder)
    return folder


@pytest.fixture
def edit(vehicle_folder):
    """Replace text in a file of the copied vehicle; the text must be there."""

    def replace(old: str, new: str, file: str = "vehicle.toml") -> Path:
        path = vehicle_folder / file
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
        return vehicle_folder

    return replace
