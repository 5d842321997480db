"""What the means of the pitch plane leave out or take in: the flight's own angle of attack, head- and tailwind."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from ...model.vehicle.mean_wind import GROUND_VELOCITY, air_speed, speed_without_wind
from ...model.vehicle.planes import plane_names
from ...model.vehicle.vehicle import Vehicle

SIDES = {"pitch": ("nose up", "nose pitched over"), "yaw": ("nose to the left", "nose to the right")}  # below 0, above


def trajectory_angle(vehicle: Vehicle, times: Sequence[float]) -> xr.Dataset | None:
    """Return the angle of attack that a vehicle has without wind, whether its equations take it in or not.

    Parameters
    ----------
    vehicle : Vehicle
    times : sequence of float
        s.

    Returns
    -------
    xarray.Dataset or None
        ``angle_of_attack`` (plane, time) in rad, positive where the nose is pitched over from the path or to the right
        of it; ``equivalent_wind``, V times it (m/s), across the path, positive in pitch for a tail wind; and
        ``dynamic_pressure`` (time, Pa). None where the table of the trajectory does not have it.
    """
    tables = {plane: vehicle.own_angles[plane] for plane in plane_names(vehicle.file) if plane in vehicle.own_angles}
    if not tables:
        return None
    angle = np.array([table.polynomial(times) for table in tables.values()])
    speed, pressure = (vehicle.tables[n].polynomial(times) for n in ("relative_velocity", "dynamic_pressure"))
    return xr.Dataset(
        {
            "angle_of_attack": (("plane", "time"), angle, {"units": "rad"}),
            "equivalent_wind": (("plane", "time"), speed * angle, {"units": "m/s"}),
            "dynamic_pressure": ("time", pressure, {"units": "Pa"}),
        },
        {"plane": list(tables), "time": ("time", np.asarray(times, float), {"units": "s"})},
        {"taken_in": int(vehicle.file.options.trajectory_angle_of_attack)},
    )


def in_words(found: xr.Dataset) -> Iterator[str]:
    """Yield a sentence for each plane: the angle where it loads the vehicle most, its wind, and whether it is in."""
    for plane in (str(name) for name in found["plane"].values):
        at = found.sel(plane=plane)
        at = at.isel(time=int(np.argmax(np.abs(at["dynamic_pressure"].values * at["angle_of_attack"].values))))
        angle, wind = float(at["angle_of_attack"]), float(at["equivalent_wind"])
        fate = (
            "taken in" if found.attrs["taken_in"] else "left out: options.trajectory_angle_of_attack = true takes it in"
        )
        yield (
            f"The flight without wind has an angle of attack of its own, in {plane} {math.degrees(abs(angle)):.2g}° "
            f"{SIDES[plane][angle > 0]} at {float(at['time']):g} s, where q times it is largest, as much as a wind of "
            f"{wind:.2g} m/s across the path; {fate}."
        )


def air_speed_in_words(vehicle: Vehicle, times: Sequence[float]) -> str:
    """Return what the mean wind makes of speed and dynamic pressure where that is largest, as a sentence.

    Parameters
    ----------
    vehicle : Vehicle
        That flies in pitch or both planes.
    times : sequence of float
        s.
    """
    time = times[int(np.argmax(vehicle.tables["dynamic_pressure"].polynomial(times)))]
    without, through = float(speed_without_wind(vehicle).polynomial(time)), float(air_speed(vehicle, time))
    fate = "taken in" if GROUND_VELOCITY in vehicle.tables else 'left out: wind.air_speed = "mean_wind" takes it in'
    return (
        f"The mean wind makes the speed through the air {through:.1f} m/s instead of {without:.1f} m/s at {time:g} s "
        f"and changes the dynamic pressure by {100 * ((through / without) ** 2 - 1):+.1f} %; {fate}."
    )


def trajectory_angle_csv(found: xr.Dataset) -> str:
    """Return it as CSV, a row for each time."""
    planes = [str(name) for name in found["plane"].values]
    lines = [",".join(["time [s]", *(f"angle_of_attack_{p} [rad],equivalent_wind_{p} [m/s]" for p in planes)])]
    for time in found["time"].values:
        at = found.sel(time=time)
        pairs = zip(at["angle_of_attack"].values, at["equivalent_wind"].values, strict=True)
        lines.append(",".join([f"{time:.9g}", *(f"{angle:.9g},{wind:.9g}" for angle, wind in pairs)]))
    return "\n".join(lines) + "\n"
