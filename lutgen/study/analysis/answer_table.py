"""Answers as a CSV: ``reader,session,position,image,condition,seconds,ease,category,positive``."""

from __future__ import annotations

import csv
import io
from dataclasses import astuple, fields
from typing import TYPE_CHECKING

from lutgen.cells import number
from lutgen.errors import LutgenError
from lutgen.study.analysis.agreement import UNAGED
from lutgen.study.answer import MAX_SECONDS, Answer
from lutgen.study.csv_rows import Row, read_rows

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

COLUMNS = tuple(field.name for field in fields(Answer))


def read_answer_table(file: str | Path) -> tuple[str, tuple[Answer, ...]]:
    """Read a table of answers: the remark in its first line, and the answers in the order of the lines.

    Raises
    ------
    LutgenError
        As :func:`lutgen.study.csv_rows.read_rows`; a cell out of range; an image twice in a reader's session;
        a category that is positive in one line and negative in another.

    """
    remark, rows = read_rows(file, COLUMNS)
    made = []
    lines: dict[tuple[str, int, str], int] = {}
    sides: dict[str, tuple[bool, int]] = {}
    for row in rows:
        answer = _answer(row)
        line = lines.setdefault((answer.reader, answer.session, answer.image), row.line)
        if line != row.line:
            raise row.error("image", f"was answered in line {line} already, by this reader in this session.")
        side, line = sides.setdefault(answer.category, (answer.positive, row.line))
        if side != answer.positive:
            raise row.error("positive", f"contradicts line {line}, where {answer.category!r} has the other side.")
        made.append(answer)
    return remark, tuple(made)


def _answer(row: Row) -> Answer:
    return Answer(
        reader=row.text("reader"),
        session=row.whole("session", low=1),
        position=row.whole("position", low=1),
        image=row.text("image"),
        condition=row.text("condition"),
        seconds=row.number("seconds", low=0.0, high=MAX_SECONDS, above=True),
        ease=row.whole("ease", low=0, high=1000),
        category=row.text("category"),
        positive=row.yes_no("positive"),
    )


def answer_table(answers: Iterable[Answer], *, remark: str) -> str:
    """Write answers as a table whose first line is a remark. Raises LutgenError for a remark of several lines."""
    if not remark or not remark.isprintable():
        raise LutgenError("the remark of a table of answers must be one line of text.")
    text = io.StringIO()
    text.write(f"# {remark}\n")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for answer in answers:
        table.writerow([int(cell) if isinstance(cell, bool) else cell for cell in astuple(answer)])
    return text.getvalue()


def condition_order(answers: Iterable[Answer]) -> tuple[str, ...]:
    """Return the conditions of answers: ``none`` first, then by mode and hour."""
    return tuple(sorted({answer.condition for answer in answers}, key=_mode_and_hours))


def _mode_and_hours(condition: str) -> tuple[bool, str, float, str]:
    mode, _, hours = condition.partition("@")
    when = number(hours or "0")
    return mode != UNAGED or when is None, mode, when or 0.0, condition
