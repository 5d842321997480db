"""Generated C: equal to the interpreter, the same bytes everywhere, cached safely, optional."""

from __future__ import annotations

import logging
import os
import stat
import subprocess
import sys
import warnings

import casadi as ca
import numpy as np
import pytest

from ascentwind.codegen.system import executable as compiled_module
from ascentwind.codegen.system.executable import difference_from_core, executable_system
from ascentwind.codegen.system.functions import core_functions
from ascentwind.codegen.system.source import c_source
from ascentwind.codegen.toolchain import library as library_module
from ascentwind.codegen.toolchain.c_printer import UnsupportedOperationError, c_function
from ascentwind.codegen.toolchain.cache import CacheError, CacheWarning, CompiledLibrary, cache_folder, describe_changes
from ascentwind.codegen.toolchain.compiler import CompilerError, find_compiler
from ascentwind.codegen.toolchain.library import InterpreterWarning
from ascentwind.model import LinearSystem, define_system
from ascentwind.model.deprecation import warn_deprecated
from ascentwind.model.errors import DeprecatedNameWarning
from ascentwind.runners import Study


def lag(name: str = "lag", gain: float = 1.0):
    t, x, n, k = (ca.SX.sym(s) for s in ("t", "x", "n", "k"))
    return define_system(
        name, time=t, states={"x": (x, -k * x + n)}, noises={"n": n}, outputs={"x": x}, parameters={"k": (k, gain)}
    )


def loaded(system: LinearSystem) -> CompiledLibrary:
    library = executable_system(system).shared_library
    assert library is not None
    return library


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("ASCENTWIND_CACHE", str(folder))
    monkeypatch.setattr(library_module, "_said_once", set())
    return folder


def test_compiled_functions_equal_the_interpreter(as504):
    """All functions at 20 random points against CasADi on tables looked up by NumPy."""
    assert as504.executable.code == "compiled"
    assert difference_from_core(as504.with_means, points=20, seed=1) <= 1e-12


def test_interpreted_splines_equal_the_lookup(as504):
    """The interpreter's Bernstein splines against NumPy's Horner scheme."""
    interpreted = executable_system(as504.system, compile=False)
    assert difference_from_core(interpreted, points=20, seed=2) <= 1e-12


def test_jacobian_for_the_implicit_method_is_the_derivative(as504):
    """jac_adjoint and jac_mean, which CVODES uses, against differences of the linear integrands."""
    executable = as504.with_means
    assert executable.shared_library is not None
    path = str(executable.shared_library.path)
    parameters = executable.integrator_parameters(80.0, 20.0, 10.0, 105.0)
    for name in ("adjoint", "mean"):
        f, jac = ca.external(name, path), ca.external(f"jac_{name}", path)
        n = f.size1_in(1)
        J = jac(0.3, np.zeros(n), [], parameters, [], *[ca.DM(*f.size_out(i)) for i in range(4)])[1].full()
        at_zero = f(0.3, np.zeros(n), [], parameters, [])[0].full()
        columns = [f(0.3, e, [], parameters, [])[0].full() - at_zero for e in np.eye(n)]
        np.testing.assert_allclose(J, np.hstack(columns), atol=1e-11 * np.abs(J).max())


