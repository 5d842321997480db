"""Turbulence, two components, flight time, filter files, the vehicle's wind and the command line."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from typer.testing import CliRunner

from ascentwind.model.errors import DataError, ExtrapolationWarning, UnknownNameError
from ascentwind.model.tables import Table, table_values
from ascentwind.model.wind.filter_file import filter_text, read_filter
from ascentwind.model.wind.range_reference import shipped_statistics, shipped_two_components
from ascentwind.model.wind.shaping_filter import entry_name
from ascentwind.model.wind.statistics import WindModel
from ascentwind.model.wind.turbulence import (
    FORMS,
    LENGTH,
    add_filters,
    transverse_spectrum,
    turbulence_filter,
    turbulence_intensity,
)
from ascentwind.model.wind.two_components import plane_weights, wind_in_plane
from ascentwind.runners.cli.app import app
from ascentwind.runners.views.wind_comparison import stretched_to_error
from ascentwind.runners.wind.fitting.altitude_grid import propagated_covariance
from ascentwind.runners.wind.synthesis.linear_regression import FIRST_2, FIRST_3, SECOND_2, SECOND_3, THIRD_3
from ascentwind.runners.wind.synthesis.synthesise import synthesise
from ascentwind.runners.wind.two_component_fit import cross_covariance, fit_noise_correlation
from ascentwind.runners.wind.verification import simulate_profiles, standard_deviation, verify


@pytest.fixture(scope="module")
def march(fit):
    statistics = shipped_statistics()
    return fit(statistics).shaping_filter, statistics


def spectrum(shaping_filter, altitude: float, wave_number: float) -> float:
    F, G, H = shaping_filter.at(altitude)
    response = H @ np.linalg.solve(1j * wave_number * np.eye(len(F)) - F, G[:, 0])
    return float(np.abs(response) ** 2 / np.pi)


@pytest.mark.parametrize(("form", "factor"), [("dryden", 1.0001), ("von-karman-2", 1.6), ("von-karman-3", 1.09)])
def test_turbulence_spectrum_to_twenty_radians_a_second(form, factor):
    shaping_filter = turbulence_filter(form)
    sigma = float(turbulence_intensity().polynomial(9000.0))
    # 20 rad/s at 500 m/s
    for wave_number in np.geomspace(0.1 / LENGTH, 20 / 500, 12):
        wanted = transverse_spectrum(form[:10] if form.startswith("von") else form, wave_number, sigma, LENGTH)
        assert 1 / factor < spectrum(shaping_filter, 9000.0, wave_number) / wanted < factor


@pytest.mark.parametrize("form", FORMS)
def test_turbulence_has_its_intensity_from_the_ground_up(form):
    shaping_filter = turbulence_filter(form, "severe")
    sigma = turbulence_intensity("severe").polynomial(np.clip(shaping_filter.altitude, 152.0, 24384.0))
    # the rational von Karman forms hold 0.962 to 1.034 of the variance
    assert standard_deviation(shaping_filter) == pytest.approx(sigma, rel=0.025)


def test_high_pass_takes_out_what_the_soundings_hold():
    whole, above = turbulence_filter(), turbulence_filter(high_pass=2000.0)
    low, high = 2 * np.pi / 50000, 2 * np.pi / 50
    assert spectrum(above, 5000.0, low) < 0.01 * spectrum(whole, 5000.0, low)
    assert spectrum(above, 5000.0, high) == pytest.approx(spectrum(whole, 5000.0, high), rel=0.01)


@pytest.mark.slow
def test_sum_of_filters_adds_variances_and_correlates_on_request(march):
    large, _ = march
    small = turbulence_filter(altitude=(0.0, 20000.0))
    h = np.array([5000.0, 10000.0])
    both = propagated_covariance(add_filters(large, small), h)
    parts = [propagated_covariance(f, h) for f in (large, small)]
    assert both == pytest.approx(parts[0] + parts[1], rel=1e-3)
    r = Table("r", "1", np.array([0.0, 20000.0]), np.array([0.5, 0.5]), "linear")
    assert propagated_covariance(add_filters(large, small, r), h)[0, 0] > both[0, 0]
    with pytest.raises(DataError, match="share no altitudes"):
        add_filters(large, turbulence_filter(altitude=(17000.0, 20000.0)))


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"form": "dryen"}, UnknownNameError, "dryden"),
        ({"severity": "sever"}, UnknownNameError, "severe"),
        ({"altitude": (5000.0, 0.0)}, DataError, "range"),
        ({"high_pass": 0.0}, DataError, "high pass"),
        ({"length": -1.0}, DataError, "positive"),
    ],
)
def test_bad_turbulence(arguments, error, says):
    with pytest.raises(error, match=says):
        turbulence_filter(**arguments)


@pytest.mark.slow
def test_two_components_have_the_intralevel_correlation(fit):
    both = shipped_two_components()
    zonal, meridional = (fit(s).shaping_filter for s in (both.zonal, both.meridional))
    deviations = (both.zonal.standard_deviation, both.meridional.standard_deviation)
    h = both.zonal.altitude
    r, start = fit_noise_correlation(zonal, meridional, h, both.intralevel_correlation, deviations)
    found = cross_covariance(zonal, meridional, r, h, start) / (deviations[0] * deviations[1])
    # at the surface exactly; above, 80 samples give +-.18
    assert found[0] == pytest.approx(both.intralevel_correlation[0], abs=1e-12)
    assert found == pytest.approx(both.intralevel_correlation, abs=0.03)
    # a second road: the two as one filter, simulated
    joint = add_filters(zonal, meridional, r, start)
    u, v = (_seen(joint, range(i, i + 3)) for i in (0, 3))
    levels = h[[0, 5, 12]]
    a, b = (simulate_profiles(f, levels, 20000, seed=7) for f in (u, v))
    at = [0, 5, 12]
    assert np.mean(a * b, axis=0) / (deviations[0] * deviations[1])[at] == pytest.approx(found[at], abs=0.03)
    # in a plane: var(a u + b v) at the surface, with weights of either sign
    winds = WindModel(both.zonal.mean_table(), zonal), WindModel(both.meridional.mean_table(), meridional)
    for azimuth in (np.radians(72.0), np.radians(108.0)):
        x, y = plane_weights(azimuth, "yaw")
        total = wind_in_plane(*winds, azimuth, noise_correlation=r, start_correlation=start)
        su, sv = deviations[0][0], deviations[1][0]
        wanted = (x * su) ** 2 + (y * sv) ** 2 + 2 * x * y * su * sv * start
        assert standard_deviation(total.shaping_filter)[0] ** 2 == pytest.approx(wanted, rel=1e-9)


def _seen(joint, states):
    H = np.zeros_like(joint.H)
    H[:, list(states)] = joint.H[:, list(states)]
    return replace(joint, H=H)


def test_wind_in_the_plane_of_a_launch():
    assert plane_weights(np.pi / 2, "pitch") == pytest.approx((1.0, 0.0))
    assert plane_weights(np.radians(72.0), "yaw") == pytest.approx((0.30902, -0.95106), abs=1e-5)
    both = shipped_two_components("march", top=6000.0)
    winds = [WindModel(s.mean_table(), synthesise(s, order=2).shaping_filter) for s in (both.zonal, both.meridional)]
    yaw = wind_in_plane(winds[0], winds[1], np.radians(72.0), "yaw")
    c, s = np.cos(np.radians(72.0)), np.sin(np.radians(72.0))
    assert yaw.mean.values[-1] == pytest.approx(c * both.zonal.mean[-1] - s * both.meridional.mean[-1])
    h = both.zonal.altitude
    wanted = c**2 * both.zonal.standard_deviation**2 + s**2 * both.meridional.standard_deviation**2
    assert np.diag(propagated_covariance(yaw.shaping_filter, h)) == pytest.approx(wanted, rel=1e-3)
    with pytest.raises(DataError, match="degrees"):
        plane_weights(72.0, "yaw")
    with pytest.raises(UnknownNameError, match="yaw"):
        plane_weights(1.0, "yew")


def test_flight_time_gives_the_variance_of_altitude(march):
    """Appendix E along a trajectory of changing climb rate: z' = hdot F z + sqrt(hdot) G n."""
    from scipy.integrate import solve_ivp

    shaping_filter, statistics = march
    h = statistics.altitude

    def climb(t: float) -> tuple[float, float]:
        return 3.0 + 5.0 * t + 1.2 * t * t, 5.0 + 2.4 * t

    def rate(t: float, p: np.ndarray) -> np.ndarray:
        altitude, speed = climb(t)
        F, G, _ = shaping_filter.at(altitude)
        P = p.reshape(3, 3)
        return (speed * (F @ P + P @ F.T) + np.sqrt(speed) ** 2 * G @ G.T).ravel()

    end = 80.0
    P = solve_ivp(rate, (0, end), 0.3 * shaping_filter.start_covariance.ravel(), rtol=1e-9, atol=1e-12).y[:, -1]
    H = shaping_filter.at(climb(end)[0])[2]
    weaker = replace(shaping_filter, start_covariance=0.3 * shaping_filter.start_covariance)
    in_altitude = propagated_covariance(weaker, np.array([h[0], climb(end)[0]]))[1, 1]
    assert H @ P.reshape(3, 3) @ H == pytest.approx(in_altitude, rel=1e-6)


