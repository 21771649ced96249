"""Sentences of verdicts: effects that are named, where the residual is largest, and light of whole sessions."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab, xyz_to_uv
from lutgen.criticism.fit.families import kind_of
from lutgen.criticism.fit.linear import State, predict
from lutgen.criticism.search.candidates import HALF, MOST_OF_IT, STRONG
from lutgen.criticism.search.explanation import ages_light, bends_curves, changes_colours
from lutgen.criticism.search.free_term import FreeTerm
from lutgen.criticism.verdict.verdict import Verdict
from lutgen.effects.clause import in_words
from lutgen.errors import listed
from lutgen.numerals import in_percent, percent, spaced

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.search.explanation import Step
    from lutgen.criticism.verdict.imitation import Imitated

NO_FREE_TERM = FreeTerm()

#: Added to a share of χ² if the mean ΔE2000 is not above that of noise.
NOT_SEEN = ", too small to show in the mean ΔE2000"

#: Shifts of chromaticity below this, in u'v', are not mentioned.
VISIBLE_SHIFT = 0.001

#: A clause that gives the size of an effect.
SIZE = re.compile(r"\d(?: %| bits)")

#: Parts of the names of signatures → words. The level of a colour is its largest code value.
SHAPES = {
    "level near ": "the level is near ",
    "red near ": "red is near ",
    "green near ": "green is near ",
    "blue near ": "blue is near ",
    " and level²": " and with the square of the level",
    " and level": " and with the level",
    " and red": " and with the code value of red",
    " and blue": " and with the code value of blue",
    " and mixture": " and with the second-largest code value",
    ", growing": ", growing with the hours",
    " in X": ", in X only",
    " in Z": ", in Z only",
}

#: Two sessions differ in light, or two forms in a size, by more than this number of standard deviations.
CLEARLY = 3.0


def structure(fitted: Fit, residual_term: FreeTerm = NO_FREE_TERM) -> str:
    """Say where the residual of a fit is largest: family or condition, and its free term, or its course."""
    worst, course = strongest(fitted)
    # The signatures of a free term already state how the residual changes with the hours.
    rest = f"; {changes(residual_term.names)}" if residual_term.names else f", {course}"
    return f"it is largest in the readings called '{worst}'{rest}"


def changes(names: Sequence[str]) -> str:
    """Say in words what the first two signatures of a free term do."""
    return ", and ".join(map(_change, names[:2]))


def _change(name: str) -> str:
    """Say in words what a signature of a free term does."""
    for short, words in SHAPES.items():
        name = name.replace(short, words)
    if name.startswith("light added "):
        return f"light is added {name.removeprefix('light added ')}"
    name = name.removeprefix("light by ")
    if " is near " in name:
        return f"light changes where {name}"
    return f"it follows {name}" if name.startswith("the ") else f"light changes with {name}"


def strongest(fitted: Fit) -> tuple[str, str]:
    """Return the family or condition with the largest residual of a fit, and the residual's course in time."""
    problem = fitted.problem
    size, kinds = (fitted.residual**2).sum(axis=1) / 3.0, kind_of(problem)
    excess_of = {str(kind): float(np.maximum(size[kinds == kind] - 1.0, 0.0).mean()) for kind in np.unique(kinds)}
    worst = max(excess_of, key=lambda kind: excess_of[kind])
    hours = [float(size[problem.hour_of == hour].mean()) for hour in range(problem.hours.size)]
    late = np.corrcoef(problem.hours, hours)[0, 1] if np.ptp(hours) > 0 else 0.0
    course = "growing with the hours" if late > 0.6 else "at all hours alike" if late > -0.3 else "more in early hours"
    return worst, course


def like_both(steps: tuple[Step, ...]) -> Verdict:
    """Name two effects that may together imitate one missing effect: one form can follow a large part of the other."""
    first, second = (step.name for step in steps)
    sentence = (
        f"One effect is missing, which resembles both {first} and {second}: the two fit together, but they are too "
        f"similar in these readings to be two separate faults."
    )
    return Verdict("one-of", sentence, (first, second))


