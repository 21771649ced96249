"""The hours of a CSV of readings: separators of thousands, and the counter's hour at the start."""

import re
from collections.abc import Mapping, Sequence

from lutgen.cells import number
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError

#: Patterns of hours with a point as the separator of thousands: 500, 3.000, 14.000; not 0.500, and not 100.500, which
#: would be 100 500 hours, 11 years.
_THOUSANDS, _BELOW = re.compile(r"[1-9][0-9]?\.[0-9]{3}"), re.compile(r"[0-9]{1,3}")

#: Fewest different hours with a point that show how the file writes hours.
_FEWEST = 2


def refuse_thousands(texts: Sequence[str], lines: Sequence[int], file: str) -> None:
    """Raise LutgenError if all hours look as if a point separated thousands: 0, 500, 3.000 and 14.000."""
    dotted = {text for text in texts if _THOUSANDS.fullmatch(text)}
    if len(dotted) < _FEWEST or not all(text in dotted or _BELOW.fullmatch(text) for text in texts):
        return
    at = next(place for place, text in enumerate(texts) if text in dotted)
    text = texts[at]
    raise LutgenError(
        f"{file}, line {lines[at]}, column hour: {text} has three decimals, as have the other hours; does the point "
        f"separate thousands? Write {text.replace('.', '')}, or {text}0 if hours and decimals are meant."
    )


def since_start(hours: Array, metadata: Mapping[str, str], file: str) -> Array:
    """Return the hours since the un-aged display: the counter minus ``# start_hour``, if stated."""
    text = metadata.get("start_hour")
    if text is None:
        return hours
    start = number(text)
    if start is None:
        raise LutgenError(
            f"{file}: start_hour is {text[:40]!r}; it is the counter's hour at the first session, such as 2400."
        )
    if hours.min() != start:
        raise LutgenError(
            f"{file}: start_hour is {start:g}, and the smallest hour is {hours.min():g}. They must be the same: "
            f"aging is measured from the first session."
        )
    return hours - start