def test_appendix_d_derived_again():
    """D-10 is right; D-8 as printed is not the derivative."""
    h, psi, B = sp.symbols("h psi B")
    alpha, omega = sp.Function("alpha")(h), sp.Function("omega")(h)
    g = B * sp.exp(alpha * h) * sp.cos(omega * h + psi)
    p, q = sp.diff(alpha * h, h), sp.diff(omega * h, h)
    bend, turn = 2 * sp.diff(alpha, h) + sp.diff(alpha, h, 2) * h, 2 * sp.diff(omega, h) + sp.diff(omega, h, 2) * h
    # D-10, coefficients of g and of its derivative
    a2 = 2 * p + turn / q
    a3 = bend - q**2 - p**2 - turn / q * p
    residual = sp.simplify((sp.diff(g, h, 2) - a2 * sp.diff(g, h) - a3 * g) / g)
    assert residual == 0
    # D-8 as printed: omega + omega' in the place of omega + omega' h in its fourth term
    cosine, sine = B * sp.exp(alpha * h) * sp.cos(omega * h + psi), B * sp.exp(alpha * h) * sp.sin(omega * h + psi)

    def d8(fourth):
        return (p**2 + bend - q**2) * cosine - (p * q + p * fourth + turn) * sine

    assert sp.simplify(sp.diff(g, h, 2) - d8(q)) == 0
    assert sp.simplify(sp.diff(g, h, 2) - d8(omega + sp.diff(omega, h))) != 0


