"""The readable C of a vehicle, kept beside the code, and the manifest that says what it is."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...codegen.ensemble.compiled import ensemble_recipe
from ...codegen.nodes.compiled import node_recipe
from ...codegen.nodes.expressions import node_expressions
from ...codegen.sweep.compiled import sweep_recipe
from ...codegen.sweep.source import sweep_functions
from ...codegen.system.executable import executable_system, system_recipe
from ...codegen.toolchain.cache import describe_changes
from ...model.system.linear_system import LinearSystem
from ..present.files import prepare_folder, write_text
from ..study import Study


def generated_files(system: LinearSystem) -> dict[str, str]:
    """Return the texts of manifest.json and of all generated C of a system.

    NAME.c holds adjoint, mean and matrices, NAME_sweep.c all end times in one pass, NAME_nodes.c gradients and
    collocation, NAME_ensemble.c simulated flights.
    """
    recipes = (
        system_recipe(executable_system(system, compile=False)),
        sweep_recipe(system, sweep_functions(system)),
        node_recipe(system, node_expressions(system)),
        ensemble_recipe(system),
    )
    sources = {recipe.file_name: recipe.source() for recipe in recipes}
    manifest: dict[str, Any] = {
        "name": system.name,
        "sha256": {name: hashlib.sha256(text.encode()).hexdigest() for name, text in sources.items()},
        "sizes": {
            "states": len(system.states),
            "noises": len(system.noises),
            "outputs": len(system.outputs),
            "parameters": len(system.parameters),
            "table_values": system.v.numel(),
            "table_numbers": sum(g.size for g in system.tables),
        },
        "structure": dict(system.structure),
        "states": list(system.state_names),
        "noises": {n.name: n.source for n in system.noises},
        "outputs": {o.name: o.unit for o in system.outputs},
        "parameters": {p.name: p.unit for p in system.parameters},
        "tables": {
            g.name: {"argument": g.argument, "knots": g.knots.size, "names": list(g.names)} for g in system.tables
        },
    }
    return {**sources, "manifest.json": json.dumps(manifest, indent=1) + "\n"}


def regenerate(vehicle: str | Path, folder: Path, changes: Mapping[str, Any] | None = None) -> dict[Path, str]:
    """Write the generated files of a vehicle and say of each whether and why it changed.

    Raises
    ------
    OutputFolderError
    """
    system = Study.load(vehicle, compile=False, changes=changes).system
    target = folder / system.name
    prepare_folder(target)
    before = _structure(target / "manifest.json")
    states = {}
    for name, text in generated_files(system).items():
        path = target / name
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            states[path] = "unchanged"
            continue
        differences = describe_changes(before, dict(system.structure)) if before else []
        states[path] = (
            f"written ({'; '.join(differences) or ('equations, names or code generator changed' if before else 'new')})"
        )
        write_text(path, text)
    return states


def _structure(manifest: Path) -> dict[str, str] | None:
    try:
        return json.loads(manifest.read_text(encoding="utf-8"))["structure"]
    except (OSError, ValueError, KeyError):
        return None
