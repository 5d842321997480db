"""Changes that make another vehicle, not a contradiction: where no second statement of the same thing exists.

``python fuzz_legitimate.py REPORT`` judges the lines of a report, counts them by verdict and prints those that are bad.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from pathlib import Path

from fuzz_mutations import Mutation

GOOD = ("refused", "warned", "unchanged", "legitimate", "not applicable")
SMALL = 0.002

# target, file, place, kinds, largest change of the statistics, reason; patterns that must match whole
ANY = float("inf")
REASONS: tuple[tuple[str, str, str, str, float, str], ...] = (
    # files of a vehicle
    ("vehicle", r"vehicle\.toml", r"control\..*", "unit|sign|shift|swap", ANY, "gains and filters are the designer's"),
    ("vehicle", r"control_gains\.csv", ".*", "unit|swap|shift|missing", ANY, "the schedule of gains is the designer's"),
    (
        "vehicle",
        r"vehicle\.toml",
        r"noise\..*\.sigma",
        "unit|shift|type|swap",
        19.0,
        "levels up to 0.2 (plausibility.assumptions), 20 times the shipped 0.01, are their author's; 0 is none",
    ),
    (
        "vehicle",
        r"vehicle\.toml",
        r"noise\..*\.correlation_time_s|(bending|slosh)\.damping",
        "unit|shift|type|swap",
        4.0,
        "times and dampings within those of launch vehicles (plausibility.assumptions) are their author's; 0 is none",
    ),
    ("vehicle", r"vehicle\.toml", r"\[noise\..*", "missing", 1.0, "a vehicle has the noises that its author gives it"),
    (
        "vehicle",
        r"vehicle\.toml",
        r"\[wind\]",
        "missing",
        1.0,
        "without a filter the wind is that of [wind.correlation] in closed form",
    ),
    (
        "vehicle",
        r"bending_.*",
        "slope_at_sensor",
        "unit|shift",
        0.25,
        "how the sensors turn with a mode stands once, and where they sit nowhere; displacements tell the size",
    ),
    (
        "vehicle",
        r"vehicle\.toml",
        r"start_time_s",
        "shift|unit",
        1.0,
        "any time before the loaded flight may be the start",
    ),
    (
        "vehicle",
        r"bending_.*",
        "normal_force_slope_times_.*",
        "sign|shift",
        0.15,
        "where along the vehicle the air works on a mode, and so the sign, stands once; mode and slope tell the size",
    ),
    (
        "vehicle",
        r"bending_.*|slosh_.*",
        "displacement_at_.*|slope_at_.*|attach_point|mass|frequency",
        "unit|sign|swap|shift",
        0.05,
        "a mode's displacement within a fifth of its largest, its slope within its waves, a tank half as wide again",
    ),
    (
        "vehicle",
        r".*\.csv",
        ".*",
        "shift",
        0.01,
        "a smooth curve one row earlier or later is within 1 %, as data of a flight are; more is told",
    ),
    # of a construction, whose tables are computed from one statement each
    (
        "construction",
        r".*/normal_force\.csv",
        ".*",
        "unit|swap|sign|shift",
        3.5,
        "how much each part carries, and to which side (boat-tails), stands once; parts have limits, and their sum",
    ),
    (
        "construction",
        r".*/(drag|pitch|engine|normal_force)\.csv",
        "rows|coefficient|pitch|time",
        "missing|shift",
        1.0,
        "curves over Mach number and time are their author's, with rows where they bend",
    ),
    (
        "construction",
        r".*/masses\.csv",
        "rows|begin|end|mass|radius_of_gyration",
        "missing|shift",
        1.5,
        "items of a list of no set length and sum, which may overlap, where their author puts them, none left empty",
    ),
    ("construction", r".*/masses\.csv", "radius_of_gyration", "unit", 0.1, "a slender vehicle turns about its length"),
    (
        "construction",
        r".*/stiffness\.csv",
        "rows|bending|shear",
        "missing|shift|unit",
        0.5,
        "walls of any thickness, as long as both stiffnesses are those of a radius",
    ),
    (
        "construction",
        r"construction\.toml",
        r"normal_force\..*|sensor_station_m|site\..*|pitch\..*|end_time_s",
        "shift|sign|unit|swap",
        1.0,
        "where parts carry and sensors sit, site, programme and end of the build are their author's",
    ),
    (
        "construction",
        r"construction\.toml",
        r"tanks\..*",
        "shift|unit",
        1.0,
        "liquid that its tank holds, and burns together",
    ),
    # of the filter, which the table of the standard deviation holds within 10 %
    (
        "filter",
        ".*",
        "(F|G|H)_.*|altitude_m",
        "unit|sign|shift",
        0.05,
        "a sample within its neighbours' noise; deviations of the filter over altitude are held to 10 % of the table's",
    ),
    ("filter", ".*", "altitude_m", "shift", 1.0, "moved as far as deviations over altitude allow"),
    ("filter", ".*", "source|name", ".*", ANY, "words"),
    # questions, and systems of one's own
    (
        "plan",
        ".*",
        r"dispersion\..*|\[\[dispersion\..*|title|times|vehicle|quantity.*",
        ".*",
        ANY,
        "a plan is a question: how many members, of which quantities, how wide; no other file states it",
    ),
    (
        "design",
        ".*",
        r"parameters.*|limits.*|trade.*|\[.*|times|frozen_times|response|vehicle",
        ".*",
        ANY,
        "bounds, limits and times of a design are the question asked; left out, they are not limited",
    ),
    (
        "system",
        ".*",
        "noise|input|output|k|s|scale|start covariance|start, end",
        "unit|sign|shift",
        ANY,
        "coefficients of one's own equations, in one's own units; two engines agree on them",
    ),
    (
        "system",
        ".*",
        ".*",
        "swap|duplicate|missing",
        ANY,
        "names and roles are the author's; two engines agree on them",
    ),
    # what is no mistake of numbers
    ("system", ".*", ".*", "type|text", ANY, "a value of a type that its place takes, or another name"),
    ("plan|design", ".*", ".*", "type|text", ANY, "a value of a type that its place takes, or a file that still reads"),
    (
        "vehicle|construction|filter",
        ".*",
        ".*",
        "type|text",
        0.2,
        "a digit among others, within its neighbours; limits of size hold for it",
    ),
)


def reason(target: str, mutation: Mutation, changed: float) -> str | None:
    """Return why a change is a vehicle that someone may mean; None where it should have been told.

    ``changed`` is the relative change of the statistics.
    """
    if changed < SMALL:
        return f"the statistics move by less than {SMALL:.1%}, the error of interpolation between rows"
    for of_target, file, place, kinds, largest, why in REASONS:
        found = zip(
            (of_target, file, place, kinds), (target, mutation.file, mutation.place, mutation.kind), strict=True
        )
        if changed <= largest and all(re.fullmatch(pattern, text) for pattern, text in found):
            return why
    return None


def judged(case: dict) -> dict:
    """Return a case with the verdict 'legitimate' where it is silent and there is a reason for it."""
    if case["verdict"] != "silent":
        return case
    why = reason(case["target"], Mutation(**case["mutation"]), case["changed"])
    return case if why is None else {**case, "verdict": "legitimate", "detail": f"{why} ({case['detail']})"}


def main() -> None:
    """Judge a report."""
    cases = [judged(json.loads(line)) for line in Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()]
    print(len(cases), "cases:", dict(Counter(c["verdict"] for c in cases)))
    print("longest", max(c["seconds"] for c in cases), "s of processor time")
    for case in cases:
        if case["verdict"] not in GOOD:
            print(json.dumps(case))


if __name__ == "__main__":
    main()
