"""The free term: simple signatures, which belong to no effect, that the residuals of a fit still follow.

An F test over thousands of readings does not find a misfit in a few of them. Therefore simple signatures are fitted to
the residuals: light that is proportional to level, channel, mixture, position, minutes, lux, window, temperature or
order (equally at all hours, growing, or at one hour), and light that is added. Each signature has one parameter; the
tips and the admitted effects stay free. The free term takes one signature after another while the gain of each exceeds
its penalty in BIC: ln n for the parameter, and 2 ln k for the choice among k signatures. The gain minus the penalties
is the evidence of the free term. This evidence is a difference in BIC, so it can be compared with that of effects. If
the evidence is not strong, there is no free term.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.lack_of_fit import is_even, is_noise, is_within_scatter
from lutgen.criticism.fit.linear import whiten
from lutgen.criticism.search.candidates import STRONG
from lutgen.readings.conditions import CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.fit.score import Score
    from lutgen.criticism.noise.pure_error import PureError

#: Largest number of signatures in a free term.
MOST = 24

#: A signature is ignored if tips and effects leave less than this share of its norm.
LEAST_SEEN = 1e-3

#: A signature is ignored if a chosen signature leaves no more than this share of its squared norm.
LEAST_LEFT = 0.05**2

#: Number of signatures that are projected at once: more need too much memory.
AT_ONCE = 32

#: Name of the signature of light that changes steadily along the order of reading.
IN_ORDER = "the order of reading"

#: Centres of the level signatures in code values, and their half width.
LEVELS, WIDTH = (0.1, 0.25, 0.4, 0.6, 0.8), 0.2


@dataclass(frozen=True)
class FreeTerm:
    """The free term of a fit.

    Attributes
    ----------
    names
        Its signatures, which describe the residuals, best first; empty if the residuals are noise.
    gain
        Decrease of χ² by all signatures together.
    evidence
        Decrease of BIC by the free term.

    """

    names: tuple[str, ...] = ()
    gain: float = 0.0
    evidence: float = 0.0


def probe(current: Fit, error: PureError, known: Sequence[str] = (), *, leave_out: Collection[str] = ()) -> FreeTerm:
    """Find the free term of a fit. The unit of its gains is the measured variance of replicates, or the assumed one.

    ``known``: signatures of a free term of another fit. They are also tried as the first signatures: two signatures may
    together explain a residual that neither explains alone. ``leave_out``: columns of conditions that no signature may
    depend on.
    """
    score = current.score
    names, matrix = _columns(score, _signatures(current.problem, current.predicted, leave_out))
    if not names:
        return FreeTerm()
    penalty = float(np.log(current.readings)) + 2.0 * float(np.log(len(names)))
    best = _greedy(matrix, score.residual, error, penalty)
    if known:
        first = [names.index(name) for name in known if name in names]
        best = max(best, _greedy(matrix, score.residual, error, penalty, first), key=lambda each: each[2])
    chosen, gain, evidence, certain = best
    if certain <= STRONG:
        return FreeTerm()
    return FreeTerm(tuple(names[index] for index in chosen), gain, evidence)


def _greedy(
    matrix: Array, residual: Array, error: PureError, penalty: float, first: Sequence[int] = ()
) -> tuple[list[int], float, float, float]:
    """Choose rows of ``matrix`` one after another, ``first`` before others.

    Return the rows, their gain, their evidence, and the evidence that includes the uncertainty of the estimated noise.
    """
    gain, evidence, certain = 0.0, 0.0, 0.0
    chosen: list[int] = []
    # For the part of each signature that is orthogonal to the chosen ones: product with the residuals, and squared
    # norm. ``along``: products of every signature with the chosen directions.
    products, left, along = matrix @ residual, np.ones(len(matrix)), np.zeros((0, len(matrix)))
    directions = np.zeros((0, matrix.shape[1]))
    while len(chosen) < MOST:
        gains = np.divide(products**2, left, out=np.zeros_like(products), where=left > 0)
        best = first[len(chosen)] if len(chosen) < len(first) else int(np.argmax(gains))
        net_gain = error.certain_gain(float(gains[best])) - penalty
        if (net_gain <= 0.0 and len(chosen) >= len(first)) or left[best] <= 0:
            break
        chosen.append(best)
        gain += float(gains[best])
        evidence += float(gains[best]) / error.scale - penalty
        certain += net_gain
        direction = (matrix[best] - along[:, best] @ directions) / np.sqrt(left[best])
        shared = matrix @ direction
        products = products - shared * (products[best] / np.sqrt(left[best]))
        left = np.where(left - shared**2 > LEAST_LEFT * left, left - shared**2, 0.0)
        directions, along = np.vstack([directions, direction]), np.vstack([along, shared])
    return chosen, gain, evidence, certain


def free_term(current: Fit, error: PureError, known: Sequence[str] = ()) -> FreeTerm:
    """Find the free term of a fit as :func:`probe`; if the scatter is large but even, its variance is the unit."""
    if not is_within_scatter(error, current) and is_even(current):
        error = replace(error, squares=current.chi2, freedom=max(current.freedom, 1), inside=None)
    return probe(current, error, known)


def leaves_only_noise(current: Fit, error: PureError, known: Sequence[str] = ()) -> bool:
    """Whether the residual of a fit is noise, by its size, and has no free term."""
    return is_noise(current, error) and not free_term(current, error, known).names


def change_in_order(current: Fit) -> float:
    """Return the relative change of light, from the first to the last reading of a session, that the residuals show."""
    score, problem = current.score, current.problem
    order = problem.readings.order
    if order is None:
        return 0.0
    signature = dict(_in_order(problem, current.predicted, order[problem.rows]))[IN_ORDER]
    left = score.project(whiten(problem, signature))
    return float(left @ score.residual / (left @ left))


def _columns(score: Score, signatures: Iterator[tuple[str, Array]]) -> tuple[list[str], Array]:
    """Return names and unit vectors, (k, 3n), of signatures after projection off tips and effects."""
    names, columns, every = [], [np.zeros((0, score.residual.size))], list(signatures)
    for start in range(0, len(every), AT_ONCE):
        some = every[start : start + AT_ONCE]
        raw = whiten(score.problem, np.array([signature for _, signature in some]))
        left, size = score.project(raw), np.linalg.norm(raw.reshape(len(some), -1), axis=1)
        seen = np.linalg.norm(left, axis=1)
        visible = (size > 0) & (seen > LEAST_SEEN * size)
        names += [name for (name, _), is_visible in zip(some, visible, strict=True) if is_visible]
        columns.append(left[visible] / seen[visible, np.newaxis])
    return names, np.concatenate(columns)


def _outside_catalogue(problem: Problem, predicted: Array, leave_out: Collection[str]) -> Iterator[tuple[str, Array]]:
    """Yield signatures that no effect of the catalogue has: by order of reading, by side, by room light."""
    if problem.readings.order is not None:
        yield from _in_order(problem, predicted, problem.readings.order[problem.rows])
    top = problem.drive.max(axis=1)
    strange = {name for condition in CONDITIONS for name in condition.strange}
    for name, weight in _conditions(problem, leave_out):
        if name in strange:
            for shape, factor in (("", np.ones_like(top)), (" at middle levels", 4 * top * (1 - top))):
                yield f"{name}{shape}", predicted * (weight * factor)[:, np.newaxis]


def _in_order(problem: Problem, predicted: Array, order: Array) -> Iterator[tuple[str, Array]]:
    """Yield the signatures of the order of reading: light of the previous patch, and a linear drift in each session."""
    before, course = np.zeros_like(predicted), np.zeros(len(order))
    sessions = problem.readings.sessions[problem.rows]
    for session in np.unique(sessions):
        here = np.flatnonzero(sessions == session)
        read = here[np.argsort(order[here], kind="stable")]
        before[read[1:]] = predicted[read[:-1]] - predicted[read[1:]]
        course[read] = np.arange(read.size) / max(read.size - 1, 1)
    yield "the patch read before", before
    yield IN_ORDER, predicted * course[:, np.newaxis]


def _signatures(problem: Problem, predicted: Array, leave_out: Collection[str] = ()) -> Iterator[tuple[str, Array]]:
    """Yield names and signatures in cd/m², (n, 3)."""
    colours = {"": np.ones(3), " in X": np.array([1.0, 0.0, 0.0]), " in Z": np.array([0.0, 0.0, 1.0])}
    for name, weight in _weights(problem, leave_out):
        for colour, part in colours.items():
            yield f"light by {name}{colour}", predicted * weight[:, np.newaxis] * part
    yield from _outside_catalogue(problem, predicted, leave_out)
    white = problem.measured_tips[:, 0][problem.hour_of]
    for name, weight in _added_light(problem, leave_out):
        for colour, part in colours.items():
            yield f"light added {name}{colour}", white * weight[:, np.newaxis] * part


def by_code(problem: Problem) -> Iterator[tuple[str, Array]]:
    """Yield names and weights (n,) that depend on code values only: level, channel and mixture."""
    code = problem.drive
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


def _weights(problem: Problem, leave_out: Collection[str]) -> Iterator[tuple[str, Array]]:
    code = problem.drive
    tau = problem.readings.hours[problem.rows] / problem.hours[-1] if problem.hours[-1] > 0 else np.zeros(len(code))
    top, (red, _, blue) = code.max(axis=1), code.T
    for name, weight in by_code(problem):
        yield name, weight
        yield f"{name}, growing", weight * tau
    for level in LEVELS:
        for hour, when in enumerate(problem.hours):
            yield f"level near {level:g} at {when:g} h", _near(top, level) * (problem.hour_of == hour)
    for name, condition in _conditions(problem, leave_out):
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


def _conditions(problem: Problem, leave_out: Collection[str]) -> Iterator[tuple[str, Array]]:
    """Yield names and weights (n,) of the signatures of the readings' conditions."""
    readings = problem.readings
    for condition in CONDITIONS:
        names = [column.name for column in condition.columns]
        if any(name in readings.conditions for name in names) and not set(names) & set(leave_out):
            values = {name: readings.column(name)[problem.rows] for name in names}
            rest = {name: readings.rest.values[name][problem.rows] for name in names if name in readings.conditions}
            yield from condition.signatures(values, rest).items()


def _added_light(problem: Problem, leave_out: Collection[str]) -> Iterator[tuple[str, Array]]:
    """Yield names and weights (n,) of added light: everywhere, growing, under a lens cap, to black, by condition."""
    code, hours = problem.drive, problem.readings.hours[problem.rows]
    ones = np.ones(len(code))
    yield "everywhere", ones
    yield "everywhere, growing", hours / max(float(problem.hours[-1]), 1.0)
    yield "under the lens cap", problem.is_capped.astype(float)
    yield "to black", (code.max(axis=1) == 0).astype(float)
    for name, condition in _conditions(problem, leave_out):
        yield f"by {name}", condition
