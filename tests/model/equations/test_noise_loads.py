"""What thrust and centre-of-pressure noise put into the bending moment: balances of forces forward of the station."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import interp1d
from test_assembled import MEAN, Assembled

from ascentwind.codegen.system.functions import core_functions
from ascentwind.model import load_vehicle
from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.equations.assemble import assemble
from ascentwind.model.errors import DataError, DirectNoiseError
from ascentwind.model.files.csv_table import read_csv_table
from ascentwind.model.vehicle.noise_loads import NoiseLoadsWarning
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Study
from ascentwind.runners.construct import aerodynamics
from ascentwind.runners.construct.mass.line import mass_line, rotary_line
from ascentwind.runners.construct.vehicle_numbers import VehicleNumbers, compute_vehicle

AS504 = built_in_vehicles()["as504"]
STATION, TIME, ROWS = 22.46, 75.0, 15.0  # m forward of the gimbal plane, s, s between rows of the build
FORMS = ("moved_line", "couple_forward", "couple_aft", "as_reported")
CELLS = 400_000  # of the sums along the vehicle
MOVE = 0.5  # m, of the normal force in differences


@pytest.fixture(scope="module")
def numbers() -> VehicleNumbers:
    return compute_vehicle(load_construction(AS504), ROWS)


@dataclass(frozen=True)
class Line:
    """The vehicle at 75 s as cells: middles, mass, rotary inertia of sections, and its normal force moved."""

    numbers: VehicleNumbers
    row: int
    x: np.ndarray
    mass: np.ndarray
    rotary: np.ndarray

    def normal_force(self, moved: float) -> np.ndarray:
        """q A c'_N(x - moved) dx, N/rad."""
        n, c = self.numbers, self.numbers.construction
        there = aerodynamics.intensity(c, n.flight.mach[[self.row]], self.x - moved)[0]
        return n.flight.dynamic_pressure[self.row] * c.reference_area * there * (self.x[1] - self.x[0])

    def moved(self) -> np.ndarray:
        """Change of the normal force in each cell for each metre that it moves."""
        return (self.normal_force(MOVE) - self.normal_force(-MOVE)) / (2 * MOVE)


@pytest.fixture(scope="module")
def line(numbers) -> Line:
    """The construction's own masses and normal force, spread without the line integrals of the build."""
    c, row = numbers.construction, int(np.argmin(np.abs(numbers.flight.time - TIME)))
    edges = numbers.modes.x
    fine = np.linspace(edges[0] - 2 * MOVE, edges[-1] + 2 * MOVE, CELLS + 1)  # room for what moves off the nose
    x = 0.5 * (fine[:-1] + fine[1:])
    element = np.clip(np.searchsorted(edges, x) - 1, 0, edges.size - 2)
    share = (x[1] - x[0]) / np.diff(edges)[element] * ((x > edges[0]) & (x < edges[-1]))
    mass = mass_line(c, edges, numbers.flight.liquid)[row][element] * share
    return Line(numbers, row, x, mass, np.asarray(rotary_line(c, edges))[element] * share)


@pytest.fixture(scope="module")
def models(cache) -> dict[str, Assembled]:
    found = {}
    for form in FORMS:
        vehicle = load_vehicle(AS504, {"options.noise_loads": form})
        system = assemble(vehicle, np.diag([1.0, 3.0, 1.0]))
        found[form] = Assembled(vehicle, system, core_functions(system))
    return found


def deviation_columns(model: Assembled, source: str) -> tuple[dict[str, float], dict[str, float], float]:
    """Return tables, accelerations and the moment's coefficient for a deviation of 1, by the assembled equations."""
    v, A, _, C = model.at(TIME)
    names = list(model.system.state_names)
    k = names.index(f"deviation_{source}")
    sigma = model.vehicle.noise[source].sigma
    rates = {name: float(A[i, k]) / sigma for i, name in enumerate(names)}
    moment = float(C[list(model.system.output_names).index("bending_moment"), k]) / sigma
    return v, rates, moment


