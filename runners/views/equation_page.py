"""The page docs/derivatives.md: the report's equations and their derivatives by tables and parameters."""

from __future__ import annotations

import re

from ...model.equations.report_equations import ReportEquation, report_equations
from ..study import Study
from .equation_latex import equation_latex

HEAD = """# Derivatives of the equations

Equations 4-1 to 4-13 of the report as the model reads them (`docs/equations.md`), and the partial derivative of
each by every table and parameter in it; of modes and tanks the first stands for the others. CasADi differentiates,
SymPy prints:

```sh
ascentwind equations {vehicle} --page docs/derivatives.md
```

writes this page, and a test fails when it is stale.

```sh
ascentwind equations {vehicle} --of angle_of_attack --by relative_velocity
```

prints any other derivative, also of the assembled system's outputs and rates.

Words below a symbol name a tank. $`k_{{T1}}`$, $`b_{{1,k}}`$ and $`a_{{1,k}}`$ are gain and coefficients of $`s^k`$ of
a network, $`Q_E`$, $`Q_A`$ and $`Q_S`$ the forces of engine, air and slosh on a mode, $`(C'_N Y)_i`$ the sum over
segments of slope times displacement.
"""


def equations_page(study: Study) -> str:
    """Return the page of a vehicle as Markdown.

    Raises
    ------
    MissingSymPyError
    """
    vehicle = study.vehicle_for("a page of the equations 4-1 to 4-13")
    parts = [HEAD.format(vehicle=vehicle.name)]
    for number, equation in report_equations(vehicle).items():
        lines = [equation_latex(study, number), *(equation_latex(study, number, by) for by in _shown(study, equation))]
        parts.append(f"## {number}\n\n" + "\n\n".join(f"```math\n{line}\n```" for line in lines) + "\n")
    return "\n".join(parts)


def _shown(study: Study, equation: ReportEquation) -> list[str]:
    """Return tables and parameters of an equation, of those that differ only by mode or tank the first."""
    vehicle = study.vehicle_for("a page of the equations 4-1 to 4-13")
    tanks = "|".join(re.escape(t.name) for t in vehicle.slosh) or "$^"
    names = [n for g in study.system.tables for n in g.names] + list(study.system.parameter_names)
    shown: dict[str, str] = {}
    for name in equation.depends_on():
        if name in names:
            shown.setdefault(re.sub(rf"\.\d+\.|_\d+$|\.s\d+$|{tanks}", "*", name), name)
    return list(shown.values())
