"""The bars in which progress shows: on a terminal, and in a cell of a notebook."""

from __future__ import annotations

import io
import threading
from contextvars import copy_context
from datetime import timedelta
from html import escape
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

AFTER = 1.0  # s, from which on a cell shows what is done
EVERY = 0.5  # s, between two looks of a cell
WIDTH = 110  # characters of a line in a cell


class StepsDone(ProgressColumn):
    """Steps done of all, where their number is known."""

    def render(self, task: Task) -> Text:
        """Return the text."""
        if task.total is None or task.fields.get("limit"):
            return Text("")
        return Text(f"{task.completed:.0f}/{task.total:.0f}")


class TimeLeft(ProgressColumn):
    """Time left, by the mean time of the steps done so far; of what has a limit the time to it.

    Rich's own column forgets steps of more than half a minute, and waits for the second.
    """

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        """Return the text."""
        left = time_left(task)
        if left is None:
            return Text("")
        said = "at most" if task.fields.get("limit") else "left"
        return Text(f"{said} {timedelta(seconds=int(left + 0.5))}", style="dim")


def time_left(task: Task) -> float | None:
    """Return the time left of a task, s; None where nobody knows."""
    passed, before = task.elapsed or 0.0, task.fields.get("before", 0.0)
    if task.total is None:
        return None
    if task.fields.get("limit"):
        return max(task.total - passed, 0.0)
    done = task.completed - before
    if not done > 0:
        return None
    # what was done of the step under way is not known: the time since the last one counts as part of it
    at_last = task.fields.get("at_last", passed)
    return max(at_last * (task.total - task.completed) / done - (passed - at_last), 0.0)


class Bar(Progress):
    """Lines of text, bar, steps, time passed and time left."""

    def update(self, task_id: Any, *, total: float | None = None, completed: float | None = None, **more: Any) -> None:
        """Update a line; steps that were done before it began say nothing of the time left."""
        with self._lock:
            task = self._tasks[task_id]
            if (completed is not None and completed != task.completed) or more.get("advance"):
                if task.total is None and total is not None and not task.completed:
                    more["before"] = completed
                more["at_last"] = task.elapsed or 0.0
        super().update(task_id, total=total, completed=completed, **more)


def _columns() -> tuple[ProgressColumn, ...]:
    return TextColumn("{task.description}"), BarColumn(), StepsDone(), TimeElapsedColumn(), TimeLeft()


def terminal_bar(console: Console) -> Bar:
    """Return a bar that goes when all is done."""
    return Bar(SpinnerColumn(), *_columns(), console=console, transient=True)


class NotebookBar(Bar):
    """A bar in an output of the cell that runs: there after a second, rewritten in its place, empty at the end.

    It is text, without script or widgets, so that the stored notebook stays small.
    """

    def __init__(self):
        super().__init__(*_columns(), auto_refresh=False, console=Console(file=io.StringIO()))
        self._handle: Any = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to look."""
        context = copy_context()  # says to which cell outputs go
        self._thread = threading.Thread(target=context.run, args=(self._look,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Empty the output."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        if self._handle is not None:
            self._handle.update(_bundle(""), raw=True)

    def refresh(self) -> None:
        """Leave it to the thread."""

    def _look(self) -> None:
        from IPython.display import display  # pyright: ignore[reportMissingImports]

        wait = AFTER
        while not self._ended.wait(wait):
            wait, text = EVERY, self.text()
            if self._handle is None:
                self._handle = display(_bundle(text), raw=True, display_id=True)
            else:
                self._handle.update(_bundle(text), raw=True)

    def text(self) -> str:
        """Return the lines as they are now."""
        page = Console(file=io.StringIO(), width=WIDTH, no_color=True, force_jupyter=False, force_terminal=False)
        with page.capture() as found:
            page.print(self.get_renderable())
        return "\n".join(line.rstrip() for line in found.get().splitlines())


def _bundle(text: str) -> dict[str, str]:
    return {"text/plain": text, "text/html": f"<pre>{escape(text)}</pre>" if text else ""}
