"""The fuzzer: seeded mistakes in every kind of file and in systems of one's own, none of which may end badly.

A minute of it runs with the tests. The long run, on all cores, with a line of JSON a case in a file:

    ASCENTWIND_FUZZ_CASES=10000 ASCENTWIND_FUZZ_REPORT=fuzz.jsonl python -m pytest -s tests/fuzz/test_fuzz.py

The file holds what was found before any reason for it; ``python tests/fuzz/fuzz_legitimate.py fuzz.jsonl`` judges it
anew after the reasons changed.
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TextIO

import pytest
from fuzz_legitimate import GOOD, judged

from ascentwind.runners.solvers.cores import available_cores

SECONDS = 40.0  # for cases, where no number of them is asked for
SILENCE = 300.0  # s without a line: a hang
FOLDER = Path(__file__).parent


@pytest.mark.slow
def test_no_mistake_ends_badly(cache):
    wanted = os.environ.get("ASCENTWIND_FUZZ_CASES")
    cases = int(wanted or 1000)
    budget = None if wanted else SECONDS
    processes = int(os.environ.get("ASCENTWIND_FUZZ_PROCESSES", available_cores() if wanted else 1))
    edges = [cases * k // processes for k in range(processes + 1)]
    with (
        ThreadPoolExecutor(processes) as pool,
        Path(os.environ.get("ASCENTWIND_FUZZ_REPORT", os.devnull)).open("w", encoding="utf-8", buffering=1) as report,
    ):
        parts = pool.map(lambda k: list(_kept(outcomes(edges[k], edges[k + 1], budget), report)), range(processes))
        found = [judged(case) for part in parts for case in part]
    verdicts, longest = dict(Counter(c["verdict"] for c in found)), max(c["seconds"] for c in found)
    print(f"\n{len(found)} cases: {verdicts}, longest {longest} s of processor time")
    bad = [case for case in found if case["verdict"] not in GOOD]
    assert found
    assert not bad, "\n".join(json.dumps(case) for case in bad[:50])


def _kept(cases: Iterator[dict], report: TextIO) -> Iterator[dict]:
    """Write each outcome as it comes, so that a run that is stopped loses nothing."""
    for case in cases:
        report.write(json.dumps(case) + "\n")
        yield case


def outcomes(first: int, last: int, budget: float | None) -> Iterator[dict]:
    """Yield the outcomes of seeds from a process of their own, begun anew after a crash or a hang.

    ``budget`` is the time for cases (s), code compiled before them not counted.
    """
    deadline = None
    while first < last and (deadline is None or time.monotonic() < deadline):
        process = subprocess.Popen(
            [sys.executable, str(FOLDER / "fuzz_cases.py"), str(first), str(last)],
            stdout=subprocess.PIPE, text=True, encoding="utf-8",
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        lines: queue.Queue[str | None] = queue.Queue()
        reader = threading.Thread(target=_read, args=(process, lines), daemon=True)
        reader.start()
        ready = False
        try:
            while first < last and (deadline is None or time.monotonic() < deadline):
                try:
                    line = lines.get(timeout=SILENCE)
                    verdict = "crash"
                except queue.Empty:
                    line, verdict = None, "hang"
                if line is None:
                    assert ready, "the fuzzer itself does not start"
                    yield {"seed": first, "verdict": verdict, "seconds": 0.0}
                    first += 1
                    break
                case = json.loads(line)
                if ready:
                    yield case
                    first = case["seed"] + 1
                elif budget is not None:
                    deadline = deadline or time.monotonic() + budget
                ready = True
        finally:
            process.kill()
            process.wait()


def _read(process: subprocess.Popen, lines: queue.Queue) -> None:
    for line in process.stdout or ():
        lines.put(line)
    lines.put(None)
