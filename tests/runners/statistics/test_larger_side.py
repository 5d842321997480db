"""Peaks are of the larger side, |mean| + 3 sigma: a mean wind mirrored in the plane changes no headline anywhere."""

from __future__ import annotations

import csv
import io
import re
import sys
import warnings
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matplotlib.text import Annotation
from rich.console import Console

from ascentwind.model import define_system
from ascentwind.runners import Study
from ascentwind.runners.cli.app import main
from ascentwind.runners.design.design import design, recompute_peaks
from ascentwind.runners.design.problem import LoadReliefProblem
from ascentwind.runners.design.report import print_design
from ascentwind.runners.parameter_study import run_parameter_study
from ascentwind.runners.parameter_study.report import report
from ascentwind.runners.reproduction.calibration import Model
from ascentwind.runners.reproduction.predictions import responses
from ascentwind.runners.reproduction.winds import WindComparison, wind_figure
from ascentwind.runners.statistics.larger_side import LARGER_SIDE, larger_side, side
from ascentwind.runners.statistics.results import ResponseStatistics
from ascentwind.runners.views import along_vehicle_files as along_vehicle_output

PLUS, MINUS = "equivalent_axial_load_plus_y", "equivalent_axial_load_minus_y"
NUMBERS = {"a": 0.8, "b": 2.0, "c": 0.3, "g": 0.5}


@pytest.fixture(scope="module")
def driven(cache) -> Study:
    """x' = -a x + u + g n, y = x + c u, u = b sin t: the sign of b mirrors the mean and leaves sigma alone."""
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    p = {name: ca.SX.sym(name) for name in NUMBERS}
    system = define_system(
        "mirrored_lag",
        time=t,
        states={"x": (x, -p["a"] * x + u + p["g"] * n)},
        noises={"n": n},
        inputs={"u": (u, p["b"] * ca.sin(t))},
        outputs={"y": x + p["c"] * u},
        parameters={name: (symbol, NUMBERS[name]) for name, symbol in p.items()},
        end=6.0,
    )
    return Study.from_system(system)


def closed_form(t, a, b, c, g):
    """Return mean and standard deviation of y."""
    mean = b * ((a * np.sin(t) - np.cos(t) + np.exp(-a * t)) / (a**2 + 1) + c * np.sin(t))
    return mean, g * np.sqrt((1 - np.exp(-2 * a * t)) / (2 * a))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    a=st.floats(0.2, 2.0), b=st.floats(0.1, 3.0), c=st.floats(-1.0, 1.0), g=st.floats(0.05, 1.0), mirrored=st.booleans()
)
def test_the_peak_is_the_larger_side_of_the_closed_form(driven, a, b, c, g, mirrored):
    numbers = {"a": a, "b": -b if mirrored else b, "c": c, "g": g}
    times = np.linspace(0.5, 6.0, 23)
    (peak,) = driven.with_parameters(numbers).response_statistics(times).peaks()
    mean, std = closed_form(times, **numbers)
    both = np.maximum(np.abs(mean + 3 * std), np.abs(mean - 3 * std))
    assert peak.value == pytest.approx(both.max(), rel=1e-6)
    assert both[times == peak.time] == pytest.approx(both.max(), rel=1e-6)
    assert peak.side == ("mean + 3σ" if peak.mean > 0 else "mean - 3σ")
    assert abs(peak.mean + (3 if peak.mean > 0 else -3) * peak.std) == pytest.approx(peak.value, rel=1e-12)


def test_the_dataset_stays_literal(driven):
    found = driven.with_parameters({"b": -2.0}).response_statistics([1.5])
    mean, std = closed_form(1.5, **(NUMBERS | {"b": -2.0}))
    assert mean < 0
    assert float(found.mean_plus_3sigma.sel(source="combined").item()) == pytest.approx(mean + 3 * std, rel=1e-6)


def test_a_mean_of_zero_has_an_upper_side():
    assert side(0.0) == "mean + 3σ"
    assert side(-1e-30) == "mean - 3σ"
    np.testing.assert_array_equal(larger_side(np.array([-2.0, 1.0]), np.array([1.0, 0.0])), [5.0, 1.0])


# one function a command: what it tells people, as numbers


def by_name(study: Study, found: dict[str, list[float]]) -> list[float]:
    """Return what is told of each response; where the wind is mirrored the two sides of the vehicle change places."""
    other = {PLUS: MINUS, MINUS: PLUS} if study.parameters["wind.mean_scale"].value < 0 else {}
    return [number for name in found for number in found[other.get(name, name)]]


def of_run(study: Study, folder: Path, ascentwind) -> list[float]:
    ascentwind("run", "--times", "70:80:5", "--out", str(folder))
    found = ResponseStatistics.open(folder)
    assert (np.sign(found["peak_side"]) == np.sign(found["peak_reference_mean"])).all()
    told = zip(found["response"].values, found["peak"].values, found["peak_time"].values, strict=True)
    return by_name(study, {str(name): [peak, time] for name, peak, time in told})


def of_run_along_vehicle(study: Study, folder: Path, ascentwind) -> list[float]:
    drawn = []
    with pytest.MonkeyPatch.context() as patch:
        draw = along_vehicle_output.along_figure
        patch.setattr(along_vehicle_output, "along_figure", lambda *a: drawn.append((*a[:2], draw(*a))) or drawn[-1][2])
        ascentwind("run", "--times", "75,80", "--along-vehicle", "peak", "--out", str(folder))
    told = {}
    for found, time, figure in drawn:
        section, envelope, meshes = figure.axes[1:4]
        limits = [np.abs(axes.get_ylim()).max() for axes in (section, envelope)]
        told[found.attrs["load"]] = [time, *limits, float(meshes.collections[0].get_array().max())]
    return by_name(study, told)


