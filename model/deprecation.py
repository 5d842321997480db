"""Names that go with the next release."""

from __future__ import annotations

import warnings
from functools import cache

from .errors import DeprecatedNameWarning


@cache
def warn_deprecated(old: str, successor: str) -> None:
    """Warn that a name has a successor, once a process.

    Warns
    -----
    DeprecatedNameWarning
    """
    warnings.warn(DeprecatedNameWarning(f"{old} goes with the next release; use {successor}"), stacklevel=3)
