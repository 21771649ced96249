"""The terminal: sentences wrapped at words, tables that fit, a progress bar, and pipes that their reader has closed."""

from __future__ import annotations

import io
import re
import sys
from contextlib import contextmanager
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.console import Console
    from rich.table import Column, Table


def say(text: str, *, err: bool = False) -> None:
    """Print sentences to standard output or standard error; a terminal gets them wrapped at words."""
    stream = sys.stderr if err else sys.stdout
    click.echo(wrapped(text, get_terminal_size().columns) if stream.isatty() else text, err=err)


#: A space in a number, such as 18 000, where no line may break; and what stands in its place while lines are broken.
_IN_A_NUMBER, _FIXED_SPACE = re.compile(r"(?<=\d) (?=\d{3}(?!\d))"), "\u2007"


def with_fixed_spaces(text: str) -> str:
    """Replace the spaces in numbers, such as 18 000, by spaces at which no line is broken."""
    return _IN_A_NUMBER.sub(_FIXED_SPACE, text)


def with_plain_spaces(text: str) -> str:
    """Undo :func:`with_fixed_spaces`."""
    return text.replace(_FIXED_SPACE, " ")


def wrapped(text: str, width: int) -> str:
    """Wrap each line at words; a continued line is indented as its beginning; long words and commands stay whole."""
    return "\n".join(part for line in text.split("\n") for part in _wrapped_line(line, width))


def _wrapped_line(line: str, width: int) -> list[str]:
    words = line.lstrip()
    if len(line) <= width or words.startswith("lutgen "):
        return [line]
    indent = line[: len(line) - len(words)]
    before, colon, command = line.partition(":  lutgen ")
    if colon:
        return [*_wrapped_line(f"{before}:", width), f"{indent}  lutgen {command}"]
    parts = wrap(
        with_fixed_spaces(words),
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
        replace_whitespace=False,
    )
    return [with_plain_spaces(part) for part in parts]


@contextmanager
def progress_bar(title: str, *, quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Show a bar on standard error while something runs; only when that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


class _PipeStream(io.FileIO):
    """A standard stream that drops what is written after its reader closed the pipe; other faults raise once."""

    _failed = False

    def write(self, data: Any, /) -> int:
        """Write to the stream, or drop the data after a failure. Raises OSError once, and never for EPIPE."""
        if self._failed:
            return memoryview(data).nbytes
        try:
            return super().write(data)
        except BrokenPipeError:
            self._failed = True
            return memoryview(data).nbytes
        except OSError:
            self._failed = True
            raise


def tolerate_closed_pipes() -> None:
    """Let the reader of standard output and standard error close the pipe, as in ``lutgen … | head -1``."""
    # A test or a program that has replaced a stream keeps its own.
    if sys.stdout is sys.__stdout__ and isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout = _for_a_pipe(sys.stdout)
    if sys.stderr is sys.__stderr__ and isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = _for_a_pipe(sys.stderr)


def _for_a_pipe(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    return io.TextIOWrapper(
        io.BufferedWriter(_PipeStream(stream.fileno(), "w", closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


#: Letters of a cell that is never wrapped: a figure with its unit, a span, an hour, a short name.
WHOLE_CELL = 16
#: Letters of a word that may be folded: a path.
LONGEST_WORD = 40


def fitted(table: Table, console: Console) -> Console:
    """Narrow the columns to fit the console, or widen the console: rich would cut 0.3127 to 0.312."""
    # Imported here, since most commands print no table and rich takes long to import.
    from rich.cells import cell_len
    from rich.console import Console
    from rich.measure import Measurement

    natural = [max(map(cell_len, _texts(column))) for column in table.columns]
    unbounded = console.options.update(width=2 * sum(natural) + 100)
    between = Measurement.get(console, unbounded, table).maximum - sum(natural)
    if sum(natural) + between <= console.width:
        return console
    least = [_least(column) for column in table.columns]
    widths = list(natural)
    while sum(widths) + between > console.width and widths != least:
        place = max(range(len(widths)), key=lambda column: (widths[column] > least[column], widths[column]))
        widths[place] -= 1
    for column, width in zip(table.columns, widths, strict=True):
        column.width, column.no_wrap = width, False
    return Console(file=console.file, highlight=False, width=max(console.width, sum(widths) + between))


def _texts(column: Column) -> list[str]:
    return [line for cell in (column.header, *column.cells) for line in str(cell).split("\n")]


def _least(column: Column) -> int:
    return max(_longest_word(str(column.header)), *map(_least_of, column.cells), 1)


def _least_of(cell: object) -> int:
    from rich.cells import cell_len
    from rich.text import Text

    text = str(cell)
    if cell_len(text) <= WHOLE_CELL or (isinstance(cell, Text) and cell.no_wrap):
        return cell_len(text)
    return max(WHOLE_CELL, min(LONGEST_WORD, _longest_word(text)))


def _longest_word(text: str) -> int:
    from rich.cells import cell_len

    return max(map(cell_len, text.split()), default=0)
