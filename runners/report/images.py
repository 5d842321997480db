"""Figures of the folder inside a page: PNG, made smaller."""

from __future__ import annotations

import base64
import io
from pathlib import Path

from PIL import Image as Picture

from ...model.errors import DataError
from ..present.wording import words
from .parts import Image

WIDTH = 1000  # px
COLOURS = 96
BUDGET = 1_400_000  # characters of all images of a page


def images(paths: list[Path]) -> tuple[list[Image], list[str]]:
    """Return images as data inside a page, and the names of those for which it has no room.

    Raises
    ------
    DataError
        A file that is no picture.
    """
    found, left, size = [], [], 0
    for path in paths:
        data = _data(path)
        if size + len(data) > BUDGET:
            left.append(path.name)
            continue
        size += len(data)
        found.append(Image(words(path.stem), data))
    return found, left


def _data(path: Path) -> str:
    try:
        with Picture.open(path) as read:
            whole = read.convert("RGB")
    except (OSError, ValueError, SyntaxError, Picture.DecompressionBombError) as error:
        raise DataError(f"is no picture ({error!s:.100}); compute it again", file=path) from None
    if whole.width > WIDTH:
        whole = whole.resize((WIDTH, round(whole.height * WIDTH / whole.width)), Picture.Resampling.LANCZOS)
    buffer = io.BytesIO()
    whole.quantize(COLOURS).save(buffer, "png", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"
