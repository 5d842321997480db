"""A product of inertia couples both planes: against the same masses in their principal planes, rolled, and by hand."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.runners import Study
from ascentwind.runners.statistics.norm import NormOfNormal

ROLL = 0.6  # rad, of the principal planes from those of the flight
RATIO = 1.3  # of the larger principal moment of inertia to the vehicle's own, which is the smaller
ENTRY = '\n[{key}]\nfile = "{file}"\nstatus = "assumed"\nsource = "made up"\n'
ASSUMED = pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")


def with_tables(folder: Path, roll_deg: float | None = None, **factors: float) -> Path:
    """Give a vehicle moments of inertia of its planes, and a product, as factors of its own moment."""
    rows = [line.split(",") for line in (folder / "rigid_body.csv").read_text().splitlines() if line[:1].isdigit()]
    text = "" if roll_deg is None else f"roll_deg = {roll_deg!r}\n"
    text += (folder / "vehicle.toml").read_text()
    for name, factor in factors.items():
        column = "product_of_inertia" if name == "product" else "moment_of_inertia"
        body = [f"{row[0]},{float(factor * float(row[2]))!r}" for row in rows]
        (folder / f"{name}.csv").write_text("\n".join([f"time [s],{column} [kg m2]", *body]) + "\n")
        key = f"tables.{column}" if name == "product" else f"{name}.tables.{column}"
        text += ENTRY.format(key=key, file=f"{name}.csv")
    (folder / "vehicle.toml").write_text(text)
    return folder


def turned_factors() -> dict[str, float]:
    """Moments and product of inertia in the flight's planes: I_1 = RATIO and I_2 = 1 in planes rolled by ROLL."""
    c, s = np.cos(ROLL), np.sin(ROLL)
    return {"pitch": RATIO * c**2 + s**2, "yaw": RATIO * s**2 + c**2, "product": (RATIO - 1) * s * c}


def turn(names: tuple[str, ...]) -> np.ndarray:
    """Return what takes quantities of the flight's planes to those of rolled ones; wind and deviations stay."""
    T, c, s = np.eye(len(names)), np.cos(ROLL), np.sin(ROLL)
    for k, name in enumerate(names):
        if name.startswith("pitch_"):
            other = names.index(f"yaw_{name.removeprefix('pitch_')}")
            T[np.ix_([k, other], [k, other])] = [[c, s], [-s, c]]
    return T


def matrices(study: Study, time: float) -> dict[str, np.ndarray]:
    names = ("A", "B", "C", "E", "G")
    return dict(zip(names, MatrixEvaluator(study.with_means, names)(time, 10.0, 150.0), strict=True))


def copies(folder: Path) -> tuple[Path, Path]:
    other = folder.parent / "other"
    shutil.copytree(folder, other)
    return folder, other


@ASSUMED
@pytest.mark.parametrize(
    "options",
    [{}, {"options.full_coupling": True}, {"options.p_delta": True, "options.local_angle_of_attack": True}],
    ids=lambda options: " ".join(options) or "as reported",
)
def test_a_product_of_inertia_is_principal_planes_rolled(vehicle_folder, options):
    """All else is the same in both planes, so that matrices differ by the turn of states and outputs alone."""
    first, second = copies(vehicle_folder)
    changes = {"planes": "both", **options}
    coupled = Study.load(with_tables(first, **turned_factors()), compile=False, changes=changes)
    rolled = Study.load(with_tables(second, float(np.degrees(ROLL)), pitch=RATIO), compile=False, changes=changes)
    assert coupled.system.state_names == rolled.system.state_names
    states, outputs = turn(coupled.system.state_names), turn(coupled.system.output_names)
    axial = [k for k, name in enumerate(coupled.system.output_names) if "axial" in name]  # N +- 2 M / R is no vector
    own = [k for k, n in enumerate(coupled.system.state_names) if not n.startswith("deviation")]
    for time in (30.0, 75.0, 120.0):
        here, there = matrices(coupled, time), matrices(rolled, time)
        expected = {
            "A": states.T @ there["A"] @ states,
            "B": states.T @ there["B"],
            "C": outputs.T @ there["C"] @ states,
            "E": states.T @ there["E"],
            "G": outputs.T @ there["G"],
        }
        for name, value in expected.items():
            found = here[name]
            if name in "CG":
                found, value = (np.delete(x, axial, axis=0) for x in (found, value))
            scale = np.abs(value).max(axis=1, keepdims=True) + 1e-300
            # columns of deviations hold the means, which an integrator made
            known = slice(None) if name in "BEG" else own
            np.testing.assert_allclose((found / scale)[:, known], (value / scale)[:, known], rtol=0, atol=1e-11)
            np.testing.assert_allclose(found / scale, value / scale, rtol=0, atol=1e-6)
    between = here["A"][coupled.system.state_names.index("pitch_attitude_rate")]
    assert between[coupled.system.state_names.index("yaw_attitude")] != 0.0


