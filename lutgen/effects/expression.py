"""Effects in one line: ``xyz + k*tau*white``.

The signal in the formula selects the stage: ``code`` the stage drive, ``linear`` the stage transfer, ``xyz`` the stage
optics. A name that is neither a signal nor a quantity is a parameter. The start and the bounds of parameters may follow
after semicolons. The name of the effect may precede the formula, with a colon::

    leak: xyz + k*tau**p*white; k=0.002[0,0.05]; p=1[0.3,3]

The amplitudes are the smallest set of parameters that leave the signal unchanged when they are 0.
"""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from itertools import combinations
from math import inf

import numpy as np

from lutgen.cells import NUMBER
from lutgen.colorimetry import Array
from lutgen.effects.declare import Effect, Parameter, check_declaration
from lutgen.effects.formula import FUNCTIONS, QUANTITIES, SIGNALS, Formula, number_of, read_formula, refuse
from lutgen.effects.probe import parameter_draws, readings
from lutgen.errors import LutgenError
from lutgen.readings.conditions import COLUMNS, OF_COLUMN

#: Largest length and largest number of parameters of a one-line effect; a larger effect belongs in a file.
MAX_LETTERS, MAX_PARAMETERS = 500, 8

#: Start of an amplitude, and its distance from 0 to each bound. Other parameters start at 1, with bounds a factor
#: DECADE away.
AMPLITUDE, REACH, DECADE = 0.01, 1.0, 10.0

#: Smallest similarity of a parameter's name to a quantity's name at which the parameter counts as misspelt: `whte`,
#: `ambient`.
_LIKENESS = 0.74

_NUMBER = rf"\s*({NUMBER})\s*"
_VALUE = re.compile(rf"\s*([A-Za-z]\w*)\s*={_NUMBER}(?:\[{_NUMBER},{_NUMBER}\]\s*)?", re.ASCII)

#: Start of a parameter from the user's text, and its bounds or None.
_Given = tuple[float, tuple[float, float] | None]


def parse(text: str) -> Effect:
    """Parse a one-line effect: ``[name:] formula [; parameter=start[low,high]]…``.

    Raises LutgenError: the text is too long or outside the grammar, does not name exactly one signal, contains a
    misspelt quantity, or changes the signal when its amplitudes are 0.
    """
    if len(text) > MAX_LETTERS:
        raise LutgenError(
            f"expression of {len(text)} letters: {MAX_LETTERS} are allowed. Write it as a file for --effects."
        )
    text = " ".join(text.split())
    named = re.match(r"([a-z][a-z0-9-]*) ?:(.*)", text)
    written, *values = (named[2] if named else text).split(";")
    formula = read_formula(written.strip())
    given = _given(formula, values)
    _check_spelling(formula, [name for name in formula.parameters if name not in given])
    amplitudes = _amplitudes(formula, given)
    names = formula.parameters
    names_in_formula = re.findall(r"[a-z][a-z0-9]*", formula.text.lower().replace("_", ""))
    effect = Effect(
        name=named[1] if named else "-".join(names_in_formula),
        stage=SIGNALS[formula.signal],
        parameters={name: _parameter(name, given.get(name), amplitude=name in amplitudes) for name in names},
        neutral=dict.fromkeys(amplitudes, 0.0),
        forms=(amplitudes,) if len(amplitudes) == len(names) else (amplitudes, names),
        function=formula,
        needs=tuple(dict.fromkeys(column for name in formula.quantities for column in QUANTITIES[name][1])),
        text=f"{formula.text}\n\nAn effect in one line, of the stage {SIGNALS[formula.signal]}.",
        origin=text,
    )
    check_declaration(effect)
    return effect


def _given(formula: Formula, values: Sequence[str]) -> dict[str, _Given]:
    """Return start and bounds of each parameter from texts such as ``k=0.01[-0.1,0.1]``."""
    if len(formula.parameters) > MAX_PARAMETERS:
        listed = ", ".join(formula.parameters)
        refuse(formula.text, f"has {len(formula.parameters)} parameters ({listed}); {MAX_PARAMETERS} are allowed")
    given: dict[str, _Given] = {}
    for value in filter(str.strip, values):
        read = _VALUE.fullmatch(value)
        if not read:
            refuse(formula.text, f"`{value.strip()}` is no parameter's value. Write `k=0.01` or `k=0.01[-0.1,0.1]`")
        name = read[1]
        start, *bounds = (number_of(number, formula.text) for number in read.groups()[1:] if number)
        if name not in formula.parameters:
            known = ", ".join(formula.parameters) or "none"
            refuse(formula.text, f"`{value.strip()}`: {name!r} is none of its parameters, which are: {known}")
        if bounds and not (bounds[0] <= start <= bounds[1] and bounds[0] < bounds[1]):
            refuse(formula.text, f"`{value.strip()}`: write start[low,high], the start between the bounds")
        given[name] = start, (bounds[0], bounds[1]) if bounds else None
    return given