def several(
    steps: tuple[Step, ...],
    sizes: Mapping[str, str],
    shares: Mapping[str, float],
    seen: Mapping[str, float],
    left: str,
) -> Verdict:
    """Name several effects; ``sizes`` says how large each is, ``left`` describes the residual of their formulas."""
    names = tuple(step.name for step in steps)
    rivals = tuple((step.name, *(rival.name for rival in step.rivals)) for step in steps if step.rivals)
    is_visible = any(seen.values())
    effects = ", ".join(
        f"{step.name} ({sizes[step.name]}; "
        f"{f'{percent(seen[step.name])} of the excess mean ΔE2000, ' if is_visible else ''}"
        f"{percent(shares[step.name])} of the excess χ²)"
        for step in steps
    )
    sentence = (
        f"More than one effect is missing{'' if is_visible else NOT_SEEN}: {effects}{f'; {left}' if left else '.'}"
    )
    return Verdict("several", sentence, names, rivals)


def clause(step: Step) -> str:
    """Describe an effect at its fitted values.

    Of an effect since the first hour, the clause also says what becomes of white; of a changed curve without a size in
    the clause, how large the largest change of a colour is.
    """
    problem = step.chosen.fit.problem
    text = in_words(step.effect, step.chosen.term.values, problem.hours.tolist())
    if problem.from_first_hour and ages_light(step.effect):
        return f"{text}{_of_white(step)}"
    return f"{text}{_of_colours(step)}" if changes_colours(step.effect) and not SIZE.search(text) else text


def _in_last_session(step: Step) -> tuple[NDArray[np.bool_], Array, Array]:
    """Return the readings at rest of the last session, (n,), and all predictions without and with an effect, (n, 3)."""
    fitted = step.chosen.fit
    problem = fitted.problem
    others = tuple(term for term in fitted.terms if term.effect.name != step.name)
    without, aged = (
        predict(problem, State(terms, fitted.tips, fitted.gains)) for terms in (others, (*others, step.chosen.term))
    )
    return problem.is_at_rest & (problem.hour_of == problem.hours.size - 1), without, aged


def _of_colours(step: Step) -> str:
    """Say how large the largest change of a colour by an effect is, in the last session."""
    here, *light = _in_last_session(step)
    problem = step.chosen.fit.problem
    if not here.any():
        return ""
    labs = (xyz_to_lab(np.maximum(each[here], 0.0), problem.measured_tips[-1, 0]) for each in light)
    most = float(delta_e_2000(*labs).max())
    return f", which changes a colour by up to {most:.1f} ΔE2000 by {spaced(problem.hours[-1])} h"


def _of_white(step: Step) -> str:
    """Say what an effect leaves of white by the last session: the share of its light, and the shift of its colour."""
    problem, (here, *predicted) = step.chosen.fit.problem, _in_last_session(step)
    white, last = here & (problem.drive == 1.0).all(axis=1), problem.hours[-1]
    if not white.any():
        return ""
    without, aged = (each[white].mean(axis=0) for each in predicted)
    shift = float(np.linalg.norm(xyz_to_uv(aged) - xyz_to_uv(without)))
    moved = f" and moves by {shift:.3f} in u'v'" if shift >= VISIBLE_SHIFT else ""
    kept = float(aged[1] / without[1])
    light = f"gains {percent(kept - 1.0)} of light" if kept > 1.0 else f"keeps {percent(kept)} of its light"
    return f", so that white {light}{moved} by {spaced(last)} h"


def excess(step: Step, seen: Mapping[str, float], shares: Mapping[str, float]) -> str:
    """Say which share of the excess mean ΔE2000 an effect explains; of the excess χ² if ΔE2000 has no excess."""
    if any(seen.values()):
        return f"{percent(seen[step.name])} of the excess error"
    return f"{percent(shares[step.name])} of the misfit (χ²){NOT_SEEN}"