def inertia_forward(line: Line, v: dict[str, float], rates: dict[str, float], lateral: float) -> float:
    """Return the moment about the station of the inertia of all forward of it: rigid body, modes, slosh masses."""
    forward = line.x > STATION
    arm = line.x - STATION
    acceleration = lateral + (line.x - v["center_of_gravity"]) * rates["attitude_rate"]
    found = (line.mass * arm * acceleration + line.rotary * rates["attitude_rate"])[forward].sum()
    edges, row = line.numbers.modes.x, line.row
    for i in (1, 2):
        shape = np.interp(line.x, edges, line.numbers.modes.displacement[row, i - 1])
        turn = np.interp(line.x, edges, line.numbers.modes.rotation[row, i - 1])
        per_unit = (line.mass * arm * shape + line.rotary * turn)[forward].sum()
        found += per_unit * rates[f"bending_rate_{i}"]
    for tank, slosh in line.numbers.slosh.items():
        found += slosh.mass[row] * max(slosh.attach_point[row] - STATION, 0.0) * rates[f"slosh_rate_{tank}"]
    return float(found)


def test_moved_centre_of_pressure_is_the_balance_of_forces_forward_of_the_station(models, line):
    """The assembled output against forces less inertia, summed over the construction's normal force and masses."""
    v, rates, moment = deviation_columns(models["moved_line"], "center_of_pressure")
    forward = line.x > STATION
    metre = ((line.x - STATION) * line.moved())[forward].sum()
    force = metre * v["center_of_pressure"] * MEAN["mean.angle_of_attack"]
    assert moment == pytest.approx(force - inertia_forward(line, v, rates, 0.0), rel=1e-3)
    assert rates["lateral_velocity"] == 0  # a couple: no force


def test_thrust_is_the_balance_of_forces_forward_of_the_station(models, line):
    """The engines act aft of the station; along the axis, where the frame does not follow the deviation, no inertia."""
    v, rates, moment = deviation_columns(models["moved_line"], "thrust")
    lateral = rates["lateral_velocity"] - v["thrust"] * MEAN["mean.attitude"] / v["mass"]
    assert lateral == pytest.approx(v["control_thrust"] * MEAN["mean.engine_angle"] / v["mass"], rel=1e-12)
    assert moment == pytest.approx(-inertia_forward(line, v, rates, lateral), rel=1e-3)


@pytest.fixture(scope="module")
def along_axis(cache) -> dict[str, Assembled]:
    """The vehicle with biases that act along and beside its axis, without and with thrust on the displaced gimbal."""
    changes = {
        "biases.center_of_gravity_offset.standard_deviation_m": 0.02,
        "biases.thrust_misalignment.standard_deviation_deg": 0.1,
    }
    found = {}
    for name, p_delta in (("straight", False), ("bent", True)):
        vehicle = load_vehicle(AS504, changes | {"options.p_delta": p_delta})
        system = assemble(vehicle, np.diag([1.0, 3.0, 1.0]))
        found[name] = Assembled(vehicle, system, core_functions(system))
    return found


