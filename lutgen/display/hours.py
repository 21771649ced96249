"""``--hours``: spans, steps and lists of operating hours."""

from __future__ import annotations

from decimal import Decimal
from math import isfinite
from typing import TYPE_CHECKING

from lutgen.cells import BLANKS, number
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from lutgen.display.tips import Tips

#: More hours than this in one request are treated as a typing error: at 1 MB a LUT they would be 10 GB.
MAX_HOURS = 10_000

#: No display reaches this hour. Larger hours are not rounded; the check of the measured span refuses them.
_ENDLESS = 10**9

#: Stands for hours that are larger than any double.
_BEYOND = Decimal("1e309")

_ALLOWED = "Write 0..18000 (every measured time), 0..18000:500 (a step) or 0,5000,10000 (a list)"


def parse_hours(text: str, tips: Tips) -> list[float]:
    """Return the hours that ``text`` asks for, increasing, each once.

    ``0..18000`` is every measured time in the span and its two ends, ``0..18000:500`` a step from its start,
    ``0,5000,10000`` a list.

    Raises LutgenError: not of these forms, reversed, endless, too many, or outside the measured span.
    """
    if ".." not in text:
        return _checked({_number(part, text) for part in text.split(",")}, tips)
    span, colon, step = text.partition(":")
    first_text, _, last_text = span.partition("..")
    first, last = _number(first_text, text), _number(last_text, text)
    if first > last:
        message = f"--hours {text}: the span runs backwards. Write {last_text}..{first_text}."
        raise LutgenError(message)
    tips.check_span(float(first))
    tips.check_span(float(last))
    if colon:
        return _checked(_steps(first, last, step, text), tips)
    measured = {Decimal(repr(float(hour))) for hour in tips.hours if first <= hour <= last}
    return _checked(measured | {first, last}, tips)


def _steps(first: Decimal, last: Decimal, given: str, text: str) -> set[Decimal]:
    step = _number(given, text)
    if step <= 0:
        message = f"--hours {text}: a step of {given} does not advance. Give one from 0.000001 on, such as 500."
        raise LutgenError(message)
    count = int((last - first) / step) + 1
    if count > MAX_HOURS:
        message = f"--hours {text}: that is {count} hours, more than {MAX_HOURS}. Give a larger step."
        raise LutgenError(message)
    return {first + i * step for i in range(count)}


def _checked(hours: set[Decimal], tips: Tips) -> list[float]:
    if len(hours) > MAX_HOURS:
        message = f"--hours asks for {len(hours)} hours, more than {MAX_HOURS}. Give fewer."
        raise LutgenError(message)
    for hour in sorted(hours):
        tips.check_span(float(hour))
    return [float(hour) for hour in sorted(hours)]


def _number(part: str, text: str) -> Decimal:
    part = part.strip(BLANKS)
    hours = number(part, non_finite=True)
    # A point without a digit before it is a slip: `0...5` is not the span 0 to a half.
    if hours is None or part.lstrip("+-").startswith("."):
        message = f"--hours {text}: {part!r} is not a number of hours. {_ALLOWED}."
        raise LutgenError(message)
    named = part.lstrip("+-")[0].isalpha()  # nan, inf
    if named or hours < 0:
        message = f"--hours {text}: {part!r} is not a finite number of hours from 0 on. {_ALLOWED}."
        raise LutgenError(message)
    exact = Decimal(repr(hours)) if isfinite(hours) else _BEYOND
    # Folder names carry six decimals, so finer hours could collide: 0.0036 s is enough for any display.
    return exact if exact > _ENDLESS else round(exact, 6)
