"""Read image files through OpenImageIO, in bands of rows, so that memory does not grow with the image's height.

A file's first bytes, never its name, give its format. An output file keeps the source's depth, alpha, metadata, ICC
profile, tiles and (lossless) compression, if the format of the output's suffix supports them.
"""

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from lutgen.bindings import oiio
from lutgen.colorimetry import SRGB_XY
from lutgen.errors import LutgenError, pick_one, reason_of
from lutgen.files import is_unicode, under_its_name
from lutgen.names import LINEAR, SIGNAL
from lutgen.pictures.encoding import Storage, Stored


@dataclass(frozen=True)
class ImageFormat:
    """An image format."""

    #: OpenImageIO's name of the format.
    name: str
    #: Suffixes; the first is the usual suffix.
    suffixes: tuple[str, ...]
    #: Possible first bytes of a file.
    magic: tuple[bytes, ...]
    #: OpenImageIO's name of the source's number type → name of the number type that is written.
    depths: Mapping[str, str]
    #: Encoding of files that do not state their encoding.
    encoding: str = SIGNAL
    #: Whether files may have alpha, and tiles.
    alpha: bool = True
    tiles: bool = False
    #: Whether a written file keeps the Orientation, by which viewers turn the picture.
    turns: bool = True
    #: Lossless compressions, which are kept. Other compressions become ``zip``, so that written numbers are exact.
    lossless: tuple[str, ...] = ()


DTYPES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16, "float": np.float32}

