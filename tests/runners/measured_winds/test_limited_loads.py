"""Limits along stations and of resultants on the day of launch and in months; the vehicle about the day's mean."""

from __future__ import annotations

import numpy as np
import pytest

import ascentwind as aw
from ascentwind.model.errors import DataError
from ascentwind.model.wind.soundings.sounding import Sounding
from ascentwind.runners import Study
from ascentwind.runners.cli.app import main
from ascentwind.runners.flight_load.limit_table import LimitError
from ascentwind.runners.flight_load.limits import limit_passage
from ascentwind.runners.measured_winds.random_wind import random_wind
from ascentwind.runners.measured_winds.wind_field import wind_field
from ascentwind.runners.station_loads.loads_along_vehicle import loads_along_vehicle

WINDOW = (62.0, 82.0)
STATIONS = aw.Limits(
    None, np.array([20.0, 30.0]), {"bending_moment": np.full((1, 2), 2.2e7)}, {"bending_moment": "N m"}
)
RESULTANT = aw.Limits.constant(2.2e7, "resultant_bending_moment", "N m")


@pytest.fixture(scope="module")
def both(cache):
    return Study.load("as504", changes={"planes": "both"})


def balloon(case, factor: float = 1.0) -> Sounding:
    """Return a balloon that measures the mean wind times a factor."""
    levels = np.arange(300.0, 13000.0, 300.0)
    mean = factor * random_wind(case, levels).mean.reshape(-1, levels.size)
    return Sounding("mean", "", None, levels, mean[0], mean[1] if len(mean) > 1 else 0 * levels)


@pytest.mark.slow
@pytest.mark.parametrize("planes", ["yaw", "both"])
@pytest.mark.parametrize("limits", [STATIONS, RESULTANT], ids=["stations", "resultant"])
@pytest.mark.filterwarnings("ignore::ascentwind.errors.UncheckedStationsWarning")
def test_far_from_launch_the_chance_is_the_seasons(planes, limits, cache, request):
    """Against the passage by the states, which knows no balloons: stations jointly, resultants of both planes."""
    if planes == "yaw" and limits is RESULTANT:
        with pytest.raises(LimitError, match="no such response"):
            request.getfixturevalue("as504").day_of_launch(
                balloon(request.getfixturevalue("as504")), 1.0, limits=limits
            )
        return
    case = request.getfixturevalue("as504" if planes == "yaw" else "both")
    season = limit_passage(case, limits, WINDOW, 0.00135, "both", 3000, 0).probability
    found = case.day_of_launch(balloon(case), 1e9, limits=limits, window=WINDOW).passage
    spread = np.hypot(season.standard_error, found.probability.standard_error)
    assert found.probability.value == pytest.approx(season.value, abs=4 * spread + 0.06 * season.value)
    assert {load.resultant for load in found.loads} == {planes == "both"}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ascentwind.errors.UncheckedStationsWarning")
def test_loads_at_stations_are_those_of_the_vehicle(as504):
    """Mean and sigma at a station far from launch, against the loads along the vehicle; weights against the mean."""
    found = as504.day_of_launch(balloon(as504), 1e9, limits=STATIONS, window=WINDOW)
    at = int(np.argmin(np.abs(found.times - 72.0)))
    sigma = loads_along_vehicle(as504, [float(found.times[at])])["std"].sel(source="combined")
    for r, row in enumerate(found.flight.loads.rows):
        here = sigma.sel(station=row.station, method="nearest").squeeze()
        assert found.std[at, r] == pytest.approx(float(here), rel=1e-4)
    weights = found.flight.weights
    season = weights.weight @ found.flight.field.wind.mean
    rest = found.flight.mean - season  # what is no wind's, here nearly nothing
    assert np.abs(rest).max() < 2e-3 * np.abs(found.flight.mean).max()