def one(
    step: Step,
    size: str,
    *,
    left: str = "",
    simplest: float = 1.0,
    imitated: Imitated | None = None,
    objection: str = "",
    doubt: str = "",
    rest: str = "is noise",
) -> Verdict:
    """Name one effect.

    ``size`` describes how large the effect is, ``left`` the residual of its formula. ``simplest`` is the gain of the
    effect's simplest form as a share of its form's gain. ``imitated`` is the effect that its form follows best.
    ``objection``: a reason of the caller why the effect is not proved; then no other reason is searched for. ``doubt``:
    a reason that counts if there is no other reason. ``rest``: what is said of the error that remains.
    """
    names = (step.name,)
    if step.rivals:
        either = (step.name, *(rival.name for rival in step.rivals))
        like = ", or an effect like these" if left else ""
        sentence = (
            f"One effect is missing, and these data cannot tell which: {listed(either, 'or')}{like}. If it is "
            f"{step.name}, {size}{f', but {left}' if left else '.'}"
        )
        return Verdict("one-of", sentence, either, (either,))
    freed = ", ".join(step.chosen.form)
    if imitated and not objection and _explains_as_much(step, imitated):
        sentence = (
            f"One effect is missing: {step.name} or {imitated.name}, or an effect like these that the catalogue lacks. "
            f"If it is {step.name}, {size}. {imitated.name} also explains {percent(imitated.alone or 0.0)} of it."
        )
        either = (step.name, imitated.name)
        return Verdict("one-of", sentence, either, (either,))
    if objection := objection or _objection(step, freed, simplest, imitated) or doubt:
        sentence = f"{step.name} is missing, or an effect like it that the catalogue lacks: {size}. {objection}"
        return Verdict("one-of", sentence, names)
    if step.chosen.refined:
        simple = "Its simple form does not fit:"
        if simplest > MOST_OF_IT:
            simple = f"Its simple form explains {percent(min(simplest, 1.0))} of that; for the rest"
        sentence = f"{step.name} is missing: {size}. {simple} {freed} had to be free."
        return Verdict("form", sentence, names)
    if left:
        sentence = f"{step.name} is missing ({size}), but {left}"
        return Verdict("form", sentence, names)
    return Verdict("named", f"{step.name} is missing: {size}. With it, what remains {rest}.", names)


def _imitates(step: Step, imitated: Imitated) -> bool:
    """Whether the form of an effect could imitate most of another effect.

    A simple form that could do so counts only if the other effect itself explains half of the misfit.
    """
    if step.chosen.refined:
        return imitated.left < 2 * STRONG or imitated.share < HALF
    return imitated.left < 2 * STRONG and (imitated.alone is None or imitated.alone > HALF)


def _explains_as_much(step: Step, imitated: Imitated) -> bool:
    """Whether the form of an effect could imitate another of its kind that itself explains nearly all.

    The kinds are changes of curves, and aging of the light. No formula of a real display is exact: a better fit of a
    form with more parameters does not decide between the two.
    """
    other = next((each for each in step.effects if each.name == imitated.name), step.effect)
    is_akin = any(kind(step.effect) and kind(other) for kind in (bends_curves, ages_light))
    return is_akin and _imitates(step, imitated) and (imitated.alone or 0.0) > MOST_OF_IT


def _objection(step: Step, freed: str, simplest: float, imitated: Imitated | None) -> str:
    """Say why the fit of a form does not prove its effect; "" if it does."""
    form = f"The form that fits ({freed} free)" if step.chosen.refined else "Its formula"
    if imitated and _imitates(step, imitated):
        if imitated.alone is None:
            return f"{form} could also imitate most of {imitated.name}."
        if imitated.alone < HALF:
            return f"{form} is free enough to imitate other effects too, such as {imitated.name}."
        itself = f"which itself explains {percent(imitated.alone)} of the misfit"
        return f"{form} could also imitate most of {imitated.name} ({itself})."
    if at_bounds := _at_bounds(step):
        return f"{form} has {listed(at_bounds)} at the limit of the allowed range."
    if step.chosen.refined and simplest < HALF:
        share = percent(max(simplest, 0.0))
        return (
            f"{form} owes its fit mainly to its free parameters: a simple form of the effect explains {share} of that."
        )
    return ""


def _at_bounds(step: Step) -> list[str]:
    """Return the free shape parameters of an effect, such as its course in time, that lie at a bound."""
    term = step.chosen.term
    shapes = [name for name in term.free if name not in term.effect.neutral]
    return [name for name in shapes if term.effect.parameters[name].is_at_bound(term.values[name])]


def more_light(current: Fit) -> str:
    """Say which session has how much more light than another; "" if a usual meter's gain explains the difference.

    No effect is named for the difference: the meter's gain and the display's brightness cannot be distinguished. A
    comparison has no gains, so the model may disagree although a diagnosis finds nothing.
    """
    keys, gains = current.problem.gain_keys, current.gains
    if len(keys) < 2:
        return ""
    least, most = int(np.argmin(gains)), int(np.argmax(gains))
    more = float((1.0 + gains[most]) / (1.0 + gains[least]) - 1.0)
    if more < CLEARLY * np.sqrt(2.0) * current.problem.noise.session:
        return ""
    (hour, name), (other_hour, other) = keys[most], keys[least]
    at, than = (name, other) if hour == other_hour else (f"{hour:g} h", f"{other_hour:g} h")
    return f"at {at} it is {in_percent(more, 1)} more than predicted from {than}, equally in all colours"
