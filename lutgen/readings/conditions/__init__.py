"""Conditions under which a reading is taken: one file for each condition. Every file in this folder is registered.

A file declares one ``CONDITION``: its columns with unit, range and the meaning of a blank cell; the span of values that
count as rest; its words in tables and sentences; its variation in a measurement plan; and drafts of effects that depend
on it. The readers and checks of tables, rest, replicates, tables of errors, ``--at``, plans, effects and plots use this
registry.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pkgutil import iter_modules
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Columns of the readings by name, each (n,).
Values = Mapping[str, Array]


@dataclass(frozen=True, kw_only=True)
class Column:
    """One optional column of the table of readings."""

    #: Heading and unit of the column; the unit of a ratio is "".
    name: str
    unit: str = ""
    #: Allowed range, and a description of the values that completes "must be …". A value outside is a typing error.
    low: float = 0.0
    high: float = 1.0
    meaning: str
    #: Value of an empty cell or a missing column in the table; NaN: unknown, or warm.
    blank: float
    #: Value that effects use for a blank cell or a missing column.
    usual: float
    #: If the column is missing, diagnosis also tests the hypothesis that the condition had this constant value.
    unlogged: float
    #: Values that the check of an effect's contract uses; the usual value first.
    tried: tuple[float, ...]
    #: For plots of an effect: a value at which the effect is visible, the limits of an axis, and the label of the axis.
    shown: float
    axis: tuple[float, float]
    words: str
    #: Value in readings whose note says that a shroud blocked the room's light; None: a shroud changes nothing.
    shrouded: float | None = None
    #: Question about the value of a whole session, which the draft of a campaign file leaves to a person; "": none.
    question: str = ""


class Sketch(NamedTuple):
    """A draft of an effect: stage, needed columns, meaning of its size, formula with ``{size}``, default and bounds."""

    stage: str
    needs: tuple[str, ...]
    meaning: str
    formula: str
    range: str = "0.01, (-0.5, 0.5)"


#: A patch of a measurement plan: code values, values of columns, and a note ("shrouded").
PlannedPatch = tuple[tuple[float, float, float], Mapping[str, float], str]


def greys(levels: tuple[float, ...], note: str = "", **columns: float) -> list[PlannedPatch]:
    """Return greys of these code values under these values of columns."""
    return [((level, level, level), columns, note) for level in levels]


def within(tolerance: float) -> Callable[[Array, float], tuple[float, float]]:
    """Return a ``span`` function: the value at rest ± ``tolerance``."""
    return lambda _values, rest: (rest - tolerance, rest + tolerance)


@dataclass(frozen=True, kw_only=True)
class Condition:
    """One condition under which a reading is taken."""

    #: Name for people: "room light".
    name: str
    #: Position among the conditions in tables and files.
    place: int
    #: The columns of the condition.
    columns: tuple[Column, ...]
    #: Name, in tables of errors, of the readings that are away from rest by this condition.
    cell: str
    #: Values of a column in one session, (n,), and the value at rest → the smallest and the largest value that count as
    #: rest. NaN counts as rest.
    span: Callable[[Array, float], tuple[float, float]]
    #: Words for effects that need the columns: completes "depends on …".
    depends: str
    #: Values by column → the condition in words. The conditions window and surround give the same words, because both
    #: describe one picture.
    in_words: Callable[[Mapping[str, float]], str]
    #: Value → label in a table; a condition with several columns takes one value for each column, in order.
    label: Callable[..., str]
    #: Phrase around a label in a sentence: "in a room of {}".
    sentence: str
    #: Heading of the condition's part of a table of errors; "": no heading.
    heading: str
    #: Format of the values in the name of a patch, "{:g} lx", and the words before the name in a sentence.
    short: str
    before: str
    #: Label of the plot axis of the condition; "": the words of the first column.
    axis: str = ""
    #: Values → places on that axis, (n,); default: the values of the first column.
    along: Callable[[Values], Array] = lambda values: next(iter(values.values()))
    #: Whether a session contains readings under several values of the condition. Of other conditions, a session of a
    #: table contains the readings at rest alone.
    of_readings: bool = False
    #: For logged values that scatter from reading to reading: values minus the value at rest, (n,) → numbers, (n,).
    #: Readings of one patch with equal numbers are replicates, although the condition may change their light.
    clusters: Callable[[Array], Array] | None = None
    #: Values → for each reading, whether the condition can affect the reading, (n,); default: it can.
    matters: Callable[[Values], NDArray[np.bool_]] = lambda values: np.ones(
        len(next(iter(values.values()))), dtype=bool
    )
    #: Values, and values at rest → name → weights of a signature in the light, (n,). A diagnosis projects the residual
    #: of a fit on each signature.
    signatures: Callable[[Values, Values], dict[str, Array]] = lambda _values, _rest: {}
    #: Names of the signatures that no effect of the catalogue has.
    strange: tuple[str, ...] = ()
    #: Pattern of the name of what a residual follows, a signature ("light by side, growing") or the cell ("cold, x") →
    #: draft of an effect that depends on the condition. The first pattern that matches is used. Empty: a draft is
    #: derived from the first column.
    sketches: Mapping[str, Sketch] = field(default_factory=dict)
    #: Name of a set of patches in a measurement plan, and the patches, which show the influence of the condition.
    varied: tuple[str, list[PlannedPatch]]

    @property
    def scatters(self) -> bool:
        """Whether logged values scatter, so that readings of one patch have several values, too few for a curve."""
        return self.clusters is not None

    @property
    def key(self) -> str:
        """Name in files and as a dimension of errors: the name of its column, if it has exactly one."""
        return self.columns[0].name if len(self.columns) == 1 else self.name


#: Every condition, in the order of tables.
CONDITIONS: tuple[Condition, ...] = tuple(
    sorted(
        (import_module(f"{__name__}.{module.name}").CONDITION for module in iter_modules(__path__)),
        key=lambda condition: condition.place,
    )
)

#: Every column by its name, in the order of tables, and the condition of each column.
COLUMNS: dict[str, Column] = {column.name: column for condition in CONDITIONS for column in condition.columns}
OF_COLUMN: dict[str, Condition] = {column.name: condition for condition in CONDITIONS for column in condition.columns}


def of_one_picture(name: str) -> tuple[str, ...]:
    """Return the columns on which effects depend together with a column, in order: a window has a surround."""
    return tuple(other for other, of in OF_COLUMN.items() if other == name or _is_beside(of, OF_COLUMN[name]))


def _is_beside(one: Condition, other: Condition) -> bool:
    return one is not other and one.depends == other.depends
