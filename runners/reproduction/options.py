"""The options the report discusses, and what each changes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...model.errors import DirectNoiseError
from ...model.system.names import COMBINED
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.shipped import find_vehicle
from ...model.vehicle.vehicle_file import read_vehicle_file
from ..study import Study
from .predictions import ATTACK, ENGINE, TIME, Responses, end_times, responses
from .rebuild import rebuilt, third_mode

GUST_ZONES = "options.gust_zones"


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


def _turbulence(severity: str, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    return {"wind.turbulence.severity": severity} | dict(changes or {})


OPTIONS = (
    Option("local_angle_of_attack", "local angle of attack in all air forces", {"options.local_angle_of_attack": True}),
    Option("third_bending_mode", "a third bending mode", construction={"bending_modes": 3}),
    Option("full_coupling", "slosh reacts on the rigid body too", {"options.full_coupling": True}),
    Option(
        "slosh_reaction", "the bending moment holds the vehicle's answer to slosh", {"options.slosh_reaction": True}
    ),
    Option(
        "couple_forward",
        "couple of a moved centre of pressure wholly forward of the station",
        {"options.noise_loads": "couple_forward"},
    ),
    Option("couple_aft", "the same wholly aft of it", {"options.noise_loads": "couple_aft"}),
    Option(
        "noise_as_reported",
        "thrust and centre of pressure not in 4-13 itself, as reported",
        {"options.noise_loads": "as_reported"},
    ),
    Option("slosh_cylinder", "slosh of flat-bottomed cylinders", construction={"slosh_method": "cylinder"}),
    Option(
        "slosh_potential", "slosh by potential flow in the tank's shape", construction={"slosh_method": "potential"}
    ),
    Option("correlation_time_0.3s", "vehicle noises with a correlation time of 0.3 s, not 1 s", _correlation(0.3)),
    Option("correlation_time_3s", "the same with 3 s", _correlation(3.0)),
    Option(
        "white_noise",
        "white vehicle noises of unit intensity times sigma",
        {"noise.thrust.white": True, "noise.center_of_pressure.white": True},
    ),
    Option("closed_form_wind", "closed form of the wind filter, not the fitted one", {"wind.synthesis": "closed_form"}),
    Option("gust_zones", "wind met nose first, in five zones", {GUST_ZONES: 5}),
    Option(
        "moderate_turbulence_at_once",
        "moderate turbulence, which the whole vehicle meets at once",
        _turbulence("moderate", {GUST_ZONES: 1}),
    ),
    Option("moderate_turbulence", "moderate turbulence, met nose first", _turbulence("moderate")),
    Option("severe_turbulence", "severe turbulence, met nose first", _turbulence("severe")),
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


def effect(folder: Path, option: Option | None, work: Path) -> Effect:
    """Compute the responses of a vehicle with an option, or as it is; tables are built anew in ``work``."""
    changes = dict(option.changes) if option else {}
    if option and option.construction:
        file = read_vehicle_file(folder / VEHICLE_FILE)
        if option.construction.get("bending_modes", 0) > len(file.bending):
            changes |= third_mode(file)
        folder = rebuilt(folder, work / option.name, construction=option.construction, changes=changes)
    study = Study.load(folder, changes=changes)
    try:
        statistics = study.response_statistics(end_times(study))
        found = responses(statistics)
    except DirectNoiseError:  # white noise reaches the bending moment through accelerations
        statistics = study.response_statistics(end_times(study), responses=[ATTACK, ENGINE])
        found = None
    std = statistics["std"].sel(time=TIME, source=COMBINED)
    return Effect(option, found, float(std.sel(response=ATTACK)), float(std.sel(response=ENGINE)))


def effects(vehicle: str | Path, progress: Callable[[str], None] = lambda name: None) -> list[Effect]:
    """Return the vehicle as it is, then with each option by itself."""
    folder = find_vehicle(vehicle)
    found = []
    with tempfile.TemporaryDirectory() as work:
        for option in (None, *OPTIONS):
            found.append(effect(folder, option, Path(work)))
            progress(option.name if option else "as it is")
    return found
