"""Members into statistics: each by itself, so that its bits depend neither on its neighbours nor on who computes it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.compiled import sweep_of
from ...codegen.system.executable import ExecutableSystem
from ...model.errors import AscentwindError
from ..case.shared_grid import shared_rule
from ..solvers.adjoint import AdjointSolver
from ..solvers.stability import first_unstable
from ..solvers.sweep import MANY, sweep_member
from ..statistics.cvodes import Cvodes
from ..statistics.norm import NormOfNormal
from ..statistics.resultants import resultant_pairs
from ..statistics.sweep import Sweep
from ..study import Study
from .quantities import Quantity, member_numbers

CHUNK = 10  # members computed and stored together
COMPUTED, UNSTABLE, FAILED = 0, 1, 2
STATUS = ("computed", "unstable", "failed")
NUMBERS = ("mean", "variance", "plane_mean", "plane_covariance", "level")
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
    resultants : tuple of str
        Norms of two responses each.
    relative_tolerance, probability : float
        The second is that with which a resultant passes its level at an instant.
    members : int
        Of the whole study: many share the rule of a grid, chosen on the nominal numbers.
    """

    quantities: tuple[Quantity, ...]
    times: tuple[float, ...]
    responses: tuple[str, ...]
    resultants: tuple[str, ...]
    relative_tolerance: float
    probability: float
    members: int = 1

    def rows(self, study: Study) -> tuple[list[int], list[tuple[int, int]]]:
        """Return the numbers of the responses among all, and of both responses of each resultant."""
        pairs, number = resultant_pairs(study.system.output_names), study.system.output_index
        of_resultants = [(number(first), number(second)) for first, second in map(pairs.__getitem__, self.resultants)]
        return [number(name) for name in self.responses], of_resultants


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
    plane_mean : (k, times, resultants, 2) array
        Of both responses of a resultant.
    plane_covariance : (k, times, resultants, sources, 2, 2) array
    level : (k, times, resultants) array
        What a resultant passes with the task's probability. All are NaN where a member failed.
    status : (k,) int8 array
        COMPUTED, UNSTABLE (computed, with an unstable root at a frozen time) or FAILED.
    reason : tuple of str
        Why it is unstable or failed.
    cpu_seconds : float
        Of the members; not stored.
    """

    mean: NDArray[np.float64]
    variance: NDArray[np.float64]
    plane_mean: NDArray[np.float64]
    plane_covariance: NDArray[np.float64]
    level: NDArray[np.float64]
    status: NDArray[np.int8]
    reason: tuple[str, ...]
    cpu_seconds: float = 0.0

    @property
    def numbers(self) -> dict[str, NDArray[np.float64]]:
        """All that is computed, by name."""
        return {name: getattr(self, name) for name in NUMBERS}


def chunks(values: NDArray[np.float64]) -> Iterator[Chunk]:
    """Cut the members, (members, quantities), into chunks."""
    for first in range(0, len(values), CHUNK):
        yield Chunk(first, values[first : first + CHUNK])


def compute_chunk(study: Study, task: Task, chunk: Chunk) -> ChunkResult:
    """Return the statistics of the members of a chunk; one that fails leaves its reason and no more."""
    start = time.thread_time()
    result = empty_result(study, task, len(chunk.values))
    reasons, statistics = list(result.reason), _member_statistics(study, task)
    for k, row in enumerate(chunk.values):
        try:
            member = member_numbers(study, task.quantities, row)
            found = statistics(member)
            reasons[k] = first_unstable(member, task.times[-1]) or ""
        except AscentwindError as error:
            reasons[k] = str(error)
            continue
        for name, values in found.items():
            result.numbers[name][k] = values
        result.status[k] = UNSTABLE if reasons[k] else COMPUTED
    return replace(result, reason=tuple(reasons), cpu_seconds=time.thread_time() - start)


def engine_name(study: Study) -> str:
    """Return the name of the engine of members: the sweep or, where nothing is compiled, CVODES."""
    return Cvodes.name if study.executable.shared_library is None else Sweep.name


def code_of(study: Study) -> str:
    """Return what the bits of a member depend on: the key of the compiled sweep, or that it is interpreted."""
    if engine_name(study) == Cvodes.name:
        return "interpreter"
    return sweep_of(study.executable).shared_library.key


Array = NDArray[np.float64]
Numbers = dict[str, Array]  # one member's part of each of ``NUMBERS``


def _member_statistics(study: Study, task: Task) -> Callable[[ExecutableSystem], Numbers]:
    """Return what computes the numbers of a member."""
    rows, pairs = task.rows(study)
    directly = [study.system.output_names[row] for row in {*rows, *(row for pair in pairs for row in pair)}]
    if engine_name(study) == Cvodes.name:
        settings = Cvodes(relative_tolerance=task.relative_tolerance)

        def by_cvodes(member: ExecutableSystem) -> Numbers:
            member.system.refuse_direct_noise(directly)
            with _interpreted:
                solver = AdjointSolver(study.mean.fill(member), settings)
                runs = [solver.run(time) for time in task.times]
                moments = [solver.pair_moments(time, pairs) for time in task.times] if pairs else []
            mean, variance = (np.array([getattr(run, name)[rows] for run in runs]) for name in ("mean", "variance"))
            return _numbers(task, mean, variance, moments, axis=0)

        return by_cvodes
    compiled = sweep_of(study.executable)
    rule = shared_rule(study, task.times, task.relative_tolerance) if task.members >= MANY else None

    def by_sweep(member: ExecutableSystem) -> Numbers:
        found = sweep_member(
            compiled,
            member,
            task.times,
            relative_tolerance=task.relative_tolerance,
            responses=directly,
            fill=study.mean.fill,
            rule=rule,
        )
        moments = [(found.mean[:, p], found.covariance[:, :, p][..., p]) for p in map(list, pairs)]
        return _numbers(task, found.mean[:, rows], found.variance[:, rows], moments, axis=1)

    return by_sweep


def _numbers(task: Task, mean: Array, variance: Array, moments: list[tuple[Array, Array]], axis: int) -> Numbers:
    """Return the numbers of a member by name; mean and covariance of resultants are parts to stack along an axis."""
    if not task.resultants:
        return {"mean": mean, "variance": variance}
    of_planes, between = (np.stack(parts, axis) for parts in zip(*moments, strict=True))
    level = NormOfNormal(of_planes, between.sum(axis=2)).percentile(task.probability)
    return {"mean": mean, "variance": variance, "plane_mean": of_planes, "plane_covariance": between, "level": level}


def empty_result(study: Study, task: Task, members: int, reason: str = "") -> ChunkResult:
    """Return a result of which every member failed."""
    over, sources = (members, len(task.times)), len(study.system.sources)
    responses, resultants = len(task.responses), len(task.resultants)
    shapes = {
        "mean": (responses,),
        "variance": (responses, sources),
        "plane_mean": (resultants, 2),
        "plane_covariance": (resultants, sources, 2, 2),
        "level": (resultants,),
    }
    nothing: dict[str, Any] = {name: np.full((*over, *shape), np.nan) for name, shape in shapes.items()}
    return ChunkResult(**nothing, status=np.full(members, FAILED, np.int8), reason=(reason,) * members)