def test_the_largest_along_the_vehicle_names_its_side():
    mean = np.array([[1.0, -4.0, 2.0], [3.0, -2.0, 1.0]])
    for factor, name in ((1.0, "mean - 3σ"), (-1.0, "mean + 3σ")):
        found = xr.Dataset(
            {
                "mean": (("time", "station"), factor * mean),
                "std": (("time", "station", "source"), np.full((2, 3, 2), 0.5)),
            },
            {"time": [70.0, 75.0], "station": [0.0, 20.0, 40.0], "source": ["wind", "combined"]},
            {"load": "shear_force"},
        )
        largest = along_vehicle_output.LargestAlong.of(found)
        assert (largest.value, largest.side, largest.station, largest.time) == (5.5, name, 20.0, 70.0)
        assert (largest.mean, largest.unit) == (-4.0 * factor, "N")


def of_sensitivity(study: Study, folder: Path, ascentwind) -> list[float]:
    ascentwind("sensitivity", "--out", str(folder))
    with xr.open_dataset(folder / "sensitivity.nc", engine="scipy") as found:
        assert found.attrs["quantity"] == LARGER_SIDE
        return [found.attrs["value"], found.attrs["t2_s"], *found["elasticity"].values]


def of_figure(study: Study, folder: Path, ascentwind) -> list[float]:
    found = study.response_statistics([70.0, 75.0, 80.0])
    notes = {}
    for name in found["response"].values:
        (note,) = found.plot(str(name), "title").axes[0].texts
        assert isinstance(note, Annotation)
        said = re.fullmatch(r"\|mean\| \+ 3σ: (\S+) (?:MN m|deg|kN|MN|kPa deg) at (\S+) s", note.get_text())
        assert said
        notes[str(name)] = [float(said[1]), float(said[2]), abs(note.xy[1])]
    return by_name(study, notes)


def of_study(study: Study, folder: Path, ascentwind) -> list[float]:
    quantity = {"name": "reference_area", "relative": True}
    plans = {
        "one_at_a_time": {"quantity": [quantity | {"plus_minus": 0.05}]},
        "dispersion": {"members": 12, "seed": 1, "quantity": [quantity | {"distribution": "normal", "sigma": 0.05}]},
        "grid": {"quantity": [quantity | {"values": [0.9, 1.1]}]},
    }
    numbers = []
    for kind, planned in plans.items():
        plan = {"format": 1, "title": "t", "times": "70,75", "responses": ["bending_moment"], kind: planned}
        written = report(
            run_parameter_study(plan, folder / kind, study=study), folder / kind, Console(file=io.StringIO())
        )
        for path in written:
            if path.suffix == ".csv":
                for row in csv.DictReader(path.read_text().splitlines()):
                    if row.get("measure") not in ("mean", "std"):
                        numbers += [float(x) for key, x in row.items() if x and key not in ("member",) and _number(x)]
    return numbers


def of_design(study: Study, folder: Path, ascentwind) -> list[float]:
    problem = LoadReliefProblem(study, {"control.T1.gain": (0.5, 2.0)}, (50.0, 54.0), response="bending_moment")
    found = design(problem)
    recomputed = recompute_peaks(found)
    print_design(found, recomputed, Console(file=io.StringIO()))
    return [*found.values.values(), *(q.after for q in found.quantities), *(v.cvodes for v in recomputed)]


def of_reproduce(study: Study, folder: Path, ascentwind) -> list[float]:
    found = responses(study.response_statistics([70.0, 75.0, 80.0]))
    figure = wind_figure(WindComparison({}, 0.0, {"own": study.response_statistics([70.0, 75.0])}), "title")
    solid = np.abs(figure.axes[0].get_lines()[0].get_ydata()).max()
    model = Model.__new__(Model)
    targets = model.figures(study)
    return [*vars(found).values(), solid, *targets]


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


COMMANDS = {
    "run": of_run,
    "run --along-vehicle": of_run_along_vehicle,
    "sensitivity": of_sensitivity,
    "figure": of_figure,
    "study": of_study,
    "design": of_design,
    "reproduce": of_reproduce,
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.slow
def test_mirroring_the_mean_wind_changes_no_headline(command, as504, tmp_path, monkeypatch):
    mirrored = as504.with_parameters({"wind.mean_scale": -as504.parameters["wind.mean_scale"].value})
    headlines = []
    for name, study in (("as_it_is", as504), ("mirrored", mirrored)):
        monkeypatch.setattr(Study, "load", classmethod(lambda cls, *_, study=study, **__: study))

        def ascentwind(*arguments: str) -> None:
            monkeypatch.setattr(sys, "argv", ["ascentwind", arguments[0], "as504", *arguments[1:]])
            with pytest.raises(SystemExit) as stop:
                main()
            assert stop.value.code in (0, None)

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            headlines.append(np.atleast_1d(COMMANDS[command](study, tmp_path / name, ascentwind)))
    assert headlines[0].size
    np.testing.assert_allclose(headlines[0], headlines[1], rtol=1e-5 if command in ("design", "study") else 1e-6)


def test_falcon_1_is_told_by_its_larger_side(cache):
    """Its mean is negative where the moment is largest."""
    found = Study.load("falcon1").response_statistics([68.0, 69.0, 70.0, 71.0], responses=["bending_moment"])
    (peak,) = found.peaks()
    mean, std = (found[name].sel(source="combined").values[:, 0] for name in ("mean", "std"))
    assert peak.side == "mean - 3σ"
    assert peak.value == pytest.approx(-(mean - 3 * std).min(), rel=1e-12)
    assert peak.value > 1.04 * (mean + 3 * std).max()
