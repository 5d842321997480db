"""The engines by name, the choice among them, and the statistics by the one that is chosen."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import fields
from typing import TypeVar

import numpy as np

from ...model.deprecation import warn_deprecated
from ...model.errors import AscentwindWarning, IntegrationError, UnknownNameError
from ..case.case import Case
from ..case.times import end_times
from ..solvers.stability import warn_if_unstable
from ..solvers.sweep import available_sweep
from .covariance import CovarianceEquation
from .cvodes import Cvodes
from .engine import Engine, Progress, relative_difference
from .ensemble import Ensemble
from .results import ResponseStatistics
from .sweep import Sweep

ENGINES: dict[str, type[Sweep | Cvodes | CovarianceEquation | Ensemble]] = {
    engine.name: engine for engine in (Sweep, Cvodes, CovarianceEquation, Ensemble)
}


E = TypeVar("E", Sweep, Cvodes)


class UncheckedStatisticsWarning(AscentwindWarning):
    """A finer discretisation, asked for as a check, could not be computed; the difference to it is infinite."""


def find_engine(engine: str | Engine) -> Engine:
    """Return an engine, by name with its defaults.

    Raises
    ------
    UnknownNameError
        With the nearest name.
    IntegrationError
        What was given is no engine.
    """
    if isinstance(engine, str):
        if engine not in ENGINES:
            raise UnknownNameError("engine", engine, ENGINES)
        return ENGINES[engine]()
    if isinstance(engine, type) or not isinstance(engine, Engine):
        made = ", ".join(f"{e.__name__}()" for e in ENGINES.values())
        raise IntegrationError(f"{engine!r:.60} is no engine; give a name ({', '.join(ENGINES)}) or {made}")
    return engine


def engine_as(kind: type[E], engine: str | Engine | None, default: E, what: str) -> E:
    """Return the engine of the one kind that a question is answered by.

    Parameters
    ----------
    kind : type
        Sweep or Cvodes.
    engine : str or Engine, optional
        The default without it or by its name.
    what : str
        The question, for the error.

    Raises
    ------
    UnknownNameError, IntegrationError
    """
    if engine is None or engine == getattr(default, "name", None):
        return default
    found = find_engine(engine)
    if not isinstance(found, kind):
        raise IntegrationError(f"{what} by {kind.__name__} alone, not by {type(found).__name__}")
    return found


def engine_from(name: str | None, *, compiled: bool = True, **settings: object) -> Engine | None:
    """Return the engine that a person named, with settings; None leaves the choice to the case.

    ``method`` alone means CVODES, and ``relative_tolerance`` alone the sweep, or CVODES where nothing is compiled.

    Raises
    ------
    UnknownNameError, IntegrationError
    """
    given = {key: value for key, value in settings.items() if value is not None}
    if name is None and given:
        name = Cvodes.name if "method" in given or not compiled else Sweep.name
    if name is None:
        return None
    takes = {field.name for field in fields(find_engine(name))}  # type: ignore[arg-type]
    for key in given:
        if key not in takes:
            raise IntegrationError(f"engine '{name}' takes no {key.replace('_', ' ')}; it takes {', '.join(takes)}")
    return ENGINES[name](**given)  # type: ignore[arg-type]


def engine_with_covariances(case: Case) -> str:
    """Return the engine that gives covariances between responses: the sweep or, where nothing is compiled, another."""
    return CovarianceEquation.name if case.executable.shared_library is None else Sweep.name


def engine_of_options(engine: str | Engine | None, options: object | None) -> str | Engine | None:
    """Return what the old argument ``options`` stood for: an engine is its own options now.

    Raises
    ------
    IntegrationError
        The options belong to another engine than the one that is named.
    """
    if options is None:
        return engine
    warn_deprecated("the argument 'options'", "engine=..., an engine with its options, such as Sweep(1e-9)")
    found = find_engine(options)  # type: ignore[arg-type]
    if engine is not None and find_engine(engine).name != found.name:
        named = find_engine(engine).name
        raise IntegrationError(f"engine '{named}' takes no {type(found).__name__}; leave one of them out")
    return found


def chosen_engine(case: Case, engine: str | Engine | None) -> Engine:
    """Return the engine asked for; without one the sweep, or CVODES where that cannot be compiled."""
    if engine is None:
        return Cvodes() if available_sweep(case.executable) is None else Sweep()
    return find_engine(engine)


def response_statistics(
    case: Case,
    times: Iterable[float],
    *,
    responses: Iterable[str] | None = None,
    engine: str | Engine | None = None,
    check: bool = False,
    progress: Progress | None = None,
) -> ResponseStatistics:
    """Run an engine; with ``check`` a second time, finer, and keep the relative difference of the std.

    Parameters
    ----------
    case : Case
    times, responses, engine, check, progress
        As of :meth:`ascentwind.Study.response_statistics`.

    Raises
    ------
    TimeRangeError, UnknownNameError, DirectNoiseError, IntegrationError

    Warns
    -----
    UnstableSystemWarning, UncheckedStatisticsWarning
    """
    ends, wanted = case.checked_times(end_times(times)), case.checked_responses(responses)
    warn_if_unstable(case.executable, ends[-1])
    chosen = chosen_engine(case, engine)
    found = chosen.compute(case, ends, wanted, progress)
    if check:
        difference = np.full(found["std"].shape, np.inf)
        try:
            finer = chosen.finer(ends[-1] - case.system.start).compute(case, ends, wanted)
            difference = relative_difference(found["std"].values, finer["std"].values)
        except IntegrationError as error:
            text = f"the statistics could not be checked by a finer discretisation, and none is known to hold: {error}"
            warnings.warn(UncheckedStatisticsWarning(text), stacklevel=3)
        found["discretisation_difference"] = (
            found["std"].dims,
            difference,
            {"units": "1", "long_name": "std against a finer discretisation, relative"},
        )
    return ResponseStatistics(found)
