"""A free term: whether the leftover of a fit still follows anything that the readings vary in.

An F test over thousands of readings misses a leftover that sits in a few. So simple signatures that belong to no effect
are tried on the residuals: light that goes with level, channel, mixture, position, minutes, lux, window, temperature or
order, at all hours alike, growing, or at one hour, and light that is added. Each is one number to fit, with the tips
and the admitted effects free. One after the other is taken into the free term while it is worth its price in BIC: ln n
for the number, and twice the logarithm of how many were looked at for having been chosen. What remains of the gain is
the evidence of the free term, in the currency by which effects are compared; where it is not strong, there is none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.lack_of_fit import is_even, is_within_scatter
from lutgen.criticism.fit.linear import whiten
from lutgen.criticism.search.candidates import STRONG
from lutgen.readings.conditions import CONDITIONS
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.fit.score import Score
    from lutgen.criticism.noise.pure_error import PureError

#: Signatures that a free term holds at most.
MOST = 24

#: A signature of which less than this share remains beside tips and effects says nothing.
LEAST_SEEN = 1e-3

#: A signature of which, in χ², no more than this share is left beside one that was chosen says nothing new.
LEAST_LEFT = 0.05**2

#: Signatures that are projected at once: more take memory.
AT_ONCE = 32

#: Centres of the level probes in code values, and their half width.
LEVELS, WIDTH = (0.1, 0.25, 0.4, 0.6, 0.8), 0.2


@dataclass(frozen=True)
class Probed:
    """A free term beside a fit.

    Attributes
    ----------
    names
        Its signatures, which describe the leftover, best first; empty when the leftover is noise.
    gain
        χ² that they gain together.
    evidence
        By how much BIC falls with it.

    """

    names: tuple[str, ...] = ()
    gain: float = 0.0
    evidence: float = 0.0


def probe(found: Fit, error: PureError) -> Probed:
    """Find the free term of a fit. Gains count in units of the noise that replicates show, or may be assumed."""
    score = found.score
    names, matrix = _columns(score, _signatures(found.problem, found.predicted))
    if not names:
        return Probed()
    price = float(np.log(found.readings)) + 2.0 * float(np.log(len(names)))
    gain, evidence = 0.0, 0.0
    chosen: list[int] = []
    # Of each signature beside those that are chosen: its product with the residuals, its length², and theirs with it.
    pulls, left, along = matrix @ score.residual, np.ones(len(names)), np.zeros((0, len(names)))
    directions = np.zeros((0, matrix.shape[1]))
    while len(chosen) < MOST:
        gains = np.divide(pulls**2, left, out=np.zeros_like(pulls), where=left > 0)
        best = int(np.argmax(gains))
        worth = float(gains[best]) / error.scale - price
        if worth <= 0.0:
            break
        chosen.append(best)
        gain += float(gains[best])
        evidence += worth
        direction = (matrix[best] - along[:, best] @ directions) / np.sqrt(left[best])
        shared = matrix @ direction
        pulls = pulls - shared * (pulls[best] / np.sqrt(left[best]))
        left = np.where(left - shared**2 > LEAST_LEFT * left, left - shared**2, 0.0)
        directions, along = np.vstack([directions, direction]), np.vstack([along, shared])
    if evidence <= STRONG:
        return Probed()
    return Probed(tuple(names[index] for index in chosen), gain, evidence)


def free_term(found: Fit, error: PureError) -> Probed:
    """Find the free term of a fit; where scatter is too large yet even, in units of the scatter that is there."""
    if not is_within_scatter(error, found) and is_even(found):
        error = replace(error, squares=found.chi2, freedom=max(found.freedom, 1), inside=None)
    return probe(found, error)


def _columns(score: Score, signatures: Iterator[tuple[str, Array]]) -> tuple[list[str], Array]:
    """Unit vectors of what tips and effects leave of signatures, (k, 3n), with their names."""
    names, columns, every = [], [np.zeros((0, score.residual.size))], list(signatures)
    for start in range(0, len(every), AT_ONCE):
        some = every[start : start + AT_ONCE]
        raw = whiten(score.problem, np.array([signature for _, signature in some]))
        left, size = score.project(raw), np.linalg.norm(raw.reshape(len(some), -1), axis=1)
        seen = np.linalg.norm(left, axis=1)
        told = (size > 0) & (seen > LEAST_SEEN * size)
        names += [name for (name, _), tells in zip(some, told, strict=True) if tells]
        columns.append(left[told] / seen[told, np.newaxis])
    return names, np.concatenate(columns)


def _strange(problem: Problem, predicted: Array) -> Iterator[tuple[str, Array]]:
    """What no effect of the catalogue does, and displays do: by the order of reading, by sides, by the room's light."""
    if problem.readings.order is not None:
        yield from _in_order(problem, predicted, problem.readings.order[problem.rows])
    top = problem.readings.drive[problem.rows].max(axis=1)
    strange = {name for condition in CONDITIONS for name in condition.strange}
    for name, weight in _conditions(problem):
        if name in strange:
            for shape, factor in (("", np.ones_like(top)), (" and level", 4 * top * (1 - top))):
                yield f"{name}{shape}", predicted * (weight * factor)[:, np.newaxis]


