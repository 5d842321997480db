"""Gust penetration: zones that add up to the vehicle, delays in the frequency domain, exact delays, doubled zones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ascentwind as aw
from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.equations.noise import DEVIATION
from ascentwind.model.equations.penetration import DELAYS
from ascentwind.model.system.names import WIND
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.vehicle.zones import AHEAD, PREFIX
from ascentwind.runners.station_loads.loads_along_vehicle import loads_along_vehicle
from ascentwind.runners.statistics.exact_penetration import check_gust_penetration

AS504 = built_in_vehicles()["as504"]
ZONES = {"options.gust_zones": 5}
GUSTY = {"wind.turbulence.severity": "moderate"}
TIME, RESPONSES = 70.0, ("bending_moment", "angle_of_attack", "engine_angle")


@pytest.fixture(scope="module")
def zoned(cache) -> aw.Study:
    return aw.Study.load("as504", changes=ZONES)


def parts(study: aw.Study, time: float = TIME):
    """Return the plant's A, what each zone's wind puts into it, its outputs C, and what each puts into those."""
    system = study.system
    A, _, C, _ = study.matrices(time)
    E, G = MatrixEvaluator(study.with_means, ("E", "G"))(time, system.start, system.end)
    plant = np.array([s.block not in (WIND, DELAYS, DEVIATION) for s in system.states])
    wind = system.input_names.index(WIND)
    winds = np.array([k for k, s in enumerate(system.states) if s.name.startswith("zone_wind")], int)
    into = np.column_stack([E[plant, wind], A[np.ix_(plant, winds)]])
    return A[np.ix_(plant, plant)], into, C[:, plant], np.column_stack([G[:, wind], C[:, winds]])


@pytest.mark.parametrize("time", [40.0, 70.0, 100.0])
def test_zones_add_up_to_the_vehicle(as504, zoned, time):
    """Their columns of E and G sum to those of a vehicle that feels one wind, and nothing else changes."""
    A, E, C, G = parts(as504, time)
    of_zones, into, seen, direct = parts(zoned, time)
    assert into.shape[1] == 5
    np.testing.assert_allclose(of_zones, A, rtol=1e-12)
    np.testing.assert_allclose(seen, C, rtol=1e-12)
    np.testing.assert_allclose(into.sum(axis=1), E[:, 0], rtol=1e-9, atol=1e-12 * np.abs(E).max())
    np.testing.assert_allclose(direct.sum(axis=1), G[:, 0], rtol=1e-9, atol=1e-12 * np.abs(G).max())
    assert np.abs(direct).max() > 0


@pytest.mark.parametrize("name", built_in_vehicles())
def test_strips_add_up_to_the_tables(name):
    """C'_N, its moment and the modes' parts; and M'_alpha by S_1 and S_2, as the load's own table has it."""
    vehicle = aw.load_vehicle(built_in_vehicles()[name], changes=ZONES | {"options.slosh_reaction": True})
    assert vehicle.zones is not None
    strips, tables = vehicle.zones.strips, vehicle.tables
    t = strips.time[1:]
    at = {key: table.polynomial(t) for key, table in tables.items()}
    slope, moment = strips.slope[1:].sum(axis=1), strips.first_moment[1:].sum(axis=1)
    np.testing.assert_allclose(slope, at["normal_force_slope"], rtol=1e-8)
    np.testing.assert_allclose(moment, slope * at["center_of_pressure"], rtol=1e-7)
    for i, shape in enumerate(strips.displacement, start=1):
        whole = at[f"bending.{i}.normal_force_slope_times_displacement"]
        np.testing.assert_allclose(shape[1:].sum(axis=1), whole, atol=1e-7 * np.abs(whole).max())
    for load in vehicle.file.loads:
        forward = sum(at[f"{PREFIX}{load.output}_{j}"] for j in range(1, 6))
        first, second = (at[f"loads.{load.output}.{c}_moment"] for c in ("first", "second"))
        turned = (moment - at["center_of_gravity"] * slope) * second / at["moment_of_inertia"]
        made = at["dynamic_pressure"] * vehicle.file.reference_area_m2 * (forward - first / at["mass"] * slope - turned)
        stated = at[f"loads.{load.output}.angle_of_attack"]
        np.testing.assert_allclose(made, stated, atol=1e-3 * np.abs(stated).max())


def responses(A, E, C, G, omega: float) -> np.ndarray:
    return C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, E) + G


def met(study: aw.Study, omega: float) -> np.ndarray:
    """Return all outputs by a sinusoidal mean wind at the foremost zone, at matrices held still."""
    system = study.system
    A, E, C, G = MatrixEvaluator(study.executable, ("A", "E", "C", "G"))(TIME, system.start, system.end)
    wind = system.input_names.index(WIND)
    return responses(A, E[:, wind], C, G[:, wind], omega)


@pytest.mark.parametrize("omega", [0.5, 6.5, 12.4])
def test_a_sinusoidal_wind_is_delayed_from_zone_to_zone(zoned, omega):
    """sum_j (C (i w - A)^-1 E_j + G_j) e^(-i w tau_j), each element to its error: (w tau)^4 / 72 and less."""
    each = responses(*parts(zoned), omega)
    delays = [1 / zoned.tables(TIME)[f"{PREFIX}rate_{j}"] for j in range(1, 5)]
    s = 1j * omega * np.array(delays)
    element = (1 - s / 3) / (1 + 2 * s / 3 + s**2 / 6)
    chain = np.concatenate([[1.0], np.cumprod(element)])
    np.testing.assert_allclose(met(zoned, omega), each @ chain, rtol=1e-8, atol=1e-12 * np.abs(each).max())
    exact = np.concatenate([[1.0], np.exp(-np.cumsum(s))])
    assert (np.abs(element - np.exp(-s)) <= np.abs(s) ** 4 / 72 * 1.05 + 1e-12).all()
    missed = np.abs(each) @ np.concatenate([[0.0], np.cumsum(np.abs(s) ** 4 / 72)])
    assert (np.abs(met(zoned, omega) - each @ exact) <= 1.05 * missed + 1e-12 * np.abs(each).max()).all()
    name = zoned.system.output_index("bending_moment")
    at_once = each.sum(axis=1)
    if omega > 6:
        assert abs(met(zoned, omega)[name]) < 0.9 * abs(at_once[name]), "nose first bends less than all at once"


def test_without_delays_all_is_as_without_zones(as504, zoned):
    """Rates of the delays times 1e8 leave the response to any sinusoidal wind."""
    tables = {n: replace(t, values=1e8 * t.values) for n, t in zoned.vehicle.tables.items() if "zones.rate" in n}
    assert len(tables) == 4
    fast = aw.Study.from_vehicle(replace(zoned.vehicle, tables=zoned.vehicle.tables | tables), compile=False)
    for omega in (0.5, 6.5, 40.0):
        plain = met(as504, omega)
        np.testing.assert_allclose(met(fast, omega), plain, rtol=1e-6, atol=1e-9 * np.abs(plain).max())


def test_the_foremost_zone_meets_the_wind_first(zoned):
    """It stands ahead of the centre of gravity by the sine of the path; the delays are distances over the speed."""
    zones, tables = zoned.vehicle.zones, zoned.tables(TIME)
    assert (np.diff(zones.position) < 0).all()
    ahead = (zones.position[0] - tables["center_of_gravity"]) * tables["altitude_rate"] / tables["relative_velocity"]
    assert tables[AHEAD] == pytest.approx(ahead, rel=1e-4)
    assert tables["met_altitude"] == pytest.approx(tables["altitude"] + tables[AHEAD], rel=1e-12)
    for j, distance in enumerate(zones.distances, start=1):
        assert tables[f"{PREFIX}rate_{j}"] == pytest.approx(tables["relative_velocity"] / distance, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("time", [60.0, 70.0, 75.0])
def test_rational_delays_are_exact_ones_within_a_per_cent(time, cache):
    found = check_gust_penetration(aw.Study.load("as504", changes=ZONES | GUSTY), time)
    assert found["agrees"].values.all()
    assert np.abs(found["difference"].sel(response=list(RESPONSES))).max() < 0.003


@pytest.mark.slow
def test_doubling_the_zones_changes_little(cache):
    """Of every response that the wind reaches, by less than half a per cent of sigma for each of the wind's sources."""
    five, ten = (
        aw.Study.load("as504", changes=GUSTY | {"options.gust_zones": n}).response_statistics([60.0, 70.0, 75.0])["std"]
        for n in (5, 10)
    )
    for source, limit in (("combined", 1e-3), ("wind", 5e-4), ("turbulence", 5e-3)):
        np.testing.assert_allclose(ten.sel(source=source), five.sel(source=source), rtol=limit)
    assert (ten.sel(source="turbulence", response=list(RESPONSES)) > 0).all()


