"""Bad input of parameter studies: typed, with file or key, why, and the way out."""

from __future__ import annotations

import pytest
from lag import dispersion, lag, normal, plan

from ascentwind.model.errors import DataError, TimeRangeError, UnknownNameError
from ascentwind.runners.parameter_study import run_parameter_study
from ascentwind.runners.parameter_study.plan import read_plan

GAIN, TAU, LEVEL = normal("gain", 0.1), normal("tau", 0.1), normal("level", 0.1)
ALL = (GAIN, TAU, LEVEL)


def correlated(*pairs: tuple[str, str, float]) -> dict:
    return dispersion(9, *ALL, correlation=[{"between": [a, b], "coefficient": c} for a, b, c in pairs])


def grid(*quantities: dict, **more) -> dict:
    return plan(grid={"quantity": list(quantities)}, **more)


CASES = {
    "unknown parameter": (dispersion(9, normal("gian", 0.1)), r"no parameter or table 'gian'; did you mean 'gain'\?"),
    "structure": (dispersion(9, normal("states", 1.0)), r"'states' is structure, not a number"),
    "zero sigma": (dispersion(9, normal("gain", 0.0)), r"quantity.0.sigma.*greater than 0 \(found 0.0\)"),
    "negative sigma": (dispersion(9, normal("gain", -1.0)), r"quantity.0.sigma.*greater than 0 \(found -1.0\)"),
    "no sigma": (dispersion(9, {"name": "gain", "distribution": "normal"}), r"needs a sigma above zero"),
    "limits of a normal": (dispersion(9, normal("gain", 1.0, low=1.0)), r"without limits; take \"truncated_normal\""),
    "low above high": (dispersion(9, {"name": "gain", "distribution": "uniform", "low": 2, "high": 1}), r"not below"),
    "unknown distribution": (dispersion(9, {"name": "gain", "distribution": "weibull"}), r"distribution.*'normal'"),
    "unknown key": (
        dispersion(9, normal("gain", 1.0, sgima=1)),
        r"'dispersion.quantity.0.sgima'.*did you mean 'sigma'",
    ),
    "unknown sampling": (dispersion(9, GAIN, sampling="halton"), r"sampling.*'sobol'"),
    "one member": (dispersion(1, GAIN), r"members.*greater than or equal to 2"),
    "not positive definite": (
        correlated(("gain", "tau", 0.9), ("tau", "level", 0.9), ("gain", "level", -0.9)),
        r"not positive definite \(smallest eigenvalue -0.8\).*gain, level, tau contradict",
    ),
    "correlation above one": (correlated(("gain", "tau", 1.2)), r"coefficient.*less than 1"),
    "correlation of a stranger": (correlated(("gain", "mass", 0.2)), r"no quantity 'mass'; known: gain, tau, level"),
    "correlation with itself": (correlated(("gain", "gain", 0.2)), r"correlates a quantity with itself"),
    "correlation twice": (correlated(("gain", "tau", 0.2), ("tau", "gain", 0.3)), r"pair of quantities a second time"),
    "named twice": (dispersion(9, GAIN, normal("other", 0.1, parameters=["gain"])), r"already belongs to .*'gain'"),
    "same quantity twice": (dispersion(9, GAIN, GAIN), r"two quantities named 'gain'"),
    "different nominals": (dispersion(9, normal("both", 0.1, parameters=["gain", "tau"])), r"set relative = true"),
    "two kinds": (dispersion(9, GAIN, seed=1) | grid({"name": "gain", "values": [1.0]}), r"exactly one of \[grid\]"),
    "no values": (grid({"name": "gain"}), r"either values = \[...\] or linspace"),
    "not finite": (grid({"name": "gain", "values": [float("nan")]}), r"finite"),
    "no quantities": (grid(), r"at least 1 item"),
    "half a range": (plan(one_at_a_time={"quantity": [{"name": "gain", "low": 1.0}]}), r"low and high, or plus_minus"),
    "no responses": (dispersion(9, GAIN) | {"responses": []}, r"'responses'.*at least 1 item"),
    "times that are none": (dispersion(9, GAIN) | {"times": "1:2"}, r"'times': '1:2' does not name times; write START"),
    "tolerance": (dispersion(9, GAIN) | {"relative_tolerance": 0.9}, r"'relative_tolerance'.*less than or equal to"),
    "text for a list": (grid({"name": "gain", "values": "1.0"}), r"values.*should be a valid list \(found '1.0'\)"),
    "an option of no vehicle": (grid({"name": "options.full_coupling", "values": [1.0]}), r"there is no parameter or"),
    "more members than memory": (dispersion(10**11, GAIN), r"members.*less than or equal to 10000000"),
    "more values than memory": (grid({"name": "gain", "linspace": [0, 1, 10**10]}), r"linspace.*less than or equal to"),
    "more combinations than memory": (
        grid(*({"name": name, "linspace": [1, 2, 10**4]} for name in ("gain", "tau"))),
        r"has 100000000 combinations, more than 10000000",
    ),
    "too much to store": (dispersion(3_000_000, GAIN) | {"times": "1:50:0.5"}, r"GB.*fewer times"),
}


