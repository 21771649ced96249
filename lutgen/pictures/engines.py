"""Engines that turn a block of pixels into the pixels of the aged display: the direct model, or a built LUT.

An engine takes planes of shape (3, n) in 0..1, in the engine's encoding. It returns planes in the same encoding, in
0..1. With these planes an un-aged sRGB viewer shows the aged colours.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.formats import lut_suffixes
from lutgen.bindings import lut_processor
from lutgen.colorimetry import XYZ_TO_LINEAR, Array, linear_to_code, transform
from lutgen.display import AgedDisplay
from lutgen.display.chain import outside_gamut
from lutgen.display.on_screen import linear_at
from lutgen.display.paper import TIE, Matrices, Selection, paper_links
from lutgen.errors import LutgenError, pick_one
from lutgen.files import is_file
from lutgen.names import LINEAR, SIGNAL
from lutgen.pictures.encoding import Decoder, Encoder, Storage, Stored

#: Whether each pixel's aged colour lies outside the viewer's gamut, shape (n,); None: the engine does not know.
Clipped = NDArray[np.bool_] | None


class Engine(Protocol):
    """Ages planes. Safe to call from several threads at once."""

    @property
    def works_in(self) -> str:
        """``SIGNAL`` or ``LINEAR``: the encoding of input and output planes."""
        ...

    def __call__(self, planes: Array, first: int, /) -> tuple[Array, Clipped]:
        """Age planes (3, n) in 0..1, of the n pixels from index ``first`` on, row by row."""
        ...


def engine_for(aging: AgedDisplay | str | Path) -> Engine:
    """Return the engine for an aged display (the direct model) or for the path of a LUT file."""
    if isinstance(aging, (str, Path)):
        return LutEngine(Path(aging), _processor(Path(aging)))
    return PaperEngine(aging) if paper_links(aging) else ChainEngine(aging)


@dataclass(frozen=True)
class Unaged:
    """Returns planes unchanged: the un-aged half of a side-by-side image."""

    works_in: str

    def __call__(self, planes: Array, _first: int = 0) -> tuple[Array, Clipped]:
        """Return the planes."""
        return planes, None


@dataclass(frozen=True)
class ChainEngine:
    """Evaluates any chain of links, as ``AgedDisplay`` does."""

    aged: AgedDisplay
    #: Function (index of the first pixel, n) → places of n pixels on the screen, (n, 2); None: all lie at one place.
    places: Callable[[int, int], Array] | None = None
    works_in: str = SIGNAL

    def __call__(self, planes: Array, first: int = 0) -> tuple[Array, Clipped]:
        """Age code values (3, n)."""
        if self.places:
            linear = linear_at(self.aged, planes.T, self.places(first, planes.shape[1]))
        else:
            linear = self.aged.code_to_linear(planes.T)
        return linear_to_code(np.clip(linear, 0.0, 1.0)).T, outside_gamut(linear)


@dataclass(frozen=True)
class PaperEngine:
    """Evaluates the paper's chain in double precision, by groups of colours that share a matrix: four times as fast."""

    aged: AgedDisplay
    works_in: str = LINEAR

    @cached_property
    def _matrices(self) -> Array:
        """Mean of XYZ_TO_LINEAR · T over each subset of w, r, g, b, coded as bits 1, 2, 4, 8: shape (16, 3, 3)."""
        (emission,) = (link for link in self.aged.tail if isinstance(link, Matrices))
        each = XYZ_TO_LINEAR @ emission.array
        members = (np.arange(16)[:, np.newaxis] >> np.arange(4)) & 1
        mean = np.einsum("si,ijk->sjk", members / np.maximum(members.sum(axis=1, keepdims=True), 1), each)
        return np.asarray(mean)

    def __call__(self, planes: Array, _first: int = 0) -> tuple[Array, Clipped]:
        """Age linear light (3, n)."""
        chosen = self._chosen(planes)
        colours = np.bincount(chosen, minlength=16)
        # First transform all colours by the most frequent matrix, then the rest by their own: this copies fewest
        # pixels.
        usual = int(np.argmax(colours))
        aged = transform(self._matrices[usual], planes.T).T
        colours[usual] = 0
        for which in np.flatnonzero(colours):
            where = np.flatnonzero(chosen == which)
            part = transform(self._matrices[which], planes.take(where, axis=1).T).T
            for plane, values in zip(aged, part, strict=True):
                plane[where] = values
        clipped = outside_gamut(aged.T)
        return np.clip(aged, 0.0, 1.0, out=aged), clipped

    def _chosen(self, linear: Array) -> NDArray[np.uint8]:
        """Return which of w, r, g, b are selected for each colour, as bits 1, 2, 4, 8: (3, n) → (n,)."""
        # As ``paper.nearest_weights``, but by scores: score = (|l|² + 1 − d²)/2 for a distance d. So a distance within
        # ``TIE`` of the smallest is a score within ``TIE``·d of the largest; d is 0.7 to 1 where two colour points are
        # equally near.
        red, green, blue = linear
        if self.aged.head[1] != Selection("nearest"):
            limit = np.minimum(np.minimum(red, green), blue) + TIE
            return _bits([red <= limit, green <= limit, blue <= limit], first=1)
        white = red + green + blue - 1.0
        limit = np.maximum(np.maximum(red, green), np.maximum(blue, white)) - TIE
        return _bits([white >= limit, red >= limit, green >= limit, blue >= limit], first=0)


