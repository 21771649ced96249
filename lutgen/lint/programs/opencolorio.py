"""OpenColorIO's CPU renderer, of whichever version is installed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bindings import ocio, ocio_errors, unclosed_metadata, warnings_logged
from lutgen.lint.finding import OCIO, OCIO_21, OCIO_26, Finding, refused
from lutgen.lint.programs import Program, Refusal, probe_colours

if TYPE_CHECKING:
    from collections.abc import Iterator
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
        message = "was not asked, since it would search for the end of the metadata without end"
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


def refusal(path: Path) -> str:
    """Return why the installed OpenColorIO does not read a file; empty where it does."""
    try:
        apply(path, probe_colours())
    except Refusal as refused:
        said = " ".join(str(refused).split())
        return said.rpartition("failed with: ")[2].replace(str(path), path.name)[:300] or "it says nothing"
    return ""


def loading(why: str | None, *readers: str) -> Iterator[Finding]:
    """Yield the finding for a result of :func:`refusal`, or for None where OpenColorIO was not asked.

    OpenColorIO 2.1 and 2.6 agree on CLF and the text tables except where a rule says otherwise, so that the answer of
    the installed version holds for all ``readers``.
    """
    if why:
        fates = refused(*readers, how=f"OpenColorIO {version()} was asked")
        yield Finding(f"is not read: {why}", "Export it again.", 0, fates)
    elif why is None:
        fates = refused(*OCIO, how="takes 129 points an axis at most")
        yield Finding("is too large to be given to OpenColorIO", "Resample it to 65 or 33.", 0, fates)


PROGRAM = Program(reader, version, apply, tolerance=1e-5, clips=False)
