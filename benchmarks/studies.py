"""Parameter studies of AS-504: a dispersion on this machine and on Dask workers, and kills at random moments.

    python benchmarks/studies.py [--members 1000] [--kills 20] [--workers 2,4,8]

Writes the table of docs/studies.md. Times are after load. Processor time is what the members themselves took, in the
process that computed them. The overhead is what a run took beyond: by wall time over that time shared by the cores,
which other work on the machine spoils, and by the processor time of all processes of the run. What Dask's processes do
by the clock grows with wall time, so that other work on the machine lifts that too. The floor is the least that Dask
can do with the same members: a task for each worker, nothing stored.
"""

from __future__ import annotations

import argparse
import logging
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import psutil

from ascentwind.runners import Study
from ascentwind.runners.parameter_study import run
from ascentwind.runners.parameter_study.cluster import packed, work
from ascentwind.runners.parameter_study.compute import chunks
from ascentwind.runners.parameter_study.plan import read_plan
from ascentwind.runners.parameter_study.quantities import resolve_quantities
from ascentwind.runners.parameter_study.sampling import member_values
from ascentwind.runners.solvers.cores import available_cores

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "as504_dispersion.toml"
PAGE = ROOT / "docs" / "studies.md"
BEGIN, END = "<!-- numbers begin -->", "<!-- numbers end -->"
# what docs/studies.md recommends: a health check of each event loop 50 times a second, a sampling profiler, a monitor
QUIET = {
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "5s",
}


def plan_of(members: int):
    """Return the example with another number of members."""
    plan = read_plan(EXAMPLE)
    assert plan.dispersion is not None
    return plan.model_copy(update={"dispersion": plan.dispersion.model_copy(update={"members": members})})


def processor_time(pids: Iterable[int]) -> float:
    """Return what this process and others have used, s."""
    others = (psutil.Process(pid).cpu_times() for pid in pids)
    return time.process_time() + sum(t.user + t.system for t in others)


def timed(
    plan, study: Study, folder: Path, scheduler: str | None = None, pids: Iterable[int] = ()
) -> tuple[float, float, float]:
    """Return wall time, processor time of the members and of all processes, of a run into an empty folder, s."""
    shutil.rmtree(folder, ignore_errors=True)
    spent = []

    def counted(function: Callable) -> Callable:
        def generator(*arguments):
            for chunk, result in function(*arguments):
                spent.append(result.cpu_seconds)
                yield chunk, result

        return generator

    local, cluster = run.compute_locally, run.compute_on_cluster
    run.compute_locally, run.compute_on_cluster = counted(local), counted(cluster)
    try:
        start, used = time.perf_counter(), processor_time(pids)
        run.run_parameter_study(plan, folder, study=study, scheduler=scheduler)
        return time.perf_counter() - start, sum(spent), processor_time(pids) - used
    finally:
        run.compute_locally, run.compute_on_cluster = local, cluster


def floor(plan, study: Study, scheduler: str, pids: list[int]) -> tuple[float, float, float]:
    """Return the same times of the members on Dask by one task for each worker, nothing stored."""
    from distributed import Client

    quantities = resolve_quantities(study, plan)
    values = [(chunk.first, chunk.values) for chunk in chunks(member_values(plan, quantities))]
    task = run._task(study, plan, quantities)
    start, used = time.perf_counter(), processor_time(pids)
    with Client(scheduler, set_as_default=False) as client:
        sent = client.submit(bytes, packed(study, task))
        shares = [client.submit(work, sent, values[k :: len(pids)], pure=False) for k in range(len(pids))]
        spent = [result.cpu_seconds for results, _ in client.gather(shares) for result in results]
    return time.perf_counter() - start, sum(spent), processor_time(pids) - used


def row(label: str, wall: float, members: float, everything: float, shared: int) -> str:
    by_wall, by_processor = wall / (members / shared) - 1, everything / members - 1
    return (
        f"| {label} | {wall:.1f} s | {members:.1f} s | {everything:.1f} s | {100 * by_wall:+.1f} % | "
        f"{100 * by_processor:+.1f} % |"
    )


