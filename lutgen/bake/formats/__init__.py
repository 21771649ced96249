"""LUT file formats: one module each in this folder, found by its name (``cube.py`` is ``--format cube``).

A module has ``FORMAT``, a :class:`Format`. Listing the names imports none of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from lutgen.errors import pick_one

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.bake.lut import Lut, MatrixLut, Sampler
    from lutgen.display import AgedDisplay


@dataclass(frozen=True)
class Provenance:
    """The birth certificate that a file carries: a title, an identifier without spaces, and lines of text."""

    title: str
    identifier: str
    lines: tuple[str, ...]

    def __post_init__(self) -> None:
        """Keep each text on its line: a display's name or source may hold anything that a user typed."""
        object.__setattr__(self, "title", _one_line(self.title))
        object.__setattr__(self, "identifier", _one_line(self.identifier))
        object.__setattr__(self, "lines", tuple(_one_line(line) for line in self.lines))


def _one_line(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)


@dataclass(frozen=True)
class Format:
    """How one file format is made.

    Attributes
    ----------
    name, suffix, summary
        ``cube``, ``.cube`` and one sentence for the help text.
    unclipped
        Whether its files keep aged colours outside sRGB, so that wider viewers can show them.
    bake
        Gives the candidates for a display and a lattice size; the best certified is written.
    write
        Gives the bytes of a file.

    """

    name: str
    suffix: str
    summary: str
    unclipped: bool
    bake: Callable[[Sampler, AgedDisplay, int], list[Lut | MatrixLut]]
    write: Callable[[Lut | MatrixLut, Provenance], bytes]


def format_names() -> list[str]:
    """Names of all formats, in alphabetical order."""
    return sorted(module.name for module in iter_modules(__path__))


def format_named(name: str) -> Format:
    """Return a format. Raises LutgenError that lists the choices."""
    if name not in format_names():
        raise pick_one("format", name, format_names())
    chosen: Format = import_module(f"{__name__}.{name}").FORMAT
    return chosen
