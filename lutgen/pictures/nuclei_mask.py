"""Nuclei that somebody else has found: a picture of labels, or one in black and white."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.bindings import oiio
from lutgen.errors import LutgenError, reason_of
from lutgen.pictures.nuclei import Labels, Nuclei, sized, width_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.pictures.field import Field

_ALLOWED = "Give a PNG or TIFF of the image's size: 0 for the ground, and 1, 2, … for each nucleus or white for all."

#: First bytes of files that keep every number, and of those that do not.
_LOSSLESS = (b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

#: A nucleus fills at least this share of the box around it; grey levels of soft edges lie about everywhere.
FILLS = 0.05

#: The largest label: what 32-bit integers hold.
_LARGEST = 2**31 - 1


def read_mask(file: str | Path, field: Field, *, min_area: int | None = None) -> Nuclei:
    """Read nuclei from a picture.

    Parameters
    ----------
    file
        PNG or TIFF of the field's size. Of two values only (black and white): each connected piece is a nucleus. Of
        more: each value but 0 is one.
    field
        The field that they lie in.
    min_area
        Pixels of the smallest nucleus; None: all are kept.

    Raises
    ------
    LutgenError
        A file that cannot be read, is lossy, coloured, of another size, holds no whole numbers, or no nucleus.

    """
    from scipy import ndimage

    values = _read(file, field)
    kinds = np.unique(values[values != 0])
    if not kinds.size:
        raise LutgenError(f"{file}: the mask is empty: every pixel is 0. {_ALLOWED}")
    if kinds.size == 1:
        labels, found = ndimage.label(values)[0], "pieces of the mask"
    else:
        labels, found = np.searchsorted(kinds, values) + 1, "labels of the mask"
        labels[values == 0] = 0
        _check_labels(file, labels, kinds.size)
    labels = np.where(field.visible, labels, 0).astype(np.int32)
    width = width_of(_with_edges(labels)) or 1.0
    made = sized(labels, width, float(min_area or 1), np.inf, f"the {found} {Path(file).name}")
    if not made.count:
        message = f"{file}: all nuclei of the mask lie where {field.file} is transparent. {_ALLOWED}"
        if made.small:
            message = f"{file}: all {made.small} nuclei are smaller than {min_area} pixels. Lower --min-area."
        raise LutgenError(message)
    return made


def _with_edges(labels: Labels) -> NDArray[np.bool_]:
    """Where labels are, without the pixels at which one meets another."""
    apart = labels > 0
    for one, other in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        apart[one] &= (labels[one] == labels[other]) | (labels[other] == 0)
    return apart


def _check_labels(file: str | Path, labels: NDArray[Any], count: int) -> None:
    from scipy import ndimage

    boxes = ndimage.find_objects(labels)
    area = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    size = np.array([(rows.stop - rows.start) * (columns.stop - columns.start) for rows, columns in boxes])
    if np.median(area / size) < FILLS:
        message = (
            f"{file}: its {count} values are scattered over the image, as grey levels of soft edges are, not labels of "
            f"nuclei. {_ALLOWED}"
        )
        raise LutgenError(message)


def _read(file: str | Path, field: Field) -> NDArray[Any]:
    """Whole numbers of a picture of the field's size, (rows, columns)."""
    path = Path(file)
    try:
        with path.open("rb") as opened:
            start = opened.read(8)
    except OSError as error:
        raise LutgenError(f"{file}: cannot read the mask: {reason_of(error)}.") from None
    if not start.startswith(_LOSSLESS):
        raise LutgenError(f"{file}: the mask is neither PNG nor TIFF; others lose or change numbers. {_ALLOWED}")
    lib = oiio()
    hint = lib.ImageSpec()
    # Colours multiplied by alpha would be other numbers.
    hint.attribute("oiio:UnassociatedAlpha", 1)
    image = lib.ImageInput.open(str(path), hint)
    if image is None:
        lib.geterror()
        raise LutgenError(f"{file}: the mask is damaged and cannot be read. Get a whole copy.")
    spec = image.spec()
    if (spec.height, spec.width) != field.shape:
        rows, columns = field.shape
        message = (
            f"{file}: the mask has {spec.width} × {spec.height} pixels, the image {field.file} {columns} × {rows}. "
            f"{_ALLOWED}"
        )
        raise LutgenError(message)
    stored = image.read_image(0, 0, 0, spec.nchannels, spec.format)
    if stored is None or image.has_error:
        image.geterror()
        raise LutgenError(f"{file}: the mask is damaged and cannot be read to its end. Get a whole copy.")
    image.close()
    values = np.asarray(stored).reshape(spec.height, spec.width, spec.nchannels)
    shades = values[..., :3] if spec.nchannels > 2 else values[..., :1]
    if spec.nchannels > 2 and (shades != shades[..., :1]).any():
        raise LutgenError(f"{file}: the mask is coloured, and a colour is no label. {_ALLOWED}")
    return _whole(file, shades[..., 0])


def _whole(file: str | Path, values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind == "f":
        wrong = ~np.isfinite(values) | (values != np.rint(values))
    else:
        wrong = np.zeros(values.shape, np.bool_)
    wrong |= (values < 0) | (values > _LARGEST)
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        message = (
            f"{file}: pixel ({column}, {row}) of the mask is {values[row, column]:g}; labels are whole numbers from 0 "
            f"to {_LARGEST}. {_ALLOWED}"
        )
        raise LutgenError(message)
    return values.astype(np.int64)
