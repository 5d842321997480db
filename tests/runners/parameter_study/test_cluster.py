"""Parameter studies on a real Dask cluster of several processes: same bytes, lost workers, clusters out of reach."""

from __future__ import annotations

import dataclasses
import os
import signal
import socket
import sys
import time
from typing import Any

import numpy as np
import pytest
from distributed import Client, LocalCluster
from lag import dispersion, lag, normal

from ascentwind.runners.parameter_study import cluster, run_parameter_study
from ascentwind.runners.parameter_study.cluster import SchedulerError
from ascentwind.runners.parameter_study.compute import Chunk, chunks, compute_chunk
from ascentwind.runners.parameter_study.plan import read_plan
from ascentwind.runners.parameter_study.quantities import resolve_quantities
from ascentwind.runners.parameter_study.run import _task
from ascentwind.runners.parameter_study.sampling import member_values

PLAN = {
    "format": 1,
    "title": "AS-504 on a cluster",
    "vehicle": "as504",
    "times": "20,30",
    "dispersion": {
        "members": 64,
        "seed": 2,
        "quantity": [normal("tables.center_of_pressure", 0.05), normal("wind.sigma_scale", 0.1)],
    },
}


@pytest.fixture(scope="module")
def workers(cache):
    """Three worker processes of one thread each."""
    with LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=":0", memory_limit=0
    ) as started:
        yield started


@pytest.mark.slow
def test_bytes_are_those_of_this_machine(as504, workers, tmp_path):
    changed = as504.with_parameters({"control.T1.gain": 1.05})  # travels with the vehicle
    here = run_parameter_study(PLAN, tmp_path / "here", study=changed)
    run_parameter_study(PLAN, tmp_path / "there", study=changed, scheduler=workers.scheduler_address)
    assert (tmp_path / "here" / "study.nc").read_bytes() == (tmp_path / "there" / "study.nc").read_bytes()
    for chunk in (tmp_path / "here" / "chunks").iterdir():
        assert chunk.read_bytes() == (tmp_path / "there" / "chunks" / chunk.name).read_bytes()
    assert here.data["status"].values.tolist() == 64 * [0]


def deadly(study, task, chunk):
    """Compute a chunk, unless it holds member 13, which takes its worker along."""
    if chunk.first <= 13 <= chunk.last:
        os._exit(1)
    return compute_chunk(study, task, chunk)


@pytest.mark.parametrize("together", [1, 2], ids=["chunk by chunk", "both chunks in a task"])
@pytest.mark.slow
def test_a_member_that_kills_its_worker_costs_no_other(as504, workers, monkeypatch, together):
    monkeypatch.setattr(cluster, "together", lambda *_: together)
    plan = read_plan(PLAN)
    quantities = resolve_quantities(as504, plan)
    task = _task(as504, plan, quantities)
    values = member_values(plan, quantities)
    with Client(workers.scheduler_address, set_as_default=False) as client:
        client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 0))
        found = dict(
            (chunk.first, result)
            for chunk, result in cluster.compute_on_cluster(
                workers.scheduler_address, as504, task, chunks(values[:20]), deadly
            )
        )
        client.wait_for_workers(3, timeout=60)
    assert found[0].status.tolist() == 10 * [0]
    assert found[10].status.tolist() == [0, 0, 0, 2, 0, 0, 0, 0, 0, 0]
    assert found[10].reason[3] == "its worker died at every attempt"
    whole = compute_chunk(as504, task, next(c for c in chunks(values) if c.first == 10))
    kept = [k for k in range(10) if k != 3]
    assert (found[10].variance[kept] == whole.variance[kept]).all()


@pytest.mark.slow
def test_a_worker_killed_from_outside_is_replaced(as504, workers, tmp_path):
    with Client(workers.scheduler_address, set_as_default=False) as client:
        client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 3))
        processes: Any = client.run(os.getpid)
        victim = next(iter(processes.values()))
    killed = []

    def kill(done: int, total: int) -> None:
        if done >= 10 and not killed:
            os.kill(victim, signal.SIGKILL)
            killed.append(done)

    given = PLAN | {"dispersion": PLAN["dispersion"] | {"seed": 5}}
    found = run_parameter_study(
        given, tmp_path / "there", study=as504, scheduler=workers.scheduler_address, progress=kill
    )
    assert killed
    assert found.data["status"].values.tolist() == 64 * [0]
    run_parameter_study(given, tmp_path / "here", study=as504)
    assert (tmp_path / "here" / "study.nc").read_bytes() == (tmp_path / "there" / "study.nc").read_bytes()


