"""What a vehicle's equations are made of, in words: said when code is generated again."""

from __future__ import annotations

from collections.abc import Sequence

from ..tables import TableGroup
from ..vehicle.vehicle import Vehicle


def structure_in_words(vehicle: Vehicle, states: int, groups: Sequence[TableGroup]) -> dict[str, str]:
    """Return it by what is counted or chosen; ``states`` is their number."""
    orders = (f"{n} {len(e.denominator) - 1}" for n, e in vehicle.transfer_functions.items())
    relief = ", ".join(
        f"{n} of order {len(e.filter.denominator) - 1}" for n, e in vehicle.file.control.load_relief.items()
    )
    return {
        **({"load relief": relief} if relief else {}),
        "bending modes": str(len(vehicle.bending)),
        "slosh tanks": ", ".join(t.name for t in vehicle.slosh) or "none",
        "transfer function orders": ", ".join(orders),
        "wind filter": f"order {vehicle.wind.shaping_filter.order}, {vehicle.wind.shaping_filter.noise_count} noises",
        "noise sources": ", ".join(f"{n} ({'white' if e.white else 'coloured'})" for n, e in vehicle.noise.items()),
        "loads": ", ".join(load.output for load in vehicle.file.loads),
        "extra outputs": ", ".join(vehicle.file.options.extra_outputs) or "none",
        "full coupling": str(vehicle.file.options.full_coupling).lower(),
        **({"local angle of attack": "true"} if vehicle.file.options.local_angle_of_attack else {}),
        **({"slosh reaction": "true"} if vehicle.file.options.slosh_reaction else {}),
        **({"noise loads": vehicle.file.options.noise_loads} if vehicle.noise and vehicle.file.loads else {}),
        "states": str(states),
        "table lengths": ", ".join(f"{g.name} {len(g.names)} x {g.knots.size}" for g in groups),
    }
