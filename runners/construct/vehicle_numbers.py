"""All numbers of a vehicle's tables, computed from what it is built of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.construction import Construction
from ..present.progress import steps
from . import aerodynamics
from .ascent.mean_flight import MeanFlight, fly
from .beam.given import given_modes
from .beam.modes import ModeHistory, followed_modes
from .line_integrals import Line
from .loads import LoadCoefficients, LoadedVehicle, axial_coefficients, load_coefficients, shear_coefficients
from .mass.line import mass_line, rotary_line
from .mass.properties import MassProperties, mass_properties
from .slosh import SloshHistory, slosh_history

Array = NDArray[np.float64]
Progress = Callable[[str], None]

STEPS = ("mean flight", "mass properties", "aerodynamics", "slosh", "bending modes", "loads")
JUST_FORWARD = 1e-6  # m
STATIONS_ALONG = 31  # between the ends of the vehicle


@dataclass(frozen=True, eq=False)
class VehicleNumbers:
    """Everything over the rows of the flight.

    Attributes
    ----------
    construction : Construction
    flight : MeanFlight
    properties : MassProperties
    normal_force_slope, center_of_pressure : (t,) arrays
        1/rad, m forward of the gimbal plane.
    slosh : dict of str to SloshHistory
        By tank that sloshes.
    modes : ModeHistory
    line : Line
        Cut wherever a distribution may bend or jump, and at the stations.
    intensity : (t, points) array
        Local normal-force slope c'_N at the line's points (1/rad/m).
    displacement, slope : (t, modes, points) arrays
        Of the modes at the line's points (1, 1/m): where the axis lies, and dY/dx of it, which the air meets.
    stations : (s,) array
        m forward of the gimbal plane, load stations among them.
    loads, shears : tuples of LoadCoefficients
        Of bending moment and shear force at the stations, for each row.
    axial : tuple of dict of column to (s,) array, or None
        Of the axial force; None without an outline.
    """

    construction: Construction
    flight: MeanFlight
    properties: MassProperties
    normal_force_slope: Array
    center_of_pressure: Array
    slosh: dict[str, SloshHistory]
    modes: ModeHistory
    line: Line
    intensity: Array
    displacement: Array
    slope: Array
    stations: Array
    loads: tuple[LoadCoefficients, ...]
    shears: tuple[LoadCoefficients, ...]
    axial: tuple[dict[tuple[str, str], Array], ...] | None


def compute_vehicle(
    construction: Construction, spacing: float = 1.0, progress: Progress | None = None
) -> VehicleNumbers:
    """Fly the vehicle and compute its masses, aerodynamics, slosh, modes and loads over the flight.

    Parameters
    ----------
    construction : Construction
    spacing : float
        Of the rows (s).
    progress : callable, optional
        Called with the name of each of ``STEPS`` when it is done.

    Raises
    ------
    DataError, ModeError, IntegrationError
    """
    with steps(STEPS[0], len(STEPS)) as line:

        def done(step: str) -> None:
            line.done((*STEPS, "tables")[STEPS.index(step) + 1])
            if progress:
                progress(step)

        return _computed(construction, spacing, done)


def _computed(construction: Construction, spacing: float, done: Progress) -> VehicleNumbers:
    flight = fly(construction, spacing)
    done(STEPS[0])
    properties = mass_properties(construction, flight.liquid)
    done(STEPS[1])
    slope, center = aerodynamics.normal_force(construction, flight.mach, flight.time)
    done(STEPS[2])
    slosh = {
        tank.name: slosh_history(
            construction, tank.name, flight.liquid[tank.name], flight.axial_acceleration, flight.time
        )
        for tank in construction.tanks
        if tank.sloshes
    }
    done(STEPS[3])
    if construction.modes is None:
        modes = followed_modes(construction, flight.time, flight.liquid, construction.bending_modes)
    else:
        modes = given_modes(construction, flight.time, flight.liquid)
    done(STEPS[4])
    stations = along_stations(construction)
    line = Line.cut_at(modes.x, aerodynamics.knots(construction), stations)
    intensity = aerodynamics.intensity(construction, flight.mach, line.points, flight.time)
    displacement, rotation = (line.linear(modes.x, shape) for shape in (modes.displacement, modes.rotation))
    inclination = line.slope(modes.x, modes.displacement)
    mass = line.spread(modes.x, mass_line(construction, modes.x, flight.liquid))
    rotary = np.broadcast_to(line.spread(modes.x, rotary_line(construction, modes.x, flight.liquid)), mass.shape)
    at_stations = aerodynamics.intensity(construction, flight.mach, stations + JUST_FORWARD, flight.time)
    force = flight.dynamic_pressure * construction.reference_area
    loaded = [
        LoadedVehicle(
            line=line,
            mass=mass[row],
            rotary_inertia=rotary[row],
            normal_force=force[row] * intensity[row],
            normal_force_at_stations=force[row] * at_stations[row],
            control_thrust=float(flight.control_thrust[row]),
            relative_velocity=float(flight.relative_velocity[row]),
            displacement=displacement[row],
            rotation=rotation[row],
            slope=inclination[row],
            slosh_mass=np.array([tank.mass[row] for tank in slosh.values()]),
            slosh_point=np.array([tank.attach_point[row] for tank in slosh.values()]),
        )
        for row in range(flight.time.size)
    ]
    loads, shears = (
        tuple(
            make(v, stations).with_inertia(float(inertia))
            for v, inertia in zip(loaded, properties.moment_of_inertia, strict=True)
        )
        for make in (load_coefficients, shear_coefficients)
    )
    axial = None
    if construction.outline is not None:
        drag = construction.outline.drag_forward(stations + construction.gimbal_station)
        axial = tuple(axial_coefficients(v, stations, drag) for v in loaded)
    done(STEPS[5])
    return VehicleNumbers(
        construction, flight, properties, slope, center, slosh, modes,
        line, intensity, displacement, inclination, stations, loads, shears, axial,
    )  # fmt: skip


def along_stations(construction: Construction) -> Array:
    """Return evenly spaced stations and the load stations, m forward of the gimbal plane."""
    even = np.linspace(construction.aft_end, construction.forward_end, STATIONS_ALONG)
    step = even[1] - even[0]
    clear = [s for s in even if all(abs(s - load) > 0.1 * step for load in construction.load_stations)]
    return np.sort(np.array([*clear, *construction.load_stations])) - construction.gimbal_station
