"""Writes docs/tables.md: every column of every table of a vehicle, from model/vehicle/columns.py.

python tools/write_tables_page.py
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ascentwind.model.vehicle import columns as c

PAGE = Path(__file__).parents[1] / "docs" / "tables.md"
SIGNS = {"+": "above 0", "0": "0 or above", "": ""}
TABLES: tuple[tuple[str, Sequence[c.Column]], ...] = (
    ("`[tables.rigid_body]`", (c.TIME, *c.RIGID_BODY)),
    ("`[tables.product_of_inertia]`, which couples both planes", (c.TIME, c.PRODUCT_OF_INERTIA)),
    ("`[tables.trajectory]`", (c.TIME, *c.TRAJECTORY)),
    ("`[tables.trajectory]`, for `options.trajectory_angle_of_attack`", tuple(c.OWN_ANGLE.values())),
    ("`[tables.trajectory]`, for `wind.azimuth_change`", (c.AZIMUTH_CHANGE,)),
    ("`[tables.propulsion]`", (c.TIME, *c.PROPULSION)),
    ("`[tables.aerodynamics]`", (c.TIME, *c.AERODYNAMICS)),
    ("`[tables.aerodynamics]`, of a plane that is not symmetrical", (c.ZERO_ANGLE,)),
    ("`[control.gains]`", (c.TIME, *c.GAINS)),
    ("`[[bending]]`, a mode", (c.TIME, *c.bending_columns(["TANK"]))),
    ("`[[bending]]`, where a centre of pressure deviates", (c.MOVED_MODE,)),
    ("`[[slosh]]`, a tank", (c.TIME, *c.SLOSH)),
    ("`[[loads]]`, a station s", (c.TIME, *c.load_columns(1, ["TANK"]))),
    ("`[[loads]]`, for `options.slosh_reaction`, noises and biases", (*c.REACTION, c.MOVED_LINE)),
    ("`[[loads]]`, for `biases.center_of_gravity_offset`", (c.OFFSET_MASS,)),
    ("`[[loads]]`, for `options.p_delta`", c.p_delta_columns(1)),
    ("`[loads.local]`, for `options.local_angle_of_attack`", (c.TIME, *c.local_load_columns(1))),
    ("`[tables.local_aerodynamics]`, for the same", (c.TIME, *c.local_columns(1))),
    ("`[loads.shear]`, the shear force at a station s", (c.TIME, *c.whole_shear_columns(1))),
    ("`[loads.axial]`, the axial force at a station s", (c.TIME, *c.AXIAL)),
    ("`[tables.loads_along_vehicle]`, besides the columns of all `[[loads]]`", c.ALONG_ARGUMENTS),
    ("`[tables.shear_along_vehicle]`, besides the columns of all `[loads.shear]`", c.ALONG_ARGUMENTS),
    ("`[tables.axial_along_vehicle]`, besides the columns of all `[loads.axial]`", (*c.ALONG_ARGUMENTS, c.RADIUS)),
    ("`[tables.normal_force_along_vehicle]`", (*c.ALONG_ARGUMENTS, *c.normal_force_columns(1))),
    ("`[control.accelerometer.modes]`, `[control.angle_of_attack.modes]`", (c.TIME, *c.mode_columns(1))),
    ("`[control.accelerometer.schedule]`, `[control.angle_of_attack.schedule]`", (c.TIME, *c.SCHEDULE)),
    ("`[wind.statistics]`", (c.ALTITUDE, *c.WIND)),
    ("`[wind.components.statistics]`, for both planes", (c.ALTITUDE, *c.WIND_COMPONENTS)),
    ("`[wind.turbulence.intensity]`", (c.ALTITUDE, *c.TURBULENCE)),
)


def page() -> str:
    """Return the page."""
    lines = [
        "# Tables of a vehicle",
        "",
        "The columns of the CSV files that a `vehicle.toml` names: `name [unit]` in the header, in any order.",
        "`tools/write_tables_page.py` writes this page from `model/vehicle/columns.py`, from which",
        "`ascentwind new-vehicle` takes the comments above its tables. Modes count from 1 (shown here for one",
        "mode), TANK is the name of a tank under `[[slosh]]`. x is metres forward of the gimbal plane, X_CG the",
        "centre of gravity, s a load station, c'_N the local normal-force slope. Signs of loads: a bending moment",
        "is positive where it turns the nose towards +Y; a shear force where it pushes the part forward of s",
        "towards +Y; an axial force in compression.",
    ]
    for title, columns in TABLES:
        lines += ["", f"## {title}", "", "| column | sign | meaning |", "|---|---|---|"]
        lines += [f"| `{column.label}` | {SIGNS[column.sign]} | {column.meaning} |" for column in columns]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
