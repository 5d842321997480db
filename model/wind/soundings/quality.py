"""What was kept of a file of soundings, and what was not and why."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

SHOWN = 12


@dataclass(eq=False)
class Quality:
    """The report of a reading, filled while files are read.

    Attributes
    ----------
    read, kept : int
        Soundings in the files, and of them those used.
    levels : int
        Levels in the soundings used.
    left_out : Counter
        Levels not used, by reason.
    dropped : list of (str, str)
        Soundings not used, with the reason.
    selected : Counter
        Soundings passed over because another month, hour or year was asked for.
    notes : list of str
        What else a person should know: heights that were computed, levels at one altitude, missing-value codes.
    """

    read: int = 0
    kept: int = 0
    levels: int = 0
    left_out: Counter[str] = field(default_factory=Counter)
    dropped: list[tuple[str, str]] = field(default_factory=list)
    selected: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)

    def lines(self) -> list[str]:
        """Return the report as lines of text."""
        found = [f"{self.read} soundings read, {self.kept} kept with {self.levels} levels of wind"]
        found += [f"{count} passed over: {why}" for why, count in self.selected.most_common()]
        found += [f"{count} levels left out: {why}" for why, count in self.left_out.most_common()]
        found += [f"left out: {name}: {why}" for name, why in self.dropped[:SHOWN]]
        found += [f"and {len(self.dropped) - SHOWN} more soundings left out"] if len(self.dropped) > SHOWN else []
        found += self.notes[:SHOWN]
        return found + ([f"and {len(self.notes) - SHOWN} more notes"] if len(self.notes) > SHOWN else [])


def observed_by_level(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return how many profiles hold the wind of each level, (k,)."""
    return (np.isfinite(u) & np.isfinite(v)).sum(axis=0)
