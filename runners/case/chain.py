"""The states of a case as a Markov chain at given times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..solvers.markov_chain import MarkovChain, chain_by_exact_steps, chain_by_sweep
from ..solvers.sweep import available_sweep
from .case import Case

TOLERANCE = 1e-6  # relative, of the sweep
SUBSTEP = 0.01  # s, of exact steps where nothing is compiled


def chain_at(case: Case, nodes: NDArray[np.float64], relative_tolerance: float = TOLERANCE) -> MarkovChain:
    """Return the states of a case as a chain, by the sweep, or by exact steps where nothing is compiled.

    Parameters
    ----------
    case : Case
    nodes : (m,) array
        s, increasing, cut where flight is cut (:func:`time_nodes`).
    relative_tolerance : float

    Raises
    ------
    IntegrationError, DataError
    """
    engine = available_sweep(case.executable)
    if engine is None:
        return chain_by_exact_steps(case.with_means, nodes, SUBSTEP)
    return chain_by_sweep(engine, case.with_means, nodes, relative_tolerance)
