"""Numbers, metadata and rows as text, read strictly: what a file's cell or an option may hold, for every reader.

Python's ``float`` and ``int`` also take ``1_000``, full-width and Arabic digits, ``nan`` and ``infinity``, and ``int``
raises its own error for more than 4300 digits. Here a number is ASCII digits, with one decimal point and an exponent
where it has them; anything else is None, and the caller says where it stands and what is allowed.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: A decimal number, for patterns that hold one: ``-1``, ``.5``, ``2.``, ``1e-3``. Digits match in one way only, so that
#: a megabyte of them is refused in linear time.
NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"

#: Texts that programs write for NaN and infinity.
NON_FINITE = r"[-+]?(?:nan|inf|infinity)"

#: Most characters of a cell. A double has 17 significant digits; the limit is for files that are one endless cell.
LONGEST = 1000

_NUMBER, _WHOLE = re.compile(NUMBER), re.compile(r"[-+]?[0-9]+")
_NON_FINITE = re.compile(NON_FINITE, re.IGNORECASE)

#: Blanks that may stand around a number. With other blanks of Unicode a text is no number.
BLANKS = " \t\r\n"

#: What spreadsheets write for a value that they do not have.
SPREADSHEET_ERROR = r"#(?:N/A|NV|DIV/0!|(?:VALUE|WERT|VALEUR|REF|BEZUG|NUM|ZAHL|NOMBRE|NULL)!|(?:NAME|NOM)\?)"

_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+")

_METADATA = re.compile(r"#\s*([A-Za-z][\w -]*?)\s*:\s*(.*)")

_ERROR_CELL = re.compile(rf"\s*{SPREADSHEET_ERROR}\s*(?:[,;\t]|$)")


def is_comment(line: str) -> bool:
    """Whether a line of a table is a comment: it begins with ``#``, which is no error value in its first cell."""
    return line.startswith("#") and not _ERROR_CELL.match(line)


def number(text: str, *, non_finite: bool = False) -> float | None:
    """Read a number, with blanks around it; None for any other text and for a number without a finite value.

    ``non_finite`` also takes NaN and infinity by name, and numbers beyond the largest double as infinity.
    """
    word = text.strip(BLANKS)
    if len(word) > LONGEST or not (_NUMBER.fullmatch(word) or (non_finite and _NON_FINITE.fullmatch(word))):
        return None
    value = float(word)
    return value if non_finite or isfinite(value) else None


def has_decimal_comma(text: str) -> bool:
    """Whether a cell is a number written with a decimal comma, and correct but for that."""
    return bool(_DECIMAL_COMMA.fullmatch(text[: LONGEST + 1].strip(BLANKS)))


def metadata(line: str) -> tuple[str, str] | None:
    """Return key, in small letters, and value of a comment ``# key: value``; None where it is none."""
    match = _METADATA.match(line[:LONGEST])
    return (match[1].strip().lower(), match[2].strip()) if match else None


def separator_of(header: str) -> str:
    """Return what stands between a table's fields: that of comma, semicolon and tab which its header has most of."""
    return max((",", ";", "\t"), key=header.count)


def split_row(line: str, separator: str = ",") -> list[str]:
    """Cut a line of a CSV into its cells, without the blanks around them. Raises ``csv.Error`` where it is none."""
    return [cell.strip(BLANKS) for cell in next(csv.reader([line], delimiter=separator))]


def csv_text(rows: Iterable[Iterable[object]], *, remark: str = "") -> str:
    """Write rows as a CSV, quoted where a cell has to be (RFC 4180); None is an empty cell, ``remark`` a first line."""
    text = io.StringIO()
    if remark:
        text.write(f"# {remark}\n")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def first_doubled(names: Iterable[str]) -> str | None:
    """Return the first name that a list has twice, if any."""
    return next((name for name, count in Counter(names).items() if count > 1), None)


def number_list(text: str) -> tuple[float, ...] | None:
    """Read a list of numbers with commas between them; None where one of them is no number."""
    values = [number(part) for part in text.split(",")]
    return None if None in values else tuple(value for value in values if value is not None)


def whole(text: str, *, least: int, most: int) -> int | None:
    """Read a whole number from ``least`` to ``most``, with blanks around it; None for any other text."""
    word = text.strip(BLANKS)
    # Leading zeros aside, what has more digits than both limits lies beyond them; `int` refuses 4301 digits and more.
    digits = word.lstrip("+-").lstrip("0")
    if not _WHOLE.fullmatch(word) or len(digits) > max(len(str(abs(least))), len(str(abs(most)))):
        return None
    value = int(f"-{digits}" if word.startswith("-") and digits else digits or "0")
    return value if least <= value <= most else None
