"""Calling a generated library: pointers into arrays, and what is said where no compiler is."""

from __future__ import annotations

import ctypes

import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindError


class NoCompilerError(AscentwindError):
    """The sweep exists as compiled code only."""


def pointer(array: NDArray[np.float64] | None) -> ctypes.c_void_p:
    """Return the address of an array; ``data_as`` keeps the array alive as long as the pointer."""
    return ctypes.c_void_p(None) if array is None else array.ctypes.data_as(ctypes.c_void_p)
