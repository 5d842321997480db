"""Names that results and equations keep for themselves, and what the text of a name may hold."""

from __future__ import annotations

import hashlib
import re

UNDISTURBED = "undisturbed_flight"  # the known input of a vehicle, of value one, that carries its axial forces' means
COMBINED = "combined"  # in every result, beside the sources: their sum
WIND = "wind"  # the source of a vehicle's wind filter
TURBULENCE = "turbulence"  # the source of its turbulence
LONGEST = 200  # characters of a name or unit

# A vehicle's noises, tanks and loads: name or pattern, and who has it. Every name that assemble(), the tables and the
# results folder make themselves stands here.
NOISE_NAMES = {
    WIND: "the source of the wind filter",
    r"wind_\d+": "a white noise of the wind filter",
    rf"{TURBULENCE}(_\d+)?": "the source of turbulence and its white noise",
    COMBINED: "the sum over all sources in every result",
    "tables": "the prefix of factors on tables in parameter studies",
}
TANK_NAMES = {
    "gimbal": "the bending tables' columns at the gimbal",
    "sensor": "the bending tables' columns at the sensor",
}
RESPONSE_NAMES = {
    "angle_of_attack|engine_angle|q_alpha": "a response of every vehicle",
    "lateral_drift|drift_rate|dynamic_pressure_times_angle_of_attack": "one of options.extra_outputs",
    "relative_deviation_.*|center_of_gravity_offset|thrust_misalignment": "a deviation among the load_components of "
    "options.extra_outputs",
    r"attitude_rate|bending_(acceleration|displacement|rate)_\d+|slosh_(acceleration|displacement)_.*": "one of the "
    "load_components of options.extra_outputs",
    "statistics|weighting_functions|.*_along_vehicle": "a file of the results",
}


def taken_by(name: str, taken: dict[str, str]) -> str | None:
    """Return who has a name already, of the names or patterns in ``taken``; None where it is free."""
    return next((who for pattern, who in taken.items() if re.fullmatch(pattern, name, re.IGNORECASE)), None)


def unfit(text: object, *, empty: bool = False) -> str | None:
    """Return why a text cannot be a name or unit, None where it can."""
    if not isinstance(text, str):
        return f"is {type(text).__name__} {text!r:.60}, not text"
    if not (text.strip() or empty):
        return "is empty"
    if text != text.strip() or not text.isprintable():
        return f"{text!r:.80} holds a line break, another control character or space at an end"
    if len(text) > LONGEST:
        return f"{text!r:.40}... has {len(text)} characters, more than {LONGEST}"
    return None


def file_name(name: str) -> str:
    """Return ``name`` where it can be a file's, without its suffix; a reminder of it and a hash elsewhere."""
    if re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_-]{0,79}", name):
        return name
    reminder = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-")[:40]
    return f"{reminder or 'name'}-{hashlib.sha256(name.encode(errors='replace')).hexdigest()[:8]}"
