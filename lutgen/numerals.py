"""Numbers in the form in which engineers read them: 12.31 ± 0.24, 1.53 ×10⁻⁵, 8.1 %, 18 000."""

from __future__ import annotations

from math import floor, isfinite, log10
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Significant figures of a value, and of its error.
FIGURES, OF_AN_ERROR = 4, 2

#: Significant figures of a value at most, however small its error is.
MOST = 6

#: A smaller error is written with a power of ten, since it would have too many zeros.
LEAST = 1e-5

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def readable(value: float, figures: int = FIGURES) -> str:
    """Write a value with so many figures; outside 0.0001..9999 with a power of a thousand."""
    if value == 0 or not isfinite(value):
        return f"{value:g}"
    value = float(f"{value:.{figures - 1}e}")
    power = _power(value)
    return f"{value / 10.0**power:.{figures}g}{_times(power)}"


def with_error(value: float, stderr: float | None, unit: str = "1") -> str:
    """Write value ± error, both to the error's second figure, and the unit."""
    behind = "" if unit == "1" else f" {unit}"
    if stderr is None or not isfinite(stderr) or stderr <= 0:
        return f"{readable(value)}{behind}"
    power = _power(value if abs(value) > stderr else stderr)
    if not power and stderr < LEAST and abs(value) < 0.1:
        power = -3
    scaled, error = value / 10.0**power, stderr / 10.0**power
    places = OF_AN_ERROR - 1 - floor(log10(error))
    most = MOST - 1 - floor(log10(max(abs(scaled), error)))
    places = max(min(places, most), 0)
    text = (
        f"{scaled:.{places}f} ± {error:.{places}f}" if round(error, places) else f"{scaled:.{places}f} ± < 1e-{places}"
    )
    return f"({text}){_times(power)}{behind}" if power else f"{text}{behind}"


def percent(share: float | None) -> str:
    """Write a share in percent; a share just above 0 is "< 1 %", one just below 1 is "> 99 %"; None is a dash."""
    if share is None:
        return "–"
    if 0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1:
        return "> 99 %"
    return f"{100 * share:.0f} %"


def times(ratio: float) -> str:
    """Write how many times the noise an error is, with three figures: 40.1 ×, 0.978 ×, 1230 ×."""
    return f"{ratio:.3g} ×" if ratio < 999.5 else f"{float(f'{ratio:.2e}'):.0f} ×"


def spaced(value: float) -> str:
    """Group the digits of a number of hours or pixels by thousands: 18 000, 562.5; the spaces do not break a line."""
    return f"{round(value, 6):,}".removesuffix(".0").replace(",", "\N{NO-BREAK SPACE}")


def counted(count: int, noun: str) -> str:
    """Count things whose plural has an s: 1 slide, 18 000 pixels."""
    return f"{spaced(count)} {noun}{'' if count == 1 else 's'}"


def listed(names: Sequence[str], most: int) -> str:
    """List names, the first ``most`` of them, and count the others."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def pixels_of_colours(pixels: int, colours: int) -> str:
    """Count pixels and their distinct colours: 345 600 pixels of 50 304 colours, 1 pixel of 1 colour."""
    return f"{counted(pixels, 'pixel')} of {counted(colours, 'colour')}"


def _power(value: float) -> int:
    """Return the power of ten, a multiple of three, that is written as a factor."""
    exponent = floor(log10(abs(value)))
    return 0 if -4 <= exponent < 4 else 3 * (exponent // 3)


def _times(power: int) -> str:
    return f" ×10{str(power).translate(_SUPERSCRIPT)}" if power else ""
