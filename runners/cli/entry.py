"""Where the command starts: what Ctrl-C does, from the first import to the last line."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from types import FrameType

from .exit_codes import INTERRUPTED

PATIENCE = 2.0  # s, for what has to be unwound; results are whole or not there, and the rest is swept by the next run


class InterruptHandler:
    """What the command does at SIGINT: the first raises KeyboardInterrupt, the second ends the process at once.

    So does an alarm two seconds later: an exception that falls into a C extension at an unlucky moment is lost there.

    Attributes
    ----------
    heard : bool
        Whatever error follows is taken as the end that was asked for: some libraries turn the exception into their own.
    """

    heard = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self.heard:
            os._exit(INTERRUPTED)
        self.heard = True
        sys.unraisablehook = lambda _: None  # where the exception is lost Python would print a traceback
        if hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, lambda *_: os._exit(INTERRUPTED))
            signal.setitimer(signal.ITIMER_REAL, PATIENCE)
        raise KeyboardInterrupt


def main() -> None:
    """Run the command line; Ctrl-C ends it with exit code 130 and without a traceback."""
    handler = InterruptHandler()
    listens = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN  # as for a job in the background of a shell
    if listens:
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))  # while loading there is nothing to lose
    from .app import main as command_line

    if listens:
        signal.signal(signal.SIGINT, handler)
    try:
        command_line()
    except BaseException:
        if handler.heard:
            _leave()
        raise
    finally:
        if listens:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done: Python, as it ends, would die of it


def _leave() -> None:
    """End the process once everything has been unwound, without the half second that Python takes to forget it all."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(INTERRUPTED)
