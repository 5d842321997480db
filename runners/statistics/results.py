"""Response statistics as an object: arrays by name, peaks, a figure, files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...model.deprecation import warn_deprecated
from ...model.errors import ParameterValueError, UnknownNameError
from ...model.system.names import COMBINED
from ..present.files import prepare_folder
from ..present.notebook import html_page, shortened
from .dataset import QUANTITIES
from .files import by_response, read_statistics, whole, write_statistics
from .instant_levels import level_over_time, with_levels
from .larger_side import SIGMAS
from .norm import LIKE_3_SIGMA, NormOfNormal
from .peaks import Peak, peaks
from .percentiles import Sides
from .resultants import Resultants, norm_of, resultants
from .sampling_interval import SamplingInterval, instant_sampling_interval

if TYPE_CHECKING:
    import pandas as pd

    from ..present.style import Figure


@dataclass(frozen=True, eq=False, repr=False)
class ResponseStatistics:
    """Mean, variance, standard deviation and mean + 3 sigma over (time, response, source).

    Attributes
    ----------
    dataset : xarray.Dataset
        All arrays, with ``response``, ``source`` and ``time`` (s) as coordinates and ``unit`` over ``response``; a
        batch has ``member`` in front, with its parameter values. The attributes are what it was computed from.

    Examples
    --------
    >>> stats.std.sel(response="bending_moment", source="wind", time=75)  # doctest: +SKIP
    >>> stats["bending_moment_std"].sel(source="wind", time=75)  # with units, as in the file  # doctest: +SKIP
    """

    dataset: xr.Dataset

    @property
    def mean(self) -> xr.DataArray:
        """Mean, (time, response, source), in each response's ``unit``."""
        return self.dataset["mean"]

    @property
    def std(self) -> xr.DataArray:
        """Standard deviation, (time, response, source), in each response's ``unit``."""
        return self.dataset["std"]

    @property
    def variance(self) -> xr.DataArray:
        """Variance, (time, response, source), in each response's ``unit`` squared."""
        return self.dataset["variance"]

    @property
    def mean_plus_3sigma(self) -> xr.DataArray:
        """Mean + 3 sigma, literally, (time, response, source), in each response's ``unit``."""
        return self.dataset["mean_plus_3sigma"]

    @property
    def attrs(self) -> dict[str, Any]:
        """What the statistics were computed from: engine, system, hashes, versions."""
        return self.dataset.attrs

    def by_response(self) -> xr.Dataset:
        """Return what files hold: ``bending_moment_std`` (time, source) and so on, each with its CF ``units``."""
        return by_response(self.dataset)

    def __getitem__(self, name: str) -> xr.DataArray:
        """Return a variable or coordinate, of :attr:`dataset` or of :meth:`by_response`.

        Raises
        ------
        UnknownNameError
        """
        if name in self.dataset.variables:
            return self.dataset[name]
        found = self.by_response()
        if name in found.variables:
            return found[name]
        raise UnknownNameError("variable", str(name), [*map(str, self.dataset.variables), *map(str, found.variables)])

    def __contains__(self, name: object) -> bool:
        return name in self.dataset.variables or name in self.by_response().variables

    def __iter__(self) -> Iterator[str]:
        return iter(map(str, self.dataset.data_vars))

    def __getattr__(self, name: str) -> Any:
        """Give what an xarray.Dataset has, as this class did when it was one, with a warning."""
        if name.startswith("_") or name == "dataset" or not hasattr(self.dataset, name):
            raise AttributeError(f"'{type(self).__name__}' has no attribute '{name}'", name=name, obj=self)
        if name in self.dataset.variables:
            return self.dataset[name]
        warn_deprecated(f"statistics.{name}", f"statistics.dataset.{name}")
        return getattr(self.dataset, name)

    def sel(self, **labels: Any) -> ResponseStatistics:
        """Return the statistics at labels, as xarray selects: ``sel(response="bending_moment", time=75)``.

        Parameters
        ----------
        **labels
            By dimension: times in s, names of responses and sources.

        Returns
        -------
        ResponseStatistics

        Raises
        ------
        UnknownNameError
            A response or source that is not there.
        """
        for dim, kind in (("response", "response"), ("source", "noise source")):
            known = [str(name) for name in np.atleast_1d(self.dataset[dim].values)]
            asked = labels.get(dim, [])
            for name in [asked] if isinstance(asked, str) else asked if isinstance(asked, list | tuple) else []:
                if name not in known:
                    raise UnknownNameError(kind, name, known)
        return ResponseStatistics(self.dataset.sel(labels))

    def peaks(self) -> list[Peak]:
        """Return the largest |mean| + 3 sigma of every response over the end times, and which source drives it.

        Raises
        ------
        ParameterValueError
            Of a batch, or without all sources.
        """
        return peaks(self._one_table())

    def percentile(self, probability: float, sides: Sides = "both", source: str = COMBINED) -> xr.DataArray:
        """Return the level that responses pass with a probability at one instant, over (time, response).

        Parameters
        ----------
        probability : float
            Probability of being beyond the level, between 0 and 1: 0.01 asks for the 99th percentile; 0.00135 on one
            side is mean + 3 sigma.
        sides : {'both', 'upper', 'lower'}
            Beyond in size, either side; upward; or downward, whose level is one of the negative response.
        source : str
            From which the response varies; its mean is the same from any.

        Returns
        -------
        xarray.DataArray
            In each response's ``unit``, with the coordinate ``side`` (time, response), the larger one for 'both'. The
            attributes say which probability and sides.

        Raises
        ------
        ParameterValueError, UnknownNameError
        """
        return level_over_time(self.dataset, probability, sides, source)

    def with_percentiles(self, probabilities: Iterable[float]) -> ResponseStatistics:
        """Return the statistics with a variable ``level`` (..., probability), which :meth:`save` writes too.

        Parameters
        ----------
        probabilities : iterable of float
            Each a probability with which the response's size, on either side, is beyond the level at one instant.

        Returns
        -------
        ResponseStatistics

        Raises
        ------
        ParameterValueError
        """
        return ResponseStatistics(with_levels(self.dataset, probabilities))

    def norm(self, first: str, second: str, source: str = COMBINED) -> NormOfNormal:
        """Return the law of the norm of two responses over time: any percentile, its derivatives, directions.

        Parameters
        ----------
        first, second : str
            Responses with one unit, such as bending moments of two planes.
        source : str
            From which they vary.

        Returns
        -------
        NormOfNormal

        Raises
        ------
        UnknownNameError
        ParameterValueError
            Of different units, or of an engine that gives no covariance between responses.
        """
        return norm_of(whole(self.dataset), first, second, source)

    def resultants(
        self,
        probabilities: Iterable[float] = (LIKE_3_SIGMA,),
        names: Iterable[str] | None = None,
        sources: Iterable[str] = (COMBINED,),
    ) -> Resultants:
        """Return the resultants of both planes: total angle of attack, resultant moment, and the like.

        Parameters
        ----------
        probabilities : iterable of float
            Each a probability with which the resultant exceeds a level at one instant; by default 1 - Phi(3), that of
            mean + 3 sigma of one response.
        names : iterable of str, optional
            Of resultants; all without it.
        sources : iterable of str
            From which the responses vary; their means are the same from any.

        Returns
        -------
        Resultants

        Raises
        ------
        PlanesError
            Of a system in one plane.
        UnknownNameError, ParameterValueError
        """
        return Resultants(resultants(self._one_table(), probabilities, names, sources))

    def sampling_interval(
        self,
        response: str,
        time: float,
        samples: float | None = None,
        confidence: float = 0.95,
        sigmas: float = SIGMAS,
    ) -> SamplingInterval:
        """Return what the sampling error of the wind's statistics leaves open of a response at one time.

        Parameters
        ----------
        response : str
        time : float
            One of the end times, s.
        samples : float, optional
            N, independent soundings behind the wind's mean and covariance; that of the wind's record without it.
        confidence : float
            Share of such intervals that hold the true value.
        sigmas : float
            k, of the level |mean| + k sigma: a factor.

        Returns
        -------
        SamplingInterval
            Of sigma, by the wind and by all sources, and of the level. The wind's part of a variance is chi-square with
            N - 1 degrees; that of other sources is taken as known (:func:`level_sampling_interval`).

        Raises
        ------
        ParameterValueError
            N is not known, or not above one; a confidence that is none; a batch.
        UnknownNameError, TimeRangeError

        Notes
        -----
        Nothing else is in it: not the filter's error, nor that of reconstructed correlations between altitudes, nor the
        model's.
        """
        return instant_sampling_interval(self._one_table(), response, time, samples, confidence, sigmas)

    def plot(self, response: str, title: str | None = None) -> Figure:
        """Return the figure of a response over time: mean, and the larger side from the first source and from all.

        Parameters
        ----------
        response : str
        title : str, optional

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        UnknownNameError
        ParameterValueError
            Of a batch, or without all sources.
        """
        from .response_figures import response_figure

        table = ResponseStatistics(self._one_table()).sel(response=[response])
        return response_figure(
            table.dataset, response, title or str(self.attrs.get("title", self.attrs.get("system", "")))
        )

    def to_frame(self) -> pd.DataFrame:
        """Return a tidy table: a row a member, time (s), response and source, in SI, with the unit of the response."""
        found = whole(self.dataset)
        frame = found[list(QUANTITIES)].to_dataframe().reset_index()
        first = ["member"] if "member" in found.dims else []
        others = [c for c in frame.columns if c not in (*first, "time", "response", "unit", "source", *QUANTITIES)]
        return frame.loc[:, [*first, *others, "time", "response", "unit", "source", *QUANTITIES]]

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``statistics.nc`` and ``statistics.csv``.

        Parameters
        ----------
        folder : str or path
            Made where it is not there.

        Returns
        -------
        list of Path
            Where they are.

        Raises
        ------
        OutputFolderError
        """
        prepare_folder(Path(folder))
        return write_statistics(self.dataset, Path(folder))

    @classmethod
    def open(cls, path: str | Path) -> ResponseStatistics:
        """Read what :meth:`save` or ``ascentwind run`` wrote.

        Parameters
        ----------
        path : str or path
            ``statistics.nc`` or its folder.

        Returns
        -------
        ResponseStatistics

        Raises
        ------
        DataError
        """
        return cls(read_statistics(Path(path)))

    def _one_table(self) -> xr.Dataset:
        if "member" in self.dataset.dims:
            raise ParameterValueError("the statistics are of a batch; choose one, e.g. statistics.sel(member=0)")
        found = whole(self.dataset)
        if COMBINED not in found["source"].values:
            raise ParameterValueError(f"a peak is from all sources together; keep the source '{COMBINED}'")
        return found

    def _summary(self) -> dict[str, str]:
        found, attrs = whole(self.dataset), self.attrs
        times = found["time"].values
        span = f"{times[0]:g} s" if times.size == 1 else f"{times.size}, {times[0]:g} to {times[-1]:g} s"
        pairs = zip(found["response"].values, found["unit"].values, strict=True)
        members = {"members": str(found.sizes["member"])} if "member" in found.dims else {}
        return {
            **members,
            "end times": span,
            "responses": shortened([f"{name} [{unit}]" for name, unit in pairs]),
            "sources": shortened([str(name) for name in found["source"].values]),
            "arrays": shortened([str(name) for name in self.dataset.data_vars]),
            "engine": ", ".join(f"{attrs[n]}" for n in ("engine", "relative_tolerance") if n in attrs),
        }

    def _peak_rows(self) -> list[tuple[str, ...]]:
        found = whole(self.dataset)
        if "member" in found.dims or COMBINED not in found["source"].values or not found["time"].size:
            return []
        head = ("peak of |mean| + 3 sigma", "value", "unit", "at (s)", "mean", "sigma")
        rows = [(p.response, p.value, p.unit, p.time, p.mean, p.std) for p in peaks(found.isel(response=slice(8)))]
        return [head, *(tuple(x if isinstance(x, str) else f"{x:.4g}" for x in row) for row in rows)]

    def _heading(self) -> str:
        return f"ResponseStatistics of {self.attrs.get('system', 'a system')}"

    def __repr__(self) -> str:
        lines = [f"{label:10} {text}" for label, text in self._summary().items()]
        rows = self._peak_rows()
        widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))] if rows else []
        lines += ["  ".join(x.ljust(w) for x, w in zip(row, widths, strict=True)).rstrip() for row in rows]
        return "\n  ".join([self._heading(), *lines])

    def _repr_html_(self) -> str:
        return html_page(self._heading(), self._summary(), self._peak_rows(), self.attrs)
