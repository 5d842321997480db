"""Names, units and start covariances of a user's own system: refused with a sentence, or harmless in C and in paths."""

from __future__ import annotations

import ctypes
import pickle
import subprocess
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ascentwind.codegen.sweep.source import sweep_functions, sweep_source
from ascentwind.codegen.system.functions import core_functions
from ascentwind.codegen.system.source import c_source
from ascentwind.codegen.toolchain.c_printer import enumerators
from ascentwind.codegen.toolchain.compiler import find_compiler
from ascentwind.codegen.toolchain.templates import comment
from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import (
    NonlinearSystemError,
    NotPicklableError,
    SystemDefinitionError,
    TimeRangeError,
    UnknownNameError,
)
from ascentwind.model.system.names import file_name
from ascentwind.runners import Study

TAU = 2.0


def lag(names=("x", "gust", "y", "tau"), **changes) -> LinearSystem:
    """x' = -x/tau + n, y = x: variance tau/2 (1 - exp(-2 t/tau)) + P0 exp(-2 t/tau)."""
    state, noise, output, parameter = names
    x, n, tau = (ca.SX.sym(s) for s in ("x", "n", "tau"))
    given = {
        "time": ca.SX.sym("t"),
        "states": {state: (x, -x / tau + n)},
        "noises": {noise: n},
        "outputs": {output: x},
        "parameters": {parameter: (tau, TAU)},
        "end": 10.0,
    }
    return define_system(changes.pop("name", "lag"), **(given | changes))


def variance(time: float, start: float = 0.0) -> float:
    """Return the lag's."""
    return TAU / 2 * (1 - np.exp(-2 * time / TAU)) + start * np.exp(-2 * time / TAU)


PLANTED = "__attribute__((constructor)) static void planted(void) { *(volatile int *)0 = 1; }"


@pytest.mark.parametrize(
    "text",
    [
        f"*/ {PLANTED} /*",
        f"*\\/ {PLANTED} /*",
        f"*??/ {PLANTED}",
        f"**// {PLANTED} //**",
        '"; #include "/etc/passwd"',
        "{{ 7 * 7 }} {% raw %}",
        "../../../../tmp/elsewhere",
        "α β σ",
    ],
)
@pytest.mark.skipif(find_compiler() is None, reason="compiles")
@pytest.mark.slow
def test_text_of_a_user_stays_in_its_comment(text, tmp_path, monkeypatch):
    """Names, units and the system's name hold C; the libraries compile, load, and answer as the plain system does."""
    cache = tmp_path / "inside" / "cache"
    monkeypatch.setenv("ASCENTWIND_CACHE", str(cache))
    system = lag(tuple(f"{k} {text}" for k in "snop"), name=f"n {text}", units={f"s {text}": f"u {text}"})
    statistics = Study.from_system(system).response_statistics([1.0])
    assert statistics.attrs["engine"] == "sweep"
    assert statistics.variance.values[0, 0, 0] == pytest.approx(variance(1.0), rel=1e-5)
    assert {path.parent for path in tmp_path.rglob("*.so")} == {cache}
    sources = (c_source(system, core_functions(system)), sweep_source(system, sweep_functions(system)))
    for source in sources:
        assert "(constructor)" not in _without_comments(source)


def _without_comments(source: str) -> str:
    compiler = find_compiler()
    assert compiler is not None
    command = [*compiler.command, "-std=c99", "-fpreprocessed", "-dD", "-E", "-P", "-x", "c", "-"]
    return subprocess.run(command, input=source, capture_output=True, text=True, check=True).stdout


@given(st.text(alphabet="*/\\?\n\r/ax\u2028", max_size=12))
def test_comment_never_ends_inside(text):
    told = comment(text)
    assert not any(stop in told for stop in ("*/", "/*", "\\", "??/", "\n", "\r", "\u2028"))


@given(st.lists(st.text(alphabet="ab._αβ 1", min_size=1, max_size=4), unique=True, max_size=12))
def test_enumerators_are_identifiers_and_differ(names):
    found = enumerators("P", names)
    assert len(set(found)) == len(names)
    assert all(name.isidentifier() and name.isascii() for name in found)


def test_names_that_look_alike_in_c_keep_apart(cache):
    """Parameters 'a.b' and 'a_b', 'α' and 'β': x' = -(a.b) x + (a_b) n + (α) u, y = (β) x."""
    x, n, u = (ca.SX.sym(s) for s in ("x", "n", "u"))
    p = {name: ca.SX.sym("p") for name in ("a.b", "a_b", "α", "β")}
    system = define_system(
        "alike",
        time=ca.SX.sym("t"),
        states={"x": (x, -p["a.b"] * x + p["a_b"] * n + p["α"] * u)},
        noises={"n": n},
        inputs={"u": (u, 1.0)},
        outputs={"y": p["β"] * x},
        parameters={name: (p[name], value) for name, value in zip(p, (0.5, 2.0, 3.0, 5.0), strict=True)},
    )
    found = Study.from_system(system).response_statistics([1.0])
    assert found.variance.values[0, 0, 0] == pytest.approx(25 * 4 * (1 - np.exp(-1.0)), rel=1e-5)
    assert found.mean.values[0, 0, 0] == pytest.approx(5 * 3 * (1 - np.exp(-0.5)) / 0.5, rel=1e-5)


