"""The life of generated libraries: made once for a system and all its numbers, from any number of threads; calls."""

from __future__ import annotations

import ast
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lag import closed_form, lag

import ascentwind
from ascentwind.codegen.ensemble.compiled import EnsembleNeedsCompilerError, ensemble_of, ensemble_recipe
from ascentwind.codegen.nodes.compiled import node_functions_of
from ascentwind.codegen.sweep.compiled import compiled_sweep, sweep_of, sweep_recipe
from ascentwind.codegen.sweep.source import sweep_functions
from ascentwind.codegen.system.executable import executable_system, system_recipe
from ascentwind.codegen.toolchain import library as library_module
from ascentwind.codegen.toolchain.cache import CacheError
from ascentwind.codegen.toolchain.compiler import Compiler, CompilerError, find_compiler, run_program
from ascentwind.codegen.toolchain.library import (
    InterpreterWarning,
    Libraries,
    NoCompilerError,
    Recipe,
    compile_together,
)
from ascentwind.runners import Study
from ascentwind.runners.solvers.sweep import batch

THREADS = 8
PARTS = pytest.mark.parametrize("part_of", [sweep_of, node_functions_of, ensemble_of])


@pytest.fixture
def own_cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("ASCENTWIND_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(library_module, "_said_once", set())
    return tmp_path / "cache"


@PARTS
def test_threads_that_ask_at_once_get_the_same_library_compiled_once(own_cache, monkeypatch, part_of):
    study, compiled, compile_one = lag(), [], Compiler.compile

    def counted(compiler: Compiler, source: Path, library: Path) -> None:
        compiled.append(library)
        time.sleep(0.1)  # long enough for all to arrive
        compile_one(compiler, source, library)

    monkeypatch.setattr(Compiler, "compile", counted)
    together = threading.Barrier(THREADS)

    def ask(_: int) -> object:
        together.wait()
        return part_of(study.with_parameters({"gain": 2.0}).executable)

    with ThreadPoolExecutor(THREADS) as pool:
        found = list(pool.map(ask, range(THREADS)))
    assert all(one is found[0] for one in found)
    assert found[0] is part_of(study.executable)
    assert len(compiled) == 1


def test_parts_do_not_wait_for_each_other():
    libraries, begun, done = Libraries(), threading.Event(), threading.Event()

    def slow() -> str:
        begun.set()
        assert done.wait(10.0)
        return "slow"

    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(libraries.held, "slow", slow)
        assert begun.wait(10.0)
        assert libraries.held("quick", lambda: "quick") == "quick"
        done.set()
        assert waiting.result() == "slow"


def test_an_error_is_not_kept(own_cache, monkeypatch):
    study = lag()
    with monkeypatch.context() as patch:
        patch.setattr(Compiler, "compile", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
        with pytest.raises(CacheError, match="No space left"):
            sweep_of(study.executable)
    std = study.response_statistics([3.0], engine="sweep").std.values[0, 0, 0]
    assert std == pytest.approx(closed_form(3.0)[1], rel=1e-6)


def test_what_must_be_compiled_says_what_to_do_without(own_cache, monkeypatch):
    interpreted = Study.from_system(lag().system, compile=False)
    with pytest.raises(NoCompilerError, match=r"loaded with compile=False, and the sweep .*engine='cvodes'"):
        sweep_of(interpreted.executable)
    with pytest.raises(EnsembleNeedsCompilerError, match=r"compile=False, and the ensemble .*another engine"):
        ensemble_of(interpreted.executable)
    assert node_functions_of(interpreted.executable).shared_library is None
    monkeypatch.setenv("CC", "")
    with pytest.raises(NoCompilerError, match=r"the sweep is compiled .* no C compiler .*engine='cvodes'"):
        compiled_sweep(interpreted.system)


def test_a_library_that_is_not_a_number_is_wrong(own_cache):
    """A difference that cannot be told is no agreement, whether the library is wanted or required."""
    recipe = replace(ensemble_recipe(lag().system), difference=lambda _: np.nan)
    with pytest.warns(InterpreterWarning, match="differs from the interpreter by nan"):
        assert recipe.load(True) is None
    with pytest.raises(CacheError, match=r"differs from the interpreter by nan .* set aside; run the same again"):
        recipe.require(True)
    assert len(list(own_cache.glob("*.wrong-*"))) == 1  # of this process; the second took the place of the first


def test_arrays_with_gaps_are_not_passed_by_address():
    library = ensemble_of(lag().executable).shared_library
    with pytest.raises(ValueError, match=r"shape \(3,\) has gaps"):
        library.call_to_the_end("standard_normals", np.uint64(1), *map(np.uint32, (0, 0, 0)), 1, np.zeros(6)[::2])


@pytest.mark.parametrize("order", ["C", "F"])
def test_parameter_sets_of_any_memory_order_are_read(order):
    """Rows of a Fortran array have gaps; read by address they would be other numbers."""
    study = lag()
    sets = np.array([[1.0, 2.0, 0.5], [3.0, 0.1, 2.0], [0.7, 4.0, 1.0]], order=order)
    found = batch(sweep_of(study.executable), study.executable, sets, [1.0, 3.0], relative_tolerance=1e-8)
    for member, (tau, gain, level) in zip(found, sets, strict=True):
        mean, std = closed_form(np.array([1.0, 3.0]), tau, gain, level)
        np.testing.assert_allclose(member.mean[:, 0], mean, rtol=1e-7)
        np.testing.assert_allclose(np.sqrt(member.variance[:, 0, 0]), std, rtol=1e-7)


@pytest.mark.parametrize(("module", "home"), [("ctypes", "library.py"), ("jinja2", "templates.py")])
def test_one_file_of_codegen_and_solvers_imports(module, home):
    package = Path(ascentwind.__file__).parent
    files = [f for room in ("model", "codegen", "runners/solvers") for f in (package / room).rglob("*.py")]
    found = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
            if any(name.split(".")[0] == module for name in names):
                found.add(file.name)
    assert found == {home}


def two_recipes() -> tuple[Recipe, Callable[[], list[Recipe]]]:
    """Return how the libraries of a system itself and of its sweep are made."""
    system = lag(compile=False).system
    first = system_recipe(executable_system(system, compile=False))
    return first, lambda: [sweep_recipe(system, sweep_functions(system))]


def test_libraries_are_compiled_at_the_same_time(own_cache, monkeypatch):
    compile_one, together = Compiler.compile, threading.Barrier(2, timeout=60)

    def meeting(compiler: Compiler, source: Path, library: Path) -> None:
        together.wait()  # breaks where one is compiled after the other
        compile_one(compiler, source, library)

    monkeypatch.setattr(Compiler, "compile", meeting)
    first, others = two_recipes()
    compile_together(first, others)
    compiler = find_compiler()
    assert compiler is not None
    assert [recipe.is_compiled(compiler) for recipe in (first, *others())] == [True, True]
    assert len(list(own_cache.glob("*.so"))) == 2
    compile_together(first, lambda: pytest.fail("the first is there, and so nobody asks for the others"))


def test_the_first_compiler_that_fails_stops_the_others_and_leaves_nothing(own_cache, tmp_path, monkeypatch):
    begun, survived = threading.Event(), tmp_path / "survived"

    def failing(compiler: Compiler, source: Path, library: Path) -> None:
        if "sweep" in library.parent.name:
            begun.set()
            run_program(["sh", "-c", f"sleep 20; touch '{survived}'"])
        begun.wait(60)
        raise CompilerError(["cc"], 1, "the first that fails")

    monkeypatch.setattr(Compiler, "compile", failing)
    with pytest.raises(CompilerError, match="the first that fails"):
        compile_together(*two_recipes())
    assert not survived.exists()
    assert {path.suffix for path in own_cache.iterdir()} <= {".lock", ".json"}


def test_a_full_cache_is_left_to_who_asks_for_a_library(own_cache, monkeypatch):
    def full(*_: object) -> None:
        raise CompilerError(["cc"], 1, "No space left on device")

    monkeypatch.setattr(Compiler, "compile", full)
    compile_together(*two_recipes())
    with pytest.warns(InterpreterWarning, match="disk"):
        assert lag().executable.shared_library is None
