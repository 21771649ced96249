"""Outputs of a command: JSON, tables and pictures in files, sentences and tables on the terminal, and closed pipes.

A command refuses an output path that is not writable before it computes anything.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import click

from lutgen.errors import LutgenError
from lutgen.files import check_new_file, write_atomically

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rich.console import Console
    from rich.table import Column
    from rich.table import Table as TerminalTable

    from lutgen.progress import Progress
    from lutgen.report.parts import Code, Headline, Page, Table

#: ``--json`` to standard output.
STANDARD_OUTPUT = "-"

#: Letters in a line if standard output is no terminal.
WIDTH = 110


def write_json(content: Any, to: str) -> None:
    """Write JSON to a file, or to standard output for ``-``; numbers that are not finite become null."""
    text = json.dumps(_plain(content), indent=1, ensure_ascii=False, allow_nan=False)
    if to == STANDARD_OUTPUT:
        click.echo(text)
    else:
        write_atomically(Path(to), f"{text}\n".encode())


def print_json(content: Any) -> None:
    """Print JSON to standard output; numbers that are not finite become null."""
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
    """Print sentences and headlines, wrapped at words on a terminal, code as it is, and complete tables."""
    for part in page:
        if isinstance(part, str):
            # rich would replace emoji codes in paths, and takes long to import.
            say(part)
        else:
            _print(part)


def _print(part: Headline | Code | Table) -> None:
    from rich.console import Console

    from lutgen.report.parts import Code, Headline, headline_text, terminal_table

    if isinstance(part, Code):
        click.echo(part.text)
        return
    console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH)
    if isinstance(part, Headline):
        text = wrapped(part.text, console.width) if sys.stdout.isatty() else part.text
        console.print(headline_text(Headline(text)), soft_wrap=True)
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
        """Raise LutgenError for an output that is not writable, before the command computes anything."""
        if self.json_to and not self.alone:
            check_new_file(self.json_to, force=self.force)
        if self.csv_to:
            check_new_file(self.csv_to, force=self.force)
        if self.plots and Path(self.plots).exists() and not Path(self.plots).is_dir():
            raise LutgenError(f"{self.plots}: is a file. Give the name of a folder for the pictures.")
        for name in self.pictures() if self.plots else ():
            check_new_file(f"{self.plots}/{name}", force=self.force)

    @property
    def alone(self) -> bool:
        """Whether standard output holds only JSON."""
        return self.json_to == STANDARD_OUTPUT

    def write(
        self,
        page: Page,
        as_json: Callable[[], Any],
        *,
        as_csv: Callable[[], str] = str,
        plot: Callable[[str], Sequence[Path]] = lambda _folder: (),
    ) -> None:
        """Write the table, the pictures and the JSON that the options choose; then print the page."""
        if self.csv_to:
            write_atomically(Path(self.csv_to), as_csv().encode())
        pictures = plot(self.plots) if self.plots else ()
        if self.json_to:
            write_json(as_json(), self.json_to)
        if not self.alone:
            print_page(page)
            if self.plots:
                print_page([f"Pictures: {', '.join(map(str, pictures))}"])


def say(text: str, *, err: bool = False) -> None:
    """Print sentences to standard output or standard error; wrap them at words on a terminal."""
    stream = sys.stderr if err else sys.stdout
    click.echo(wrapped(text, get_terminal_size().columns) if stream.isatty() else text, err=err)


#: A space in a number or before its unit, such as 18 000 h, at which no line may break.
_IN_A_NUMBER = re.compile(r"(?<=\d)[ \N{NO-BREAK SPACE}](?=\d{3}(?!\d)|(?:h|%|lx|nm|°C|cd/m²|σ|×)(?!\w))")
#: The letter that replaces such a space during wrapping.
_FIXED_SPACE = "\N{FIGURE SPACE}"

#: A command inside a sentence: in backquotes; after a colon, to the end of the sentence; elsewhere, with its options.
_COMMAND = re.compile(
    r"`[^`]+`"
    r"|(?<=: )lutgen [a-z].*?(?=[.,;)]?$|[.,;)]+ )"
    r"|\blutgen [a-z]+(?: --?[a-z][a-z-]*(?: (?!-)[^\s.,;)]+)?)*"
)


def with_fixed_spaces(text: str) -> str:
    """Replace the spaces in numbers and before units, such as 18 000 h, with spaces at which no line breaks."""
    return _IN_A_NUMBER.sub(_FIXED_SPACE, text)


def _with_whole_commands(text: str) -> str:
    """Replace the spaces in commands, such as ``lutgen build --hours 0``, with spaces at which no line breaks."""
    return _COMMAND.sub(lambda command: command[0].replace(" ", _FIXED_SPACE), text)


def with_plain_spaces(text: str) -> str:
    """Undo :func:`with_fixed_spaces`."""
    return text.replace(_FIXED_SPACE, " ")


def wrapped(text: str, width: int) -> str:
    """Wrap each line at words. Continuation lines keep the indent; long words and commands are never broken."""
    return "\n".join(part for line in text.split("\n") for part in _wrapped_line(line, width))


def _wrapped_line(line: str, width: int) -> list[str]:
    words = line.lstrip()
    if len(line) <= width or words.startswith(("lutgen ", "Example: lutgen ")):
        return [line]
    indent = line[: len(line) - len(words)]
    before, colon, command = line.partition(":  lutgen ")
    if colon:
        return [*_wrapped_line(f"{before}:", width), f"{indent}  lutgen {command}"]
    parts = wrap(
        _with_whole_commands(with_fixed_spaces(words)),
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
        replace_whitespace=False,
    )
    return [with_plain_spaces(part) for part in parts]


@contextmanager
def progress_bar(title: str, *, quiet: bool = False) -> Iterator[Progress]:
    """Show a progress bar on standard error, if standard error is a terminal."""
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
    """A standard stream that drops data after its reader closed the pipe; any other error raises once."""

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
    """Let the reader of standard output and standard error close the pipe, as in ``lutgen … | head -1``.

    A stream that was closed before lutgen began, as by ``>&-``, is replaced by a stream that drops all data.
    """
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115 - open to the end
        # A test or a program may have replaced a stream: keep the replacement.
        elif stream is getattr(sys, f"__{name}__") and isinstance(stream, io.TextIOWrapper):
            setattr(sys, name, _for_a_pipe(stream))


def _for_a_pipe(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    return io.TextIOWrapper(
        io.BufferedWriter(_PipeStream(stream.fileno(), "w", closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


#: A line of a cell of at most so many letters is never wrapped: a figure with its unit, a span, an hour, a short name.
WHOLE_CELL = 16
#: A word of more letters may be broken: a path.
LONGEST_WORD = 40


def fitted(table: TerminalTable, console: Console) -> Console:
    """Narrow the columns to fit the console, or widen the console: rich would cut 0.3127 to 0.312."""
    # rich takes long to import, and most commands print no table.
    from rich.cells import cell_len
    from rich.console import Console
    from rich.measure import Measurement
    from rich.text import Text

    natural = [max(map(cell_len, _texts(column))) for column in table.columns]
    unbounded = console.options.update(width=2 * sum(natural) + 100)
    between = Measurement.get(console, unbounded, table).maximum - sum(natural)
    if sum(natural) + between <= console.width:
        return console
    heads = [str(column.header) for column in table.columns]
    cells = [max(map(_least_of, column.cells), default=1) for column in table.columns]
    least = [max(_longest_word(head), cell) for head, cell in zip(heads, cells, strict=True)]
    if sum(least) + between > console.width:
        # A heading such as white-shift then breaks after its hyphen.
        least = [max(_longest_word(head.replace("-", "- ")), cell) for head, cell in zip(heads, cells, strict=True)]
    widths = list(natural)
    while sum(widths) + between > console.width and widths != least:
        place = max(range(len(widths)), key=lambda column: (widths[column] > least[column], widths[column]))
        widths[place] -= 1
    for column, width in zip(table.columns, widths, strict=True):
        column.width, column.no_wrap = width, False
        if _longest_word(str(column.header)) > width:
            column.header = Text("\n".join(wrap(str(column.header), width)))
    return Console(file=console.file, highlight=False, width=max(console.width, sum(widths) + between))


def _texts(column: Column) -> list[str]:
    return [line for cell in (column.header, *column.cells) for line in str(cell).split("\n")]


def _least_of(cell: object) -> int:
    from rich.cells import cell_len
    from rich.text import Text

    most = max(map(cell_len, str(cell).split("\n")))
    if most <= WHOLE_CELL or (isinstance(cell, Text) and cell.no_wrap):
        return most
    return max(WHOLE_CELL, min(LONGEST_WORD, _longest_word(str(cell))))


def _longest_word(text: str) -> int:
    from rich.cells import cell_len

    return max(map(cell_len, text.split()), default=0)
