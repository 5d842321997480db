"""The numbers that a system itself declares, in the form in which compiled code reads them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...model.system.linear_system import LinearSystem
from ...model.tables import TableGroup, run_time_vector


@dataclass(frozen=True, eq=False)
class NominalNumbers:
    """A system's own numbers."""

    system: LinearSystem

    @property
    def groups(self) -> tuple[TableGroup, ...]:
        return self.system.tables

    @cached_property
    def tables(self) -> NDArray[np.float64]:
        return run_time_vector(self.groups) if self.groups else np.zeros(1)

    @cached_property
    def parameters(self) -> NDArray[np.float64]:
        return np.array([p.value for p in self.system.parameters], float)
