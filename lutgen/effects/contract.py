"""The contract of an effect: the properties that fits and LUTs rely on, checked in this process on ``probe`` readings.

Each clause is a function of an effect. The function returns one sentence that says how the effect satisfies the clause,
or raises :class:`Broken` with a sentence that says with which values the effect breaks the clause.
:mod:`lutgen.effects.child` checks a file under limits of time and memory, for ``lutgen effects --check``.
"""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects import probe
from lutgen.effects.declare import Effect
from lutgen.effects.own import what_was_raised
from lutgen.effects.probe import ProbeReading
from lutgen.effects.scene import Scene
from lutgen.errors import LutgenError, listed
from lutgen.readings.conditions import COLUMNS


@dataclass(frozen=True)
class Clause:
    """The result of one clause of the contract: passed or not, and one sentence with the reason."""

    clause: str
    passed: bool
    sentence: str


class Broken(LutgenError):  # noqa: N818 - the name says that a clause is broken
    """An effect breaks a clause; the message says how."""


def examine(effect: Effect) -> Iterator[Clause]:
    """Check the clauses one after the other, in this process; stop after a broken clause of ``BASIC``."""
    if effect.stage == "selection":
        yield Clause("runs", passed=True, sentence="This effect has no function: it only selects the paper's matrix.")
        return
    for name, clause in CLAUSES.items():
        try:
            with np.errstate(all="ignore"):
                yield Clause(name, passed=True, sentence=clause(effect))
        except Broken as broken:
            yield Clause(name, passed=False, sentence=str(broken))
            if name in BASIC:
                return


def _runs(effect: Effect) -> str:
    for reading in (probe.readings(effect.stage, at_rest=True), probe.readings(effect.stage)):
        _apply(effect, reading, effect.typical())
    return "Takes readings under all conditions."


def _shapes(effect: Effect) -> str:
    for case, reading in _cases(effect.stage).items():
        result = _apply(effect, reading, effect.typical())
        expected = reading.signal.shape
        # Tips of one hour under many conditions: the result may have one set of tips, or one for each reading.
        shared = case == "white and primaries shared by all readings"
        if shared and result.shape == (probe.READINGS, *expected[-2:]):
            continue
        if result.shape != expected:
            raise Broken(
                f"{case}: takes a signal of shape {reading.signal.shape} and returns {result.shape}. Return the shape "
                f"that came in."
            )
    return f"Returns the shape that comes in: {', '.join(_cases(effect.stage))}."


def _neutral(effect: Effect) -> str:
    others = [name for name in effect.parameters if name not in effect.neutral]
    bounds = {name: effect.parameters[name].bounds for name in others}
    points = [effect.typical(), *probe.parameter_corners(bounds), *probe.parameter_draws(bounds, probe.DRAWS)]
    neutral = ", ".join(f"{name} = {value:g}" for name, value in effect.neutral.items())
    for reading in (probe.readings(effect.stage, at_rest=True), probe.readings(effect.stage)):
        for values in points:
            result = _apply(effect, reading, effect.rest() | values | dict(effect.neutral))
            change = np.abs(result - reading.signal)
            if not change.max() <= probe.ROUNDING * np.abs(reading.signal).max():
                worst = _worst(change)
                raise Broken(
                    f"At its neutral values ({neutral or 'it has none'}) it changes {_which(reading, worst)} by "
                    f"{change[worst].max():.3g}{_with(values, others)}. There it must return the signal as it came."
                )
    suffix = ", for all values of the other parameters" if others else ""
    return f"Changes nothing at its neutral values ({neutral}){suffix}."


def _finite(effect: Effect) -> str:
    bounds = {name: parameter.bounds for name, parameter in effect.parameters.items()}
    corners = probe.parameter_corners(bounds)
    for values in (*corners, *probe.parameter_draws(bounds, probe.DRAWS)):
        for reading in (probe.readings(effect.stage, at_rest=True), probe.readings(effect.stage)):
            result = _apply(effect, reading, values)
            if not np.isfinite(result).all():
                worst = _worst(~np.isfinite(result))
                kinds = [name for name, found in (("NaN", np.isnan), ("infinity", np.isinf)) if found(result).any()]
                raise Broken(
                    f"Gives {listed(kinds)} for {_which(reading, worst)}{_with(values)}. Narrow the bounds, or "
                    f"guard the formula there (a root or power of a negative number, a division by zero)."
                )
    return (
        f"Gives finite numbers in {len(corners)} corners of its parameters' bounds and at {probe.DRAWS} points inside."
    )


