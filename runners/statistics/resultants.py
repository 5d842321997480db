"""Resultants of two planes: total angle of attack, resultant moment, and the like; percentiles of norms, no sigma.

Each is the norm of two responses with one unit, correlated by the wind and by deviations in common. Its law is in
:mod:`.norm`; what is told of it is the mean of both planes, their covariance by source, levels with a probability,
and the direction in which a level is reached. A norm is not normal: it has no mean + 3 sigma.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...model.errors import ParameterValueError, PlanesError, UnknownNameError
from ...model.system.names import COMBINED
from ...model.vehicle.loads import SIDES
from ...model.vehicle.planes import PLANES, paired
from ..present.files import prepare_folder, write_text
from ..present.netcdf import RULE, one_unit_a_variable, with_conventions, write_netcdf
from ..present.notebook import html_of
from .norm import NormOfNormal
from .percentiles import checked_probabilities

if TYPE_CHECKING:
    from ...model.system.labels import Output
    from ..case.case import Case

TOTAL = {
    "angle_of_attack": "total_angle_of_attack",
    "engine_angle": "total_engine_angle",
    "q_alpha": "q_total_angle_of_attack",
}
NO_NORM = (*SIDES, "relative_deviation_")  # in the names of pairs that are no two components of a vector
NAME = "resultants"


def resultant_name(name: str) -> str:
    """Return what the norm of a response of both planes is called."""
    return TOTAL.get(name, f"resultant_{name}")


def resultant_pairs(responses: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return the resultants that responses have, by name, with both responses."""
    pairs = paired(responses).items()
    return {resultant_name(name): pair for name, pair in pairs if not any(part in name for part in NO_NORM)}


def outputs_of(case: Case, name: str) -> tuple[str, ...]:
    """Return the response of a name, or both responses that a resultant is the norm of."""
    return resultant_pairs(case.system.output_names).get(name, (name,))


def labels_of(case: Case, name: str) -> tuple[Output, ...]:
    """Return what is known of them: unit, scale, symbol."""
    return tuple(case.system.outputs[case.system.output_index(output)] for output in outputs_of(case, name))


def response_or_resultant(case: Case, name: str) -> str:
    """Return the name of a response or of a resultant of two with one unit.

    Raises
    ------
    UnknownNameError, DirectNoiseError
    PlanesError
        It is the resultant of a response of one plane.
    ParameterValueError
        It is a resultant of responses with different units.
    """
    names = case.system.output_names
    pairs = resultant_pairs(names)
    if name in pairs:
        case.checked_responses(pairs[name])
        outputs = labels_of(case, name)
        if outputs[0].unit != outputs[1].unit:
            listed = " and ".join(f"'{o.name}' is in {o.unit}" for o in outputs)
            raise ParameterValueError(f"{listed}: they have no norm; choose another resultant")
        return name
    if name in {resultant_name(output) for output in names}:
        raise PlanesError.of_one(f"'{name}'", case.system.name)
    if pairs and name not in names:
        raise UnknownNameError("response or resultant", str(name), [*names, *pairs])
    return case.checked_responses([name])[0]


def has_resultants(statistics: xr.Dataset) -> bool:
    """Tell whether statistics are of both planes, from an engine that gives covariances between responses."""
    return "covariance" in statistics and bool(resultant_pairs(str(name) for name in statistics["response"].values))


def norm_of(statistics: xr.Dataset, first: str, second: str, source: str = COMBINED) -> NormOfNormal:
    """Return the law of the norm of two responses over time.

    Parameters
    ----------
    statistics : xarray.Dataset
        Over (..., time, response, source), with covariances between responses.
    first, second : str
        Responses with one unit.
    source : str
        From which they vary.

    Raises
    ------
    UnknownNameError
    ParameterValueError
        Of responses with different units, or of statistics without covariances.
    """
    known = [str(name) for name in statistics["response"].values]
    for name in (first, second):
        if name not in known:
            raise UnknownNameError("response", name, known)
    if source not in statistics["source"].values:
        raise UnknownNameError("noise source", source, [str(s) for s in statistics["source"].values])
    units = [str(statistics["unit"].sel(response=name).item()) for name in (first, second)]
    if units[0] != units[1]:
        raise ParameterValueError(
            f"'{first}' is in {units[0]} and '{second}' in {units[1]}: they have no norm; choose two with one unit"
        )
    if "covariance" not in statistics:
        raise ParameterValueError(
            f"a norm needs the covariance between responses, which {statistics.attrs.get('engine', 'this engine')} "
            "does not give; compute the statistics by the sweep or the covariance equation"
        )
    names = [first, second]
    mean = statistics["mean"].sel(response=names, source=source).transpose(..., "response").values
    covariance = statistics["covariance"].sel(source=source, response=names, other_response=names)
    return NormOfNormal(mean, covariance.transpose(..., "response", "other_response").values)


