"""What the front door offers says what it takes, gives and refuses, by numpydoc's sections; its examples are run."""

from __future__ import annotations

import builtins
import doctest
import inspect
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from typing import Any

import pytest

import ascentwind as aw

UNDERLINED = re.compile(r"^(\w[\w ]*)\n-{3,}$", re.MULTILINE)
# a unit, in words that there is none, or where it stands
UNIT = re.compile(
    r"As for|As there|\b(s|h|m|kg|N|rad|deg|Hz|SI|seconds|relative|probability|unit|share|factor)\b", re.IGNORECASE
)


def sections(text: str) -> dict[str, str]:
    """Return the sections of a docstring by their headings; the summary and what follows it under ''."""
    parts = UNDERLINED.split(inspect.cleandoc(text))
    return dict(zip(["", *parts[1::2]], parts[::2], strict=True))


def entries(section: str) -> dict[str, str]:
    """Return what a section says by name; names that share an entry (``start, end : float``) have it each."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in section.strip("\n").splitlines():
        if line and not line.startswith(" "):
            head, _, kind = line.partition(" : ")
            names = [n.strip().lstrip("*") for n in head.split(",")]
            found |= dict.fromkeys(names, kind)
        else:
            found |= {n: f"{found[n]} {line.strip()}" for n in names}
    return found


def own(thing: Any) -> bool:
    return getattr(thing, "__module__", "").startswith("ascentwind.")


def offered() -> Iterator[tuple[str, Any]]:
    """Yield every public function, class and method behind the front door, methods of base classes of ours last."""
    for name in sorted(dir(aw)):
        thing = getattr(aw, name)
        if not callable(thing):
            continue
        yield name, thing
        for base in thing.__mro__ if inspect.isclass(thing) else ():
            for member, value in vars(base).items() if own(base) else ():
                value = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value
                if inspect.isfunction(value) and not member.startswith("_"):
                    yield f"{name}.{member}", value


OFFERED = dict(reversed(list(offered())))  # a method that a class has itself stands for that of its base class


def asked(thing: Any) -> dict[str, inspect.Parameter]:
    """Return the parameters that a caller gives; of a class, where it is made by its fields."""
    if inspect.isclass(thing) and not is_dataclass(thing):
        return {}
    given = inspect.signature(thing).parameters
    return {n: p for n, p in given.items() if n not in ("self", "cls") and not n.startswith("_")}


def faults(thing: Any) -> list[str]:
    found, said = sections(inspect.getdoc(thing) or ""), []  # a method without one has that of its base class
    if not found[""].strip():
        return ["it has no docstring"]
    parameters = asked(thing)
    told = entries(found.get("Parameters", "") + "\n" + found.get("Attributes", ""))
    said += [f"'{name}' is not among its Parameters" for name in parameters if name not in told]
    for name, parameter in parameters.items():
        plain = re.fullmatch(r"(Iterable\[)?float\]?( \| .*)?", str(parameter.annotation))
        if plain and name in told and not UNIT.search(told[name]):
            said.append(f"'{name}' has no unit")
    if inspect.isclass(thing):
        return said
    result = str(inspect.signature(thing).return_annotation)
    if parameters and result not in ("None", "Self") and "Returns" not in found and "Yields" not in found:
        said.append(f"it does not say what it returns ({result})")
    if len(parameters) > 1 and "Raises" not in found:
        said.append("it does not say what it raises")
    known = vars(builtins).keys() | set(dir(aw.errors))
    for kind in ("Raises", "Warns"):
        said += [f"{n} is no error of ascentwind.errors" for n in entries(found.get(kind, "")) if n not in known]
    return said


@pytest.mark.parametrize("name", OFFERED)
def test_parameters_returns_units_and_errors_are_told(name):
    assert faults(OFFERED[name]) == []


def test_what_is_not_told_is_found():
    def told(time: float, width: float = 1.0) -> float:
        """Return a width at a time.

        Parameters
        ----------
        time, width : float
            In s and m.

        Returns
        -------
        float

        Raises
        ------
        DataError
        """
        return time * width

    def untold(time: float, width: float = 1.0) -> float:
        """Return a width at a time.

        Parameters
        ----------
        time : float
            When.

        Raises
        ------
        NoSuchError
        """
        return time * width

    assert faults(told) == []
    assert faults(untold) == [
        "'width' is not among its Parameters",
        "'time' has no unit",
        "it does not say what it returns (float)",
        "NoSuchError is no error of ascentwind.errors",
    ]


@pytest.mark.parametrize("name", ["Study", "define_system"])
def test_examples_give_what_they_say(name, cache):
    thing = getattr(aw, name)
    (example,) = doctest.DocTestFinder(recurse=False).find(thing, name, globs={name: thing, "aw": aw})
    assert example.examples and any(e.want for e in example.examples)
    said: list[str] = []
    assert doctest.DocTestRunner().run(example, out=said.append).failed == 0, "".join(said)