def test_a_worker_loads_a_vehicle_once_for_several_plans(as504):
    plan = read_plan(PLAN)
    quantities = resolve_quantities(as504, plan)
    task = _task(as504, plan, quantities)
    values = member_values(plan, quantities)[:2]
    cluster._loaded.cache_clear()
    for times in ((20.0,), (30.0,)):
        other = dataclasses.replace(task, times=times)
        some, _ = cluster.work(cluster.packed(as504, other), [(0, values[:1]), (1, values[1:])])
        whole = compute_chunk(as504, other, Chunk(0, values))
        assert (np.concatenate([part.variance for part in some]) == whole.variance).all()
    assert cluster._loaded.cache_info().misses == 1


def test_chunks_in_a_task():
    assert cluster.together(spent=0.0, computed=0, waiting=100, threads=2) == 1  # it is not known how long one takes
    assert cluster.together(spent=5.0, computed=10, waiting=100, threads=2) == 4
    assert cluster.together(spent=50.0, computed=10, waiting=100, threads=2) == 1
    assert cluster.together(spent=0.0, computed=10, waiting=100, threads=2) == 25
    assert cluster.together(spent=5.0, computed=10, waiting=9, threads=2) == 2  # the end is shared
    assert cluster.together(spent=5.0, computed=10, waiting=3, threads=0) == 1


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_an_unreachable_scheduler(as504, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 1.0)
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(SchedulerError, match=rf"no scheduler answers at {address} within 1 s.*'dask scheduler' runs"):
        run_parameter_study(PLAN, tmp_path, study=as504, scheduler=address)


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("nonsense://x:1", "unknown address scheme 'nonsense'"),
        ("localhost", "missing port"),
        ("tcp://localhost:port", "invalid literal"),
    ],
)
def test_what_is_no_address_is_refused_at_once(as504, tmp_path, address, why):
    begin = time.monotonic()
    with pytest.raises(SchedulerError, match=rf"is not the address of a scheduler \(.*{why}.*tcp://host:8786"):
        run_parameter_study(PLAN, tmp_path, study=as504, scheduler=address)
    assert time.monotonic() - begin < cluster.CONNECT_SECONDS


def test_a_scheduler_without_workers(as504, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 1.0)
    empty = LocalCluster(n_workers=0, processes=False, dashboard_address=":0")
    with (
        empty,
        pytest.raises(SchedulerError, match=r"has had no workers for 1 s; start some with 'dask worker tcp|inproc"),
    ):
        run_parameter_study(PLAN, tmp_path, study=as504, scheduler=empty.scheduler_address)


@pytest.mark.slow
def test_a_scheduler_that_goes_away(as504, tmp_path):
    started = LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0")

    def close(done: int, total: int) -> None:
        if done == 10:
            started.close()

    with pytest.raises(SchedulerError, match=r"connection to the scheduler at tcp.* was lost.*run the same command"):
        run_parameter_study(PLAN, tmp_path, study=as504, scheduler=started.scheduler_address, progress=close)
    found = run_parameter_study(PLAN, tmp_path, study=as504)
    assert found.data["status"].values.tolist() == 64 * [0]


def test_a_system_of_ones_own_stays_here(tmp_path):
    with pytest.raises(SchedulerError, match="only a vehicle; leave the scheduler out"):
        run_parameter_study(dispersion(4, normal("gain", 0.1)), tmp_path, study=lag(), scheduler="tcp://127.0.0.1:1")


def test_without_dask_it_says_what_to_install(as504, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SchedulerError, match=r"pip install 'ascentwind\[dask\]'"):
        run_parameter_study(PLAN, tmp_path, study=as504, scheduler="tcp://127.0.0.1:1")
