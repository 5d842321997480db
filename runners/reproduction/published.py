"""Every figure that NASA CR-103010 published and that can be held against a number of ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Published:
    """A published figure.

    Attributes
    ----------
    name : str
        Key of our number for it.
    what, unit : str
        For people; the factor to SI is 1 for every unit used.
    value : float
    bound : {'equal', 'below'}
        Whether the report gives a value or an upper bound.
    where : str
        Section of the report.
    """

    name: str
    what: str
    value: float
    unit: str
    where: str
    bound: Literal["equal", "below"] = "equal"

    def miss(self, ours: float) -> float:
        """Return the relative miss; 0 inside an upper bound."""
        if self.bound == "below" and ours <= self.value:
            return 0.0
        return ours / self.value - 1


PUBLISHED = (
    Published("peak_mean", "peak mean bending moment, station 25, rigid-body angle of attack", 14.23e6, "N m", "4.1.2"),
    Published("peak_mean_local", "the same with local angle of attack", 14.81e6, "N m", "4.1.2"),
    Published("local_rise", "rise of it by the local angle of attack", 0.0408, "1", "4.1.2, from the two above"),
    Published("sigma_75", "σ of the bending moment at 75 s, wind alone", 4.207e6, "N m", "5.1, root of 17.7e12"),
    Published(
        "rise_bending",
        "rise of the peak of mean ± 3σ, bending moment, by thrust and X_CP noise",
        0.05,
        "1",
        "5.1",
    ),
    Published("rise_attack", "the same for the angle of attack at 75 s", 0.01, "1", "5.2", "below"),
    Published("rise_engine", "the same for the engine angle, at its peak", 0.05, "1", "5.3"),
    Published("rigid_root", "rigid-body root at 75 s", 1.0, "rad/s", "3.1, 'about'"),
    Published("bending_1", "first bending frequency at 75 s", 6.0, "rad/s", "3.1, 'about'"),
    Published("bending_2", "second bending frequency at 75 s", 13.0, "rad/s", "3.1, 'about'"),
    Published("wind_error", "wind filter: rms error of the covariances, 1-16 km", 14.0, "m2/s2", "3.4.7", "below"),
    Published("wind_share", "share of them inside the 90 % interval of 80 samples", 1.0, "1", "3.4.7"),
    Published(
        "wind_sensitivity",
        "change of the variance at 75 s by a filter of twice the mean squared error",
        -0.028,
        "1",
        "5.1",
    ),
)
BY_NAME = {p.name: p for p in PUBLISHED}