@given(st.text(max_size=120))
def test_file_names_stay_in_their_folder(name):
    found = file_name(name)
    assert found and len(found) < 100 and found.isascii() and not set(found) & set('/\\:*?"<>|. \0')


def test_file_names_of_different_names_differ():
    assert len({file_name(name) for name in ("α", "β", "a/b", "a_b", "a b", "a.b")}) == 6
    assert file_name("bending_moment") == "bending_moment"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": ""}, "name of a system is empty"),
        ({"name": "a\nb"}, "name of a system 'a.nb' holds a line break"),
        ({"name": 7}, "name of a system is int 7, not text"),
        ({"name": "x" * 5000}, "has 5000 characters, more than 200"),
        ({"names": ("x\0", "n", "y", "p")}, "name of a state 'x.x00' holds a line break"),
        ({"names": (" x", "n", "y", "p")}, "space at an end"),
        ({"names": ("x", "combined", "y", "p")}, "noise source cannot be called 'combined'.*rename"),
        ({"sources": {"gust": "combined"}}, "noise source cannot be called 'combined'"),
        ({"units": {"x": "m\n*/"}}, "unit of state 'x'"),
        ({"units": {"x": 3}}, "unit of state 'x' is int 3"),
        ({"scales": {"x": 0.0}}, "scale of state 'x' is 0"),
        ({"scales": {"x": -1.0}}, "scale of state 'x' is -1"),
        ({"scales": {"x": float("nan")}}, "scale of state 'x' is nan"),
        ({"scales": {"x": "big"}}, "scale of state 'x' is 'big'"),
        ({"start": float("nan")}, "time 'start' is nan"),
        ({"end": "later"}, "time 'end' is 'later'"),
        ({"states": {}, "outputs": {"y": ca.SX.sym("t")}}, "has no states"),
        ({"outputs": {}}, "has no outputs"),
        ({"time": 0.0}, "time 't' is float 0.0, not a symbol"),
        ({"time": ca.MX.sym("t")}, "time 't' is an MX expression"),
        ({"noises": {"gust": 2 * ca.SX.sym("n")}}, r"noise 'gust' is the expression \(+2.\*n\)+, not a symbol"),
        ({"noises": {"gust": ca.MX.sym("n")}}, "noise 'gust' is an MX expression; write the system with casadi.SX"),
        ({"noises": {"gust": ca.SX.sym("n", 2)}}, "noise 'gust' has 2 entries"),
        ({"noises": {"gust": "n"}}, "noise 'gust' is str 'n', not a symbol"),
        ({"states": {"x": ca.SX.sym("x")}}, r"state 'x' is SX .*; give \(symbol, derivative\)"),
        ({"states": {"x": (ca.SX.sym("x"), [1.0, 2.0])}}, "derivative of state 'x' is list"),
        ({"states": {"x": (ca.SX.sym("x"), None)}}, "derivative of state 'x' is NoneType"),
        ({"states": {"x": (ca.SX.sym("x"), True)}}, "derivative of state 'x' is bool"),
        ({"states": {"x": (ca.SX.sym("x"), ca.MX.sym("x"))}}, "derivative of state 'x' is an MX"),
        ({"outputs": {"y": ca.SX.sym("y", 3)}}, "output 'y' has 3 entries"),
        ({"parameters": {"tau": 2.0}}, r"parameter 'tau' is float 2.0; give \(symbol, number\)"),
        ({"parameters": {"tau": (ca.SX.sym("a"), float("nan"))}}, "parameter 'tau' is nan"),
        ({"parameters": {"tau": (ca.SX.sym("a"), "2")}}, "parameter 'tau' is '2'; give a finite number"),
        ({"parameters": {"tau": (ca.SX.sym("a"), 10**400)}}, "parameter 'tau' is 10+.*; give a finite number"),
        ({"start": 10**400}, "'start' is 10+"),
        ({"end": -(10**400)}, "'end' is -10+"),
        ({"parameters": {"tau": (ca.SX.sym("a"), [2.0])}}, r"parameter 'tau' is \[2.0\]"),
        ({"parameters": {"tau": (ca.SX.sym("a"), True)}}, "parameter 'tau' is True"),
    ],
)
def test_what_a_system_cannot_be_made_of_is_said_by_name(changes, message):
    with pytest.raises(SystemDefinitionError, match=message) as caught:
        lag(**changes)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"units": {"xx": "m"}}, "no state, output, parameter or table 'xx'; did you mean 'x'"),
        ({"units": {"tua": "s"}}, "did you mean 'tau'"),
        ({"units": {"gust": "m"}}, "no state, output, parameter or table 'gust'"),
        ({"scales": {"Y": 1.0}}, "no state or output 'Y'"),
        ({"scales": {"tau": 1.0}}, "no state or output 'tau'"),
        ({"sources": {"gsut": "wind"}}, "no noise 'gsut'; did you mean 'gust'"),
        ({"start_covariance": {"gusts": [[1.0]]}}, "no noise source 'gusts'; did you mean 'gust'"),
        ({"start_covariance": {"gust": [[1.0]]}, "sources": {"gust": "wind"}}, "no noise source 'gust'"),
    ],
)
def test_misspelt_names_are_refused_with_the_nearest(changes, message):
    with pytest.raises(UnknownNameError, match=message):
        lag(**changes)


