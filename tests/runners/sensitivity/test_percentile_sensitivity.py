"""Derivatives of a percentile of a resultant against differences of the percentile itself, and bad input."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from lag import lag

import ascentwind as aw
from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, PlanesError, TimeRangeError, UnknownNameError
from ascentwind.runners.flight_load.probability import root_between
from ascentwind.runners.sensitivity import percentile
from ascentwind.runners.sensitivity.derivative_figures import heading
from ascentwind.runners.station_loads.loads_along_vehicle import resultant_along_vehicle

MOMENTS = ("pitch_bending_moment", "yaw_bending_moment")
NAMES = ("wind.azimuth", "control.T1.gain", "thrust.sigma", "wind.mean_scale", "wind.sigma_scale", "bending.1.damping")


@pytest.fixture(scope="module")
def both():
    return aw.Study.load("as504", changes={"planes": "both"})


@pytest.mark.slow
@pytest.mark.parametrize("p", [0.00135, 0.2])
def test_differences_of_the_percentile(both, p):
    found = both.percentile_sensitivity("resultant_bending_moment", 75.0, p, parameters=NAMES)

    def level(changes: dict[str, float]) -> float:
        engine = aw.Sweep(relative_tolerance=1e-11)
        statistics = both.with_parameters(changes).response_statistics([75.0], engine=engine)
        return float(statistics.norm(*MOMENTS).percentile(p)[0])

    assert found.attrs["value"] == pytest.approx(level({}), rel=1e-8)
    for name in NAMES:
        at = both.parameters[name].value
        step = 2e-3 * abs(at)
        a, b, c, d = (level({name: at + k * step}) for k in (-2, -1, 1, 2))
        expected = (8 * (c - b) - (d - a)) / (12 * step)
        assert float(found["derivative"].sel(parameter=name)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_the_wind_as_a_whole_and_its_tables_agree(both):
    """A percent of sigma is a percent of every row of both components' H: the factor and the tables are two roads."""
    found = both.percentile_sensitivity("resultant_bending_moment", 75.0, parameters=["wind.sigma_scale"])
    rows = [name for name in found["table"].values if str(name).startswith("wind_filter.H_")]
    by_tables = float(found["table_elasticity"].sel(table=rows).sum())
    assert by_tables == pytest.approx(float(found["elasticity"][0]), rel=1e-6)


@pytest.mark.slow
def test_resultant_along_the_vehicle_at_a_load_station_is_that_of_the_output(both):
    found = resultant_along_vehicle(both, [60.0, 75.0], slosh_reaction=False)
    k = int(np.argmin(np.abs(found["station"].values - 25.0)))
    law = both.response_statistics([60.0, 75.0]).norm(*MOMENTS)
    np.testing.assert_allclose(found["level"].values[:, k], law.percentile(), rtol=1e-6)
    combined = found["plane_covariance"].sel(source="combined").values[:, k]
    np.testing.assert_allclose(combined, law.covariance, rtol=1e-5)


@pytest.fixture(scope="module")
def swelling(cache) -> aw.Study:
    """Two Brownian motions through outputs that swell and fade: both planes have sigma a sqrt(t) sin(pi t / 2)."""
    t, x, y, n, m, a = (ca.SX.sym(name) for name in ("t", "x", "y", "n", "m", "a"))
    gain = ca.sin(np.pi * t / 2)
    system = define_system(
        "swelling",
        time=t,
        states={"x": (x, n), "y": (y, m)},
        noises={"n": n, "m": m},
        parameters={"a": (a, 3.0)},
        outputs={"pitch_load": a * gain * x, "yaw_load": a * gain * y, "pitch_angle": x, "yaw_angle": y},
        end=2.0,
    )
    units = {"pitch_angle": "rad", "yaw_angle": "deg"}
    outputs = tuple(replace(o, unit=units.get(o.name, "N m")) for o in system.outputs)
    return aw.Study.from_system(replace(system, outputs=outputs))


def test_the_peak_of_a_level_between_output_times(swelling):
    """Rayleigh's level sigma sqrt(-2 ln p) is largest where 1 / 2 t + (pi / 2) / tan(pi t / 2) vanishes."""
    found = swelling.percentile_sensitivity("resultant_load", "peak", 0.01)
    time = root_between(lambda t: 0.5 / t + 0.5 * np.pi / np.tan(0.5 * np.pi * t), 1.0, 1.9, 1e-12)
    assert found.attrs["t2_s"] == pytest.approx(time, abs=1e-4)
    level = 3.0 * np.sqrt(time) * np.sin(np.pi * time / 2) * np.sqrt(-2 * np.log(0.01))
    assert found.attrs["value"] == pytest.approx(level, rel=1e-7)
    assert float(found["derivative"][0]) == pytest.approx(level / 3.0, rel=1e-7)
    assert (found.attrs["at_peak"], found.attrs["peak_at_end_of_range"]) == (1, 0)
    assert heading(found).startswith("the level of resultant load passed with 0.01 at 1.169 s: 9.499")


def test_refused_of_a_small_system(swelling):
    with pytest.raises(TimeRangeError, match="give seconds or 'peak'"):
        swelling.percentile_sensitivity("resultant_load", "largest")
    with pytest.raises(ParameterValueError, match="'pitch_angle' is in rad and .* no norm"):
        swelling.percentile_sensitivity("resultant_angle", 1.0)


def test_refused():
    study = lag()
    with pytest.raises(PlanesError, match="both planes"):
        study.percentile_sensitivity("resultant_bending_moment", 1.0)


@pytest.mark.slow
def test_refused_of_both(both):
    with pytest.raises(UnknownNameError, match="did you mean 'resultant_bending_moment'"):
        both.percentile_sensitivity("resultant_bending_momen", 75.0)
    with pytest.raises(ParameterValueError, match="probability"):
        both.percentile_sensitivity("resultant_bending_moment", 75.0, 1.5)
    with pytest.raises(TimeRangeError):
        both.percentile_sensitivity("resultant_bending_moment", 500.0)


def test_all_derivatives_cost_one_law_one_flight_and_two_adjoint_pairs(swelling, monkeypatch):
    """However many parameters: the work is some four tables of both planes, of which this is the count."""
    made = {name: 0 for name in ("AdjointPair", "_laws", "until")}

    def counted(name: str, of):
        def call(*args, **options):
            made[name] += 1
            return of(*args, **options)

        return call

    monkeypatch.setattr(percentile, "AdjointPair", counted("AdjointPair", percentile.AdjointPair))
    monkeypatch.setattr(percentile, "_laws", counted("_laws", percentile._laws))
    monkeypatch.setattr(percentile.FlightNodes, "until", counted("until", percentile.FlightNodes.until))
    for parameters in (None, ["a"]):
        made.update(dict.fromkeys(made, 0))
        swelling.percentile_sensitivity("resultant_load", 1.0, 0.01, parameters)
        assert made == {"AdjointPair": 2, "_laws": 1, "until": 1}
