"""Figures of a built vehicle: flight, masses, modes, slosh, aerodynamics and loads."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes

from ..present.style import STYLE, Figure
from ..present.wording import display, words
from .vehicle_numbers import VehicleNumbers


def flight_figure(numbers: VehicleNumbers) -> Figure:
    """Return altitude, speed, Mach number, dynamic pressure, thrust and angles over time."""
    flight = numbers.flight
    t = flight.time
    with rc_context(STYLE):
        figure, axes = _page(numbers, "mean flight", 3, 2)
        _line(axes[0, 0], t, flight.altitude / 1e3, "altitude (km)")
        _line(axes[0, 1], t, flight.relative_velocity, "relative velocity (m/s)")
        _line(axes[1, 0], t, flight.mach, "Mach number")
        _line(axes[1, 1], t, flight.dynamic_pressure / 1e3, "dynamic pressure (kPa)")
        factor, unit = display("N", flight.thrust)
        axes[2, 0].plot(t, factor * flight.thrust, label="thrust")
        axes[2, 0].plot(t, factor * flight.control_thrust, "--", label="gimballed engines")
        axes[2, 0].plot(t, factor * flight.drag, ":", label="drag")
        axes[2, 0].set_ylabel(f"force ({unit})")
        axes[2, 1].plot(t, np.rad2deg(flight.flight_path_angle), label="relative flight path above horizon")
        axes[2, 1].plot(t, 90 - np.rad2deg(flight.pitch), "--", label="axis above the horizon at launch")
        axes[2, 1].set_ylabel("angle (deg)")
        for panel in axes[2]:
            panel.legend(fontsize=8.5)
        _mark_events(numbers, axes)
    return figure


def masses_figure(numbers: VehicleNumbers) -> Figure:
    """Return mass, centre of gravity, inertia and liquids over time."""
    t, properties = numbers.flight.time, numbers.properties
    with rc_context(STYLE):
        figure, axes = _page(numbers, "masses", 2, 2)
        _line(axes[0, 0], t, properties.mass / 1e3, "mass (t)")
        _line(axes[0, 1], t, properties.center_of_gravity, "c.g. (m forward of gimbal)")
        scale, unit = (1e6, "10⁶ kg m²") if properties.moment_of_inertia.max() > 1e7 else (1e3, "10³ kg m²")
        _line(axes[1, 0], t, properties.moment_of_inertia / scale, f"pitch inertia ({unit})")
        for tank, liquid in numbers.flight.liquid.items():
            axes[1, 1].plot(t, liquid / 1e3, label=words(tank))
        axes[1, 1].set_ylabel("liquid (t)")
        axes[1, 1].legend(fontsize=8.5)
        _mark_events(numbers, axes)
    return figure


def modes_figure(numbers: VehicleNumbers) -> Figure:
    """Return frequencies and generalised masses over time, and the shapes at three times."""
    modes, gimbal = numbers.modes, numbers.construction.gimbal_station
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.2 + 2.4 * modes.frequency.shape[1]), layout="constrained")
        figure.suptitle(f"{numbers.construction.name}: bending modes")
        grid = figure.add_gridspec(1 + modes.frequency.shape[1], 2)
        frequency, mass = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
        for k in range(modes.frequency.shape[1]):
            frequency.plot(modes.time, modes.frequency[:, k], label=f"mode {k + 1}")
            mass.plot(modes.time, modes.generalized_mass[:, k] / 1e3, label=f"mode {k + 1}")
            axes = figure.add_subplot(grid[1 + k, :])
            for row, style in zip(_rows(numbers), ("-", "--", ":"), strict=True):
                axes.plot(modes.x + gimbal, modes.displacement[row, k], style, label=f"{modes.time[row]:.0f} s")
            for tank, slosh in numbers.slosh.items():
                axes.axvline(slosh.attach_point[_rows(numbers)[1]] + gimbal, color="grey", lw=0.7)
                axes.annotate(
                    words(tank), (slosh.attach_point[_rows(numbers)[1]] + gimbal, 0.6), rotation=90, fontsize=7,
                    xycoords=("data", "axes fraction"), textcoords="offset points", xytext=(2, 0),
                )  # fmt: skip
            axes.set(ylabel=f"shape of mode {k + 1}", xlabel="vehicle station (m)")
            axes.margins(x=0)
            axes.legend(fontsize=8.5)
        frequency.set(xlabel="flight time (s)", ylabel="frequency (rad/s)", ylim=(0, None))
        mass.set(xlabel="flight time (s)", ylabel="generalised mass (t)", ylim=(0, None))
        frequency.legend(fontsize=8.5)
    return figure


def slosh_figure(numbers: VehicleNumbers) -> Figure:
    """Return mass, frequency and attach point of every slosh mode over time."""
    t = numbers.flight.time
    with rc_context(STYLE):
        figure, axes = _page(numbers, f"slosh, method '{numbers.construction.slosh_method}'", 3, 1)
        for tank, slosh in numbers.slosh.items():
            axes[0, 0].plot(t, slosh.mass / 1e3, label=words(tank))
            axes[1, 0].plot(t, slosh.frequency, label=words(tank))
            axes[2, 0].plot(t, slosh.attach_point, label=words(tank))
        axes[2, 0].plot(t, numbers.properties.center_of_gravity, "k--", lw=1, label="centre of gravity")
        for panel, label in zip(axes[:, 0], ("slosh mass (t)", "frequency (rad/s)", "attach point (m)"), strict=True):
            panel.set_ylabel(label)
        axes[2, 0].legend(fontsize=8.5, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        _mark_events(numbers, axes)
    return figure


def aerodynamics_figure(numbers: VehicleNumbers) -> Figure:
    """Return slope and centre of pressure over Mach number, and the local normal force along the vehicle."""
    flight, gimbal = numbers.flight, numbers.construction.gimbal_station
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 6.4), layout="constrained")
        figure.suptitle(
            f"{numbers.construction.name}: normal force, reference area {numbers.construction.reference_area:g} m²"
        )
        grid = figure.add_gridspec(2, 2)
        slope, center, local = (figure.add_subplot(g) for g in (grid[0, 0], grid[0, 1], grid[1, :]))
        slope.plot(flight.mach, numbers.normal_force_slope)
        slope.set(xlabel="Mach number", ylabel="C'_N (1/rad)", ylim=(0, None))
        center.plot(flight.mach, numbers.center_of_pressure, label="centre of pressure")
        center.plot(flight.mach, numbers.properties.center_of_gravity, "--", label="centre of gravity")
        center.set(xlabel="Mach number", ylabel="m forward of gimbal")
        center.legend(fontsize=8.5)
        for row, style in zip(_rows(numbers), ("-", "--", ":"), strict=True):
            local.plot(
                numbers.line.points + gimbal,
                numbers.intensity[row],
                style,
                lw=1.3,
                label=f"Mach {flight.mach[row]:.2f}",
            )
        local.set(xlabel="vehicle station (m)", ylabel="local slope (1/rad/m)")
        local.margins(x=0)
        local.legend(fontsize=8.5)
    return figure


def loads_figure(numbers: VehicleNumbers) -> Figure:
    """Return the coefficients of the bending moment along the vehicle at three times."""
    station = numbers.stations + numbers.construction.gimbal_station
    rows = _rows(numbers)
    of_angle, angle_unit = display("N m/rad", [numbers.loads[row].angle_of_attack for row in rows])
    of_engine, engine_unit = display("N m/rad", [numbers.loads[row].engine_angle for row in rows])
    with rc_context(STYLE):
        figure, axes = _page(numbers, "coefficients of the bending moment along the vehicle", 2, 2, sharex=True)
        for row, style in zip(rows, ("-", "--", ":"), strict=True):
            c, label = numbers.loads[row], f"{numbers.flight.time[row]:.0f} s"
            axes[0, 0].plot(station, of_angle * c.angle_of_attack, style, color="C0", label=label)
            axes[0, 1].plot(station, of_engine * c.engine_angle, style, color="C0", label=label)
            for k in range(c.bending.shape[0]):
                axes[1, 0].plot(
                    station, c.bending[k] / 1e3, style, color=f"C{k}", label=f"mode {k + 1}" if style == "-" else None
                )
            for k, tank in enumerate(numbers.slosh):
                axes[1, 1].plot(
                    station, c.slosh[k] / 1e3, style, color=f"C{k}", label=words(tank) if style == "-" else None
                )
        labels = (f"M'_α ({angle_unit})", f"M'_β ({engine_unit})", "M'_η (10³ N s²)", "M'_ξ (10³ N s²)")
        for panel, label in zip(axes.flat, labels, strict=True):
            panel.set_ylabel(label)
            panel.set_xlabel("vehicle station (m)")
            panel.margins(x=0)
            for load in numbers.construction.load_stations:
                panel.axvline(load, color="black", lw=0.8, ls=":")
            if panel.lines:
                panel.legend(fontsize=7)
    return figure


FIGURES: dict[str, Callable[[VehicleNumbers], Figure]] = {
    "flight": flight_figure,
    "masses": masses_figure,
    "bending_modes": modes_figure,
    "slosh": slosh_figure,
    "aerodynamics": aerodynamics_figure,
    "loads": loads_figure,
}


def _page(numbers: VehicleNumbers, title: str, rows: int, columns: int, sharex: bool = False):
    figure = Figure(figsize=(4.6 * columns if columns > 1 else 8.0, 2.5 * rows + 0.6), layout="constrained")
    figure.suptitle(f"{numbers.construction.name}: {title}")
    return figure, figure.subplots(rows, columns, squeeze=False, sharex=sharex)


def _line(axes: Axes, x: np.ndarray, y: np.ndarray, label: str) -> None:
    axes.plot(x, y)
    axes.set_ylabel(label)


def _rows(numbers: VehicleNumbers) -> tuple[int, int, int]:
    """Return the first row, that of the largest dynamic pressure, and the last."""
    return 0, int(np.argmax(numbers.flight.dynamic_pressure)), numbers.flight.time.size - 1


def _mark_events(numbers: VehicleNumbers, axes: np.ndarray) -> None:
    for panel in axes.flat:
        panel.set_xlabel("flight time (s)")
        for event, time in numbers.flight.events.items():
            if event.endswith("cutoff"):
                panel.axvline(time, color="black", lw=0.7, ls=":")
