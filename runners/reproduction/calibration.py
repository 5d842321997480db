"""Moving uncertain inputs inside their bounds towards the published figures: least squares, exact derivatives."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from ...model.system.names import COMBINED
from ...model.vehicle.shipped import find_vehicle
from ...model.wind.range_reference import shipped_statistics
from ...model.wind.statistics import WindModel, WindStatistics
from ..statistics.larger_side import LARGER_SIDE, sign
from ..study import Study
from ..views.wind_comparison import stretched
from ..wind.fitting.altitude_grid import propagated_covariance
from ..wind.fitting.intervals import share_inside
from .directional import directional_derivative
from .predictions import BENDING, ENGINE, TIME, end_times, larger_sides
from .published import BY_NAME, Published
from .rebuild import rebuilt, scaled_generalized_mass, scaled_normal_force, scaled_stiffness

TARGETS = ("peak_mean", "sigma_75", "rise_bending", "rise_engine", "bending_1", "bending_2")
STEP = 1e-3  # share of an input's range, between the studies that tell how its tables change
RULE = 0.03  # relative miss that counts as met


@dataclass(frozen=True)
class Input:
    """An uncertain input.

    Attributes
    ----------
    name, what, unit : str
    nominal, low, high : float
    source : str
        Where the bounds come from.
    logarithmic : bool
        Whether its range is divided evenly by ratio, not by difference.
    """

    name: str
    what: str
    unit: str
    nominal: float
    low: float
    high: float
    source: str
    logarithmic: bool = False

    def value(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)

    def share(self, value: float) -> float:
        """Return the share of the range at which a value lies."""
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


SECTION_9 = "bounds of the data compilation (docs/data.md)"


def inputs(correlation: tuple[float, float]) -> tuple[Input, ...]:
    """Return the inputs; ``correlation``: range of the factor on the wind filter's speed over altitude."""
    return (
        Input("normal_force", "factor on the normal force", "1", 1.0, 0.9, 1.1, SECTION_9),
        Input("center_of_pressure", "shift of the centre of pressure", "m", 0.0, -2.0, 2.0, SECTION_9),
        Input(
            "stiffness", "factor on bending and shear stiffness", "1", 1.0, 0.81, 1.21, "10 % in frequency; as above"
        ),
        Input("generalized_mass", "factor on the generalised masses", "1", 1.0, 0.7, 1.3, SECTION_9),
        Input(
            "bending_damping", "damping of the bending modes", "1", 0.005, 0.0025, 0.01, "assumed 0.005; half to twice"
        ),
        Input("slosh_damping", "damping of slosh", "1", 0.01, 0.01, 0.05, "ring baffles; as above"),
        Input(
            "correlation_time",
            "correlation time of thrust and X_CP noise",
            "s",
            1.0,
            0.1,
            10.0,
            "assumed, no bound",
            True,
        ),
        Input(
            "mean_wind", "factor on the mean wind", "1", 1.0, 0.5, 2.0, "the report's mean wind is lost; half to twice"
        ),
        Input(
            "wind_correlation",
            "factor on the wind's change over altitude",
            "1",
            1.0,
            *correlation,
            "90 % interval of 80 samples",
        ),
    )


def correlation_range(study: Study, statistics: WindStatistics) -> tuple[float, float]:
    """Return how much faster or slower the filter may run before a covariance leaves its 90 % interval."""
    vehicle = study.vehicle_for("a calibration")
    wind = vehicle.wind.shaping_filter

    def outside(logarithm: float) -> float:
        covariance = propagated_covariance(stretched(wind, float(np.exp(logarithm))), statistics.altitude, 250.0)
        share = share_inside(covariance, statistics.covariance, statistics.independent_samples)
        return -0.5 if share == 1 else 0.5

    low, high = (brentq(outside, 0.0, end, xtol=1e-3) for end in (-2.0, 2.0))
    return float(np.exp(low + 2e-3)), float(np.exp(high - 2e-3))  # pyright: ignore[reportArgumentType, reportOperatorIssue]


