"""The slides of a cohort: files, folders of files, and lists of them; each once, however often it is named."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.cells import is_comment
from lutgen.errors import LutgenError
from lutgen.files import files_below, read_at_most
from lutgen.pictures import blocks
from lutgen.pictures.images import FORMATS

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Sequence

#: What is taken of a folder.
SUFFIXES = tuple(suffix for kind in FORMATS for suffix in kind.suffixes) + blocks.SUFFIXES

#: A list of slides ends in this.
LIST = ".txt"

#: A path of some hundred bytes for each of a hundred thousand slides.
MAX_BYTES = 64_000_000

#: Slides that are an index beside a folder of the same name, which holds the pixels.
_WITH_FOLDER = ".mrxs"


@dataclass(frozen=True)
class CohortSlide:
    """One slide of a cohort.

    Attributes
    ----------
    name
        Its path as it was given.
    path
        Its whole path, the same from every folder.
    bytes, changed_ns
        Its size, and when it was last changed, in nanoseconds since 1970; 0 where there is no such file.

    """

    name: str
    path: str
    bytes: int
    changed_ns: int


def find_slides(given: Sequence[str | Path]) -> tuple[CohortSlide, ...]:
    """Return the slides that files, folders and lists name, in that order; those of a folder by name.

    A folder gives all images and slides in it and below; what begins with a dot is left out. A list (.txt) holds a path
    a line, seen from the list's folder; empty lines and those that begin with # say nothing. A file that is not there
    is a slide too, one that cannot be read.

    Raises
    ------
    LutgenError
        Nothing was given, a folder or a list without slides, or one that cannot be read.

    """
    if not given:
        raise LutgenError("no slide was given. Give slides, a folder of them, or a list (.txt) of a path a line.")
    slides: dict[str, CohortSlide] = {}
    for each in given:
        for path in _named(Path(each)):
            slide = _slide(path)
            slides.setdefault(slide.path, slide)
    return tuple(slides.values())


def _named(given: Path) -> Iterable[Path]:
    files = files_below(given, SUFFIXES)
    if files is None:
        return _in_list(given) if given.suffix.lower() == LIST else [given]
    if not files:
        raise LutgenError(f"{given}: no slide in this folder or below. Looked for {', '.join(SUFFIXES)}.")
    return files


def _in_list(file: Path) -> list[Path]:
    advice = "A list holds the path of a slide a line."
    data = read_at_most(file, MAX_BYTES, what="the list of slides", none="list of slides", advice=advice)
    try:
        lines = [line.strip() for line in data.decode("utf-8-sig").splitlines()]
    except UnicodeDecodeError:
        raise LutgenError(f"{file}: cannot read the list of slides: it is not utf-8 text. {advice}") from None
    files = [file.parent / line for line in lines if line and not is_comment(line)]
    if not files:
        raise LutgenError(f"{file}: names no slide. {advice}")
    return files


def _slide(path: Path) -> CohortSlide:
    whole = path.resolve()
    parts = list(_parts(whole))
    return CohortSlide(
        str(path), str(whole), sum(part.st_size for part in parts), max((part.st_mtime_ns for part in parts), default=0)
    )


def _parts(path: Path) -> Iterator[os.stat_result]:
    files = [path]
    if path.suffix.lower() == _WITH_FOLDER:
        files += sorted(part for part in path.with_suffix("").rglob("*") if part.is_file())
    for file in files:
        with suppress(OSError):
            yield file.stat()
