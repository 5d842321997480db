"""Ctrl-C in every command: ended at once, exit code 130, no traceback, the cache and stored results left usable."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from ascentwind.codegen.toolchain.interruption import Workers, interruptible
from ascentwind.runners import Cvodes
from ascentwind.runners.cli.exit_codes import INTERRUPTED
from ascentwind.runners.solvers.cores import available_cores

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads processor time from /proc")

SLOWEST = 3.0  # s of processor time; it is some 0.05 s, and 2 s where the alarm has to ring
STARTED = "from ascentwind.runners.cli.entry import main; main()"
EXAMPLES = Path(__file__).parents[3] / "examples"
COMMANDS = {
    "run": ["run", "as504"],
    "run by CVODES": ["run", "as504", "--engine", "cvodes", "--tolerance", "1e-12"],
    "run by the covariance equation": ["run", "as504", "--engine", "covariance"],
    "run by the ensemble": ["run", "as504", "--engine", "ensemble"],
    "mean": ["mean", "as504"],
    "sensitivity": ["sensitivity", "as504"],
    "verify": ["verify", "as504"],
    "tolerance": ["tolerance", "as504"],
    "design": ["design", "as504"],
    "study": ["study", str(EXAMPLES / "as504_dispersion.toml")],
    "reproduce": ["reproduce", "--out", "page"],
    "build-vehicle": ["build-vehicle", "as504", "--out", "built", "--figures", "figures"],
    "equations": ["equations", "as504", "--page", "page.md"],
    "wind fit": ["wind", "fit"],
    "inspect": ["inspect", "as504", "--time", "75"],
    "regenerate": ["regenerate"],
}


def start(arguments: list[str], folder: Path, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", STARTED, *arguments], cwd=folder, env=os.environ | environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's background job ignores it
    )  # fmt: skip


def processor_seconds(process: subprocess.Popen[str]) -> float:
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def interrupt(process: subprocess.Popen[str]) -> tuple[float, str]:
    """Send SIGINT; return the processor time until the process has ended, s, and what it printed as errors."""
    before, used = ended_processes(), processor_seconds(process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    return ended_processes() - before - used, errors


def ended_processes() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@pytest.mark.parametrize("moment", [0.3, *(pytest.param(m, marks=pytest.mark.slow) for m in (2.0, 3.5))])
@pytest.mark.parametrize("command", COMMANDS)
def test_commands_end_at_once(command, moment, tmp_path):
    process = start(COMMANDS[command], tmp_path)
    while process.poll() is None and processor_seconds(process) < moment:
        time.sleep(0.01)
    if process.poll() is not None:
        pytest.skip("it had ended before")
    delay, errors = interrupt(process)
    if process.returncode == 0:
        pytest.skip("all was done before it heard")
    assert process.returncode == INTERRUPTED, errors
    assert "Traceback" not in errors
    assert "error" not in errors
    assert delay < SLOWEST
    assert not [p for p in tmp_path.rglob("*") if p.is_file() and p.name.startswith(".") and p.name != ".lock"]


def test_compiler_under_way_is_ended(tmp_path):
    """The driver starts another process, as compilers do; both end, and the cache serves the next."""
    script, cache = tmp_path / "slowcc", tmp_path / "cache"
    script.write_text(
        '#!/bin/sh\ncase "$*" in *--version*) echo slow 1; exit;; *-E*) cat >/dev/null; exit;; esac\n'
        f"sleep 600 & echo $! > {tmp_path}/worker\nwait\n"
    )
    script.chmod(0o755)
    process = start(["run", "as504"], tmp_path, CC=str(script), ASCENTWIND_CACHE=str(cache))
    while not (tmp_path / "worker").exists() or not (tmp_path / "worker").read_text().strip():
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    delay, errors = interrupt(process)
    assert (process.returncode, delay < SLOWEST, "Traceback" in errors) == (INTERRUPTED, True, False)
    worker = int((tmp_path / "worker").read_text())
    status = Path(f"/proc/{worker}/status")
    assert not status.exists() or "zombie" in status.read_text()
    assert not [p for p in cache.iterdir() if p.is_dir()]


@pytest.mark.slow
def test_interrupted_study_keeps_its_chunks(tmp_path):
    process = start(COMMANDS["study"], tmp_path)
    chunks = tmp_path / "as504_dispersion-results" / "chunks"
    while not list(chunks.glob("0*.nc")):
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    delay, errors = interrupt(process)
    assert (process.returncode, delay < SLOWEST) == (INTERRUPTED, True)
    assert "run the same command again" in " ".join(errors.split())
    assert list(chunks.glob("0*.nc"))
    assert not list(chunks.glob(".*.nc"))


def signal_after(seconds: float) -> threading.Timer:
    timer = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    return timer


@pytest.mark.skipif(signal.getsignal(signal.SIGINT) is signal.SIG_IGN, reason="SIGINT is ignored here")
@pytest.mark.parametrize("engine", ["cvodes", "sweep"])
def test_library_raises_keyboard_interrupt(as504, engine):
    """In Python too; CVODES does not take it for a failure of the equations."""
    options = Cvodes(relative_tolerance=1e-13, method="bdf") if engine == "cvodes" else None
    as504.response_statistics([20.0], engine=engine)
    timer = signal_after(0.3)
    with pytest.raises(KeyboardInterrupt):
        for _ in range(1000):
            as504.response_statistics(np.arange(20.0, 140.0), engine=options or engine)
    timer.join()
    assert as504.response_statistics([20.0], engine=engine).variance.sel(response="bending_moment").min() > 0


@pytest.mark.skipif(signal.getsignal(signal.SIGINT) is signal.SIG_IGN, reason="SIGINT is ignored here")
def test_batch_is_stopped_within_a_sweep(as504):
    begin, timer = time.process_time(), signal_after(0.5)
    with pytest.raises(KeyboardInterrupt):
        as504.batch([{}] * 5000, np.arange(20.0, 140.0))
    timer.join()
    assert time.process_time() - begin < 0.5 * available_cores() + SLOWEST


def compute_until_stopped(begun: threading.Event):
    """Return what a thread computes on and on, as compiled code does, until its flag is raised."""

    def compiled(flag) -> int:
        begun.set()
        while not flag[0]:
            time.sleep(0.001)
        return -1

    return compiled


def test_flag_reaches_what_the_threads_call():
    begun, futures = threading.Event(), []
    with pytest.raises(ZeroDivisionError), Workers(1) as pool:
        futures += [pool.submit(interruptible, compute_until_stopped(begun)) for _ in range(2)]
        begun.wait()
        raise ZeroDivisionError
    running, waiting = futures
    assert waiting.cancelled()
    with pytest.raises(KeyboardInterrupt):
        running.result()


class Swallowed:
    """Gone through a destructor, in which Python drops every exception."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