def _input(effect: Effect) -> str:
    for reading in _cases(effect.stage).values():
        given = probe.copied(reading)
        _apply(effect, given, effect.typical(), copy=False)
        if not np.array_equal(given.signal, reading.signal):
            raise Broken("Writes into the signal that it is given. Return a new array: `xyz + …`, not `xyz += …`.")
        for name, array in probe.arrays(reading.scene).items():
            if not np.array_equal(array, probe.arrays(given.scene)[name]):
                raise Broken(f"Writes into scene.{name}. Leave the scene as it is, and compute with copies.")
    return "Leaves the signal and the scene that it is given as they are."


def _repeatable(effect: Effect) -> str:
    first, second = (_apply(effect, probe.readings(effect.stage), effect.typical()) for _ in range(2))
    if not np.array_equal(first, second, equal_nan=True):
        raise Broken(
            "Gives another result when it is called again. Remove random numbers, the time of day and stored state."
        )
    return "Gives the same bits when it is called again."


def _pointwise(effect: Effect) -> str:
    reading = probe.readings(effect.stage)
    for values in (effect.typical(), *probe.draws(effect)[:2]):
        together = _apply(effect, reading, values)
        tolerance = 1e3 * probe.ROUNDING * np.abs(together).max()
        for row in (0, 7, probe.READINGS - 1):
            alone = _apply(effect, probe.some(reading, slice(row, row + 1), effect.stage), values)
            if not np.allclose(alone, together[row : row + 1], rtol=0, atol=tolerance, equal_nan=True):
                raise Broken(
                    f"Gives {_which(reading, row)} another result alone than among {probe.READINGS} readings. "
                    f"Compute each reading from itself: no mean, maximum or order over axis 0."
                )
        if effect.stage in _STACKED:
            stack = probe.at_once(reading)
            for index, part in enumerate(_apply(effect, stack, values)):
                scene = replace(stack.scene, white=stack.scene.white[index])
                alone = _apply(effect, replace(stack, signal=stack.signal[index], scene=scene), values)
                if not np.allclose(part, alone, rtol=0, atol=tolerance, equal_nan=True):
                    raise Broken("Gives another result for white and primaries alone than among twelve sets at once.")
    return "Gives each reading the same result alone as among others."


def _columns(effect: Effect) -> str:
    reacts = [column for column in COLUMNS if probe.reacts(effect, column, _apply, at_rest=False)]
    idle = [column for column in effect.needs if column not in reacts]
    if idle:
        raise Broken(
            f"Names {listed(idle)} in `needs`, which change nothing. Leave out the columns that it does not read."
        )
    rest = probe.readings(effect.stage, at_rest=True)
    visible_at_rest = any(
        not probe.same(_apply(effect, rest, values), rest.signal) for values in (effect.typical(), *probe.draws(effect))
    )
    alone = [column for column in reacts if probe.reacts(effect, column, _apply, at_rest=True)] or reacts
    missing = [] if visible_at_rest else [column for column in alone if column not in effect.needs]
    if missing:
        raise Broken(
            f"Does nothing under the reference conditions and something where {listed(missing)} differ, which `needs` "
            f"does not name. Add: needs={(*effect.needs, *missing)!r}."
        )
    also = [column for column in reacts if column not in effect.needs]
    read = f"Reads {listed(effect.needs)}, as it says" if effect.needs else "Needs no column"
    return f"{read}{f'; reacts to {listed(also)} too' if also else ''}."


def _influence(effect: Effect) -> str:
    reading = probe.readings(effect.stage)
    for name, parameter in effect.parameters.items():
        for values in (effect.typical(), *probe.draws(effect)):
            low, high = (_apply(effect, reading, {**values, name: end}) for end in parameter.bounds)
            if not probe.same(low, high):
                break
        else:
            low_text, high_text = (f"{end:g}" for end in parameter.bounds)
            raise Broken(
                f"Parameter {name!r} changes nothing between {low_text} and {high_text}. Use it or take it out: a fit "
                f"cannot find it."
            )
    return "Every parameter changes something." if effect.parameters else "Has no parameters."


#: Name of each clause → the function that checks the clause, in the order of the report.
CLAUSES: dict[str, Callable[[Effect], str]] = {
    "runs": _runs,
    "shapes": _shapes,
    "repeatable": _repeatable,
    "neutral": _neutral,
    "finite": _finite,
    "input untouched": _input,
    "reading by reading": _pointwise,
    "columns named": _columns,
    "parameters matter": _influence,
}

#: If an effect breaks one of these clauses, the later clauses cannot be checked.
BASIC = ("runs", "shapes", "repeatable")