KINDS = (
    True, 5.0, "x", [1.0], (1, 2), object(), 1 + 2j, {1: 2}, range(3), lambda: 1, np.zeros((2, 2)), {2.0}, iter([2.0]),
    ca.SX.sym("q"), ca.MX.sym("q"), ca.DM([1.0, 2.0]),
)  # fmt: skip


@pytest.mark.parametrize("value", KINDS, ids=lambda v: type(v).__name__)
@pytest.mark.parametrize(
    "key", ["states", "noises", "outputs", "parameters", "inputs", "sources", "units", "scales", "start_covariance"]
)
def test_what_is_no_mapping_by_name_is_refused(key, value):
    with pytest.raises(SystemDefinitionError, match=rf"{key}: .*(is no mapping|names are text)"):
        lag(**{key: value})


@pytest.mark.parametrize("value", [5.0, True, None, object(), ca.SX.sym("q"), ["x"], [None], [float("nan")], [2 + 1j]])
def test_what_is_no_list_of_times_is_refused(value):
    with pytest.raises(TimeRangeError, match="discontinuities"):
        lag(discontinuities=value)


def test_one_symbol_stands_for_one_thing():
    x, n, t = ca.SX.sym("x"), ca.SX.sym("n"), ca.SX.sym("t")
    for changes, message in (
        ({"states": {"a": (x, -x + n), "b": (x, -x)}}, "one symbol stands for state 'a' and state 'b'"),
        ({"states": {"a": (x, -x + n)}, "noises": {"n": x}}, "state 'a' and noise 'n'"),
        ({"states": {"a": (x, -x + n)}, "time": x}, "time and state 'a'"),
        ({"states": {"a": (x, -x + n)}, "parameters": {"k": (t, 1.0)}, "time": t}, "time and parameter 'k'"),
    ):
        with pytest.raises(SystemDefinitionError, match=message):
            lag(**({"noises": {"gust": n}, "outputs": {"y": x}} | changes))


def test_interpolant_is_named_and_not_called_nonlinear():
    t, x, n = (ca.SX.sym(s) for s in "txn")
    table = ca.interpolant("table", "linear", [[0.0, 1.0]], [1.0, 2.0])
    with pytest.raises(SystemDefinitionError, match="derivative of 'x' calls a function .casadi.interpolant") as caught:
        lag(time=t, states={"x": (x, -table(t) * x + n)}, noises={"gust": n}, outputs={"y": x}, parameters={})
    assert not isinstance(caught.value, NonlinearSystemError)


COVARIANCES = [
    ([[1.0, 2.0], [2.0, 1.0]], "indefinite"),
    ([[-1.0, 0.0], [0.0, 1.0]], "gives 'a' the variance -1"),
    ([[1.0, 0.5], [0.0, 1.0]], "not symmetric between 'a' and 'b'"),
    ([[0.0, 0.1], [0.1, 1.0]], "indefinite: 0.1 between 'a' and 'b'"),
    ([[float("nan"), 0.0], [0.0, 1.0]], "is nan between 'a' and 'a'"),
    ([[1.0, float("inf")], [float("inf"), 1.0]], "is inf between 'a' and 'b'"),
    ([[1.0]], r"shape \(1, 1\); it is \(2, 2\)"),
    ([1.0, 1.0], r"shape \(2,\); it is \(2, 2\)"),
    (1.0, r"shape \(\); it is \(2, 2\)"),
    ([[1.0, 0.0], [0.0]], "give numbers"),
    ("identity", "give numbers"),
    ([[10**400, 0], [0, 1]], "give numbers"),
]


