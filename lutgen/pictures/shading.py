"""From a block of stored pixels to a block of stored aged pixels: decode, age, encode."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.pictures.encoding import Decoder, Encoder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.pictures.encoding import Storage, Stored
    from lutgen.pictures.engines import Clipped, Engine


#: Pixels that are aged at a time: the planes of fewer cost more calls, those of more leave the cache.
BLOCK = 16_384


class Counts(NamedTuple):
    """Pixels whose aged colour the viewer's gamut clips (None: unknown), and those that the source's 0..1 does."""

    clipped: int | None
    source_clipped: int


def shader_for(source: Storage, target: Storage, engine: Engine) -> Shader | TableShader:
    """Return the fastest way: 8-bit pixels whose colour does not depend on alpha are looked up."""
    shader = Shader(source, target, engine)
    eight_bits = source.dtype == target.dtype == np.uint8
    if eight_bits and not source.associated and not target.associated:
        return TableShader(shader)
    return shader


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

    @cached_property
    def _encode(self) -> Encoder:
        return Encoder(self.target, self.engine.works_in)

    @property
    def changes(self) -> bool:
        """Whether source and target store differently."""
        return self.source != self.target

    def __call__(self, stored: Stored, out: Stored) -> Counts:
        """Age ``stored`` (n, channels) into ``out`` (n, channels)."""
        clipped, source_clipped = self.shade(stored, out)
        return Counts(None if clipped is None else int(np.count_nonzero(clipped)), source_clipped)

    def shade(self, stored: Stored, out: Stored) -> tuple[Clipped, int]:
        """As a call, but tell which pixels the viewer's gamut clips."""
        planes, source_clipped = self._decode(stored)
        aged, clipped = self.engine(planes)
        self._encode(aged, stored, self.source.white, out)
        return clipped, source_clipped


#: Bits of a table's entry above the aged colour's three bytes; an entry of 0 is still to be computed.
_SEEN, _CLIPPED, _UNKNOWN = (np.uint32(1 << bit) for bit in (24, 25, 26))
_COLOUR = np.uint32(0x00FF_FFFF)


@dataclass(frozen=True)
class TableShader:
    """Ages every colour of 8-bit pixels once: a table of all 16.7 million (64 MB), filled as they turn up.

    Threads share the table; two that meet the same new colour at once write the same entry.
    """

    shader: Shader
    chunk: int = 8 * BLOCK
    _table: NDArray[np.uint32] = field(default_factory=lambda: np.zeros(1 << 24, "<u4"), repr=False, compare=False)

    def __call__(self, stored: Stored, out: Stored) -> Counts:
        """Age ``stored`` (n, channels) into ``out`` (n, channels)."""
        colours = _packed(stored)
        found = self._table.take(colours)
        new = found == 0
        if new.any():
            self._add(np.unique(colours[new]))
            found = self._table.take(colours)
        out[:, :3] = _bytes(found)[:, :3]
        out[:, 3:] = stored[:, 3:]
        unknown = bool(found[0] & _UNKNOWN)
        return Counts(None if unknown else int(np.count_nonzero(found & _CLIPPED)), 0)

    def _add(self, colours: NDArray[np.uint32]) -> None:
        channels = self.shader.source.channels
        for start in range(0, len(colours), self.shader.chunk):
            part = colours[start : start + self.shader.chunk]
            entries = np.zeros(len(part), "<u4")
            clipped, _ = self.shader.shade(_bytes(part)[:, :channels], _bytes(entries)[:, :channels])
            entries |= _SEEN | (_UNKNOWN if clipped is None else clipped * _CLIPPED)
            self._table[part] = entries


def _packed(stored: Stored) -> NDArray[np.uint32]:
    """(n, 3 or 4) bytes → (n,) numbers of three bytes, red lowest."""
    if stored.shape[1] == 4:
        return np.ascontiguousarray(stored).view("<u4")[:, 0] & _COLOUR
    packed = np.zeros(len(stored), "<u4")
    _bytes(packed)[:, :3] = stored
    return packed


def _bytes(packed: NDArray[np.uint32]) -> NDArray[np.uint8]:
    """(n,) numbers → their (n, 4) bytes, red first; a view."""
    return packed.view(np.uint8).reshape(-1, 4)
