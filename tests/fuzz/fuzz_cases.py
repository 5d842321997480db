"""One fuzz case: a seed is a file (or a system) with one mistake in it, and what ascentwind makes of that.

``python fuzz_cases.py FIRST LAST`` runs seeds and prints a line of JSON for each, so that a crash or a hang is the loss
of one process and not of the tests.
"""

from __future__ import annotations

import json
import re
import resource
import shutil
import sys
import tempfile
import tomllib
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

import numpy as np
from fuzz_mutations import KINDS, Mutation, mutate
from fuzz_systems import mutated_system
from numpy.typing import NDArray

from ascentwind.codegen.system.executable import ExecutableSystem, executable_system
from ascentwind.model.equations.assemble import assemble
from ascentwind.model.equations.stated_twice import compare_stated_twice
from ascentwind.model.errors import AscentwindError, AscentwindWarning
from ascentwind.model.system.linear_system import LinearSystem
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.vehicle.vehicle import Vehicle
from ascentwind.runners import Study
from ascentwind.runners.case.wind_start import covariance_at
from ascentwind.runners.construct.build_vehicle import build_vehicle
from ascentwind.runners.design.file import load_design
from ascentwind.runners.parameter_study.plan import ParameterStudyPlan, read_plan
from ascentwind.runners.parameter_study.quantities import resolve_quantities
from ascentwind.runners.parameter_study.sampling import member_values
from ascentwind.runners.solvers.stability import check_coupling

LONGEST = 5.0  # s of processor time
SPACING = 5.0  # s, between the rows of a built vehicle
TARGETS = {"vehicle": 40, "construction": 15, "filter": 10, "plan": 10, "design": 10, "system": 15}
PLAN = Path(__file__).parents[2] / "examples" / "as504_dispersion.toml"
DESIGN = "design.toml"
LOAD = Study.load
UNCHANGED = 1e-9  # of a statistic, relative: the change touches nothing that is computed


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Attributes
    ----------
    verdict : str
        'refused', 'warned', 'unchanged' (nothing computed moves) and 'not applicable' are good; 'silent' is where there
        is a reason for it (fuzz_legitimate.py); 'traceback', 'not finite' and 'slow' are not, nor are 'crash' and
        'hang', which the caller tells.
    changed : float
        By how much the statistics move, relative; 1 where the structure changes.
    """

    seed: int
    target: str
    mutation: Mutation
    verdict: str
    detail: str
    changed: float
    seconds: float

    def line(self) -> str:
        """Return it as JSON."""
        return json.dumps(asdict(self))


def run_case(seed: int) -> Outcome:
    """Run one case."""
    random = Random(seed)
    target = random.choices(list(TARGETS), list(TARGETS.values()))[0]
    kind = random.choice(KINDS)
    before = _processor_seconds()
    with tempfile.TemporaryDirectory() as work, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mutation, verdict, detail, changed = Mutation(kind, "", "", ""), "not applicable", "", 0.0
        try:
            mutation, changed = _RUN[target](Path(work), kind, random)
        except AscentwindError as error:
            mutation, verdict, detail = getattr(error, "mutation", mutation), "refused", str(error)
        except Exception as error:
            mutation = getattr(error, "mutation", mutation)
            verdict, detail = "traceback", "".join(traceback.format_exception(error)[-3:])
        else:
            if mutation.what:
                told = [str(w.message) for w in caught if issubclass(w.category, AscentwindWarning)]
                verdict, detail = _judge(changed, [t for t in told if t not in _usual_warnings()])
    seconds = _processor_seconds() - before
    if seconds > LONGEST and verdict != "traceback":
        verdict, detail = "slow", f"{verdict}: {detail}"
    return Outcome(seed, target, mutation, verdict, detail[:600], changed, round(seconds, 2))


def _judge(changed: float, told: list[str]) -> tuple[str, str]:
    if told:
        return "warned", told[0]
    if not np.isfinite(changed):
        return "not finite", "statistics that are not numbers, without a word"
    if changed < UNCHANGED:
        return "unchanged", ""
    return "silent", f"statistics move by {changed:.2g}"


def _processor_seconds() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


@contextmanager
def _marked(mutation: Mutation | None) -> Iterator[None]:
    """Tell with an error what the file was spoiled by."""
    try:
        yield
    except Exception as error:
        error.mutation = mutation  # type: ignore[attr-defined]
        raise


def _none(kind: str) -> tuple[Mutation, float]:
    return Mutation(kind, "", "", ""), 0.0


@cache
def _usual(name: str) -> tuple[Study, dict[str, Any], tuple[str, ...]]:
    """Return a shipped vehicle, its statistics and what it warns of as it is."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        study = Study.load(name)
        statistics = _statistics(study, _times(study))
    return study, statistics, tuple(str(w.message) for w in caught)


