"""Strict reading of numbers, metadata and rows from the text of files and options. Every reader uses these functions.

Python's ``float`` and ``int`` also accept ``1_000``, full-width and Arabic digits, ``nan`` and ``infinity``. ``int``
raises its own error for more than 4300 digits. Here a number consists of ASCII digits, with an optional decimal point
and an optional exponent. For any other text the functions return None. The caller's message says where the text is and
what is allowed.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable
from math import isfinite

#: Pattern of a decimal number, for use in other patterns: ``-1``, ``.5``, ``2.``, ``1e-3``. A text matches in one way
#: only, so that the pattern rejects a megabyte of digits in linear time.
NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"

#: Pattern of the texts that programs write for NaN and infinity.
NON_FINITE = r"[-+]?(?:nan|inf|infinity)"

#: Maximum number of characters of a cell. A double needs 17 digits. The limit is for files that are one endless cell.
LONGEST = 1000

_NUMBER, _WHOLE = re.compile(NUMBER), re.compile(r"[-+]?[0-9]+")
_NON_FINITE = re.compile(NON_FINITE, re.IGNORECASE)

#: Blanks that are allowed around a number. A text with other Unicode blanks is no number.
BLANKS = " \t\r\n"

#: Pattern of the error values that spreadsheets write into cells, in English, German and French.
SPREADSHEET_ERROR = r"#(?:N/A|NV|DIV/0!|(?:VALUE|WERT|VALEUR|REF|BEZUG|NUM|ZAHL|NOMBRE|NULL)!|(?:NAME|NOM)\?)"

_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+")

_METADATA = re.compile(r"#\s*([A-Za-z][\w -]*?)\s*:\s*(.*)")

_ERROR_CELL = re.compile(rf"\s*{SPREADSHEET_ERROR}\s*(?:[,;\t]|$)")


def is_comment(line: str) -> bool:
    """Whether a line of a table is a comment: it begins with ``#`` and not with an error value like ``#N/A``."""
    return line.startswith("#") and not _ERROR_CELL.match(line)


def number(text: str, *, non_finite: bool = False) -> float | None:
    """Read a number, with optional blanks around it; None for any other text and for a number without a finite value.

    With ``non_finite`` also accept NaN and infinity by name, and read numbers above the largest double as infinity.
    """
    word = text.strip(BLANKS)
    if len(word) > LONGEST or not (_NUMBER.fullmatch(word) or (non_finite and _NON_FINITE.fullmatch(word))):
        return None
    value = float(word)
    return value if non_finite or isfinite(value) else None


def has_decimal_comma(text: str) -> bool:
    """Whether a cell is a number with a decimal comma and is otherwise correct."""
    return bool(_DECIMAL_COMMA.fullmatch(text[: LONGEST + 1].strip(BLANKS)))


def metadata(line: str) -> tuple[str, str] | None:
    """Return the lower-case key and the value of a comment ``# key: value``; None for any other line."""
    match = _METADATA.match(line[:LONGEST])
    return (match[1].strip().lower(), match[2].strip()) if match else None


def separator_of(header: str) -> str:
    """Return the separator of a table's fields: the most frequent of comma, semicolon and tab in the header."""
    return max((",", ";", "\t"), key=header.count)


def split_row(line: str, separator: str = ",") -> list[str]:
    """Split a line of a CSV into cells without the blanks around them. Raises ``csv.Error`` for a malformed line."""
    return [cell.strip(BLANKS) for cell in next(csv.reader([line], delimiter=separator))]


def csv_text(rows: Iterable[Iterable[object]], *, remark: str = "") -> str:
    """Write rows as a CSV with quotes where needed (RFC 4180). None is an empty cell; ``remark`` is a first comment."""
    text = io.StringIO()
    if remark:
        text.write(f"# {remark}\n")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def first_doubled(names: Iterable[str]) -> str | None:
    """Return the first name that occurs more than once; None when all names are distinct."""
    return next((name for name, count in Counter(names).items() if count > 1), None)


def number_list(text: str) -> tuple[float, ...] | None:
    """Read a comma-separated list of numbers; None when one part is no number."""
    values = [number(part) for part in text.split(",")]
    return None if None in values else tuple(value for value in values if value is not None)


def whole(text: str, *, least: int, most: int) -> int | None:
    """Read an integer from ``least`` to ``most``, with optional blanks around it; None for any other text."""
    word = text.strip(BLANKS)
    # A number with more digits than both limits is out of range. This test avoids `int`, which refuses 4301 digits.
    digits = word.lstrip("+-").lstrip("0")
    if not _WHOLE.fullmatch(word) or len(digits) > max(len(str(abs(least))), len(str(abs(most)))):
        return None
    value = int(f"-{digits}" if word.startswith("-") and digits else digits or "0")
    return value if least <= value <= most else None
