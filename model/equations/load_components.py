"""Quantities that every bending moment is linear in: with their covariances a moment follows at any station."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import casadi as ca

from ..system.labels import Output
from ..vehicle.biases import CENTER_OF_GRAVITY_OFFSET, THRUST_MISALIGNMENT
from .coupling import Accelerations
from .motion import Motion
from .typical_sizes import SCALES

# unit and typical size of deviations that are not relative
IN_PLACE_UNITS = {CENTER_OF_GRAVITY_OFFSET: ("m", "offset"), THRUST_MISALIGNMENT: ("rad", "angle")}


def component_columns(
    modes: int, tanks: Sequence[str], deviations: Iterable[str] = (), zones: int = 1
) -> dict[str, str]:
    """Return the outputs that a moment is made of and the column of a load's table that multiplies each.

    The columns of slosh_reaction have no output of their own: they act through the tanks. ``deviations`` are those that
    load stations by themselves, ``zones`` the number of gust zones.
    """
    numbers = range(1, modes + 1)
    return {
        "angle_of_attack": "angle_of_attack",
        **{f"zone_angle_{j}": f"zone_angle_{j}" for j in range(1, zones + 1) if zones > 1},
        "engine_angle": "engine_angle",
        **{f"bending_acceleration_{i}": f"bending_{i}" for i in numbers},
        **{f"slosh_acceleration_{tank}": f"slosh_{tank}" for tank in tanks},
        "attitude_rate": "attitude_rate",
        **{f"bending_displacement_{i}": f"bending_displacement_{i}" for i in numbers},
        **{f"bending_rate_{i}": f"bending_rate_{i}" for i in numbers},
        **{f"slosh_displacement_{tank}": f"slosh_displacement_{tank}" for tank in tanks},
        **{deviation_output(name): deviation_output(name) for name in deviations},
    }


def load_components(
    motion: Motion, solved: Accelerations, tanks: Sequence[str], deviations: Mapping[str, ca.SX]
) -> list[tuple[Output, ca.SX]]:
    """Return those of them that are no outputs anyway."""
    found = [(Output("attitude_rate", "rad/s", SCALES["angle"], "phi'"), motion.attitude_rate)]
    for j in range(motion.zone_angles.numel()):
        what = f"of gust zone {j + 1}, less alpha"
        found.append((Output(f"zone_angle_{j + 1}", "rad", SCALES["angle"], what), motion.zone_angles[j]))
    for i in range(motion.eta.numel()):
        n = i + 1
        found += [
            (Output(f"bending_acceleration_{n}", "m/s2", SCALES["bending_acceleration"], f"eta_{n}''"),
             solved.bending[i]),
            (Output(f"bending_displacement_{n}", "m", SCALES["bending"], f"eta_{n}"), motion.eta[i]),
            (Output(f"bending_rate_{n}", "m/s", SCALES["bending_rate"], f"eta_{n}'"), motion.eta_rate[i]),
        ]  # fmt: skip
    for k, tank in enumerate(tanks):
        found += [
            (Output(f"slosh_acceleration_{tank}", "m/s2", SCALES["slosh_acceleration"], f"xi'' of {tank}"),
             solved.slosh[k]),
            (Output(f"slosh_displacement_{tank}", "m", SCALES["slosh"], f"xi of {tank}"), motion.xi[k]),
        ]  # fmt: skip
    for name, deviation in deviations.items():
        unit, scale = IN_PLACE_UNITS.get(name, ("1", "relative_deviation"))
        found.append((Output(deviation_output(name), unit, SCALES[scale], f"n of {name}"), deviation))
    return found


def deviation_output(name: str) -> str:
    """Return what the output of a deviation is called: a length or an angle as its source."""
    return name if name in IN_PLACE_UNITS else f"relative_deviation_{name}"