def _check_spelling(formula: Formula, names: Sequence[str]) -> None:
    """Refuse a parameter whose name looks like a misspelt quantity; a fit would free it as a new parameter."""
    known = {name.replace("_", ""): name for name in (*SIGNALS, *QUANTITIES, *FUNCTIONS)}
    for name in names:
        plain = name.lower().replace("_", "")
        long = [word for word in known if len(word) > 2]
        swapped = [word for word in long if sorted(word) == sorted(plain)]
        near = [plain] if plain in known else swapped or get_close_matches(plain, long, 1, _LIKENESS)
        if near:
            meant = known[near[0]]
            refuse(
                formula.text,
                f"{name!r} looks like {meant!r}. Write that, or say that you mean it: `; {name}=0.01[-1,1]`",
            )


def _parameter(name: str, given: _Given | None, *, amplitude: bool) -> Parameter:
    start, bounds = given or (AMPLITUDE if amplitude else 1.0, None)
    meaning = f"{name} of the expression: " + ("at 0 it does nothing" if amplitude else "shapes the effect")
    if bounds is None and amplitude:
        reach = max(REACH, DECADE * abs(start))
        bounds = -reach, reach
    return Parameter(start, bounds or _decades(start), "1", meaning)


def _decades(start: float) -> tuple[float, float]:
    low, high = sorted((start / DECADE, start * DECADE))
    return (low, high) if low < high else (-REACH, REACH)


def _amplitudes(formula: Formula, given: Mapping[str, _Given]) -> tuple[str, ...]:
    """Return the smallest set of parameters that leaves the signal unchanged at 0, for all other parameters."""
    # Of sets of equal size, prefer a set in which the formula is linear: in ``xyz*(1 + k*sin(w*tau))`` k, not w.
    ends = {name: given.get(name, (1.0, None)) for name in formula.parameters}
    bounds = {name: reach or _decades(start) for name, (start, reach) in ends.items()}
    draws = parameter_draws(bounds, 6)
    if not any(_changes(formula, draw) for draw in draws):
        refuse(formula.text, f"is always {formula.signal} itself. Add what changes it, as in `xyz + k*tau*white`")
    may_vanish = [name for name, (_, reach) in ends.items() if reach is None or reach[0] <= 0.0 <= reach[1]]
    for count in range(1, len(may_vanish) + 1):
        fitting = [
            some
            for some in combinations(may_vanish, count)
            if not any(_changes(formula, {**draw, **dict.fromkeys(some, 0.0)}) for draw in draws)
        ]
        if fitting:
            return max(fitting, key=lambda some: _is_linear(formula, some, draws))
    infinite = [name for name in formula.quantities if name in COLUMNS and COLUMNS[name].usual == inf]
    return refuse(
        formula.text,
        f"is not {formula.signal} itself when its parameters are 0. Add a change to the signal, as in "
        f"`xyz + k*tau*white`, `xyz*(1 - k*tau)` or `linear**(1 + k)`, with 0 inside the bounds of k. "
        f"Read here as quantities: {', '.join(formula.quantities) or 'none'}; as parameters: "
        f"{', '.join(formula.parameters) or 'none'}"
        + "".join(f"; {name} is infinite when {OF_COLUMN[name].label(inf)}" for name in infinite),
    )


def _changes(formula: Formula, values: Mapping[str, float]) -> bool:
    """Whether the result of the formula differs from the signal, or is not a number."""
    signal = readings(SIGNALS[formula.signal]).signal
    return not np.allclose(_result(formula, values), signal, rtol=1e-12, atol=1e-12 * float(np.abs(signal).max()))


def _result(formula: Formula, values: Mapping[str, float]) -> Array:
    reading = readings(SIGNALS[formula.signal])
    return formula(reading.signal, reading.scene, **values)


def _is_linear(formula: Formula, some: Sequence[str], draws: Sequence[Mapping[str, float]]) -> bool:
    """Whether the change of the signal is proportional to the parameters ``some``."""
    signal = readings(SIGNALS[formula.signal]).signal
    for draw in draws:
        once, twice = (
            _result(formula, {**draw, **{name: factor * draw[name] for name in some}}) - signal for factor in (1.0, 2.0)
        )
        if not np.allclose(twice, 2.0 * once, rtol=1e-9, atol=1e-9 * float(np.abs(signal).max())):
            return False
    return True
