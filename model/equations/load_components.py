"""Quantities that every bending moment is linear in: with their covariances a moment follows at any station."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import casadi as ca

from ..system.labels import Output
from .coupling import Accelerations
from .motion import Motion
from .typical_sizes import SCALES


def component_columns(modes: int, tanks: Sequence[str], noises: Iterable[str] = ()) -> dict[str, str]:
    """Return the outputs that a moment is made of and the column of a load's table that multiplies each.

    The columns of slosh_reaction have no output of their own: they act through the tanks. ``noises`` are those that
    load stations by themselves.
    """
    numbers = range(1, modes + 1)
    return {
        "angle_of_attack": "angle_of_attack",
        "engine_angle": "engine_angle",
        **{f"bending_acceleration_{i}": f"bending_{i}" for i in numbers},
        **{f"slosh_acceleration_{tank}": f"slosh_{tank}" for tank in tanks},
        "attitude_rate": "attitude_rate",
        **{f"bending_displacement_{i}": f"bending_displacement_{i}" for i in numbers},
        **{f"bending_rate_{i}": f"bending_rate_{i}" for i in numbers},
        **{f"slosh_displacement_{tank}": f"slosh_displacement_{tank}" for tank in tanks},
        **{f"relative_deviation_{name}": f"relative_deviation_{name}" for name in noises},
    }


def load_components(
    motion: Motion, solved: Accelerations, tanks: Sequence[str], deviations: Mapping[str, ca.SX]
) -> list[tuple[Output, ca.SX]]:
    """Return those of them that are no outputs anyway."""
    found = [(Output("attitude_rate", "rad/s", SCALES["angle"], "phi'"), motion.attitude_rate)]
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
        output = Output(f"relative_deviation_{name}", "1", SCALES["relative_deviation"], f"n of {name}")
        found.append((output, deviation))
    return found
