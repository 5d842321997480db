"""Agreement: engines that agree, and each way in which one can be caught."""

from __future__ import annotations

import re
import sys

import casadi as ca
import numpy as np
import pytest

from ascentwind.model import define_system
from ascentwind.runners import Ensemble, Study
from ascentwind.runners.cli.app import main
from ascentwind.runners.statistics.agreement import agreement
from ascentwind.runners.statistics.engines import ENGINES

OPTIONS = Ensemble(runs=400)
TIMES = [1.0, 4.0]


@pytest.fixture(scope="module")
def study() -> Study:
    t, x, v, a, b, u = (ca.SX.sym(s) for s in ("t", "x", "v", "a", "b", "u"))
    system = define_system(
        "verified",
        time=t,
        states={"x": (x, v + 0.1 * b), "v": (v, -0.5 * v - (4 + 0.1 * t) * x + a + u)},
        noises={"a": a, "b": b},
        inputs={"u": (u, 1.0)},
        outputs={"x": x, "v": v},
        end=10.0,
    )
    return Study.from_system(system)


@pytest.fixture
def spoil(monkeypatch):
    """Let an engine return a variable multiplied by a factor."""

    def put(engine: str, variable: str, factor: float) -> None:
        right = ENGINES[engine].compute

        def wrong(self, *arguments):
            found = right(self, *arguments)
            for name in (variable, f"{variable}_low", f"{variable}_high"):
                if name in found:
                    found[name] = found[name] * factor
            return found

        monkeypatch.setattr(ENGINES[engine], "compute", wrong)

    return put


def test_engines_agree(study):
    found = agreement(study, TIMES, OPTIONS)
    assert found.agree, found.verdict()
    assert set(found.statistics) == set(ENGINES)
    assert all(d.max() < 1e-7 for d in found.differences.values())
    assert re.match(r"The engines agree: .*covariance equation.* lie in the 90% interval of 400", found.verdict())


@pytest.mark.parametrize("engine", [name for name, e in ENGINES.items() if e.tight() is not None and name != "cvodes"])
@pytest.mark.parametrize("variable", ["std", "mean"])
def test_a_small_error_of_one_engine_is_found_and_named(study, spoil, engine, variable):
    right = study.response_statistics(TIMES, engine="covariance")
    combined = right.std.sel(source="combined")
    # a mean that is less than the deviation is held against the deviation
    share = float((np.abs(right.mean) / np.maximum(np.abs(right.mean), combined)).max()) if variable == "mean" else 1.0
    spoil(engine, variable, 1 + 3e-6)
    found = agreement(study, TIMES, OPTIONS)
    assert not found.agree
    assert ENGINES[engine].label in found.verdict()
    said = re.escape(f"{3e-6 * share:.1e}")
    assert re.search(rf"DISAGREE: .* differs by {said} in \w+ from \w+ at [14] s", found.verdict())


def test_an_error_common_to_all_equations_is_found_by_the_ensemble(study, spoil):
    for engine, entry in list(ENGINES.items()):
        if entry.tight() is not None:
            spoil(engine, "std", 1.3)
    found = agreement(study, TIMES, OPTIONS)
    assert all(d.max() < 1e-7 for d in found.differences.values())
    assert re.search("lie outside the ensemble by more than chance allows", found.verdict())


def test_right_ensembles_are_not_called_wrong(study):
    """Of 40 seeds none: the chance of one is 4 %, and the seeds are fixed."""
    reference = study.response_statistics(TIMES, engine="cvodes")
    from ascentwind.runners.solvers.ensemble import std_interval

    wide = 1 - 1e-3 / reference.std.size
    for seed in range(40):
        sampled = study.response_statistics(TIMES, engine=Ensemble(runs=100, seed=seed))
        low, high = std_interval(sampled.std.values, 100, wide)
        assert ((low <= reference.std.values) & (reference.std.values <= high)).all()


@pytest.mark.slow
def test_command_prints_a_table_and_ends_with_the_verdict(as504, spoil, monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(
        sys, "argv", ["ascentwind", "verify", "as504", "--times", "15,20", "--runs", "60", "--out", str(tmp_path)]
    )
    with pytest.raises(SystemExit) as stop:
        main()
    printed = capsys.readouterr().out
    assert stop.value.code in (0, None), printed
    assert len(re.findall(r"│ (15|20) s +│", printed)) == 2 * len(as504.checked_responses(None)) * 4
    assert "…" not in printed, "a narrow terminal cuts numbers off"
    assert "The engines agree" in printed
    assert (tmp_path / "sample_paths.png").read_bytes().startswith(b"\x89PNG")
    assert "simulated flights" in (tmp_path / "sample_paths.svg").read_text()
    spoil("covariance", "std", 1.01)
    monkeypatch.setattr(sys, "argv", ["ascentwind", "verify", "as504", "--times", "15", "--runs", "60"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 1
    assert "DISAGREE" in capsys.readouterr().out


def test_differences_are_those_of_the_tables(study):
    found = agreement(study, TIMES, OPTIONS)
    a, b = (found.statistics[e].std.values for e in ("covariance", "cvodes"))
    np.testing.assert_allclose(found.differences["covariance"], np.abs(a / b - 1), atol=1e-15)
