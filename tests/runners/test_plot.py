"""The figure of any result: each kind has one that shows itself, and what has none is refused."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import sys

import numpy as np
import pytest

import ascentwind as aw
import ascentwind.runners
from ascentwind.errors import LimitError, ParameterValueError, UnknownNameError, UnusedOptionError
from ascentwind.model.wind.range_reference import shipped_statistics
from ascentwind.runners.case.case import Case
from ascentwind.runners.design.design import design
from ascentwind.runners.design.problem import LoadReliefProblem
from ascentwind.runners.figures.plot import PLOTTED

OTHERS = {"Study", "Self", "xr", "Dataset", "DataArray", "Any", "Lasting"}  # how long winds last is no result
PNG = b"\x89PNG\r\n\x1a\n"


def balloon(tmp_path):
    file = tmp_path / "balloon.csv"
    rows = [f"1,{h},{10 + h / 1000},0" for h in range(250, 16001, 250)]
    file.write_text("\n".join(["profile,altitude [m],u [m/s],v [m/s]", *rows]))
    return file


@pytest.fixture(scope="module")
def results(as504, fit, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plot")
    wind = balloon(folder)
    limits = folder / "limits.csv"
    limits.write_text("time [s],bending_moment [N m]\n60,28e6\n90,28e6\n")
    grid = {
        "format": 1,
        "title": "one",
        "vehicle": "as504",
        "times": "70:76:2",
        "responses": ["bending_moment"],
        "grid": {"quantity": [{"name": "wind.sigma_scale", "values": [0.9, 1.1]}]},
    }
    both_planes = aw.Study.load("as504", changes={"planes": "both"})
    both = both_planes.response_statistics(times=[70, 75])
    problem = LoadReliefProblem(
        as504, {"control.T1.gain": (0.9, 1.1)}, (50.0, 54.0), peak_limits={"engine_angle": 0.05}
    )
    along = folder / "along.csv"
    along.write_text("station [m],bending_moment [N m]\n20,40e6\n40,40e6\n")
    return {
        "statistics": as504.response_statistics(times=[70, 75]),
        "resultants": both.resultants(),
        "load": as504.flight_load("bending_moment", (70.0, 76.0), draws=200),
        "gusts": as504.gust_sweep(aw.QuasiSquare(), [72.0], responses=["bending_moment"], lengths=[100.0, 200.0]),
        "flown": as504.fly(wind, [70.0, 75.0], component="zonal"),
        "launch": as504.day_of_launch(wind, 3.0, limits=limits, window=(60.0, 90.0), draws=200, component="zonal"),
        "study": aw.run_parameter_study(grid, folder / "study"),
        "design": design(problem),
        "design wind": as504.design_wind("bending_moment", 75.0),
        "design wind of both planes": both_planes.design_wind("resultant_bending_moment", 75.0),
        "limits": as504.limit_passage(limits, (70.0, 76.0), draws=200),
        "limits along the vehicle": as504.limit_passage(along, (70.0, 76.0), draws=200),
        "flown in both planes": both_planes.fly(wind, [70.0, 75.0]).resultants,
        "synthesis": fit(shipped_statistics("march", "zonal")),
    }


@pytest.mark.slow
def test_every_kind_shows_itself(results):
    for name, result in results.items():
        image = aw.plot(result)._repr_png_()
        assert image.startswith(PNG), name
        assert len(image) < 300_000, name
    assert {type(each) for each in results.values()} == set(PLOTTED)


@pytest.mark.slow
def test_every_kind_says_what_it_is_without_script(results):
    for name, result in results.items():
        page = result._repr_html_()
        assert 50 < len(page) < 20_000, name
        assert "<script" not in page, name
        assert type(result).__name__ in page, name


def test_what_shows_itself_has_a_figure():
    """Every class of a result, found by walking the package, whatever its name."""
    for module in pkgutil.walk_packages(ascentwind.runners.__path__, "ascentwind.runners."):
        if not module.name.startswith("ascentwind.runners.cli"):
            importlib.import_module(module.name)
    found = {
        thing
        for name, module in list(sys.modules.items())
        if name.startswith("ascentwind.runners.")
        for thing in vars(module).values()
        if isinstance(thing, type) and "_repr_html_" in vars(thing) and not issubclass(thing, Case)
    }
    assert found == set(PLOTTED)


def test_what_a_study_returns_shows_itself():
    """A result of a question is a dataset or matrices, or one of those that have a figure."""
    known = {kind.__name__ for kind in PLOTTED} | OTHERS
    for name, method in vars(aw.Study).items():
        if name.startswith("_") or not inspect.isfunction(method):
            continue
        returned = set(re.findall(r"\w+", str(method.__annotations__["return"])))
        assert returned <= known, f"{name} returns {returned - known}, which has no figure"


@pytest.mark.slow
def test_datasets_that_have_a_figure(as504, results):
    sensitivity = as504.sensitivity("bending_moment", 75.0)
    weights = as504.weighting_function(75.0)
    both = results["design wind of both planes"].case
    for dataset in (sensitivity, weights, both.resultant_along_vehicle([70.0, 75.0])):
        assert aw.plot(dataset)._repr_png_().startswith(PNG)
    assert aw.plot(weights, "engine_angle").texts[-1].get_text().startswith("Weighting function from wind to engine")
    with pytest.raises(UnknownNameError, match="engin_angle"):
        aw.plot(weights, "engin_angle")
    with pytest.raises(UnusedOptionError):
        aw.plot(sensitivity, "bending_moment")
    with pytest.raises(ParameterValueError, match=r"of .*A.* has no figure.*sensitivities"):
        aw.plot(as504.matrix_grid([70.0, 75.0]))


@pytest.mark.slow
def test_a_response_that_is_not_there_is_named(results):
    for name in ("statistics", "resultants", "gusts", "flown", "study"):
        with pytest.raises(UnknownNameError, match="bending_momnt"):
            aw.plot(results[name], "bending_momnt")
    for name in ("load", "launch", "synthesis", "design", "design wind", "limits"):
        with pytest.raises(UnusedOptionError):
            aw.plot(results[name], "bending_moment")


@pytest.mark.slow
def test_a_launch_without_limits_says_so(as504, tmp_path):
    launch = as504.day_of_launch(balloon(tmp_path), 3.0, responses=["bending_moment"], component="zonal")
    with pytest.raises(LimitError):
        aw.plot(launch)


def test_what_has_no_figure_is_refused():
    with pytest.raises(ParameterValueError, match=r"ndarray has no figure.*FlightLoad"):
        aw.plot(np.zeros(3))


@pytest.mark.slow
def test_a_grid_of_three_has_no_figure(results):
    study = results["study"]
    of_three = type(study)(study.plan, study.study, study.quantities * 3, study.data)
    with pytest.raises(ParameterValueError, match="3 quantities"):
        aw.plot(of_three)


def test_a_figure_shows_itself_with_dollars_as_they_are(as504):
    figure = as504.response_statistics(times=[70, 75]).plot("bending_moment", title="costs $5 and $6")
    assert figure._repr_png_().startswith(PNG)
    assert all(not text.get_parse_math() for text in [*figure.axes[0].texts, figure.axes[0].title])
