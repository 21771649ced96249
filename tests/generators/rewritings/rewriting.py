"""The type of a rewriting, its entry into a registry, and the groups of rows that several rewritings need."""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np

from tests.generators.table import Table, parsed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    Rewriting = Callable[[str], str]
    OfTable = Callable[[Table], Table]


class CannotRewrite(ValueError):  # noqa: N818, it is no error: the caller leaves this pair out and says so
    """This campaign cannot be written in this way. The message says why."""


def rewriting(registry: dict[str, Rewriting]) -> Callable[[OfTable], Rewriting]:
    """Return a decorator that enters a function of tables into a registry of functions of texts.

    The first line of the function's docstring is its name in the registry.
    """

    def enter(rewrite: OfTable) -> Rewriting:
        @wraps(rewrite)
        def of_text(text: str) -> str:
            table = parsed(text)
            rewritten = rewrite(table).text()
            if rewritten == table.text():
                raise CannotRewrite("the file is written so already")
            return rewritten

        registry[name_of(rewrite)] = of_text
        return of_text

    return enter


def name_of(function: Callable[..., object]) -> str:
    """Return the first line of the docstring, with a lower-case initial and without its full stop."""
    sentence = (function.__doc__ or "").partition("\n")[0].rstrip(".")
    return sentence[0].lower() + sentence[1:]


def random_of(table: Table) -> np.random.Generator:
    """Return a random generator whose seed is the text."""
    return np.random.default_rng(crc32(table.text().encode()))


def rows_of_each(labels: Iterable[object]) -> list[NDArray[np.intp]]:
    """Return the rows of each label; labels in the order of their first row."""
    groups: dict[object, list[int]] = {}
    for row, label in enumerate(labels):
        groups.setdefault(label, []).append(row)
    return [np.array(rows) for rows in groups.values()]


def rows_of_sessions(table: Table) -> list[NDArray[np.intp]]:
    """Return the rows of each session, earliest session first."""
    hours = table.numbers("hour")
    sessions = rows_of_each(zip(hours, table.session, strict=True))
    return sorted(sessions, key=lambda rows: float(hours[rows[0]]))
