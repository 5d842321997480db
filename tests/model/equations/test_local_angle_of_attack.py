"""Local angle of attack: forces of segments, each at its own angle, against the assembled equations."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from test_assembled import VEHICLE, Assembled, NumericEquations, acceleration_rows, assert_rows_equal

from ascentwind.codegen.system.functions import core_functions
from ascentwind.model import load_vehicle
from ascentwind.model.equations.assemble import assemble
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.columns import local_columns, local_load_columns

TIME = 75.0
MODES = (0, 1)
LOAD = {
    "attitude_rate": 3e5,
    "bending_displacement_1": 2e5,
    "bending_displacement_2": -4e5,
    "bending_rate_1": 1e4,
    "bending_rate_2": 3e4,
}


def switched(folder: Path) -> Path:
    """Copy AS-504 with full coupling and the option."""
    shutil.copytree(VEHICLE, folder)
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    for option in ("full_coupling = ", "local_angle_of_attack = "):
        assert text.count(option + "false") == 1
        text = text.replace(option + "false", option + "true")
    toml.write_text(text)
    return folder


def write(file: Path, columns, values: dict[str, float]) -> None:
    header = ",".join(["time [s]", *(column.label for column in columns)])
    row = ",".join(repr(float(values[column.name])) for column in columns)
    file.write_text(header + "".join(f"\n{t},{row}" for t in (0, 80, 200, 300)) + "\n")


@pytest.fixture(scope="module")
def segments() -> dict[str, np.ndarray]:
    """Point forces whose sums are the shipped vehicle's normal force, centre of pressure and generalised forces."""
    v = {n: float(t.polynomial(TIME)) for n, t in load_vehicle(VEHICLE).tables.items()}
    rng, n = np.random.default_rng(5), 6
    c = rng.uniform(0.3, 1.5, n)
    c *= v["normal_force_slope"] / c.sum()
    x, Y = rng.uniform(-2, 90, n), rng.uniform(-1, 1, (2, n))
    x += v["center_of_pressure"] - c @ x / c.sum()
    for i in MODES:
        Y[i] += (v[f"bending.{i + 1}.normal_force_slope_times_displacement"] - c @ Y[i]) / c.sum()
    return {"c": c, "arm": x - v["center_of_gravity"], "Y": Y, "slope": rng.uniform(-0.02, 0.02, (2, n))}


@pytest.fixture(scope="module")
def local(tmp_path_factory, segments) -> Assembled:
    folder = switched(tmp_path_factory.mktemp("local") / "as504")
    c, arm, Y, slope = (segments[k] for k in ("c", "arm", "Y", "slope"))
    integrals = {"arm": c @ arm, "arm_squared": c @ arm**2}
    for i in MODES:
        integrals[f"arm_displacement_{i + 1}"] = (c * arm) @ Y[i]
        integrals[f"slope_{i + 1}"] = c @ slope[i]
        integrals[f"arm_slope_{i + 1}"] = (c * arm) @ slope[i]
        for j in MODES:
            integrals[f"displacement_{i + 1}_displacement_{j + 1}"] = (c * Y[i]) @ Y[j]
            integrals[f"displacement_{i + 1}_slope_{j + 1}"] = (c * Y[i]) @ slope[j]
    write(folder / "local_aerodynamics.csv", local_columns(2), integrals)
    write(folder / "local_loads_station_25m.csv", local_load_columns(2), LOAD)
    vehicle = load_vehicle(folder, {"options.noise_loads": "as_reported"})  # the others: test_noise_loads.py
    system = assemble(vehicle, np.diag([1.0, 3.0, 1.0]))
    return Assembled(vehicle, system, core_functions(system))


def test_rows_are_those_of_segments_at_their_own_angle(local, segments):
    """M q'' = forces, each segment's force from its own angle of attack, by virtual work on (Y, phi, eta)."""
    v, A, _, C = local.at(TIME)
    e = NumericEquations(local, v, C)
    c, arm, Y, slope = (segments[k] for k in ("c", "arm", "Y", "slope"))
    own, slosh = e.own_forces()
    external = e.external(0 * e.alpha, e.beta, e.identity["attitude"])
    for k in range(c.size):
        rate = e.identity["attitude_rate"] * arm[k] + Y[:, k] @ e.eta_rate
        angle = e.alpha + slope[:, k] @ e.eta - rate / v["relative_velocity"]
        virtual = np.array([1, arm[k], *Y[:, k]])
        external = external + v["dynamic_pressure"] * e.area * c[k] * np.outer(virtual, angle)
    columns = [i for i, n in enumerate(e.states) if not n.startswith("deviation")]
    force = np.vstack([external + own, e.slosh_mass[:, None] * slosh])
    d = 1 / np.sqrt(np.diag(e.mass_matrix()))
    expected = d[:, None] * np.linalg.solve(d[:, None] * e.mass_matrix() * d, d[:, None] * force)
    assert_rows_equal(acceleration_rows(local, A)[:, columns], expected[:, columns], 1 / d)


def test_load_takes_the_local_terms(local):
    v, A, _, C = local.at(TIME)
    e = NumericEquations(local, v, C)
    rows = acceleration_rows(local, A)[2:]
    names = [f"bending_{i + 1}" for i in MODES] + [f"slosh_{t.name}" for t in local.vehicle.slosh]
    load = "loads.bending_moment."
    expected = v[load + "angle_of_attack"] * e.alpha + v[load + "engine_angle"] * e.beta
    expected = expected + sum(v[load + n] * row for n, row in zip(names, rows, strict=True))
    expected = expected + LOAD["attitude_rate"] * e.identity["attitude_rate"]
    for i in MODES:
        expected = expected + LOAD[f"bending_displacement_{i + 1}"] * e.eta[i]
        expected = expected + LOAD[f"bending_rate_{i + 1}"] * e.eta_rate[i]
    np.testing.assert_allclose(C[e.outputs.index("bending_moment")], expected, rtol=1e-11, atol=1e-6)


@pytest.mark.parametrize(
    ("begin", "end", "key"),
    [
        ("[tables.local_aerodynamics]", "[tables.loads_along", r"tables\.local_aerodynamics"),
        ("[loads.local]", "[loads.shear]", r"loads\.bending_moment\.local"),
    ],
)
def test_missing_tables_are_named(tmp_path, begin, end, key):
    """The option without its tables is refused, and the message says which command makes them."""
    toml = switched(tmp_path / "as504") / "vehicle.toml"
    text = toml.read_text()
    toml.write_text(text[: text.index(begin)] + text[text.index(end) :])
    with pytest.raises(DataError, match=f"{key}.*build-vehicle"):
        load_vehicle(toml.parent)
