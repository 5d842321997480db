"""Reading text files that people edit: errors that say what the file is instead."""

from __future__ import annotations

import codecs
from pathlib import Path

from ..errors import DataError

_WIDE = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}


def read_text(file: Path) -> str:
    """Return a file as text, without a byte order mark and with every line ending as a newline.

    Raises
    ------
    DataError
        It cannot be read, or is not UTF-8.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise DataError(f"cannot be read ({error.strerror or error}); check its name", file=file) from None
    except ValueError as error:  # a zero character in the name
        raise DataError(f"cannot be read ({error}); check its name", file=file) from None
    wide = next((name for mark, name in _WIDE.items() if content.startswith(mark)), None)
    if wide is not None or b"\0" in content:
        raise DataError(f"is {wide or 'binary or UTF-16'}, not UTF-8 text; save it as UTF-8", file=file)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise DataError(
            f"is not UTF-8 text (byte 0x{content[error.start]:02x}); save it as UTF-8", file=file, row=line
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")