def column_of(model: Assembled, state: str) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Return tables, and what a state of 1 puts into rates and outputs, by the assembled equations."""
    v, A, _, C = model.at(TIME)
    names, outputs = model.system.state_names, model.system.output_names
    k = names.index(state)
    return v, dict(zip(names, A[:, k], strict=True)), dict(zip(outputs, C[:, k], strict=True))


def test_mass_beside_the_thrust_axis_is_the_balance_of_forces_forward_of_the_station(along_axis, line):
    """Every section pulls with A_X beside the axis; the vehicle turns by the whole couple and does not move aside."""
    v, rates, outputs = column_of(along_axis["straight"], "deviation_center_of_gravity_offset")
    offset, forward = 0.02, line.x > STATION
    assert rates["lateral_velocity"] == 0
    couple = offset * (v["thrust"] - v["axial_drag"])
    assert rates["attitude_rate"] == pytest.approx(couple / v["moment_of_inertia"], rel=1e-12)
    pull = offset * v["axial_acceleration"] * line.mass[forward].sum()
    expected = pull - inertia_forward(line, v, rates, 0.0)
    assert outputs["bending_moment"] == pytest.approx(expected, rel=1e-3)
    assert outputs["engine_angle"] == outputs["angle_of_attack"] == 0


def test_misaligned_thrust_is_an_engine_angle_that_the_engines_do_not_have(along_axis, line):
    """Side force and moment of the turned thrust, aft of the station; the engine angle itself stands."""
    v, rates, outputs = column_of(along_axis["straight"], "deviation_thrust_misalignment")
    side = np.radians(0.1) * v["control_thrust"]
    assert rates["lateral_velocity"] == pytest.approx(side / v["mass"], rel=1e-12)
    assert rates["attitude_rate"] == pytest.approx(-side * v["center_of_gravity"] / v["moment_of_inertia"], rel=1e-12)
    expected = -inertia_forward(line, v, rates, rates["lateral_velocity"])
    of_rigid_body = np.radians(0.1) * v["loads.bending_moment.engine_angle"]  # ten times what the modes leave of it
    assert outputs["bending_moment"] == pytest.approx(expected, abs=1e-3 * of_rigid_body)
    assert outputs["engine_angle"] == 0
    assert all(rates[name] == 0 for name in rates if name.startswith(("T1", "T2", "T3")))


@pytest.mark.parametrize("mode", [1, 2])
def test_thrust_on_the_displaced_gimbal_is_a_balance_on_the_bent_axis(along_axis, line, mode):
    """Inertia along the bent axis forward of the station less the answer to -F_TX Y_i(X_E) eta_i; no side force."""
    _, straight, without = column_of(along_axis["straight"], f"bending_{mode}")
    v, bent, with_it = column_of(along_axis["bent"], f"bending_{mode}")
    rates = {name: bent[name] - straight[name] for name in bent}
    assert rates["lateral_velocity"] == 0
    couple = -v["thrust"] * v[f"bending.{mode}.displacement_at_gimbal"]
    assert rates["attitude_rate"] == pytest.approx(couple / v["moment_of_inertia"], rel=1e-9)
    shape = np.interp(line.x, line.numbers.modes.x, line.numbers.modes.displacement[line.row, mode - 1])
    there = np.interp(STATION, line.numbers.modes.x, line.numbers.modes.displacement[line.row, mode - 1])
    pull = v["thrust"] / v["mass"] * (line.mass * (shape - there))[line.x > STATION].sum()
    expected = pull - inertia_forward(line, v, rates, 0.0)
    assert with_it["bending_moment"] - without["bending_moment"] == pytest.approx(expected, rel=2e-3)


def test_thrust_on_the_displaced_gimbal_does_not_deviate(along_axis):
    """A product of a deviation and the bending; the column of the thrust is what it was."""
    columns = [column_of(along_axis[name], "deviation_thrust")[1:] for name in ("straight", "bent")]
    assert columns[0] == columns[1]


def test_moved_normal_force_works_on_the_modes(models, line):
    """Eta'' of a moved centre of pressure: the rigid answer of slosh, and c'_N moved under the modes (4-10)."""
    v, reported, _ = deviation_columns(models["as_reported"], "center_of_pressure")
    _, rates, _ = deviation_columns(models["moved_line"], "center_of_pressure")
    per_metre, matrix = [], np.diag([v[f"bending.{i}.generalized_mass"] for i in (1, 2)])
    for i in (1, 2):
        shape = line.numbers.modes.displacement[line.row, i - 1]
        beam = interp1d(line.numbers.modes.x, shape, fill_value="extrapolate")  # pyright: ignore[reportArgumentType]
        per_metre.append(beam(line.x) @ line.moved())
    for tank in models["moved_line"].vehicle.slosh:
        Y = np.array([v[f"bending.{i}.displacement_at_{tank.name}"] for i in (1, 2)])
        matrix -= v[f"slosh.{tank.name}.mass"] * np.outer(Y, Y)
    force = np.array(per_metre) * v["center_of_pressure"] * MEAN["mean.angle_of_attack"]
    expected = np.linalg.solve(matrix, force)
    found = [rates[f"bending_rate_{i}"] - reported[f"bending_rate_{i}"] for i in (1, 2)]
    np.testing.assert_allclose(found, expected, rtol=5e-3)


