"""Chunks on a Dask cluster: parameter values go out, statistics come back, the vehicle travels once to each worker."""

from __future__ import annotations

import hashlib
import logging
import pickle
import threading
import time
from collections.abc import Callable, Generator, Iterable
from typing import Any

import casadi as ca
import numpy as np

from ...model.errors import AscentwindError
from ...model.vehicle import Vehicle
from ..statistics import data_hash
from ..study import Study
from ..sweep_engine import sweep_of
from .compute import Chunk, ChunkResult, Task, compute_chunk, empty_result

log = logging.getLogger(__name__)

CONNECT_SECONDS = 10.0
WORKER_SECONDS = 60.0  # how long a cluster may be without workers
LOOK_SECONDS = 2.0
UNDER_WAY = 4  # chunks for each thread of the cluster

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
    packed = pickle.dumps((study.vehicle, study.executable.parameters))
    client = _connect(distributed, address)
    try:
        yield from _Dispatch(distributed, client, address, study, task, packed, compute).run(list(missing))
    except (distributed.CancelledError, distributed.comm.CommClosedError, OSError):
        raise SchedulerError(
            f"the connection to the scheduler at {address} was lost; stored members stay: start the cluster again "
            "and run the same command"
        ) from None
    finally:
        client.close(timeout=LOOK_SECONDS)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise SchedulerError("a scheduler needs Dask, which is not installed: pip install 'ascentwind[dask]'") from None
    return distributed


def _connect(distributed: Any, address: str) -> Any:
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # its tracebacks; ours say the same in a sentence
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

    def __init__(
        self, distributed: Any, client: Any, address: str, study: Study, task: Task, packed: bytes, compute: Compute
    ):
        self.distributed, self.client, self.address = distributed, client, address
        self.study, self.task, self.compute = study, task, compute
        self.key = hashlib.sha256(packed).hexdigest()
        # a task, not scattered data: a cluster can make it again when the worker that held it is lost
        self.vehicle = client.submit(bytes, packed, key=f"ascentwind-vehicle-{self.key[:16]}", priority=10)
        self.identity = _identity(study)
        self.warned = False

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
        queue, running = waiting[::-1], {}
        seen = time.monotonic()
        while queue or running:
            while queue and len(running) < (UNDER_WAY * max(1, self._threads()) if at_once else 1):
                chunk = queue.pop()
                running[self._submit(chunk, alone=not at_once)] = chunk
            done = self._done(list(running))
            if self._threads():
                seen = time.monotonic()
            elif time.monotonic() - seen > WORKER_SECONDS:
                raise SchedulerError(_no_workers(self.address, WORKER_SECONDS))
            for future in done:
                yield running.pop(future), self._result(future)

    def _done(self, running: list[Any]) -> set[Any]:
        """Wait for a chunk, but not for ever."""
        try:
            with self.client.as_current():
                return self.distributed.wait(running, timeout=LOOK_SECONDS, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            return set()

    def _threads(self) -> int:
        if self.client.status == "closed":
            raise OSError("it does not answer")
        workers = self.client.scheduler_info(n_workers=-1).get("workers", {})
        return sum(worker["nthreads"] for worker in workers.values())

    def _submit(self, chunk: Chunk, alone: bool) -> Any:
        key = f"ascentwind-{self.key[:8]}-{id(self)}-{chunk.name}{'-alone' if alone else ''}"
        return self.client.submit(work, self.vehicle, self.key, self.task, chunk, self.compute, pure=False, key=key)

    def _result(self, future: Any) -> ChunkResult | None:
        """Return the result of a chunk, None if its workers died."""
        try:
            result, identity = future.result()
        except self.distributed.KilledWorker:
            return None
        except (ImportError, AttributeError) as error:
            raise SchedulerError(
                f"a worker cannot load what it is sent ({error}); install this ascentwind there"
            ) from None
        self._compare(identity)
        return result

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


def _joined(parts: list[ChunkResult]) -> ChunkResult:
    mean, variance, status = (np.concatenate([getattr(p, n) for p in parts]) for n in ("mean", "variance", "status"))
    reason = tuple(r for p in parts for r in p.reason)
    return ChunkResult(mean, variance, status, reason, sum(p.cpu_seconds for p in parts))


def _identity(study: Study) -> dict[str, str]:
    from importlib.metadata import version

    return {
        "ascentwind": version("ascentwind"),
        "casadi": ca.CasadiMeta.version(),
        "numpy": np.__version__,
        "data": data_hash(study),
        "code": sweep_of(study.system).shared_library.key,
    }


_studies: dict[str, tuple[Study, dict[str, str]]] = {}
_loading = threading.Lock()


def work(packed: bytes, key: str, task: Task, chunk: Chunk, compute: Compute) -> tuple[ChunkResult, dict[str, str]]:
    """Compute a chunk on a worker, which loads a vehicle once; return with it what it was computed by."""
    with _loading:
        if key not in _studies:
            vehicle: Vehicle
            vehicle, parameters = pickle.loads(packed)
            study = Study.from_vehicle(vehicle)
            study = Study(study.executable.with_numbers(parameters=parameters), vehicle)
            _studies[key] = (study, _identity(study))
    study, identity = _studies[key]
    return compute(study, task, chunk), identity
