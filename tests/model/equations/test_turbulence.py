"""Turbulence in a vehicle's equations: against its filter over altitude, closed forms, and by every engine."""

from __future__ import annotations

import numpy as np
import pytest

import ascentwind as aw
from ascentwind.model.system.names import TURBULENCE, WIND
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.wind.turbulence import FORMS, INTENSITY, LENGTH, turbulence_filter
from ascentwind.runners.case.climb import Climb
from ascentwind.runners.cli.job import load_study

AS504 = built_in_vehicles()["as504"]
ON = {"wind.turbulence.severity": "moderate", "options.gust_zones": 1}  # the whole vehicle feels it at once
TIME, ALTITUDE, HIGH_PASS = 70.0, 9000.0, 2000.0  # the altitude is a sample of the filter that stands alone


@pytest.fixture(scope="module")
def gusty(cache) -> aw.Study:
    return aw.Study.load("as504", changes=ON)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("high_pass", [HIGH_PASS, None])
def test_states_are_the_filter_over_altitude(cache, form, high_pass):
    """Rates, noise, the wind that is met and the start are those of the filter that stands alone."""
    changes = ON | {"wind.turbulence.form": form, "wind.turbulence.high_pass_m": high_pass or "none"}
    study = aw.Study.load("as504", changes=changes, compile=False)
    alone = turbulence_filter(form, high_pass=high_pass)
    time = float(Climb.of(study).time_at(ALTITUDE))
    A, B, C, _ = study.matrices(time)
    rows, tables = study.system.block(TURBULENCE), study.tables(time)
    F, G, H = alone.at(ALTITUDE)
    rate = tables["altitude_rate"]
    np.testing.assert_allclose(A[rows, rows], rate * F, rtol=1e-10)
    (column,) = study.system.noise_columns(TURBULENCE)
    np.testing.assert_allclose(B[rows, column], np.sqrt(rate) * G[:, 0], rtol=1e-10)
    alpha = C[study.system.output_index("angle_of_attack"), rows]
    np.testing.assert_allclose(alpha * tables["relative_velocity"], H, rtol=1e-9)
    P = study.system.start_covariance_matrix(TURBULENCE, study.executable.parameters)
    np.testing.assert_allclose(P[rows, rows], alone.start_covariance, rtol=1e-9, atol=1e-12)
    P = P.copy()
    P[rows, rows] = 0
    assert not P.any()