def speeds(members: int, workers: list[int], folder: Path) -> list[str]:
    """Return rows of the table: this machine, then clusters of several worker processes."""
    study, cores = Study.load("as504"), available_cores()
    plan = plan_of(members)
    timed(plan_of(40), study, folder / "warm")
    rows = [row(f"{cores} threads of this process", *timed(plan, study, folder / "here"), cores)]
    print(rows[-1], flush=True)
    for settings, words in ((QUIET, ""), ({}, ", Dask as it comes")):
        for count in workers:
            found, least = on_workers(plan, count, settings, study, folder)
            shared = min(count, cores)
            rows.append(row(f"{count} Dask worker processes{words}", *found, shared))
            rows.append(row("its floor", *least, shared))
            print("\n".join(rows[-2:]), flush=True)
    return rows


def on_workers(plan, count: int, settings: dict, study: Study, folder: Path) -> tuple[tuple, tuple]:
    """Return times of a study on a cluster of this machine, and those of its floor."""
    import dask
    from distributed import LocalCluster

    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0
        ) as cluster,
    ):
        timed(plan_of(40 * count), study, folder / "warm", cluster.scheduler_address)  # every worker loads
        pids = [nanny.pid for nanny in cluster.workers.values()]
        found = timed(plan, study, folder / "there", cluster.scheduler_address, pids)
        least = floor(plan, study, cluster.scheduler_address, pids)
    if (folder / "there" / "study.nc").read_bytes() != (folder / "here" / "study.nc").read_bytes():
        sys.exit(f"{count} workers give other bytes")
    return found, least


def kills(count: int, folder: Path) -> str:
    """Kill ``ascentwind study`` at random moments; return a sentence on what became of it."""
    text = EXAMPLE.read_text().replace("members = 1000", "members = 400").replace("50:100:1", "70:80:2")
    file = folder / "killed.toml"
    file.write_text(text)
    study, plan = Study.load("as504"), read_plan(file)
    run.run_parameter_study(plan, folder / "whole", study=study)
    expected = (folder / "whole" / "study.nc").read_bytes()
    out, moments, before, hit = folder / "killed", random.Random(504), {}, 0
    for _ in range(count):
        process = subprocess.Popen(
            [sys.executable, "-c", "from ascentwind.runners.cli.app import main; main()", "study", file, "--out", out],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while not (out / "chunks").exists() and process.poll() is None:
            time.sleep(0.01)
        goal = len(before) + moments.randrange(0, 3)
        while len(stored(out)) < goal and process.poll() is None:
            time.sleep(0.001)
        time.sleep(moments.uniform(0.0, 1.0))
        process.send_signal(signal.SIGKILL)
        hit += process.wait() == -signal.SIGKILL
        now = stored(out)
        if not before.items() <= now.items():
            sys.exit("a chunk was computed a second time")
        before = now
        print(f"kill {hit}: {len(before)} of 40 chunks", flush=True)
    run.run_parameter_study(plan, out, study=study)
    if not before.items() <= stored(out).items() or (out / "study.nc").read_bytes() != expected:
        sys.exit("the resumed study differs")
    return (
        f"`ascentwind study` with 400 members, killed (SIGKILL) {hit} times at random moments: `study.nc` ends with "
        f"the bytes of an uninterrupted run, and none of the {len(before)} chunks stored at the last kill was written "
        "twice."
    )


def stored(folder: Path) -> dict[str, tuple[int, int]]:
    return {p.name: (p.stat().st_ino, p.stat().st_mtime_ns) for p in (folder / "chunks").glob("[0-9]*.nc")}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--members", type=int, default=1000)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--workers", default="2,4,8")
    given = parser.parse_args()
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as name:
        rows = speeds(given.members, [int(w) for w in given.workers.split(",")], Path(name))
        sentence = kills(given.kills, Path(name))
    table = "\n".join(
        [
            f"{given.members} members of `examples/as504_dispersion.toml`, 51 end times, {available_cores()} cores, "
            f"load average {os.getloadavg()[1]:.1f} in the five minutes before the end:",
            "",
            "| where | wall time | processor time, members | all processes | overhead, wall | overhead, processor |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            sentence,
        ]
    )
    page = PAGE.read_text()
    head, rest = page.split(BEGIN)
    PAGE.write_text(f"{head}{BEGIN}\n{table}\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