@pytest.mark.slow
def test_the_same_bytes_from_two_processes():
    code = (
        "from ascentwind.runners import Study; from ascentwind.runners.cli.regenerate import generated_files;"
        "import hashlib; s = Study.load('as504', compile=False).system;"
        "print(hashlib.sha256(''.join(generated_files(s).values()).encode()).hexdigest())"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True,
            env=os.environ | {"PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(found) == 1


def test_source_holds_structure_only(as504, edit):
    """Other table values, gains, dampings and noise levels give the same C; another structure does not."""
    source = c_source(as504.system, core_functions(as504.system))
    edit("damping = 0.005 ", "damping = 0.007 ")
    edit("sigma = 0.01", "sigma = 0.02")
    folder = edit("0,1,1", "0,0.8,0.9", "control_gains.csv")
    changed = Study.load(folder, compile=False)
    assert c_source(changed.system, core_functions(changed.system)) == source
    folder = edit("full_coupling = false", "full_coupling = true")
    coupled = Study.load(folder, compile=False)
    assert c_source(coupled.system, core_functions(coupled.system)) != source
    assert describe_changes(dict(as504.system.structure), dict(coupled.system.structure)) == [
        "full coupling: false -> true"
    ]


def test_second_load_takes_the_library_from_the_cache(own_cache):
    first, second = loaded(lag()), loaded(lag(gain=3.0))
    assert first.fresh
    assert not second.fresh
    assert first.path == second.path
    assert stat.S_IMODE(own_cache.stat().st_mode) == 0o700


def test_regeneration_says_what_changed(own_cache, caplog):
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    executable_system(lag("grows"))
    more = define_system("grows", time=t, states={"x": (x, -x + n)}, noises={"n": n}, outputs={"x": x, "twice": 2 * x})
    with caplog.at_level(logging.INFO):
        executable_system(more)
    assert "grows: compiling again because outputs: x -> x, twice" in caplog.text


def test_damaged_library_is_set_aside_and_made_again(own_cache):
    library = loaded(lag())
    whole = library.path.read_bytes()
    library.path.unlink()  # a file that this process has mapped must not shrink under it
    library.path.write_bytes(whole[:-100])
    with pytest.warns(CacheWarning, match="is damaged"):
        again = executable_system(lag())
    assert again.shared_library is not None and again.shared_library.fresh
    assert list(own_cache.glob("*.damaged-*"))
    assert difference_from_core(again) <= 1e-12


def test_library_with_wrong_numbers_is_not_used(own_cache, monkeypatch):
    monkeypatch.setattr(compiled_module, "difference_from_core", lambda _: 1e-3)
    with pytest.warns(InterpreterWarning, match="differs from the interpreter"):
        found = executable_system(lag())
    assert found.code == "interpreter"
    assert list(own_cache.glob("*.wrong-*"))


def test_without_a_compiler_the_interpreter_is_used_and_said_once(own_cache, monkeypatch):
    monkeypatch.setenv("CC", "")
    with pytest.warns(InterpreterWarning, match="no C compiler"):
        first = executable_system(lag())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        executable_system(lag())
    assert first.code == "interpreter"
    assert Study(first).response_statistics([1.0]).variance.values[0, 0, 0] == pytest.approx(
        0.5 * (1 - np.exp(-2.0)), rel=1e-6
    )


def test_failing_compiler_shows_command_and_text(own_cache, monkeypatch, tmp_path):
    script = tmp_path / "badcc"
    script.write_text(
        "#!/bin/sh\n[ \"$1\" = --version ] && echo badcc 1 && exit\necho 'fatal: no such option' >&2\nexit 3\n"
    )
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    with pytest.raises(CompilerError, match=r"code 3: .*badcc.*\n?.*fatal: no such option"):
        executable_system(lag())
    assert not list(own_cache.glob("*.so"))
    monkeypatch.setenv("CC", "no-such-compiler-anywhere")
    with pytest.raises(CompilerError, match="there is no such program"):
        find_compiler()


def test_cache_that_others_can_write_is_refused(own_cache):
    own_cache.mkdir()
    own_cache.chmod(0o777)
    with pytest.raises(CacheError, match="chmod 700"):
        cache_folder()
    with pytest.warns(InterpreterWarning, match="compiled code is not used"):
        assert executable_system(lag()).code == "interpreter"


def test_operations_without_a_c_form_are_refused():
    x = ca.SX.sym("x")
    function = ca.Function("f", [x], [ca.erfinv(x)])
    with pytest.raises(UnsupportedOperationError, match="no C form"):
        c_function("f", function, ("x",), ("y",), {})


def test_written_operations_mean_what_casadi_means(own_cache):
    """Every elementary operation, compiled against interpreted."""
    t, x, n, k = (ca.SX.sym(s) for s in ("t", "x", "n", "k"))
    elementary = [ca.sin(t), ca.cos(k), ca.tan(k), ca.exp(-t), ca.log(2 + t), ca.sqrt(1 + t), ca.tanh(k), ca.erf(k)]
    compared = [ca.fmin(t, 3), ca.fmax(t, 3), ca.if_else(t < 40, 2.0, k), ca.sign(k - t), ca.logic_and(t > 1, k > 0)]
    powers = [ca.power(k, 3), ca.power(1 + t, k), 1 / (1 + t), -k, 2 * k, ca.atan2(k, 1 + t)]
    rounded = [ca.fabs(t - 50), ca.floor(t), ca.fmod(t, 7)]
    terms = elementary + compared + powers + rounded
    system = define_system(
        "operations", time=t, states={"x": (x, sum(terms) * x + n)}, noises={"n": n},
        outputs={f"y{i}": term * x for i, term in enumerate(terms)}, parameters={"k": (k, 0.7)},
    )  # fmt: skip
    found = executable_system(system)
    assert found.code == "compiled"
    assert difference_from_core(found, points=40) <= 1e-12


def test_the_old_name_of_what_evaluates_warns_once(cache):
    warn_deprecated.cache_clear()
    executable = executable_system(lag(), compile=False)
    with pytest.warns(DeprecatedNameWarning, match=r"executable\.engine goes .* use executable\.code$"):
        assert executable.engine == "interpreter"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert executable.engine == executable.code
