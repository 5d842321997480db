"""Fixtures: what is compiled and fitted once for all workers, the shipped vehicles, and a copy of one to spoil."""

from __future__ import annotations

import hashlib
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock
from threadpoolctl import threadpool_limits

from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.wind.statistics import WindStatistics
from ascentwind.runners import Study
from ascentwind.runners.wind.synthesis.result import SynthesisResult
from ascentwind.runners.wind.synthesis.synthesise import synthesise


def pytest_xdist_auto_num_workers(config) -> int | None:
    """A few files asked for by name are run in this process: it starts at once and a debugger works in it."""
    return 0 if len(config.args) < 4 and all(Path(a.partition("::")[0]).is_file() for a in config.args) else None


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory) -> Path:
    """A folder that all workers of this run share."""
    base = tmp_path_factory.getbasetemp()  # a worker's own lies in that of the run
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "shared"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session", autouse=True)
def cache(shared_folder):
    with pytest.MonkeyPatch.context() as patch:
        kept = os.environ.get("ASCENTWIND_TEST_CACHE")  # keys hold the source: a library of old code is never found
        folder = Path(kept) if kept else shared_folder / "cache"
        folder.mkdir(exist_ok=True)
        folder.chmod(0o700)
        patch.setenv("ASCENTWIND_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session", autouse=True)
def one_thread_a_worker():
    """Workers share the cores, and on two threads the products of small matrices take five times the processor time."""
    with pytest.MonkeyPatch.context() as patch, threadpool_limits(1, user_api="blas"):
        patch.setenv("OPENBLAS_NUM_THREADS", "1")  # of processes that tests start
        yield


@pytest.fixture(scope="session")
def fit(shared_folder) -> Callable[..., SynthesisResult]:
    """``synthesise``, but the same statistics by the same method are fitted once in a run, whichever worker asks."""

    def fitted(statistics: WindStatistics, method: str = "state-space", **settings) -> SynthesisResult:
        asked = hashlib.sha256(pickle.dumps((statistics, method, sorted(settings.items())))).hexdigest()
        file = shared_folder / f"{asked[:32]}.fit"
        with FileLock(file.with_suffix(".lock")):
            if not file.exists():
                file.write_bytes(pickle.dumps(synthesise(statistics, method, **settings)))
            return pickle.loads(file.read_bytes())

    return fitted


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
