"""Reports: what a model and its pictures say, for people. Every picture is one PNG, the same bytes on every run."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.files import replacing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.measurements import Measurements

#: PNG metadata: leaves out the version that matplotlib would write.
METADATA: Any = {"Software": None}


def check_new_png(path: str | Path, *, force: bool) -> Path:
    """Return ``path`` when a picture may be written there, before any work is done for it.

    Raises
    ------
    LutgenError
        Not a .png, a folder, or a file that exists, without ``force``.

    """
    path = Path(path)
    if path.suffix.lower() != ".png":
        message = f"{path}: pictures are written as PNG. Give a name that ends in .png."
        raise LutgenError(message)
    if path.is_dir():
        message = f"{path}: is a folder. Give the name of a .png file."
        raise LutgenError(message)
    if path.exists() and not force:
        message = f"{path}: exists already. Add --force to replace it, or choose another name."
        raise LutgenError(message)
    return path


@contextmanager
def new_png(path: str | Path, *, force: bool) -> Iterator[Path]:
    """Give the temporary path of a picture that takes its place whole; errors as in :func:`check_new_png`."""
    with replacing(check_new_png(path, force=force)) as partial:
        yield partial


def provenance(measurements: Measurements) -> str:
    """Say in one sentence where the readings come from; a reconstruction says so in its ``source`` line."""
    file, source = Path(measurements.file).name, measurements.metadata.get("source", "")
    if not source:
        return f"Readings: {file}, which does not say where they come from (no line `# source: …`)."
    return f"Readings: {file}. Source: {source}."


def pixels_of_colours(pixels: int, colours: int) -> str:
    """Count pixels and their distinct colours: 345 600 pixels of 50 304 colours, 1 pixel of 1 colour."""
    return (
        f"{spaced(pixels)} pixel{'' if pixels == 1 else 's'} of {spaced(colours)} colour{'' if colours == 1 else 's'}"
    )


def spaced(hours: float) -> str:
    """Write hours as people read them: 18 000, 562.5."""
    return f"{round(hours, 6):,}".removesuffix(".0").replace(",", "\N{NO-BREAK SPACE}")
