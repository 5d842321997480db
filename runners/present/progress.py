"""Progress of whatever takes long: one bar, opened by a command or by the outermost call in a notebook.

Library calls say their steps here. They show in the bar that is open; where none is, in a cell of a notebook, or where
:func:`show_progress` asked for it, the outermost call opens one. In scripts and tests nothing shows.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

T = TypeVar("T")

_open: ContextVar[Progress | None] = ContextVar("bar", default=None)
_asked: bool | None = None  # by show_progress


class Steps:
    """One line of a bar, of which one step after another is done; a line that nobody sees without a bar."""

    def __init__(self, bar: Progress | None, task: TaskID | None):
        self._bar, self._task = bar, task

    def done(self, text: str | None = None) -> None:
        """Advance by one step; ``text`` says what is being done now."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, advance=1, description=text)

    def reached(self, count: float, total: float | None = None, text: str | None = None) -> None:
        """Advance to a number of steps, of a total that may not have been known before."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=count, total=total, description=text)


@contextmanager
def steps(text: str, total: float | None = None, *, limit: bool = False) -> Iterator[Steps]:
    """Show a line while the block runs: text, steps done of all, time passed and time left.

    Parameters
    ----------
    text : str
        What is being done.
    total : float, optional
        Number of steps; without it nobody knows how long it takes.
    limit : bool
        ``total`` is the time in s after which what is done ends by itself.
    """
    with _bar() as bar:
        if bar is None:
            yield Steps(None, None)
            return
        task = bar.add_task(text, total=total, limit=limit)
        try:
            yield Steps(bar, task)
        finally:
            bar.remove_task(task)


def each(items: Iterable[T], text: str, total: int | None = None) -> Iterator[T]:
    """Yield items, a step each; ``total`` is their number where they have no length."""
    with steps(text, len(items) if total is None else total) as line:  # pyright: ignore[reportArgumentType]
        for item in items:
            yield item
            line.done()


@contextmanager
def opened(bar: Progress) -> Iterator[None]:
    """Show all lines in a bar while the block runs, or in the one that is open already."""
    if _open.get() is not None:
        yield
        return
    with bar:
        token = _open.set(bar)
        try:
            yield
        finally:
            _open.reset(token)


def show_progress(shown: bool | None = True) -> None:
    """Say whether library calls that take long show their progress and the time left.

    Parameters
    ----------
    shown : bool or None
        True: on a terminal too, on standard error. False: nowhere. None, as it is at first: in a notebook's cells.
    """
    global _asked
    _asked = shown


def in_notebook() -> bool:
    """Return whether this runs in a cell of a notebook."""
    if "ipykernel" not in sys.modules and "google.colab" not in sys.modules:
        return False
    from rich.console import Console

    return Console().is_jupyter


@contextmanager
def _bar() -> Iterator[Progress | None]:
    """Yield the bar that is open, or a new one where one is wanted."""
    found = _open.get()
    # threads compute for someone who shows what they do
    if found is not None or _asked is False or threading.current_thread() is not threading.main_thread():
        yield found
        return
    if in_notebook():
        from .bars import NotebookBar

        made = NotebookBar()
    elif _asked:
        from .bars import terminal_bar
        from .terminal import errors

        made = terminal_bar(errors)
    else:
        yield None
        return
    with opened(made):
        yield made
