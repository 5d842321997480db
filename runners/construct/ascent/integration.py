"""CVODES over one leg of the ascent, and where inside a leg something happens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ....model.construction import Construction, earth
from ....model.construction.ascent_equations import OBSERVED, AscentEquations, ascent_equations
from ....model.errors import IntegrationError
from ...solvers.integration import hearing_interrupts
from .pieces import follows_velocity, piece

Array = NDArray[np.float64]
RELATIVE_TOLERANCE = 1e-10
TIME_TOLERANCE = 1e-9  # s, of located events


@dataclass(frozen=True, eq=False)
class Leg:
    """A stretch of the flight without corners: times (s), states at its ends, and the piece that holds there."""

    begin: float
    end: float
    start: Array
    finish: Array
    piece: Array
    along_velocity: bool


class Ascent:
    """The equations of a construction with their integrators."""

    def __init__(self, construction: Construction):
        self.construction = construction
        kinds = (False, True) if construction.pitch.kind == "gravity_turn" else (False,)
        self._equations = {kind: ascent_equations(construction, kind) for kind in kinds}
        stores = construction.stores
        largest = max([1.0, *stores.values()])
        self._scale = np.concatenate([np.full(3, 1e6), np.full(3, 1e3), np.full(len(stores), largest)])
        self._integrators = {kind: _integrator(e, self._scale) for kind, e in self._equations.items()}

    def at_release(self) -> Array:
        """Return the state of a vehicle that stands on the turning Earth."""
        site = self.construction.site
        angle = earth.ROTATION_RATE * (site.release - site.platform_release)
        turn = ca.evalf(earth.rotation_about_pole(angle)).full()
        position = turn @ earth.site_position(site.latitude, site.altitude)
        velocity = np.cross([0.0, 0.0, earth.ROTATION_RATE], position)
        return np.concatenate([position, velocity, list(self.construction.stores.values())])

    def leg(self, running: Iterable[str], begin: float, end: float, start: Array) -> Leg:
        """Integrate between two times without an edge inside.

        Raises
        ------
        IntegrationError
        """
        coefficients = piece(self.construction, running, begin, end)
        along = follows_velocity(self.construction.pitch, 0.5 * (begin + end))
        finish = self._integrate(along, coefficients, begin, end, start)
        return Leg(begin, end, start, finish, coefficients, along)

    def state(self, leg: Leg, time: float) -> Array:
        """Return the state at a time of a leg."""
        if time == leg.end:
            return leg.finish
        return self._integrate(leg.along_velocity, leg.piece, leg.begin, time, leg.start)

    def observe(self, leg: Leg, time: float) -> dict[str, float]:
        """Return the quantities named in ``OBSERVED`` and the stores' amounts (kg) at a time of a leg."""
        state = self.state(leg, time)
        values = self._equations[leg.along_velocity].observe(time, state, leg.piece).full().ravel()
        amounts = {f"liquid.{name}": m for name, m in zip(self.construction.stores, state[6:], strict=True)}
        return dict(zip(OBSERVED, values.tolist(), strict=True)) | amounts

    def locate(self, leg: Leg, value: Callable[[Mapping[str, float]], float]) -> float | None:
        """Return the time of a leg at which a quantity passes through zero, or None if its sign stays."""
        ends = [value(self.observe(leg, t)) for t in (leg.begin, leg.end)]
        if not (ends[0] < 0 <= ends[1] or ends[0] > 0 >= ends[1]):
            return None
        found = brentq(lambda t: value(self.observe(leg, t)), leg.begin, leg.end, xtol=TIME_TOLERANCE)
        return float(found)  # pyright: ignore[reportArgumentType] - full_output is off

    def _integrate(self, along: bool, coefficients: Array, begin: float, end: float, start: Array) -> Array:
        if end == begin:
            return start
        parameters = np.concatenate([[begin, end - begin], coefficients])
        try:
            with hearing_interrupts():
                found = self._integrators[along](x0=start / self._scale, p=parameters)["xf"].full().ravel()
        except RuntimeError as error:
            reason = str(error).strip().splitlines()[-1]
            raise IntegrationError(
                f"CVODES gave up on the mean flight between {begin:g} and {end:g} s: {reason}"
            ) from None
        if not np.isfinite(found).all():
            raise IntegrationError(
                f"the mean flight is not finite between {begin:g} and {end:g} s; check the raw inputs"
            )
        return found * self._scale


def _integrator(equations: AscentEquations, scale: Array) -> ca.Function:
    """Return an integrator over pseudo-time 0 to 1 of the scaled state; parameters: begin, duration, piece."""
    s, x = ca.MX.sym("s"), ca.MX.sym("x", equations.state_size)
    p = ca.MX.sym("p", 2 + equations.piece_size)
    rate = equations.derivative(p[0] + s * p[1], x * scale, p[2:])
    return ca.integrator(
        "ascent",
        "cvodes",
        {"t": s, "x": x, "p": p, "ode": p[1] * rate / scale},
        0.0,
        1.0,
        {
            "linear_multistep_method": "adams",
            "nonlinear_solver_iteration": "functional",
            "reltol": RELATIVE_TOLERANCE,
            "abstol": 1e-3 * RELATIVE_TOLERANCE,
            "max_num_steps": 100_000,
            "show_eval_warnings": False,
        },
    )
