"""What a vehicle's equations are made of, in words: said when code is generated again."""

from __future__ import annotations

from collections.abc import Sequence

from ..tables import TableGroup
from ..vehicle.biases import vehicle_biases
from ..vehicle.loads import load_outputs
from ..vehicle.noise_loads import deviating_tables
from ..vehicle.planes import SECTIONS, own_tables, plane_entry
from ..vehicle.vehicle import Vehicle
from ..vehicle.vehicle_file import VehicleFile


def _planes(file: VehicleFile) -> str:
    own = [f"{name} with its own {', '.join(own)}" for name in ("pitch", "yaw") if (own := _own(file, name))]
    each = [name for name, noise in file.noise.items() if noise.planes == "each"] if file.planes == "both" else []
    turns = ["azimuth turns along the flight"] if file.planes == "both" and file.wind.azimuth_change else []
    speed = ["speed through the mean wind"] if file.wind.air_speed == "mean_wind" else []
    if file.planes == "both":
        each += [bias.source for bias in vehicle_biases(file).values() if not bias.common and bias.unit == "1"]
    apart = (f"{name} in each" for name in each)
    roll = [] if file.roll_deg is None else ["rolled"]
    if file.tables.product_of_inertia is not None:
        roll.append("coupled by a product of inertia")
    return "; ".join([file.planes, f"wind {file.wind.pitch_wind} in pitch", *turns, *speed, *roll, *own, *apart])


def _own(file: VehicleFile, plane: str) -> list[str]:
    entry = plane_entry(file, plane)
    return [*own_tables(entry), *(section for section in SECTIONS if getattr(entry, section) is not None)]


def structure_in_words(vehicle: Vehicle, states: int, groups: Sequence[TableGroup]) -> dict[str, str]:
    """Return it by what is counted or chosen; ``states`` is their number."""
    file, biases = vehicle.file, ", ".join(vehicle_biases(vehicle.file))
    orders = (f"{n} {len(e.denominator) - 1}" for n, e in vehicle.transfer_functions.items())
    relief = ", ".join(f"{n} of order {len(e.filter.denominator) - 1}" for n, e in file.control.load_relief.items())
    turbulence = vehicle.turbulence
    return {
        **({} if file.planes == "yaw" else {"planes": _planes(file)}),
        **({"load relief": relief} if relief else {}),
        "bending modes": str(len(vehicle.bending)),
        "slosh tanks": ", ".join(t.name for t in vehicle.slosh) or "none",
        "transfer function orders": ", ".join(orders),
        "wind filter": f"order {vehicle.wind.shaping_filter.order}, {vehicle.wind.shaping_filter.noise_count} noises",
        **({"turbulence": f"{turbulence.form}, order {turbulence.order}"} if turbulence else {}),
        **({"gust zones": str(vehicle.zones.count)} if vehicle.zones else {}),
        "noise sources": ", ".join(f"{n} ({'white' if e.white else 'coloured'})" for n, e in vehicle.noise.items()),
        "loads": ", ".join(load_outputs(file)),
        "extra outputs": ", ".join(file.options.extra_outputs) or "none",
        "full coupling": str(file.options.full_coupling).lower(),
        **({"local angle of attack": "true"} if file.options.local_angle_of_attack else {}),
        **({"slosh reaction": "true"} if file.options.slosh_reaction else {}),
        **({"noise loads": file.options.noise_loads} if deviating_tables(file) and file.loads else {}),
        **({"biases": biases} if biases else {}),
        **({"wind-biased programme": "true"} if file.options.wind_biased_programme else {}),
        **({"trajectory's angle of attack": "true"} if file.options.trajectory_angle_of_attack else {}),
        **({"P-delta": "true"} if file.options.p_delta else {}),
        "states": str(states),
        "table lengths": ", ".join(f"{g.name} {len(g.names)} x {g.knots.size}" for g in groups),
    }
