"""The conditions of a bake or a picture (``--at``)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, make_dataclass, replace
from math import inf, isfinite
from typing import Any

from lutgen.cells import BLANKS, number
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.readings.conditions import COLUMNS, CONDITIONS

#: Text for infinite minutes since power-on.
WARM = "warm"

#: One field for each column of conditions; the default is the usual value.
_Columns: Any = make_dataclass(
    "_Columns",
    [(name, float, field(default=column.usual)) for name, column in COLUMNS.items()],
    frozen=True,
    namespace={"__module__": __name__},
)


@dataclass(frozen=True)
class Conditions(_Columns):  # type: ignore[misc] # the registry defines the fields
    """The conditions under which the display is seen: one number for each column of conditions.

    The fields are ``u`` and ``v``, position from the top left, 0..1; ``ambient_lx``, room light on the screen;
    ``warmup_min``, minutes since power-on, infinite when warm; ``temperature_c`` of the panel; ``window``, share of the
    screen that a colour covers; ``surround``, code value of the grey around the colour; and columns of further
    conditions.
    """

    def __post_init__(self) -> None:
        for name, value in self.as_dict().items():
            column = COLUMNS[name]
            allowed = isfinite(value) and column.low <= value <= column.high
            if not allowed and value != column.usual:
                raise LutgenError(
                    f"condition {name} = {value:g}: must be {column.meaning} ({column.low:g} to {column.high:g})."
                )

    def as_dict(self) -> dict[str, float]:
        """Return all conditions by name."""
        return {each.name: float(getattr(self, each.name)) for each in fields(self)}

    def stated(self) -> dict[str, float]:
        """Return the conditions that differ from the usual values, by name."""
        usual = REFERENCE.as_dict()
        return {name: value for name, value in self.as_dict().items() if value != usual[name]}


#: The default conditions: centre, dark room, warm, 25 °C, full screen.
REFERENCE = Conditions()


def conditions_of(values: Mapping[str, float], usual: Conditions = REFERENCE) -> Conditions:
    """Return conditions with some values replaced. Raises LutgenError: unknown name or invalid value."""
    for name in values:
        refuse_unknown("condition", name, [*COLUMNS])
    return replace(usual, **values)


def parse_at(texts: Iterable[str], usual: Conditions = REFERENCE) -> Conditions:
    """Parse ``--at``: NAME=VALUE, repeated or as a comma list.

    Raises LutgenError: another form, an unknown name, a repeated name, or an invalid value.
    """
    values: dict[str, float] = {}
    for part in (part for text in texts for part in text.split(",")):
        name, equals, text = (piece.strip(BLANKS) for piece in part.partition("="))
        if not equals:
            message = f"--at {part.strip()}: write NAME=VALUE, such as ambient_lx=60. Names: {', '.join(COLUMNS)}."
            raise LutgenError(message)
        if name in values:
            raise LutgenError(f"--at gives {name} twice. Give each condition once.")
        warm = text == WARM and name in COLUMNS and COLUMNS[name].usual == inf
        value = inf if warm else number(text)
        if value is None:
            raise LutgenError(f"--at {name}={text}: {text!r} is not a number; give a finite number, such as 60 or 0.5.")
        values[name] = value
    return conditions_of(values, usual)


def in_words(conditions: Conditions, names: Iterable[str]) -> str:
    """Return the conditions of these names in words: ``centre, dark room, warm``."""
    named, values = set(names), conditions.as_dict()
    chosen = [each for each in CONDITIONS if named & {column.name for column in each.columns}]
    return ", ".join(dict.fromkeys(each.in_words(values) for each in chosen))
