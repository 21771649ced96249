"""colour-science's ``read_LUT``, in double precision."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from lutgen.lint.finding import COLOUR
from lutgen.lint.programs import Program, Refusal

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: What it raises over files that it cannot read.
_RAISED = (
    ValueError, IndexError, KeyError, AttributeError, TypeError, NameError, AssertionError, MemoryError, OverflowError,
)  # fmt: skip


def version() -> str:
    """Return the package's version; lutgen depends on it, so it is there."""
    import colour

    return str(colour.__version__)


def apply(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file."""
    import colour

    trilinear = colour.algebra.table_interpolation_trilinear
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            lut = colour.read_LUT(str(path))
            parts = list(lut) if isinstance(lut, colour.LUTSequence) else [lut]
            shown = code / 255
            for part in parts:
                shown = (
                    part.apply(shown, interpolator=trilinear) if isinstance(part, colour.LUT3D) else part.apply(shown)
                )
    # Users of the reader see these errors too, so they count as its refusal.
    except _RAISED as error:
        raise Refusal(f"{type(error).__name__}: {error}") from None
    return np.asarray(shown, dtype=np.float64)


PROGRAM = Program(lambda: COLOUR, version, apply, tolerance=1e-5, clips=False)
