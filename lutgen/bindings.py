"""OpenColorIO and OpenImageIO, which come from Debian's packages or from PyPI's wheels; reading LUT files with them.

Nothing newer than OpenColorIO 2.1 may be assumed: what it lacks is asked for by feature.
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError, reason_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_SOURCES = {
    "PyOpenColorIO": ("OpenColorIO", "python3-pyopencolorio"),
    "OpenImageIO": ("OpenImageIO", "python3-openimageio"),
}

#: Ten times the size of a .cube of 65³; a larger file is no LUT.
LARGEST_LUT = 100_000_000

#: Points along an edge of a table, and of a curve, that OpenColorIO takes.
MOST_POINTS, MOST_CURVE_POINTS = 129, 1_048_576

#: How a .csp opens, and the lines between which its metadata stand.
_CSP, _METADATA = re.compile(rb"(?i)\s*CSPLUTV100"), re.compile(rb"(?im)^[ \t]*(BEGIN|END) METADATA")

#: The sizes that a .cube claims; OpenColorIO 2.1 would ask for the memory before it counts the rows.
_CLAIMED = re.compile(rb"(?im)^[ \t]*LUT_([13])D_SIZE[ \t]+([0-9]+)")


def ocio() -> Any:
    """Return the module ``PyOpenColorIO``. Raises LutgenError saying how to install it."""
    return _binding("PyOpenColorIO")


def ocio_errors() -> tuple[type[BaseException], ...]:
    """Return what OpenColorIO raises.

    A missing file is not among its own ``Exception``, and where it quotes a file that is no text, Python cannot decode
    what it says.
    """
    lib = ocio()
    return lib.Exception, lib.ExceptionMissingFile, UnicodeDecodeError


@contextmanager
def warnings_logged(lib: Any) -> Iterator[list[str]]:
    """Collect what OpenColorIO logs, each message on one line, instead of printing it."""
    messages: list[str] = []
    lib.SetLoggingFunction(lambda message: messages.append(" ".join(str(message).split())))
    try:
        yield messages
    finally:
        # Left in place, a Python function would be called after Python has gone.
        lib.ResetToDefaultLoggingFunction()


def oiio() -> Any:
    """Return the module ``OpenImageIO``. Raises LutgenError saying how to install it."""
    return _binding("OpenImageIO")


def littlecms() -> Any:
    """Return the module ``imagecodecs``, of which LittleCMS is a part. Raises LutgenError saying how to install it."""
    try:
        return import_module("imagecodecs")
    except ImportError as error:
        message = (
            f"ICC profiles are read back through LittleCMS, whose binding cannot be imported ({error}). Install it by "
            f"`pip install lutgen[icc]`; `lutgen build --no-certificates` does without."
        )
        raise LutgenError(message) from None


def lut_processor(path: Path) -> Any:
    """Return OpenColorIO's processor for a LUT file of code values, interpolated tetrahedrally.

    Raises
    ------
    LutgenError
        No file, an empty or huge one, one whose header claims more than any LUT has, or one that OpenColorIO cannot
        read.

    """
    lib = ocio()
    refuse_unlikely(path)
    with path.open("rb") as file:
        head = file.read(65_536)
    for dimensions, digits in _CLAIMED.findall(head):
        most = MOST_POINTS if dimensions == b"3" else MOST_CURVE_POINTS
        # Nobody needs all digits of a lie, and Python refuses to read thousands of them.
        if len(digits) > 9 or int(digits) > most:
            claimed = digits[:12].decode()
            message = f"{path}: claims {claimed} points in {dimensions.decode()}D; OpenColorIO takes at most {most}."
            raise LutgenError(f"{message} Ask its maker for a smaller one.")
    if line := unclosed_metadata(path):
        message = f"{path}:{line}: opens its metadata and never closes them. Write END METADATA behind them."
        raise LutgenError(message)
    # Caches key on the path: a rewritten file would otherwise be answered from memory.
    lib.ClearAllCaches()
    # The name as it is given, not where a link leads: OpenColorIO chooses the reader by its suffix.
    file_transform = lib.FileTransform(src=str(path.absolute()), interpolation=lib.INTERP_TETRAHEDRAL)
    try:
        return _raw_config().getProcessor(file_transform)
    except ocio_errors() as error:
        message = f"{path}: OpenColorIO {lib.__version__} cannot read it: {' '.join(str(error).split())}"
        raise LutgenError(message) from None


@cache
def _raw_config() -> Any:
    lib = ocio()
    config = lib.Config.CreateRaw()
    # Its processors are kept by the name of the file, which may be written anew.
    config.setProcessorCacheFlags(lib.PROCESSOR_CACHE_OFF)
    return config


def unclosed_metadata(path: Path) -> int:
    """Return the line on which a .csp, of whatever suffix, opens metadata that it never closes; 0 where none does.

    OpenColorIO, 2.1 and 2.6 alike, reads on for their end for ever and fills the memory. It tries all formats on a file
    whose suffix does not fit.
    """
    with path.open("rb") as file:
        if not _CSP.match(file.read(65_536)):
            return 0
        file.seek(0)
        data = file.read(LARGEST_LUT)
    marks = list(_METADATA.finditer(data))
    if not marks or any(mark[1].upper() == b"END" for mark in marks[1:]):
        return 0
    return data.count(b"\n", 0, marks[0].start()) + 1


def refuse_unlikely(path: Path) -> None:
    """Raise LutgenError unless ``path`` is a file of a LUT's size, before anything of it is read."""
    try:
        size = path.stat().st_size
    except OSError as error:
        raise LutgenError(f"{path}: cannot be read: {reason_of(error)}.") from None
    if not path.is_file():
        raise LutgenError(f"{path}: is no file. Give the path of a LUT.")
    if not size:
        raise LutgenError(f"{path}: is empty. Build it again, or copy it anew.")
    if size > LARGEST_LUT:
        raise LutgenError(
            f"{path}: has {size / 1e6:.0f} MB, and a LUT has at most {LARGEST_LUT / 1e6:.0f} MB. Is it the right file?"
        )
    if not os.access(path, os.R_OK):
        raise LutgenError(f"{path}: cannot be read: permission denied.")


def _binding(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        name, debian = _SOURCES[module]
        message = (
            f"{name}'s Python binding cannot be imported ({error}). Install Debian's {debian} and use a virtual "
            f"environment with system site packages, or without rights `pip install lutgen[wheels]`."
        )
        raise LutgenError(message) from None
