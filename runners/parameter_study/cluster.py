"""Chunks on a Dask cluster: parameter values go out, statistics come back, the vehicle travels once to each worker."""

from __future__ import annotations

import hashlib
import logging
import pickle
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable
from functools import lru_cache
from queue import Empty, SimpleQueue
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindError
from ...model.vehicle.vehicle import Vehicle
from ..case.provenance import data_hash
from ..study import Study
from .compute import NUMBERS, Chunk, ChunkResult, Task, code_of, compute_chunk, empty_result

log = logging.getLogger(__name__)

CONNECT_SECONDS = 10.0
WORKER_SECONDS = 60.0  # how long a cluster may be without workers
LOOK_SECONDS = 2.0
UNDER_WAY = 2  # Dask tasks for each thread of the cluster: one at work, one waiting on the same worker
TASK_SECONDS = 2.0  # of chunks in one Dask task, which itself costs client, scheduler and worker some 10 ms

Compute = Callable[[Study, Task, Chunk], ChunkResult]


class SchedulerError(AscentwindError):
    """A Dask cluster cannot be reached, has no workers, or does not hold what the study needs."""


def compute_on_cluster(
    address: str, study: Study, task: Task, missing: Iterable[Chunk], compute: Compute = compute_chunk
) -> Generator[tuple[Chunk, ChunkResult], None, None]:
    """Yield chunks as they are done, in any order.

    A chunk whose workers died (as often as the scheduler's ``allowed-failures``) is tried again at the end, member by
    member, so that one that kills its worker is found; its result says so.

    Parameters
    ----------
    address : str
        Of the scheduler, such as 'tcp://host:8786'.

    Raises
    ------
    SchedulerError
    """
    if study.vehicle is None:
        raise SchedulerError(
            "a system of your own cannot be sent to a cluster, only a vehicle; leave the scheduler out to compute here"
        )
    distributed = _distributed()
    client = _connect(distributed, address)
    try:
        yield from _Dispatch(distributed, client, address, study, task, packed(study, task, compute)).run(list(missing))
    except (distributed.CancelledError, distributed.comm.CommClosedError, OSError):
        raise SchedulerError(
            f"the connection to the scheduler at {address} was lost; stored members stay: start the cluster again "
            "and run the same command"
        ) from None
    finally:
        client.close(timeout=LOOK_SECONDS)


def packed(study: Study, task: Task, compute: Compute = compute_chunk) -> bytes:
    """Return all that ``work`` needs beside the values of members, so that it is not sent and read again with each."""
    return pickle.dumps((pickle.dumps((study.vehicle, study.executable.parameters)), task, compute))


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise SchedulerError("a scheduler needs Dask, which is not installed: pip install 'ascentwind[dask]'") from None
    return distributed


def _connect(distributed: Any, address: str) -> Any:
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # its tracebacks; ours say the same in a sentence
    address = address if "://" in address else f"tcp://{address}"
    try:
        distributed.comm.get_address_host_port(address, strict=True)  # else a client tries for long, then says much
    except ValueError as error:
        raise SchedulerError(
            f"'{address}' is not the address of a scheduler ({error}); give one such as tcp://host:8786"
        ) from None
    try:
        client = distributed.Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise SchedulerError(
            f"no scheduler answers at {address} within {CONNECT_SECONDS:g} s ({str(error).splitlines()[0]}); see that "
            "'dask scheduler' runs there and that the address, such as tcp://host:8786, is right"
        ) from None
    try:
        client.wait_for_workers(1, timeout=CONNECT_SECONDS)
    except TimeoutError:
        client.close(timeout=LOOK_SECONDS)
        raise SchedulerError(_no_workers(address, CONNECT_SECONDS)) from None
    return client


def _no_workers(address: str, seconds: float) -> str:
    return (
        f"the scheduler at {address} has had no workers for {seconds:g} s; start some with 'dask worker {address}' and "
        "run the same command again, stored members stay"
    )


