"""What stays smooth between two times of the flight: pitch polynomial, thrust and flow of the running engines."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ....model.construction import Construction
from ....model.construction.ascent_equations import PITCH_COEFFICIENTS
from ....model.construction.flight import EngineGroup, PitchProgramme

Array = NDArray[np.float64]


def piece_edges(construction: Construction) -> set[float]:
    """Return the range times (s) at which the programme or an engine table has a corner or a jump."""
    pitch = construction.pitch
    of_programme = {pitch.begin, *pitch.segments[:, :2].ravel().tolist(), *pitch.time.tolist()}
    if pitch.kind != "gravity_turn":
        of_programme.add(pitch.arrest)
    edges = {pitch.time_base + tau for tau in of_programme}
    for group in construction.engines:
        edges.update(group.time.tolist())
    edges.update(jettison.time for jettison in construction.jettisons)
    return edges


def piece(construction: Construction, running: Iterable[str], begin: float, end: float) -> Array:
    """Return the coefficients, as ``AscentEquations`` takes them, between two times without an edge inside (s)."""
    middle = 0.5 * (begin + end)
    parts = [pitch_polynomial(construction.pitch, middle - construction.pitch.time_base)]
    running = set(running)
    for group in construction.engines:
        if group.name in running:
            parts += [_line(group, group.vacuum_thrust, middle), _line(group, group.mass_flow, middle)]
        else:
            parts.append(np.zeros(4))
    parts.append(np.array([float(middle < jettison.time) for jettison in construction.jettisons]))
    return np.concatenate(parts)


def follows_velocity(pitch: PitchProgramme, time: float) -> bool:
    """Tell whether the axis follows the relative velocity at a range time (s)."""
    return pitch.kind == "gravity_turn" and time - pitch.time_base > pitch.time[-1]


def pitch_polynomial(pitch: PitchProgramme, tau: float) -> Array:
    """Return the coefficients of chi (rad) by rising power of the programme time, valid at and about ``tau`` (s)."""
    held = np.zeros(PITCH_COEFFICIENTS)
    if tau < pitch.begin:
        return held
    if pitch.kind != "gravity_turn" and tau > pitch.arrest:
        before = pitch_polynomial(pitch, np.nextafter(pitch.arrest, -np.inf))
        held[0] = np.polynomial.polynomial.polyval(pitch.arrest, before)
        return held
    if pitch.kind == "polynomials":
        row = int(np.clip(np.searchsorted(pitch.segments[:, 1], tau), 0, len(pitch.segments) - 1))
        coefficients, last = pitch.segments[row, 2:], pitch.segments[-1, 1]
        if tau <= last:
            return coefficients
        held[0] = np.polynomial.polynomial.polyval(last, coefficients)
        return held
    if not pitch.time[0] < tau < pitch.time[-1]:
        held[0] = np.interp(tau, pitch.time, pitch.angle)
        return held
    held[:2] = _through(pitch.time, pitch.angle, tau)
    return held


def _line(group: EngineGroup, values: Array, at: float) -> Array:
    """Return constant and slope over range time of an engine table about a time.

    Outside its rows it is held, and of a solid motor zero.
    """
    if not group.time[0] < at < group.time[-1]:
        if group.solid:
            return np.zeros(2)
        return np.array([np.interp(at, group.time, values), 0.0])
    return _through(group.time, values, at)


def _through(x: Array, y: Array, at: float) -> Array:
    right = int(np.searchsorted(x, at))
    slope = (y[right] - y[right - 1]) / (x[right] - x[right - 1])
    return np.array([y[right] - slope * x[right], slope])
