"""Members into statistics: each by itself, so that its bits depend neither on its neighbours nor on who computes it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.compiled import sweep_of
from ...codegen.system.executable import ExecutableSystem
from ...model.errors import AscentwindError
from ..solvers.adjoint import adjoint_member
from ..solvers.stability import first_unstable
from ..solvers.sweep import sweep_member
from ..statistics.cvodes import Cvodes
from ..statistics.sweep import Sweep
from ..study import Study
from .quantities import Quantity, member_numbers

CHUNK = 10  # members computed and stored together
COMPUTED, UNSTABLE, FAILED = 0, 1, 2
STATUS = ("computed", "unstable", "failed")
_interpreted = Lock()  # CVODES catches what CasADi writes, for the whole process


@dataclass(frozen=True)
class Task:
    """What is computed for every member.

    Attributes
    ----------
    quantities : tuple of Quantity
    times : tuple of float
        End times t2, increasing, s.
    responses : tuple of str
    relative_tolerance : float
    """

    quantities: tuple[Quantity, ...]
    times: tuple[float, ...]
    responses: tuple[str, ...]
    relative_tolerance: float


@dataclass(frozen=True, eq=False)
class Chunk:
    """Some members to compute: the number of the first, and the values of all, (k, quantities)."""

    first: int
    values: NDArray[np.float64]

    @property
    def last(self) -> int:
        return self.first + len(self.values) - 1

    @property
    def name(self) -> str:
        return f"{self.first:07d}-{self.last:07d}"


@dataclass(frozen=True, eq=False)
class ChunkResult:
    """The statistics of the members of a chunk.

    Attributes
    ----------
    mean : (k, times, responses) array
    variance : (k, times, responses, sources) array
        NaN where a member failed.
    status : (k,) int8 array
        COMPUTED, UNSTABLE (computed, with an unstable root at a frozen time) or FAILED.
    reason : tuple of str
        Why it is unstable or failed.
    cpu_seconds : float
        Of the members; not stored.
    """

    mean: NDArray[np.float64]
    variance: NDArray[np.float64]
    status: NDArray[np.int8]
    reason: tuple[str, ...]
    cpu_seconds: float = 0.0


def chunks(values: NDArray[np.float64]) -> Iterator[Chunk]:
    """Cut the members, (members, quantities), into chunks."""
    for first in range(0, len(values), CHUNK):
        yield Chunk(first, values[first : first + CHUNK])


def compute_chunk(study: Study, task: Task, chunk: Chunk) -> ChunkResult:
    """Return the statistics of the members of a chunk; one that fails leaves its reason and no more."""
    start = time.thread_time()
    result = empty_result(study, task, len(chunk.values))
    reasons, statistics = list(result.reason), _member_statistics(study, task)
    rows = [study.system.output_index(name) for name in task.responses]
    for k, row in enumerate(chunk.values):
        try:
            member = member_numbers(study, task.quantities, row)
            mean, variance = statistics(member)
            reasons[k] = first_unstable(member, task.times[-1]) or ""
        except AscentwindError as error:
            reasons[k] = str(error)
            continue
        result.mean[k], result.variance[k] = mean[:, rows], variance[:, rows]
        result.status[k] = UNSTABLE if reasons[k] else COMPUTED
    return ChunkResult(result.mean, result.variance, result.status, tuple(reasons), time.thread_time() - start)


def engine_name(study: Study) -> str:
    """Return the name of the engine of members: the sweep or, where nothing is compiled, CVODES."""
    return Cvodes.name if study.executable.shared_library is None else Sweep.name


def code_of(study: Study) -> str:
    """Return what the bits of a member depend on: the key of the compiled sweep, or that it is interpreted."""
    if engine_name(study) == Cvodes.name:
        return "interpreter"
    return sweep_of(study.executable).shared_library.key


Numbers = tuple[NDArray[np.float64], NDArray[np.float64]]  # mean and variance


def _member_statistics(study: Study, task: Task) -> Callable[[ExecutableSystem], Numbers]:
    """Return what computes mean and variance of all responses of a member."""
    if engine_name(study) == Cvodes.name:
        settings = Cvodes(relative_tolerance=task.relative_tolerance)

        def by_cvodes(member: ExecutableSystem) -> Numbers:
            member.system.refuse_direct_noise(task.responses)
            with _interpreted:
                return adjoint_member(study.mean.fill(member), task.times, settings)

        return by_cvodes
    compiled = sweep_of(study.executable)

    def by_sweep(member: ExecutableSystem) -> Numbers:
        found = sweep_member(
            compiled,
            member,
            task.times,
            relative_tolerance=task.relative_tolerance,
            responses=task.responses,
            fill=study.mean.fill,
        )
        return found.mean, found.variance

    return by_sweep


def empty_result(study: Study, task: Task, members: int, reason: str = "") -> ChunkResult:
    """Return a result of which every member failed."""
    shape = (members, len(task.times), len(task.responses))
    return ChunkResult(
        np.full(shape, np.nan),
        np.full((*shape, len(study.system.sources)), np.nan),
        np.full(members, FAILED, np.int8),
        (reason,) * members,
    )