def test_high_pass_leaves_its_closed_form():
    """Of R = sigma^2 e^(-x/L) (1 - x/2L) a first-order high pass of corner c leaves a/(a + c) + a c / 2 (a + c)^2."""
    a, c = 1 / LENGTH, 2 * np.pi / HIGH_PASS
    alone = turbulence_filter("dryden", high_pass=HIGH_PASS)
    sigma = turbulence_filter("dryden").H
    whole = np.linalg.norm(sigma[0] @ np.linalg.cholesky(turbulence_filter("dryden").start_covariance))
    left = alone.H[0] @ alone.start_covariance @ alone.H[0]
    assert left == pytest.approx(whole**2 * (a / (a + c) + a * c / (2 * (a + c) ** 2)), rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("wavelength", [200.0, 2000.0, 20000.0])
def test_of_every_wave_the_high_pass_leaves_its_share(form, wavelength):
    """W^2 / (W^2 + c^2): half at the wavelength given, a hundredth where soundings know it, all of the short ones."""
    omega = 2 * np.pi / wavelength

    def power(alone) -> float:
        F, G, H = alone.at(ALTITUDE)
        return float(np.abs(H @ np.linalg.solve(1j * omega * np.eye(alone.order) - F, G[:, 0])) ** 2)

    share = power(turbulence_filter(form, high_pass=HIGH_PASS)) / power(turbulence_filter(form))
    assert share == pytest.approx(1 / (1 + (wavelength / HIGH_PASS) ** 2), rel=1e-9)


def test_it_is_a_source_of_its_own_beside_an_unchanged_wind(as504, gusty):
    found, plain = (s.response_statistics([TIME]) for s in (gusty, as504))
    assert gusty.system.sources == (WIND, TURBULENCE, "thrust", "center_of_pressure")
    for source in plain["source"].values[:-1]:
        kept = found["std"].sel(source=source)
        np.testing.assert_allclose(kept, plain["std"].sel(source=source), rtol=2e-5)
    np.testing.assert_allclose(found["mean"].sel(source="combined"), plain["mean"].sel(source="combined"), rtol=1e-5)
    rise = float((found["std"] / plain["std"]).sel(source="combined", response="bending_moment").squeeze()) - 1
    assert 0.01 < rise < 0.06, "moderate turbulence adds some per cent"


@pytest.mark.slow
def test_engines_agree(gusty):
    engines = (aw.Sweep(relative_tolerance=1e-9), aw.Cvodes(relative_tolerance=1e-9), "covariance")
    first, *others = (gusty.response_statistics([TIME], engine=engine) for engine in engines)
    for other in others:
        np.testing.assert_allclose(other["std"].sel(source=TURBULENCE), first["std"].sel(source=TURBULENCE), rtol=2e-5)


def test_parameters_are_what_a_file_says(gusty):
    """Twice the scale is twice sigma; another length by parameter is that length in the file."""
    asked = {"response": "bending_moment", "source": TURBULENCE, "time": TIME}

    def std(study: aw.Study) -> float:
        return float(study.response_statistics([TIME], engine=aw.Sweep(relative_tolerance=1e-9))["std"].sel(asked))

    whole = std(gusty)
    assert std(gusty.with_parameters({"turbulence.sigma_scale": 2.0})) == pytest.approx(2 * whole, rel=1e-6)
    changes = {"wind.turbulence.length_m": 300.0, "wind.turbulence.high_pass_m": 1500.0}
    by_file = aw.Study.load("as504", changes=ON | changes)
    by_parameter = gusty.with_parameters({"turbulence.length": 300.0, "turbulence.high_pass": 1500.0})
    assert std(by_parameter) == pytest.approx(std(by_file), rel=1e-9)
    assert std(by_file) != pytest.approx(whole, rel=1e-2)
    for name in ("turbulence.length", "turbulence.high_pass"):
        with pytest.raises(aw.errors.ParameterValueError):
            gusty.with_parameters({name: -1.0})


@pytest.mark.slow
def test_derivatives_are_those_of_differences(gusty):
    found = gusty.check_sensitivity(
        "angle_of_attack", TIME, source=TURBULENCE, parameters=["turbulence.length", "turbulence.high_pass"]
    )
    assert found["agrees"].values.all()


@pytest.mark.slow
def test_correlated_with_the_wind_when_asked(gusty):
    """The noise keeps its size: r of it is the first noise of the wind's filter, the rest its own."""
    r = 0.6
    study = aw.Study.load("as504", changes=ON | {"wind.turbulence.correlation": r})
    _, B, _, _ = study.matrices(TIME)
    _, apart, _, _ = gusty.matrices(TIME)
    rows = study.system.block(TURBULENCE)
    (own,), first = study.system.noise_columns(TURBULENCE), study.system.noise_columns(WIND)[0]
    np.testing.assert_allclose(B[rows, first], r * apart[rows, own], rtol=1e-12)
    np.testing.assert_allclose(B[rows, own], np.sqrt(1 - r**2) * apart[rows, own], rtol=1e-12)
    both = study.response_statistics([TIME])["variance"].sel(response="angle_of_attack", time=TIME)
    plain = gusty.response_statistics([TIME])["variance"].sel(response="angle_of_attack", time=TIME)
    share = float(both.sel(source=TURBULENCE) / plain.sel(source=TURBULENCE))
    assert share == pytest.approx(1 - r**2, rel=1e-3)


@pytest.mark.slow
def test_a_table_of_ones_own(edit):
    """Constant sigma of 2 m/s is twice that of 1 m/s; what the table does not cover is told."""
    section = (
        '[wind.turbulence]\nform = "von-karman-3"\n[wind.turbulence.intensity]\nfile = "own.csv"\n'
        'status = "assumed"\nsource = "test"\ninterpolation = "linear"\n\n[options]'
    )
    folder, std = edit("[options]", section), []
    for sigma in (1.0, 2.0):
        (folder / "own.csv").write_text(f"altitude [m],sigma [m/s]\n0,{sigma}\n40000,{sigma}\n")
        study = aw.Study.load(folder)
        assert study.tables(TIME)[INTENSITY] == sigma
        found = study.response_statistics([TIME])["std"]
        std.append(float(found.sel(source=TURBULENCE, response="angle_of_attack", time=TIME)))
    assert std[1] == pytest.approx(2 * std[0], rel=1e-4)
    (folder / "own.csv").write_text("altitude [m],sigma [m/s]\n0,1\n9000,1\n")
    with pytest.warns(aw.errors.ExtrapolationWarning, match="the turbulence's intensity: the flight is above 9000 m"):
        aw.load_vehicle(folder)


def test_another_wind_keeps_the_turbulence(gusty, as504):
    assert gusty.with_wind(as504.vehicle.wind).system.sources == gusty.system.sources
    assert "turbulence" not in as504.system.sources


def test_off_keeps_the_rest(as504):
    study = aw.Study.load("as504", changes={"wind.turbulence.severity": "off", "wind.turbulence.length_m": 300.0})
    assert study.system.sources == as504.system.sources


BAD = [
    ({"severity": "sever"}, "wind.turbulence.severity"),
    ({"severity": -1}, "wind.turbulence.severity"),
    ({"length_m": 300.0}, "needs severity"),
    ({"severity": "light", "length_m": 0.0}, "wind.turbulence.length_m"),
    ({"severity": "light", "high_pass_m": -5.0}, "wind.turbulence.high_pass_m"),
    ({"severity": "light", "high_pass_m": 1e6}, "no wave of theirs"),
    ({"severity": "light", "correlation": 1.0}, "wind.turbulence.correlation"),
    ({"severity": "light", "form": "karman"}, "wind.turbulence.form"),
    ({"severity": "light", "sigma": 1.0}, "is not a key here"),
    ({"severity": "light", "intensity": {"file": "x.csv", "status": "found", "source": "x"}}, "keep one"),
]


@pytest.mark.parametrize(("section", "says"), BAD, ids=[str(section) for section, _ in BAD])
def test_bad_sections_are_refused(section, says):
    with pytest.raises(aw.errors.DataError, match=says):
        aw.load_vehicle(AS504, changes={f"wind.turbulence.{key}": value for key, value in section.items()})


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("0,1\n9000,-1\n", "not allowed below zero"),
        ("0,1\n9000,400\n", "a turbulence of 400 m/s at 9000 m is none"),
        ("0,1\n", "rows"),
        ("100000,1\n200000,1\n", "feet or millimetres"),
        ("0,1\n1000,1\n", "one value would be held"),
    ],
)
def test_bad_tables_are_refused(edit, rows, says):
    section = '[wind.turbulence.intensity]\nfile = "own.csv"\nstatus = "assumed"\nsource = "test"\n\n[options]'
    folder = edit("[options]", section)
    (folder / "own.csv").write_text(f"altitude [m],sigma [m/s]\n{rows}")
    with pytest.raises(aw.errors.DataError, match=says) as told:
        aw.load_vehicle(folder)
    assert "own.csv" in str(told.value)


def test_the_command_line_names_a_severity():
    assert load_study("as504", turbulence="moderate").system.sources[1] == TURBULENCE
    with pytest.raises(aw.errors.UnknownNameError, match="moderate"):
        load_study("as504", turbulence="moderat")
    with pytest.raises(aw.errors.UnusedOptionError, match="two severities"):
        load_study("as504", ['wind.turbulence.severity="light"'], turbulence="moderate")


def test_a_noise_of_that_name_is_refused(edit):
    folder = edit("[noise.thrust]", "[noise.turbulence]")
    with pytest.raises(aw.errors.DataError, match="rename it"):
        aw.load_vehicle(folder)
