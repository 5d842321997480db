"""The mean flight: ascent by the pitch programme, integrated by CVODES, with its events."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ....model.construction import Construction
from ....model.construction.jettison import Jettison
from ....model.errors import DataError
from .integration import Ascent, Leg
from .limits import check_held, check_leg, check_lift_off, first_depletion
from .pieces import piece_edges

Array = NDArray[np.float64]
EVENT_MARGIN = 1e-4  # s, of the rows on either side of a cutoff
AT_EVENTS = ("mach", "relative_velocity", "altitude", "dynamic_pressure", "mass")
_LONGEST_LEG = 1.0  # s


@dataclass(frozen=True, eq=False)
class MeanFlight:
    """Flight of the point mass without wind, by rows of time.

    Rows stand at multiples of the spacing after release, and 0.1 ms either side of every cutoff and jettison, where
    thrust or masses jump.

    Attributes
    ----------
    time : (n,) array
        Range time (s).
    altitude : (n,) array
        Above the ellipsoid, of the centre of gravity (m).
    relative_velocity, mach, dynamic_pressure, pressure : (n,) arrays
        Speed relative to the air (m/s) and its Mach number; q and ambient pressure (Pa).
    thrust, control_thrust, drag : (n,) arrays
        N; control thrust is that of the gimballed engines.
    axial_acceleration : (n,) array
        (thrust - drag) / mass (m/s2).
    mass : (n,) array
        All masses and the liquid left (kg).
    flight_path_angle : (n,) array
        Of the relative velocity above the local horizontal (rad).
    pitch : (n,) array
        Of the axis in the plumbline frame, 0 vertical, positive downrange (rad).
    angle_of_attack : (n,) array
        Between axis and relative velocity (rad).
    angle_of_attack_pitch, angle_of_attack_yaw : (n,) arrays
        In the pitch plane of the plumbline frame, positive where the nose is pitched over from the relative velocity,
        and across it, positive where the nose is to the right of it (rad).
    azimuth_change : (n,) array
        How far that pitch plane, which does not turn with the Earth, lies to the right of the flight's azimuth by the
        north of where the vehicle is (rad).
    inertial_speed, inertial_flight_path_angle : (n,) arrays
        m/s, rad.
    surface_range : (n,) array
        From the site over the turning Earth (m).
    liquid : mapping of str to (n,) array
        By tank, grain of a solid motor and mass that is dropped (kg).
    events : mapping of str to float
        'release', 'mach_one', 'max_dynamic_pressure', 'tilt_arrest' (of a gravity turn: 'gravity_turn') and the engine
        groups' cutoff events and the jettisons, as far as the flight reaches them (s).
    at_events : mapping of str to mapping of str to float
        At each of them ``mach``, ``relative_velocity``, ``altitude``, ``dynamic_pressure`` and ``mass``; at a cutoff or
        jettison just before it.
    """

    time: Array
    altitude: Array
    relative_velocity: Array
    mach: Array
    dynamic_pressure: Array
    pressure: Array
    thrust: Array
    control_thrust: Array
    drag: Array
    axial_acceleration: Array
    mass: Array
    flight_path_angle: Array
    pitch: Array
    angle_of_attack: Array
    angle_of_attack_pitch: Array
    angle_of_attack_yaw: Array
    azimuth_change: Array
    inertial_speed: Array
    inertial_flight_path_angle: Array
    surface_range: Array
    liquid: Mapping[str, Array]
    events: Mapping[str, float]
    at_events: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def fly(construction: Construction, spacing: float = 1.0) -> MeanFlight:
    """Fly a construction from release to ``end_time`` or to the cutoff of its last engines.

    Parameters
    ----------
    construction : Construction
    spacing : float
        Of the rows (s).

    Raises
    ------
    DataError
        Thrust below weight at release; ground impact; a tank that is empty before its engines are cut off; a Mach
        number or an altitude beyond the tables. The message names the time.
    IntegrationError
    """
    ascent = Ascent(construction)
    release, cutoffs = construction.site.release, [g.cutoff for g in construction.engines if g.cutoff is not None]
    grid = spacing * np.arange(np.floor(release / spacing) + 1, np.floor(construction.end_time / spacing + 1e-9) + 1)
    edges = _edges(construction, [*grid, *cutoffs])
    legs, cut = _legs(ascent, edges)
    end = legs[-1].end
    stops = {group.name: time for group, time in cut}
    for group in construction.engines:
        check_held(group, release, stops.get(group.name, end))
    events = {"release": release, **_programme_events(construction, end), **_found_events(ascent, legs)}
    events.update((group.cutoff_event, time) for group, time in cut)
    dropped = {j.event: j.time for j in construction.jettisons}
    events.update(dropped)
    jumps = sorted({*(time for _, time in cut), *dropped.values()})
    rows = _row_times(grid, jumps, release, end)
    observed = [ascent.observe(_leg_of(legs, t), t) for t in rows]
    names = [name for name in observed[0] if name in MeanFlight.__dataclass_fields__]
    return MeanFlight(
        time=rows,
        **{name: np.array([o[name] for o in observed]) for name in names},
        liquid={name: np.array([o[f"liquid.{name}"] for o in observed]) for name in construction.stores},
        events=events,
        at_events={name: _at_event(ascent, legs, time) for name, time in events.items()},
    )


def _edges(construction: Construction, more: Sequence[float]) -> list[float]:
    """Return the times after release at which a leg ends, at most a second apart."""
    begin, end = construction.site.release, construction.end_time
    times = {*piece_edges(construction), *more, end, *np.arange(np.ceil(begin), end, _LONGEST_LEG)}
    return sorted(float(t) for t in times if begin < t <= end)


def _legs(ascent: Ascent, edges: Sequence[float]) -> tuple[list[Leg], list[tuple]]:
    """Fly leg by leg; return the legs, and engine groups with the times of their cutoff."""
    construction = ascent.construction
    running, cut, legs = list(construction.engines), [], []
    now, state = construction.site.release, ascent.at_release()
    for edge in edges:
        while now < edge and running:
            leg = ascent.leg([g.name for g in running], now, edge, state)
            if not legs:
                check_lift_off(construction, ascent.observe(leg, now))
            dry = first_depletion(ascent, leg, running)
            if dry is not None:
                time, group = dry
                leg = ascent.leg([g.name for g in running], now, time, state)
                running.remove(group)
                cut.append((group, time))
            check_leg(ascent, leg)
            legs.append(leg)
            now, state = leg.end, leg.finish
        commanded = [g for g in running if g.cutoff is not None and g.cutoff <= now]
        cut += [(g, g.cutoff) for g in commanded]
        running = [g for g in running if g not in commanded]
        for jettison in (j for j in construction.jettisons if j.time == now):
            state = _without(construction, state, jettison)
            running = [g for g in running if g.name not in jettison.motors]
    late = [j for j in construction.jettisons if j.time > now]
    if late:
        raise DataError(
            f"jettison '{late[0].event}' at {late[0].time:g} s comes after the last engines stop at {now:g} s; drop it "
            "earlier, or leave it out",
            time=late[0].time,
        )
    return legs, cut


def _without(construction: Construction, state: Array, jettison: Jettison) -> Array:
    """Return the state without what a jettison drops."""
    kept = [name not in (*jettison.masses, *jettison.motors) for name in construction.stores]
    return np.concatenate([state[:6], np.where(kept, state[6:], 0.0)])


def _row_times(grid: Array, jumps: Iterable[float], begin: float, end: float) -> Array:
    """Return the times of the rows: the grid, and either side of every jump, within the flight."""
    jumps = np.array(sorted(jumps))
    sides = np.concatenate([jumps - EVENT_MARGIN, jumps + EVENT_MARGIN])
    if jumps.size:
        grid = grid[abs(grid[:, None] - jumps).min(axis=1) > 1.5 * EVENT_MARGIN]
    rows = np.unique(np.concatenate([grid, sides, [end] if end not in jumps else []]))
    return rows[(rows > begin) & (rows <= end)]


def _at_event(ascent: Ascent, legs: Sequence[Leg], time: float) -> dict[str, float]:
    observed = ascent.observe(legs[0] if time <= legs[0].begin else _leg_of(legs, time), time)
    return {name: float(observed[name]) for name in AT_EVENTS}


def _leg_of(legs: Sequence[Leg], time: float) -> Leg:
    return next(leg for leg in legs if leg.begin < time <= leg.end)


def _programme_events(construction: Construction, end: float) -> dict[str, float]:
    pitch = construction.pitch
    turn = pitch.kind == "gravity_turn"
    time = pitch.time_base + (float(pitch.time[-1]) if turn else pitch.arrest)
    return {"gravity_turn" if turn else "tilt_arrest": time} if time <= end else {}


def _found_events(ascent: Ascent, legs: Sequence[Leg]) -> dict[str, float]:
    """Locate Mach 1 and the maximum of the dynamic pressure."""
    found = {}
    for leg in legs:
        time = ascent.locate(leg, lambda o: o["mach"] - 1)
        if time is not None:
            found["mach_one"] = time
            break
    pressure = [ascent.observe(leg, leg.end)["dynamic_pressure"] for leg in legs]
    peak = int(np.argmax(pressure))
    for leg in legs[peak : peak + 2]:
        time = ascent.locate(leg, lambda o: o["dynamic_pressure_rate"])
        if time is not None:
            found["max_dynamic_pressure"] = time
    return found