@dataclass(frozen=True)
class LutEngine:
    """Applies a LUT file of code values, interpolated tetrahedrally by OpenColorIO in single precision."""

    path: Path
    processor: Any
    works_in: str = SIGNAL

    def __call__(self, planes: Array, _first: int = 0) -> tuple[Array, Clipped]:
        """Age code values (3, n). A LUT holds no record of the colours that were clipped when it was built."""
        pixels = np.ascontiguousarray(planes.T, dtype=np.float32)
        self.processor.applyRGB(pixels)
        if not np.isfinite(pixels).all():
            raise LutgenError(f"{self.path}: gives NaN or infinity for colours of this image. Build the LUT again.")
        return np.clip(pixels.T.astype(np.float64, order="C"), 0.0, 1.0), None


def _bits(flags: Sequence[NDArray[np.bool_]], *, first: int) -> NDArray[np.uint8]:
    result = flags[0].view(np.uint8) << np.uint8(first)
    for bit, flag in enumerate(flags[1:], first + 1):
        result |= flag.view(np.uint8) << np.uint8(bit)
    return result


#: A row of numbers of a LUT in which a number is NaN or infinite, as programs write it (``-1.#IND``: Windows). The text
#: of a description is no number.
_NOT_FINITE = re.compile(
    rb"(?i)(?:[^\n]*<(?!(?:input|output)?descript)[^<>\n]*>)?[ \t0-9.e+-]*?"
    rb"([+-]?(?:nan|inf|infinity|[0-9]\.#[a-z0-9]+))(?=[\s<]|\Z)"
)

#: Parts of such numbers, which are quick to find.
_SUSPICIOUS = re.compile(rb"[nN][aA][nN]|[iI][nN][fF]|\.#")


def _processor(path: Path) -> Any:
    if path.suffix.lower() not in lut_suffixes():
        raise pick_one("kind of LUT", path.name, (f"a {suffix} file" for suffix in lut_suffixes()))
    if not is_file(path):
        raise LutgenError(f"{path}: there is no such LUT. Give the path of one that lutgen build wrote.")
    processor = lut_processor(path).getDefaultCPUProcessor()
    # OpenColorIO reads such a number as 0, without a warning.
    data = path.read_bytes()
    for suspicious in _SUSPICIOUS.finditer(data):
        if bad := _NOT_FINITE.match(data, data.rfind(b"\n", 0, suspicious.start()) + 1):
            line = data.count(b"\n", 0, bad.start(1)) + 1
            raise LutgenError(
                f"{path}, line {line}: holds {bad[1].decode()!r}, and a LUT needs finite numbers. Export it again; "
                f"`lutgen lint {path}` lists all its faults."
            )
    return processor


#: Pixels aged at a time. Fewer pixels need more calls; planes of more pixels do not fit into the cache.
BLOCK = 16_384