FORMATS = (
    ImageFormat(
        "png",
        (".png",),
        (b"\x89PNG\r\n\x1a\n",),
        dict.fromkeys(DTYPES, "uint16") | {"uint8": "uint8"},
        turns=False,
    ),
    ImageFormat("jpeg", (".jpg", ".jpeg"), (b"\xff\xd8\xff",), dict.fromkeys(DTYPES, "uint8"), alpha=False),
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

#: Suffix → format.
SUFFIXES = {suffix: kind for kind in FORMATS for suffix in kind.suffixes}

#: Pixels in a band: large enough for compressors to use every core, small enough to hold several bands in memory.
BAND = 1_500_000

#: Most rows of a TIFF's strip. Taller strips, often the whole image, are read in units of 32 rows, and the strips of
#: outputs have 32 rows.
MAX_STRIP = 512

#: OpenImageIO's names of linear light with the sRGB primaries (version 2.4: Linear; version 3: the other names).
_LINEAR_NAMES = ("linear", "scene_linear", "lin_srgb", "lin_rec709", "lin_rec709_scene", "lin_srgb_scene")

#: EXR's attribute `chromaticities`: x, y of red, green, blue and white.
_SRGB_PRIMARIES = tuple(float(number) for number in SRGB_XY[[1, 2, 3, 0]].ravel())


class ImageSource:
    """An open image: its size in pixels, its storage and its bands of rows."""

    def __init__(self, path: Path, image: Any, kind: ImageFormat, encoding: str) -> None:
        """Take an image that OpenImageIO has opened. Raises LutgenError for pixels that cannot be aged."""
        self.path, self.format = path, kind
        self._image, self.spec = image, image.spec()
        alpha = _check_channels(path, self.spec)
        associated = alpha and not self.spec.get_int_attribute("oiio:UnassociatedAlpha")
        encoding = encoding or _encoding(path, self.spec, kind)
        number = str(self.spec.format)
        if number not in DTYPES:
            known = ", ".join(DTYPES)
            raise LutgenError(f"{path}: stores {number} numbers. lutgen reads {known}; convert the image first.")
        self.storage = Storage(np.dtype(DTYPES[number]), encoding, alpha, associated)
        self.width, self.height = int(self.spec.width), int(self.spec.height)
        #: TIFF's Orientation, 1 to 8: how viewers turn or mirror the picture; 1: as stored.
        self.orientation = int(self.spec.get_int_attribute("Orientation", 1))

    @property
    def unit(self) -> int:
        """Number of rows to read together: a row of tiles, or whole strips of at least 32 rows, or 32."""
        if self.spec.tile_width:
            return int(self.spec.tile_height)
        strip = int(self.spec.get_int_attribute("tiff:RowsPerStrip", 1))
        return -(-32 // strip) * strip if strip <= MAX_STRIP else 32

    def bands(self) -> list[tuple[int, int]]:
        """Return the first (inclusive) and last (exclusive) row of each band, from 0 on, in whole units."""
        rows = max(BAND // self.width // self.unit, 1) * self.unit
        return [(first, min(first + rows, self.height)) for first in range(0, self.height, rows)]

    def blocks(self) -> list[tuple[int, int, int, int]]:
        """Return the first and last row and column of each block: a band, or whole tiles of a wide band."""
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
        # For some damage OpenImageIO returns no block, for some it returns a block and sets an error.
        if block is None or self._image.has_error:
            self._image.geterror()
            raise _damaged(self.path)
        return np.asarray(block).reshape(last - first, right - left, self.storage.channels)


@contextmanager
def open_source(path: Path, source: str = "auto") -> Iterator[ImageSource]:
    """Open an image. Raises LutgenError: missing, empty, damaged, no format of ``FORMATS``, or neither RGB nor RGBA."""
    kind = _sniff(path)
    if kind.name in ("png", "tiff") and not is_whole(path):
        raise _damaged(path)
    # OpenImageIO chooses the reader by the suffix, reads options after a question mark, and accepts only UTF-8 paths.
    named = path.suffix.lower() in kind.suffixes and "?" not in str(path) and is_unicode(path)
    with nullcontext(path) if named else under_its_name(path, kind.suffixes[0]) as link:
        image = opened_by_oiio(link)
        if image is None:
            raise _damaged(path)
        try:
            yield ImageSource(path, image, kind, "" if source == "auto" else source)
        finally:
            image.close()


def opened_by_oiio(path: Path) -> Any | None:
    """Open an image whose colours are not multiplied by alpha; None: OpenImageIO cannot read it."""
    lib = oiio()
    hint = lib.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    image = lib.ImageInput.open(str(path), hint)
    if image is None or image.has_error:
        # OpenImageIO prints unread messages when it is unloaded.
        (image or lib).geterror()
        return None
    return image


@contextmanager
def new_by_oiio(path: Path, kind: str, spec: Any, check: Callable[[bool], None]) -> Iterator[Any]:
    """Yield a new image file; ``check`` raises when it gets False. Raises OSError: the file cannot be created."""
    # Python's OSError says why a file cannot be created; OpenImageIO's message does not.
    path.touch()
    image = oiio().ImageOutput.create(kind)
    try:
        check(image.open(str(path), spec))
        yield image
    except BaseException:
        image.close()
        image.geterror()
        raise
    closed = image.close()
    image.geterror()
    check(closed)


def format_of_suffix(path: Path) -> ImageFormat:
    """Return the format of ``path``'s suffix, for writing. Raises LutgenError for none, or an unknown one."""
    if path.suffix.lower() in SUFFIXES:
        return SUFFIXES[path.suffix.lower()]
    if not path.suffix:
        raise LutgenError(f"{path}: has no suffix, which chooses the format. Add one of: {', '.join(SUFFIXES)}.")
    raise pick_one("output suffix", path.suffix, SUFFIXES)


def first_bytes(path: Path, what: str) -> bytes:
    """Return the bytes that name the format of a file. Raises LutgenError: ``what`` cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(16)
    except OSError as error:
        raise LutgenError(f"{path}: cannot read {what}: {reason_of(error)}.") from None


def _sniff(path: Path) -> ImageFormat:
    if not path.exists():
        raise LutgenError(f"{path}: there is no such image. Check the name and the folder.")
    if not path.is_file():
        raise LutgenError(f"{path}: is not a file. Give the path of an image.")
    start = first_bytes(path, "the image")
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
    """Return whether there is alpha. Raises LutgenError unless the pixels are RGB or RGBA of an allowed depth."""
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
TIFF = SUFFIXES[".tif"]


def _encoding(path: Path, spec: Any, kind: ImageFormat) -> str:
    """Return the encoding that the file states, or else the usual encoding of its format."""
    named = str(spec.get_string_attribute("oiio:ColorSpace")).lower()
    primaries = spec.getattribute("chromaticities") or _SRGB_PRIMARIES
    of_srgb = max(abs(a - b) for a, b in zip(primaries, _SRGB_PRIMARIES, strict=False)) <= 1e-3
    if of_srgb and named in _LINEAR_NAMES:
        return LINEAR
    if not of_srgb or named.startswith(("lin_", "aces")):
        space = named if of_srgb else f"that of other primaries ({', '.join(f'{number:g}' for number in primaries)})"
        raise LutgenError(
            f"{path}: its colour space is {space}; lutgen knows linear light of the sRGB primaries. Convert the image "
            "to linear sRGB first, or say what its numbers are with --source signal or --source linear."
        )
    return SIGNAL if named.startswith("srgb") else kind.encoding


def _damaged(path: Path) -> LutgenError:
    return LutgenError(f"{path}: the image is truncated or damaged and cannot be read to its end. Get a whole copy.")


# The image libraries miss or only print some damage: wrong checksums of PNG, and metadata cut off a TIFF's end.

#: Bytes of one value of each TIFF type (TIFF 6.0, section 2; 13: IFD; 16 to 18: BigTIFF).
_TIFF_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}


def is_whole(path: Path) -> bool:
    """Return whether a file that begins as a PNG or TIFF is complete, as far as can be checked without decoding it."""
    with path.open("rb") as file:
        check = _png_is_whole if file.read(1) == b"\x89" else _tiff_is_whole
        file.seek(0)
        try:
            return check(file, path.stat().st_size)
        except struct.error:
            return False


def _png_is_whole(file: BinaryIO, size: int) -> bool:
    """Return whether all chunks are present with right checksums. libpng would only print such errors."""
    file.seek(8)
    while file.tell() < size:
        head = file.read(8)
        (length,) = struct.unpack(">I", head[:4])
        if file.tell() + length + 4 > size:
            return False
        checksum, left = zlib.crc32(head[4:]), length
        while left:
            part = file.read(min(left, 1 << 20))
            checksum, left = zlib.crc32(part, checksum), left - len(part)
        if struct.unpack(">I", file.read(4)) != (checksum,):
            return False
        if head[4:] == b"IEND":
            return True
    return False


def _tiff_is_whole(file: BinaryIO, size: int) -> bool:
    """Return whether all data of the first directory lie inside the file.

    libtiff drops data outside without an error.
    """
    start = file.read(16)
    order = "<" if start[:2] == b"II" else ">"
    (version,) = struct.unpack(order + "H", start[2:4])
    # Formats of: the directory's offset; its number of entries; an entry's tag, type, count, and value or offset.
    big = version == 43
    where, number, entry = ("Q", "Q", "HHQQ") if big else ("I", "H", "HHII")
    (offset,) = struct.unpack_from(order + where, start, 8 if big else 4)
    file.seek(offset)
    (entries,) = struct.unpack(order + number, file.read(struct.calcsize(order + number)))
    length = struct.calcsize(order + entry)
    if file.tell() + entries * length > size:
        return False
    for _tag, kind, count, value in struct.iter_unpack(order + entry, file.read(entries * length)):
        bytes_ = count * _TIFF_SIZES.get(kind, 0)
        if bytes_ > struct.calcsize(where) and value + bytes_ > size:
            return False
    return True


def turned(frame: Any, orientation: int) -> Any:
    """Turn a frame (h, w, …) as the file's Orientation (Exif, 1 to 8) tells viewers to turn it."""
    if orientation in (5, 6, 7, 8):
        frame = frame.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        frame = frame[::-1]
    return frame[:, ::-1] if orientation in (2, 3, 6, 7) else frame


def turned_size(width: int, height: int, orientation: int) -> tuple[int, int]:
    """Return width and height of a picture after :func:`turned`."""
    return (width, height) if orientation < 5 else (height, width)