@pytest.mark.parametrize("count", [2, 3, 5, 10])
def test_strips_meet_a_parabola_as_it_is(count):
    """Whatever the wind: a constant, from three zones on a straight line and a parabola along the vehicle too."""
    zones = aw.load_vehicle(AS504, changes={"options.gust_zones": count}).zones
    assert zones is not None
    x, at = zones.strips.forward_of_gimbal, zones.position
    assert np.isin(at, x).all()
    for power in range(min(count, 3)):
        np.testing.assert_allclose(zones.member.T @ at**power, x**power, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_engines_agree_and_turbulence_bends_less(cache):
    once, zones = (aw.Study.load("as504", changes=GUSTY | {"options.gust_zones": n}) for n in (1, 5))
    assert once.vehicle is not None
    assert once.vehicle.zones is None
    found = [
        zones.response_statistics([TIME], engine=e) for e in (aw.Sweep(relative_tolerance=1e-9), aw.Cvodes.tight())
    ]
    np.testing.assert_allclose(found[0]["std"], found[1]["std"], rtol=2e-5)
    at = {"response": "bending_moment", "source": "turbulence", "time": TIME}
    ratio = float(found[0]["std"].sel(at) / once.response_statistics([TIME])["std"].sel(at))
    assert 0.6 < ratio < 0.8


@pytest.mark.slow
def test_loads_along_the_vehicle_are_the_outputs(zoned):
    """At the station of the output, the shear force too."""
    found = zoned.response_statistics([TIME], engine=aw.Sweep(relative_tolerance=1e-9))
    for load in ("bending_moment", "shear_force"):
        along = loads_along_vehicle(zoned, [TIME], load=load, slosh_reaction=False)
        (station,) = (entry.station_m for entry in zoned.vehicle.file.loads)
        here = along["std"].sel(time=TIME, station=station, method="nearest")
        np.testing.assert_allclose(here, found["std"].sel(time=TIME, response=load), rtol=2e-4)
    whole = loads_along_vehicle(zoned, [TIME])["std"].sel(time=TIME, source="wind").values
    assert (whole[[0, -1]] < 0.02 * whole.max()).all(), "slosh answered, nothing is left at the ends"


def test_five_where_turbulence_is_on_and_as_asked():
    for changes, count in (
        ({}, None),
        (GUSTY, 5),
        (GUSTY | {"options.gust_zones": 1}, None),
        ({"options.gust_zones": 3}, 3),
        ({"wind.turbulence.severity": "off"}, None),
    ):
        zones = aw.load_vehicle(AS504, changes=changes).zones
        assert (zones and zones.count) == count


@pytest.mark.parametrize("count", [0, -1, 2.5, "five", True])
def test_numbers_of_zones_that_are_none(count):
    with pytest.raises(aw.errors.DataError, match="gust_zones"):
        aw.load_vehicle(AS504, changes={"options.gust_zones": count})


def test_more_zones_than_strips():
    with pytest.raises(aw.errors.DataError, match="strips with a normal force, fewer than options.gust_zones = 200"):
        aw.load_vehicle(AS504, changes={"options.gust_zones": 200})


def strips(folder):
    return folder / "normal_force_along_vehicle.csv"


def test_a_missing_table_is_asked_for_or_told(edit):
    text = (AS504 / "vehicle.toml").read_text()
    first = text.index("[tables.normal_force_along_vehicle]")
    folder = edit(text[first : text.index("\n\n", first)], "")
    with pytest.raises(aw.errors.DataError, match="normal_force_along_vehicle.*build-vehicle"):
        aw.load_vehicle(folder, changes=ZONES)
    with pytest.warns(aw.errors.WindWarning, match="feels every gust at once"):
        assert aw.load_vehicle(folder, changes=GUSTY).zones is None


def changed_strips(folder, change) -> None:
    lines = strips(folder).read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("time"))
    rows = [change(line.split(",")) for line in lines[head + 1 :]]
    text = "\n".join([*lines[: head + 1], *(",".join(row) for row in rows if row is not None)])
    strips(folder).write_text(text + "\n")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda row: [*row[:2], str(1000 * float(row[2])), *row[3:]], "lies beyond the vehicle"),
        (lambda row: row if row[0] != "75" or float(row[2]) > 1 else None, "every strip once at every time"),
    ],
    ids=["millimetres", "a row is missing"],
)
def test_strips_that_lie_elsewhere_are_refused(vehicle_folder, change, says):
    changed_strips(vehicle_folder, change)
    with pytest.raises(aw.errors.DataError, match=says):
        aw.load_vehicle(vehicle_folder, changes=ZONES)
    aw.load_vehicle(vehicle_folder)  # what is not used is not read


@pytest.mark.parametrize(("column", "factor"), [(3, 2.2), (3, 1.01), (4, -1.0), (5, 1.1)])
def test_strips_that_do_not_add_up_are_told(vehicle_folder, column, factor):
    changed_strips(vehicle_folder, lambda row: [*row[:column], str(factor * float(row[column])), *row[column + 1 :]])
    with pytest.warns(aw.errors.PlausibilityWarning, match="adds up to .* along the vehicle, but"):
        aw.load_vehicle(vehicle_folder, changes=ZONES)


def test_exact_delays_need_zones(as504):
    with pytest.raises(aw.errors.DataError, match="no gust zones"):
        check_gust_penetration(as504, TIME)


@pytest.mark.slow
def test_derivatives_follow_the_wind_that_the_foremost_zone_meets(cache):
    """By rows of the largest elasticities, the altitude's among them, which moves the foremost zone as well."""
    study = aw.Study.load("as504", changes=ZONES | GUSTY)
    found = study.check_sensitivity("bending_moment", TIME, parameters=["turbulence.length"], rows=6)
    assert found["agrees"].values.all()
    assert any(item.startswith("altitude at") for item in found["item"].values)