def _usual_warnings() -> set[str]:
    return {text for name in built_in_vehicles() for text in _usual(name)[2]}


def _times(study: Study) -> list[float]:
    """Return an early time, the greatest dynamic pressure and a late time."""
    start, end = study.system.start, study.system.end
    return [start + 0.2 * (end - start), start + 0.45 * (end - start), start + 0.9 * (end - start)]


def _statistics(study: Study, times: list[float]) -> dict[str, Any]:
    found = study.response_statistics(times)
    return {name: found[name].values for name in ("mean", "std")}


def _difference(name: str, folder: Path) -> float:
    """Return how far a changed vehicle's statistics are from the shipped one's, relative; 1 for another structure."""
    usual, statistics, _ = _usual(name)
    vehicle = load_vehicle(folder)
    system = assemble(vehicle, _start_covariance(vehicle))
    study = Study(_executable(usual, vehicle, system), vehicle)
    check_coupling(study.executable)
    times = _times(usual)
    if study.executable.shared_library is not None and system.start < times[0] and times[-1] <= system.end:
        found = _statistics(study, times)
        size = {k: np.abs(v).max(axis=0, keepdims=True) for k, v in statistics.items()}
        apart = [np.abs(found[k] - v) / np.where(size[k] > 0, size[k], 1) for k, v in statistics.items()]
        compare_stated_twice(vehicle)
        return float(np.max(apart)) if all(np.isfinite(a).all() for a in apart) else np.inf
    compare_stated_twice(vehicle)
    middle, soon = 0.5 * (system.start + system.end), system.start + min(0.2, 0.1 * (system.end - system.start))
    found = [*study.matrices(middle), *_statistics(study, [soon]).values()]
    return 1.0 if all(np.isfinite(v).all() for v in found) else np.inf


def _start_covariance(vehicle: Vehicle) -> NDArray[np.float64]:
    return covariance_at(vehicle.wind.shaping_filter, float(vehicle.tables["altitude"].polynomial(vehicle.start)))


def _executable(usual: Study, vehicle: Vehicle, system: LinearSystem) -> ExecutableSystem:
    """Return a system with the code of the shipped vehicle, if it is made of the same; else interpreted."""
    assert usual.vehicle is not None
    old = usual.system
    made_of = ("structure", "state_names", "noise_names", "output_names", "parameter_names", "outputs")
    if any(getattr(system, name) != getattr(old, name) for name in made_of):
        return executable_system(system, compile=False)
    same = np.array_equal(_start_covariance(vehicle), _start_covariance(usual.vehicle)) and all(
        getattr(system, name) == getattr(old, name) for name in ("start", "end", "discontinuities")
    )
    return replace(
        usual.executable,
        system=old if same else system,
        groups=system.tables,
        parameters=np.array([p.value for p in system.parameters]),
    )


def _vehicle(work: Path, kind: str, random: Random) -> tuple[Mutation, float]:
    name = random.choice(sorted(built_in_vehicles()))
    folder = work / name
    shutil.copytree(built_in_vehicles()[name], folder)
    named = re.findall(r'file = "([\w/.]+\.csv)"', (folder / "vehicle.toml").read_text())
    file = "vehicle.toml" if random.random() < 0.4 else random.choice(named)
    return _spoiled_vehicle(name, folder, file, kind, random)


def _filter(work: Path, kind: str, random: Random) -> tuple[Mutation, float]:
    name = random.choice(sorted(built_in_vehicles()))
    folder = work / name
    shutil.copytree(built_in_vehicles()[name], folder)
    file = tomllib.loads((folder / "vehicle.toml").read_text())["wind"]["filter"]
    return _spoiled_vehicle(name, folder, file, kind, random)


def _spoiled_vehicle(name: str, folder: Path, file: str, kind: str, random: Random) -> tuple[Mutation, float]:
    mutation = mutate(folder, file, kind, random)
    if mutation is None:
        return _none(kind)
    with _marked(mutation):
        return mutation, _difference(name, folder)


