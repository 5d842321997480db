"""Bending modes over flight, each followed through crossings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment
from threadpoolctl import threadpool_limits

from ....model.construction import Construction
from ....model.errors import ModeError
from ..mass.line import beam_edges, mass_line, rotary_line
from .beam import FreeBeam

_SPARE_MODES = 3  # beyond those asked for: one of them may cross into the range
LEAST_LIKENESS = 0.8
_HALVINGS = 8

_Step = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]  # frequency, shapes, likeness


@dataclass(frozen=True, eq=False)
class ModeHistory:
    """Bending modes over time, normalised to a displacement of 1 at the forward end.

    Attributes
    ----------
    time : (t,) array
        s.
    frequency, generalized_mass : (t, k) arrays
        rad/s, kg. Numbered by frequency at the first time; from there each is followed by its shape.
    x : (n,) array
        Nodes, metres forward of the gimbal plane.
    displacement, rotation : (t, k, n) arrays
        1, 1/m.
    likeness : (t, k) array
        Modal assurance: squared cosine between the shape and that at the time before, weighted by mass.
    """

    time: NDArray[np.float64]
    frequency: NDArray[np.float64]
    generalized_mass: NDArray[np.float64]
    x: NDArray[np.float64]
    displacement: NDArray[np.float64]
    rotation: NDArray[np.float64]
    likeness: NDArray[np.float64]


def followed_modes(
    construction: Construction,
    time: ArrayLike,
    liquid: Mapping[str, ArrayLike],
    count: int,
    edges: ArrayLike | None = None,
) -> ModeHistory:
    """Compute the modes at given times and follow each by the likeness of its shape.

    Where a shape changes so much from one time to the next that it cannot be told, times are halved in between, with
    the liquid linear over time.

    Parameters
    ----------
    construction : Construction
    time : (t,) array
        s, increasing.
    liquid : mapping
        Tank name to the liquid in it over time (t,) in kg.
    count : int
        How many modes, by frequency at the first time.
    edges : (n,) array, optional
        Nodes, metres forward of the gimbal plane; without, those of ``beam_edges``.

    Raises
    ------
    ModeError
        A mode cannot be followed, or does not move the forward end; time and mode are named.
    """
    times = np.asarray(time, dtype=float)
    amounts = {name: np.broadcast_to(np.asarray(v, dtype=float), times.shape) for name, v in liquid.items()}
    nodes = beam_edges(construction) if edges is None else np.asarray(edges, dtype=float)
    whole = FreeBeam.of(construction, nodes)
    # all at once: the level of a tank is searched for, and costs as much for one time as for hundreds
    lines = np.broadcast_to(mass_line(construction, nodes, amounts), (times.size, nodes.size - 1))
    known = dict(zip(times.tolist(), lines, strict=True))

    def at(now: float) -> tuple[FreeBeam, NDArray[np.float64]]:
        there = {name: float(np.interp(now, times, v)) for name, v in amounts.items()}
        masses = known[now] if now in known else mass_line(construction, nodes, there)
        if not construction.grains and not construction.jettisons:
            return whole, masses
        return whole.with_rotary(rotary_line(construction, nodes, there)), masses

    def follow(shapes: NDArray[np.float64], before: float, now: float, halvings: int) -> _Step:
        beam, masses = at(now)
        frequency, candidates = beam.eigenmodes(masses, count + _SPARE_MODES)
        own = np.diag(beam.product(masses, shapes, shapes))
        alike = beam.product(masses, shapes, candidates) ** 2 / own[:, None]
        rows, columns = linear_sum_assignment(-alike)
        likeness = alike[rows, columns]
        if likeness.min() >= LEAST_LIKENESS:
            return frequency[columns], candidates[columns], likeness
        if halvings == 0:
            raise ModeError(
                f"bending mode {int(np.argmin(likeness)) + 1} cannot be followed past t = {before:g} s: the likest "
                f"shape at {now:g} s has a modal assurance of {likeness.min():.2f}; ask for fewer modes or end earlier"
            )
        middle = 0.5 * (before + now)
        _, halfway, first = follow(shapes, before, middle, halvings - 1)
        frequency, candidates, second = follow(halfway, middle, now, halvings - 1)
        return frequency, candidates, np.minimum(first, second)

    with threadpool_limits(1, user_api="blas"):  # the matrices are small: on two threads they take ten times as long
        beam, masses = at(float(times[0]))
        step: _Step = (*beam.eigenmodes(masses, count), np.ones(count))
        steps = [step]
        for before, now in pairwise(times):
            step = follow(step[1], float(before), float(now), _HALVINGS)
            steps.append(step)
    modes = [whole.scaled(frequency, shapes, float(t)) for t, (frequency, shapes, _) in zip(times, steps, strict=True)]
    return ModeHistory(
        time=times,
        frequency=np.array([m.frequency for m in modes]),
        generalized_mass=np.array([m.generalized_mass for m in modes]),
        x=nodes,
        displacement=np.array([m.displacement for m in modes]),
        rotation=np.array([m.rotation for m in modes]),
        likeness=np.array([likeness for _, _, likeness in steps]),
    )
