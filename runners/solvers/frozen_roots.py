"""Damping of families of roots at frozen times, and its exact derivatives with respect to parameters.

A simple eigenvalue s of A with left and right vectors l, r (l r = 1) has ds/dp = l (dA/dp) r; dA/dp is CasADi's.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...model.equations.noise import DEVIATION
from ...model.system.linear_system import LinearSystem
from ...model.system.names import TURBULENCE, WIND
from ...model.tables import table_values

RIGID_BODY = "rigid_body"
MODES, SLOSH = ("bending", "bending_rate"), ("slosh", "slosh_rate")  # blocks of states
UNCONTROLLED = "uncontrolled"  # wind, turbulence and deviations: no vehicle parameter moves their roots


def state_families(system: LinearSystem) -> list[str]:
    """Return the family of roots that every state belongs to: a mode, slosh, the rigid body with its control."""
    families, counts = [], Counter()
    for state in system.states:
        counts[state.block] += 1
        if state.block in MODES:
            families.append(f"bending_{counts[state.block]}")
        elif state.block in SLOSH:
            families.append("slosh")
        else:
            families.append(UNCONTROLLED if state.block in (WIND, TURBULENCE, DEVIATION) else RIGID_BODY)
    return families


def root_families(system: LinearSystem) -> list[str]:
    """Return the families of roots of a system, the uncontrolled one left out."""
    return [f for f in dict.fromkeys(state_families(system)) if f != UNCONTROLLED]


@dataclass(frozen=True, eq=False)
class FrozenDamping:
    """Damping at frozen times.

    Attributes
    ----------
    damping : (times, families) array
        The lowest damping ratio of a family's oscillatory roots, 1 where it has none.
    growth : (times,) array
        The largest real part of all controlled roots, 1/s.
    damping_gradient : (times, families, n) array
    growth_gradient : (times, n) array
    """

    damping: NDArray[np.float64]
    growth: NDArray[np.float64]
    damping_gradient: NDArray[np.float64]
    growth_gradient: NDArray[np.float64]


class FrozenRoots:
    """Evaluates :class:`FrozenDamping` for other parameter values.

    Parameters
    ----------
    executable : ExecutableSystem
        Its tables are used.
    times : sequence of float
        s.
    parameters : sequence of str
        With respect to which derivatives are taken.
    """

    def __init__(self, executable: ExecutableSystem, times: Sequence[float], parameters: Sequence[str]):
        system = executable.system
        self.families = root_families(system)
        self._of_state = np.array(state_families(system))
        columns = [system.parameter_names.index(name) for name in parameters]
        wanted = system.p[columns]
        A = ca.densify(system.A)
        self._function = ca.Function("frozen", [system.time, system.v, system.p], [A, ca.jacobian(ca.vec(A), wanted)])
        self._points = [(t, np.array(list(table_values(executable.groups, t).values()))) for t in times]

    def __call__(self, values: NDArray[np.float64]) -> FrozenDamping:
        """Return damping and growth for a whole parameter vector."""
        rows = [self._at(t, v, values) for t, v in self._points]
        return FrozenDamping(*(np.array(column) for column in zip(*rows, strict=True)))

    def _at(self, time: float, v: NDArray, values: NDArray) -> tuple[NDArray, float, NDArray, NDArray]:
        A, dA = (m.full() for m in self._function(time, v, values))
        n = A.shape[0]
        dA = dA.reshape(n, n, -1, order="F")
        eigen = np.linalg.eig(A)
        roots: NDArray[np.complex128] = eigen.eigenvalues.astype(np.complex128)
        right: NDArray[np.complex128] = eigen.eigenvectors.astype(np.complex128)
        left = np.linalg.inv(right)
        share = np.abs(left * right.T)  # participation of states in roots; it does not depend on their units
        by_family = {f: share[:, self._of_state == f].sum(axis=1) for f in (*self.families, UNCONTROLLED)}
        names = list(by_family)
        belongs = np.array(names)[np.argmax(list(by_family.values()), axis=0)]
        slope = np.einsum("ij,jkp,ki->ip", left, dA, right)
        size = np.abs(roots)
        with np.errstate(divide="ignore", invalid="ignore"):
            damping = np.where(size > 0, -roots.real / size, 1.0)
        lowest, gradient = np.ones(len(self.families)), np.zeros((len(self.families), dA.shape[2]))
        for f, family in enumerate(self.families):
            mine = np.flatnonzero((belongs == family) & (roots.imag > 0))
            if mine.size == 0:
                continue
            i = mine[np.argmin(damping[mine])]
            lowest[f] = damping[i]
            turn = (np.conj(roots[i]) * slope[i]).real
            gradient[f] = -slope[i].real / size[i] + roots[i].real * turn / size[i] ** 3
        controlled = np.flatnonzero(belongs != UNCONTROLLED)
        i = controlled[np.argmax(roots.real[controlled])]
        return lowest, float(roots[i].real), gradient, slope[i].real
