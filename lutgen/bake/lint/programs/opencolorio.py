"""OpenColorIO's CPU renderer, of whichever version is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.check_config import warnings_logged
from lutgen.bake.lint.finding import OCIO_21, OCIO_26
from lutgen.bake.lint.programs import Program, Refusal
from lutgen.bindings import ocio, ocio_errors, unclosed_metadata

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array


def reader() -> str:
    """Return the name of the reader that stands for the installed version."""
    return OCIO_21 if version().startswith("2.1.") else OCIO_26


def version() -> str:
    """Return the binding's version."""
    return str(ocio().__version__)


def apply(path: Path, code: NDArray[np.uint8]) -> Array:
    """Apply a file in float32."""
    lib = ocio()
    if unclosed_metadata(path):
        message = "was not asked: it would read on for the end of the metadata for ever"
        raise Refusal(message)
    # Caches key on the path: a rewritten file would otherwise be answered from memory.
    lib.ClearAllCaches()
    transform = lib.FileTransform(src=str(path), interpolation=lib.INTERP_LINEAR)
    with warnings_logged(lib):
        try:
            processor = lib.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor()
        except ocio_errors() as error:
            raise Refusal(str(error)) from None
    result = (code / 255).astype(np.float32)
    processor.applyRGB(result)
    return result.astype(np.float64)


PROGRAM = Program(reader, version, apply, tolerance=1e-5, clips=False)
