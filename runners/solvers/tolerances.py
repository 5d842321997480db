"""Which tolerances a solver takes."""

from __future__ import annotations

from ...model.errors import IntegrationError

LARGEST_TOLERANCE = 1e-2


def check_relative_tolerance(value: float, least: float) -> None:
    """Refuse a relative tolerance below ``least`` or above 1e-2.

    Raises
    ------
    IntegrationError
    """
    if not least <= value <= LARGEST_TOLERANCE:
        raise IntegrationError(
            f"a relative tolerance of {value:g} cannot be met; choose {least:g} to {LARGEST_TOLERANCE:g}"
        )


def check_absolute_part(value: float) -> None:
    """Refuse an absolute tolerance that is no part of the relative one.

    Raises
    ------
    IntegrationError
    """
    if not 0 < value <= 1:
        raise IntegrationError(f"an absolute part of {value:g} makes no sense; choose up to 1")
