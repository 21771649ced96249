"""Formatting of numbers for engineers: 12.31 ± 0.24, 1.53 ×10⁻⁵, 8.1 %, 18 000."""

from collections.abc import Sequence
from math import floor, isfinite, log10

#: Significant figures of a value without an error, and of an error.
FIGURES, OF_AN_ERROR = 4, 2

#: Maximum number of significant figures of a value, even if its error is very small.
MOST = 6

#: An error below this limit is written with a power of ten, since its decimals would begin with too many zeros.
LEAST = 1e-5

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def readable(value: float, figures: int = FIGURES) -> str:
    """Format a value with ``figures`` significant figures; outside 0.0001..9999 with a power of a thousand."""
    if value == 0 or not isfinite(value):
        return f"{value:g}"
    value = float(f"{value:.{figures - 1}e}")
    power = _power(value)
    return f"{value / 10.0**power:.{figures}g}{_times(power)}"


def with_error(value: float, stderr: float | None, unit: str = "1") -> str:
    """Format value ± error and the unit, rounded to the second significant figure of the error."""
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
    """Format a share in percent: "< 1 %" between 0 and 0.01, "> 99 %" between 0.99 and 1, and a dash for None."""
    if share is None:
        return "–"
    if 0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1:
        return "> 99 %"
    return f"{100 * share:.0f} %"


def in_percent(share: float, digits: int = 0, *, signed: bool = False) -> str:
    """Format a share in percent with ``digits`` decimals: 0.02 %; ``signed``: +20.0 %."""
    return f"{100 * share:{'+' if signed else ''}.{digits}f} %"


def times(ratio: float) -> str:
    """Format the ratio of an error to the noise with three figures: 40.1 ×, 0.978 ×, 1230 ×."""
    return f"{ratio:.3g} ×" if ratio < 999.5 else f"{float(f'{ratio:.2e}'):.0f} ×"


def spaced(value: float) -> str:
    """Format a number of hours or pixels with grouped thousands: 18 000, 562.5. The spaces are no-break spaces."""
    return f"{round(value, 6):,}".removesuffix(".0").replace(",", "\N{NO-BREAK SPACE}")


def counted(count: int, noun: str) -> str:
    """Format a count and a noun whose plural ends in s: 1 slide, 18 000 pixels."""
    return f"{spaced(count)} {noun}{'' if count == 1 else 's'}"


def listed(names: Sequence[str], most: int) -> str:
    """List the first ``most`` names, and the number of the remaining names: "a, b and 3 more"."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def pixels_of_colours(pixels: int, colours: int) -> str:
    """Format numbers of pixels and of distinct colours: 345 600 pixels of 50 304 colours, 1 pixel of 1 colour."""
    return f"{counted(pixels, 'pixel')} of {counted(colours, 'colour')}"


def _power(value: float) -> int:
    """Return the exponent of the power of ten to write as a factor, a multiple of three; 0 for no factor."""
    exponent = floor(log10(abs(value)))
    return 0 if -4 <= exponent < 4 else 3 * (exponent // 3)


def _times(power: int) -> str:
    return f" ×10{str(power).translate(_SUPERSCRIPT)}" if power else ""
