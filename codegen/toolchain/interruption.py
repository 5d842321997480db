"""Ctrl-C while compiled code runs: the code looks at a flag at every step, and whoever waits for it raises the flag.

Python hears a signal between two of its own instructions, in its main thread only. So the main thread never runs long
compiled code itself: it waits for threads that do, and their flag is raised where the signal is heard.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import FrameType, TracebackType
from typing import ParamSpec, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

STOPPED = -1  # what compiled code returns that found the flag raised; the templates say the same

P = ParamSpec("P")
R = TypeVar("R")

_of_thread = threading.local()


class Workers(ThreadPoolExecutor):
    """A pool of threads that stops what they compute when the block that uses it ends by an exception.

    What has not begun is dropped, compiled code returns at its next step, and the block is left when all threads
    have ended. In the main thread the exception of Ctrl-C waits for that: raised wherever the thread happens to be, it
    can leave a lock of the pool taken, so that nobody ever ends, or be lost in a destructor. Only a second one, of
    someone who has waited, is raised at once.
    """

    def __init__(self, threads: int):
        self._flag = _lowered()
        self._heard: BaseException | None = None
        super().__init__(threads, initializer=setattr, initargs=(_of_thread, "flag", self._flag))

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            _signal.heed(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is not None:
                self._flag[0] = 1
                self.shutdown(cancel_futures=True)
            super().__exit__(kind, error, trace)
        finally:
            _signal.forget(self)
        if self._heard is not None:
            raise self._heard from None

    def submit(self, function: Callable[P, R], /, *args: P.args, **options: P.kwargs) -> Future[R]:
        """Let a thread call a function, unless the flag is raised before it begins.

        Raises
        ------
        KeyboardInterrupt
            If the flag is raised already.
        """
        if self._flag[0]:
            raise KeyboardInterrupt
        return super().submit(self._unless_stopped, function, *args, **options)

    def _unless_stopped(self, function: Callable[P, R], /, *args: P.args, **options: P.kwargs) -> R:
        if self._flag[0]:
            raise KeyboardInterrupt
        return function(*args, **options)

    def stop(self, heard: BaseException) -> None:
        """Raise the flag now and the exception when the block is left."""
        self._heard = heard
        self._flag[0] = 1


class _Signal:
    """Ctrl-C for the main thread's pools: while there are any, their handler stands in for the one before."""

    def __init__(self) -> None:
        self._pools: list[Workers] = []
        self._before: Callable[[int, FrameType | None], object] | None = None
        self._heard = False

    def heed(self, pool: Workers) -> None:
        """Stop a pool at Ctrl-C, where the process listens to it."""
        self._pools.append(pool)
        before = signal.getsignal(signal.SIGINT)
        if len(self._pools) == 1 and callable(before):
            self._before, self._heard = before, False
            signal.signal(signal.SIGINT, self)

    def forget(self, pool: Workers) -> None:
        """Leave a pool alone; after the last the handler is the one before, or what someone else has set since."""
        if pool in self._pools:
            self._pools.remove(pool)
        if not self._pools and signal.getsignal(signal.SIGINT) is self:
            signal.signal(signal.SIGINT, self._before)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        try:
            if self._before is not None:
                self._before(number, frame)
        except BaseException as error:
            if self._heard:
                raise
            self._heard = True
            for pool in self._pools:
                pool.stop(error)


_signal = _Signal()


def interruptible(function: Callable[[NDArray[np.intc]], int]) -> int:
    """Call compiled code so that Ctrl-C ends it, and return what it returns.

    Parameters
    ----------
    function : callable
        Returns an int, and takes the flag, an array of one.

    Raises
    ------
    KeyboardInterrupt
        If the code was stopped.
    """
    flag = getattr(_of_thread, "flag", None)
    if flag is None:
        if threading.current_thread() is threading.main_thread():
            with Workers(1) as pool:
                return pool.submit(interruptible, function).result()
        flag = _lowered()  # of a thread that is not ours: nobody raises it
    code = function(flag)
    if code == STOPPED:
        raise KeyboardInterrupt
    return code


def refuse_if_stopped() -> None:
    """Raise KeyboardInterrupt in a thread whose flag is raised, such as one that waits for another program."""
    flag = getattr(_of_thread, "flag", None)
    if flag is not None and flag[0]:
        raise KeyboardInterrupt


def _lowered() -> NDArray[np.intc]:
    return np.zeros(1, np.intc)
