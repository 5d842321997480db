"""What a parameter study's TOML file may hold: a grid, one parameter at a time, or a dispersion."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from ...model.errors import DataError, TimeRangeError
from ...model.files.folder_files import FileName
from ...model.files.toml_file import Section, Whole, read_toml, validated
from ..case.times import parse_times
from ..solvers.sweep import LEAST_TOLERANCE
from ..solvers.tolerances import LARGEST_TOLERANCE

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
QuantityName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.]*$")]
Names = Annotated[tuple[str, ...], Field(min_length=1)]
Kind = Literal["grid", "one_at_a_time", "dispersion"]

MOST = 10_000_000  # members: more would fill the memory before their size is known


class PlannedQuantity(Section):
    """A number that the study varies.

    It stands for one parameter, for a factor on a table ('tables.NAME', nominal value 1), or for several that move
    together. With ``relative`` its numbers are factors of the nominal value, 1.1 for 10 % more.
    """

    name: QuantityName
    parameters: tuple[str, ...] = ()
    relative: bool = False

    @property
    def targets(self) -> tuple[str, ...]:
        """The parameters and tables behind the quantity."""
        return self.parameters or (self.name,)


class GridQuantity(PlannedQuantity):
    """``values``, or ``linspace = [first, last, count]``."""

    values: tuple[Finite, ...] = ()
    linspace: tuple[Finite, Finite, Annotated[Whole, Field(ge=2, le=MOST)]] | None = None

    @model_validator(mode="after")
    def _one_list(self) -> Self:
        if bool(self.values) == (self.linspace is not None):
            raise ValueError("needs either values = [...] or linspace = [first, last, count]")
        if len(set(self.values)) < len(self.values):
            twice = next(v for i, v in enumerate(self.values) if v in self.values[:i])
            raise ValueError(f"has the value {twice:g} twice; keep each once")
        return self

    @property
    def count(self) -> int:
        """How many values it has."""
        return len(self.values) if self.linspace is None else self.linspace[2]

    def axis(self) -> list[float]:
        """Return the values."""
        if self.linspace is None:
            return list(self.values)
        first, last, count = self.linspace
        return np.linspace(first, last, count).tolist()


class SweptQuantity(PlannedQuantity):
    """``low`` and ``high``, or ``plus_minus`` about the nominal value."""

    low: Finite | None = None
    high: Finite | None = None
    plus_minus: Positive | None = None

    @model_validator(mode="after")
    def _one_range(self) -> Self:
        _check_range(self.low, self.high, self.plus_minus)
        return self


class DispersedQuantity(PlannedQuantity):
    """A random quantity; ``mean`` is the nominal value where it is not given."""

    distribution: Literal["normal", "truncated_normal", "uniform"]
    mean: Finite | None = None
    sigma: Positive | None = None
    low: Finite | None = None
    high: Finite | None = None
    plus_minus: Positive | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.distribution == "uniform":
            if self.sigma is not None or self.mean is not None:
                raise ValueError("is uniform and takes low and high, or plus_minus; remove sigma and mean")
        elif self.sigma is None:
            raise ValueError(f"is {self.distribution} and needs a sigma above zero")
        if self.distribution != "normal":
            _check_range(self.low, self.high, self.plus_minus)
        elif not self.low is self.high is self.plus_minus is None:
            raise ValueError('is normal, without limits; take "truncated_normal", or remove low, high and plus_minus')
        return self


def _check_range(low: float | None, high: float | None, plus_minus: float | None) -> None:
    if (low is None) != (high is None) or (low is None) == (plus_minus is None):
        raise ValueError("needs either low and high, or plus_minus")
    if low is not None and high is not None and low >= high:
        raise ValueError(f"has low = {low:g}, which is not below high = {high:g}")


class Correlation(Section):
    """Correlation of the normal scores of two quantities."""

    between: tuple[str, str]
    coefficient: Annotated[float, Field(gt=-1, lt=1)]


class Grid(Section):
    """All combinations; the last quantity varies fastest."""

    quantity: Annotated[tuple[GridQuantity, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _not_too_many(self) -> Self:
        members = prod(q.count for q in self.quantity)
        if members > MOST:
            raise ValueError(f"has {members} combinations, more than {MOST}; take fewer values")
        return self


class OneAtATime(Section):
    """Each quantity at its low and at its high value, the others nominal."""

    quantity: Annotated[tuple[SweptQuantity, ...], Field(min_length=1)]


class Dispersion(Section):
    """Random members."""

    members: Annotated[Whole, Field(ge=2, le=MOST)]
    seed: Annotated[Whole, Field(ge=0)]
    sampling: Literal["random", "latin_hypercube", "sobol"] = "latin_hypercube"
    quantity: Annotated[tuple[DispersedQuantity, ...], Field(min_length=1)]
    correlation: tuple[Correlation, ...] = ()


class ParameterStudyPlan(Section):
    """The whole TOML file.

    ``times`` are the vehicle's ``default_times``, ``responses``, resultants of both planes among them, and ``sources``
    all of them where they are not given. With ``probability``, 1 - Phi(3) without it, a resultant passes its level.
    """

    format: Literal[1]
    title: str
    vehicle: FileName | None = None
    times: str | None = None
    responses: Names | None = None
    sources: Names | None = None
    relative_tolerance: Annotated[float, Field(ge=LEAST_TOLERANCE, le=LARGEST_TOLERANCE)] = 1e-4
    probability: Annotated[float, Field(gt=0, lt=1)] | None = None
    grid: Grid | None = None
    one_at_a_time: OneAtATime | None = None
    dispersion: Dispersion | None = None

    @field_validator("times")
    @classmethod
    def _readable(cls, text: str | None) -> str | None:
        try:
            if text is not None:
                parse_times(text)
        except TimeRangeError as error:
            raise ValueError(str(error)) from None
        return text

    @field_validator("responses", "sources")
    @classmethod
    def _once(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        return names and tuple(dict.fromkeys(names))

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if sum(part is not None for part in (self.grid, self.one_at_a_time, self.dispersion)) != 1:
            raise ValueError("needs exactly one of [grid], [one_at_a_time] and [dispersion]")
        names = [q.name for q in self.quantities]
        repeated = sorted({n for n in names if names.count(n) > 1})
        if repeated:
            raise ValueError(f"has two quantities named '{repeated[0]}'; rename one")
        return self

    def named_vehicle(self) -> str:
        """Return the vehicle that the plan names.

        Raises
        ------
        DataError
            It names none.
        """
        if self.vehicle is None:
            raise DataError("is missing; name a shipped vehicle or a vehicle folder, or give a study", column="vehicle")
        return self.vehicle

    @property
    def kind(self) -> Kind:
        """Which of the three tables the plan has."""
        if self.grid is not None:
            return "grid"
        return "dispersion" if self.dispersion is not None else "one_at_a_time"

    @property
    def quantities(self) -> tuple[PlannedQuantity, ...]:
        """What is varied."""
        part = self.grid or self.one_at_a_time or self.dispersion
        assert part is not None  # checked by _one_kind
        return part.quantity


def read_plan(source: str | Path | Mapping[str, Any] | ParameterStudyPlan) -> ParameterStudyPlan:
    """Return a plan from a TOML file, from a mapping of the same form, or as it is.

    A ``vehicle`` that is a folder beside the TOML file is found from there.

    Raises
    ------
    DataError
        The file, the key in it, what is wrong and the nearest valid key.
    """
    if isinstance(source, ParameterStudyPlan):
        return source
    if isinstance(source, Mapping):
        return validated(source, ParameterStudyPlan)
    file = Path(source)
    plan = read_toml(file, ParameterStudyPlan)
    if plan.vehicle is None:
        raise DataError("is missing; name a shipped vehicle or a vehicle folder", file=file, column="vehicle")
    beside = file.parent / plan.vehicle
    return plan.model_copy(update={"vehicle": str(beside)}) if beside.is_dir() else plan