def resultants(
    statistics: xr.Dataset, probabilities: Iterable[float], names: Iterable[str] | None, sources: Iterable[str]
) -> xr.Dataset:
    """Return the dataset of resultants; see :meth:`ResponseStatistics.resultants`."""
    pairs = resultant_pairs(str(name) for name in statistics["response"].values)
    if not pairs:
        raise PlanesError.of_one("a resultant", str(statistics.attrs.get("system", "the system")))
    chosen = list(pairs) if names is None else list(dict.fromkeys([names] if isinstance(names, str) else names))
    for name in chosen:
        if name not in pairs:
            raise UnknownNameError("resultant", name, pairs)
    chances, sources = checked_probabilities(probabilities), list(dict.fromkeys(sources))
    parts = [_one(statistics, pairs[name], chances, sources) for name in chosen]
    found = xr.concat(parts, dim=xr.DataArray(chosen, dims="resultant", name="resultant"))
    units = [str(statistics["unit"].sel(response=pairs[name][0]).item()) for name in chosen]
    found = found.assign_coords(unit=("resultant", units)).transpose("time", "resultant", ...)
    for name, (meaning, rule) in MEANINGS.items():
        found[name].attrs |= {"long_name": meaning, **({RULE: rule} if rule else {"units": "rad"})}
    found["time"].attrs |= statistics["time"].attrs
    found.attrs = dict(statistics.attrs)
    return found


MEANINGS = {
    "plane_mean": ("mean in each plane", "resultant"),
    "plane_covariance": ("covariance of both planes", "resultant^2"),
    "level": ("level that the resultant exceeds with the probability at an instant", "resultant"),
    "direction": ("likeliest direction where the level is reached, from pitch (+) towards yaw (+)", ""),
    "circular_mean": ("mean direction where the level is reached", ""),
    "circular_std": ("circular standard deviation of the direction there", ""),
    "rms": ("root mean square of the resultant", "resultant"),
    "major": ("larger standard deviation along a principal axis", "resultant"),
    "minor": ("smaller standard deviation along a principal axis", "resultant"),
    "axis": ("direction of the larger one", ""),
}


def _one(
    statistics: xr.Dataset, pair: tuple[str, str], probabilities: tuple[float, ...], sources: list[str]
) -> xr.Dataset:
    norms = [norm_of(statistics, *pair, source) for source in sources]
    levels, directions = [], []
    for norm in norms:
        levels.append([norm.percentile(p) for p in probabilities])
        directions.append([norm.direction(level) for level in levels[-1]])
    by_direction = {
        name: np.moveaxis(np.array([[getattr(d, part) for d in row] for row in directions]), -1, 0)
        for name, part in (
            ("direction", "most_likely"),
            ("circular_mean", "circular_mean"),
            ("circular_std", "circular_std"),
        )
    }
    ellipses = [norm.ellipse() for norm in norms]
    over = ("time", "source", "probability")
    return xr.Dataset(
        {
            "plane_mean": (("time", "plane"), norms[0].mean),
            "plane_covariance": (
                ("time", "source", "plane", "other_plane"),
                np.stack([norm.covariance for norm in norms], axis=1),
            ),
            "level": (over, np.moveaxis(np.array(levels), -1, 0)),
            **{name: (over, values) for name, values in by_direction.items()},
            "rms": (("time", "source"), np.stack([norm.rms() for norm in norms], axis=-1)),
            **{
                name: (("time", "source"), np.stack([ellipse[k] for ellipse in ellipses], axis=-1))
                for k, name in enumerate(("major", "minor", "axis"))
            },
        },
        {
            "time": statistics["time"].values,
            "source": sources,
            "probability": list(probabilities),
            "plane": list(PLANES),
            "other_plane": list(PLANES),
        },
    )


@dataclass(frozen=True)
class ResultantPeak:
    """The largest level of a resultant over the end times.

    Attributes
    ----------
    resultant, unit : str
    time : float
        s.
    value : float
        Level, SI.
    direction, spread : float
        Likeliest direction and circular standard deviation there, rad.
    mean : tuple of float
        In pitch and in yaw.
    at_end : bool
        Whether it lies on the first or last end time, so that the true one may lie beyond.
    """

    resultant: str
    unit: str
    time: float
    value: float
    direction: float
    spread: float
    mean: tuple[float, float]
    at_end: bool


