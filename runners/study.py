"""A study: a vehicle (or any linear system) with numbers, and the questions one asks of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..codegen.compiled import ExecutableSystem, executable_system
from ..model.assemble import assemble
from ..model.errors import ParameterValueError, TimeRangeError, UnknownNameError
from ..model.library import find_vehicle
from ..model.system import LinearSystem, Parameter
from ..model.tables import table_values
from ..model.vehicle import Vehicle, load_vehicle
from ..model.wind_filter import ShapingFilter
from ..model.wind_statistics import WindModel
from .adjoint import AdjointSolver
from .engines import Progress, batch_dataset, compute_statistics
from .integration import IntegratorOptions
from .mean_response import with_mean_tables
from .stability import Root, check_coupling, matrices_at, roots, warn_if_unstable
from .statistics import ResponseStatistics, weighting_dataset, weighting_family
from .sweep_engine import SweepOptions, batch, sweep, sweep_of, with_sweep_mean_tables
from .wind_range import warn_beyond
from .wind_start import covariance_at

POSITIVE = ("correlation_time", "reference_area")


@dataclass(frozen=True, eq=False)
class Study:
    """Response statistics of a system by the method of adjoint systems.

    Make one with :meth:`load` (vehicles) or :meth:`from_system` (systems of your own).

    Examples
    --------
    >>> from ascentwind.runners import Study
    >>> study = Study.load("as504")
    >>> stats = study.response_statistics(times=[75.0])
    >>> sigma = stats.std.sel(response="bending_moment", source="wind", time=75.0)
    """

    executable: ExecutableSystem
    vehicle: Vehicle | None = None

    @staticmethod
    def load(vehicle: str | Path, *, compile: bool = True) -> Study:
        """Load a shipped vehicle by name, or a vehicle folder.

        Parameters
        ----------
        vehicle : str or path
        compile : bool
            False uses CasADi's interpreter: the same numbers, slower.

        Raises
        ------
        UnknownNameError, DataError, SingularCouplingError, CompilerError
        """
        return Study.from_vehicle(load_vehicle(find_vehicle(vehicle)), compile=compile)

    @staticmethod
    def from_vehicle(vehicle: Vehicle, *, compile: bool = True) -> Study:
        """Assemble a loaded vehicle and prepare its code."""
        altitude = float(vehicle.tables["altitude"].polynomial(vehicle.start))
        system = assemble(vehicle, covariance_at(vehicle.wind.shaping_filter, altitude))
        executable = executable_system(system, compile)
        check_coupling(executable)
        return Study(executable, vehicle)

    @staticmethod
    def from_system(system: LinearSystem, *, compile: bool = True) -> Study:
        """Prepare the code of a linear system of your own."""
        return Study(executable_system(system, compile))

    @property
    def system(self) -> LinearSystem:
        """The linear system: names of states, noises, outputs, and the symbolic matrices."""
        return self.executable.system

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every parameter by name, with its present value, unit and meaning."""
        pairs = zip(self.system.parameters, self.executable.parameters, strict=True)
        return {p.name: replace(p, value=float(value)) for p, value in pairs}

    def with_parameters(self, changes: Mapping[str, float]) -> Study:
        """Return a study with other parameter values; nothing is compiled.

        Raises
        ------
        UnknownNameError
            With the nearest parameter name.
        ParameterValueError
            For a value that is not finite, or a time or area that is not positive.
        """
        return Study(self.executable.with_numbers(parameters=self._parameter_values(changes)), self.vehicle)

    def _parameter_values(self, changes: Mapping[str, float]) -> NDArray[np.float64]:
        names, values = self.system.parameter_names, self.executable.parameters.copy()
        for name, value in changes.items():
            if name not in names:
                raise UnknownNameError("parameter", name, names)
            if not np.isfinite(value) or (name.rpartition(".")[2] in POSITIVE and value <= 0):
                raise ParameterValueError(f"parameter '{name}' cannot be {value:g}; give a finite, sensible number")
            values[names.index(name)] = float(value)
        return values

    def with_wind(self, wind: WindModel | ShapingFilter) -> Study:
        """Return a study of the same vehicle in another wind.

        Parameters
        ----------
        wind : WindModel or ShapingFilter
            A filter alone keeps the vehicle's mean wind.

        Raises
        ------
        UnknownNameError
            If the study has no vehicle.

        Warns
        -----
        ExtrapolationWarning
            The flight leaves the filter's altitudes: its coefficients are held at their last values there.
        """
        if self.vehicle is None:
            raise UnknownNameError("wind of a system of one's own", self.system.name, [])
        if isinstance(wind, ShapingFilter):
            wind = WindModel(self.vehicle.wind.mean, wind)
        warn_beyond(wind.shaping_filter, self.vehicle)
        study = Study.from_vehicle(replace(self.vehicle, wind=wind), compile=self.executable.library is not None)
        values = {n: p.value for n, p in self.parameters.items() if n in study.parameters}
        return study.with_parameters(values)

    @cached_property
    def with_means(self) -> ExecutableSystem:
        """The system with its tables of the mean response, which the noise coefficients need, filled in."""
        if self.executable.library is None:
            return with_mean_tables(self.executable)
        return with_sweep_mean_tables(sweep_of(self.system), self.executable)

    def matrices(self, time: float) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Return A (n, n), B (n, n_w), C (n_y, n), D (n_y, n_w) at a time; names are in ``study.system``."""
        self._check_times([time])
        m = matrices_at(self.with_means, float(time))
        return m["A"], m["B"], m["C"], m["D"]

    def roots(self, time: float) -> list[Root]:
        """Return the eigenvalues of A frozen at a time, slowest first."""
        self._check_times([time])
        return roots(self.executable, float(time))

    def tables(self, time: float) -> dict[str, float]:
        """Return every table value at a time (s) by name."""
        self._check_times([time])
        return table_values(self.with_means.groups, float(time))

    def response_statistics(
        self,
        times: Iterable[float],
        *,
        responses: Iterable[str] | None = None,
        engine: str | None = None,
        options: object | None = None,
        check: bool = False,
        progress: Progress | None = None,
    ) -> ResponseStatistics:
        """Return mean, variance, standard deviation and mean + 3 sigma by response, source and end time.

        Parameters
        ----------
        times : iterable of float
            End times t2, s.
        responses : iterable of str, optional
            All without it. White noise that reaches a response directly makes its variance infinite; leave that
            response out or colour the noise.
        engine : str, optional
            'sweep' (default where a compiler is found): all end times in one pass of a generated integrator.
            'cvodes' (default elsewhere): one backward adjoint run an end time. 'covariance': the covariance
            equation, forward. 'ensemble': simulated flights, with confidence intervals.
        options : SweepOptions, IntegratorOptions, CovarianceOptions or EnsembleOptions, optional
            As the engine takes; alone they choose it.
        check : bool
            Compute everything a second time with a finer discretisation (tolerance, or substep of the ensemble) and
            keep the relative difference of the standard deviation as ``discretisation_difference``.
        progress : callable, optional
            Called with each end time when it is done.

        Returns
        -------
        ResponseStatistics
            An xarray Dataset over (time, response, source); ``combined`` is the sum over the independent sources.

        Raises
        ------
        TimeRangeError, UnknownNameError, DirectNoiseError, IntegrationError

        Warns
        -----
        UnstableSystemWarning
        """
        times = sorted({float(t) for t in times})
        self._check_times(times)
        wanted = self._responses(responses)
        warn_if_unstable(self.executable, times[-1])
        return compute_statistics(self, times, wanted, engine, options, check, progress)

    def batch(
        self,
        parameter_sets: Sequence[Mapping[str, float]],
        times: Iterable[float],
        *,
        options: SweepOptions | None = None,
        threads: int | None = None,
    ) -> ResponseStatistics:
        """Return the statistics for many sets of parameter values by the sweep, on all cores.

        Parameters
        ----------
        parameter_sets : sequence of mappings
            Each as for :meth:`with_parameters`.
        times : iterable of float
            End times t2, s.
        options : SweepOptions, optional
            Relative tolerance 1e-4 without it.
        threads : int, optional
            All cores without it.

        Returns
        -------
        ResponseStatistics
            As :meth:`response_statistics`, with a dimension ``member`` in front.

        Raises
        ------
        TimeRangeError, UnknownNameError, ParameterValueError, IntegrationError, NoCompilerError
        """
        if not parameter_sets:
            raise ParameterValueError("a batch needs at least one set of parameter values")
        ends = sorted({float(t) for t in times})
        self._check_times(ends)
        options = options or SweepOptions(relative_tolerance=1e-4)
        values = [self._parameter_values(changes) for changes in parameter_sets]
        found = batch(
            sweep_of(self.system),
            self.executable,
            values,
            ends,
            relative_tolerance=options.relative_tolerance,
            threads=threads,
        )
        return batch_dataset(self, found, self._responses(None), options)

    def weighting_functions(
        self, times: Iterable[float], *, spacing: float = 0.25, options: SweepOptions | None = None
    ) -> xr.Dataset:
        """Return the weighting functions g(t2, t) of all responses for many end times, by one backward sweep.

        Parameters
        ----------
        times : iterable of float
            End times t2, s.
        spacing : float
            Largest distance between points, s.

        Returns
        -------
        xarray.Dataset
            As :meth:`weighting_function`, with a dimension ``time`` in front; zero for t after the end time.
        """
        ends = sorted({float(t) for t in times})
        self._check_times(ends)
        self._check_spacing(spacing)
        tolerance = (options or SweepOptions()).relative_tolerance
        found = sweep(
            sweep_of(self.system),
            self.with_means,
            ends,
            relative_tolerance=tolerance,
            weighting_spacing=spacing,
            responses=(),
        )
        return weighting_family(self, found)

    def weighting_function(
        self, time: float, *, spacing: float = 0.05, options: IntegratorOptions | None = None
    ) -> xr.Dataset:
        """Return the weighting functions g(t2, t) of all responses for t2 = ``time``.

        Parameters
        ----------
        time : float
            t2, s.
        spacing : float
            Largest distance between points, s.

        Returns
        -------
        xarray.Dataset
            ``noise_weighting`` (response, noise, t): response to a unit impulse of each white noise at t; squared
            and integrated it gives the variance. ``input_weighting`` (response, input, t): response to an impulse of
            the wind straight into the vehicle; its delta at t = t2 has the weight ``direct`` (response, input).
        """
        self._check_times([time])
        self._check_spacing(spacing)
        history = AdjointSolver(self.with_means, options or IntegratorOptions()).history(float(time), spacing)
        return weighting_dataset(self, float(time), history)

    def _check_spacing(self, spacing: float) -> None:
        if not spacing > 0:
            raise TimeRangeError(f"a spacing of {spacing:g} s is not positive")

    def _check_times(self, times: list[float]) -> None:
        if not times:
            raise TimeRangeError("no end time was given")
        for time in times:
            if not np.isfinite(time):
                raise TimeRangeError(f"{time} is not a time")
            if time < self.system.start:
                raise TimeRangeError(
                    f"end time {time:g} s lies before the start at {self.system.start:g} s; "
                    "choose a later one or an earlier start_time_s"
                )
            if time > self.system.end:
                raise TimeRangeError(f"end time {time:g} s lies beyond {self._end_of_data()}")

    def _end_of_data(self) -> str:
        end = f"the end of the system at {self.system.end:g} s"
        if self.vehicle is None:
            return end
        shortest = min((s for s in self.vehicle.sources if s.last == self.system.end), key=lambda s: s.name)
        return f"the last row of {shortest.file.name} at {shortest.last:g} s; extend the table or ask for less"

    def _responses(self, responses: Iterable[str] | None) -> list[str]:
        names = list(self.system.output_names if responses is None else dict.fromkeys(responses))
        self.system.refuse_direct_noise(names)
        return names
