"""A free-free bar as a NASTRAN deck in mm, tonnes and MPa, its modes by a finite-element model of its own, and results.

The model here shares nothing with runners/construct: cubic elements with shear flexibility (Przemieniecki, Theory of
Matrix Structural Analysis, 5.6), masses lumped at the grids as NASTRAN does without PARAM,COUPMASS, and a general
eigenproblem.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

COUNT, LENGTH = 151, 30_000.0  # grids, mm
YOUNG, POISSON, DENSITY = 70_000.0, 0.3, 2.7e-9  # MPa, 1, t/mm3
AREA = 80_000.0  # mm2
INERTIA = (6e9, 4e9)  # mm4, aft and forward half: in the lateral plane, which is the elements' plane 2
OTHER = 1.3  # times as much in their plane 1
SHEAR_FACTOR = 0.5
HEAVY = {51: 0.4, 116: 0.25}  # t, by grid
TURNING = 2e5  # t mm2, of each of these
MAPPING = """format = 1
deck = "bar.bdf"
length = "mm"
mass = "t"
forward = "x"
lateral = "z"
grids = ["1:151"]
aft_end_m = 0.0
forward_end_m = 30.0
mass_kg = 7130.0
status = "computed"
source = "a bar made for this test"

[[results]]
time_s = 20.0
file = "RESULTS"
modes = [3, 4]
"""


@dataclass(frozen=True)
class Bar:
    """Modes of unit generalised mass, the two rigid ones first: radians per second; w and theta_y by mode and grid."""

    radians: np.ndarray
    displacement: np.ndarray
    rotation: np.ndarray


def deck_text() -> str:
    """Grids every 200 mm along x; the elements' plane 1 lies in y."""
    x = np.linspace(0.0, LENGTH, COUNT)
    lines = ["SOL 103", "CEND", "METHOD = 1", "DISPLACEMENT = ALL", "BEGIN BULK", "PARAM,POST,-1", "EIGRL,1,,,4"]
    lines += [f"GRID,{i + 1},,{v:.1f},0.,0.,,1246" for i, v in enumerate(x)]
    lines += [f"CBAR,{i},{11 if i <= COUNT // 2 else 12},{i},{i + 1},0.,1.,0." for i in range(1, COUNT)]
    for number, inertia in zip((11, 12), INERTIA, strict=True):
        lines += [f"PBAR,{number},1,{AREA:.1f},{OTHER * inertia:.4e},{inertia:.4e},1.+9,0.", ",", ""]
        lines[-2:] = [",,,,,,,,", f",{SHEAR_FACTOR},{SHEAR_FACTOR}"]
    lines += [f"MAT1,1,{YOUNG},,{POISSON},{DENSITY:.1e}"]
    for k, (grid, mass) in enumerate(HEAVY.items()):
        lines += [f"CONM2,{901 + k},{grid},,{mass}", f",{TURNING:.4e},,{TURNING:.4e},,,{TURNING:.4e}"]
    return "\n".join([*lines, "ENDDATA"]) + "\n"


def solved(count: int = 4) -> Bar:
    """Solve the bar in the x-z plane: degrees of freedom w and theta_y, of which w' = -theta_y."""
    h, shear = LENGTH / (COUNT - 1), SHEAR_FACTOR * AREA * YOUNG / (2 * (1 + POISSON))
    K, M = np.zeros((2 * COUNT, 2 * COUNT)), np.zeros((2 * COUNT, 2 * COUNT))
    for e in range(COUNT - 1):
        EI = YOUNG * INERTIA[0 if e < COUNT // 2 else 1]
        phi = 12 * EI / (shear * h**2)
        k = EI / (h**3 * (1 + phi)) * np.array(
            [
                [12, -6 * h, -12, -6 * h],
                [-6 * h, (4 + phi) * h**2, 6 * h, (2 - phi) * h**2],
                [-12, 6 * h, 12, 6 * h],
                [-6 * h, (2 - phi) * h**2, 6 * h, (4 + phi) * h**2],
            ]
        )  # fmt: skip
        at = slice(2 * e, 2 * e + 4)
        K[at, at] += k
        M[2 * e, 2 * e] += 0.5 * DENSITY * AREA * h
        M[2 * e + 2, 2 * e + 2] += 0.5 * DENSITY * AREA * h
    for grid, mass in HEAVY.items():
        M[2 * grid - 2, 2 * grid - 2] += mass
        M[2 * grid - 1, 2 * grid - 1] += TURNING
    # rotations without inertia would make M singular: its inverse is taken out by shifting the problem
    shift = 100.0
    inverse, vectors = eigh(M, K + shift * M, subset_by_index=(2 * COUNT - count, 2 * COUNT - 1))
    square = np.maximum(1 / inverse[::-1] - shift, 0.0)
    shapes = vectors[:, ::-1] * inverse[::-1] ** -0.5
    return Bar(np.sqrt(square), shapes[::2].T, shapes[1::2].T)


def write_bar(folder: Path, suffix: str, bar: Bar | None = None) -> Path:
    """Write deck, results (.f06 or .op2, by pyNastran) and mapping into a folder; return the mapping file."""
    bar = solved() if bar is None else bar
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bar.bdf").write_text(deck_text())
    results = folder / f"bar{suffix}"
    write_results(results, bar)
    mapping = folder / "mapping.toml"
    mapping.write_text(MAPPING.replace("RESULTS", results.name))
    return mapping


def write_results(file: Path, bar: Bar) -> None:
    from ascentwind.runners.construct.sources.pynastran import pynastran

    model = pynastran("op2.op2", "OP2")(debug=None)
    made = pynastran("op2.tables.oug.oug_eigenvectors", "RealEigenvectorArray")
    values = pynastran("op2.tables.lama_eigenvalues.lama_objects", "RealEigenvalues")
    count = bar.radians.size
    data = np.zeros((count, COUNT, 6), dtype="float32")
    data[:, :, 2], data[:, :, 4] = bar.displacement, bar.rotation
    grids = np.array([[i + 1, 1] for i in range(COUNT)], dtype="int32")
    numbers = list(range(1, count + 1))
    shapes = made.add_modal_case("OUGV1", grids, data, 1, numbers, bar.radians**2, bar.radians / (2 * np.pi))
    shapes.table_code = shapes.data_code["table_code"] = (
        7  # eigenvectors; pyNastran's add_modal_case says displacements
    )
    table = values("bar", "LAMA", nmodes=count)
    table.mode[:] = table.extraction_order[:] = numbers
    table.eigenvalues[:], table.radians[:] = bar.radians**2, bar.radians
    table.cycles[:], table.generalized_mass[:] = bar.radians / (2 * np.pi), 1.0
    table.generalized_stiffness[:] = bar.radians**2
    model.eigenvectors[1], model.eigenvalues["bar"], model.subcase_key = shapes, table, {1: [1]}
    model.title, model.subtitle = "bar", ""
    model.is_nx, model.is_msc, model.is_optistruct, model.is_interlaced = False, True, False, False
    if file.suffix == ".f06":
        model.write_f06(str(file), quiet=True)
    else:
        model.write_op2(str(file), nastran_format="msc", skips=["eigenvalues"])  # pyNastran writes none
