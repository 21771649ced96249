"""Sentences on the terminal, wrapped at words; a pipe that its reader has closed is no error."""

from __future__ import annotations

import io
import sys
from shutil import get_terminal_size
from textwrap import wrap
from typing import Any

import click


def say(text: str, *, err: bool = False) -> None:
    """Print sentences to standard output or standard error; a terminal gets them wrapped at words."""
    stream = sys.stderr if err else sys.stdout
    click.echo(wrapped(text, get_terminal_size().columns) if stream.isatty() else text, err=err)


def wrapped(text: str, width: int) -> str:
    """Wrap each line at words; a continued line is indented as its beginning is.

    A word longer than a line, such as a path, stays whole, and so does a line that is a command to be copied; a command
    at the end of a line that is too long has a line of its own.
    """
    return "\n".join(part for line in text.split("\n") for part in _wrapped_line(line, width))


def _wrapped_line(line: str, width: int) -> list[str]:
    words = line.lstrip()
    if len(line) <= width or words.startswith("lutgen "):
        return [line]
    indent = line[: len(line) - len(words)]
    before, colon, command = line.partition(":  lutgen ")
    if colon:
        return [*_wrapped_line(f"{before}:", width), f"{indent}  lutgen {command}"]
    return wrap(
        words,
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
        replace_whitespace=False,
    )


class _Unread(io.FileIO):
    """A standard stream whose reader may leave: what is written after that is dropped.

    A command then still writes its files, and its exit code still says what it found. Any other fault, such as a full
    disk, is raised once, and not again when Python flushes the stream at exit.
    """

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
    """Let the reader of standard output and standard error leave, as in ``lutgen … | head -1``."""
    # A test or a program that has replaced a stream keeps its own.
    if sys.stdout is sys.__stdout__ and isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout = _unread(sys.stdout)
    if sys.stderr is sys.__stderr__ and isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = _unread(sys.stderr)


def _unread(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    return io.TextIOWrapper(
        io.BufferedWriter(_Unread(stream.fileno(), "w", closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
