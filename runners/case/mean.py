"""The mean response that a case is computed about: linear, or with large angles."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import Protocol

from ...codegen.system.executable import ExecutableSystem
from ...model.vehicle.vehicle import Vehicle
from ..solvers.mean_response import Respond, mean_response, with_mean_tables

ONE_AT_A_TIME = Lock()  # CVODES catches what CasADi writes, for the whole process


class Mean(Protocol):
    """How the tables of the mean response are filled, for whatever numbers."""

    def fill(self, executable: ExecutableSystem, respond: Respond = mean_response) -> ExecutableSystem:
        """Return the system with its tables of the mean; ``respond`` computes the linear one."""
        ...


@dataclass(frozen=True)
class LinearMean:
    """The mean of the linear equations."""

    # the function itself, by which batches know that they may fill the tables within a sweep
    fill = staticmethod(with_mean_tables)


@dataclass(frozen=True, eq=False)
class NonlinearMean:
    """The mean of the linear equations and, on top, what large angles add to it for the rigid, controlled vehicle."""

    vehicle: Vehicle

    def fill(self, executable: ExecutableSystem, respond: Respond = mean_response) -> ExecutableSystem:
        """Return the system with its tables of the mean; ``respond`` computes the linear part.

        Raises
        ------
        DataError, IntegrationError
        """
        from ..solvers.planar_mean import with_nonlinear_mean  # brings the equations of a flight with it

        filled = with_mean_tables(executable, respond)
        with ONE_AT_A_TIME:
            return with_nonlinear_mean(self.vehicle, filled)
