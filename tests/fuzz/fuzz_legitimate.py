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
SMALL = 0.01

# target, file, place, kinds, reason; patterns that must match whole
REASONS: tuple[tuple[str, str, str, str, str], ...] = (
    (".*", ".*", ".*", "type|text", "a digit or a word among others, of the type its place asks for"),
    ("plan", ".*", ".*", ".*", "a plan is the question asked: its numbers, names and order are its author's"),
    ("design", ".*", ".*", ".*", "bounds, limits and times of a design are the question asked"),
    ("system", ".*", ".*", ".*", "a system of one's own is what its author writes; two engines agree on it"),
    ("vehicle", r".*\.csv", "rows", "missing", "rows are interpolated between, and tables may cover a shorter flight"),
    ("vehicle", r"bending_.*|.*modes\.csv", "displacement_.*|slope_.*", "sign", "a mode has either sign at a place"),
    ("vehicle", "loads_station_.*", "bending_.*", "sign", "the moment by a mode has the mode's sign, which is free"),
    (
        "vehicle",
        r"vehicle\.toml",
        r"control\..*",
        "unit|sign|shift|swap",
        "gains are the designer's; unstable roots are told",
    ),
    (
        "vehicle",
        r"vehicle\.toml",
        r"(bending|slosh|noise)\..*|.*(damping|sigma|correlation_time_s)",
        "unit|shift|swap|missing",
        "dampings and noise levels are assumptions of the vehicle's author",
    ),
    (
        "construction",
        ".*/normal_force.csv",
        ".*",
        "swap|sign",
        "how much each part carries, and to which side, is stated once",
    ),
    ("construction", r".*\.csv", "rows", "missing", "rows are interpolated, or items of a list without a set length"),
    ("construction", r".*\.csv", ".*", "shift", "a curve moved by a row is another curve; nothing states it twice"),
    ("construction", ".*", r"engines\.draws", ".*", "what the draws leave comes from no tank (docs/construction.md)"),
    ("filter", ".*", "source|name", ".*", "words"),
    (
        "vehicle",
        r"bending_.*|.*modes\.csv",
        "displacement_.*|slope_.*",
        "unit|shift|swap",
        "a shape of its own; modes stand once",
    ),
    (
        "vehicle",
        r"wind_.*\.csv",
        "mean",
        "unit|sign|shift",
        "a calmer or stronger mean, or from the other side, of another site",
    ),
    ("construction", ".*", r"\[\[normal_force\]\]", "missing", "a vehicle may have fewer parts of the normal force"),
)


def reason(target: str, mutation: Mutation, changed: float) -> str | None:
    """Return why a change is a vehicle that someone may mean; None where it should have been told.

    ``changed`` is the relative change of the statistics.
    """
    if changed < SMALL:
        return f"the statistics move by less than {SMALL:.0%}, within what such data are known to"
    for of_target, file, place, kinds, why in REASONS:
        found = zip(
            (of_target, file, place, kinds), (target, mutation.file, mutation.place, mutation.kind), strict=True
        )
        if all(re.fullmatch(pattern, text) for pattern, text in found):
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
