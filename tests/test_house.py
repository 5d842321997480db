"""The rule of arrows: which room may import which, type imports included; no circles; no underscore names of others."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest

import ascentwind

PACKAGE = Path(ascentwind.__file__).parent
# from the ground up; a room imports only from floors below its own, and from its own room
FLOORS = (
    ("model",),
    ("codegen",),
    ("runners.solvers",),
    ("runners.case", "runners.wind", "runners.construct"),
    ("runners.statistics",),
    ("runners.sensitivity", "runners.station_loads", "runners.export"),
    ("runners.flight_load", "runners.gusts"),
    ("runners.design_wind",),
    ("runners.measured_winds",),
    ("runners.study",),
    ("runners.design", "runners.parameter_study", "runners.views"),
    ("runners.report", "runners.figures"),
    ("runners.reproduction",),
    ("runners.cli",),
)
PRESENT = "runners.present"  # serves all runners and knows only model
MODULES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts): path
    for top in ("model", "codegen", "runners")
    for path in sorted((PACKAGE / top).rglob("*.py"))
    if path.name != "__init__.py"
}


def imported(module: str) -> dict[str, set[str]]:
    """Return the modules that a module imports, with the names it takes of each."""
    found: dict[str, set[str]] = {}
    for node in ast.walk(ast.parse(MODULES[module].read_text())):
        if not isinstance(node, ast.ImportFrom):
            continue
        if node.level:
            base = [*module.split(".")[: -node.level], *(node.module.split(".") if node.module else [])]
        elif node.module and node.module.startswith("ascentwind."):
            base = node.module.split(".")[1:]
        else:
            continue
        for alias in node.names:
            whole = ".".join([*base, alias.name])
            target = whole if whole in MODULES else ".".join(base)
            if target in MODULES and target != module:
                found.setdefault(target, set()).add(alias.name)
    return found


IMPORTS = {module: imported(module) for module in MODULES}


def floor(module: str) -> tuple[int, str]:
    for level, rooms in enumerate(FLOORS):
        for room in rooms:
            if module == room or module.startswith(room + "."):
                return level, room
    raise AssertionError(f"{module} lies in no room of the plan; give it one, or the plan a room")


def room(module: str) -> str:
    return module if module == "runners.study" else module.rpartition(".")[0]


@pytest.mark.parametrize("module", [m for m in MODULES if not m.startswith(PRESENT)])
def test_arrows_point_down(module):
    level, mine = floor(module)
    for target in IMPORTS[module]:
        if target.startswith(PRESENT):
            assert module.startswith("runners."), f"{module} is no runner and imports {target}"
            continue
        lower, other = floor(target)
        assert other == mine or lower < level, f"{module} imports {target}, which lies on its floor or above"


def test_present_knows_only_model():
    for module in MODULES:
        if module.startswith(PRESENT):
            for target in IMPORTS[module]:
                assert target.startswith((PRESENT, "model.")), f"{module} imports {target}"


def circle(edges: dict[str, set[str]]) -> list[str]:
    """Return one circle of a graph, empty where there is none."""
    state: dict[str, int] = {}
    path: list[str] = []

    def go(node: str) -> list[str]:
        state[node] = 1
        path.append(node)
        for following in sorted(edges.get(node, ())):
            if state.get(following) == 1:
                return [*path[path.index(following) :], following]
            if following not in state and (found := go(following)):
                return found
        state[node] = 2
        path.pop()
        return []

    for node in sorted(edges):
        if node not in state and (found := go(node)):
            return found
    return []


def test_no_circle_of_files():
    assert circle({m: set(targets) for m, targets in IMPORTS.items()}) == []


def test_no_circle_of_rooms():
    edges: dict[str, set[str]] = {}
    for module, targets in IMPORTS.items():
        edges.setdefault(room(module), set()).update(room(t) for t in targets if room(t) != room(module))
    assert circle(edges) == []


def test_circles_are_found():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]


def test_nobody_takes_underscore_names_of_another_file():
    taken = [
        f"{module} takes {name} of {target}"
        for module, targets in IMPORTS.items()
        for target, names in targets.items()
        for name in names
        if name.startswith("_") and room(module) != room(target)
    ]
    assert taken == []


def test_runners_are_rooms():
    flat = [p.name for p in (PACKAGE / "runners").glob("*.py")]
    assert sorted(flat) == ["__init__.py", "study.py"]


def test_files_of_tests_have_names_of_their_own():
    """pytest imports them by their bare names."""
    names = Counter(file.name for file in Path(__file__).parent.rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


def test_tests_take_what_they_share_by_its_bare_name():
    """Beside an installed package `tests` is no importable name; pytest's own path holds tests/support."""
    tests = Path(__file__).parent
    wrong = [
        f"{file.relative_to(tests)}:{node.lineno}"
        for file in tests.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "tests"
    ]
    assert wrong == []


def test_rooms_say_what_they_are():
    unsaid = []
    for folder in {path.parent for path in MODULES.values()}:
        init = folder / "__init__.py"
        if not init.is_file() or ast.get_docstring(ast.parse(init.read_text())) is None:
            unsaid.append(folder.relative_to(PACKAGE).as_posix())
    assert unsaid == []


def test_no_room_is_named_in_a_file_name():
    crowded = []
    for folder in {p.parent for p in MODULES.values()}:
        prefixes = [p.stem.split("_")[0] for p in folder.glob("*.py") if "_" in p.stem and p.stem != "__init__"]
        crowded += [f"{folder.name}/{x}_*" for x in set(prefixes) if prefixes.count(x) > 2]
    assert crowded == []
