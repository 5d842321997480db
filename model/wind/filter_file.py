"""Shaping filters in files: JSON with the altitude samples, the three matrices and the start covariance."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError
from ..files.text_file import read_text
from .record import WindOrigin
from .shaping_filter import ShapingFilter

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


def read_filter(file: Path) -> ShapingFilter:
    """Read a filter.

    Raises
    ------
    DataError
        The file and what is wrong with it.
    """
    try:
        data = json.loads(read_text(file), object_pairs_hook=_each_once, parse_constant=_no_number)
        if data.get("format") != FORMAT or isinstance(data["format"], bool):
            raise DataError(f"has format {data.get('format')!r}; this version reads {FORMAT}", file=file)
        altitude, F, G, H, start, kinks = (_numbers(data[k], k) for k in KEYS)
        return ShapingFilter(
            str(data["name"]), altitude, F, G, H, start, tuple(kinks.tolist()), str(data["source"]), _origin(data)
        )
    except KeyError as error:
        raise DataError(f"lacks {error}; write filters with 'ascentwind wind fit'", file=file) from None
    except (ValueError, TypeError, AttributeError, IndexError, OverflowError) as error:
        raise DataError(f"is not a wind filter: {error}", file=file) from None
    except RecursionError:
        raise DataError("nests lists too deep; write filters with 'ascentwind wind fit'", file=file) from None
    except DataError as error:
        raise DataError(error.why, file=file) from None


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