#: Number of pixels with an aged colour outside the viewer's gamut (None: unknown), and with a source outside 0..1.
PixelCounts = tuple[int | None, int]


@dataclass(frozen=True)
class Shader:
    """Ages every pixel."""

    source: Storage
    target: Storage
    engine: Engine
    chunk: int = BLOCK

    @cached_property
    def _decode(self) -> Decoder:
        return Decoder(self.source, self.engine.works_in)

    def __call__(self, stored: Stored, out: Stored, first: int = 0) -> PixelCounts:
        """Age ``stored`` (n, channels) into ``out`` (n, channels); ``first`` is the index in the picture of row 0."""
        clipped, source_clipped = self.shade(stored, out, first)
        return None if clipped is None else int(np.count_nonzero(clipped)), source_clipped

    def shade(self, stored: Stored, out: Stored, first: int = 0) -> tuple[Clipped, int]:
        """As ``__call__``, but return which pixels are outside the viewer's gamut."""
        planes, source_clipped = self._decode(stored)
        aged, clipped = self.engine(planes, first)
        Encoder(self.target, self.engine.works_in)(aged, stored, self.source.white, out)
        return clipped, source_clipped


#: Bits of a table's entry above the aged colour's three bytes. An entry of 0 is not computed yet.
_SEEN, _CLIPPED, _UNKNOWN = (np.uint32(1 << bit) for bit in (24, 25, 26))
_COLOUR = np.uint32(0x00FF_FFFF)


@dataclass(frozen=True)
class TableShader:
    """Ages every 8-bit colour once, and caches it in a table of 64 MB. Threads write equal entries, so need no lock."""

    shader: Shader
    chunk: int = 8 * BLOCK
    _table: NDArray[np.uint32] = field(default_factory=lambda: np.zeros(1 << 24, "<u4"), repr=False, compare=False)

    def __call__(self, stored: Stored, out: Stored, _first: int = 0) -> PixelCounts:
        """Age ``stored`` (n, channels) into ``out`` (n, channels)."""
        colours = _packed(stored)
        shown = self._table.take(colours)
        new = shown == 0
        if new.any():
            self._add(np.unique(colours[new]))
            shown = self._table.take(colours)
        out[:, :3] = _bytes(shown)[:, :3]
        out[:, 3:] = stored[:, 3:]
        unknown = bool(shown[0] & _UNKNOWN)
        return None if unknown else int(np.count_nonzero(shown & _CLIPPED)), 0

    def _add(self, colours: NDArray[np.uint32]) -> None:
        channels = self.shader.source.channels
        for start in range(0, len(colours), self.shader.chunk):
            part = colours[start : start + self.shader.chunk]
            entries = np.zeros(len(part), "<u4")
            clipped, _ = self.shader.shade(_bytes(part)[:, :channels], _bytes(entries)[:, :channels])
            entries |= _SEEN | (_UNKNOWN if clipped is None else clipped * _CLIPPED)
            self._table[part] = entries


def shader_for(source: Storage, target: Storage, engine: Engine) -> Shader | TableShader:
    """Return the fastest shader: a table for 8-bit pixels whose aged colour depends on neither alpha nor place."""
    shader = Shader(source, target, engine)
    eight_bits = source.dtype == target.dtype == np.uint8
    placed = isinstance(engine, ChainEngine) and engine.places
    return TableShader(shader) if eight_bits and not (source.associated or target.associated or placed) else shader


def _packed(stored: Stored) -> NDArray[np.uint32]:
    """Pack (n, 3 or 4) bytes into (n,) numbers of three bytes, red lowest."""
    if stored.shape[1] == 4:
        return np.ascontiguousarray(stored).view("<u4")[:, 0] & _COLOUR
    packed = np.zeros(len(stored), "<u4")
    _bytes(packed)[:, :3] = stored
    return packed


def _bytes(packed: NDArray[np.uint32]) -> NDArray[np.uint8]:
    """Return a view of (n,) numbers as (n, 4) bytes, red first."""
    return packed.view(np.uint8).reshape(-1, 4)
