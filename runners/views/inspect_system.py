"""Everything a study holds at one flight time, for people and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from ...model.equations.report_symbols import report_symbol
from ..present.terminal import print_table
from ..study import Study


def inspection(study: Study, time: float) -> dict[str, Any]:
    """Return table values, parameters, matrices with names, and roots at a time, JSON-ready."""
    system = study.system
    A, B, C, D = study.matrices(time)
    units = {name: unit for g in system.tables for name, unit in zip(g.names, g.units, strict=True)}
    return {
        "system": system.name,
        "time_s": time,
        "tables": [
            {"name": name, "symbol": report_symbol(name), "value": value, "unit": units[name]}
            for name, value in study.tables(time).items()
        ],
        "parameters": [
            {"name": p.name, "value": p.value, "unit": p.unit, "description": p.description}
            for p in study.parameters.values()
        ],
        "states": [{"name": s.name, "unit": s.unit} for s in system.states],
        "noises": [{"name": n.name, "source": n.source} for n in system.noises],
        "outputs": [{"name": o.name, "unit": o.unit} for o in system.outputs],
        "A": A.tolist(),
        "B": B.tolist(),
        "C": C.tolist(),
        "D": D.tolist(),
        "roots": [
            {
                "real_rad_s": r.value.real,
                "imaginary_rad_s": r.value.imag,
                "frequency_rad_s": r.frequency,
                "damping": r.damping,
                "states": list(r.states),
            }
            for r in study.roots(time)
        ],
    }


def print_inspection(found: dict[str, Any], console: Console) -> None:
    """Print an inspection as tables; of the matrices the entries that are not zero."""
    console.rule(f"{found['system']} at {found['time_s']:g} s")
    table = Table("table", "report symbol", "value", "unit", title="Table values")
    for row in found["tables"]:
        table.add_row(row["name"], row["symbol"], f"{row['value']:.6g}", row["unit"])
    print_table(table, console)
    table = Table("parameter", "value", "unit", title="Parameters")
    for row in found["parameters"]:
        table.add_row(row["name"], f"{row['value']:.6g}", row["unit"])
    print_table(table, console)
    states = [s["name"] for s in found["states"]]
    noises, outputs = [n["name"] for n in found["noises"]], [o["name"] for o in found["outputs"]]
    for name, rows, columns in (
        ("A", states, states),
        ("B", states, noises),
        ("C", outputs, states),
        ("D", outputs, noises),
    ):
        matrix = np.array(found[name]).reshape(len(rows), len(columns))
        table = Table("row", "column: value", title=f"{name}  ({matrix.shape[0]} x {matrix.shape[1]})")
        for label, values in zip(rows, matrix, strict=True):
            entries = (f"{columns[j]}: {values[j]:.5g}" for j in np.flatnonzero(values))
            table.add_row(label, ",  ".join(entries) or "-")
        print_table(table, console)
    table = Table("root (rad/s)", "frequency (rad/s)", "(Hz)", "damping ratio", "states", title="Roots of A, frozen")
    for root in found["roots"]:
        sign = "±" if root["imaginary_rad_s"] else ""
        value = (
            f"{root['real_rad_s']:.4g} {sign} {root['imaginary_rad_s']:.4g}j" if sign else f"{root['real_rad_s']:.4g}"
        )
        frequency = root["frequency_rad_s"]
        table.add_row(
            value,
            f"{frequency:.4g}",
            f"{frequency / 2 / np.pi:.3g}",
            f"{root['damping']:.4g}",
            ", ".join(root["states"]),
        )
    print_table(table, console)
