"""One clause that describes an effect and its size: "black leaks 0.22 % of white, growing to 0.77 % by 18 000 h"."""

from __future__ import annotations

from bisect import bisect_right
from string import Formatter
from typing import TYPE_CHECKING

from lutgen.errors import listed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.effects.declare import Effect

CHANNELS = ("red", "green", "blue")


def in_words(effect: Effect, values: Mapping[str, float], hours: Sequence[float] = ()) -> str:
    """Return a clause that describes an effect at these values.

    The clause is the effect's ``says``, or the first line of its docstring if ``says`` gives a size and others changed.
    ``hours``: the hours of the sessions, increasing. A date is somewhere between two sessions: the clause names them.
    """
    amount = next(iter(effect.neutral), "")
    inserted = {name for _, name, _, _ in Formatter().parse(effect.says) if name}
    changed = [name for name, rest in effect.neutral.items() if values[name] != rest]
    gives_size = not inserted.isdisjoint({"size", *effect.neutral})
    if not effect.says or (gives_size and not {amount, "grown", *inserted}.issuperset(changed)):
        clause = effect.summary.partition(":")[0]
        return clause[:1].lower() + clause[1:]
    new, grown = values.get(amount, 0.0), values.get("grown", 0.0)
    new = new if abs(new) >= 0.01 * abs(grown) else 0.0  # a size of no importance is not printed
    less = effect.says_less and new + grown < 0 and new <= 0
    new, grown = (-new, -grown) if less else (new, grown)
    dates = [name for name, each in effect.parameters.items() if each.grid == "gaps"]
    texts = {name: _when(values[name], hours) for name in dates}
    channels = listed(each for each in CHANNELS if any(_of(name) == each for name in changed))
    size = f"{100 * (new or grown):.2g} %"
    says = effect.says_less if less else effect.says
    clause = says.format(**{**values, **texts, "size": size, "channels": channels})
    clause += _course(new, grown) if "size" in inserted else ""
    later = [name for name in dates if name not in inserted and values[name] > effect.parameters[name].value]
    return f"{clause}, since a time {texts[later[0]]}" if later else clause


def _of(name: str) -> str:
    """Return the channel of a parameter, such as red of ``red_grown``; "" if there is none."""
    channel = name.partition("_")[0]
    return channel if channel in CHANNELS else ""


def _when(date: float, hours: Sequence[float]) -> str:
    place = bisect_right(hours, date)
    return (
        f"between {hours[place - 1]:.0f} and {hours[place]:.0f} h" if 0 < place < len(hours) else f"near {date:.0f} h"
    )


def _course(new: float, grown: float) -> str:
    """Return the end of a clause: how a share of ``new`` at hour 0 changes by 18 000 h."""
    first, last = f"{100 * new:.2g} %", f"{100 * (new + grown):.2g} %"
    if not grown or first == last:
        return ""
    if not new:
        return " by 18 000 h"
    return f", {'growing' if abs(new + grown) > abs(new) else 'falling'} to {last} by 18 000 h"
