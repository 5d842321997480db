"""A vehicle or system with its numbers, and what follows from them at one time."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.compiled import sweep_recipe
from ...codegen.sweep.source import sweep_functions
from ...codegen.system.executable import ExecutableSystem, executable_system
from ...codegen.toolchain.library import Recipe
from ...model.equations.assemble import assemble
from ...model.errors import (
    DataError,
    NotPicklableError,
    NoVehicleError,
    ParameterValueError,
    TimeRangeError,
    UnknownNameError,
)
from ...model.system.labels import Parameter
from ...model.system.linear_system import LinearSystem
from ...model.system.names import WIND
from ...model.tables import table_values
from ...model.vehicle.coverage import check_wind, loaded_flight
from ...model.vehicle.planes import one_wind
from ...model.vehicle.reader import load_vehicle
from ...model.vehicle.shipped import find_vehicle
from ...model.vehicle.vehicle import Vehicle
from ...model.wind.record import COMPONENTS
from ...model.wind.statistics import WindModel
from ..present.notebook import html_page
from ..present.progress import steps
from ..solvers.mean_response import Respond, mean_response
from ..solvers.stability import Root, check_coupling, matrices_at, roots
from ..solvers.sweep import available_sweep, forward_mean
from ..solvers.time_nodes import on_flight
from .mean import LinearMean, NonlinearMean
from .summary import summary
from .wind_start import covariance_at

ANGLES = ("azimuth", "roll")  # last word of the names of parameters that turn, in rad
POSITIVE = ("correlation_time", "reference_area", "standard_deviation", "radius", "length", "high_pass")


@dataclass(frozen=True, eq=False, repr=False)
class Case:
    """A system with its numbers and its vehicle: all that an analysis is given.

    :class:`~ascentwind.runners.study.Study` is one, and asks the questions.

    Attributes
    ----------
    executable : ExecutableSystem
    vehicle : Vehicle or None
        None for a system of one's own.
    """

    executable: ExecutableSystem
    vehicle: Vehicle | None = None

    def __reduce__(self) -> str:
        raise NotPicklableError(
            "a study holds symbols and compiled code, which do not travel between processes; send study.vehicle and "
            "parameter values and make it there with Study.from_vehicle, or let 'ascentwind study' do so"
        )

    def __repr__(self) -> str:
        lines = [f"{label:10} {text}" for label, text in summary(self.executable, self.vehicle).items()]
        return "\n  ".join([f"{type(self).__name__} of {self.system.name}", *lines])

    def _repr_html_(self) -> str:
        return html_page(f"{type(self).__name__} of {self.system.name}", summary(self.executable, self.vehicle))

    @classmethod
    def load(cls, vehicle: str | Path, *, compile: bool = True, changes: Mapping[str, Any] | None = None) -> Self:
        """Load a shipped vehicle by name, or a vehicle folder.

        Parameters
        ----------
        vehicle : str or path
        compile : bool
            False uses CasADi's interpreter: the same numbers, slower.
        changes : mapping, optional
            Values in the place of those in vehicle.toml, by dotted key: ``{"options.full_coupling": True}``. They may
            change the structure, which ``with_parameters`` cannot.

        Returns
        -------
        Study

        Raises
        ------
        UnknownNameError, DataError, SingularCouplingError, CompilerError
        """
        return cls.from_vehicle(load_vehicle(find_vehicle(vehicle), changes), compile=compile)

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle, *, compile: bool = True) -> Self:
        """Assemble a loaded vehicle and prepare its code.

        Parameters
        ----------
        vehicle : Vehicle
            As :func:`ascentwind.load_vehicle` returns it.
        compile : bool
            As for :meth:`load`.

        Returns
        -------
        Study

        Raises
        ------
        SingularCouplingError, CompilerError
        """
        with steps("equations and their code") as line:
            system = assemble(vehicle, covariance_at(vehicle.wind.shaping_filter, vehicle.start_altitude))
            line.done(f"code of {system.name}")
            executable = executable_system(system, compile, _next_compiled)
            check_coupling(executable)
        return cls(executable, vehicle)

    @classmethod
    def from_system(cls, system: LinearSystem, *, compile: bool = True) -> Self:
        """Prepare the code of a linear system of your own.

        Parameters
        ----------
        system : LinearSystem
            As :func:`ascentwind.define_system` returns it.
        compile : bool
            As for :meth:`load`.

        Returns
        -------
        Study

        Raises
        ------
        CompilerError
        """
        with steps(f"code of {system.name}"):
            return cls(executable_system(system, compile))

    @property
    def system(self) -> LinearSystem:
        """The linear system: names of states, noises, outputs, and the symbolic matrices."""
        return self.executable.system

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every parameter by name, with its present value, unit and meaning."""
        pairs = zip(self.system.parameters, self.executable.parameters, strict=True)
        return {p.name: replace(p, value=float(value)) for p, value in pairs}

    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Return a study with other parameter values; nothing is compiled.

        Parameters
        ----------
        changes : mapping of str to float
            Values by parameter name, in the units that ``parameters`` shows.

        Returns
        -------
        Study

        Raises
        ------
        UnknownNameError
            With the nearest parameter name.
        ParameterValueError
            For a value that is not finite, or a time or area that is not positive.
        """
        return type(self)(self.executable.with_numbers(parameters=self.numbers(changes)), self.vehicle)

    def numbers(self, changes: Mapping[str, float]) -> NDArray[np.float64]:
        """Return the values of all parameters with some changed, in the order of the system's.

        Parameters
        ----------
        changes : mapping of str to float
            As for :meth:`with_parameters`.

        Returns
        -------
        (n_p,) array

        Raises
        ------
        UnknownNameError, ParameterValueError
        """
        names, values = self.system.parameter_names, self.executable.parameters.copy()
        for name, value in changes.items():
            if name not in names:
                raise UnknownNameError("parameter", name, names)
            try:
                number = float(value)
            except (TypeError, ValueError, OverflowError):
                raise ParameterValueError(f"parameter '{name}' cannot be {value!r:.40}; give a number") from None
            if not np.isfinite(number) or (name.rpartition(".")[2] in POSITIVE and number <= 0):
                raise ParameterValueError(f"parameter '{name}' cannot be {number:g}; give a finite, sensible number")
            if name.rpartition(".")[2] in ANGLES and abs(number) > 2 * np.pi:
                raise ParameterValueError(
                    f"parameter '{name}' cannot be {number:g} rad, more than a turn; {number:g} deg is "
                    f"{np.radians(number):.4g} rad"
                )
            values[names.index(name)] = number
        return values

    def vehicle_for(self, what: str) -> Vehicle:
        """Return the vehicle for a question that only a vehicle answers.

        Parameters
        ----------
        what : str
            The question, which begins the sentence of the error.

        Returns
        -------
        Vehicle

        Raises
        ------
        NoVehicleError
            The case is a system of one's own.
        """
        if self.vehicle is None:
            raise NoVehicleError(what, self.system.name)
        return self.vehicle

    def wind_input(self, what: str) -> int:
        """Return which of the known inputs is the one wind that a vehicle meets.

        Parameters
        ----------
        what : str
            The question, which begins the sentence of the error.

        Returns
        -------
        int

        Raises
        ------
        PlanesError
            The wind has two components.
        UnknownNameError
            The system has no such input.
        """
        names = self.system.input_names
        if WIND in names:
            return names.index(WIND)
        if self.vehicle is not None:
            one_wind(self.vehicle, what)
        raise UnknownNameError("input", WIND, names)

    def wind_inputs(self, what: str) -> list[int]:
        """Return which of the known inputs are winds: the one that a vehicle meets, or both components of it.

        Parameters
        ----------
        what : str
            The question, which begins the sentence of the error.

        Returns
        -------
        list of int

        Raises
        ------
        UnknownNameError
            The system has no such inputs.
        """
        names, components = self.system.input_names, [f"{WIND}_{component}" for component in COMPONENTS]
        return [names.index(c) for c in components] if set(components) <= set(names) else [self.wind_input(what)]

    @property
    def start_altitude(self) -> float:
        """Altitude where the flight starts, m; of a vehicle only, else a NoVehicleError."""
        return self.vehicle_for("the altitude of the start").start_altitude

    def with_wind(self, wind: WindModel) -> Self:
        """Return a study of the same vehicle in another wind.

        Parameters
        ----------
        wind : WindModel
            Mean and filter of one wind.

        Returns
        -------
        Study

        Raises
        ------
        NoVehicleError
        DataError
            A filter without its mean; a wind that the flight does not meet, or whose parts are of different winds.

        Warns
        -----
        ExtrapolationWarning
            The flight leaves the wind's altitudes where it is loaded: values are held at the last ones there.
        WindWarning
            The filter's standard deviation is more than a tenth from the table's.
        """
        vehicle = self.vehicle_for("another wind")
        if not isinstance(wind, WindModel):
            raise DataError(
                f"a wind is a mean and a filter of the same statistics, and {type(wind).__name__} is not: give "
                "WindModel(statistics.mean_table(), filter)"
            )
        one_wind(vehicle, "another wind")
        check_wind(wind, loaded_flight(vehicle.tables, vehicle.start, vehicle.end))
        case = self.from_vehicle(replace(vehicle, wind=wind), compile=self.executable.shared_library is not None)
        values = {n: p.value for n, p in self.parameters.items() if n in case.parameters}
        return case.with_parameters(values)

    @cached_property
    def mean(self) -> LinearMean | NonlinearMean:
        """How tables of the mean response are filled, as the vehicle's options ask."""
        if self.vehicle is not None and self.vehicle.file.options.mean_response == "nonlinear":
            return NonlinearMean(self.vehicle)
        return LinearMean()

    @cached_property
    def linear_means(self) -> ExecutableSystem:
        """The system with its tables of the mean response filled in by the linear mean."""
        return LinearMean().fill(self.executable, self._respond)

    @cached_property
    def with_means(self) -> ExecutableSystem:
        """The system with the tables of the mean response that the noise coefficients need, as the options ask."""
        return self.mean.fill(self.executable, self._respond)

    @property
    def _respond(self) -> Respond:
        engine = available_sweep(self.executable)
        return mean_response if engine is None else forward_mean(engine)

    @cached_property
    def _kept(self) -> dict[Hashable, Any]:
        return {}

    def kept(self, question: Hashable, answer: Callable[[], Any]) -> Any:
        """Return what was computed once for a question that is asked again and again, such as the weights of a flight.

        Parameters
        ----------
        question : hashable
        answer : callable
            Computes it, the first time.

        Returns
        -------
        object
            Not to be changed.

        Raises
        ------
        AscentwindError
            What computing it raises.
        """
        if question not in self._kept:
            self._kept[question] = answer()
        return self._kept[question]

    def mean_states(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the states of the linear mean response.

        Parameters
        ----------
        times : (k,) array
            s, increasing.

        Returns
        -------
        (k, n) array

        Raises
        ------
        IntegrationError
        """
        start = self.system.start
        later = np.asarray(times, float)[np.asarray(times, float) > start]
        states = self._respond(self.with_means, np.concatenate([[start], later])).states
        return states if later.size < len(times) else states[1:]

    def matrices(self, time: float) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Return the matrices at a time; names of their rows and columns are in ``system``.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        A (n, n), B (n, n_w), C (n_y, n), D (n_y, n_w) : arrays

        Raises
        ------
        TimeRangeError
        """
        self.checked_times([time])
        m = matrices_at(self.with_means, float(time))
        return m["A"], m["B"], m["C"], m["D"]

    def roots(self, time: float) -> list[Root]:
        """Return the eigenvalues of A frozen at a time, slowest first.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        list of Root

        Raises
        ------
        TimeRangeError
        """
        self.checked_times([time])
        return roots(self.executable, float(time))

    def tables(self, time: float) -> dict[str, float]:
        """Return every table value at a time by name.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        dict of str to float

        Raises
        ------
        TimeRangeError
        """
        self.checked_times([time])
        return table_values(self.with_means.groups, float(time))

    def require_linear_mean(self, what: str) -> None:
        """Raise where the nonlinear mean is in force and something follows the linear one.

        Parameters
        ----------
        what : str
            Begins the sentence of the error.

        Raises
        ------
        ParameterValueError
        """
        if isinstance(self.mean, NonlinearMean):
            raise ParameterValueError(f'{what} follows the linear mean response; set options.mean_response = "linear"')

    def check_spacing(self, spacing: float) -> None:
        """Raise if a distance between points is not positive.

        Parameters
        ----------
        spacing : float
            s.

        Raises
        ------
        TimeRangeError
        """
        if not spacing > 0:
            raise TimeRangeError(f"a spacing of {spacing:g} s is not positive")

    def checked_times(self, times: Iterable[float]) -> list[float]:
        """Return end times as they are given; raise if one does not lie on the flight, or there are none.

        Parameters
        ----------
        times : iterable of float
            s.

        Returns
        -------
        list of float

        Raises
        ------
        TimeRangeError
        """
        times = list(times)
        if not times:
            raise TimeRangeError("no end time was given")
        for time in times:
            if not np.isfinite(time):
                raise TimeRangeError(f"{time} is not a time")
            if on_flight(self.system, [time])[0]:
                continue
            if time < self.system.start:
                raise TimeRangeError(
                    f"end time {time:g} s lies before the start at {self.system.start:g} s; "
                    "choose a later one or an earlier start_time_s"
                )
            raise TimeRangeError(f"end time {time:g} s lies beyond {self._end_of_data()}")
        return times

    def _end_of_data(self) -> str:
        end = f"the end of the system at {self.system.end:g} s"
        if self.vehicle is None:
            return end
        shortest = min((s for s in self.vehicle.sources if s.last == self.system.end), key=lambda s: s.name)
        return f"the last row of {shortest.file.name} at {shortest.last:g} s; extend the table or ask for less"

    def checked_responses(self, responses: Iterable[str] | None) -> list[str]:
        """Return the names of responses, each once; all for None.

        Parameters
        ----------
        responses : iterable of str or None

        Returns
        -------
        list of str

        Raises
        ------
        UnknownNameError, DirectNoiseError
        """
        if isinstance(responses, str):
            responses = [responses]
        names = list(self.system.output_names if responses is None else dict.fromkeys(responses))
        self.system.refuse_direct_noise(names)
        return names


def _next_compiled(system: LinearSystem) -> Recipe:
    """Return what most questions to a vehicle ask for after its own functions."""
    return sweep_recipe(system, sweep_functions(system))
