"""Gust penetration: the vehicle enters a wind nose first, and each zone meets it later by its distance over the speed.

The wind drives the foremost zone and is carried from zone to zone by delays d/V, each the Pade element [1/2]

    (1 - s d / 3 V) / (1 + 2 s d / 3 V + s^2 d^2 / 6 V^2),

strictly proper, so that only the foremost zone meets the filter's roughness, in states that are winds: along the path
its coefficients are constant, so that V may change. The rates V/d are tables. A chain of first-order lags would take a
quarter off the first mode's wind.

The reference wind, of the angle of attack (4-3), is that of the zones by their normal forces: then the lateral force is
that of 4-1 whatever the zones meet, and what is left of each zone's wind, delta_j = (W_j - W) / V with
sum_j c_j delta_j = 0, turns the vehicle, bends it and loads it:

    q A sum_j m_j delta_j,    q A sum_j D_ij delta_j,    q A sum_j (A_j - S_2 / I_ZZ m_j) delta_j

(m_j, D_ij, A_j the integrals of c'_N x, c'_N Y_i and c'_N (x - s) forward of s, times what zone j's wind is in the
parabola between zones that the strips meet).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ..system.symbols import TableSymbols
from ..vehicle.columns import SECOND_MOMENT
from ..vehicle.zones import PREFIX
from .block import Block

DELAYS = "gust_delays"  # the block of their states
SCALE = 10.0  # m/s


@dataclass(frozen=True, eq=False)
class Penetration:
    """Winds of the zones.

    Attributes
    ----------
    block : Block
        States of the delays.
    reference : SX
        Wind of the angle of attack, m/s.
    angles : (n,) SX
        delta_j, rad; empty for a vehicle that feels one wind.
    """

    blocks: tuple[Block, ...]
    reference: ca.SX
    angles: ca.SX


def penetration(met: ca.SX, zones: int, tables: TableSymbols) -> Penetration:
    """Return the winds of the zones from that which the foremost one meets (m/s); one zone is the whole vehicle."""
    if zones == 1:
        return Penetration((), met, ca.SX(0, 1))
    winds, states, rates = [met], [], []
    for j in range(2, zones + 1):
        wind, inner, here = ca.SX.sym(f"zone_wind_{j}"), ca.SX.sym(f"zone_delay_{j}"), winds[-1]
        rate = tables[f"{PREFIX}rate_{j - 1}"]
        states += [wind, inner]
        rates += [rate * (inner - 4 * wind - 2 * here), 6 * rate * (here - wind)]
        winds.append(wind)
    part = [tables[f"{PREFIX}normal_force_slope_{j}"] for j in range(1, len(winds) + 1)]
    reference = sum((c * w for c, w in zip(part, winds, strict=True)), ca.SX(0)) / sum(part, ca.SX(0))
    angles = ca.vertcat(*((wind - reference) / tables["relative_velocity"] for wind in winds))
    names = [symbol.name() for symbol in states]
    block = Block.of(DELAYS, ca.vertcat(*states), ca.vertcat(*rates), "m/s", SCALE, names)
    return Penetration((block,), reference, angles)


@dataclass(frozen=True)
class ZoneForces:
    """What the zones' own winds add: yaw moment (N m), generalised forces (modes,) (N)."""

    moment: ca.SX
    modal: ca.SX


def zone_forces(tables: TableSymbols, reference_area: ca.SX, angles: ca.SX, modes: int) -> ZoneForces:
    """Integrate q A c'_N delta_j against x and Y_i(x)."""
    pressure = tables["dynamic_pressure"] * reference_area
    modal = (_sum(tables, f"displacement_{i}", angles) for i in range(1, modes + 1))
    return ZoneForces(pressure * _sum(tables, "first_moment", angles), pressure * ca.vertcat(ca.SX(0, 1), *modal))


def zone_load(tables: TableSymbols, reference_area: ca.SX, output: str, angles: ca.SX) -> ca.SX:
    """What the zones' own winds add to a load, the rigid body's answer included, N m or N."""
    coefficients = tables.under(f"loads.{output}.")
    held = _sum(tables, output, angles)
    turned = _sum(tables, "first_moment", angles)
    return zone_coefficient(coefficients, tables, reference_area, held, turned)


def zone_coefficient(
    coefficients: Mapping[str, Any], flight: Any, reference_area: Any, forward: Any, first_moment: Any
) -> Any:
    """Return q A (A_j - S_2 / I_ZZ m_j), by symbols or by numbers."""
    answer = coefficients[SECOND_MOMENT.name] / flight["moment_of_inertia"] * first_moment
    return flight["dynamic_pressure"] * reference_area * (forward - answer)


def _sum(tables: TableSymbols, quantity: str, angles: ca.SX) -> ca.SX:
    parts = (tables[f"{PREFIX}{quantity}_{j + 1}"] * angles[j] for j in range(angles.numel()))
    return sum(parts, ca.SX(0))
