"""How a condition of a reading is declared: its columns, and what rest means for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Columns of the readings by name, each (n,).
Values = Mapping[str, Array]


@dataclass(frozen=True)
class Column:
    """One optional column of the table of readings."""

    #: Its heading and unit; the unit is "" for a ratio.
    name: str
    unit: str
    #: Allowed range, and what the values are: completes "must be …". A value outside is a typing error.
    low: float
    high: float
    meaning: str
    #: What an empty cell, or a missing column, means in the table; NaN: unknown, or warm.
    blank: float
    #: The value that effects take for a blank cell or a missing column.
    usual: float
    #: A value that the condition may have had throughout if nobody logged it.
    unlogged: float
    #: Values under which the contract of effects tries an effect, the usual one first.
    tried: tuple[float, ...]
    #: For pictures of an effect: a value at which the effect is visible, the ends of an axis, and its label.
    shown: float
    axis: tuple[float, float]
    words: str


@dataclass(frozen=True)
class Variation:
    """Patches that show what a condition does, for a measurement plan.

    ``patches``: code value, values of columns, and a note ("shrouded") each.
    """

    name: str
    patches: tuple[tuple[tuple[float, float, float], Mapping[str, float], str], ...]


def greys(levels: tuple[float, ...], note: str = "", **columns: float) -> Variation:
    """Return a nameless variation: greys of these code values under some values of columns."""
    return Variation("", tuple(((level, level, level), columns, note) for level in levels))


def joined(name: str, *parts: Variation) -> Variation:
    """Return one variation of several."""
    return Variation(name, tuple(patch for part in parts for patch in part.patches))


def within(tolerance: float) -> Callable[[Array, float], tuple[float, float]]:
    """Return a span of rest of this size on either side of the value at rest."""
    return lambda _values, rest: (rest - tolerance, rest + tolerance)


def nothing(_values: Values, _rest: Values) -> dict[str, Array]:
    """Return no signature."""
    return {}


def everywhere(values: Values) -> NDArray[np.bool_]:
    """Return that the condition matters to every reading, (n,)."""
    return np.ones(next(iter(values.values())).size, dtype=bool)


@dataclass(frozen=True)
class Condition:
    """One condition under which a reading is taken."""

    #: As people call it: "room light".
    name: str
    #: Where it stands among the conditions, in tables and files.
    place: int
    #: Its columns.
    columns: tuple[Column, ...]
    #: Name of the readings that are away from rest by it, in tables of errors.
    cell: str
    #: Of a column's values in one session, (n,), and the value at which its colour points were read: the smallest and
    #: the largest value that still count as rest. NaN counts as rest.
    span: Callable[[Array, float], tuple[float, float]]
    #: What effects that need its columns depend on: completes "depends on …".
    depends: str
    #: Values by column → the condition in words. Window and surround describe one picture and give the same words.
    told: Callable[[Mapping[str, float]], str]
    #: One value → how a table calls it; of several columns, all of them in their order.
    label: Callable[..., str]
    #: Where a sentence puts a label: "in a room of {}".
    sentence: str
    #: Heading of its part of a table of errors; "" where it has none.
    heading: str
    #: Format of its values in the name of a patch, "{:g} lx", and the word before that name in a sentence.
    short: str
    before: str
    #: Label of an axis along which the condition runs.
    axis: str
    #: Values → which readings the condition can affect, (n,).
    matters: Callable[[Values], NDArray[np.bool_]] = everywhere
    #: Values, and values at rest → name → weight of a signature in the light, (n,); a diagnosis tries each signature on
    #: the residual of a fit.
    signatures: Callable[[Values, Values], dict[str, Array]] = nothing
    #: Those signatures that no effect of the catalogue has.
    strange: tuple[str, ...] = ()
    #: How a plan varies it.
    variations: tuple[Variation, ...] = field(default=())