LOCK = threading.Lock()


def in_a_destructor() -> None:
    Swallowed()


def with_a_lock_taken() -> None:
    """As within ``with condition:``, before its block, where Python's own locks stay taken."""
    LOCK.acquire()
    signal.raise_signal(signal.SIGINT)
    LOCK.release()


@pytest.mark.skipif(signal.getsignal(signal.SIGINT) is signal.SIG_IGN, reason="SIGINT is ignored here")
@pytest.mark.parametrize("moment", [in_a_destructor, with_a_lock_taken])
def test_no_moment_loses_it(moment):
    """The threads are stopped, no lock stays taken, and the exception comes out of the block."""
    begun, futures, before = threading.Event(), [], signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), Workers(2) as pool:
        futures += [pool.submit(interruptible, compute_until_stopped(begun)) for _ in range(4)]
        begun.wait()
        moment()
        for future in futures:
            with pytest.raises(KeyboardInterrupt):
                future.result(timeout=60.0)
        with pytest.raises(KeyboardInterrupt):
            pool.submit(int)
    assert all(future.done() for future in futures)
    assert not LOCK.locked()
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(signal.getsignal(signal.SIGINT) is signal.SIG_IGN, reason="SIGINT is ignored here")
def test_batch_of_many_is_stopped_wherever_it_is(as504):
    """Most of the time of so many goes into handing them to the threads, whose locks are Python's own."""
    times = np.arange(20.0, 140.0)
    for seconds in np.linspace(0.05, 0.5, 8):
        timer = signal_after(seconds)
        with pytest.raises(KeyboardInterrupt):
            as504.batch([{}] * 5000, times)
        timer.join()


@pytest.mark.skipif(signal.getsignal(signal.SIGINT) is signal.SIG_IGN, reason="SIGINT is ignored here")
def test_pools_within_each_other_all_stop():
    """Those of a generator may outlive one made after them."""
    begun, before = threading.Event(), signal.getsignal(signal.SIGINT)
    outer, inner = Workers(1), Workers(1)
    with pytest.raises(KeyboardInterrupt), outer, inner:
        waiting = [pool.submit(interruptible, compute_until_stopped(begun)) for pool in (outer, inner)]
        begun.wait()
        signal.raise_signal(signal.SIGINT)
        for future in waiting:
            with pytest.raises(KeyboardInterrupt):
                future.result(timeout=60.0)
    assert signal.getsignal(signal.SIGINT) is before
    outer, inner = Workers(1), Workers(1)
    outer.__enter__()
    inner.__enter__()
    outer.__exit__(None, None, None)
    inner.__exit__(None, None, None)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_handler_of_ones_own_decides():
    """One that raises nothing has not asked for an end; a second Ctrl-C is raised at once."""
    heard: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    try:
        with Workers(1) as pool:
            signal.raise_signal(signal.SIGINT)
            assert pool.submit(int, "7").result() == 7
        assert heard == [signal.SIGINT]
        signal.signal(signal.SIGINT, signal.default_int_handler)
        reached = []
        with pytest.raises(KeyboardInterrupt), Workers(1):
            signal.raise_signal(signal.SIGINT)
            reached.append("after the first")
            signal.raise_signal(signal.SIGINT)
            reached.append("after the second")
        assert reached == ["after the first"]
    finally:
        signal.signal(signal.SIGINT, before)
