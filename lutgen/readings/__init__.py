"""The table of readings: what a meter said of a display, patch by patch and hour by hour.

One file per format in this folder, found by its name: ``csv.py`` reads ``*.csv``. Each has one function
``read(path, text) -> Measurements``. Whatever the format, nothing about the values is guessed: percent or
8-bit drive, relative instead of absolute luminance, swapped channels are refused with a sentence that says
what to do.
"""

from __future__ import annotations

import hashlib
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from lutgen.errors import LutgenError
from lutgen.files import read_at_most
from lutgen.readings.table import TIP_NAMES, Measurements

__all__ = ["TIP_NAMES", "Measurements", "formats", "read_measurements"]

#: Modules of this folder that are no format.
_OTHERS = {"campaign", "conditions", "rest", "session", "sessions", "table"}

#: A table of readings is text of at most a few MB; a larger file is something else.
MAX_BYTES = 64_000_000


def formats() -> list[str]:
    """Names of the formats that can be read, which are the file suffixes: one module each in this folder."""
    return sorted(module.name for module in iter_modules(__path__) if module.name not in _OTHERS)


def read_measurements(path: str | Path) -> Measurements:
    """Read a table of readings.

    Parameters
    ----------
    path
        A file whose suffix names its format (see :func:`formats`).

    Raises
    ------
    LutgenError
        Unreadable, binary, empty or wrong in any value: names file, line, column and what to do.

    """
    path = Path(path)
    suffix = path.suffix.lower().lstrip(".")
    if suffix not in formats():
        known = ", ".join(f".{name}" for name in formats())
        message = f"{path}: the suffix {path.suffix!r} names no format of measurements. Pick one of: {known}."
        raise LutgenError(message)
    data = read_at_most(path, MAX_BYTES, what="the measurements", none="table of readings")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        message = f"{path}: byte {error.start} is not UTF-8 text: a binary file? Measurements are a text table."
        raise LutgenError(message) from None
    if "\0" in text:
        message = f"{path}: holds NUL bytes: a binary file? Measurements are a text table."
        raise LutgenError(message)
    if not text.strip():
        message = f"{path}: the file is empty. It needs a header line and one row a reading."
        raise LutgenError(message)
    measurements: Measurements = import_module(f"lutgen.readings.{suffix}").read(
        text, file=str(path), sha256=hashlib.sha256(data).hexdigest()
    )
    return measurements
