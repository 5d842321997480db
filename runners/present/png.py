"""PNG files of drawings: rows as they are, for what is mostly background packs as well without filters tried on it."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

SIGNATURE = b"\x89PNG\r\n\x1a\n"
HEADER = ">IIBBBBB"  # width, height, bits, kind, packing, filters, interlacing
COLOURS = 2  # red, green and blue
METRE = 1  # the unit of pixels along one
INCH = 0.0254  # m
LEVEL = 1  # no larger than at the highest by a fifth, and in half its time


def png(image: NDArray[np.uint8], pixels: int) -> bytes:
    """Return an opaque image as a PNG file.

    Parameters
    ----------
    image : (height, width, 3 or 4) array
        Red, green and blue; a fourth channel is left out.
    pixels : int
        An inch.
    """
    height, width = image.shape[:2]
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # 0 before each: no filter
    rows[:, 1:] = image[:, :, :3].reshape(height, 3 * width)
    density = round(pixels / INCH)
    parts = {
        b"IHDR": struct.pack(HEADER, width, height, 8, COLOURS, 0, 0, 0),
        b"pHYs": struct.pack(">IIB", density, density, METRE),
        b"IDAT": zlib.compress(rows.tobytes(), LEVEL),
        b"IEND": b"",
    }
    return SIGNATURE + b"".join(_chunk(kind, data) for kind, data in parts.items())


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
