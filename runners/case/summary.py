"""What a case is, in a few lines for a prompt or a notebook."""

from __future__ import annotations

from ...codegen.system.executable import ExecutableSystem
from ...model.vehicle.vehicle import Vehicle
from ..present.notebook import cut, shortened


def summary(executable: ExecutableSystem, vehicle: Vehicle | None) -> dict[str, str]:
    """Return facts by their label, each on one line however large the system is."""
    system = executable.system
    changed = [
        f"{p.name} = {value:g}"
        for p, value in zip(system.parameters, executable.parameters, strict=True)
        if value != p.value
    ]
    facts = {"title": cut(vehicle.title)} if vehicle is not None else {}
    return facts | {
        "responses": shortened([f"{o.name} [{o.unit}]" for o in system.outputs]),
        "sources": shortened(system.sources),
        "inputs": shortened(system.input_names),
        "states": f"{len(system.states)}: {shortened(system.state_names, 4)}",
        "flight": f"{system.start:g} to {system.end:g} s",
        "numbers": f"{len(system.parameters)} parameters, {sum(len(g.names) for g in system.tables)} tables",
        "changed": shortened(changed),
        "code": "compiled" if executable.shared_library is not None else "interpreted",
    }