@dataclass(frozen=True, eq=False, repr=False)
class Resultants:
    """Resultants of two planes over (time, resultant).

    Attributes
    ----------
    dataset : xarray.Dataset
        ``plane_mean`` (time, resultant, plane), ``plane_covariance`` (time, resultant, source, plane, other_plane),
        ``level``, ``direction`` (most likely), ``circular_mean``, ``circular_std`` (time, resultant, source,
        probability), ``rms``, ``major``, ``minor`` and ``axis`` of the ellipse of one sigma (time, resultant, source).
        Angles in rad from the pitch plane's positive axis towards the yaw plane's.
    """

    dataset: xr.Dataset

    def norm(self, resultant: str, source: str = COMBINED) -> NormOfNormal:
        """Return the law of a resultant over time.

        Parameters
        ----------
        resultant, source : str

        Returns
        -------
        NormOfNormal

        Raises
        ------
        UnknownNameError
        """
        at = self._at(resultant)
        if source not in self.dataset["source"].values:
            raise UnknownNameError("noise source", source, [str(s) for s in self.dataset["source"].values])
        return NormOfNormal(at["plane_mean"].values, at["plane_covariance"].sel(source=source).values)

    def peaks(self, probability: float | None = None, source: str = COMBINED) -> list[ResultantPeak]:
        """Return the largest level of every resultant over the end times.

        Parameters
        ----------
        probability : float, optional
            One of those that the levels are for; the first without it.
        source : str

        Returns
        -------
        list of ResultantPeak

        Raises
        ------
        UnknownNameError
        """
        chances = [float(p) for p in self.dataset["probability"].values]
        chance = chances[0] if probability is None else probability
        if chance not in chances:
            raise UnknownNameError("probability", f"{chance:g}", [f"{p:g}" for p in chances])
        found, times = [], self.dataset["time"].values
        for name in self.dataset["resultant"].values:
            at = self._at(str(name)).sel(source=source, probability=chance)
            k = int(np.argmax(at["level"].values))
            here = at.isel(time=k)
            first, second = (float(x) for x in here["plane_mean"].values)
            found.append(
                ResultantPeak(
                    str(name),
                    str(here["unit"].item()),
                    float(times[k]),
                    float(here["level"]),
                    float(here["direction"]),
                    float(here["circular_std"]),
                    (first, second),
                    times.size > 1 and k in (0, times.size - 1),
                )
            )
        return found

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``resultants.nc`` and ``resultants.csv``.

        Parameters
        ----------
        folder : str or path
            Made where it is not there.

        Returns
        -------
        list of Path

        Raises
        ------
        OutputFolderError
        """
        folder = Path(folder)
        prepare_folder(folder)
        units = [str(unit) for unit in self.dataset["unit"].values]
        stored = with_conventions(one_unit_a_variable(self.dataset, {"resultant": units}))
        text = self._csv()
        return [
            write_netcdf(stored, folder / f"{NAME}.nc"),
            write_text(folder / f"{NAME}.csv", text),
        ]

    def _csv(self) -> str:
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        names = ("level", "direction", "circular_mean", "circular_std", "rms", "major", "minor", "axis")
        means = [f"mean_{plane}" for plane in PLANES]
        angles = ("direction", "circular_mean", "circular_std", "axis")
        head = [f"{name}_rad" if name in angles else name for name in names]
        writer.writerow(["time_s", "resultant", "unit", "source", "probability", *means, *head])
        d = self.dataset
        for k, time in enumerate(d["time"].values):
            for r, resultant in enumerate(d["resultant"].values):
                for s, source in enumerate(d["source"].values):
                    for p, chance in enumerate(d["probability"].values):
                        at: dict[str, Any] = {"time": k, "resultant": r, "source": s, "probability": p}
                        values = [float(d[n].values[tuple(at[str(dim)] for dim in d[n].dims)]) for n in names]
                        numbers = [np.format_float_scientific(x, 9) for x in (*d["plane_mean"].values[k, r], *values)]
                        writer.writerow(
                            [f"{time:.12g}", resultant, d["unit"].values[r], source, f"{float(chance)!r}", *numbers]
                        )
        return buffer.getvalue()

    def _at(self, resultant: str) -> xr.Dataset:
        known = [str(name) for name in self.dataset["resultant"].values]
        if resultant not in known:
            raise UnknownNameError("resultant", resultant, known)
        return self.dataset.sel(resultant=resultant)

    def __repr__(self) -> str:
        rows = [
            f"{p.resultant:28} {p.value:.4g} {p.unit} at {p.time:g} s, {np.degrees(p.direction):.0f} deg from pitch"
            for p in self.peaks()
        ]
        chance = float(self.dataset["probability"].values[0])
        return "\n  ".join(
            [f"Resultants of {self.dataset.attrs.get('system', 'a system')}, passed with {chance:.3g}", *rows]
        )

    def _repr_html_(self) -> str:
        return html_of(repr(self))
