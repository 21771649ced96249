"""LUT file formats: each format is a module in this folder (``cube.py`` is ``--format cube``).

Each module defines ``FORMAT``, a :class:`Format`. Listing the names imports no module. The name of a Python module
cannot begin with a digit and cannot contain a dash. An underscore at the beginning is therefore no part of the format's
name, and an underscore inside stands for a dash: ``_3dl.py`` is ``--format 3dl``, ``icc_matrix.py`` is
``--format icc-matrix``.
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
    """The origin that a file states: a title, an identifier without spaces, and lines of text."""

    title: str
    identifier: str
    lines: tuple[str, ...]
    direction: str = "simulate"

    def __post_init__(self) -> None:
        """Remove line breaks from each text, since a user may type any text as a display's name or source."""
        object.__setattr__(self, "title", _one_line(self.title))
        object.__setattr__(self, "identifier", _one_line(self.identifier))
        object.__setattr__(self, "lines", tuple(_one_line(line) for line in self.lines))

    def comments(self, *, title: bool = True) -> bytes:
        """Return the lines as ``#`` comments in UTF-8, with or without the title before them.

        A display's name may be in any script. All tested readers skip the UTF-8 text after ``#``.
        """
        lines = (self.title, *self.lines) if title else self.lines
        return "".join(f"# {line}\n" for line in lines).encode()


def _one_line(text: str) -> str:
    return text if text.isprintable() else "".join(letter if letter.isprintable() else " " for letter in text)


@dataclass(frozen=True)
class Reader:
    """The functions that read back files that OpenColorIO cannot read. Both raise LutgenError."""

    #: Applies a file to code values (n, 3). It clips only where the file clips.
    apply: Callable[[Path, Array], Array]
    #: Returns the space (a key of ``SPACES``) and the size of a file's table; size 0 is a matrix.
    table: Callable[[Path], tuple[str, int]]


@dataclass(frozen=True)
class Format:
    """The properties of a file format, and the functions that write and read it."""

    #: For example ``cube`` and ``.cube``.
    name: str
    suffix: str
    #: Whether its files keep aged colours outside sRGB, so that viewers with a wider gamut can show them.
    unclipped: bool
    #: Returns the bytes of a file.
    write: Callable[[Lut | MatrixLut, Provenance], bytes]
    #: The spaces in which its table may be indexed, keys of ``SPACES``. The most faithful table is written.
    spaces: tuple[str, ...] = ("code",)
    #: The largest number of an integer format, whose smallest number is 0; None: its files hold decimals.
    largest: int | None = None
    #: Converts the requested number of points along an edge to the number that the format allows; None: any number.
    points: Callable[[int], int] | None = None
    #: Returns the candidates for a display and a lattice size; None: one table in each of ``spaces``.
    candidates: Callable[[Sampler, AgedDisplay, int], list[Lut | MatrixLut]] | None = None
    #: Returns the text before the table's rows, for formats that consist of this text and rows of text only.
    head: Callable[[Lut | MatrixLut, Provenance], bytes] | None = None
    #: The reader of files with this suffix; None: OpenColorIO reads them, so that configs can use them.
    reader: Reader | None = None
    #: Name of the file in its display's folder, without the suffix. Formats with the same suffix need different stems.
    stem: str = "aged"
    #: Whether it can hold a correction. A profile describes a display, so it cannot.
    corrects: bool = True
    #: Whether a finer table can follow any display. A format that cannot is compared with its certificate only.
    follows: bool = True
    #: Whether it can be combined with the picture's own profile.
    takes_source: bool = False

    def bake(self, sampler: Sampler, aged: AgedDisplay, size: int) -> list[Lut | MatrixLut]:
        """Return the candidates for a display and a lattice size. The most faithful candidate is written."""
        if self.candidates:
            return self.candidates(sampler, aged, size)
        points = self.points(size) if self.points else size
        return sampler.candidates(aged, points, *self.spaces, clip=not self.unclipped, largest=self.largest)

    @property
    def file(self) -> str:
        """The name of the file in its display's folder."""
        return f"{self.stem}{self.suffix}"

    def file_in(self, direction: str) -> str:
        """Return the name of the file: aged.cube for ``simulate``, compensate.cube for ``compensate``."""
        return self.file if direction == "simulate" else self.file.replace("aged", direction, 1)


def rows_after(
    head: Callable[[Lut | MatrixLut, Provenance], bytes], lut: Lut | MatrixLut, provenance: Provenance
) -> bytes:
    """Return the bytes of a file of text: ``head``, then the rows of the table; the ``write`` of such formats."""
    from lutgen.bake.digits import rows_of_text
    from lutgen.bake.lut import table_of

    return rows_of_text(table_of(lut).reshape(-1, 3), head=head(lut, provenance))


def format_names() -> list[str]:
    """Return the names of all formats, in alphabetical order."""
    return sorted(_modules())


@cache
def format_named(name: str) -> Format:
    """Return the format ``name``. Raises LutgenError with a list of the formats for an unknown name."""
    modules = _modules()
    if name not in modules:
        raise pick_one("format", name, sorted(modules))
    chosen: Format = import_module(f"{__name__}.{modules[name]}").FORMAT
    return chosen


@cache
def lut_suffixes() -> tuple[str, ...]:
    """Return the suffixes of the LUT files that OpenColorIO reads, in the order of the formats' names."""
    formats = map(format_named, format_names())
    return tuple(dict.fromkeys(each.suffix for each in formats if each.reader is None))


@cache
def _modules() -> dict[str, str]:
    """Return a dictionary: name of a format → name of its module."""
    return {module.name.lstrip("_").replace("_", "-"): module.name for module in iter_modules(__path__)}
