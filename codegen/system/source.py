"""The C source of a linear system: arithmetic by CasADi, lookup and interface from a template."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import casadi as ca
import numpy as np

from ...model.system.linear_system import LinearSystem
from ..toolchain.c_printer import c_function, enumerators
from ..toolchain.fingerprint import fingerprint
from ..toolchain.templates import render
from .functions import INPUTS, INTERVAL, MATRICES, OUTPUTS, CoreFunctions, state_scales
from .table_layout import table_layout


class _Patterns:
    """Sparsity patterns in CasADi's compressed form, each written once."""

    def __init__(self):
        self.labels: dict[str, list[int]] = {}

    def add(self, sparsity: ca.Sparsity) -> str:
        rows, columns = sparsity.shape
        values = [rows, columns, 1] if sparsity.is_dense() else [rows, columns, *sparsity.colind(), *sparsity.row()]
        for label, known in self.labels.items():
            if known == values:
                return label
        label = f"pattern_{len(self.labels)}"
        self.labels[label] = values
        return label


def c_source(system: LinearSystem, core: CoreFunctions) -> str:
    """Return the C source of a system.

    The source holds structure only: numbers of the vehicle (tables, parameters) are read at run time, so that it
    changes, and is compiled again, only when the structure does.
    """
    patterns = _Patterns()
    dense = {n: patterns.add(ca.Sparsity.dense(n, 1)) for n in {0, 1, system.p.numel()}}
    names = {
        "v": enumerators("V", [name for g in system.tables for name in g.names]),
        "p": enumerators("P", system.parameter_names),
    }
    scalar = dense[1]
    A = core.state_matrix.sparsity_out(0)
    matrices = [A, *(core.other_matrices.sparsity_out(i) for i in range(len(MATRICES) - 1))]
    at_time = [("t", scalar), ("low", scalar), ("high", scalar), ("p", dense[system.p.numel()]), ("address", scalar)]
    exported: list[dict[str, Any]] = [
        {
            "name": "matrices",
            "inputs": at_time,
            "outputs": [(n, patterns.add(sparsity)) for n, sparsity in zip(MATRICES, matrices, strict=True)],
        },
        {
            "name": "response",
            "inputs": [*at_time, ("x", patterns.add(core.response.sparsity_in(3)))],
            "outputs": [("y", patterns.add(core.response.sparsity_out(0)))],
        },
    ]
    integrands = []
    for name, sign, function, quadratures in (
        ("adjoint", "-", core.adjoint, core.adjoint_quadrature.numel_out(0)),
        ("mean", "+", core.mean, 0),
    ):
        blocks = function.numel_out(0) // A.size1()
        block, entries, factors = _jacobian(A, state_scales(system), transposed=name == "adjoint")
        integrands.append(
            {
                "name": name,
                "sign": sign,
                "direction": "-" if sign == "-" else "",
                "states": function.numel_out(0),
                "quadratures": quadratures,
                "blocks": blocks,
                "entries": entries,
                "factors": factors,
            }
        )
        exported += _integrand_interface(name, system, function, quadratures, ca.diagcat(*[block] * blocks), patterns)
    return render(
        "system.c.jinja",
        title=f"{system.name}: linear time-varying system",
        structure=system.structure,
        states=system.states,
        noises=system.noises,
        outputs=system.outputs,
        parameters=system.parameters,
        groups=table_layout(system),
        table_values=system.v.numel(),
        interval=INTERVAL,
        table_names=names["v"],
        parameter_names=names["p"],
        matrix_count=len(MATRICES),
        nonzeros=A.nnz(),
        core=[
            c_function("state_matrix_core", core.state_matrix, ("t", "v", "p"), ("A",), names),
            c_function("other_matrices_core", core.other_matrices, ("t", "v", "p"), MATRICES[1:], names),
            *(
                c_function(f.name(), f, ("t", "v", "p", "x"), ("result",), names)
                for f in (core.adjoint, core.adjoint_quadrature, core.mean, core.response)
            ),
            c_function("covariance_inputs_core", core.covariance_inputs, ("t", "v", "p"), ("B", "known"), names),
        ],
        covariance=_covariance(system, core),
        patterns=patterns.labels,
        integrands=integrands,
        exported=exported,
    )


def source_fingerprint(system: LinearSystem, core: CoreFunctions) -> str:
    """Return a hash of all that ``c_source`` writes from."""
    functions = (getattr(core, field.name) for field in fields(core))
    return fingerprint(system, functions, ("system/source.py", "templates/system.c.jinja"))


def _integrand_interface(
    name: str,
    system: LinearSystem,
    function: ca.Function,
    quadratures: int,
    jacobian: ca.Sparsity,
    patterns: _Patterns,
) -> list[dict[str, Any]]:
    sizes = {"t": 1, "x": function.numel_in(3), "z": 0, "p": INTERVAL + system.p.numel() + 1, "u": 0}
    results = {"ode": function.numel_out(0), "alg": 0, "quad": quadratures, "zero": 0}
    inputs = [(n, patterns.add(ca.Sparsity.dense(sizes[n], 1))) for n in INPUTS]
    outputs = [(n, patterns.add(ca.Sparsity.dense(results[n], 1))) for n in OUTPUTS]
    # Only d ode/d x is ever used (by the implicit method); every other block is declared empty.
    blocks = [
        (
            f"jac_{o}_{i}",
            patterns.add(jacobian if (o, i) == ("ode", "x") else ca.Sparsity(results[o], sizes[i])),
        )
        for o in OUTPUTS
        for i in INPUTS
    ]
    unused = [(f"out_{o}", patterns.add(ca.Sparsity(results[o], 1))) for o in OUTPUTS]
    return [
        {"name": name, "inputs": inputs, "outputs": outputs},
        {"name": f"jac_{name}", "inputs": inputs + unused, "outputs": blocks},
    ]


def _covariance(system: LinearSystem, core: CoreFunctions) -> dict[str, list]:
    """Return patterns and scales of the covariance equation, and the noises, one source after another."""
    A, B = core.state_matrix.sparsity_out(0), core.covariance_inputs.sparsity_out(0)
    _, _, factors = _jacobian(A, state_scales(system), transposed=False)
    noises = [system.noise_columns(source) for source in system.sources]
    return {
        "rows": A.row(),
        "columns": A.get_col(),
        "factors": factors,
        "moved": B.row(),
        "first": B.colind(),
        "scales": [repr(float(scale)) for scale in state_scales(system)],
        "noises_of": [len(own) for own in noises],
        "noise": [column for own in noises for column in own],
    }


def _jacobian(A: ca.Sparsity, scale: np.ndarray, transposed: bool) -> tuple[ca.Sparsity, list[int], list[str]]:
    """Return the pattern of the scaled A (or A'), which entry of A each nonzero is, and its factor.

    The adjoint integrand runs backward, so that its Jacobian is +span S A' S^-1; the mean's is span S^-1 A S.
    """
    rows, columns = A.row(), A.get_col()
    factors = [float(scale[j] / scale[i]) for i, j in zip(rows, columns, strict=True)]
    order = range(A.nnz())
    if transposed:
        order = sorted(order, key=lambda k: (rows[k], columns[k]))
    return A.T if transposed else A, list(order), [repr(factors[k]) for k in order]