def test_appendix_b_formulas_are_exact_for_polynomials():
    """(B-8) to (B-22) on powers of the point; the printed forms differ only where noted in docs/wind.md."""
    for points, tables in ((3, (FIRST_2, SECOND_2)), (4, (FIRST_3, SECOND_3, THIRD_3))):
        x = np.arange(points)
        for order, table in enumerate(tables, start=1):
            for power in range(3 if points == 3 or order == 1 else 4):
                wanted = np.polyval(np.polyder([1] + [0] * power, order), x)
                if power < 3 or order > 1:
                    assert table @ x**power == pytest.approx(wanted), (points, order, power)


def test_filters_survive_their_file(tmp_path, march):
    shaping_filter, _ = march
    file = tmp_path / "filter.json"
    file.write_text(filter_text(shaping_filter))
    again = read_filter(file)
    for name in ("altitude", "F", "G", "H", "start_covariance"):
        assert np.array_equal(getattr(again, name), getattr(shaping_filter, name))
    for text, says in (("{", "not a wind filter"), ('{"format": 2}', "format"), ('{"format": 1}', "lacks")):
        file.write_text(text)
        with pytest.raises(DataError, match=says):
            read_filter(file)
    with pytest.raises(DataError, match="cannot be read"):
        read_filter(tmp_path / "none.json")


@pytest.mark.slow
def test_fitted_filter_moves_the_bending_variance_by_less_than_one_percent(as504_closed_form):
    """Against the closed form it was fitted to."""
    statistics = shipped_statistics(top=30000.0, third_order=True)
    with pytest.warns(ExtrapolationWarning, match="30000 m"):
        wind = WindModel(statistics.mean_table(), synthesise(statistics).shaping_filter)
        fitted = as504_closed_form.with_wind(wind)
    one, other = (
        float(s.response_statistics([75.0]).variance.sel(response="bending_moment", source="wind", time=75.0))
        for s in (as504_closed_form, fitted)
    )
    assert other == pytest.approx(one, rel=0.01)
    assert other != one


def test_a_flight_above_the_filter_is_told(as504, march):
    shaping_filter, _ = march
    with pytest.warns(ExtrapolationWarning, match="16000 m"):
        as504.with_wind(replace(as504.vehicle.wind, shaping_filter=shaping_filter))


