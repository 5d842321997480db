"""A progress bar for fits: time used of the limit, evaluations and the best cost so far."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ...solvers.least_squares import Progress as Callback


@contextmanager
def fit_progress(console: Console, label: str, time_limit: float) -> Iterator[Callback]:
    """Show a bar that fills with the time limit (s) while the block runs; yields the callback for ``FitOptions``.

    A fit that starts again from another point counts its evaluations anew; the bar shows their sum and the least cost.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn(f"of {time_limit:g} s, {{task.fields[evaluations]}} evaluations, cost {{task.fields[cost]}} m⁴/s⁴"),
    )
    begin, done, last, least = time.monotonic(), 0, 0, float("inf")
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(label, total=time_limit, evaluations=0, cost="-")

        def advance(evaluations: int, cost: float) -> None:
            nonlocal done, last, least
            done += evaluations - last if evaluations > last else evaluations
            last, least = evaluations, min(least, cost)
            bar.update(task, completed=time.monotonic() - begin, evaluations=done, cost=f"{least:.4g}")

        yield advance
