"""Remarks on a verdict: assumed noise, drift, unequal blacks, readings with little weight, and invisible effects."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_uv
from lutgen.criticism.compare.drift import drifts
from lutgen.criticism.first_session.model import white_moved
from lutgen.criticism.noise.tails import OUTLIER
from lutgen.criticism.search.explanation import EVENLY
from lutgen.criticism.verdict import black
from lutgen.criticism.verdict.words import CLEARLY
from lutgen.errors import listed
from lutgen.numerals import in_percent, readable

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.search.candidates import Family
    from lutgen.criticism.search.explanation import Explanation, Step
    from lutgen.criticism.search.influence import Suspicion

#: A remark names a relative noise of replicates above this: twice that of the noisiest of ``readings/instruments``.
NOISY = 0.005

#: White changed suddenly if the change between two sessions is at least this share of all changes from session to
#: session.
MOST_OF_STEPS = 0.75

#: Largest number of lines of readings that a remark names.
NAMED_LINES = 12


def remarks_of(explanation: Explanation, blind: Sequence[str], suspicion: Suspicion) -> tuple[str, ...]:
    """Return remarks on a verdict; ``blind``: names of effects that these readings cannot show."""
    problem = explanation.base.problem
    noise, remarks = problem.noise, [each.sentence() for each in drifts(problem)]
    if noise.source == "assumed":
        remarks.append(
            f"Too few replicates: the noise is assumed, {in_percent(noise.relative, 2)} and "
            f"{noise.floor_cd_m2:.2g} cd/m². Repeat readings three times, or give --instrument."
        )
    if noise.source == "replicates" and noise.relative > NOISY:
        remarks.append(
            f"Repeated readings of a patch differ by {in_percent(noise.relative, 2)} (1 σ), more than with usual "
            f"instruments: their light may depend on the patch that was read before. Errors below this scatter stay "
            f"hidden."
        )
    if problem.from_first_hour and problem.hours.size > 1:
        remarks.append(_what_changed(problem))
    if problem.from_first_hour and problem.readings.metadata.get("luminance") == "held" and not problem.held:
        change = in_percent(white_moved(problem.readings), signed=True)
        remarks.append(
            f"The file says that luminance is held, but white has changed by {change}: no sensor held it, or the "
            f"sensor had no reserve left. Luminance is taken as free."
        )
    if of_black := black.remark(problem):
        remarks.append(of_black)
    if explanation.unknown_table:
        remarks.append(
            "The number of bits is uncertain, since the file lacks the calibration table before the rounding. Sessions "
            "as .ti3 hold this table."
        )
    if suspicion.rows:
        remarks.append(f"Left out, as other readings contradict them: {lines_of(explanation, suspicion)}.")
    if outliers := _with_little_weight(explanation):
        remarks.append(f"Given little weight, as readings of the patch at nearby hours contradict them: {outliers}.")
    if blind:
        remarks.append(f"These data could not have seen: {', '.join(blind)}.")
    return tuple(remarks)


def of_other_forms(step: Step, first: Sequence[Family]) -> str:
    """Say which sizes change clearly in another form of an effect that explains the readings as well; "" if none does.

    ``first``: the families of all effects, each alone. A standard error allows for the noise, not for another form.
    """
    family, chosen = next((each for each in first if each.name == step.name), None), step.chosen
    if not family or family.best.form != chosen.form:
        return ""
    errors = next(
        errors
        for term, errors in zip(chosen.fit.terms, chosen.fit.stderr, strict=True)
        if term.effect.name == step.name
    )
    for other in family.alike:
        moved = [
            f"{name} is {readable(other.term.values[name], 3)} instead of {readable(chosen.term.values[name], 3)}"
            for name in chosen.form
            if name in other.form
            and abs(other.term.values[name] - chosen.term.values[name]) > CLEARLY * errors.get(name, np.inf)
        ]
        if moved:
            return f"With {listed(other.form)} free, the effect explains these readings as well: {listed(moved)}."
    return ""


def _what_changed(problem: Problem) -> str:
    """State the measured change of white and primaries from the first session to the last."""
    first, last = problem.measured_tips[0], problem.measured_tips[-1]
    light = last[:, 1] / first[:, 1]
    shift = np.hypot(*(xyz_to_uv(last) - xyz_to_uv(first)).T)
    names = ("white", "red", "green", "blue")
    changes = listed(f"{name} ×{share:.3f}" for name, share in zip(names, light, strict=True))
    shifts = listed(f"{name} {size:.4f}" for name, size in zip(names, shift, strict=True))
    measured = (
        f"Measured from {problem.hours[0]:g} to {problem.hours[-1]:g} h: luminance of {changes}; Δu'v' of {shifts}."
    )
    return f"{measured}{_sudden(problem)}"


def _sudden(problem: Problem) -> str:
    """Say between which two sessions all colours changed alike, as by a new setting; "" if they changed otherwise."""
    light = problem.measured_tips[:, :, 1] / problem.measured_tips[:1, :, 1]
    steps = np.abs(np.diff(np.log(light[:, 0])))
    even = max(EVENLY * float(np.ptp(light[:, 0])), CLEARLY * 2.0**0.5 * problem.noise.relative)
    if steps.size < 2 or steps.max() < MOST_OF_STEPS * steps.sum() or np.ptp(light[-1]) > even:
        return ""
    at = int(np.argmax(steps))
    return (
        f" All colours changed alike, and mostly between {problem.hours[at]:g} and {problem.hours[at + 1]:g} h, as "
        f"with a new setting of brightness or another meter: lutgen sessions explain finds such changes."
    )


def _with_little_weight(explanation: Explanation) -> str:
    """Name the readings to which heavy tails give little weight; give the lines of the first few."""
    problem = explanation.base.problem
    if problem.weights is None:
        return ""
    rows = [int(row) for row in problem.rows if problem.weights[row] < OUTLIER]
    many = f"{len(rows)} of {problem.rows.size} readings, the first of them in " if len(rows) > NAMED_LINES else ""
    return f"{many}{problem.readings.places(rows[:NAMED_LINES])}" if rows else ""


def lines_of(explanation: Explanation, suspicion: Suspicion) -> str:
    """Name the lines of the readings that are left out, and those whose readings were exchanged."""
    problem = explanation.base.problem
    in_pairs = {row for pair in suspicion.exchanged for row in pair}
    single = [row for row in suspicion.rows if row not in in_pairs]
    of_single = [problem.readings.places(single)] if single else []
    return listed([*of_single, *lines_of_pairs(problem, suspicion.exchanged)])


def lines_of_pairs(problem: Problem, exchanged: Iterable[tuple[int, int]]) -> list[str]:
    """Name the lines of each pair of exchanged readings."""
    return [f"{problem.readings.places(pair)} (each holds what the other should hold)" for pair in exchanged]