def _construction(work: Path, kind: str, random: Random) -> tuple[Mutation, float]:
    folder = work / "falcon1"
    shutil.copytree(built_in_vehicles()["falcon1"], folder)
    files = [
        "construction.toml",
        *(str(p.relative_to(folder)) for p in sorted((folder / "construction").glob("*.csv"))),
    ]
    mutation = mutate(folder, random.choice([files[0], *files]), kind, random)
    if mutation is None:
        return _none(kind)
    with _marked(mutation):
        build_vehicle(folder, work / "built", spacing=SPACING)
        return mutation, max(_apart(work / "built" / name, table) for name, table in _built().items())


def _apart(file: Path, usual: NDArray[np.float64]) -> float:
    """Return the largest difference of a table from the usual one, relative to its columns; 1 for another shape."""
    found = _numbers(file)
    if found.shape != usual.shape:
        return 1.0
    size = np.abs(usual).max(axis=0)
    return float(np.max(np.abs(found - usual) / np.where(size > 0, size, 1.0)))


def _numbers(file: Path) -> NDArray[np.float64]:
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])


@cache
def _built() -> dict[str, NDArray[np.float64]]:
    """Return the tables that the shipped construction makes."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "falcon1"
        shutil.copytree(built_in_vehicles()["falcon1"], folder)
        _, written = build_vehicle(folder, Path(work) / "built", spacing=SPACING)
        return {path.name: _numbers(path) for path in written}


def _loaded(vehicle: str | Path, **options: Any) -> Study:
    """Return a shipped vehicle, loaded once, or another one."""
    shipped = str(vehicle) in built_in_vehicles() and not any(options.values())
    return _usual(str(vehicle))[0] if shipped else LOAD(vehicle, **options)


@cache
def _usual_plan() -> ParameterStudyPlan:
    return read_plan(PLAN)


def _plan(work: Path, kind: str, random: Random) -> tuple[Mutation, float]:
    shutil.copy(PLAN, work / "plan.toml")
    mutation = mutate(work, "plan.toml", kind, random)
    if mutation is None:
        return _none(kind)
    with _marked(mutation):
        plan = read_plan(work / "plan.toml")
        values = member_values(plan, resolve_quantities(_loaded(str(plan.vehicle)), plan))
        if not np.isfinite(values).all():
            return mutation, np.inf
        return mutation, 0.0 if plan == _usual_plan() else 1.0


def _design(work: Path, kind: str, random: Random) -> tuple[Mutation, float]:
    text = (built_in_vehicles()["as504"] / DESIGN).read_text()
    (work / DESIGN).write_text(text.replace("format = 1", 'format = 1\nvehicle = "as504"'))
    mutation = mutate(work, DESIGN, kind, random)
    if mutation is None:
        return _none(kind)
    with _marked(mutation):
        with mock.patch.object(Study, "load", _loaded):
            load_design(work / DESIGN)
        return mutation, 1.0


def _system(work: Path, kind: str, random: Random) -> tuple[Mutation, float]:
    mutation, define = mutated_system(kind, random)
    with _marked(mutation):
        study = Study.from_system(define(), compile=False)
        start = study.system.start
        found = study.response_statistics([start + 1.0], engine="covariance")
        again = study.response_statistics([start + 1.0], engine="cvodes")
        values = [found.std.values, again.std.values, found.mean.values[..., 0], again.mean.values[..., 0]]
        if not all(np.isfinite(v).all() for v in values):
            return mutation, np.inf
        size = max(float(np.abs(values[1]).max()), 1e-300)
        apart = float(np.abs(values[0] - values[1]).max()) / size
        if apart > 1e-3:
            raise AssertionError(f"covariance and CVODES differ by {apart:.1g}: {values[0]} and {values[1]}")
        return mutation, 1.0


_RUN = {
    "vehicle": _vehicle,
    "construction": _construction,
    "filter": _filter,
    "plan": _plan,
    "design": _design,
    "system": _system,
}


def main() -> None:
    """Run the seeds from the first argument up to, not including, the second."""
    first, last = map(int, sys.argv[1:3])
    for name in built_in_vehicles():
        _usual(name)
    _built()
    print(json.dumps({"ready": True}), flush=True)
    for seed in range(first, last):
        print(run_case(seed).line(), flush=True)


if __name__ == "__main__":
    main()
