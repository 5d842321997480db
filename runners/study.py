"""A study: a vehicle (or any linear system) with numbers, and the questions one asks of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..codegen.compiled import ExecutableSystem, executable_system
from ..model.assemble import assemble
from ..model.errors import DirectNoiseError, TimeRangeError, UnknownNameError
from ..model.library import find_vehicle
from ..model.system import LinearSystem, Parameter
from ..model.tables import table_values
from ..model.vehicle import Vehicle, load_vehicle
from .adjoint import AdjointSolver
from .integration import IntegratorOptions
from .mean_response import with_mean_tables
from .sensitivity import sensitivity
from .sensitivity_check import check_sensitivity
from .stability import Root, check_coupling, matrices_at, roots, warn_if_unstable
from .statistics import COMBINED, ResponseStatistics, response_dataset, weighting_dataset
from .wind_start import covariance_at

Progress = Callable[[float], None]
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
        check_coupling(executable, system.tables)
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
        ValueError
            For a value that is not finite, or a time or area that is not positive.
        """
        names, values = self.system.parameter_names, self.executable.parameters.copy()
        for name, value in changes.items():
            if name not in names:
                raise UnknownNameError("parameter", name, names)
            if not np.isfinite(value) or (name.rpartition(".")[2] in POSITIVE and value <= 0):
                raise ParameterValueError(name, value)
            values[names.index(name)] = float(value)
        return Study(self.executable.with_numbers(parameters=values), self.vehicle)

    @cached_property
    def with_means(self) -> ExecutableSystem:
        """The system with its tables of the mean response, which the noise coefficients need, filled in."""
        return with_mean_tables(self.executable)

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
        options: IntegratorOptions | None = None,
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
        options : IntegratorOptions, optional
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
        options = options or IntegratorOptions()
        warn_if_unstable(self.executable, times[-1])
        solver = AdjointSolver(self.with_means, options)
        runs = []
        for time in times:
            runs.append(solver.run(time))
            if progress:
                progress(time)
        return response_dataset(self, runs, wanted, options)

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
        if not spacing > 0:
            raise TimeRangeError(f"a spacing of {spacing:g} s is not positive")
        history = AdjointSolver(self.with_means, options or IntegratorOptions()).history(float(time), spacing)
        return weighting_dataset(self, float(time), history)

    def sensitivity(
        self,
        response: str,
        time: float | Literal["peak"],
        *,
        source: str = COMBINED,
        quantity: str = "std",
        parameters: Iterable[str] | None = None,
        elasticity: bool = True,
    ) -> xr.Dataset:
        """Return exact derivatives of one number with respect to every parameter, table and table row.

        Parameters
        ----------
        response : str
        time : float or 'peak'
            t2, s; 'peak' is the time at which the quantity is largest, located between output times.
        source : str
            A noise source, or 'combined'.
        quantity : {'std', 'variance', 'mean', 'mean_plus_3sigma'}
        parameters : iterable of str, optional
            All without it.
        elasticity : bool
            False leaves out the derivatives in percent per percent, which a quantity of zero does not have.

        Returns
        -------
        xarray.Dataset
            ``derivative`` and ``elasticity`` (parameter); ``table_derivative`` (table, t) per second of flight, with
            ``table_derivative_at_end`` (table), the weight of its delta at t2, and ``node_weight`` (t) to integrate
            with; ``knot_derivative`` (knot) by row; ``wind_sigma_elasticity`` (band) by kilometre of altitude.

        Raises
        ------
        UnknownNameError, StructuralParameterError, TimeRangeError, DirectNoiseError, ZeroQuantityError

        Warns
        -----
        UndefinedElasticityWarning
            Parameters that are zero; their ``elasticity_defined`` is 0.
        """
        return sensitivity(self, response, time, source, quantity, parameters, elasticity)

    def check_sensitivity(
        self,
        response: str,
        time: float | Literal["peak"],
        *,
        source: str = COMBINED,
        quantity: str = "std",
        parameters: Iterable[str] | None = None,
        rows: int = 0,
    ) -> xr.Dataset:
        """Compare :meth:`sensitivity` with central differences of CVODES at a tolerance of 1e-12.

        Parameters
        ----------
        response, time, source, quantity, parameters
            As there.
        rows : int
            Of how many tables the row with the largest elasticity is checked too.

        Returns
        -------
        xarray.Dataset
            Over (item): ``derivative``, ``difference``, its ``uncertainty``, how far they are ``apart`` and whether
            the sensitivity ``agrees`` to 1e-5 and the uncertainty.
        """
        return check_sensitivity(self, response, time, source, quantity, parameters, rows)

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
        for name in names:
            row = self.system.D[self.system.output_index(name), :]
            for column, noise in enumerate(self.system.noises):
                if row[column].nnz() and not row[column].is_zero():
                    raise DirectNoiseError(
                        f"white noise of source '{noise.source}' reaches '{name}' directly, so that its variance is "
                        "infinite; colour the noise (white = false with a correlation time) or leave the response out"
                    )
        return names


class ParameterValueError(UnknownNameError, ValueError):
    """A parameter value that the equations cannot use."""

    def __init__(self, name: str, value: float):
        Exception.__init__(self, f"parameter '{name}' cannot be {value:g}; give a finite number above its limit")
