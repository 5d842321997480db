"""Progress of fits: time left of their limit, evaluations and the best cost so far."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ...present.progress import steps
from ...solvers.least_squares import FitOptions


@contextmanager
def fit_progress(text: str, options: FitOptions | None) -> Iterator[FitOptions]:
    """Show a line that fills with the time limit while the block runs; yields the options that tell it.

    Options that tell somebody else are yielded as they are. A fit that starts again from another point counts its
    evaluations anew; the line shows their sum and the least cost.
    """
    options = options or FitOptions()
    if options.progress is not None:
        yield options
        return
    begin, done, last, least = time.monotonic(), 0, 0, float("inf")
    with steps(text, options.time_limit, limit=True) as line:

        def advance(evaluations: int, cost: float) -> None:
            nonlocal done, last, least
            done += evaluations - last if evaluations > last else evaluations
            last, least = evaluations, min(least, cost)
            told = f"{text}, {done} evaluations, cost {least:.4g} m⁴/s⁴"
            line.reached(min(time.monotonic() - begin, options.time_limit), text=told)

        yield replace(options, progress=advance)
