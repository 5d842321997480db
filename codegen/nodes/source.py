"""The C source of a system's functions at many points, eight side by side, and of the collocation that uses them."""

from __future__ import annotations

import casadi as ca

from ...model.system.linear_system import LinearSystem
from ..toolchain.c_printer import c_statements, enumerators
from ..toolchain.templates import render

LANES = 8  # points side by side: one 512-bit register, two of 256 bits
ARGUMENTS = {
    "node_matrices": ("t", "v", "z"),
    "quadratic_gradient": ("t", "v", "z", "a", "y", "c", "m"),
    "linear_gradient": ("t", "v", "z", "a", "x", "c"),
}
SOURCE_FILES = (
    "nodes/source.py",
    "templates/node_functions.c.jinja",
    "templates/collocation.c",
)


def nodes_source(system: LinearSystem, functions: tuple[ca.Function, ...]) -> str:
    """Return C that evaluates the functions at many points.

    Parameters
    ----------
    functions : Functions
        Nonzeros of the matrices, then the gradients with respect to numbers and table values.
    """
    tables = enumerators("V", [name for g in system.tables for name in g.names])
    loops = []
    for f in functions:
        arguments = ARGUMENTS[f.name()]
        sizes = [f.numel_in(i) for i in range(f.n_in())]
        summed = 0 if f.name() == "node_matrices" else f.numel_in(2)
        wide = [name for name in arguments if name != "z"]
        loops.append(
            {
                "name": f.name(),
                "arguments": list(zip(arguments, sizes, strict=True)),
                "wide": wide,
                "summed": summed,
                "kept": f.numel_out(0) - summed,
                "statements": c_statements(
                    f, arguments, ("result",), {"v": tables}, dict.fromkeys((*wide, "result"), "j")
                ),
            }
        )
    return render(
        "node_functions.c.jinja",
        title=f"{system.name}: matrices, and gradients with respect to numbers and table values",
        table_names=tables,
        lanes=LANES,
        loops=loops,
    )