class _Dispatch:
    """Chunks under way on a cluster."""

    def __init__(self, distributed: Any, client: Any, address: str, study: Study, task: Task, sent: bytes):
        self.distributed, self.client, self.address = distributed, client, address
        self.study, self.task = study, task
        self.key = hashlib.sha256(sent).hexdigest()
        # a task, not scattered data: a cluster can make it again when the worker that held it is lost
        self.sent = client.submit(bytes, sent, key=f"ascentwind-vehicle-{self.key[:16]}", priority=10)
        self.identity = _identity(study)
        self.warned = False
        self.done: SimpleQueue[Any] = SimpleQueue()
        self.threads, self.asked = 0, -LOOK_SECONDS
        self.spent, self.computed = 0.0, 0

    def run(self, waiting: list[Chunk]) -> Generator[tuple[Chunk, ChunkResult], None, None]:
        killed = []
        for chunk, result in self._flow(waiting, at_once=True):
            if result is None:
                killed.append(chunk)
            else:
                yield chunk, result
        for chunk in sorted(killed, key=lambda c: c.first):
            log.warning("members %s lost their workers; they are tried again one by one", chunk.name)
            members = [Chunk(chunk.first + k, chunk.values[k : k + 1]) for k in range(len(chunk.values))]
            alone = dict(self._flow(members, at_once=False))
            died = empty_result(self.study, self.task, 1, "its worker died at every attempt")
            yield chunk, _joined([alone[member] or died for member in members])

    def _flow(self, waiting: list[Chunk], at_once: bool) -> Generator[tuple[Chunk, ChunkResult | None], None, None]:
        """Yield chunks as they are done, None for one that lost its workers.

        Alone on the cluster a chunk cannot be blamed for the death of a worker that it shared with another.
        """
        queue, running = deque(waiting), {}
        seen = time.monotonic()
        while queue or running:
            threads = self._threads()
            while queue and len(running) < (UNDER_WAY * max(1, threads) if at_once else 1):
                size = together(self.spent, self.computed, len(queue), threads) if at_once else 1
                some = [queue.popleft() for _ in range(size)]
                running[self._submit(some, alone=not at_once)] = some
            if threads:
                seen = time.monotonic()
            elif time.monotonic() - seen > WORKER_SECONDS:
                raise SchedulerError(_no_workers(self.address, WORKER_SECONDS))
            try:
                future = self.done.get(timeout=LOOK_SECONDS)
            except Empty:
                continue
            some = running.pop(future)
            results = self._result(future)
            if results is not None:
                self.spent += sum(r.cpu_seconds for r in results)
                self.computed += len(results)
            del future  # the cluster forgets it, and its result
            yield from zip(some, results or [None] * len(some), strict=True)

    def _threads(self) -> int:
        """Return the threads of all workers, asked for now and then: the scheduler describes every worker at length."""
        if self.client.status == "closed":
            raise OSError("it does not answer")
        if time.monotonic() - self.asked >= LOOK_SECONDS:
            workers = self.client.scheduler_info(n_workers=-1).get("workers", {})
            self.threads, self.asked = sum(worker["nthreads"] for worker in workers.values()), time.monotonic()
        return self.threads

    def _submit(self, some: list[Chunk], alone: bool) -> Any:
        key = f"ascentwind-{self.key[:8]}-{id(self)}-{some[0].name}{'-alone' if alone else ''}"
        values = [(chunk.first, chunk.values) for chunk in some]
        future = self.client.submit(work, self.sent, values, pure=False, key=key)
        future.add_done_callback(self.done.put)
        return future

    def _result(self, future: Any) -> list[ChunkResult] | None:
        """Return the results of a Dask task, None if its workers died."""
        try:
            results, identity = future.result()
        except self.distributed.KilledWorker:
            return None
        except (ImportError, AttributeError) as error:
            raise SchedulerError(
                f"a worker cannot load what it is sent ({error}); install this ascentwind there"
            ) from None
        self._compare(identity)
        return results

    def _compare(self, identity: dict[str, str]) -> None:
        """Refuse results of another program, and say when another processor may change last digits."""
        for name in ("ascentwind", "casadi", "numpy", "data"):
            if identity[name] != self.identity[name]:
                raise SchedulerError(
                    f"a worker has {name} {identity[name]} and this process {self.identity[name]}; install the same on "
                    "all machines"
                )
        if identity["code"] != self.identity["code"] and not self.warned:
            self.warned = True
            log.warning("a worker has another compiler or processor than this machine: last digits may differ")


def together(spent: float, computed: int, waiting: int, threads: int) -> int:
    """Return how many chunks go into the next Dask task.

    Parameters
    ----------
    spent : float
        Processor time of the chunks computed so far, s.
    computed, waiting : int
        Chunks.
    threads : int
        Of the cluster; towards the end they share what is left, so that all end together.
    """
    if not computed:
        return 1
    long_enough = int(TASK_SECONDS * computed / max(spent, 1e-3 * computed))
    return max(1, min(long_enough, waiting // (2 * max(1, threads))))


def _joined(parts: list[ChunkResult]) -> ChunkResult:
    joined = {name: np.concatenate([getattr(p, name) for p in parts]) for name in (*NUMBERS, "status")}
    reason = tuple(r for p in parts for r in p.reason)
    return ChunkResult(**joined, reason=reason, cpu_seconds=sum(p.cpu_seconds for p in parts))


def _identity(study: Study) -> dict[str, str]:
    from importlib.metadata import version

    return {
        "ascentwind": version("ascentwind"),
        "casadi": ca.CasadiMeta.version(),
        "numpy": np.__version__,
        "data": data_hash(study),
        "code": code_of(study),
    }


_loading = threading.Lock()


def work(sent: bytes, some: list[tuple[int, NDArray[np.float64]]]) -> tuple[list[ChunkResult], dict[str, str]]:
    """Compute chunks on a worker, which loads a vehicle once; return with them what they were computed by."""
    with _loading:
        vehicle, task, compute = _opened(sent)
        study, identity = _loaded(vehicle)
    return [compute(study, task, Chunk(*numbers)) for numbers in some], identity


@lru_cache(maxsize=8)
def _opened(sent: bytes) -> tuple[bytes, Task, Compute]:
    return pickle.loads(sent)


@lru_cache(maxsize=8)
def _loaded(sent: bytes) -> tuple[Study, dict[str, str]]:
    vehicle: Vehicle
    vehicle, parameters = pickle.loads(sent)
    study = Study.from_vehicle(vehicle)
    study = Study(study.executable.with_numbers(parameters=parameters), vehicle)
    return study, _identity(study)
