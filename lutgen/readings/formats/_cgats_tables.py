"""Parser of CGATS text: the tables of a file, each with keywords and rows. ``cgats`` interprets the tables.

The parser reads CGATS.5 and ArgyllCMS' own dialect (https://www.argyllcms.com/doc/File_Formats.html): comments from
``#``, strings in double quotes with doubled quotes inside, keywords with one value, ``BEGIN_DATA_FORMAT``,
``BEGIN_DATA``, several tables one after the other, and Argyll's free text between ``BEGIN_…`` and ``END_…``. The parser
compares the counts that the file states with its content.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import StringIO
from itertools import chain

from lutgen.cells import SPREADSHEET_ERROR, first_doubled, whole
from lutgen.errors import LutgenError
from lutgen.readings.formats._source import FileText
from lutgen.readings.session import MOST_READINGS

#: A quoted string with doubled quotes inside, a comment, or a bare word. A spreadsheet's error value counts as a word.
_TOKEN = re.compile(rf'"([^"]*(?:""[^"]*)*)"|((?!{SPREADSHEET_ERROR}(?:\s|$))#.*)|([^\s"#]+|#\S+)')

#: Keywords that enclose sections, and keywords of counts.
_FORMAT, _DATA = ("BEGIN_DATA_FORMAT", "END_DATA_FORMAT"), ("BEGIN_DATA", "END_DATA")
_FIELDS, _SETS = "NUMBER_OF_FIELDS", "NUMBER_OF_SETS"


@dataclass
class CgatsTable:
    """One table of a CGATS file."""

    #: First line of the table.
    line: int
    #: Identifier of the table, such as CTI3, CAL or CGATS.17; "": no identifier.
    kind: str = ""
    #: Keyword → value, and name of a block → its free text.
    keywords: dict[str, str] = field(default_factory=dict)
    #: Names of the columns, in capitals.
    fields: tuple[str, ...] = ()
    #: Cells of each row, in the order of ``fields``, and the first line of each row.
    rows: list[tuple[str, ...]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def tables(source: FileText) -> list[CgatsTable]:
    """Read all tables of a CGATS file.

    Raises LutgenError: the file is truncated, a number of fields or sets is wrong, a column occurs twice, or a string
    does not end. The message names the line.
    """
    closed: list[CgatsTable] = []
    lines = _lines(source)
    current: CgatsTable | None = None
    for at, words in lines:
        head = words[0].upper()
        current = current or CgatsTable(at)
        if head == _FORMAT[0]:
            current.fields = _fields(source, current, words[1:], at, lines)
        elif head == _DATA[0]:
            _read_rows(source, current, words[1:], at, lines)
            closed.append(current)
            current = None
        elif head in (_FORMAT[1], _DATA[1]):
            raise LutgenError(f"{source.at(at)}: {head} without its BEGIN: is a line missing above?")
        elif head.startswith("BEGIN_"):
            current.keywords[head.removeprefix("BEGIN_")] = _free_text(source, head, at, lines)
        elif len(words) == 1 and not current.keywords and not current.kind:
            current.kind = words[0]
        else:
            current.keywords[head] = " ".join(words[1:])
    if current is not None and (current.fields or not closed):
        place = f"{source.file}: the table of line {current.line}"
        raise LutgenError(f"{place} ends before its data (no BEGIN_DATA): cut off? Copy it again.")
    return closed


def _lines(source: FileText) -> Iterator[tuple[int, list[str]]]:
    """Yield number and words of each line with words, without comments."""
    for at, line in enumerate(StringIO(source.text, newline=None), start=1):
        words, place = [], 0
        stripped = line.strip()
        while place < len(stripped):
            match = _TOKEN.match(stripped, place)
            if match is None:
                if stripped[place].isspace():
                    place += 1
                    continue
                raise LutgenError(
                    f"{source.at(at)}: a string begins with a quote and does not end: is the line cut off?"
                )
            if match[1] is not None:
                words.append(match[1].replace('""', '"'))
            elif match[3] is not None:
                words.append(match[3])
            place = match.end()
        if words:
            yield at, words


def _fields(
    source: FileText, table: CgatsTable, first: list[str], begun: int, lines: Iterator[tuple[int, list[str]]]
) -> tuple[str, ...]:
    names = [*first, *(word for _, words in _until(source, _FORMAT, begun, lines) for word in words)]
    fields = tuple(name.upper() for name in names)
    doubled = first_doubled(fields)
    if doubled or not fields:
        what = f"column {doubled} appears twice" if doubled else "no column is named"
        raise LutgenError(f"{source.at(begun)}: {what} in the data format. Name each column once.")
    _check_count(source, table, _FIELDS, len(fields), f"the data format names {len(fields)}")
    return fields


def _read_rows(
    source: FileText, table: CgatsTable, first: list[str], begun: int, lines: Iterator[tuple[int, list[str]]]
) -> None:
    if not table.fields:
        raise LutgenError(
            f"{source.at(begun)}: data without a data format (BEGIN_DATA_FORMAT … END_DATA_FORMAT) above it."
        )
    width = len(table.fields)
    # A row may continue on the next line only if the file states the number of rows; otherwise a lost cell would go
    # unnoticed.
    wraps = _SETS in table.keywords
    row: list[str] = []
    start = begun
    # Words after BEGIN_DATA on its own line belong to the first row.
    for at, words in chain([(begun, first)] if first else [], _until(source, _DATA, begun, lines)):
        start = start if row else at
        row += words
        if len(row) > width or (len(row) < width and not wraps):
            raise LutgenError(
                f"{source.at(start)}: {len(row)} fields where the data format names {width}: "
                "is a value missing or doubled, or a decimal comma in it?"
            )
        if len(table.rows) == MOST_READINGS:
            raise LutgenError(f"{source.at(at)}: more than {MOST_READINGS} rows, which no session has. Split the file.")
        if len(row) == width:
            table.rows.append(tuple(row))
            table.lines.append(start)
            row = []
    if row:
        raise LutgenError(
            f"{source.at(start)}: {len(row)} fields where the data format names {width}: is a value missing?"
        )
    _check_count(source, table, _SETS, len(table.rows), f"{len(table.rows)} rows follow: cut off, or edited by hand")


def _until(
    source: FileText, pair: tuple[str, str], begun: int, lines: Iterator[tuple[int, list[str]]]
) -> Iterator[tuple[int, list[str]]]:
    begin, end = pair
    for at, words in lines:
        if words[-1].upper() == end:
            if words[:-1]:
                yield at, words[:-1]
            return
        if words[0].upper().startswith(("BEGIN_DATA", "END_DATA")):
            raise LutgenError(f"{source.at(at)}: {words[0]} before the {end} of line {begun}: is a line missing?")
        yield at, words
    raise LutgenError(f"{source.at(begun)}: {begin} without {end}: the file is cut off. Copy it again.")


def _free_text(source: FileText, head: str, begun: int, lines: Iterator[tuple[int, list[str]]]) -> str:
    end = f"END_{head.removeprefix('BEGIN_')}"
    parts: list[str] = []
    for _, words in lines:
        if words[0].upper() == end:
            return "\n".join(parts)
        parts.append(" ".join(f'"{word}"' if " " in word else word for word in words))
    raise LutgenError(f"{source.at(begun)}: {head} without {end}: the file is cut off. Copy it again.")


def _check_count(source: FileText, table: CgatsTable, name: str, count: int, held: str) -> None:
    stated = table.keywords.get(name)
    if stated is None:
        return
    number = whole(stated, least=0, most=10**9)
    if number is None:
        raise LutgenError(
            f"{source.file}: {name} of the table of line {table.line} is {stated[:40]!r}, no count. Give a number."
        )
    if number != count:
        raise LutgenError(
            f"{source.file}: {name} of the table of line {table.line} is {number}, but {held}. Copy the file again."
        )
