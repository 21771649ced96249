"""Outputs of a command: JSON, tables and pictures in files, and after them a page on the terminal.

A place that cannot be written to is refused before any work is done.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lutgen import files
from lutgen.cli.terminal import say
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from lutgen.report.parts import Headline, Page, Table

#: ``--json`` to standard output.
STANDARD_OUTPUT = "-"

#: Letters in a line where standard output is no terminal.
WIDTH = 110


def check_new_file(path: str, *, force: bool, suffixes: Sequence[str] = ()) -> Path:
    """Return the path. Raises LutgenError: a folder, another suffix, not writable, or, unforced, there already."""
    file = files.check_new_file(path, force=force, suffixes=suffixes)
    _check_writable(file)
    return file


def check_json(json_to: str | None, *, force: bool) -> bool:
    """Refuse a file that JSON cannot be written to; say whether standard output belongs to JSON alone."""
    if json_to and json_to != STANDARD_OUTPUT:
        check_new_file(json_to, force=force)
    return json_to == STANDARD_OUTPUT


def check_pictures(folder: str, names: Iterable[str], *, force: bool) -> Path:
    """Return the folder when pictures of these names may be written into it; errors as in :func:`check_new_file`."""
    place = Path(folder)
    if place.exists() and not place.is_dir():
        raise LutgenError(f"{folder}: is a file. Give the name of a folder for the pictures.")
    for name in names:
        check_new_file(str(place / name), force=force)
    return place


def _check_writable(file: Path) -> None:
    place = next(parent for parent in file.absolute().parents if parent.exists())
    if not place.is_dir() or not os.access(place, os.W_OK):
        why = "no right to write there" if place.is_dir() else f"{place} is a file, not a folder"
        raise LutgenError(f"{file}: cannot write: {why}. Choose another place to write to.")


def write_json(content: Any, to: str) -> None:
    """Write JSON to a file, or to standard output for ``-``; what is not finite becomes null."""
    text = json.dumps(_plain(content), indent=1, ensure_ascii=False, allow_nan=False)
    if to == STANDARD_OUTPUT:
        click.echo(text)
    else:
        files.write_atomically(Path(to), f"{text}\n".encode())


def print_json(content: Any) -> None:
    """Print JSON for a program to read; what is not finite becomes null."""
    write_json(content, STANDARD_OUTPUT)


def _plain(content: Any) -> Any:
    if isinstance(content, dict):
        return {str(key): _plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_plain(value) for value in content]
    if isinstance(content, float):
        return float(content) if isfinite(content) else None
    return content


def print_page(page: Page) -> None:
    """Print sentences, wrapped at words on a terminal, and tables, of which nothing is cut off."""
    for part in page:
        if isinstance(part, str):
            # Without rich, which looks for emoji in paths and takes long to import.
            say(part)
        else:
            _print(part)


def _print(part: Headline | Table) -> None:
    from rich.console import Console

    from lutgen.cli.terminal import fitted
    from lutgen.report.parts import Headline, headline_text, terminal_table

    console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH)
    if isinstance(part, Headline):
        console.print(headline_text(part), soft_wrap=not sys.stdout.isatty())
        return
    laid_out = terminal_table(part)
    fitted(laid_out, console).print(laid_out)
    for note in part.notes:
        say(note)


@dataclass(frozen=True)
class Outputs:
    """Outputs of a command: a page on the terminal, and the files of --json, --csv and --plots."""

    json_to: str | None
    csv_to: str | None = None
    plots: str | None = None
    pictures: Callable[[], Iterable[str]] = tuple
    force: bool = False

    def __post_init__(self) -> None:
        """Raise LutgenError, before any work is done for them, for places that cannot be written to."""
        check_json(self.json_to, force=self.force)
        if self.csv_to:
            check_new_file(self.csv_to, force=self.force)
        if self.plots:
            check_pictures(self.plots, self.pictures(), force=self.force)

    @property
    def alone(self) -> bool:
        """Whether standard output belongs to JSON alone."""
        return self.json_to == STANDARD_OUTPUT

    def write(
        self,
        page: Page,
        as_json: Callable[[], Any],
        *,
        as_csv: Callable[[], str] = str,
        plot: Callable[[str], Sequence[Path]] = lambda _folder: (),
    ) -> None:
        """Write the table, the pictures and the JSON that were asked for; then print the page."""
        if self.csv_to:
            files.write_atomically(Path(self.csv_to), as_csv().encode())
        pictures = plot(self.plots) if self.plots else ()
        if self.json_to:
            write_json(as_json(), self.json_to)
        if not self.alone:
            print_page(page)
            if self.plots:
                print_page([f"Pictures: {', '.join(map(str, pictures))}"])
