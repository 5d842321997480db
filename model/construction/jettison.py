"""What leaves a vehicle in flight: masses, motors and the air forces on them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ..errors import DataError, UnknownNameError
from .flight import Drag


@dataclass(frozen=True, eq=False)
class Jettison:
    """Parts that leave together.

    Attributes
    ----------
    event : str
        Name of that event in the vehicle's [events], such as 'booster_separation'.
    time : float
        s.
    masses, motors, normal_force : tuples of str
        Names of items, solid motors and parts of the normal force.
    drag : Drag or None
        Of what is left; None: as before.
    """

    event: str
    time: float
    masses: tuple[str, ...]
    motors: tuple[str, ...]
    normal_force: tuple[str, ...]
    drag: Drag | None = None

    def __post_init__(self):
        if not math.isfinite(self.time):
            raise DataError(f"jettison '{self.event}' needs a time")
        if not self.masses and not self.motors:
            raise DataError(f"jettison '{self.event}' drops no mass; name its masses or motors")

    def require_known(self, masses: Iterable[str], motors: Iterable[str], normal_force: Iterable[str]) -> None:
        """Refuse names of things that the vehicle does not have.

        Raises
        ------
        UnknownNameError
        """
        for kind, named, known in (
            ("item of masses", self.masses, tuple(masses)),
            ("solid motor", self.motors, tuple(motors)),
            ("part of the normal force", self.normal_force, tuple(normal_force)),
        ):
            for name in named:
                if name not in known:
                    raise UnknownNameError(kind, name, known)
