"""Reading a TOML file into a checked pydantic model, with errors that name the key and the nearest valid one."""

from __future__ import annotations

import tomllib
import unicodedata
from collections.abc import Mapping, Sequence
from copy import deepcopy
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, ValidationInfo, field_validator
from pydantic_core import ErrorDetails

from ..errors import DataError, DataErrorCollector, suggestion
from .folder_files import OwnPath
from .text_file import read_text


def _whole(value: Any) -> Any:
    """Return 1e4 as 10000; what is no whole number stays and is refused by its type."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Whole = Annotated[int, BeforeValidator(_whole)]
CONTROL = ("Cc", "Cs")  # of Unicode: control characters, half pairs
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class Section(BaseModel):
    """A table of a TOML file: unknown keys are refused, and every value must have the type of its key.

    Neither ``true`` nor ``"0.005"`` is a number, neither 1 nor ``"yes"`` is true.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    @field_validator("*", mode="before")
    @classmethod
    def _as_written(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse True where Python takes it for the 1 of a choice, and text that files and figures cannot hold."""
        annotation = cls.model_fields[str(info.field_name)].annotation
        if isinstance(value, bool) and get_origin(annotation) is Literal:
            raise ValueError(f"should be {' or '.join(map(str, get_args(annotation)))}")
        for text in value if isinstance(value, tuple) else (value,):
            if isinstance(text, str) and any(unicodedata.category(c) in CONTROL and c not in "\n\t" for c in text):
                raise ValueError("holds a control character; remove it")
        return value


File = TypeVar("File", bound=Section)


def read_toml(
    file: Path,
    model: type[File],
    changes: Mapping[str, Any] | None = None,
    collector: DataErrorCollector | None = None,
) -> File:
    """Read and check a TOML file.

    Parameters
    ----------
    file : Path
    model : type
        Its pydantic model.
    changes : mapping, optional
        Values to put in the place of the file's, by dotted key; items of a list count from 0.
    collector : DataErrorCollector, optional
        Keeps what is wrong with keys, where the file without them, misspelt ones by the names that they mean, still
        says enough for the other files to be looked at; then this is what is returned.

    Raises
    ------
    DataError
        The file, the key in it, what is wrong and the nearest valid key.
    """
    try:
        data = tomllib.loads(read_text(file))
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"is not valid TOML: {error}", file=file) from None
    except ValueError as error:  # an integer of thousands of digits
        raise DataError(f"holds a number that cannot be read ({error})", file=file) from None
    except RecursionError:
        raise DataError("nests lists or tables too deep; the deepest here has a handful of levels", file=file) from None
    for dotted, value in (changes or {}).items():
        _put(data, dotted, _own(value), file)
    try:
        return validated(data, model, file)
    except DataError as error:
        mended = None if collector is None else _mended(data, model)
        if collector is None or mended is None:
            raise
        with collector.part():
            raise error
        return mended


def validated(data: Mapping[str, Any], model: type[File], file: Path | None = None) -> File:
    """Check the contents of a TOML file, or the same given in Python, where paths are the user's own.

    Raises
    ------
    DataError
    """
    try:
        return model.model_validate(_plain(data) if file is not None else _own(_plain(data)))
    except ValidationError as error:
        found = _told_once(error.errors())
    except RecursionError:
        raise DataError("nests lists or tables too deep; the deepest here has a handful of levels", file=file) from None
    collector = DataErrorCollector()
    collector.errors = [_data_error(e, model, file) for e in found]
    collector.raise_all()
    raise AssertionError("an invalid file without an error")


def _mended(data: Mapping[str, Any], model: type[File]) -> File | None:
    """Return a file without the keys at fault, misspelt ones by the missing names they mean; None if that fails."""
    try:
        mended = deepcopy(dict(data))
        try:
            return model.model_validate(_plain(mended))
        except ValidationError as error:
            errors = error.errors()
        for e in errors:
            *path, last = e["loc"]
            while path and not isinstance(last, str):  # an item of a list goes with all of them
                last = path.pop()
            inner = _inside(mended, path)
            if e["type"] == "missing" or not isinstance(inner, dict) or last not in inner:
                continue
            value = inner.pop(last)
            if e["type"] == "extra_forbidden":
                missing = [str(m["loc"][-1]) for m in errors if m["type"] == "missing" and [*m["loc"][:-1]] == path]
                inner |= dict.fromkeys(get_close_matches(str(last), missing, n=1, cutoff=0.5), value)
        return model.model_validate(_plain(mended))
    except (ValidationError, RecursionError):
        return None


def _inside(data: Any, path: Sequence[int | str]) -> Any:
    """Return what stands at a path, None where nothing does."""
    for part in path:
        known: dict[Any, Any] = (
            data if isinstance(data, dict) else dict(enumerate(data)) if isinstance(data, list) else {}
        )
        if part not in known:
            return None
        data = known[part]
    return data


def _told_once(errors: list[ErrorDetails]) -> list[ErrorDetails]:
    """Return errors, misspelt keys first; the key that is missing for each of them is not told beside it."""
    misspelt = [e for e in errors if e["type"] == "extra_forbidden"]
    meant = set()
    for e in misspelt:
        missing = {
            str(m["loc"][-1]): m["loc"] for m in errors if m["type"] == "missing" and m["loc"][:-1] == e["loc"][:-1]
        }
        meant |= {missing[near] for near in get_close_matches(str(e["loc"][-1]), missing, n=1, cutoff=0.5)}
    return misspelt + [e for e in errors if e["type"] != "extra_forbidden" and e["loc"] not in meant]


def _data_error(error: ErrorDetails, model: type[Section], file: Path | None) -> DataError:
    location = [str(part) for part in error["loc"]]
    if error["type"] == "extra_forbidden":
        why = f"is not a key here{suggestion(location[-1], _keys_at(model, location[:-1]))}"
    elif error["type"] == "missing":
        why = "is missing; add it"
    else:
        why = str(error["msg"]).removeprefix("Value error, ").replace("valid tuple", "valid list")
        if not isinstance(error["input"], dict | tuple):
            why += f" (found {_short(error['input'])})"
    return DataError(why, file=file, column=".".join(part[:60] for part in location) or None)


def _short(value: object) -> str:
    try:
        text = repr(value)
    except ValueError:
        return "an integer of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _plain(value: Any) -> Any:
    """Return lists as tuples and NumPy's numbers as Python's, for the strict types of a section."""
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return tuple(_plain(item) for item in value) if isinstance(value, list | tuple) else value


def _own(value: Any) -> Any:
    """Return a value whose texts, if they turn out to be paths, may lead anywhere."""
    if isinstance(value, Mapping):
        return {key: _own(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_own(item) for item in value)
    return OwnPath(value) if isinstance(value, str) else value


def _put(data: dict[str, Any], dotted: str, value: Any, file: Path) -> None:
    """Set a value by dotted key; sections that are missing are made, and checked with the rest."""
    *path, last = dotted.split(".")
    inner: Any = data
    for part in path:
        inner = _item(inner, part, dotted, file) if isinstance(inner, list) else inner.setdefault(part, {})
        if not isinstance(inner, dict | list):
            raise DataError(f"has no key '{last}': it is a value, not a section", file=file, column=dotted)
    if isinstance(inner, list):
        _item(inner, last, dotted, file)
        inner[int(last)] = value
    else:
        inner[last] = value


def _item(items: list[Any], index: str, dotted: str, file: Path) -> Any:
    if not index.isdigit() or int(index) >= len(items):
        raise DataError(
            f"'{index}' is not an item of a list of {len(items)}; count from 0 to {len(items) - 1}",
            file=file,
            column=dotted,
        )
    return items[int(index)]


def _keys_at(model: type[BaseModel], path: list[str]) -> list[str]:
    """Return the keys allowed at a path of the file, following nested models."""
    for part in path:
        if part.isdigit() or part not in model.model_fields:
            continue
        annotation = model.model_fields[part].annotation
        stack = [annotation]
        while stack:
            candidate = stack.pop()
            if isinstance(candidate, type) and issubclass(candidate, BaseModel):
                model = candidate
                break
            stack.extend(getattr(candidate, "__args__", ()))
    return list(model.model_fields)
