"""pillow_lut, which fills Pillow's colour table: 8 bit in, 8 bit out."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from typing import TYPE_CHECKING

import numpy as np

from lutgen.lint.finding import PILLOW
from lutgen.lint.programs import Absent, Program, Refusal

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array


def version() -> str:
    """Return the distribution's version."""
    try:
        return version_of("pillow_lut")
    except PackageNotFoundError:
        raise Absent("pillow_lut is not installed (pip install pillow_lut)") from None


def apply(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file."""
    try:
        table = import_module("pillow_lut").load_cube_file(str(path))
    # Users of the reader see these errors too, so they count as its refusal.
    except (ValueError, IndexError, OverflowError, MemoryError) as error:
        raise Refusal(f"{type(error).__name__}: {error}") from None
    shown = import_module("PIL.Image").fromarray(code[np.newaxis]).filter(table)
    return np.asarray(np.asarray(shown)[0] / 255)


PROGRAM = Program(lambda: PILLOW, version, apply, tolerance=1.5 / 255, clips=True)
