"""A case: what is asked of a vehicle only, and the mean that members have."""

from __future__ import annotations

import numpy as np
import pytest
from lag import lag

import ascentwind as aw
from ascentwind.model.errors import NoVehicleError, UnknownNameError
from ascentwind.runners.station_loads.loads_along_vehicle import loads_along_vehicle
from ascentwind.runners.views.mean_comparison import mean_comparison


@pytest.mark.parametrize(
    "ask",
    [
        lambda study: study.start_altitude,
        lambda study: study.vehicle_for("a test"),
        lambda study: study.with_wind(None),
        lambda study: loads_along_vehicle(study, [3.0]),
        lambda study: mean_comparison(study),
    ],
)
def test_what_only_a_vehicle_has_is_refused_of_a_system(ask):
    with pytest.raises(NoVehicleError, match="asks for a vehicle, and 'lag' is a system of one's own") as caught:
        ask(lag())
    assert isinstance(caught.value, UnknownNameError)


def test_the_start_is_where_the_altitude_table_says(as504):
    table = as504.vehicle.tables["altitude"]
    assert as504.start_altitude == pytest.approx(np.interp(as504.system.start, table.argument, table.values), rel=1e-3)


def test_checked_names_and_times_are_returned(as504):
    assert as504.checked_times(iter([20.0, 30.0])) == [20.0, 30.0]
    assert as504.checked_responses("bending_moment") == ["bending_moment"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:wind filter")
def test_a_batch_with_the_nonlinear_mean_is_one_study_after_another():
    study = aw.Study.load("falcon1", changes={"options.mean_response": "nonlinear"})
    linear = aw.Study.load("falcon1")
    sets = [{}, {"wind.mean_scale": 1.5}]
    at = [study.system.start + 60.0]
    tight = aw.Sweep(1e-9)
    found = study.batch(sets, at, engine=tight)
    for member, changes in enumerate(sets):
        alone = study.with_parameters(changes).response_statistics(at, engine=tight)
        np.testing.assert_allclose(found.variance.values[member], alone.variance.values, rtol=1e-7)
    plain = linear.batch(sets, at, engine=tight)
    assert not np.allclose(found.variance.values[1], plain.variance.values[1], rtol=1e-9)
