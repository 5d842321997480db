"""Ctrl-C while compiled code runs: the code looks at a flag at every step, and whoever waits for it raises the flag.

Python hears a signal between two of its own instructions, in its main thread only. So the main thread never runs long
compiled code itself: it waits for threads that do, and when it is interrupted it raises their flag.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

STOPPED = -1  # what compiled code returns that found the flag raised; the templates say the same

_of_thread = threading.local()


class Workers(ThreadPoolExecutor):
    """A pool of threads that stops what they compute when the block that uses it ends by an exception.

    What has not begun is dropped, compiled code returns at its next step, and the block is left when all threads
    have ended.
    """

    def __init__(self, threads: int):
        self._flag = _lowered()
        super().__init__(threads, initializer=setattr, initargs=(_of_thread, "flag", self._flag))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._flag[0] = 1
            self.shutdown(cancel_futures=True)
        super().__exit__(kind, error, trace)


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


def _lowered() -> NDArray[np.intc]:
    return np.zeros(1, np.intc)
