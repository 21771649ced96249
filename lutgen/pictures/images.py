"""Image files through OpenImageIO, in bands of rows, so that memory does not grow with the image's height.

The kind of a file is read from its first bytes, never from its name. What is written keeps the source's depth,
alpha, metadata, ICC profile, tiles and (lossless) compression, as far as the format chosen by the suffix has them.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from dataclasses import dataclass
from errno import ENOSPC
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.bindings import oiio
from lutgen.colorimetry import SRGB_XY
from lutgen.errors import LutgenError, pick_one, reason_of
from lutgen.files import free_bytes, is_unicode, under_its_name
from lutgen.names import LINEAR, SIGNAL
from lutgen.pictures.encoding import Storage
from lutgen.pictures.integrity import is_whole

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from lutgen.pictures.encoding import Stored


@dataclass(frozen=True)
class ImageFormat:
    """A kind of image file.

    Attributes
    ----------
    name
        OpenImageIO's name.
    suffixes
        The first is the usual one.
    magic
        First bytes, one or more kinds.
    depths
        OpenImageIO's name of a stored number → that of the number written for it.
    encoding
        What its files store unless they say otherwise.
    lossless
        Compressions that are kept; others become ``zip``, so that what is written is what was computed.

    """

    name: str
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...]
    depths: Mapping[str, str]
    encoding: str = SIGNAL
    alpha: bool = True
    tiles: bool = False
    lossless: tuple[str, ...] = ()


FORMATS = (
    ImageFormat(
        "png",
        (".png",),
        (b"\x89PNG\r\n\x1a\n",),
        {"uint8": "uint8", "uint16": "uint16", "half": "uint16", "float": "uint16"},
    ),
    ImageFormat(
        "jpeg",
        (".jpg", ".jpeg"),
        (b"\xff\xd8\xff",),
        dict.fromkeys(("uint8", "uint16", "half", "float"), "uint8"),
        alpha=False,
    ),
    ImageFormat(
        "tiff",
        (".tif", ".tiff"),
        (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
        {"uint8": "uint8", "uint16": "uint16", "half": "float", "float": "float"},
        tiles=True,
        lossless=("none", "lzw", "zip", "packbits"),
    ),
    ImageFormat(
        "openexr",
        (".exr",),
        (b"\x76\x2f\x31\x01",),
        {"uint8": "half", "uint16": "float", "half": "half", "float": "float"},
        encoding=LINEAR,
        tiles=True,
        lossless=("none", "rle", "zip", "zips", "piz"),
    ),
)

_DTYPES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16, "float": np.float32}

#: Pixels in a band: large enough for compressors to use every core, small enough to hold several.
BAND = 1_500_000

#: Rows of a TIFF's strip; higher ones (often the whole image) are read row by row and not kept.
MAX_STRIP = 512

#: Bytes for what an image file holds beside pixels, such as its ICC profile.
_SPARE = 1 << 20

#: JPEG: quality of what is written, and colour at full resolution.
JPEG_QUALITY, JPEG_SUBSAMPLING = 95, "4:4:4"

#: Names OpenImageIO gives to linear light of the sRGB primaries, by version (2.4: Linear; 3: the others).
_LINEAR_NAMES = ("linear", "scene_linear", "lin_srgb", "lin_rec709", "lin_rec709_scene", "lin_srgb_scene")

#: EXR's attribute `chromaticities`: x, y of red, green, blue and white.
_SRGB_PRIMARIES = tuple(float(number) for number in SRGB_XY[[1, 2, 3, 0]].ravel())

#: Metadata that describe the source's bytes rather than its picture, or say how it was stored.
_NOT_KEPT = ("oiio:", "tiff:", "jpeg:", "png:", "planarconfig", "textureformat", "openexr:levelmode", "iccprofile:")
_COMPRESSION = ("compression", "compressionquality", "openexr:dwacompressionlevel")


class ImageSource:
    """An open image: its storage and its bands of rows."""

    def __init__(self, path: Path, image: Any, kind: ImageFormat, encoding: str) -> None:
        """Take an image that OpenImageIO has opened; raises LutgenError for pixels that cannot be aged."""
        self.path, self.format = path, kind
        self._image, self.spec = image, image.spec()
        alpha = _check_channels(path, self.spec)
        associated = alpha and not self.spec.get_int_attribute("oiio:UnassociatedAlpha")
        encoding = encoding or _encoding(path, self.spec, kind)
        self.storage = Storage(_dtype(path, self.spec.format), encoding, alpha, associated)

    @property
    def width(self) -> int:
        """Pixels in a row."""
        return int(self.spec.width)

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.spec.height)

    @property
    def sideways(self) -> bool:
        """Whether the file asks viewers to turn it by 90°."""
        return int(self.spec.get_int_attribute("Orientation", 1)) > 4

    @property
    def mirrored(self) -> bool:
        """Whether the file asks viewers to show its left side on the right."""
        return int(self.spec.get_int_attribute("Orientation", 1)) in (2, 3)

    @property
    def unit(self) -> int:
        """Rows that are stored together, or 32: a row of tiles, or as many whole strips."""
        if self.spec.tile_width:
            return int(self.spec.tile_height)
        strip = int(self.spec.get_int_attribute("tiff:RowsPerStrip", 1))
        return -(-32 // strip) * strip if strip <= MAX_STRIP else 32

    def bands(self) -> list[tuple[int, int]]:
        """Rows from (inclusive) and to (exclusive), in whole units, counted from 0."""
        rows = max(BAND // self.width // self.unit, 1) * self.unit
        return [(first, min(first + rows, self.height)) for first in range(0, self.height, rows)]

    def blocks(self) -> list[tuple[int, int, int, int]]:
        """Rows from and to, columns from and to, in whole tiles: as bands, but a row of many tiles is cut too."""
        tile, bands = int(self.spec.tile_width), self.bands()
        high = bands[0][1]
        wide = max(BAND // high // tile, 1) * tile if tile else self.width
        return [(*band, left, min(left + wide, self.width)) for band in bands for left in range(0, self.width, wide)]

    def read(self, first: int, last: int, left: int = 0, right: int | None = None) -> Stored:
        """Read rows ``first`` to ``last``, columns ``left`` to ``right`` (exclusive): (rows, columns, channels)."""
        spec, y = self.spec, self.spec.y
        rows, right = (y + first, y + last), self.width if right is None else right
        if spec.tile_width:
            columns = (spec.x + left, spec.x + right)
            block = self._image.read_tiles(*columns, *rows, spec.z, spec.z + 1, 0, spec.nchannels, spec.format)
        else:
            block = self._image.read_scanlines(*rows, spec.z, 0, spec.nchannels, spec.format)
        # Some damage gives an error, some gives pixels and an error.
        if block is None or self._image.has_error:
            self._image.geterror()
            raise _damaged(self.path)
        return np.asarray(block).reshape(last - first, right - left, self.storage.channels)


@contextmanager
def open_source(path: Path, source: str = "auto") -> Iterator[ImageSource]:
    """Open an image; ``source`` is ``auto``, ``SIGNAL`` or ``LINEAR``.

    Raises
    ------
    LutgenError
        Missing, empty, damaged, not an image of ``FORMATS``, or neither RGB nor RGBA.

    """
    kind = _sniff(path)
    if kind.name in ("png", "tiff") and not is_whole(path):
        raise _damaged(path)
    # OpenImageIO chooses the reader by the suffix, reads options behind a question mark, and takes UTF-8 alone.
    if path.suffix.lower() in kind.suffixes and "?" not in str(path) and is_unicode(path):
        with _opened(path, path, kind, source) as opened:
            yield opened
    else:
        with under_its_name(path, kind.suffixes[0]) as link, _opened(path, link, kind, source) as opened:
            yield opened


@contextmanager
def _opened(path: Path, link: Path, kind: ImageFormat, source: str) -> Iterator[ImageSource]:
    lib = oiio()
    hint = lib.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    image = lib.ImageInput.open(str(link), hint)
    if image is None or image.has_error:
        # Unread messages would be printed when OpenImageIO is unloaded.
        (image or lib).geterror()
        raise _damaged(path)
    try:
        yield ImageSource(path, image, kind, "" if source == "auto" else source)
    finally:
        image.close()


class Target:
    """An image being written, band by band."""

    def __init__(self, source: ImageSource, kind: ImageFormat, *, wide: bool) -> None:
        """Decide how to store what ``source`` becomes; ``wide`` for two pictures side by side."""
        if source.storage.alpha and not kind.alpha:
            message = f"{source.path}: has alpha, which {kind.suffixes[0]} cannot keep. Write to .png, .tif or .exr."
            raise LutgenError(message)
        self._lib = oiio()
        self.format = kind
        depth = kind.depths[str(source.spec.format)]
        encoding = source.storage.encoding if kind in (source.format, _TIFF) else kind.encoding
        associated = source.storage.alpha and (kind.name == "openexr" or (kind == _TIFF and source.storage.associated))
        self.storage = Storage(np.dtype(_DTYPES[depth]), encoding, source.storage.alpha, associated)
        self.spec = self._spec(source, depth, wide=wide)

    def _spec(self, source: ImageSource, depth: str, *, wide: bool) -> Any:
        spec = self._lib.ImageSpec(source.spec)
        spec.set_format(self._lib.TypeDesc(depth))
        same_format = self.format == source.format
        compression = str(spec.get_string_attribute("compression"))
        for attribute in source.spec.extra_attribs:
            if not _kept(attribute.name.lower(), same_encoding=self.storage.encoding == source.storage.encoding):
                spec.erase_attribute(attribute.name)
        if self.format.lossless:
            spec.attribute("compression", compression if same_format and compression in self.format.lossless else "zip")
        if self.format == _TIFF:
            spec.attribute("tiff:RowsPerStrip", source.unit)
        if self.format.name == "jpeg":
            spec.attribute("CompressionQuality", JPEG_QUALITY)
            spec.attribute("jpeg:subsampling", JPEG_SUBSAMPLING)
        if self.storage.alpha and not self.storage.associated:
            spec.attribute("oiio:UnassociatedAlpha", 1)
        if not (self.format.tiles and same_format):
            spec.tile_width = spec.tile_height = spec.tile_depth = 0
        if wide:
            spec.width *= 2
            spec.full_x, spec.full_y, spec.full_width, spec.full_height = spec.x, spec.y, spec.width, spec.height
        return spec

    @contextmanager
    def open(self, partial: Path) -> Iterator[None]:
        """Create the file ``partial``; its suffix does not matter. Raises OSError when that cannot be done."""
        # Python's own attempt says why a file cannot be made, in words.
        partial.touch()
        self._folder = partial.parent
        self._check_room(0)
        self._image = self._lib.ImageOutput.create(self.format.name)
        self._check(self._image.open(str(partial), self.spec))
        try:
            yield
        except BaseException:
            self._image.close()
            self._image.geterror()
            raise
        self._check(self._image.close())
        # libpng says nothing when the disk is full.
        self._check(self.format.name != "png" or is_whole(partial))

    def write(self, first: int, last: int, pixels: Stored) -> None:
        """Write rows ``first`` to ``last`` (exclusive), shape (rows, width, channels)."""
        spec = self.spec
        self._check_room(pixels.nbytes)
        rows = (spec.y + first, spec.y + last)
        if spec.tile_width:
            columns = (spec.x, spec.x + spec.width)
            self._check(self._image.write_tiles(*columns, *rows, spec.z, spec.z + 1, pixels))
        else:
            self._check(self._image.write_scanlines(*rows, spec.z, pixels))

    def _check(self, done: bool) -> None:
        if not done:
            self._image.geterror()
            if free_bytes(self._folder) < _SPARE:
                raise OSError(ENOSPC, os.strerror(ENOSPC))
            raise OSError(f"the {self.format.suffixes[0]} file cannot be finished")

    def _check_room(self, size: int) -> None:
        """Raise OSError when ``size`` bytes of pixels may not fit: libjpeg ends the process when the disk is full."""
        # No band of a JPEG takes twice the bytes of its pixels.
        if self.format.name == "jpeg" and free_bytes(self._folder) < 2 * size + _SPARE:
            raise OSError(ENOSPC, os.strerror(ENOSPC))


def format_of_suffix(path: Path) -> ImageFormat:
    """Return the format that ``path`` is to be written in. Raises LutgenError for an unknown suffix."""
    for kind in FORMATS:
        if path.suffix.lower() in kind.suffixes:
            return kind
    raise pick_one("output suffix", path.suffix or path.name, (suffix for kind in FORMATS for suffix in kind.suffixes))


def _sniff(path: Path) -> ImageFormat:
    if not path.exists():
        raise LutgenError(f"{path}: there is no such image.")
    if not path.is_file():
        raise LutgenError(f"{path}: is not a file. Give the path of an image.")
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise LutgenError(f"{path}: cannot read the image: {reason_of(error)}.") from None
    if not start:
        raise LutgenError(f"{path}: the image is empty (0 bytes).")
    for kind in FORMATS:
        if start.startswith(kind.magic):
            return kind
        if any(magic.startswith(start) for magic in kind.magic):
            raise _damaged(path)
    names = ", ".join(kind.suffixes[0].removeprefix(".").upper() for kind in FORMATS)
    raise LutgenError(f"{path}: not an image that lutgen reads. It reads {names}, known by their first bytes.")


def _check_channels(path: Path, spec: Any) -> bool:
    """Whether there is alpha. Raises LutgenError unless the pixels are RGB or RGBA of an allowed depth."""
    if spec.width < 1 or spec.height < 1:
        raise LutgenError(f"{path}: the image is empty ({spec.width} × {spec.height} pixels).")
    allowed = "lutgen ages RGB, with or without alpha. Convert the image to RGB first."
    colour = str(spec.get_string_attribute("tiff:ColorSpace") or spec.get_string_attribute("jpeg:ColorSpace"))
    photometric = int(spec.get_int_attribute("tiff:PhotometricInterpretation", 2))
    if colour.upper() in ("CMYK", "YCBCRK", "YCCK") or photometric == _TIFF_INKS:
        raise LutgenError(f"{path}: stores inks (CMYK), not light. {allowed}")
    if spec.nchannels not in (3, 4):
        plural = "" if spec.nchannels == 1 else "s"
        raise LutgenError(f"{path}: has {spec.nchannels} channel{plural}. {allowed}")
    names = [str(name) for name in spec.channelnames]
    if [name.upper() for name in names[:3]] != ["R", "G", "B"] or (spec.nchannels == 4 and spec.alpha_channel != 3):
        raise LutgenError(f"{path}: its channels are {', '.join(names)}. {allowed}")
    if photometric in _TIFF_LAB:
        raise LutgenError(f"{path}: stores CIE Lab, not RGB. {allowed}")
    if spec.deep or spec.depth > 1:
        raise LutgenError(f"{path}: is a deep or volume image. {allowed}")
    return bool(spec.nchannels == 4)


_TIFF_INKS, _TIFF_LAB = 5, (8, 9, 10)
_TIFF = next(kind for kind in FORMATS if kind.name == "tiff")


def _dtype(path: Path, oiio_format: Any) -> np.dtype[Any]:
    name = str(oiio_format)
    if name not in _DTYPES:
        raise LutgenError(f"{path}: stores {name} numbers. lutgen reads {', '.join(_DTYPES)}; convert the image first.")
    return np.dtype(_DTYPES[name])


def _encoding(path: Path, spec: Any, kind: ImageFormat) -> str:
    """What the file says that it stores, or what files of its format do."""
    named = str(spec.get_string_attribute("oiio:ColorSpace")).lower()
    primaries = spec.getattribute("chromaticities") or _SRGB_PRIMARIES
    if max(abs(a - b) for a, b in zip(primaries, _SRGB_PRIMARIES, strict=False)) > 1e-3:
        named = f"that of other primaries ({', '.join(f'{number:g}' for number in primaries)})"
    elif named in _LINEAR_NAMES:
        return LINEAR
    if named.startswith(("lin_", "aces", "that")):
        message = (
            f"{path}: its colour space is {named}; lutgen knows linear light of the sRGB primaries. Convert the image "
            "to linear sRGB first, or say what its numbers are with --source signal or --source linear."
        )
        raise LutgenError(message)
    return SIGNAL if named.startswith("srgb") else kind.encoding


def _kept(name: str, *, same_encoding: bool) -> bool:
    if name in ("oiio:colorspace", "iccprofile"):
        # A profile of the source's encoding would be wrong for another.
        return same_encoding
    return not name.startswith(_NOT_KEPT) and name not in _COMPRESSION


def _damaged(path: Path) -> LutgenError:
    return LutgenError(f"{path}: the image is truncated or damaged and cannot be read to its end. Get a whole copy.")
