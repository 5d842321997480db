"""Every loaded ensemble against NumPy: two steps of one run, with random numbers drawn in Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .simulation import CompiledEnsemble, Steps

AGREEMENT = 1e-10
SEED, RUN = 504, 3


def difference_from_numpy(compiled: CompiledEnsemble, states: int, sources: int, outputs: int) -> float:
    """Return the largest difference between outputs of a run and those of NumPy, relative to the largest."""
    random = np.random.default_rng(SEED)
    shapes = [(sources, states, states), (2, states, states), (2, sources, states, states), (2, outputs, states)]
    steps = Steps(*(random.standard_normal(shape) for shape in shapes))
    _, paths = compiled.run(steps, SEED, RUN, 1, keep_paths=True)
    assert paths is not None
    expected = np.zeros((2, outputs))
    for s in range(sources):
        x = steps.start[s] @ standard_normals(SEED, RUN, 0, s, states)
        for k in range(2):
            x = steps.transition[k] @ x + steps.noise[k, s] @ standard_normals(SEED, RUN, k + 1, s, states)
            expected[k] += steps.output[k] @ x
    difference = float(np.abs(paths[0] - expected).max(initial=0.0))
    return difference / max(float(np.abs(expected).max(initial=0.0)), 1e-300) if difference else 0.0


def standard_normals(seed: int, run: int, step: int, source: int, count: int) -> NDArray[np.float64]:
    """Return standard normal numbers by Philox 4x32-10 and Box and Muller, as the compiled ensemble draws them."""
    z: list[float] = []
    for pair in range((count + 1) // 2):
        a, b, c, d = philox((seed & 0xFFFFFFFF, seed >> 32), (run, step, source, pair))
        u, v = ((((high << 32 | low) >> 11) + 1) / 2.0**53 for high, low in ((a, b), (c, d)))
        radius = np.sqrt(-2.0 * np.log(u))
        z += [radius * np.cos(2 * np.pi * v), radius * np.sin(2 * np.pi * v)]
    return np.array(z[:count])


def philox(key: tuple[int, int], counter: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    """Return four words of Philox 4x32-10 (Salmon, Moraes, Dror and Shaw 2011)."""
    (k0, k1), (c0, c1, c2, c3) = key, counter
    for _ in range(10):
        a, b = 0xD2511F53 * c0, 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (b >> 32) ^ c1 ^ k0, b & 0xFFFFFFFF, (a >> 32) ^ c3 ^ k1, a & 0xFFFFFFFF
        k0, k1 = (k0 + 0x9E3779B9) & 0xFFFFFFFF, (k1 + 0xBB67AE85) & 0xFFFFFFFF
    return c0, c1, c2, c3