@ASSUMED
def test_accelerations_are_those_of_the_matrix_of_inertia(vehicle_folder):
    """Rows of phi'' are the inverse of [[I_p, P], [P, I_y]] times the moments, which the uncoupled rows give."""
    first, second = copies(vehicle_folder)
    factors = {"pitch": 1.2, "yaw": 0.9, "product": 0.35}
    coupled = Study.load(with_tables(first, **factors), compile=False, changes={"planes": "both"})
    factors.pop("product")
    free = Study.load(with_tables(second, **factors), compile=False, changes={"planes": "both"})
    names = coupled.system.state_names
    rows = [names.index(f"{plane}_attitude_rate") for plane in ("pitch", "yaw")]
    own = [k for k, name in enumerate(names) if not name.startswith("deviation")]
    at, there = coupled.tables(75.0), matrices(free, 75.0)
    pitch, yaw, product = (
        at[f"{n}"] for n in ("pitch.moment_of_inertia", "yaw.moment_of_inertia", "product_of_inertia")
    )
    moments = np.array([[pitch], [yaw]]) * there["A"][rows]
    expected = np.linalg.solve(np.array([[pitch, product], [product, yaw]]), moments)
    found = matrices(coupled, 75.0)["A"][rows]
    np.testing.assert_allclose(found[:, own], expected[:, own], rtol=1e-12, atol=1e-14)


@ASSUMED
def test_a_product_of_zero_changes_nothing(vehicle_folder):
    first, second = copies(vehicle_folder)
    coupled, free = (
        Study.load(folder, compile=False, changes={"planes": "both"})
        for folder in (with_tables(first, product=0.0), second)
    )
    here, there = matrices(coupled, 75.0), matrices(free, 75.0)
    for name, value in there.items():
        np.testing.assert_allclose(here[name], value, rtol=1e-12, atol=1e-12 * np.abs(value).max())


@pytest.mark.slow
@ASSUMED
def test_resultants_are_those_of_the_rolled_vehicle(vehicle_folder, cache):
    """By the sweep: levels of resultants are the same, and the direction turns by the roll."""
    first, second = copies(vehicle_folder)
    coupled = Study.load(with_tables(first, **turned_factors()), changes={"planes": "both"})
    rolled = Study.load(with_tables(second, float(np.degrees(ROLL)), pitch=RATIO), changes={"planes": "both"})
    names = ("resultant_bending_moment", "total_angle_of_attack", "total_engine_angle")
    laws = [
        {name: study.response_statistics([75.0]).resultants(names=names).norm(name) for name in names}
        for study in (coupled, rolled)
    ]
    for name in names:
        here, there = (law[name] for law in laws)
        level = here.percentile(1e-3)
        np.testing.assert_allclose(level, there.percentile(1e-3), rtol=1e-5)
        turned = here.direction(level).most_likely - there.direction(level).most_likely
        np.testing.assert_allclose(turned, ROLL, atol=1e-4)
        assert isinstance(here, NormOfNormal)


REFUSED = {
    "one plane": ({"product": 0.1}, {"planes": "yaw"}, 'tables.product_of_inertia.*planes = "yaw".*leave it out'),
    "no masses": ({"product": -1.01}, {"planes": "both"}, "product.csv.*not below the root of the moments of inertia"),
    "no masses of a plane": ({"product": 0.95, "pitch": 0.9}, {"planes": "both"}, "not below the root"),
    "a file that is not there": (
        {"product": 0.1}, {"planes": "both", "tables.product_of_inertia.file": "none.csv"}, "none.csv.*cannot be read",
    ),
    "a moment that deviates": (
        {"product": 0.1}, {"planes": "both", "noise.thrust.tables": ["moment_of_inertia"]}, "act on more than the mean",
    ),
}  # fmt: skip


@ASSUMED
@pytest.mark.parametrize("name", REFUSED)
def test_refused(vehicle_folder, name):
    factors, changes, message = REFUSED[name]
    with_tables(vehicle_folder, **factors)
    with pytest.raises(DataError, match=message):
        Study.from_vehicle(load_vehicle(vehicle_folder, changes), compile=False)


def test_another_unit_is_refused(vehicle_folder):
    with_tables(vehicle_folder, product=0.1)
    file = vehicle_folder / "product.csv"
    file.write_text(file.read_text().replace("[kg m2]", "[lb ft2]"))
    with pytest.raises(DataError, match=r"product_of_inertia.*unit is \[lb ft2\]"):
        load_vehicle(vehicle_folder, {"planes": "both"})
