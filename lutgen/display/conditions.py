"""The conditions of a bake or a picture (``--at``), and sentences on what a LUT or a picture cannot carry."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, make_dataclass, replace
from itertools import product
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.cells import BLANKS, number
from lutgen.effects.probe import reacts_to
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.readings.conditions import COLUMNS, CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from lutgen.display.model import DisplayModel
    from lutgen.display.on_screen import OnScreen

#: Text for infinite minutes since power-on.
WARM = "warm"

#: The conditions of the position on the screen.
PLACE = ("u", "v")

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
        """Raise LutgenError for a value outside its range."""
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


def conditions_of(values: Mapping[str, float]) -> Conditions:
    """Return the usual conditions with some values replaced. Raises LutgenError: unknown name or invalid value."""
    return replace(REFERENCE, **_known(values))


def parse_at(texts: Iterable[str], usual: Conditions = REFERENCE) -> Conditions:
    """Parse ``--at``: NAME=VALUE, repeated or as a comma list.

    Raises LutgenError: another form, an unknown name, a repeated name, or an invalid value.
    """
    values: dict[str, float] = {}
    for part in (part for text in texts for part in text.split(",")):
        name, equals, text = (piece.strip(BLANKS) for piece in part.partition("="))
        if not equals:
            message = f"--at {part.strip()}: write NAME=VALUE, such as ambient_lx=60. Names: {', '.join(_names())}."
            raise LutgenError(message)
        if name in values:
            raise LutgenError(f"--at gives {name} twice. Give each condition once.")
        warm = text == WARM and name in COLUMNS and COLUMNS[name].usual == inf
        value = inf if warm else number(text)
        if value is None:
            raise LutgenError(f"--at {name}={text}: {text!r} is not a number; give a finite number, such as 60 or 0.5.")
        values[name] = value
    return replace(usual, **_known(values))


def _names() -> list[str]:
    return [each.name for each in fields(Conditions)]


def _known(values: Mapping[str, float]) -> Mapping[str, float]:
    for name in values:
        refuse_unknown("condition", name, _names())
    return values


def in_words(conditions: Conditions, names: Iterable[str]) -> str:
    """Return the conditions of these names in words: ``centre, dark room, warm``."""
    named, values = set(names), conditions.as_dict()
    chosen = [each for each in CONDITIONS if named & {column.name for column in each.columns}]
    return ", ".join(dict.fromkeys(each.in_words(values) for each in chosen))


#: Column → words for effects that need the column.
_DEPENDS = {column.name: condition.depends for condition in CONDITIONS for column in condition.columns}


def what_luts_carry(model: DisplayModel) -> list[str]:
    """Return a sentence on each condition that a bake of ``model`` fixes, and on each effect that no LUT can carry."""
    steps = [
        f"{name} makes stairs of the curves, which are finer than a LUT's grid: its error is in the group border."
        for name in model.names_of_steps()
    ]
    return _fixed(model, "Baked at", "which a LUT cannot carry") + steps


def what_pictures_carry(model: DisplayModel, on_screen: OnScreen | None = None) -> list[str]:
    """Return a sentence on each condition that is fixed when ``model`` is applied to a picture.

    ``on_screen``: position of the picture on the screen, which gives each pixel its own position.
    """
    fixed = _fixed(model, "Shown at", "which is taken as the same in all of the picture", PLACE if on_screen else ())
    return [*on_screen.sentences(), *fixed] if on_screen else fixed


def seen_on(model: DisplayModel, on_screen: OnScreen | None = None) -> dict[str, Any]:
    """Return the entries on the display in the JSON of commands on pictures: display, model, remarks, on_screen."""
    return {
        "display": {"file": model.measurements.file, "sha256": model.measurements.sha256},
        "model": model.file or None,
        "remarks": what_pictures_carry(model, on_screen),
        **({"on_screen": on_screen.as_json()} if on_screen else {}),
    }


def _fixed(model: DisplayModel, verb: str, but: str, free: tuple[str, ...] = ()) -> list[str]:
    stated = model.conditions.stated()
    columns = {
        each.effect.name: tuple(name for name in reacts_to(each.effect) if name not in free) for each in model.baked
    }
    needs = {name for names in columns.values() for name in names} | set(stated)
    lines = [f"{verb}: {in_words(model.conditions, needs)}."] if needs else []
    for each in model.baked:
        if names := columns[each.effect.name]:
            on = " and ".join(dict.fromkeys(_DEPENDS[name] for name in names))
            lines.append(f"{each.effect.name} depends on {on}, {but}.")
    lines += [f"Nothing in this model depends on {name}." for name in stated if not _matters(model, name)]
    return lines + [
        f"{each.effect.name} is left out: it belongs to the instrument, not to the display."
        for each in model.effects
        if each.effect.stage == "instrument"
    ]


def _matters(model: DisplayModel, name: str) -> bool:
    """Whether the usual value of a condition changes a test colour at the first or the last hour."""
    usual = replace(model, conditions=replace(model.conditions, **{name: getattr(REFERENCE, name)}))
    code = np.array(list(product((0.0, 0.25, 0.5, 1.0), repeat=3)))
    ends = (float(model.tips.hours[0]), float(model.tips.hours[-1]))
    return any(
        (model.at("chroma", hours).code_to_xyz(code) != usual.at("chroma", hours).code_to_xyz(code)).any()
        for hours in ends
    )
