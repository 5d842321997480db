"""Roots of the system frozen in time: frequency, damping, and a warning when one is unstable."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...model.errors import DataError, SingularCouplingError, UnstableSystemWarning
from ...model.tables import table_values
from ...model.vehicle.columns import PRODUCT_OF_INERTIA
from .time_nodes import interval_after, intervals

UNSTABLE = 1e-6  # rad/s; a real part below is rounding or an integrator


@dataclass(frozen=True)
class Root:
    """An eigenvalue of A, its frequency |s| (rad/s), damping ratio and the states that take part most."""

    value: complex
    frequency: float
    damping: float
    states: tuple[str, ...]


def matrices_at(executable: ExecutableSystem, time: float) -> dict[str, NDArray[np.float64]]:
    """Return A, B, C, D, E, G and the known inputs at a time; at a discontinuity those after it."""
    here = interval_after(executable, time)
    matrices = executable.matrices(time, here.low, here.high)
    for name, matrix in matrices.items():
        if not np.isfinite(matrix).all():
            raise DataError(_not_finite(executable, name, matrix), time=time)
    return matrices


def _not_finite(executable: ExecutableSystem, name: str, matrix: NDArray) -> str:
    system = executable.system
    row, column = (int(i) for i in np.argwhere(~np.isfinite(matrix))[0])
    rows = system.state_names if name in "ABE" else system.output_names
    return f"{name} is not finite in the row of '{rows[row]}' (column {column + 1}); check the tables behind it"


def roots(executable: ExecutableSystem, time: float) -> list[Root]:
    """Return the eigenvalues of A frozen at a time, slowest first, one of each complex pair."""
    system = executable.system
    values, right = np.linalg.eig(matrices_at(executable, time)["A"])
    left = np.linalg.pinv(right)
    found = []
    for i in np.argsort(np.abs(values)):
        value = complex(values[i])
        if value.imag < 0:
            continue
        share = np.abs(left[i] * right[:, i])
        names = [system.state_names[k] for k in np.argsort(-share)[:2] if share[k] > 0.15 * share.max()]
        size = abs(value)
        found.append(Root(value, size, -value.real / size if size else 1.0, tuple(names)))
    return found


def first_unstable(executable: ExecutableSystem, end: float, checks: int = 12) -> str | None:
    """Look for unstable roots at frozen times up to ``end`` and describe the first, None without any."""
    system = executable.system
    begin = system.start
    for time in sorted({*np.linspace(begin, end, checks), *(i.begin for i in intervals(executable, begin, end))}):
        matrix = matrices_at(executable, float(time))["A"]
        if np.linalg.eigvals(matrix).real.max() <= UNSTABLE:
            continue
        worst = max(roots(executable, float(time)), key=lambda r: r.value.real)
        return (
            f"the system frozen at {time:.4g} s is unstable: root {worst.value.real:+.3g} "
            f"{worst.value.imag:+.3g}j rad/s in {' and '.join(worst.states)}"
        )
    return None


def warn_if_unstable(executable: ExecutableSystem, end: float) -> None:
    """Warn of the first unstable root at frozen times up to ``end``.

    Instability at frozen times does not make the statistics wrong; it makes them grow.
    """
    found = first_unstable(executable, end)
    if found:
        warnings.warn(
            UnstableSystemWarning(f"{found}; the statistics asked for are given and grow with it"), stacklevel=3
        )


def check_coupling(executable: ExecutableSystem) -> None:
    """Refuse a vehicle whose bending and slosh masses do not make a positive definite mass matrix.

    Raises
    ------
    SingularCouplingError
        Names the time and the mass that is too large.
    """
    system = executable.system
    if system.coupling_matrix is None or not system.tables or system.coupling_matrix.shape[0] == 0:
        return
    matrix = ca.Function("coupling", [system.v, system.p], [ca.densify(system.coupling_matrix)])
    for time in np.linspace(system.start, system.end, 60):
        values = np.array(list(table_values(system.tables, float(time)).values()))
        M = matrix(values, executable.parameters).full()
        smallest = np.linalg.eigvalsh(M / np.sqrt(np.outer(*(2 * [np.abs(np.diag(M)) + 1e-300])))).min()
        if not smallest > 1e-9:
            raise SingularCouplingError(
                f"at {time:.4g} s the mass matrix of bending and slosh is singular: the slosh masses, weighed by their "
                "mode displacements, reach the generalised masses; check both tables there"
                + (
                    ", and the product of inertia"
                    if any(PRODUCT_OF_INERTIA.name in g.names for g in system.tables)
                    else ""
                )
            )
