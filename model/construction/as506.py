"""AS-506 (Apollo 11) out of AS-504's construction: the flight whose evaluation report is public.

Masses: MPR-SAT-FE-69-9, tables 20-1 (at hold-down release) and 20-9; the split of a dry stage stays AS-504's. Pitch:
time-tilt polynomials of the flight computer (Project Apollo - NASSP, LVDC.cpp). Shape, stiffness, aerodynamics and
atmosphere are AS-504's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .construction import Construction
from .flight import EngineGroup

RELEASE_MASS = 2_899_008.0  # kg, table 20-1
CENTER_CUTOFF, OUTBOARD_CUTOFF = 135.20, 161.63  # s, table 2-2

# kg at release by group of AS-504's items
_GROUPS: tuple[tuple[float, tuple[str, ...]], ...] = (
    (
        130_422.0,
        (
            "F-1 engines (5)",
            "Base heat shield, base plumbing, hydraulics",
            "Fins and engine fairings",
            "S-IC thrust structure",
            "RP-1 tank shell",
            "LOX tunnels, suction lines, RP-1 tank equipment",
            "Intertank",
            "LOX tank shell, baffles, He bottles",
            "S-IC forward skirt and equipment",
        ),
    ),
    (2_223.0, ("S-IC He, N2, frost, retro, other",)),
    (311.0, ("S-IC ullage gas",)),
    (5_983.0, ("RP-1 below tank",)),
    (5_206.0, ("S-IC/S-II interstage + ullage motors",)),
    (
        36_158.0,
        (
            "S-II J-2 engines (5)",
            "S-II thrust cone, aft skirt",
            "S-II LOX tank, common bulkhead",
            "S-II LH2 tank wall, insulation, feed lines",
            "S-II forward dome and skirt, equipment",
        ),
    ),
    (1_413.0, ("S-II misc (frost, gases, below-tank propellant)",)),
    (3_663.0, ("S-II/S-IVB interstage + retros",)),
    (
        11_273.0,
        (
            "S-IVB J-2 engine, thrust cone",
            "S-IVB aft skirt, APS",
            "S-IVB tank, common bulkhead, lines",
            "S-IVB forward skirt, equipment",
        ),
    ),
    (939.0, ("S-IVB misc (APS, He, frost, below tank)",)),
    (1_939.0, ("IU",)),
    (1_792.0, ("SLA",)),
    (15_095.0, ("LM",)),
    (28_806.0, ("SM", "CM")),
    (4_042.0, ("LES+BPC",)),
)
# What leaves from below the tanks and as gas between release and outboard cutoff (net, table 20-1) counts as LOX in the
# tank: the construction's masses do not change.
_FROM_BELOW = 2_431.0
_LIQUID = {
    "sic_lox": 1_446_726.0 + _FROM_BELOW,
    "sic_rp1": 631_847.0,
    "sii_lox": 370_778.0,
    "sii_lh2": 71_615.0,
    "sivb_lox": 87_149.0,
    "sivb_lh2": 19_758.0,
}
_LEFT = {"sic_lox": 1_280.0, "sic_rp1": 8_008.0}  # kg at outboard cutoff, table 20-1
# Time since time base 1 (s) from, to; coefficients of the tilt (deg) by rising power, negative downrange
_TILT = (
    (0.0, 33.6, 1.04707442, -0.147669484, 0.00824109168, -0.000403816898, 3.3875198e-06),
    (33.6, 68.6, -6.8711608, 0.664009046, -0.0231195092, 0.000137310354, -1.2433039e-07),
    (68.6, 95.6, -6.63318417, 0.810101295, -0.0299134054, 0.00023966525, -6.35979551e-07),
    (95.6, 160.0, 42.5287982, -1.25455452, 0.00237693395, 1.63508094e-05, -5.87090259e-08),
)
_AZIMUTH = 72.058  # deg


def as506(as504: Construction) -> Construction:
    """Return the construction of AS-506.

    Parameters
    ----------
    as504 : Construction
        The shipped one.
    """
    masses = {m.name: m for m in as504.masses}
    changed = {"LOX below tank": 21_868.0 - _FROM_BELOW}
    for total, items in _GROUPS:
        factor = total / sum(masses[item].mass for item in items)
        changed |= {item: factor * masses[item].mass for item in items}
    tilt = np.array(_TILT)
    segments = np.hstack([tilt[:, :2], -np.deg2rad(tilt[:, 2:])])
    return replace(
        as504,
        name="as506",
        masses=tuple(replace(m, mass=changed[m.name]) for m in as504.masses),
        tanks=tuple(replace(t, liquid=_LIQUID[t.name]) for t in as504.tanks),
        engines=tuple(_engines(g) for g in as504.engines),
        pitch=replace(as504.pitch, arrest=160.0, segments=segments),
        site=replace(as504.site, azimuth=float(np.deg2rad(_AZIMUTH))),
        end_time=OUTBOARD_CUTOFF,
    )


def _engines(group: EngineGroup) -> EngineGroup:
    """Return a group with AS-506's cutoff; the jump of flow and thrust moves there from AS-504's."""
    used = {tank: _LIQUID[tank] - left for tank, left in _LEFT.items()}
    draws = {tank: mass / sum(used.values()) for tank, mass in used.items()}
    time = group.time.copy()
    near = abs(time - 134.34) < 1e-3
    time[near] += CENTER_CUTOFF - 134.34
    cutoff = OUTBOARD_CUTOFF if group.gimballed else CENTER_CUTOFF
    return replace(group, time=time, draws=draws, cutoff=cutoff, residual={})