def two(covariance, **more) -> LinearSystem:
    """a' = -a + n, b' = -b; start covariance as given."""
    a, b, n = (ca.SX.sym(s) for s in "abn")
    return define_system(
        "two", time=ca.SX.sym("t"), states={"a": (a, -a + n), "b": (b, -b)}, noises={"n": n},
        outputs={"a": a, "sum": a + b}, start_covariance={"n": covariance}, **more,
    )  # fmt: skip


@pytest.mark.parametrize(("covariance", "message"), COVARIANCES)
@pytest.mark.parametrize("kind", [lambda c: c, lambda c: np.array(c), lambda c: ca.SX(ca.DM(c))])
def test_start_covariance_that_is_none_is_refused(kind, covariance, message):
    try:
        given = kind(covariance)
    except (ValueError, NotImplementedError, RuntimeError):
        pytest.skip("no such array")
    with pytest.raises(SystemDefinitionError, match="|".join((message, "shape|give numbers"))):
        two(given)


def test_indefinite_by_three_is_refused():
    """Correlations of -0.6 between each two of three: eigenvalue 1 - 2 * 0.6 < 0, no pair tells it."""
    states = {name: ca.SX.sym(name) for name in "abc"}
    n = ca.SX.sym("n")
    with pytest.raises(SystemDefinitionError, match="negative eigenvalue -0.2"):
        define_system(
            "three", time=ca.SX.sym("t"), states={k: (x, -x + n) for k, x in states.items()}, noises={"n": n},
            outputs={"a": states["a"]}, start_covariance={"n": 1.6 * np.eye(3) - 0.6},
        )  # fmt: skip


def test_start_covariance_as_list_counts():
    """Lists are arrays: the variance at 1 s is that of the closed form with P0 = 0.25."""
    found = Study.from_system(lag(start_covariance={"gust": [[0.25]]}), compile=False).response_statistics([1.0])
    assert found.variance.values[0, 0, 0] == pytest.approx(variance(1.0, 0.25), rel=1e-4)


def test_symbolic_start_covariance_is_checked_when_its_numbers_are_known():
    s, c = ca.SX.sym("s"), ca.SX.sym("c")
    system = two(ca.vertcat(ca.horzcat(s, c), ca.horzcat(c, 1)), parameters={"s": (s, 1.0), "c": (c, 0.5)})
    study = Study.from_system(system, compile=False)
    start = np.array([[1.0, 0.5], [0.5, 1.0]])
    expected = np.exp(-2.0) * start.sum() + 0.5 * (1 - np.exp(-2.0))
    found = study.response_statistics([1.0]).variance.sel(response="sum", source="n").item()
    assert found == pytest.approx(expected, rel=1e-4)
    for changes, message in (({"c": 2.0}, "indefinite"), ({"s": -1.0}, "'a' the variance -1")):
        with pytest.raises(SystemDefinitionError, match=message):
            study.with_parameters(changes).response_statistics([1.0])
    with pytest.raises(SystemDefinitionError, match="depends on 'other', which is no parameter"):
        two(ca.SX.sym("other") * ca.SX.eye(2))


def test_repeated_names_are_refused():
    system = lag()
    with pytest.raises(SystemDefinitionError, match="more than one state 'x'"):
        x2 = ca.SX.sym("x2")
        replace(
            system, x=ca.vertcat(system.x, x2), derivative=ca.vertcat(system.derivative, -x2), states=system.states * 2
        )


def test_without_noises_every_engine_gives_the_mean_alone():
    """x' = -x + u, u = 1: mean 1 - exp(-t), variance zero."""
    x, u = ca.SX.sym("x"), ca.SX.sym("u")
    study = Study.from_system(
        define_system(
            "calm", time=ca.SX.sym("t"), states={"x": (x, -x + u)}, noises={}, inputs={"u": (u, 1.0)}, outputs={"x": x}
        )
    )
    for engine in ("sweep", "cvodes", "covariance", "ensemble"):
        found = study.response_statistics([1.0], engine=engine)
        assert found["source"].values.tolist() == ["combined"]
        assert found.mean.values.item() == pytest.approx(1 - np.exp(-1.0), rel=1e-5), engine
        assert found.variance.values.item() == 0.0


def test_loaded_library_is_the_named_one(cache):
    """A library's file is its name, made fit for a file, and the hash of its content."""
    study = Study.from_system(lag(name="../above"))
    library = study.executable.shared_library
    assert library is not None
    path = library.path
    assert path.parent == cache and ".." not in path.name and "above" in path.name
    ctypes.CDLL(str(path))


def test_a_study_says_that_it_does_not_travel():
    with pytest.raises(NotPicklableError, match="send study.vehicle and parameter values"):
        pickle.dumps(Study.from_system(lag(), compile=False))
