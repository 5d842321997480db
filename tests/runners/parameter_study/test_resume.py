"""Parameter studies that are killed, run out of disk, meet another study, or are stopped: nothing is lost."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from lag import dispersion, lag, normal

from ascentwind.model.errors import OutputFolderError
from ascentwind.runners.parameter_study import compute, local, run_parameter_study
from ascentwind.runners.parameter_study.store import ResumeError
from ascentwind.runners.present import files as output

MEMBERS = 240
PLAN = dispersion(MEMBERS, normal("tau", 0.2), normal("gain", 0.5), seed=8)
SCRIPT = f"""
import json, resource, signal, sys
sys.path.insert(0, {str(Path(__file__).parents[2] / "support")!r})
from lag import lag
from ascentwind.runners.parameter_study import run_parameter_study
plan, folder, limit = json.loads(sys.argv[1]), sys.argv[2], int(sys.argv[3])
study = lag()
if limit:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
print("ready", flush=True)
run_parameter_study(plan, folder, study=study)
"""


@pytest.fixture(scope="module")
def study(cache):
    return lag()


def start(folder: Path, limit: int = 0) -> subprocess.Popen:
    command = [sys.executable, "-c", SCRIPT, json.dumps(PLAN), str(folder), str(limit)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    return process


def stored(folder: Path) -> dict[str, tuple[int, int]]:
    """Return inode and time of every chunk: both stay when it is not written again."""
    return {p.name: (p.stat().st_ino, p.stat().st_mtime_ns) for p in (folder / "chunks").glob("[0-9]*.nc")}


@pytest.mark.slow
def test_killed_at_random_moments_it_ends_with_the_same_bytes(study, tmp_path):
    run_parameter_study(PLAN, tmp_path / "whole", study=study)
    expected = (tmp_path / "whole" / "study.nc").read_bytes()
    folder, moments, kills = tmp_path / "killed", random.Random(1), 0
    before: dict[str, tuple[int, int]] = {}
    for _ in range(3):
        process = start(folder)
        goal = len(before) + moments.randrange(1, 6)
        while len(stored(folder)) < goal and process.poll() is None:
            time.sleep(0.001)
        process.send_signal(signal.SIGKILL)
        kills += process.wait() == -signal.SIGKILL
        now = stored(folder)
        assert before.items() <= now.items()  # no chunk was computed a second time
        before = now
    assert kills == 3
    assert 0 < len(before) < MEMBERS / compute.CHUNK
    assert not (folder / "study.nc").exists()
    process = start(folder)
    assert process.wait(60) == 0, process.stderr.read() if process.stderr else ""
    assert (folder / "study.nc").read_bytes() == expected
    assert before.items() <= stored(folder).items()


def test_only_what_is_missing_is_computed(study, tmp_path, monkeypatch):
    run_parameter_study(PLAN, tmp_path, study=study)
    expected = (tmp_path / "study.nc").read_bytes()
    gone = tmp_path / "chunks" / "0000040-0000049.nc"
    damaged = tmp_path / "chunks" / "0000100-0000109.nc"
    gone.unlink()
    damaged.write_bytes(damaged.read_bytes()[:-9])
    (tmp_path / "study.nc").unlink()
    computed, seen = [], []
    original = local.compute_chunk
    monkeypatch.setattr(local, "compute_chunk", lambda s, t, c: computed.append(c.first) or original(s, t, c))
    run_parameter_study(PLAN, tmp_path, study=study, progress=lambda done, total: seen.append((done, total)))
    assert sorted(computed) == [40, 100]
    assert seen[0] == (MEMBERS - 20, MEMBERS)
    assert seen[-1] == (MEMBERS, MEMBERS)
    assert (tmp_path / "study.nc").read_bytes() == expected


@pytest.mark.slow
def test_a_flipped_bit_is_not_taken_for_a_result(study, tmp_path, caplog):
    run_parameter_study(PLAN, tmp_path, study=study)
    expected = (tmp_path / "study.nc").read_bytes()
    chunk = tmp_path / "chunks" / "0000000-0000009.nc"
    spoiled = bytearray(chunk.read_bytes())
    spoiled[-300] ^= 1
    chunk.write_bytes(spoiled)
    run_parameter_study(PLAN, tmp_path, study=study)
    assert "0000000-0000009.nc is damaged" in caplog.text
    assert (tmp_path / "study.nc").read_bytes() == expected


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"times": "1,4"}, r"plan.times: \"1,3\" there, \"1,4\" here"),
        ({"dispersion": {**PLAN["dispersion"], "seed": 9}}, r"plan.dispersion: .*values of the members"),
        ({"relative_tolerance": 1e-7}, r"plan.relative_tolerance: 1e-08 there, 1e-07 here"),
    ],
)
def test_a_folder_of_another_plan_is_refused(study, tmp_path, change, expected):
    small = PLAN | {"dispersion": {**PLAN["dispersion"], "members": 5}}
    change = {k: ({**v, "members": 5} if k == "dispersion" else v) for k, v in change.items()}
    run_parameter_study(small, tmp_path, study=study)
    before = (tmp_path / "study.nc").read_bytes()
    with pytest.raises(ResumeError, match=f"holds another parameter study.*{expected}.*another --out"):
        run_parameter_study(small | change, tmp_path, study=study)
    assert (tmp_path / "study.nc").read_bytes() == before


def test_a_folder_of_another_vehicle_or_version_is_refused(study, tmp_path):
    small = PLAN | {"dispersion": {**PLAN["dispersion"], "members": 5}}
    run_parameter_study(small, tmp_path, study=study)
    with pytest.raises(ResumeError, match="it differs in data_sha256"):
        run_parameter_study(small, tmp_path, study=study.with_parameters({"level": 2.0}))
    file = tmp_path / "identity.json"
    file.write_text(file.read_text().replace('"ascentwind": "', '"ascentwind": "0.'))
    with pytest.raises(ResumeError, match="it differs in ascentwind: "):
        run_parameter_study(small, tmp_path, study=study)


def test_a_folder_at_work_is_refused(study, tmp_path):
    def meanwhile(done: int, total: int) -> None:
        with pytest.raises(ResumeError, match="another process is computing"):
            run_parameter_study(PLAN, tmp_path, study=study)

    run_parameter_study(PLAN, tmp_path, study=study, progress=meanwhile)


@pytest.mark.slow
def test_a_full_disk_keeps_what_is_stored(study, tmp_path, monkeypatch):
    run_parameter_study(PLAN, tmp_path / "whole", study=study)
    folder, written = tmp_path / "full", []
    original = os.fsync

    def full(descriptor: int) -> None:
        if len(written) >= 12:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written.append(descriptor)
        original(descriptor)

    with monkeypatch.context() as patch:
        patch.setattr(output.os, "fsync", full)
        expected = r"nc cannot be written \(No space left on device\).*\d+ bytes.*110 of 240 members"
        with pytest.raises(OutputFolderError, match=expected):
            run_parameter_study(PLAN, folder, study=study)
    before = stored(folder)
    assert len(before) == 11  # and the identity
    run_parameter_study(PLAN, folder, study=study)
    assert before.items() <= stored(folder).items()
    assert (folder / "study.nc").read_bytes() == (tmp_path / "whole" / "study.nc").read_bytes()


@pytest.mark.slow
def test_a_limit_on_the_size_of_a_file(study, tmp_path):
    """A real refusal by the system: the assembled result is larger than the limit, chunks are not."""
    process = start(tmp_path, limit=12_000)
    _, text = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "study.nc cannot be written (File too large)" in text
    assert len(stored(tmp_path)) == MEMBERS / compute.CHUNK
    assert not list(tmp_path.glob(".*study*"))
    run_parameter_study(PLAN, tmp_path, study=study)
    assert (tmp_path / "study.nc").exists()


@pytest.mark.slow
def test_stopped_by_the_keyboard_it_goes_on_later(study, tmp_path):
    def stop(done: int, total: int) -> None:
        if done >= 50:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_parameter_study(PLAN, tmp_path, study=study, progress=stop)
    assert 5 <= len(stored(tmp_path)) < MEMBERS / compute.CHUNK
    run_parameter_study(PLAN, tmp_path, study=study)
    assert (tmp_path / "study.nc").exists()