def test_couples_differ_from_the_reported_form_by_themselves_and_their_relief(models):
    """Closed forms: the couple forward of the station less the share S_2 / I of it with which the vehicle answers."""
    v, _, reported = deviation_columns(models["as_reported"], "center_of_pressure")
    couple = v["dynamic_pressure"] * 79.46 * v["normal_force_slope"] * v["center_of_pressure"]
    couple *= MEAN["mean.angle_of_attack"]
    table = read_csv_table(AS504 / "loads_station_25m.csv", "time", "s").columns
    relief = table["second_moment"][table["time"] == TIME].item() / v["moment_of_inertia"]
    for form, forward in (("couple_forward", 1.0), ("couple_aft", 0.0)):
        _, rates, moment = deviation_columns(models[form], "center_of_pressure")
        assert moment - reported == pytest.approx((forward - relief) * couple, rel=1e-9)
        assert rates == deviation_columns(models["as_reported"], "center_of_pressure")[1]


def test_thrust_enters_every_form_but_the_reports(models):
    v, _, reported = deviation_columns(models["as_reported"], "thrust")
    direct = v["loads.bending_moment.engine_angle"] * MEAN["mean.engine_angle"]
    for form in FORMS[:3]:
        assert deviation_columns(models[form], "thrust")[2] - reported == pytest.approx(direct, rel=1e-12)


@pytest.mark.slow
def test_bounds_at_75_s_are_those_of_an_independent_estimate():
    """Found before these equations, from forces forward of the station: 1.49 to 1.51 MN m, 1.30 as reported, +1.3 %.

    The moved line lies outside: its work on the modes moves too, which a couple of unknown place leaves out.
    """
    found = {}
    for form in FORMS:
        study = Study.load(AS504, changes={"options.noise_loads": form})
        std = study.response_statistics([TIME], responses=["bending_moment"])["std"].squeeze()
        found[form] = [float(std.sel(source=s)) / 1e6 for s in ("center_of_pressure", "combined")]
    assert found["as_reported"][0] == pytest.approx(1.30, abs=0.005)
    assert found["couple_forward"][0] == pytest.approx(1.49, abs=0.005)
    assert found["couple_aft"][0] == pytest.approx(1.51, abs=0.005)
    assert found["couple_aft"][1] / found["as_reported"][1] - 1 == pytest.approx(0.013, abs=0.0005)


