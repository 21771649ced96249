"""LUT file formats: one module each in this folder, found by its name (``cube.py`` is ``--format cube``).

A module has ``FORMAT``, a :class:`Format`. Listing the names imports none of them. A module's name cannot begin with a
digit or have a dash, so an underscore before one is no part of the format's name, and one inside is a dash:
``_3dl.py`` is ``--format 3dl``, ``icc_matrix.py`` is ``--format icc-matrix``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from lutgen.errors import pick_one

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.bake.lut import Lut, MatrixLut, Sampler
    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay


@dataclass(frozen=True)
class Provenance:
    """What a file says of its origin: a title, an identifier without spaces, and lines of text."""

    title: str
    identifier: str
    lines: tuple[str, ...]
    direction: str = "simulate"

    def __post_init__(self) -> None:
        """Remove line breaks from each text: a display's name or source may hold anything that a user typed."""
        object.__setattr__(self, "title", _one_line(self.title))
        object.__setattr__(self, "identifier", _one_line(self.identifier))
        object.__setattr__(self, "lines", tuple(_one_line(line) for line in self.lines))

    def comments(self, *, title: bool = True) -> bytes:
        """Return the lines as ``#`` comments, with or without the title before them.

        In UTF-8, of which the readers tried skip what follows ``#``: a display's name may be in any script.
        """
        lines = (self.title, *self.lines) if title else self.lines
        return "".join(f"# {line}\n" for line in lines).encode()


def _one_line(text: str) -> str:
    return text if text.isprintable() else "".join(letter if letter.isprintable() else " " for letter in text)


@dataclass(frozen=True)
class Reader:
    """How files that OpenColorIO does not read are read back; both raise LutgenError."""

    #: Sends code values (n, 3) through a file, without clipping what the file does not clip.
    apply: Callable[[Path, Array], Array]
    #: Gives the space (a key of ``SPACES``) and the size of a file's table; size 0 is a matrix.
    table: Callable[[Path], tuple[str, int]]


@dataclass(frozen=True)
class Format:
    """How one file format is made."""

    #: ``cube``, ``.cube`` and one sentence for the help text.
    name: str
    suffix: str
    summary: str
    #: Whether its files keep aged colours outside sRGB, so that wider viewers can show them.
    unclipped: bool
    #: Gives the bytes of a file.
    write: Callable[[Lut | MatrixLut, Provenance], bytes]
    #: How its table may be indexed, keys of ``SPACES``: the best certified is written.
    spaces: tuple[str, ...] = ("code",)
    #: The largest of the whole numbers, from 0 on, that its files hold; None: they hold decimals.
    largest: int | None = None
    #: Gives the points along an edge, where they are not those that the user asks for.
    points: Callable[[int], int] | None = None
    #: Gives the candidates for a display and a lattice size, where tables in ``spaces`` are not all of them.
    candidates: Callable[[Sampler, AgedDisplay, int], list[Lut | MatrixLut]] | None = None
    #: Gives what stands before the table's rows, where a file is that and rows of text alone.
    head: Callable[[Lut | MatrixLut, Provenance], bytes] | None = None
    #: How a file with this suffix is read back; None: by OpenColorIO, so that configs can use it.
    reader: Reader | None = None
    #: Name of the file in its display's folder, without the suffix: formats that share a suffix need their own.
    stem: str = "aged"
    #: Whether it can hold the correction for a display; a profile, which describes one, cannot.
    corrects: bool = True
    #: Whether a finer table follows any display; one that is too simple for that is held to its certificate alone.
    follows: bool = True
    #: Whether it can begin with the picture's own profile.
    takes_source: bool = False

    def bake(self, sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
        """Return the candidates for a display and a lattice size; the best certified is written."""
        if self.candidates:
            return self.candidates(sampler, aged, size)
        points = self.points(size) if self.points else size
        return sampler.candidates(aged, points, *self.spaces, clip=not self.unclipped, largest=self.largest)

    @property
    def file(self) -> str:
        """Name of the file in its display's folder."""
        return f"{self.stem}{self.suffix}"

    def file_in(self, direction: str) -> str:
        """Name of the file in a direction: aged.cube to ``simulate``, compensate.cube to ``compensate``."""
        return self.file if direction == "simulate" else self.file.replace("aged", direction, 1)


def format_names() -> list[str]:
    """Names of all formats, in alphabetical order."""
    return sorted(_modules())


@cache
def format_named(name: str) -> Format:
    """Return a format. Raises LutgenError that lists the choices."""
    modules = _modules()
    if name not in modules:
        raise pick_one("format", name, sorted(modules))
    chosen: Format = import_module(f"{__name__}.{modules[name]}").FORMAT
    return chosen


@cache
def lut_suffixes() -> tuple[str, ...]:
    """Suffixes of the LUT files that OpenColorIO reads, in the order of the formats' names."""
    formats = map(format_named, format_names())
    return tuple(dict.fromkeys(each.suffix for each in formats if each.reader is None))


@cache
def _modules() -> dict[str, str]:
    """Name of each format → name of its module."""
    return {module.name.lstrip("_").replace("_", "-"): module.name for module in iter_modules(__path__)}
