"""A study: the questions one asks of a vehicle, or of any linear system with numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

from ..model.errors import IntegrationError, ParameterValueError
from ..model.system.names import COMBINED
from .case.case import Case
from .case.times import end_times
from .flight_load.request import DESIGN, DRAWS
from .measured_winds.defaults import ERROR, THRESHOLD
from .statistics.norm import LIKE_3_SIGMA

if TYPE_CHECKING:
    import xarray as xr

    from ..model.wind.soundings.collection import Soundings
    from ..model.wind.soundings.sounding import Sounding
    from .design_wind.design_wind import DesignWind
    from .flight_load.limit_table import Limits
    from .flight_load.load import FlightLoad
    from .flight_load.passage import Passage
    from .gusts.search import GustSweep
    from .gusts.shapes import Gust
    from .measured_winds.day_of_launch import Balloon, DayOfLaunch
    from .measured_winds.fly import FlownWinds
    from .measured_winds.wind_field import Lasting
    from .statistics.cvodes import Cvodes
    from .statistics.engine import Engine, Progress
    from .statistics.percentiles import Sides
    from .statistics.results import ResponseStatistics
    from .statistics.sweep import Sweep


@dataclass(frozen=True, eq=False, repr=False)
class Study(Case):
    """Response statistics of a system by the method of adjoint systems.

    Make one with :meth:`load` (vehicles) or :meth:`from_system` (systems of your own).

    Attributes
    ----------
    executable : ExecutableSystem
    vehicle : Vehicle or None
        None for a system of one's own.

    Examples
    --------
    >>> import ascentwind as aw
    >>> study = aw.Study.load("as504")
    >>> stats = study.response_statistics(times=[75.0])
    >>> sigma = stats.std.sel(response="bending_moment", source="wind", time=75.0)
    >>> print(f"{float(sigma) / 1e6:.2f} MN m")
    4.62 MN m
    >>> A, B, C, D = study.matrices(75.0)
    >>> A.shape == (len(study.system.states),) * 2
    True
    """

    def response_statistics(
        self,
        times: Iterable[float],
        *,
        responses: Iterable[str] | None = None,
        engine: str | Engine | None = None,
        options: Engine | None = None,
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
        engine : str or Engine, optional
            :class:`~ascentwind.Sweep`, 'sweep' (default where a compiler is found): all end times in one pass of a
            generated integrator. :class:`~ascentwind.Cvodes`, 'cvodes' (default elsewhere): one backward adjoint run an
            end time. :class:`~ascentwind.CovarianceEquation`, 'covariance': forward. :class:`~ascentwind.Ensemble`,
            'ensemble': simulated flights, with confidence intervals. By name each has its defaults.
        options : Engine, optional
            The former name of ``engine``; goes with the next release.
        check : bool
            Compute everything a second time with a finer discretisation (a tenth of the tolerance or less, half the
            substep of the ensemble), in each of 1024 pieces of the flight so that no step passes over a pulse, and keep
            the relative difference of the standard deviation as ``discretisation_difference``.
        progress : callable, optional
            Called with each end time when it is done.

        Returns
        -------
        ResponseStatistics
            Over (time, response, source); ``combined`` is the sum over the independent sources.

        Raises
        ------
        TimeRangeError, UnknownNameError, DirectNoiseError, IntegrationError

        Warns
        -----
        UnstableSystemWarning, UncheckedStatisticsWarning
        """
        from .statistics.engines import engine_of_options, response_statistics

        return response_statistics(
            self,
            times,
            responses=responses,
            engine=engine_of_options(engine, options),
            check=check,
            progress=progress,
        )

    def batch(
        self,
        parameter_sets: Sequence[Mapping[str, float]],
        times: Iterable[float],
        *,
        engine: str | Engine | None = None,
        options: Engine | None = None,
        threads: int | None = None,
    ) -> ResponseStatistics:
        """Return the statistics for many sets of parameter values, by the sweep on all cores.

        Where nothing is compiled, CVODES computes one set after another.

        Parameters
        ----------
        parameter_sets : sequence of mappings
            Each as for :meth:`with_parameters`.
        times : iterable of float
            End times t2, s.
        engine : Sweep, Cvodes or their names, optional
            The sweep at a relative tolerance of 1e-4 without it or by its name.
        options : Sweep, optional
            The former name of ``engine``; goes with the next release.
        threads : int, optional
            All cores without it; names the sweep, which needs a compiler.

        Returns
        -------
        ResponseStatistics
            As :meth:`response_statistics`, with a dimension ``member`` in front and every parameter that was named as a
            coordinate over it, with its unit.

        Raises
        ------
        TimeRangeError, UnknownNameError, ParameterValueError, IntegrationError, NoCompilerError
        """
        from ..codegen.sweep.compiled import sweep_of
        from .present.progress import each, steps
        from .solvers.adjoint import adjoint_member
        from .solvers.sweep import batch
        from .statistics.cvodes import Cvodes
        from .statistics.dataset import batch_dataset, with_members
        from .statistics.engines import engine_of_options, find_engine
        from .statistics.results import ResponseStatistics
        from .statistics.sweep import Sweep

        if not parameter_sets:
            raise ParameterValueError("a batch needs at least one set of parameter values")
        ends = self.checked_times(end_times(times))
        self.checked_responses(None)
        values = [self.numbers(changes) for changes in parameter_sets]
        engine = engine_of_options(engine, options)
        if engine is None:
            alone = self.executable.shared_library is None and threads is None
            engine = Cvodes() if alone else Sweep(relative_tolerance=1e-4)
        elif engine == Sweep.name:
            engine = Sweep(relative_tolerance=1e-4)
        chosen = find_engine(engine)
        if isinstance(chosen, Cvodes):
            if threads is not None:
                raise IntegrationError("CVODES computes one set after another; leave 'threads' out, or take the sweep")
            members = []
            for numbers in each(values, "sets of parameters"):
                member = self.mean.fill(self.executable.with_numbers(parameters=numbers))
                members.append(adjoint_member(member, ends, chosen))
        elif isinstance(chosen, Sweep):
            with steps(f"{len(values)} sets of parameters"):
                found = batch(
                    sweep_of(self.executable),
                    self.executable,
                    values,
                    ends,
                    relative_tolerance=chosen.relative_tolerance,
                    threads=threads,
                    fill=self.mean.fill,
                )
            members = [(member.mean, member.variance) for member in found]
        else:
            raise IntegrationError(f"a batch is computed by Sweep or Cvodes, not by {type(chosen).__name__}")
        dataset = batch_dataset(self, ends, members, chosen.name, chosen.relative_tolerance)
        return ResponseStatistics(with_members(dataset, self, parameter_sets))

    def weighting_functions(
        self,
        times: Iterable[float],
        *,
        spacing: float = 0.25,
        engine: str | Sweep | None = None,
        options: Sweep | None = None,
    ) -> xr.Dataset:
        """Return the weighting functions g(t2, t) of all responses for many end times, by one backward sweep.

        Where nothing is compiled, the transition matrices that it takes are SciPy's.

        Parameters
        ----------
        times : iterable of float
            End times t2, s.
        spacing : float
            Largest distance between points, s.
        engine : Sweep or its name, optional
        options : Sweep, optional
            The former name of ``engine``; goes with the next release.

        Returns
        -------
        xarray.Dataset
            As :meth:`weighting_function`, with a dimension ``time`` in front; zero for t after the end time.

        Raises
        ------
        TimeRangeError, IntegrationError, NoCompilerError
        """
        from ..codegen.sweep.compiled import sweep_of
        from .solvers.sweep import interpreted_weighting, sweep
        from .statistics.engines import engine_as, engine_of_options
        from .statistics.sweep import Sweep
        from .statistics.weighting import weighting_family

        ends = self.checked_times(end_times(times))
        self.check_spacing(spacing)
        if engine is None and options is None and self.executable.shared_library is None:
            return weighting_family(self, ends, interpreted_weighting(self.with_means, ends, spacing))
        what = "weighting functions of many end times are computed"
        chosen = engine_as(Sweep, engine_of_options(engine, options), Sweep(), what)

        def answer() -> xr.Dataset:
            found = sweep(
                sweep_of(self.executable),
                self.with_means,
                ends,
                relative_tolerance=chosen.relative_tolerance,
                weighting_spacing=spacing,
                responses=(),
            )
            assert found.weighting is not None
            return weighting_family(self, ends, found.weighting)

        return self.kept(("weighting functions", tuple(ends), spacing, chosen), answer).copy()

    def weighting_function(
        self,
        time: float,
        *,
        spacing: float = 0.05,
        engine: str | Cvodes | None = None,
        options: Cvodes | None = None,
    ) -> xr.Dataset:
        """Return the weighting functions g(t2, t) of all responses for t2 = ``time``.

        Parameters
        ----------
        time : float
            t2, s.
        spacing : float
            Largest distance between points, s.
        engine : Cvodes or its name, optional
        options : Cvodes, optional
            The former name of ``engine``; goes with the next release.

        Returns
        -------
        xarray.Dataset
            ``noise_weighting`` (response, noise, t): response to a unit impulse of each white noise at t; squared
            and integrated it gives the variance. ``input_weighting`` (response, input, t): response to an impulse of
            the wind straight into the vehicle; its delta at t = t2 has the weight ``direct`` (response, input).

        Raises
        ------
        TimeRangeError, IntegrationError
        """
        from .solvers.adjoint import AdjointSolver
        from .statistics.cvodes import Cvodes
        from .statistics.engines import engine_as, engine_of_options
        from .statistics.weighting import weighting_dataset

        self.checked_times([time])
        self.check_spacing(spacing)
        what = "the weighting functions of one end time are computed"
        chosen = engine_as(Cvodes, engine_of_options(engine, options), Cvodes(), what)
        history = AdjointSolver(self.with_means, chosen).history(float(time), spacing)
        return weighting_dataset(self, float(time), history)

    def flight_load(
        self,
        response: str,
        window: tuple[float, float] | None = None,
        probabilities: float | Iterable[float] = (DESIGN,),
        *,
        limit: str | Path | Limits | float | None = None,
        sides: Sides = "both",
        draws: int = DRAWS,
        seed: int = 0,
    ) -> FlightLoad:
        """Return the largest value that a response takes in a window of flight, with its odds.

        Parameters
        ----------
        response : str
            Of a system in both planes the name of a resultant too, such as 'resultant_bending_moment': the largest norm
            of both planes, jointly, whose level is looked for in the part of the window where it is passed.
        window : (float, float), optional
            s; a vehicle's default times without it, the whole flight of other systems.
        probabilities : float or iterable of float
            For each the level that the flight's maximum passes with it. 0.00135 is the chance with which a single
            instant passes mean + 3 sigma.
        limit : path, Limits or float, optional
            What the size of the response may not pass, over time; ``passage`` of the result says with what chance a
            flight does, and what margin is left.
        sides : {'both', 'upper', 'lower'}
            Of the response's size, both sides together; of the response; or of its negative. A resultant is a size.
        draws : int
            Paths of the importance sampling: 2000 give a probability to some 3 %.
        seed : int
            The same seed gives the same numbers on every machine, to rounding.

        Returns
        -------
        FlightLoad
            ``level`` and its ``interval``, ``probability(value)``, ``exceedance``, ``time_of_maximum``, ``shares``.

        Raises
        ------
        UnknownNameError, TimeRangeError, ParameterValueError, DirectNoiseError, NoVarianceError, LimitError
        PlanesError
            A resultant of a system in one plane.

        Warns
        -----
        SpacingWarning
            The response moves too fast for the finest grid of times.

        Notes
        -----
        The response over the window is a Gaussian process with the covariance R(t, s) = C(t) P(t) Phi(s, t)' C(s)'.
        Rare passages are drawn by a mixture over times (Adler, Blanchet and Liu 2012), between points of the grid as
        Brownian bridges where white noise reaches the response's rate.
        """
        from .flight_load.load import flight_load

        return flight_load(self, response, window, probabilities, sides, draws, seed, limit)

    def limit_passage(
        self,
        limits: str | Path | Limits,
        window: tuple[float, float] | None = None,
        probability: float = DESIGN,
        *,
        sides: Sides = "both",
        draws: int = DRAWS,
        seed: int = 0,
    ) -> Passage:
        """Return the chance that a flight passes any of several limits, at any time and any station, jointly.

        Parameters
        ----------
        limits : path or Limits
            Over time: of responses and resultants. Over stations, or both: of bending moment, shear force, axial force
            or equivalent axial load along the vehicle, at each of the vehicle's stations that lies between theirs; of a
            vehicle in both planes of the resultants of bending moment and shear force.
        window : (float, float), optional
            As for :meth:`flight_load`, s.
        probability : float
            A probability, that margins are of.
        sides : {'both', 'upper', 'lower'}
        draws : int
            Paths of the importance sampling.
        seed : int

        Returns
        -------
        Passage
            ``probability`` jointly, ``by_load``, ``by_time``, ``level`` and ``margin`` (time, load), ``factor`` on all
            limits and ``margin_of_safety``.

        Raises
        ------
        LimitError, DataError, TimeRangeError, ParameterValueError, UnknownNameError, DirectNoiseError, NoVarianceError

        Warns
        -----
        CertainPassageWarning
            A limit lies below a mean.
        UncheckedStationsWarning
            The vehicle has stations outside those of the table.
        """
        from .flight_load.limits import limit_passage

        return limit_passage(self, limits, window, probability, sides, draws, seed)

    def resultant_along_vehicle(
        self, times: Iterable[float], load: str = "bending_moment", probability: float = LIKE_3_SIGMA
    ) -> xr.Dataset:
        """Return the resultant of a load of both planes at every station of the vehicle.

        Parameters
        ----------
        times : iterable of float
            Flight times, s.
        load : {'bending_moment', 'shear_force'}
        probability : float
            Probability with which the resultant exceeds its level at one instant; by default 1 - Phi(3).

        Returns
        -------
        xarray.Dataset
            ``plane_mean``, ``plane_covariance`` by source, ``level`` and ``direction`` over (time, station, ...).

        Raises
        ------
        PlanesError
            The vehicle flies in one plane.
        NoVehicleError, DataError, TimeRangeError, UnknownNameError, ParameterValueError, IntegrationError
        """
        from .station_loads.loads_along_vehicle import resultant_along_vehicle

        return resultant_along_vehicle(self, times, load=load, probability=probability)

    def percentile_sensitivity(
        self,
        resultant: str,
        time: float | Literal["peak"],
        probability: float = LIKE_3_SIGMA,
        parameters: Iterable[str] | None = None,
    ) -> xr.Dataset:
        """Return the derivatives of a percentile of a resultant of both planes, by all parameters and tables.

        Parameters
        ----------
        resultant : str
            Such as 'resultant_bending_moment' or 'total_angle_of_attack'.
        time : float or 'peak'
            End time t2, s; 'peak' is the time of the largest level, located between output times.
        probability : float
            Probability with which the resultant exceeds its level at that instant; by default 1 - Phi(3).
        parameters : iterable of str, optional
            All without it.

        Returns
        -------
        xarray.Dataset
            As :meth:`sensitivity`. The attributes hold the level (``value``), its likeliest direction (rad, from pitch
            towards yaw) and its derivatives by the mean vector and the covariance of both planes.

        Raises
        ------
        PlanesError
            The system has one plane.
        UnknownNameError, TimeRangeError, ParameterValueError, DirectNoiseError, NoCompilerError, IntegrationError
        """
        from .present.progress import steps
        from .sensitivity.percentile import percentile_sensitivity

        with steps("sensitivities of a level"):
            return percentile_sensitivity(self, resultant, time, probability, parameters)

    def design_wind(
        self,
        response: str | FlightLoad,
        time: float | None = None,
        *,
        sigmas: float = 3.0,
        combined: bool = False,
    ) -> DesignWind:
        """Return the most likely wind over altitude that makes a load.

        Parameters
        ----------
        response : str or FlightLoad
            With a flight's load: the wind behind its first level, at the time at which flights most likely pass it,
            combined; leave the others out.
        time : float, optional
            t2, s.
        sigmas : float
            k of the load mean + k sigma, a factor. Negative for the other side; zero is the mean wind.
        combined : bool
            False: sigma of the wind alone, whose profile makes all of the load. True: sigma of all sources; the
            profile makes the wind's share, ``deviations`` of the vehicle the rest.

        Returns
        -------
        DesignWind
            ``profile``, ``load``, ``draws(count)`` of winds that make the load, ``write(path)``.

        Raises
        ------
        UnknownNameError, TimeRangeError, ParameterValueError, DirectNoiseError, NoVarianceError, NoVehicleError
        DataError, IntegrationError

        Notes
        -----
        E[w(h) | y] = mean + cov(w(h), y) (L - E[y]) / Var[y], with a corner at h(t2). Of all histories of the filter's
        white noise that make the load it is that of least norm, k.
        """
        from .design_wind.design_wind import design_wind

        return design_wind(self, response, time, sigmas, combined)

    def gust_response(
        self,
        gust: Gust,
        start_altitude: float,
        times: Iterable[float],
        *,
        responses: Iterable[str] | None = None,
        direction: float | None = None,
    ) -> xr.Dataset:
        """Return what a discrete gust alone puts into responses, over time.

        Parameters
        ----------
        gust : OneMinusCosine, QuasiSquare or RampAndHold
        start_altitude : float
            Where it starts, m.
        times : iterable of float
            s; zero before the vehicle meets it.
        responses : iterable of str, optional
            All without it; in both planes resultants too.
        direction : float, optional
            Where it blows, rad from north towards east: of a vehicle in both planes, and of no other.

        Returns
        -------
        xarray.Dataset
            ``response_to_gust`` (time, response).

        Raises
        ------
        GustError, TimeRangeError, UnknownNameError, ParameterValueError, NoVehicleError, DataError, IntegrationError
        """
        from .gusts.response import gust_response

        return gust_response(self, gust, start_altitude, times, responses, direction)

    def gust_sweep(
        self,
        gust: Gust | None = None,
        times: Iterable[float] | None = None,
        *,
        responses: Iterable[str] | None = None,
        lengths: Iterable[float] | None = None,
    ) -> GustSweep:
        """Return the responses to discrete gusts of all lengths that start at all altitudes.

        Parameters
        ----------
        gust : OneMinusCosine, QuasiSquare or RampAndHold, optional
            The shape, of which the length is varied; a full wave of 9 m/s without it.
        times : iterable of float, optional
            End times t2, s; 21 of the vehicle's default times without it.
        responses : iterable of str, optional
            All without it; in both planes resultants too.
        lengths : iterable of float, optional
            m, along altitude; 60 to 300 m without it.

        Returns
        -------
        GustSweep
            ``dataset`` over (time, response, length); ``worst(response)`` located between the points. In both planes
            every gust blows in the direction that is worst for the response.

        Raises
        ------
        GustError, TimeRangeError, UnknownNameError, ParameterValueError, NoVehicleError, DataError, IntegrationError
        """
        from .gusts.search import gust_sweep
        from .gusts.shapes import OneMinusCosine

        return gust_sweep(self, OneMinusCosine() if gust is None else gust, times, responses, lengths)

    def fly(
        self,
        profiles: str | Path | Soundings | Sounding,
        times: Iterable[float] | None = None,
        *,
        responses: Iterable[str] | None = None,
        component: str | None = None,
        sign: int = 1,
    ) -> FlownWinds:
        """Return what measured winds make of responses, beside what the vehicle's Gaussian wind predicts.

        Histories are products of the profiles with the weighting functions, integrated over the levels; nothing is
        integrated again for further profiles at the same levels.

        Parameters
        ----------
        profiles : path, Soundings or Sounding
            A file whose soundings share levels, or what :func:`ascentwind.read_soundings` returns. Straight between
            levels; where a profile holds nothing, the filter's mean given the profile.
        times : iterable of float, optional
            End times, s; the vehicle's default ones without it.
        responses : iterable of str, optional
            All without it.
        component : {'zonal', 'meridional'}, optional
            What blows across the flight; the wind's record says it without it.
        sign : {1, -1}
            With ``component``: 1 when its positive direction is the vehicle's +Y.

        Returns
        -------
        FlownWinds
            ``histories``, ``percentiles()``, ``maxima``, ``worst(response)``, ``normality``; in both planes
            ``resultants``.

        Raises
        ------
        NoVehicleError, DataError, SoundingError, UnknownNameError, TimeRangeError, DirectNoiseError
        """
        from .measured_winds.fly import fly
        from .present.progress import steps

        with steps("flights through measured winds"):
            return fly(self, profiles, times, responses, component, sign)

    def matrix_grid(self, times: Iterable[float] | None = None) -> xr.Dataset:
        """Return the matrices A, B, C, D, E, G and the known inputs over time, with names and units.

        A jump is there twice, a few roundings before and after it. ``grid.A.sel(time=75.0).to_pandas()`` is a labelled
        frame.

        Parameters
        ----------
        times : iterable of float, optional
            s; the whole flight in steps of 0.05 s without it.

        Returns
        -------
        xarray.Dataset
            A (time, state_rate, state), B (time, state_rate, noise), C (time, response, state), D (time, response,
            noise), E (time, state_rate, input), G (time, response, input), u (time, input), ``start_covariance``
            (source, state_rate, state) and ``jump`` (s).

        Raises
        ------
        TimeRangeError, ExportError
        """
        from .export.matrix_grid import default_grid, matrix_grid

        return matrix_grid(self, default_grid(self) if times is None else times)

    def to_statespace(self, time: float, *, library: Literal["control", "scipy"] = "control") -> Any:
        """Return the system frozen at a time as an object of a control library.

        Its inputs are the white noises, then the known inputs; names are kept by python-control.

        Parameters
        ----------
        time : float
            s; at a jump after it.
        library : {'control', 'scipy'}

        Returns
        -------
        control.StateSpace or scipy.signal.StateSpace

        Raises
        ------
        TimeRangeError, UnknownNameError
        MissingLibraryError
            python-control is not installed.
        """
        from .export.state_space import state_space

        return state_space(self, time, library)

    def day_of_launch(
        self,
        soundings: Balloon | Sequence[Balloon],
        hours_before: float | Sequence[float],
        *,
        limits: str | Path | Limits | None = None,
        window: tuple[float, float] | None = None,
        responses: Iterable[str] | None = None,
        persistence: Lasting | None = None,
        error: float = ERROR,
        threshold: float = THRESHOLD,
        sides: Sides = "both",
        draws: int = DRAWS,
        seed: int = 0,
        component: str | None = None,
        sign: int = 1,
    ) -> DayOfLaunch:
        """Return what winds measured before a launch say of its responses and limits.

        Parameters
        ----------
        soundings : path, Sounding or Soundings, or a sequence of them
            Of one time each. Levels outside the flight are not used, nor those within 50 m of the one below.
        hours_before : float or sequence of float
            Between each and the launch, h.
        limits : path or Limits, optional
            Of responses over time; needed for a probability.
        window : (float, float), optional
            As for :meth:`flight_load`, s.
        responses : iterable of str, optional
            Those with a limit without it, or all.
        persistence : Persistence or ComponentPersistence, optional
            By wavelength and lag, of both components alike or of each; without it the correlation after 24 h is that
            measured at Cape Canaveral in March; how it grows at shorter lags and falls for shorter waves is assumed.
        error : float
            Standard deviation of a measured wind, m/s, independent by level.
        threshold : float
            Probability of passing a limit above which it is no-go.
        sides : {'both', 'upper', 'lower'}
        draws : int
            Paths of the importance sampling.
        seed : int
        component : {'zonal', 'meridional'}, optional
            As for :meth:`fly`.
        sign : {1, -1}

        Returns
        -------
        DayOfLaunch
            ``mean``, ``std`` (time, response), ``wind``, ``probability``, ``go``, ``margin_in_sigmas()``, ``update``;
            in both planes ``law(resultant)``.

        Raises
        ------
        NoVehicleError, SoundingError, DataError, LimitError, ParameterValueError, UnknownNameError, TimeRangeError

        Warns
        -----
        CertainPassageWarning
        """
        from .measured_winds.day_of_launch import day_of_launch
        from .present.progress import steps

        with steps("what the balloons say"):
            return day_of_launch(
                self, soundings, hours_before, limits, window, responses, persistence, error, threshold, sides, draws,
                seed, component, sign,
            )  # fmt: skip

    def availability(
        self,
        limits: str | Path | Limits,
        *,
        months: Sequence[str] | None = None,
        azimuths: Iterable[float] | None = None,
        winds: str | Path | None = None,
        window: tuple[float, float] | None = None,
        check_hours: float | None = None,
        threshold: float = THRESHOLD,
        sides: Sides = "both",
        draws: int = DRAWS,
        seed: int = 0,
        progress: Callable[[int, int], None] | None = None,
    ) -> xr.Dataset:
        """Return the chance that a flight passes its limits, by month and launch azimuth, in the vehicle's plane.

        Parameters
        ----------
        limits : path or Limits
            Of responses over time.
        months : sequence of str, optional
            All that are there without it.
        azimuths : iterable of float, optional
            rad from north towards east; the vehicle's own without it.
        winds : path, optional
            Folder of months as ``ascentwind wind months`` writes it; those of Cape Canaveral without it.
        window : (float, float), optional
            As for :meth:`flight_load`, s.
        check_hours : float, optional
            With a sounding so many hours (h) before launch and a go below the threshold: how often it stops a launch,
            and what risk remains, by drawn days.
        threshold : float
            Probability, of the check.
        sides : {'both', 'upper', 'lower'}
        draws : int
            Paths of the importance sampling.
        seed : int
        progress : callable, optional
            Called with how many months and azimuths are done, and how many there are.

        Returns
        -------
        xarray.Dataset
            Over (month, azimuth): ``probability``, ``lower`` and ``upper`` of its 90 % interval by the sampling of the
            statistics, ``stopped`` and ``remaining_risk``; ``level`` (month, azimuth, response).

        Raises
        ------
        NoVehicleError, DataError, LimitError, UnknownNameError, ParameterValueError, TimeRangeError
        """
        from .measured_winds.availability import availability

        return availability(
            self, limits, months, azimuths, winds, window, check_hours, threshold, sides, draws, seed, progress
        )

    def predict_wind(
        self, altitude: ArrayLike, wind: ArrayLike, ahead: ArrayLike, *, error: float = ERROR
    ) -> xr.Dataset:
        """Return the wind ahead from the wind below, by a Kalman filter over altitude.

        Parameters
        ----------
        altitude : (k,) array_like
            Where it was measured, increasing, m.
        wind : (k,) array_like
            Along the vehicle's +Y, m/s; where it flies in both planes (k, 2), towards the east and towards the north.
        ahead : (j,) array_like
            Altitudes above the last one, increasing, m.
        error : float
            Standard deviation of a measurement, m/s.

        Returns
        -------
        xarray.Dataset
            ``predicted``, ``std`` and ``band`` (ahead); ``one_step`` (altitude) from the levels below each, and the
            ``gain`` (altitude, state); in both planes of each ``component``.

        Raises
        ------
        NoVehicleError, ParameterValueError
        """
        from .measured_winds.predictor import predict_wind

        return predict_wind(self, altitude, wind, ahead, error)

    def persistence(self, soundings: Soundings, component: str | None = None) -> Lasting:
        """Return how long winds last by one's own soundings, for :meth:`day_of_launch`.

        Parameters
        ----------
        soundings : Soundings
            With hours in their dates; pairs of any lag up to 48 h, 20 at least.
        component : {'zonal', 'meridional'}, optional
            That across the flight without it; none where the vehicle flies in both planes.

        Returns
        -------
        Persistence or ComponentPersistence
            Of the component across the flight, or of both.

        Raises
        ------
        NoVehicleError, SoundingError, ParameterValueError, DataError, UnknownNameError
        """
        from .case.climb import Climb
        from .flight_load.window import checked_window
        from .measured_winds.met_winds import met_winds
        from .measured_winds.wind_field import measured_persistence, wind_field

        met = met_winds(self, component, 1)
        top = float(Climb.of(self).altitude(checked_window(self, None)[1]))
        return measured_persistence(wind_field(self, top), soundings, met.components)

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
            t2, s; 'peak' is the time at which the quantity, or the size of the mean, is largest, located between
            output times.
        source : str
            A noise source, or 'combined'.
        quantity : {'std', 'variance', 'mean', 'mean_plus_3sigma', 'abs_mean_plus_3sigma'}
            The last is |mean| + 3 sigma, the larger of both sides; the one before is literal.
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
        from .present.progress import steps
        from .sensitivity.one import sensitivity

        self.require_linear_mean("a sensitivity")
        with steps("sensitivities"):
            return sensitivity(self, response, time, source, quantity, parameters, elasticity)

    def sensitivities(
        self,
        responses: Iterable[str] | None,
        times: Iterable[float],
        *,
        source: str = COMBINED,
        quantity: str = "std",
        parameters: Iterable[str] | None = None,
    ) -> xr.Dataset:
        """Return exact derivatives of many responses at many end times; what they share is computed once.

        Parameters
        ----------
        responses : iterable of str or None
            All with None.
        times : iterable of float
            End times t2, s.
        source, quantity, parameters
            As for :meth:`sensitivity`.

        Returns
        -------
        xarray.Dataset
            ``value`` (time, response) and ``derivative`` (time, response, parameter).

        Raises
        ------
        UnknownNameError, StructuralParameterError, TimeRangeError, DirectNoiseError, ZeroQuantityError
        """
        from .sensitivity.many import sensitivities

        self.require_linear_mean("a sensitivity")
        return sensitivities(self, responses, times, source, quantity, parameters)

    def second_derivatives(
        self,
        response: str,
        time: float | Literal["peak"],
        parameters: Iterable[str],
        *,
        source: str = COMBINED,
        quantity: str = "std",
    ) -> xr.Dataset:
        """Return the second derivatives of one number with respect to at most ten parameters.

        They are exact for the discretised variance and mean, as first derivatives are; what goes through the mean
        response in the noise columns is exact to the order of the method. At 'peak' the time is held: the second
        derivative of the maximum itself has a further part, by the shift of the peak.

        Parameters
        ----------
        response, time, source, quantity
            As for :meth:`sensitivity`.
        parameters : iterable of str

        Returns
        -------
        xarray.Dataset
            ``second_derivative`` (parameter, with_respect_to), symmetric, and ``derivative`` (parameter); the
            attribute ``asymmetry`` is how far both triangles were apart before, relative to the largest entry.

        Raises
        ------
        ParameterValueError
            For none or more than ten parameters.
        UnknownNameError, StructuralParameterError, TimeRangeError, DirectNoiseError, ZeroQuantityError
        """
        from .sensitivity.second import second_derivatives

        self.require_linear_mean("a second derivative")
        return second_derivatives(self, response, time, parameters, source, quantity)

    def check_gust_penetration(self, time: float) -> xr.Dataset:
        """Return sigma by the wind's sources with the equations' rational delays and with exact ones.

        Parameters
        ----------
        time : float
            t2, s.

        Returns
        -------
        xarray.Dataset
            ``rational`` and ``exact`` over (response, source), ``difference`` and ``agrees`` (within 1 %) by response.

        Raises
        ------
        DataError, NoVehicleError, TimeRangeError, IntegrationError
        """
        from .statistics.exact_penetration import check_gust_penetration

        return check_gust_penetration(self, time)

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

        Raises
        ------
        UnknownNameError, StructuralParameterError, TimeRangeError, DirectNoiseError, ZeroQuantityError
        """
        from .sensitivity.check import check_sensitivity

        self.require_linear_mean("a sensitivity")
        return check_sensitivity(self, response, time, source, quantity, parameters, rows)