def spoil(folder: Path, *tables: str, column: str) -> Path:
    """Remove a column from tables."""
    for table in tables:
        file = folder / table
        columns = read_csv_table(file, "time", "s")
        kept = [name for name in columns.columns if name != column]
        head = ",".join(f"{name} [{columns.units[name]}]" for name in kept)
        rows = np.stack([columns.columns[name] for name in kept], axis=1)
        file.write_text(head + "\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows))
    return folder


def make_rigid(folder: Path) -> None:
    """Remove what modes and tanks put into the load; without them ``bending`` and ``slosh`` may be empty."""
    for table in (LOAD, "shear_station_25m.csv"):
        for column in read_csv_table(folder / table, "time", "s").columns:
            if column.startswith(("bending_", "slosh_", "p_delta_")):
                spoil(folder, table, column=column)


LOAD, MODE = "loads_station_25m.csv", "bending_2.csv"
MOVED_LINE, MOVED_MODE, SECOND = "center_of_pressure", "normal_force_slope_times_slope", "second_moment"


@pytest.mark.parametrize(
    ("columns", "form"),
    [
        (((LOAD, MOVED_LINE),), "couple_aft"),
        (((MODE, MOVED_MODE),), "couple_aft"),
        (((LOAD, MOVED_LINE), (LOAD, SECOND)), "as_reported"),
    ],
)
@pytest.mark.slow
def test_vehicles_without_the_columns_load_with_a_hint(vehicle_folder, edit, columns, form):
    edit('noise_loads = "moved_line"', "# none:")
    for table, column in columns:
        spoil(vehicle_folder, table, column=column)
    with pytest.warns(NoiseLoadsWarning, match=rf"{columns[0][0]}.*{columns[0][1]}.*{form}.*build-vehicle"):
        vehicle = load_vehicle(vehicle_folder)
    assert vehicle.file.options.noise_loads == form
    assemble(vehicle, np.diag([1.0, 3.0, 1.0]))


@pytest.mark.parametrize(
    ("form", "table", "column"),
    [("moved_line", LOAD, MOVED_LINE), ("moved_line", MODE, MOVED_MODE), ("couple_forward", LOAD, SECOND)],
)
def test_a_form_that_is_named_is_not_replaced(vehicle_folder, form, table, column):
    spoil(vehicle_folder, table, column=column)
    with pytest.raises(DataError, match=rf"{table}.*'{column} .*is missing"):
        load_vehicle(vehicle_folder, {"options.noise_loads": form})


@pytest.mark.parametrize(
    ("tables", "why"),
    [
        (["center_of_gravity"], "'center_of_gravity' moves masses.*as_reported"),
        (["slosh.sic_lox.attach_point"], "attach_point' moves masses"),
        (["control_thrust", "loads.bending_moment.engine_angle"], "follows 'control_thrust' by itself.*count twice"),
        (["dynamic_pressure", "loads.bending_moment.angle_of_attack"], "follows 'dynamic_pressure' by itself"),
    ],
)
def test_deviations_that_a_moment_cannot_follow_are_refused(tables, why):
    changes = {"noise.thrust.tables": tables}
    with pytest.raises(DataError, match=why):
        load_vehicle(AS504, changes)
    load_vehicle(AS504, changes | {"options.noise_loads": "as_reported"})


@pytest.mark.parametrize("source", ["thrust", "center_of_pressure"])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.slow
def test_white_noise_of_a_rigid_vehicle_reaches_the_moment_directly(vehicle_folder, source, form):
    """Without modes and tanks nothing else brings it there: infinite, and refused, in every form but the report's."""
    make_rigid(vehicle_folder)
    changes = {"options.noise_loads": form, f"noise.{source}.white": True, "bending": [], "slosh": []}
    study = Study.load(vehicle_folder, changes=changes, compile=False)
    if form == "as_reported":
        found = study.response_statistics([20.0], responses=["bending_moment"], engine="covariance")
        assert np.isfinite(found["std"]).all()
    else:
        with pytest.raises(DirectNoiseError, match=f"'{source}' reaches 'bending_moment' directly"):
            study.response_statistics([20.0], responses=["bending_moment"], engine="covariance")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.slow
def test_variance_of_a_rigid_moment_is_the_square_of_its_load(vehicle_folder, form):
    """Closed form: at the start a deviation has its full variance and no time to turn the vehicle."""
    make_rigid(vehicle_folder)
    study = Study.load(
        vehicle_folder, changes={"options.noise_loads": form, "bending": [], "slosh": [], "start_time_s": 60.0}
    )
    time = 60.001
    v = study.tables(time)
    found = study.response_statistics([time], responses=["bending_moment"])["std"].squeeze()
    alpha, beta = v["mean.angle_of_attack"], v["mean.engine_angle"]
    table = read_csv_table(vehicle_folder / LOAD, "time", "s").columns
    row = table["time"] == 60.0
    couple = v["dynamic_pressure"] * 79.46 * v["normal_force_slope"]
    relief = table["second_moment"][row].item() / v["moment_of_inertia"]
    metre = {
        "moved_line": table["center_of_pressure"][row].item(),
        "couple_forward": (1 - relief) * couple,
        "couple_aft": -relief * couple,
        "as_reported": 0.0,
    }[form]
    thrust = 0.0 if form == "as_reported" else 0.01 * abs(v["loads.bending_moment.engine_angle"] * beta)
    center = 0.05 * abs(metre * v["center_of_pressure"] * alpha)
    assert float(found.sel(source="center_of_pressure")) == pytest.approx(center, rel=1e-3, abs=1.0)
    assert float(found.sel(source="thrust")) == pytest.approx(thrust, rel=1e-2, abs=1.0)