def test_deviations_act_in_the_days_mean(as504):
    """A day whose mean is the season's changes nothing; one of the doubled mean is the vehicle in a doubled mean."""
    names, forever = ["bending_moment"], aw.Persistence(np.inf)
    asked = {"window": WINDOW, "responses": names, "persistence": forever, "error": 1e-3}
    calm = as504.day_of_launch(balloon(as504), 0.0, **asked)
    # the mean lies on its cubic between the levels of the field, where what is added is straight
    np.testing.assert_allclose(calm.about_its_mean().std, calm.std, rtol=1e-5)
    field = wind_field(as504, float(calm.flight.field.levels[-1]))
    levels = field.levels[::3]
    doubled = 2 * np.interp(levels, field.levels, field.wind.mean)
    storm = as504.day_of_launch(Sounding("s", "", None, levels, doubled, 0 * levels), 0.0, **asked)
    about = storm.about_its_mean()
    np.testing.assert_allclose(about.mean, storm.mean)
    gained = about.flight.std[:, 0] ** 2 - storm.flight.std[:, 0] ** 2
    more = as504.with_parameters({"wind.mean_scale": 2.0}).response_statistics(storm.times[::40], responses=names)
    less = as504.response_statistics(storm.times[::40], responses=names)
    wanted = (more.variance - less.variance).sel(source="combined").values.ravel()
    assert np.abs(gained[::40] - wanted).max() < 5e-3 * np.abs(wanted).max()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ascentwind.errors.UncheckedStationsWarning")
def test_months_with_limits_along_stations(as504):
    """Every station is passed less often than all of them, and one response alone less often than its stations."""
    found = as504.availability(STATIONS, months=["february"], window=WINDOW, check_hours=3.0, threshold=0.2)
    assert 0 < found["probability"].item() < 1
    assert found["lower"].item() < found["probability"].item() < found["upper"].item()
    assert found["level"].sizes["response"] == 3
    assert 0 <= found["stopped"].item() < 1


@pytest.mark.slow
def test_months_with_a_limit_of_the_resultant(both):
    turned = np.radians([72.0, 252.0])
    found = both.availability(RESULTANT, months=["february"], azimuths=turned, window=WINDOW)
    assert found["level"].sizes == {"month": 1, "azimuth": 2, "response": 1}
    p, se = found["probability"].values[0], found["standard_error"].values[0]
    assert p[0] == pytest.approx(p[1], abs=4 * np.hypot(*se))  # the other way round: all wind turns its sign
    assert (found["spacing_error"] < 0.1).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"responses": ["bending_moment"]}, "is over stations of the structure; leave responses out"),
        ({"limits": aw.Limits(None, np.array([200.0, 300.0]), STATIONS.values, STATIONS.units)}, "has no station"),
        ({"limits": aw.Limits.constant(1.0, "bending_momant", "N m")}, "did you mean 'bending_moment'"),
    ],
)
@pytest.mark.filterwarnings("ignore::ascentwind.errors.UncheckedStationsWarning")
def test_what_cannot_be_limited_is_refused(as504, change, says):
    with pytest.raises(DataError, match=says):
        as504.day_of_launch(balloon(as504), 3.0, **({"limits": STATIONS, "window": WINDOW} | change))


def test_a_resultant_has_no_sides(both):
    with pytest.raises(LimitError, match="has no upper side"):
        both.day_of_launch(balloon(both), 3.0, limits=RESULTANT, window=WINDOW, sides="upper")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stations", "resultant"])
def test_the_page_of_the_command(kind, cache, tmp_path, monkeypatch, capsys):
    rows = [f"{h},{10 + h / 500:.2f},1" for h in range(300, 13000, 400)]
    (tmp_path / "b.csv").write_text("\n".join(["altitude [m],u [m/s],v [m/s]", *rows]))
    text = "station [m],bending_moment [N m]\n20,2.2e7\n30,2.2e7\n"
    if kind == "resultant":
        text = "time [s],resultant_bending_moment [N m]\n0,2.2e7\n150,2.2e7\n"
    (tmp_path / "l.csv").write_text(text)
    asked = [
        "day-of-launch",
        "as504",
        "--sounding",
        tmp_path / "b.csv",
        "--hours-before",
        3,
        "--limit",
        tmp_path / "l.csv",
    ]
    asked += [
        "--window",
        "65:80",
        "--out",
        tmp_path / "out",
        *(["--set", "planes=both"] if kind == "resultant" else []),
    ]
    monkeypatch.setattr("sys.argv", ["ascentwind", *map(str, asked)])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code, capsys.readouterr().err
    page = (tmp_path / "out" / "day_of_launch.md").read_text()
    for part in (
        "With the vehicle's deviations as in the season's mean flight",
        "the grid of times leaves",
        "passed by",
    ):
        assert part in page
    assert (tmp_path / "out" / "day_of_launch.png").exists()