def _in_order(problem: Problem, predicted: Array, order: Array) -> Iterator[tuple[str, Array]]:
    """What goes by the order of reading: light of the patch before, and a steady course through a session."""
    before, course = np.zeros_like(predicted), np.zeros(len(order))
    sessions = problem.readings.sessions[problem.rows]
    for session in np.unique(sessions):
        here = np.flatnonzero(sessions == session)
        read = here[np.argsort(order[here], kind="stable")]
        before[read[1:]] = predicted[read[:-1]] - predicted[read[1:]]
        course[read] = np.arange(read.size) / max(read.size - 1, 1)
    yield "the patch read before", before
    yield "the order of reading", predicted * course[:, np.newaxis]


def _signatures(problem: Problem, predicted: Array) -> Iterator[tuple[str, Array]]:
    """Names and signatures in cd/m², (n, 3)."""
    colours = {"": np.ones(3), " in X": np.array([1.0, 0.0, 0.0]), " in Z": np.array([0.0, 0.0, 1.0])}
    for name, weight in _weights(problem):
        for colour, part in colours.items():
            yield f"light by {name}{colour}", predicted * weight[:, np.newaxis] * part
    yield from _strange(problem, predicted)
    white = problem.measured_tips[:, 0][problem.hour_of]
    for name, weight in _places(problem):
        for colour, part in colours.items():
            yield f"light added {name}{colour}", white * weight[:, np.newaxis] * part


def by_code(problem: Problem) -> Iterator[tuple[str, Array]]:
    """Names and weights (n,) of what goes by code values alone: level, channel and mixture."""
    code = problem.readings.drive[problem.rows]
    top = code.max(axis=1)
    for level in LEVELS:
        near = _near(top, level)
        yield f"level near {level:g}", near
        for channel, share in zip(("red", "green", "blue"), code.T, strict=True):
            yield f"{channel} near {level:g}", near * share / np.maximum(top, 1e-6)
    red, green, blue = code.T
    yield from (("red × green", red * green), ("green × blue", green * blue), ("red × blue", red * blue))


def _near(top: Array, level: float) -> Array:
    return np.maximum(1.0 - np.abs(top - level) / WIDTH, 0.0)


def _weights(problem: Problem) -> Iterator[tuple[str, Array]]:
    code = problem.readings.drive[problem.rows]
    tau = problem.readings.hours[problem.rows] / problem.hours[-1] if problem.hours[-1] > 0 else np.zeros(len(code))
    top, (red, _, blue) = code.max(axis=1), code.T
    for name, weight in by_code(problem):
        yield name, weight
        yield f"{name}, growing", weight * tau
    for level in LEVELS:
        for hour, when in enumerate(problem.hours):
            yield f"level near {level:g} at {when:g} h", _near(top, level) * (problem.hour_of == hour)
    for name, condition in _conditions(problem):
        for shape, factor in (
            ("", np.ones_like(top)),
            (" and level", top),
            (" and level²", top * top),
            (" and red", red),
            (" and blue", blue),
            (" and mixture", np.sort(code, axis=1)[:, 1]),
        ):
            yield f"{name}{shape}", condition * factor
            yield f"{name}{shape}, growing", condition * factor * tau


def _conditions(problem: Problem) -> Iterator[tuple[str, Array]]:
    """Names and weights (n,) of what the conditions of the readings would do."""
    readings = problem.readings
    for condition in CONDITIONS:
        names = [column.name for column in condition.columns]
        if any(name in readings.conditions for name in names):
            values = {name: readings.column(name)[problem.rows] for name in names}
            rest = {name: readings.rest.values[name][problem.rows] for name in names if name in readings.conditions}
            yield from condition.signatures(values, rest).items()


def _places(problem: Problem) -> Iterator[tuple[str, Array]]:
    """Where light may be added: everywhere, growing, under a capped lens, by room light, surround or window."""
    code, hours = problem.readings.drive[problem.rows], problem.readings.hours[problem.rows]
    ones = np.ones(len(code))
    yield "everywhere", ones
    yield "everywhere, growing", hours / max(float(problem.hours[-1]), 1.0)
    yield "before the lens cap", is_capped(problem.readings)[problem.rows].astype(float)
    yield "to black", (code.max(axis=1) == 0).astype(float)
    for name, condition in _conditions(problem):
        yield f"by {name}", condition