#: Stages whose signals may have a leading axis for many sets of tips.
_STACKED = {"emission", "optics", "viewing", "instrument"}


def _cases(stage: str) -> dict[str, ProbeReading]:
    """Return the readings in every shape that fits and LUTs use, by the name of the case."""
    full, rest = probe.readings(stage), probe.readings(stage, at_rest=True)
    one_reading = probe.some(full, slice(0, 1), stage)
    one_hour = replace(rest, scene=replace(rest.scene, hours=np.full((1, 1), 9000.0), white=rest.scene.white[:1]))
    cases = {"many readings": full, "one reading": one_reading, "one hour": one_hour}
    if stage in _STACKED:
        cases["twelve sets of white and primaries"] = probe.at_once(full)
    if stage == "emission":
        cases["white and primaries shared by all readings"] = replace(full, signal=full.signal[:1])
    return cases


def _apply(effect: Effect, reading: ProbeReading, values: Mapping[str, float], *, copy: bool = True) -> Array:
    """Apply an effect to a reading; an exception of a user's function breaks the clause."""
    given = probe.copied(reading) if copy else reading
    try:
        result: object = effect.function(given.signal, given.scene, **values)
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        code = getattr(effect.function, "__code__", None)
        reason = what_was_raised(error, code.co_filename if code else "")
        raise Broken(f"Raises {reason}{_with(values)}.{_hint(effect, reason)}") from None
    if not isinstance(result, np.ndarray) or result.dtype != np.float64:
        kind = f"an array of {result.dtype}" if isinstance(result, np.ndarray) else type(result).__name__
        raise Broken(f"Returns {kind}. Return a numpy array of float64, as the signal is.")
    return result


def _hint(effect: Effect, message: str) -> str:
    if "'Scene' object has no attribute" in message:
        known = [name for name in dir(Scene) if not name.startswith("_")]
        return f" A scene has: {', '.join([*probe.arrays(probe.readings(effect.stage).scene), *known])}."
    if effect.stage == "emission" and "broadcast" in message:
        return " Columns such as scene.tau are (n, 1), white and primaries (n, 4, 3): write scene.tau[..., np.newaxis]."
    return ""


def _worst(change: Array) -> int:
    """Return the index of the reading with the largest change."""
    return int(np.argmax(change.reshape(len(change), -1).max(axis=1)))


def _which(reading: ProbeReading, row: int) -> str:
    code = ", ".join(f"{value:.3g}" for value in reading.scene.code[row])
    hours = np.broadcast_to(reading.scene.hours, (probe.READINGS, 1))[row][0]
    return f"the reading of code ({code}) at hour {hours:g}"


def _with(values: Mapping[str, float], names: list[str] | None = None) -> str:
    given = [f"{name} = {value:g}" for name, value in values.items() if names is None or name in names]
    return f" with {', '.join(given)}" if given else ""


@dataclass(frozen=True)
class Report:
    """The results of the contract's clauses for one effect."""

    effect: str
    clauses: tuple[Clause, ...]

    @property
    def failure(self) -> Clause | None:
        """The first broken clause, or None."""
        return next((clause for clause in self.clauses if not clause.passed), None)

    @property
    def passed(self) -> bool:
        """Whether the effect satisfies every clause."""
        return self.failure is None

    def as_json(self) -> dict[str, Any]:
        """Return the report in the form of its JSON."""
        clauses = [{"clause": each.clause, "passed": each.passed, "sentence": each.sentence} for each in self.clauses]
        return {"effect": self.effect, "passed": self.passed, "clauses": clauses}


def check(effect: Effect) -> Report:
    """Check an effect's contract in this process; redirect the effect's output to standard error."""
    with redirect_stdout(sys.stderr):
        return Report(effect.name, tuple(examine(effect)))


def refuse_unsound(files: Iterable[str | Path] = (), expressions: Iterable[str] = ()) -> None:
    """Check the contract of a user's own effects and of installed effects, before fits and LUTs use them.

    Raises LutgenError: an effect cannot be loaded, or breaks a clause; the message names the first broken clause.
    """
    from lutgen.effects.expression import parse
    from lutgen.effects.own import installed, load_file

    for each in (*(each for path in files for each in load_file(path)), *installed(), *map(parse, expressions)):
        refuse_broken(check(each), each.origin)


def refuse_broken(report: Report, origin: str) -> None:
    """Raise LutgenError with the first broken clause of a report, if any; ``origin`` is the effect's origin."""
    if report.failure:
        raise LutgenError(
            f"{origin}: effect {report.effect!r} breaks the contract, clause {report.failure.clause!r}: "
            f"{report.failure.sentence}"
        )
