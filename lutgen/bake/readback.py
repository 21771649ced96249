"""Reading LUT files back: through OpenColorIO, or through the format's own reader when OpenColorIO cannot read it."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from lutgen.bake.formats import Reader, format_named, format_names
from lutgen.bindings import lut_processor, ocio, refuse_unlikely
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError


class TableKind(NamedTuple):
    """The space of a file's table (a key of ``SPACES``), its size (0 for a matrix) and whether it is clipped."""

    space: str
    size: int
    clipped: bool


def apply_lut(path: Path, code: Array) -> Array:
    """Apply a LUT file to code values (n, 3) as its readers do, with tetrahedral interpolation.

    Raises LutgenError: the file is missing, is larger than any LUT, cannot be read, or gives NaN or infinity.
    """
    reader = _reader(path)
    if reader:
        refuse_unlikely(path)
        result = reader.apply(path, code)
    else:
        processor = lut_processor(path).getDefaultCPUProcessor()
        shown = np.array(code, dtype=np.float32, order="C")
        processor.applyRGB(shown)
        result = shown.astype(np.float64)
    if not np.isfinite(result).all():
        raise LutgenError(f"{path}: gives NaN or infinity for {int((~np.isfinite(result)).any(axis=1).sum())} colours.")
    return result


def table_kind(path: Path, *, clipped: bool) -> TableKind:
    """Return the kind of a LUT file's table. Raises LutgenError as :func:`apply_lut` does."""
    reader = _reader(path)
    if reader:
        refuse_unlikely(path)
        return TableKind(*reader.table(path), clipped)
    return TableKind(*table_of_ocio(path), clipped)


def table_of_ocio(path: Path) -> tuple[str, int]:
    """Return the space and the size of a LUT's table, as OpenColorIO reads the file.

    The space is "code" when the table is the first step, "shaped" after a 1D curve, and otherwise "linear".
    """
    lib = ocio()
    steps = list(lut_processor(path).createGroupTransform())
    tables = [place for place, step in enumerate(steps) if isinstance(step, lib.Lut3DTransform)]
    if not tables:
        return "linear", 0
    size = steps[tables[0]].getGridSize()
    before = steps[: tables[0]]
    # A curve of two points is the identity.
    if all(isinstance(step, lib.Lut1DTransform) and step.getLength() == 2 for step in before):
        return "code", size
    return ("shaped" if isinstance(before[-1], lib.Lut1DTransform) else "linear"), size


def _reader(path: Path) -> Reader | None:
    """Return the reader of the format with this suffix; None for formats that OpenColorIO reads."""
    forms = map(format_named, format_names())
    return next((form.reader for form in forms if form.reader and path.suffix.lower() == form.suffix), None)