class Model:
    """The published figures of a vehicle as functions of the uncertain inputs, with derivatives.

    Parameters
    ----------
    vehicle : str or path
    work : Path
        An empty folder for vehicles built anew.
    """

    def __init__(self, vehicle: str | Path, work: Path):
        self.folder, self.work, self._count = find_vehicle(vehicle), work, 0
        base = self.study({i.name: i.nominal for i in inputs((1.0, 1.0))})
        self.inputs = inputs(correlation_range(base, shipped_statistics(top=16000.0)))

    def study(self, values: dict[str, float]) -> Study:
        """Build and load the vehicle with these inputs."""
        self._count += 1
        force, shift = values["normal_force"], values["center_of_pressure"]
        out = rebuilt(
            self.folder,
            self.work / str(self._count),
            alter=lambda c: scaled_stiffness(scaled_normal_force(c, force, shift), values["stiffness"]),
            adjust=lambda n: scaled_generalized_mass(n, values["generalized_mass"]),
        )
        return self._in_wind(Study.load(out), values)

    def _in_wind(self, study: Study, values: dict[str, float]) -> Study:
        vehicle = study.vehicle_for("a calibration")
        if values["wind_correlation"] != 1:
            wind = vehicle.wind
            assert isinstance(wind, WindModel)  # the report has one plane
            faster = stretched(wind.shaping_filter, values["wind_correlation"])
            study = study.with_wind(replace(wind, shaping_filter=faster))
        numbers = {"bending_damping": "bending.", "slosh_damping": "slosh."}
        changes = {
            p: values[name]
            for name, start in numbers.items()
            for p in study.parameters
            if p.startswith(start) and p.endswith(".damping")
        }
        times = [p for p in study.parameters if p.endswith(".correlation_time")]
        changes |= dict.fromkeys(times, values["correlation_time"]) | {"wind.mean_scale": values["mean_wind"]}
        return study.with_parameters(changes)

    def figures(self, study: Study) -> NDArray[np.float64]:
        """Return the targets."""
        return np.array([value for value, _ in self._quantities(study, derivatives=False)])

    def jacobian(self, study: Study, values: dict[str, float]) -> NDArray[np.float64]:
        """Return the derivatives of the targets by the inputs as shares of their ranges, (targets, inputs).

        How tables change with an input is a difference of two builds; how a response changes with the tables is exact.
        """
        quantities = self._quantities(study, derivatives=True)
        columns = []
        for item in self.inputs:
            share = item.share(values[item.name])
            step = -STEP if share + STEP > 1 else STEP
            moved = self.study(values | {item.name: item.value(share + step)})
            columns.append([derivative(moved) / step for _, derivative in quantities])
        return np.array(columns).T

    def _quantities(self, study: Study, derivatives: bool) -> list[tuple[float, Callable[[Study], float]]]:
        """Return each target with a function that gives its first-order change to a neighbouring study."""
        s = study.response_statistics(end_times(study))
        mean = s["mean"].sel(response=BENDING, source="wind")
        times = s["time"].values
        largest = int(np.argmax(abs(mean.values)))
        way = float(sign(mean.values[largest]))

        def change(response: str, time: float, source: str, quantity: str) -> Callable[[Study], float]:
            if not derivatives:
                return lambda moved: 0.0
            found = study.sensitivity(response, time, source=source, quantity=quantity, elasticity=False)
            return lambda moved: directional_derivative(found, study, moved)

        of_mean = change(BENDING, float(times[largest]), "wind", "mean")

        def rise(response: str) -> tuple[float, Callable[[Study], float]]:
            total, wind = (larger_sides(s, source).sel(response=response) for source in (COMBINED, "wind"))
            a, b = float(total.max()), float(wind.max())
            da = change(response, float(times[np.argmax(total.values)]), COMBINED, LARGER_SIDE)
            db = change(response, float(times[np.argmax(wind.values)]), "wind", LARGER_SIDE)
            return a / b - 1, lambda moved: da(moved) / b - a * db(moved) / b**2

        def frequency(mode: int) -> tuple[float, Callable[[Study], float]]:
            name = f"bending.{mode}.frequency"
            here = study.tables(TIME)[name]
            return here, lambda moved: moved.tables(TIME)[name] - here

        sigma = float(s["std"].sel(response=BENDING, source="wind", time=TIME))
        return [
            (way * float(mean.values[largest]), lambda moved: way * of_mean(moved)),
            (sigma, change(BENDING, TIME, "wind", "std")),
            rise(BENDING),
            rise(ENGINE),
            frequency(1),
            frequency(2),
        ]


@dataclass(frozen=True)
class Calibration:
    """What the least squares found.

    Attributes
    ----------
    inputs : tuple of Input
    values : dict of str to float
    targets : tuple of Published
    before, after : (targets,) arrays
    derivatives : (targets, inputs) array
        Elasticities of the targets to each input over its whole range, at the start: change of the target, relative
        to the published figure, from the input's lower to its upper bound.
    evaluations : int
    """

    inputs: tuple[Input, ...]
    values: dict[str, float]
    targets: tuple[Published, ...]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    derivatives: NDArray[np.float64]
    evaluations: int

    @property
    def met(self) -> list[bool]:
        """Whether each target lies within 3 % of the published figure."""
        return [abs(t.miss(a)) <= RULE for t, a in zip(self.targets, self.after, strict=True)]


def calibrate(vehicle: str | Path = "as504", progress: Callable[[str], None] = lambda text: None) -> Calibration:
    """Minimise the sum of squared relative misses over the inputs inside their bounds."""
    targets = tuple(BY_NAME[name] for name in TARGETS)
    published = np.array([t.value for t in targets])
    with tempfile.TemporaryDirectory() as work:
        model = Model(vehicle, Path(work))
        studies: dict[bytes, Study] = {}

        def at(x: NDArray) -> tuple[dict[str, float], Study]:
            values = {i.name: i.value(float(share)) for i, share in zip(model.inputs, x, strict=True)}
            key = x.tobytes()
            if key not in studies:
                studies[key] = model.study(values)
            return values, studies[key]

        def misses(x: NDArray) -> NDArray:
            found = model.figures(at(x)[1]) / published - 1
            progress(f"largest miss {100 * np.abs(found).max():.1f} %")
            return found

        def slopes(x: NDArray) -> NDArray:
            values, study = at(x)
            return model.jacobian(study, values) / published[:, None]

        begin = np.clip([i.share(i.nominal) for i in model.inputs], 1e-6, 1 - 1e-6)
        before, first = misses(begin), slopes(begin)
        limits = {"xtol": 1e-4, "ftol": 1e-4, "max_nfev": 25}
        result = least_squares(misses, begin, slopes, bounds=(0, 1), **limits)  # pyright: ignore[reportArgumentType]
        values, study = at(result.x)
        after = model.figures(study)
    return Calibration(model.inputs, values, targets, (before + 1) * published, after, first, result.nfev)
