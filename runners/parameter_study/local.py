"""Chunks on the cores of this machine, by threads: the generated sweep runs without Python's lock."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from concurrent.futures import as_completed

from ...codegen.toolchain.interruption import Workers
from ..solvers.cores import available_cores
from ..study import Study
from .compute import Chunk, ChunkResult, Task, compute_chunk


def compute_locally(
    study: Study, task: Task, missing: Iterable[Chunk]
) -> Generator[tuple[Chunk, ChunkResult], None, None]:
    """Yield chunks as they are done, in any order.

    When the caller stops, those not yet done are dropped.
    """
    with Workers(available_cores()) as pool:
        running = {pool.submit(compute_chunk, study, task, chunk): chunk for chunk in missing}
        for future in as_completed(running):
            yield running.pop(future), future.result()