@pytest.fixture(scope="module")
def study(cache):
    return lag()


@pytest.mark.parametrize("case", CASES)
def test_bad_plans_are_refused_before_anything_is_computed(case, study, tmp_path):
    given, expected = CASES[case]
    with pytest.raises(DataError, match=expected):
        run_parameter_study(given, tmp_path / "out", study=study)
    assert not (tmp_path / "out").exists()


def test_times_responses_and_sources_are_checked(study, tmp_path):
    given = dispersion(9, GAIN)
    with pytest.raises(TimeRangeError, match="beyond"):
        run_parameter_study(given | {"times": "1,60"}, tmp_path, study=study)
    with pytest.raises(UnknownNameError, match="'y'"):
        run_parameter_study(given | {"responses": ["y"]}, tmp_path, study=study)
    with pytest.raises(UnknownNameError, match="noise source 'wind'"):
        run_parameter_study(given | {"sources": ["wind"]}, tmp_path, study=study)


def test_a_factor_on_zero_is_refused(study, tmp_path):
    with pytest.raises(DataError, match="'level' is zero, so that a factor on it changes nothing"):
        given = dispersion(9, normal("level", 0.1, relative=True))
        run_parameter_study(given, tmp_path, study=study.with_parameters({"level": 0.0}))


def test_a_table_without_its_prefix_and_errors_of_a_file(as504, tmp_path):
    file = tmp_path / "mass.toml"
    file.write_text('format = 1\ntitle = "t"\nvehicle = "as504"\n[[grid.quantity]]\nname = "mass"\nvalues = [0.9]\n')
    with pytest.raises(DataError, match=r"mass.toml, column 'grid.quantity.0': 'mass' is a table; write 'tables.mass'"):
        run_parameter_study(file, tmp_path / "out", study=as504)
    file.write_text(file.read_text().replace('"mass"', '"options.full_coupling"'))
    with pytest.raises(DataError, match=r"'options.full_coupling' is structure, not a number"):
        run_parameter_study(file, tmp_path / "out", study=as504)
    file.write_text('format = 1\ntitle = "t"\n[[grid.quantity]]\nname = "mass"\nvalues = [0.9]\n')
    with pytest.raises(DataError, match=r"mass.toml, column 'vehicle': is missing; name a shipped vehicle"):
        read_plan(file)
    file.write_text("format = ")
    with pytest.raises(DataError, match=r"mass.toml: is not valid TOML"):
        read_plan(file)


def test_a_source_named_twice_is_stored_once(study, tmp_path):
    found = run_parameter_study(dispersion(2, GAIN) | {"sources": ["gust", "gust"]}, tmp_path, study=study)
    assert found.data["source"].values.tolist() == ["gust", "combined"]


def test_a_factor_that_a_table_cannot_have_fails_its_member(as504, tmp_path):
    """The mass of a file must be positive; the mean wind may be turned round."""
    given = {"format": 1, "title": "t", "times": "30"}
    for name, values, status in (
        ("tables.mass", [1.0, 0.0, -1.0], [0, 2, 2]),
        ("tables.wind.mean", [-1.0, 0.0], [0, 0]),
    ):
        grid = {"quantity": [{"name": name, "values": values}]}
        found = run_parameter_study(given | {"grid": grid}, tmp_path / name, study=as504)
        assert found.data["status"].values.tolist() == status
    grid = {"quantity": [{"name": "tables.thrust", "values": [-1.0]}]}
    found = run_parameter_study(given | {"grid": grid}, tmp_path / "thrust", study=as504)
    assert "a factor of -1 on 'tables.thrust' leaves it no sense" in found.data["reason"].values[0]
