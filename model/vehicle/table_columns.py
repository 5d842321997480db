"""Which columns each table of a vehicle may hold."""

from __future__ import annotations

from . import columns as c
from .columns import Column
from .vehicle_file import VehicleFile


def table_columns(file: VehicleFile) -> dict[str, tuple[Column, ...]]:
    """Return by file name every column that a table of a vehicle has a use for, its argument first."""
    modes, tanks = len(file.bending), [tank.name for tank in file.slosh]
    tables, control = file.tables, file.control
    by_option = (*c.REACTION, *c.by_need_columns(modes))
    found = {
        tables.rigid_body.file: c.RIGID_BODY,
        tables.trajectory.file: (*c.TRAJECTORY, *c.OWN_ANGLE.values(), c.AZIMUTH_CHANGE),
        tables.propulsion.file: c.PROPULSION,
        tables.aerodynamics.file: c.AERODYNAMICS,
        control.gains.file: c.GAINS,
        **{mode.table.file: (*c.bending_columns(tanks), c.MOVED_MODE) for mode in file.bending},
        **{tank.table.file: c.SLOSH for tank in file.slosh},
        **{load.table.file: (*c.load_columns(modes, tanks), *by_option) for load in file.loads},
        **{load.shear.file: c.whole_shear_columns(modes) for load in file.loads if load.shear},
        **{load.axial.file: c.AXIAL for load in file.loads if load.axial},
        **{load.local.file: c.local_load_columns(modes) for load in file.loads if load.local},
        **{sensor.modes.file: c.mode_columns(modes) for sensor in control.load_relief.values() if sensor.modes},
        **{sensor.schedule.file: c.SCHEDULE for sensor in control.load_relief.values() if sensor.schedule},
    }
    if tables.product_of_inertia:
        found[tables.product_of_inertia.file] = (c.PRODUCT_OF_INERTIA,)
    if tables.local_aerodynamics:
        found[tables.local_aerodynamics.file] = c.local_columns(modes)
    found = {name: (c.TIME, *columns) for name, columns in found.items()}
    if tables.loads_along_vehicle:
        found[tables.loads_along_vehicle.file] = (*c.ALONG_ARGUMENTS, *c.along_columns(modes, tanks))
    if tables.shear_along_vehicle:
        found[tables.shear_along_vehicle.file] = (*c.ALONG_ARGUMENTS, *c.whole_shear_columns(modes))
    if tables.axial_along_vehicle:
        found[tables.axial_along_vehicle.file] = (*c.ALONG_ARGUMENTS, *c.AXIAL, c.RADIUS)
    if tables.normal_force_along_vehicle:
        found[tables.normal_force_along_vehicle.file] = (*c.ALONG_ARGUMENTS, *c.normal_force_columns(modes))
    if file.wind.turbulence and file.wind.turbulence.intensity:
        found[file.wind.turbulence.intensity.file] = (c.ALTITUDE, *c.TURBULENCE)
    return found | {file.wind.statistics.file: (c.ALTITUDE, *c.WIND)}
