"""Centre of gravity and inertia of AS-506 against its evaluation report."""

from __future__ import annotations

from dataclasses import replace

from ....model.construction import Construction
from ...construct.mass.properties import mass_properties
from .construction import as506
from .flight import SOURCE, FlightCheck

CENTER_OF_GRAVITY_LIMIT = 0.15  # m
INERTIA_LIMIT = 0.01  # of the flown value

# Table 20-1, actual: kg below the LOX tank and the RP-1 tank, of gas in both, of the S-IC's other fluids, and of S-II
# and S-IVB less dry stage and liquid; then LOX and RP-1 in the tanks.
_ITEMS = (
    "LOX below tank",
    "RP-1 below tank",
    "S-IC ullage gas",
    "S-IC He, N2, frost, retro, other",
    "S-II misc (frost, gases, below-tank propellant)",
    "S-IVB misc (APS, He, frost, below tank)",
)
_STATES = {
    "hold-down release": ((21_868.0, 5_983.0, 311.0, 2_223.0, 1_413.0, 939.0), (1_446_726.0, 631_847.0)),
    "outboard cutoff": ((16_761.0, 5_946.0, 3_860.0, 1_738.0, 1_155.0, 849.0), (1_280.0, 8_008.0)),
}
_FLOWN = {  # table 20-10, actual: kg, m (vehicle station), kg m2
    "hold-down release": (2_899_010.0, 30.276, 914.293e6),
    "outboard cutoff": (827_294.0, 46.453, 440.511e6),
}


def mass_checks(as504: Construction) -> tuple[FlightCheck, ...]:
    """Compare mass, centre of gravity and pitch inertia of AS-506, built from the shipped construction of AS-504.

    The dry stages' centres of gravity, and the S-IC's inertia, are fitted to those of the same report; the sum is not.
    At outboard cutoff gas fills the LOX tank. A fifth of the LOX below it has gone since release, about the line of the
    centre engine, so the rest stays spread as it was.
    """
    vehicle = as506(as504)
    lox = next(tank for tank in vehicle.tanks if tank.name == "sic_lox")
    rows = []
    for state, (fluids, (oxygen, kerosene)) in _STATES.items():
        amounts: dict[str, float] = dict(zip(_ITEMS, fluids, strict=True))
        masses = tuple(replace(item, mass=amounts.get(item.name, item.mass)) for item in vehicle.masses)
        if state == "outboard cutoff":
            masses = tuple(
                replace(item, begin=lox.bottom, end=lox.top) if item.name == "S-IC ullage gas" else item
                for item in masses
            )
        found = mass_properties(replace(vehicle, masses=masses), {"sic_lox": oxygen, "sic_rp1": kerosene})
        mass, center, inertia = _FLOWN[state]
        station = float(found.center_of_gravity) + vehicle.gimbal_station
        source = f"{SOURCE}, table 20-10"
        rows += [
            FlightCheck(f"{state}, mass", "t", float(found.mass) / 1e3, mass / 1e3, None, source),
            FlightCheck(f"{state}, centre of gravity, station", "m", station, center, CENTER_OF_GRAVITY_LIMIT, source),
            FlightCheck(
                f"{state}, pitch inertia",
                "1e6 kg m2",
                float(found.moment_of_inertia) / 1e6,
                inertia / 1e6,
                INERTIA_LIMIT * inertia / 1e6,
                source,
            ),
        ]
    return tuple(rows)
