"""One clause that describes an effect and its size: "black leaks 0.22 % of white, growing to 0.77 % by 18 000 h"."""

from __future__ import annotations

from bisect import bisect_right
from string import Formatter
from typing import TYPE_CHECKING

import numpy as np

from lutgen.effects.scene import LIFE_H
from lutgen.effects.shapes import growth
from lutgen.errors import listed
from lutgen.numerals import spaced

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.effects.declare import Effect

CHANNELS = ("red", "green", "blue")


def in_words(effect: Effect, values: Mapping[str, float], hours: Sequence[float] = ()) -> str:
    """Return a clause that describes an effect at these values.

    The clause is the effect's ``says``, or the first line of its docstring if ``says`` gives a size and others changed.
    ``hours``: the hours of the sessions, increasing. Sizes are those at the last session; without hours, at 18 000 h. A
    date is somewhere between two sessions: the clause names them.
    """
    amount = next(iter(effect.neutral), "")
    inserted = {name for _, name, _, _ in Formatter().parse(effect.says) if name}
    changed = [name for name, rest in effect.neutral.items() if values[name] != rest]
    gives_size = not inserted.isdisjoint({"size", *effect.neutral})
    if not effect.says or (gives_size and not {amount, "grown", *inserted}.issuperset(changed)):
        clause = effect.summary.partition(":")[0]
        return clause[:1].lower() + clause[1:]
    last = hours[-1] if len(hours) and hours[-1] else LIFE_H
    new, grown = values.get(amount, 0.0), _grown(values, last)
    new = new if abs(new) >= 0.01 * abs(grown) else 0.0  # a size of no importance is not printed
    less = effect.says_less and new + grown < 0 and new <= 0
    new, grown = (-new, -grown) if less else (new, grown)
    channels = listed(each for each in CHANNELS if any(_channel_of(name) == each for name in changed))
    dates = {name: each.value for name, each in effect.parameters.items() if each.grid == "gaps"}
    when = next((_when(values[name], hours) for name in dates), "")
    words = {"size": f"{100 * (new or grown):.2g} %", "channels": channels, "when": when}
    clause = (effect.says_less if less else effect.says).format(**{**values, **words})
    clause += _course(new, grown, last) if "size" in inserted else ""
    is_later = inserted.isdisjoint({"when", *dates}) and any(values[name] > rest for name, rest in dates.items())
    return f"{clause}, since a time {when}" if is_later else clause


def _channel_of(name: str) -> str:
    """Return the channel of a parameter, such as red of ``red_grown``; "" if there is none."""
    channel = name.partition("_")[0]
    return channel if channel in CHANNELS else ""


def _when(date: float, hours: Sequence[float]) -> str:
    """Return a date as the gap between the two sessions around it; without such sessions, as about an hour."""
    place = bisect_right(hours, date)
    if not 0 < place < len(hours):
        return f"near {date:.0f} h"
    return f"between {hours[place - 1]:.0f} and {hours[place]:.0f} h"


def _grown(values: Mapping[str, float], hour: float) -> float:
    """Return the growth of an amplitude since hour 0; values without a power of time grow in proportion to time."""
    course = {"power": values.get("power", 1.0), "saturation": values.get("saturation", 0.0)}
    return float(growth(np.array(hour / LIFE_H), new=0.0, grown=values.get("grown", 0.0), **course))


def _course(new: float, grown: float, hour: float) -> str:
    """Return the end of a clause: how a share of ``new`` at hour 0 changes by an hour."""
    first, last = f"{100 * new:.2g} %", f"{100 * (new + grown):.2g} %"
    at = spaced(hour).replace("\N{NO-BREAK SPACE}", " ")
    if not grown or first == last:
        return ""
    if not new:
        return f" by {at} h"
    return f", {'growing' if abs(new + grown) > abs(new) else 'falling'} to {last} by {at} h"
