"""Shaping filters in files: JSON with the altitude samples, the three matrices and the start covariance."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError
from ..files.text_file import read_text
from ..tables import Table
from .record import COMPONENTS, WindOrigin
from .shaping_filter import ShapingFilter
from .two_components import TwoComponentFilter

FORMAT = 1
KEYS = ("altitude_m", "F_per_m", "G_per_root_m", "H_m_per_s", "start_covariance", "kinks_m")


def filter_text(shaping_filter: ShapingFilter) -> str:
    """Return a filter as JSON; numbers keep all their digits."""
    f = shaping_filter
    arrays = (f.altitude, f.F, f.G, f.H, f.start_covariance, np.array(f.kinks))
    head: dict[str, object] = {"format": FORMAT, "name": f.name, "source": f.source}
    if f.origin is not None:
        head["origin"] = asdict(f.origin)
    lines = [f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in head.items()]
    lines += [f"  {json.dumps(k)}: {json.dumps(a.tolist())}" for k, a in zip(KEYS, arrays, strict=True)]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def two_component_filter_text(filters: TwoComponentFilter) -> str:
    """Return the filters of both components, and what joins them, as JSON; numbers keep all their digits."""
    r = filters.noise_correlation
    parts = [
        f'"{name}": {filter_text(f).rstrip()}'
        for name, f in zip(COMPONENTS, (filters.zonal, filters.meridional), strict=True)
    ]
    joined = json.dumps({"altitude_m": r.argument.tolist(), "value": r.values.tolist()})
    parts += [f'"noise_correlation": {joined}', f'"start_correlation": {json.dumps(filters.start_correlation)}']
    return f'{{"format": {FORMAT},\n' + ",\n".join(parts) + "\n}\n"


def read_filter(file: Path) -> ShapingFilter:
    """Read a filter of one component.

    Raises
    ------
    DataError
        The file and what is wrong with it.
    """
    with _told(file):
        return _filter(_data(file))


def read_two_component_filter(file: Path) -> TwoComponentFilter:
    """Read the filters of both components.

    Raises
    ------
    DataError
        The file and what is wrong with it.
    """
    with _told(file):
        data = _data(file)
        if "zonal" not in data and "F_per_m" in data:
            raise DataError("holds one component; 'ascentwind wind apply --components both' writes both")
        zonal, meridional = (_filter(_section(data, name)) for name in COMPONENTS)
        joined = _section(data, "noise_correlation")
        altitude, value = (_numbers(joined[key], key) for key in ("altitude_m", "value"))
        start = _numbers(data["start_correlation"], "start_correlation")
        return TwoComponentFilter(
            zonal, meridional, Table("wind.noise_correlation", "1", altitude, value, "linear"), float(start)
        )


@contextmanager
def _told(file: Path) -> Iterator[None]:
    """Say of which file an error is."""
    try:
        yield
    except KeyError as error:
        raise DataError(f"lacks {error}; write filters with 'ascentwind wind fit'", file=file) from None
    except (ValueError, TypeError, AttributeError, IndexError, OverflowError) as error:
        raise DataError(f"is not a wind filter: {error}", file=file) from None
    except RecursionError:
        raise DataError("nests lists too deep; write filters with 'ascentwind wind fit'", file=file) from None
    except DataError as error:
        raise DataError(error.why, file=file) from None


def _data(file: Path) -> dict[str, Any]:
    data = json.loads(read_text(file), object_pairs_hook=_each_once, parse_constant=_no_number)
    if data.get("format") != FORMAT or isinstance(data["format"], bool):
        raise DataError(f"has format {data.get('format')!r}; this version reads {FORMAT}")
    return data


def _section(data: dict[str, Any], key: str) -> dict[str, Any]:
    if not isinstance(data[key], dict):
        raise ValueError(f"'{key}' is no section")
    return data[key]


def _filter(data: dict[str, Any]) -> ShapingFilter:
    altitude, F, G, H, start, kinks = (_numbers(data[k], k) for k in KEYS)
    return ShapingFilter(
        str(data["name"]), altitude, F, G, H, start, tuple(kinks.tolist()), str(data["source"]), _origin(data)
    )


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of the file; what stands twice is refused, for JSON would take the last."""
    keys = [key for key, _ in pairs]
    for key in keys:
        if keys.count(key) > 1:
            raise ValueError(f"'{key}' stands twice; keep one")
    return dict(pairs)


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is not a finite number")


def _numbers(value: Any, key: str) -> NDArray[np.float64]:
    """Return an array of a file; NumPy would take true and "1" for numbers."""
    items = [value]
    while items:
        item = items.pop()
        if isinstance(item, list):
            items += item
        elif isinstance(item, bool) or not isinstance(item, int | float) or not math.isfinite(item):
            raise ValueError(f"'{key}' holds {json.dumps(item)[:40]}, which is not a finite number")
    return np.array(value, float)


def _origin(data: dict[str, dict[str, str]]) -> WindOrigin | None:
    return None if "origin" not in data else WindOrigin(**{key: str(value) for key, value in data["origin"].items()})
