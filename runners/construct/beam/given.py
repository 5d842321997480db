"""Bending modes that others computed, held against the vehicle's own masses and brought to every row of the flight."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from threadpoolctl import threadpool_limits

from ....model.construction import Construction
from ....model.construction.given_modes import GivenModes
from ....model.errors import ExtrapolationWarning, ModeError, PlausibilityWarning
from ..mass.line import beam_edges, mass_line, rotary_line
from .beam import FreeBeam, line_matrix
from .modes import LEAST_LIKENESS, ModeHistory

Array = NDArray[np.float64]

LARGEST_PRODUCT = 0.05  # of two modes, or of a mode and a rigid motion, by mass; 1 if they were the same
LARGEST_MASS_ERROR = 0.05  # of a generalised mass against the integral over the masses
LARGEST_FREQUENCY_ERROR = 0.15  # of the beam's own frequency, beyond which stiffness and modes hardly go together


def given_modes(construction: Construction, time: ArrayLike, liquid: Mapping[str, ArrayLike]) -> ModeHistory:
    """Return the modes that a construction gives, at the rows of the flight.

    Shapes are cubic splines over the stations; shapes, frequencies and generalised masses are linear over time and held
    outside. What little of a rigid motion is left in a mode is taken out row by row, with the masses of the row: loads
    close to rounding only if modes carry neither momentum nor angular momentum.

    Parameters
    ----------
    construction : Construction
        With ``modes``.
    time : (t,) array
        s.
    liquid : mapping
        Tank name to the liquid in it over time (t,) in kg.

    Raises
    ------
    ModeError
        A mode is not orthogonal to the others or to rigid motion of the vehicle's masses, its generalised mass is that
        of other masses, or its shape is another one from one time to the next.

    Warns
    -----
    ExtrapolationWarning
        Modes are held before their first or after their last time.
    PlausibilityWarning
        The beam with the construction's stiffness has other frequencies.
    """
    modes = construction.modes
    assert modes is not None
    times = np.asarray(time, dtype=float)
    _warn_of_held(modes, times)
    nodes = beam_edges(construction)
    stations = np.clip(nodes + construction.gimbal_station, modes.station[0], modes.station[-1])
    shapes = CubicSpline(modes.station, modes.displacement, axis=-1)(stations)
    turns = CubicSpline(modes.station, modes.rotation, axis=-1)(stations)
    amounts = {name: np.broadcast_to(np.asarray(v, dtype=float), times.shape) for name, v in liquid.items()}
    lines = mass_line(construction, nodes, amounts)
    rotary = np.broadcast_to(rotary_line(construction, nodes, amounts), lines.shape)
    with threadpool_limits(1, user_api="blas"):
        _check(construction, modes, nodes, times, lines, shapes, turns, rotary)
        made = _at_rows(modes, nodes, times, lines, shapes, turns, rotary)
    likeness = np.ones((times.size, construction.bending_modes))
    return ModeHistory(times, made[0], made[1], nodes, made[2], made[3], likeness)


def _at_rows(
    modes: GivenModes, nodes: Array, times: Array, lines: Array, shapes: Array, turns: Array, rotary: Array
) -> tuple[Array, Array, Array, Array]:
    """Return frequencies and generalised masses (t, k), displacements and rotations (t, k, n), without rigid motion."""

    def over_time(values: Array) -> Array:
        flat = values.reshape(modes.time.size, -1)
        at = [np.interp(times, modes.time, column) for column in flat.T]
        return np.stack(at, axis=1).reshape(times.size, *values.shape[1:])

    frequency, mass, Y, R = (over_time(v) for v in (modes.frequency, modes.generalized_mass, shapes, turns))
    for row, line in enumerate(lines):
        J = line_matrix(rotary[row])
        rigid, turned = np.vstack([np.ones(nodes.size), nodes]), np.vstack([np.zeros(nodes.size), np.ones(nodes.size)])
        M = line_matrix(line)
        own = rigid @ M @ rigid.T + turned @ J @ turned.T
        share = np.linalg.solve(own, rigid @ M @ Y[row].T + turned @ J @ R[row].T)
        Y[row] -= share.T @ rigid
        R[row] -= share.T @ turned
    end = Y[..., -1]
    return frequency, mass / end**2, Y / end[..., None], R / end[..., None]


def _check(
    construction: Construction,
    modes: GivenModes,
    nodes: Array,
    times: Array,
    lines: Array,
    shapes: Array,
    turns: Array,
    rotary: Array,
) -> None:
    """Hold the modes, at their own times, against the masses that the vehicle has then."""
    before: Array | None = None
    for t, now in enumerate(modes.time):
        if not times[0] <= now <= times[-1]:
            continue
        line, turning = (np.array([np.interp(now, times, column) for column in of.T]) for of in (lines, rotary))
        M, J = line_matrix(line), line_matrix(turning)
        gram = shapes[t] @ M @ shapes[t].T + turns[t] @ J @ turns[t].T
        center = float(np.ones(nodes.size) @ M @ nodes) / line.sum()
        rigid = np.vstack([np.ones(nodes.size), nodes - center])
        turned = np.vstack([np.zeros(nodes.size), np.ones(nodes.size)])
        size = np.sqrt(np.diag(rigid @ M @ rigid.T + turned @ J @ turned.T))
        own = np.sqrt(np.diag(gram))
        left = np.abs(rigid @ M @ shapes[t].T + turned @ J @ turns[t].T) / size[:, None] / own
        _refuse_others(modes, float(now), t, gram, left)
        if before is not None:
            likeness = np.diag(shapes[t] @ M @ before.T) ** 2 / np.diag(shapes[t] @ M @ shapes[t].T)
            likeness = likeness / np.diag(before @ M @ before.T)
            if likeness.min() < LEAST_LIKENESS:
                raise ModeError(
                    f"mode {int(np.argmin(likeness)) + 1} has another shape at {now:g} s than at the time before "
                    f"(modal assurance {likeness.min():.2f}); number modes by their shape, or give times between"
                )
        before = shapes[t]
        _warn_of_other_stiffness(construction, modes, nodes, line, t)


def _refuse_others(modes: GivenModes, now: float, t: int, gram: Array, left: Array) -> None:
    own = np.sqrt(np.diag(gram))
    if left.max() > LARGEST_PRODUCT:
        which, mode = np.unravel_index(int(np.argmax(left)), left.shape)
        raise ModeError(
            f"mode {mode + 1} at {now:g} s {('moves', 'turns')[int(which)]} the vehicle's masses as a whole "
            f"({left.max():.3f} of its size, {LARGEST_PRODUCT:g} allowed); they are not the masses that it was "
            "computed with"
        )
    product = np.abs(gram) / np.outer(own, own) - np.eye(own.size)
    if product.max() > LARGEST_PRODUCT:
        i, j = np.unravel_index(int(np.argmax(product)), product.shape)
        raise ModeError(
            f"modes {min(i, j) + 1} and {max(i, j) + 1} at {now:g} s are not orthogonal by the vehicle's masses "
            f"({product.max():.3f}, {LARGEST_PRODUCT:g} allowed); they are not the masses that they were computed with"
        )
    error = modes.generalized_mass[t] / np.diag(gram) - 1
    if np.abs(error).max() > LARGEST_MASS_ERROR:
        mode = int(np.argmax(np.abs(error)))
        raise ModeError(
            f"mode {mode + 1} at {now:g} s has a generalised mass of {modes.generalized_mass[t, mode]:.6g} kg with 1 "
            f"at the forward end, but the vehicle's masses give {gram[mode, mode]:.6g} kg; check units and masses"
        )


def _warn_of_other_stiffness(construction: Construction, modes: GivenModes, nodes: Array, line: Array, t: int) -> None:
    found, _ = FreeBeam.of(construction, nodes).eigenmodes(line, modes.frequency.shape[1])
    error = np.sort(modes.frequency[t]) / found - 1
    if np.abs(error).max() > LARGEST_FREQUENCY_ERROR:
        mode = int(np.argmax(np.abs(error)))
        warnings.warn(
            f"given modes have {np.sort(modes.frequency[t])[mode]:.4g} rad/s at {modes.time[t]:g} s where a beam "
            f"of the given stiffness has {found[mode]:.4g} rad/s (mode {mode + 1}); the given ones are used, so "
            "check [stiffness]",
            PlausibilityWarning,
            stacklevel=5,
        )


def _warn_of_held(modes: GivenModes, times: Array) -> None:
    held = max(modes.time[0] - times[0], 0.0) + max(times[-1] - modes.time[-1], 0.0)
    if held > 0.02 * (times[-1] - times[0]):
        warnings.warn(
            f"modes are given from {modes.time[0]:g} to {modes.time[-1]:g} s and held for {held:.4g} s of the flight, "
            f"{times[0]:g} to {times[-1]:g} s; give them at its ends too",
            ExtrapolationWarning,
            stacklevel=4,
        )
