"""The report's figures beside ours: first-order changes by exact derivatives, rebuilt variants, and the page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.noise_loads import NOISE_LOADS
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.vehicle.vehicle_file import read_vehicle_file
from ascentwind.runners import Study, Sweep
from ascentwind.runners.reproduction.as506.flight import FlightCheck
from ascentwind.runners.reproduction.calibration import Calibration, Input
from ascentwind.runners.reproduction.directional import directional_derivative
from ascentwind.runners.reproduction.mean_wind import MeanWind, WindRatio
from ascentwind.runners.reproduction.options import OPTIONS, Effect, Option, effect
from ascentwind.runners.reproduction.page import Reproduction, page
from ascentwind.runners.reproduction.predictions import Prediction, Responses, end_times, responses
from ascentwind.runners.reproduction.published import BY_NAME
from ascentwind.runners.reproduction.rebuild import rebuilt, scaled_normal_force, third_mode
from ascentwind.runners.reproduction.winds import WindComparison
from ascentwind.runners.views.wind_comparison import stretched

AS504 = built_in_vehicles()["as504"]
PAGE = Path(__file__).parents[3] / "docs" / "reproduction.md"
TIGHT = Sweep(relative_tolerance=1e-10)


def moment(study: Study, quantity: str) -> float:
    found = study.response_statistics([70.0], engine=TIGHT)
    return float(found[quantity].sel(response="bending_moment", source="wind").item())


@pytest.fixture(scope="module")
def shifted(tmp_path_factory):
    """Studies either side of AS-504 in an input of its construction, by a step each."""
    work = tmp_path_factory.mktemp("shifted")

    def at(step):
        return Study.load(
            rebuilt(AS504, work / f"{step:g}", alter=lambda c: scaled_normal_force(c, 1 + step, 10 * step))
        )

    return 1e-3, at(-1e-3), at(0.0), at(1e-3)


@pytest.mark.parametrize("quantity", ["std", "mean"])
@pytest.mark.slow
def test_first_order_change_of_a_construction_is_the_central_difference(shifted, quantity):
    """Normal force and its place change four kinds of tables at once."""
    step, before, here, after = shifted
    found = here.sensitivity("bending_moment", 70.0, source="wind", quantity=quantity, elasticity=False)
    first_order = (directional_derivative(found, here, after) - directional_derivative(found, here, before)) / (
        2 * step
    )
    difference = (moment(after, quantity) - moment(before, quantity)) / (2 * step)
    assert first_order == pytest.approx(difference, rel=1e-4)


@pytest.mark.slow
def test_first_order_change_of_wind_and_parameters_is_the_central_difference(as504):
    found = as504.sensitivity("bending_moment", 70.0, source="wind", quantity="std", elasticity=False)
    wind = as504.vehicle.wind.shaping_filter
    names = ("slosh.sic_lox.damping", "bending.1.damping")
    moved = []
    for sign in (-1, 1):
        changes = {name: as504.parameters[name].value * (1 + sign * 1e-3) for name in names}
        faster = replace(as504.vehicle.wind, shaping_filter=stretched(wind, 1 + sign * 1e-3))
        moved.append(as504.with_wind(faster).with_parameters(changes))
    first_order = np.diff([directional_derivative(found, as504, study) for study in moved])[0]
    assert first_order == pytest.approx(np.diff([moment(study, "std") for study in moved])[0], rel=1e-4)


@pytest.mark.slow
def test_first_order_change_of_the_mean_wind_reaches_what_the_noises_multiply(as504):
    """A factor on the mean wind changes the mean, and through it the spread by thrust and centre of pressure."""
    found = as504.sensitivity("bending_moment", 70.0, quantity="mean_plus_3sigma", elasticity=False)
    moved = [as504.with_parameters({"wind.mean_scale": 1 + sign * 1e-3}) for sign in (-1, 1)]
    first_order = np.diff([directional_derivative(found, as504, study) for study in moved])[0]
    peaks = [
        study.response_statistics([70.0], engine=TIGHT)["mean_plus_3sigma"]
        .sel(response="bending_moment", source="combined")
        .item()
        for study in moved
    ]
    assert first_order == pytest.approx(np.diff(peaks)[0], rel=1e-4)


def test_studies_of_other_structure_are_not_compared(as504, as504_closed_form):
    found = as504.sensitivity("bending_moment", 70.0, source="wind", elasticity=False)
    with pytest.raises(DataError, match="other parameters or tables"):
        directional_derivative(found, as504, as504_closed_form)


@pytest.mark.slow
def test_third_mode_is_a_third_mode(tmp_path):
    changes = third_mode(read_vehicle_file(AS504 / "vehicle.toml"))
    folder = rebuilt(AS504, tmp_path / "three", construction={"bending_modes": 3}, changes=changes)
    study = Study.load(folder, compile=False, changes=changes)
    frequency = [study.tables(75.0)[f"bending.{i}.frequency"] for i in (1, 2, 3)]
    # the report names about 6, 13 and 18 rad/s
    np.testing.assert_allclose(frequency, [6, 13, 18], rtol=0.1)


def test_upper_bounds_are_met_below_and_missed_above():
    assert BY_NAME["rise_attack"].miss(0.005) == 0
    assert BY_NAME["rise_attack"].miss(0.02) == pytest.approx(1.0)
    assert BY_NAME["peak_mean"].miss(7.115e6) == pytest.approx(-0.5)


def made_up(as504) -> Reproduction:
    here = Responses(10e6, 4.6e6, 24e6, 75.0, 0.03, 0.02, 0.005, 0.06)
    more = Responses(10.5e6, 4.6e6, 25.2e6, 75.0, 0.03, 0.02, 0.005, 0.06)
    targets = (BY_NAME["peak_mean"], BY_NAME["sigma_75"])
    item = Input("normal_force", "factor on the normal force", "1", 1.0, 0.9, 1.1, "somewhere")
    calibration = Calibration(
        (item,), {"normal_force": 1.1}, targets, np.array([10e6, 4.6e6]), np.array([11e6, 4.2e6]), np.ones((2, 1)), 5
    )
    statistics = as504.response_statistics([70.0, 75.0], responses=["bending_moment"])
    effects = [
        Effect(None, here, 0.03, 0.006),
        Effect(Option("more", "more of it"), more, 0.03, 0.006),
        Effect(Option("white", "white noise"), None, 0.03, 0.006),
    ]
    check = FlightCheck("altitude", "km", 65.0, 66.1, 1.0, "table 4-2")
    predictions = [Prediction(BY_NAME["peak_mean"], 10e6), Prediction(BY_NAME["rise_attack"], 0.005)]
    forms: dict[str, Responses] = dict.fromkeys(NOISE_LOADS, here)
    wind = MeanWind(1.5, 3.38, 10500.0, forms, forms, WindRatio("March 1983", 2.5, 37.0), WindRatio("May", 2.6, 38.0))
    return Reproduction(
        predictions,
        effects,
        WindComparison({"own": statistics}, -0.07, {"own": statistics}),
        [check],
        calibration,
        wind,
    )


def test_page_says_what_was_missed_and_what_is_at_a_bound(as504):
    text = page(made_up(as504))
    assert "| 14.23 MN m | 4.1.2 | 10.00 MN m | -29.7 % |" in text
    assert "| below 1.0 % | 5.2 | 0.5 % | met |" in text
    assert "| more of it | +5.0 % | +0.0 % | +5.0 % |" in text
    assert "| white noise | infinite | infinite | infinite |" in text
    assert "Outside its limit: altitude." in text
    assert "1.1 (upper bound)" in text
    assert "Cannot be met within 3 % at once: peak mean bending moment" in text
    assert "σ of the bending moment" not in text[text.index("Cannot be met") :].split("What each")[0]


@pytest.mark.slow
def test_page_in_the_docs_holds_the_present_numbers(as504):
    """Stale if the vehicle changed since: write it anew with 'ascentwind reproduce'."""
    found = responses(as504.response_statistics(end_times(as504)))
    text = PAGE.read_text(encoding="utf-8")
    for value in (found.peak_mean, found.sigma_75, found.peak):
        assert f"| {value / 1e6:.2f} MN m |" in text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gust_zones", "moderate_turbulence_at_once", "moderate_turbulence"])
def test_rows_of_gusts_and_turbulence_in_the_docs_hold_the_present_numbers(name, as504, tmp_path):
    """Their sigma at 75 s is that of wind and turbulence together, whose variances add up."""
    (option,) = (each for each in OPTIONS if each.name == name)
    found = effect(AS504, option, tmp_path)
    assert found.responses is not None
    own = responses(as504.response_statistics(end_times(as504)))
    row = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {option.what} |"))
    changes = (getattr(found.responses, each) / getattr(own, each) - 1 for each in ("peak_mean", "sigma_75", "peak"))
    assert row.split(" | ")[1:4] == [f"{100 * change:+.1f} %" for change in changes]
    variance = Study.load("as504", changes=option.changes).response_statistics([75.0]).variance
    at = {"response": "bending_moment", "time": 75.0}
    parts = [float(variance.sel(source=source, **at)) for source in variance["source"].values if source != "combined"]
    of_vehicle = sum(float(variance.sel(source=source, **at)) for source in ("thrust", "center_of_pressure"))
    assert found.responses.sigma_75**2 == pytest.approx(sum(parts) - of_vehicle, rel=1e-9)
    assert found.responses.rise_bending < own.rise_bending, "turbulence is not one of the vehicle's noises"
