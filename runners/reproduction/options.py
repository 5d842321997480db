"""The options the report discusses, and what each changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...model.errors import DirectNoiseError
from ..statistics import COMBINED
from ..study import Study
from .predictions import ATTACK, ENGINE, TIME, Responses, end_times, responses


@dataclass(frozen=True)
class Option:
    """Another way to model the same vehicle.

    Attributes
    ----------
    name, what : str
    changes : mapping
        Of vehicle.toml, by dotted key.
    construction : mapping
        Of construction.toml, by dotted key; the vehicle's tables are built anew.
    """

    name: str
    what: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    construction: Mapping[str, Any] = field(default_factory=dict)


def _correlation(seconds: float) -> dict[str, float]:
    return {f"noise.{n}.correlation_time_s": seconds for n in ("thrust", "center_of_pressure")}


OPTIONS = (
    Option("local_angle_of_attack", "local angle of attack in all air forces", {"options.local_angle_of_attack": True}),
    Option("full_coupling", "slosh reacts on the rigid body too", {"options.full_coupling": True}),
    Option("correlation_time_0.3s", "vehicle noises with a correlation time of 0.3 s, not 1 s", _correlation(0.3)),
    Option("correlation_time_3s", "the same with 3 s", _correlation(3.0)),
    Option(
        "white_noise",
        "white vehicle noises of unit intensity times sigma",
        {"noise.thrust.white": True, "noise.center_of_pressure.white": True},
    ),
    Option("closed_form_wind", "closed form of the wind filter, not the fitted one", {"wind.synthesis": "closed_form"}),
)


@dataclass(frozen=True)
class Effect:
    """What an option makes of the responses; None where the variance is infinite.

    Attributes
    ----------
    sigma_attack, sigma_engine : float
        Of angle of attack and engine angle at 75 s, all sources (rad).
    """

    option: Option | None
    responses: Responses | None
    sigma_attack: float
    sigma_engine: float


def effect(vehicle: str | Path, option: Option | None = None) -> Effect:
    """Compute the responses of a vehicle with an option, or as it is."""
    study = Study.load(vehicle, changes=option.changes if option else None)
    try:
        statistics = study.response_statistics(end_times(study))
        found = responses(statistics)
    except DirectNoiseError:  # white noise reaches the bending moment through accelerations
        statistics = study.response_statistics(end_times(study), responses=[ATTACK, ENGINE])
        found = None
    std = statistics["std"].sel(time=TIME, source=COMBINED)
    return Effect(option, found, float(std.sel(response=ATTACK)), float(std.sel(response=ENGINE)))


def effects(
    vehicle: str | Path,
    folder_of: Callable[[Option], str | Path],
    progress: Callable[[], None] = lambda: None,
) -> list[Effect]:
    """Return the vehicle as it is, then with each option by itself.

    Parameters
    ----------
    vehicle : str or path
    folder_of : callable
        Gives the vehicle folder an option works on: the same, or one built anew.
    """
    found = [effect(vehicle)]
    for option in OPTIONS:
        progress()
        found.append(effect(folder_of(option), option))
    return found
