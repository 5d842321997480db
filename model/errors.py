"""Typed errors and warnings: each says where, why and what to do about it."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

Part = TypeVar("Part")


class AscentwindError(Exception):
    """Base of every error that ascentwind raises on purpose.

    Its message and attributes travel between processes, whatever its class asks for when it is made.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        return _made_again, (type(self), self.args, self.__dict__)


def _made_again(kind: type[AscentwindError], args: tuple[Any, ...], attributes: dict[str, Any]) -> AscentwindError:
    """Return an error as it was, without another call of its constructor, whose arguments are not those kept."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(attributes)
    return error


class DataError(AscentwindError):
    """A vehicle file holds something that cannot be used.

    Parameters
    ----------
    why : str
        What is wrong and what to do about it.
    file : path, optional
    column : str, optional
        Column of a table or key of a TOML file.
    row : int, optional
        Line number in the file, counted from 1 as an editor does.
    time : float, optional
        Flight time in seconds.
    """

    def __init__(
        self,
        why: str,
        *,
        file: str | Path | None = None,
        column: str | None = None,
        row: int | None = None,
        time: float | None = None,
    ):
        self.why, self.file, self.column, self.row, self.time = why, file, column, row, time
        where = [str(file)] if file is not None else []
        if column is not None:
            where.append(f"column '{column}'")
        if row is not None:
            where.append(f"line {row}")
        if time is not None:
            where.append(f"t = {time:g} s")
        super().__init__(f"{', '.join(where)}: {why}" if where else why)


class MissingLibraryError(DataError):
    """A file or a page needs a library that is not installed."""


class SeveralDataErrors(DataError):
    """Several things that cannot be used, told together; the place is that of the first.

    Parameters
    ----------
    errors : iterable of DataError
    """

    SHOWN = 20

    def __init__(self, errors: Iterable[DataError]):
        self.errors = tuple(errors)
        first, more = self.errors[0], len(self.errors) - self.SHOWN
        super().__init__(first.why, file=first.file, column=first.column, row=first.row, time=first.time)
        told = [str(error) for error in self.errors[: self.SHOWN]]
        self.args = ("\n".join(told + ([f"and {more} more"] if more > 0 else [])),)


class DataErrorCollector:
    """Keeps the errors of parts that do not need each other, to raise them together."""

    def __init__(self):
        self.errors: list[DataError] = []

    @contextmanager
    def part(self) -> Iterator[None]:
        """Keep the error with which a part ends."""
        try:
            yield
        except SeveralDataErrors as several:
            self.errors += several.errors
        except DataError as error:
            self.errors.append(error)

    def take(self, read: Callable[[], Part]) -> Part:
        """Return what a part gives; after an error, which is kept, what is returned must not be used."""
        with self.part():
            return read()
        return cast("Part", None)

    def raise_all(self) -> None:
        """Raise what was kept, if anything.

        Raises
        ------
        DataError
            The only one, or a ``SeveralDataErrors``.
        """
        once = list({str(error): error for error in self.errors}.values())
        if len(once) == 1:
            raise once[0]
        if once:
            raise SeveralDataErrors(once)


class TimeRangeError(AscentwindError):
    """A time was asked for that the flight or its tables do not cover."""


class PlanesError(AscentwindError):
    """Something was asked of a vehicle in planes that it is not known for.

    Parameters
    ----------
    what : str
        Begins the sentence.
    vehicle : str
    plane : str, optional
        The only one that it is known for.
    """

    def __init__(self, what: str, vehicle: str, plane: str = ""):
        alone = f"the {plane} plane alone" if plane else "one plane alone"
        choice = f'planes = "{plane}"' if plane else 'planes = "yaw" or planes = "pitch"'
        super().__init__(f"{what} is known for {alone}, which is not how '{vehicle}' flies; ask it of {choice}")

    @classmethod
    def of_one(cls, what: str, system: str) -> PlanesError:
        """Return the error of what needs both planes and is asked of one."""
        error = cls(what, system)
        error.args = (f"{what} is of both planes, and '{system}' has one alone; set planes = \"both\"",)
        return error


class DirectNoiseError(AscentwindError):
    """White noise reaches an output directly, so that its variance would be infinite."""


class SystemDefinitionError(AscentwindError):
    """A linear system of one's own is defined in a way that cannot be used."""


class NotPicklableError(AscentwindError, TypeError):
    """Symbols and compiled code do not travel between processes; the data that they are made from do."""


class NonlinearSystemError(SystemDefinitionError):
    """An expression given for a linear system is not linear in its states and inputs."""


class SwitchError(AscentwindError):
    """A condition on time in the equations cannot be located, or not be differentiated where it switches."""


class SingularCouplingError(AscentwindError):
    """The mass matrix that couples bending and slosh cannot be inverted."""


class ModeError(AscentwindError):
    """A bending mode cannot be normalised, or not be followed from one time to the next."""


class IntegrationError(AscentwindError):
    """An integrator gave up before the end of the interval."""


class StepBudgetError(IntegrationError):
    """An integration would take more steps than a vehicle needs: something in it is far too fast.

    Parameters
    ----------
    steps : int
        More are needed.
    where : str
        Where the integration stood, such as 't = 12 s'.
    time : float, optional
        The same as a flight time, s.
    fastest : str, optional
        The fastest root there and the states that take part in it.
    """

    def __init__(self, steps: int, where: str, *, time: float | None = None, fastest: str | None = None):
        self.steps, self.where, self.time, self.fastest = steps, where, time, fastest
        why = f"the fastest root there is {fastest}" if fastest else "something in the system is far too fast"
        super().__init__(
            f"the integration needs more than {steps:,} steps and was ended at {where}; {why}: look for swapped "
            "columns or a wrong unit in what makes it (frequency, mass, damping, gain, filter)"
        )


class OutputFolderError(AscentwindError):
    """Results cannot be written where they were asked for."""


class UnusedOptionError(AscentwindError):
    """An option was given that would change nothing."""


class UnknownNameError(AscentwindError):
    """A name is not known; the nearest valid one is offered."""

    def __init__(self, kind: str, name: str, known: Iterable[str]):
        self.kind, self.name, self.known = kind, name, tuple(known)
        super().__init__(f"there is no {kind} '{name}'{suggestion(name, self.known)}")


class NoVehicleError(UnknownNameError):
    """Something was asked of a system of one's own that only a vehicle has."""

    def __init__(self, what: str, system: str):
        self.kind, self.name, self.known = "vehicle", system, ()
        Exception.__init__(self, f"{what} asks for a vehicle, and '{system}' is a system of one's own: use Study.load")


class ParameterValueError(AscentwindError, ValueError):
    """A parameter was given a value that the equations cannot use."""


class AscentwindWarning(UserWarning):
    """Base of every warning that ascentwind gives."""


class DeprecatedNameWarning(AscentwindWarning):
    """A name that goes with the next release was used; its successor is named."""


class UnstableSystemWarning(AscentwindWarning):
    """The closed loop, frozen at some time, has a root in the right half plane."""


class ExtrapolationWarning(AscentwindWarning):
    """Values beyond the end of a table were needed and held constant."""


class PlausibilityWarning(AscentwindWarning):
    """Two statements of a vehicle's files hardly go together."""


class WindWarning(AscentwindWarning):
    """Mean, standard deviation and filter of a wind seem to be of different winds, or nobody can tell."""


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return '; did you mean ...?' or a short list of what is known."""
    known = list(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if near:
        return f"; did you mean '{near[0]}'?"
    return f"; known: {', '.join(known[:12])}{', ...' if len(known) > 12 else ''}" if known else ""