def test_a_filter_is_held_where_the_mean_wind_goes_on(as504, march, fit):
    """The mean covers 3 m to 30 km, the filters less at both ends: their coefficients are the end values there."""
    shaping_filter, statistics = march
    middle = fit(statistics.between(2000.0, 16000.0), "constrained-response").shaping_filter
    for f, times in ((shaping_filter, (100.0, 110.0)), (middle, (12.0, 25.0, 100.0))):
        with pytest.warns(ExtrapolationWarning):
            study = as504.with_wind(replace(as504.vehicle.wind, shaping_filter=f))
        for time in times:
            altitude = study.vehicle.tables["altitude"].polynomial(time)
            F, _, H = f.at(altitude)
            inspected = table_values(study.executable.groups, time)
            for label, i, j in f.entries:
                if label in "FH":
                    wanted = F[i, j] if label == "F" else H[j]
                    assert inspected[entry_name(label, i, j)] == pytest.approx(wanted, rel=1e-12, abs=1e-18)


def test_vehicle_takes_a_filter_file(vehicle_folder, march):
    from ascentwind.model.vehicle.reader import load_vehicle

    shaping_filter, _ = march
    (vehicle_folder / "filter.json").write_text(filter_text(shaping_filter))
    toml = vehicle_folder / "vehicle.toml"
    shipped = toml.read_text()
    text = shipped.replace('"wind_march_zonal_filter.json"', '"filter.json"')
    assert text != shipped

    def found(changed: str):
        toml.write_text(changed)
        return load_vehicle(vehicle_folder)

    vehicle = found(text)
    assert np.array_equal(vehicle.wind.shaping_filter.F, shaping_filter.F)
    assert next(s for s in vehicle.sources if s.name == "wind.filter").file.name == "filter.json"
    chosen, file = 'synthesis = "fitted"', 'filter = "filter.json"\n'
    before, _, after = text.partition("\n[wind.correlation]")
    without_kernel = before + after[after.index("\n[") :]
    # alone each needs no choice; together they do, and a choice needs what it names
    alone = found(without_kernel.replace(chosen, ""))
    assert np.array_equal(alone.wind.shaping_filter.F, shaping_filter.F)
    closed = found(text.replace(file, "").replace(chosen, ""))
    assert closed.wind.shaping_filter.name == "two_part_kernel"
    assert found(text.replace(chosen, 'synthesis = "closed_form"')).wind.shaping_filter.name == "two_part_kernel"
    for changed, says in (
        (text.replace(chosen, ""), "choose with synthesis"),
        (text.replace(file, ""), "no filter"),
        (without_kernel.replace(chosen, 'synthesis = "closed_form"'), "no .wind.correlation."),
        (without_kernel.replace(chosen, "").replace(file, ""), "needs filter"),
        (text.replace('"table"   #', '"cr103010_fit"   #'), "only the closed form"),
    ):
        assert changed != text
        with pytest.raises(DataError, match=says):
            found(changed)


@pytest.mark.slow
def test_shipped_filter_is_the_fit_it_says(as504):
    """The command in the file, run again, gives its covariances; against the data by the engine, not the fit."""
    shipped = as504.vehicle.wind.shaping_filter
    assert "--edition 1983 --top 30000" in shipped.source
    statistics = shipped_statistics(top=30000.0)
    again = synthesise(statistics, noises=2)
    check = verify(shipped, statistics)
    assert check.covariance == pytest.approx(again.covariance, rel=1e-3, abs=1e-3)
    assert check.rms_error < 0.25
    assert check.share_inside == 1.0
    assert check.largest_pole < -1e-6


def test_poorer_filters_are_as_wrong_as_asked(march):
    shaping_filter, statistics = march
    poorer = stretched_to_error(shaping_filter, statistics, 14.0)
    error = propagated_covariance(poorer, statistics.altitude) - statistics.covariance
    assert np.sqrt(np.mean(error[np.triu_indices(len(error))] ** 2)) == pytest.approx(14.0, rel=0.01)
    assert np.diag(error) == pytest.approx(0, abs=1e-3)


def test_command_line(tmp_path):
    runner = CliRunner()
    file = tmp_path / "f.json"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit = runner.invoke(app, ["wind", "fit", "--top", "6000", "--order", "2", "--out", str(file)])
    assert fit.exit_code == 0, fit.output
    assert "converged" in fit.output
    check = runner.invoke(app, ["wind", "check", str(file), "--top", "6000", "--profiles", "500"])
    assert "100.0 %" in check.output
    stats = runner.invoke(app, ["wind", "stats", "--component", "meridional"])
    assert "14.05" in stats.output  # v at 11 km, RCC 361-83
    plot = runner.invoke(app, ["wind", "plot", str(file), "--top", "6000", "--out", str(tmp_path / "figures")])
    assert plot.exit_code == 0, plot.output
    assert len([*(tmp_path / "figures").glob("*.png"), *(tmp_path / "figures").glob("*.svg")]) == 8
