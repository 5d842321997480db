"""CVODES through CasADi: settings, counters, and errors with a time in them."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from dataclasses import dataclass, field
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...model.errors import IntegrationError, StepBudgetError
from .tolerances import check_absolute_part, check_relative_tolerance

Method = Literal["adams", "bdf"]
Iteration = Literal["newton", "functional"]
LEAST_TOLERANCE = 1e-13
LEAST_STEPS = 1000  # of CVODES from one output point to the next
COUNTERS = ("nsteps", "nfevals", "nlinsetups", "netfails")


@dataclass(frozen=True)
class CvodesSettings:
    """How CVODES integrates; what each setting means is told where people give them, at :class:`ascentwind.Cvodes`.

    Raises
    ------
    IntegrationError
    """

    method: Method = "adams"
    iteration: Iteration = "newton"
    relative_tolerance: float = 1e-7
    absolute_part: float = 1e-3
    max_steps: int = 200_000
    longest_interval: float = float("inf")

    def __post_init__(self):
        if self.method not in ("adams", "bdf"):
            raise IntegrationError(f"method '{self.method}' is not known; choose 'adams' or 'bdf'")
        if self.iteration not in ("newton", "functional"):
            raise IntegrationError(f"iteration '{self.iteration}' is not known; choose 'newton' or 'functional'")
        check_relative_tolerance(self.relative_tolerance, LEAST_TOLERANCE)
        check_absolute_part(self.absolute_part)

    def casadi_options(self) -> dict[str, Any]:
        """Return the settings by CasADi's names."""
        return {
            "linear_multistep_method": self.method,
            "nonlinear_solver_iteration": self.iteration,
            "reltol": self.relative_tolerance,
            "abstol": self.absolute_part * self.relative_tolerance,
            "max_num_steps": self.max_steps,
            "quad_err_con": True,
            "show_eval_warnings": False,
            "disable_internal_warnings": True,
        }


@dataclass
class Counters:
    """Work done by the solver, added up over intervals."""

    totals: dict[str, int] = field(default_factory=lambda: dict.fromkeys(COUNTERS, 0))

    def add(self, statistics: dict[str, object]) -> None:
        for name in COUNTERS:
            value = statistics.get(name, 0)
            self.totals[name] += int(value) if isinstance(value, int | float) else 0


class Integrator:
    """A CasADi CVODES integrator over pseudo-time 0 to 1, reused for every interval."""

    def __init__(self, function: ca.Function, options: CvodesSettings):
        self._function, self._options = function, options.casadi_options()
        self._by_count: dict[int, ca.Function] = {}

    def run(
        self, start: NDArray[np.float64], parameters: NDArray[np.float64], where: str, points: int = 1
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], dict[str, object]]:
        """Integrate.

        Parameters
        ----------
        start : (n,) array
        parameters : (n_p,) array
        where : str
            Named in an error.
        points : int
            Number of equidistant output points after the start.

        Returns
        -------
        states : (n, points) array
        quadratures : (n_q, points) array
        statistics : dict

        Raises
        ------
        IntegrationError
            If the solver gives up or the result is not finite.
        StepBudgetError
        """
        if points not in self._by_count:
            grid = np.linspace(0.0, 1.0, points + 1)[1:]
            # CVODES counts from one output point to the next
            steps = max(LEAST_STEPS, 4 * self._options["max_num_steps"] // points)
            options = self._options | {"max_num_steps": min(steps, self._options["max_num_steps"])}
            if points > 1:  # at rest its steps would grow beyond all bounds, and pass over what moves the system next
                options["max_step_size"] = 1.0 / points
            self._by_count[points] = ca.integrator(
                f"{self._function.name()}_{points}", "cvodes", self._function, 0.0, grid.tolist(), options
            )
        integrator = self._by_count[points]
        try:
            with hearing_interrupts():
                result = integrator(x0=start, p=parameters)
        except RuntimeError as error:
            if "CV_TOO_MUCH_WORK" in str(error):
                low, high = map(float, parameters[2:4])  # the limits of table lookup
                span = f"a time between {low:.6g} s and {high:.6g} s"
                raise StepBudgetError(self._options["max_num_steps"], span, time=0.5 * (low + high)) from None
            raise IntegrationError(f"the integrator gave up {where}: {_reason(error)}") from None
        states, quadratures = result["xf"].full(), result["qf"].full()
        if not (np.isfinite(states).all() and np.isfinite(quadratures).all()):
            raise IntegrationError(
                f"the integration {where} left the range of numbers; the system grows without bound there or a "
                "table holds an impossible value (see 'ascentwind inspect')"
            )
        return states, quadratures, integrator.stats()


@contextmanager
def hearing_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt where CasADi heard Ctrl-C; it prints so and tells CVODES that the equations failed.

    What CasADi prints of a failed integration is dropped: the error says it.
    """
    printed = io.StringIO()
    try:
        with redirect_stderr(printed):
            yield
    except RuntimeError:
        if "KeyboardInterrupt" in printed.getvalue():
            raise KeyboardInterrupt from None
        raise


def _reason(error: RuntimeError) -> str:
    text = str(error)
    for mark, plain in (
        ("CV_TOO_MUCH_ACC", "the tolerance is finer than rounding allows; loosen it"),
        ("CV_ERR_FAILURE", "the error test failed again and again; look for a jump that no event declares"),
        ("CV_CONV_FAILURE", "the nonlinear solver did not converge; look for a jump that no event declares"),
        ("CV_RHSFUNC_FAIL", "the equations cannot be evaluated there"),
        ("CV_FIRST_RHSFUNC_ERR", "the equations cannot be evaluated there"),
    ):
        if mark in text:
            return plain
    return text.strip().splitlines()[-1] if text.strip() else "no reason given"
