"""OpenColorIO and OpenImageIO, which come from Debian's packages or from PyPI's wheels.

Nothing newer than OpenColorIO 2.1 may be assumed: what it lacks is asked for by feature.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from lutgen.errors import LutgenError

_SOURCES = {
    "PyOpenColorIO": ("OpenColorIO", "python3-pyopencolorio", "opencolorio"),
    "OpenImageIO": ("OpenImageIO", "python3-openimageio", "openimageio"),
}


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


def oiio() -> Any:
    """Return the module ``OpenImageIO``. Raises LutgenError saying how to install it."""
    return _binding("OpenImageIO")


def _binding(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        name, debian, wheel = _SOURCES[module]
        message = (
            f"{name}'s Python binding cannot be imported ({error}). Install Debian's {debian} and use a virtual "
            f"environment with system site packages, or `pip install {wheel}`."
        )
        raise LutgenError(message) from None
