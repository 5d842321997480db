"""Integrations that would take too many steps: ended early, with the fastest root named."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...model.errors import StepBudgetError
from .stability import Root, roots
from .time_nodes import Interval

STEP_TIMES_ROOT = 6.0  # the longest product of step and root at which an explicit formula of order 8 is stable
STAGES = 12  # of DOP853
LOOKS = 3  # at the roots, in each interval


@contextmanager
def naming_fastest_root(executable: ExecutableSystem) -> Iterator[None]:
    """Add to a :class:`StepBudgetError` from within the fastest root of the system frozen where it stopped."""
    try:
        yield
    except StepBudgetError as error:
        if error.fastest is not None or error.time is None:
            raise
        found = describe(roots(executable, error.time)[-1])
        raise StepBudgetError(error.steps, error.where, time=error.time, fastest=found) from None


def describe(root: Root) -> str:
    """Return a root and the states that take part in it, in words."""
    imaginary = f" +- {root.value.imag:.3g}j" if root.value.imag else ""
    return f"{root.value.real:.3g}{imaginary} rad/s, in {' and '.join(root.states)}"


def check_explicit_steps(executable: ExecutableSystem, pieces: list[Interval], most: int) -> None:
    """Refuse an explicit integration whose roots, frozen, ask for too many steps.

    Raises
    ------
    StepBudgetError
    """
    needed, fastest, when = 0.0, None, 0.0
    for piece in pieces:
        times = piece.low + (piece.high - piece.low) * (np.arange(LOOKS) + 0.5) / LOOKS
        found = [roots(executable, float(time))[-1] for time in times]
        needed += (piece.end - piece.begin) * float(np.mean([root.frequency for root in found])) / STEP_TIMES_ROOT
        for time, root in zip(times, found, strict=True):
            if fastest is None or root.frequency > fastest.frequency:
                fastest, when = root, float(time)
    if fastest is not None and needed > most:
        raise StepBudgetError(most, f"t = {when:.6g} s", time=when, fastest=describe(fastest))


def at_most(rate: Callable[[float, NDArray], NDArray], steps: int, where: str) -> Callable[[float, NDArray], NDArray]:
    """Return the same right-hand side, which ends SciPy's DOP853 after so many steps.

    Parameters
    ----------
    rate : callable
    steps : int
    where : str
        Names the independent variable in an error, {} for its value.
    """
    left = STAGES * steps

    def counted(x: float, y: NDArray) -> NDArray:
        nonlocal left
        left -= 1
        if left < 0:
            raise StepBudgetError(steps, where.format(x))
        return rate(x, y)

    return counted
