"""The C source of the ensemble: many runs side by side, for the sizes of one system."""

from __future__ import annotations

import hashlib

from ...model.system.linear_system import LinearSystem
from ..toolchain.templates import render

LANES = 32  # runs side by side in the vector registers


def ensemble_sizes(system: LinearSystem) -> dict[str, int]:
    """Return all of a system that shapes its ensemble."""
    return {"states": len(system.states), "sources": len(system.sources), "outputs": len(system.outputs)}


def ensemble_fingerprint(system: LinearSystem) -> str:
    """Return a hash of the source, which is quickly written."""
    return hashlib.sha256(ensemble_source(system).encode()).hexdigest()


def ensemble_source(system: LinearSystem) -> str:
    """Return the C source for the sizes of a system."""
    return render("ensemble.c.jinja", title=system.name, lanes=LANES, **ensemble_sizes(system))
