"""The next measurement: the patches that best distinguish two rival effects (T-optimality).

Atkinson & Fedorov, Biometrika 62, 57-70 (1975), doi:10.1093/biomet/62.1.57. The fit of one effect is assumed to be
true. Noise-free readings of candidate patches are added, and the other effect is fitted to all readings. The χ² of this
second fit is the separation that the patches give.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term, predict
from lutgen.readings.conditions import COLUMNS, CONDITIONS
from lutgen.readings.rest import is_tip

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.search.candidates import Candidate
    from lutgen.criticism.search.explanation import Explanation


@dataclass(frozen=True)
class Patch:
    """A patch to measure: its code value and, if it is not at rest, its conditions by column."""

    code: tuple[float, float, float]
    conditions: Mapping[str, float]
    note: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return its columns."""
        red, green, blue = self.code
        note = {"note": self.note} if self.note else {}
        return {"R": red, "G": green, "B": blue, **self.conditions, **note}


def _greys(levels: tuple[float, ...], note: str = "") -> tuple[Patch, ...]:
    return tuple(Patch((level, level, level), {}, note) for level in levels)


def _ramps(colours: tuple[tuple[int, int, int], ...], levels: tuple[float, ...]) -> tuple[Patch, ...]:
    return tuple(Patch((r * level, g * level, b * level), {}) for r, g, b in colours for level in levels)


_PRIMARIES, _SECONDARIES = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), ((1, 1, 0), (1, 0, 1), (0, 1, 1))
_MIXTURES = tuple(
    Patch((float(r), float(g), float(b)), {}) for r, g, b in np.random.default_rng(9).random((12, 3)).round(3)
)

#: Sets of patches that can be measured: name → patches. Each condition adds its own set.
POOL: dict[str, tuple[Patch, ...]] = {
    "lens cap": _greys((0.0, 0.0, 0.0), "lens cap"),
    "black and dark greys": _greys((0.0, 0.0, 0.0, 0.05, 0.1, 0.2)),
    "nine greys": _greys((0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)),
    "ramps of red, green, blue": _ramps(_PRIMARIES, (0.15, 0.3, 0.45, 0.6, 0.75, 0.9)),
    "secondaries": _ramps(_SECONDARIES, (1.0, 0.6)),
    "mixtures": _MIXTURES,
} | {name: tuple(Patch(*patch) for patch in patches) for name, patches in (each.varied for each in CONDITIONS)}


@dataclass(frozen=True)
class Separation:
    """Patches that distinguish two rivals, and χ² between the rivals before and after these patches are read once."""

    separates: tuple[str, str]
    name: str
    patches: tuple[Patch, ...]
    before: float
    after: float

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "separates": list(self.separates),
            "name": self.name,
            "patches": [patch.as_json() for patch in self.patches],
            "separation_before": self.before,
            "separation_after": self.after,
        }


def what_separates(explanation: Explanation, pair: tuple[str, str]) -> Separation:
    """Find the set of patches that best separates an admitted effect from its rival."""
    step = next(each for each in explanation.steps if each.name == pair[0])
    rival = next(each for each in step.rivals if each.name == pair[1])
    return separation(step.chosen.fit if len(explanation.steps) == 1 else explanation.final, rival.best, pair)


def separation(truth: Fit, rival: Candidate, pair: tuple[str, str]) -> Separation:
    """Find the patches that ``rival`` predicts worst if the fit ``truth`` is true."""
    others = tuple(term for term in truth.terms if term.effect.name != pair[0] and term.effect.name != pair[1])
    terms = (*others, rival.term)
    truth = replace(truth, problem=rival.fit.problem)
    before = _chi2_of(terms, truth, ())
    after = {name: _chi2_of(terms, truth, patches) for name, patches in POOL.items()}
    # The gain of a set is divided by the square root of its size: large sets take time to measure.
    best = max(after, key=lambda name: (after[name] - before) / len(POOL[name]) ** 0.5)
    return Separation(pair, best, POOL[best], before, after[best])


def _chi2_of(terms: tuple[Term, ...], truth: Fit, patches: tuple[Patch, ...]) -> float:
    """Return χ² of ``terms`` fitted to noise-free readings of ``truth``, with patches added at the last hour."""
    problem = with_patches(truth.problem, patches)
    # The added patches belong to known sessions, but may change the order of the sessions' gains.
    number = {key: place for place, key in enumerate(truth.problem.gain_keys)}
    gains = [truth.gains[number[key]] if key in number else 0.0 for key in problem.gain_keys]
    state = State(truth.terms, truth.tips, np.array(gains or [0.0]))
    # The weights follow from the prediction, because the added rows have no reading.
    return fit(problem.with_light(predict(problem, state)), terms, state).chi2


def with_patches(problem: Problem, patches: tuple[Patch, ...]) -> Problem:
    """Add rows for patches at the last hour at which tips were read; the XYZ of these rows are placeholders."""
    patches = tuple(patch for patch in patches if not set(patch.conditions) & {name for name, _ in problem.assumed})
    if not patches:
        return problem
    readings = problem.readings
    hour = float(problem.hours[problem.is_knot][-1])
    place = int(np.searchsorted(readings.hours, hour, side="right"))
    count = len(patches)
    # The patches join the session that reads tips at rest at that hour, and have the rest conditions of this session.
    host = int(np.flatnonzero(readings.at_rest() & (readings.hours == hour) & is_tip(readings.drive).any(axis=1))[-1])
    conditions = {}
    for name in COLUMNS:
        if name in readings.conditions or any(name in patch.conditions for patch in patches):
            given = readings.column(name)
            rest = given[host]
            new = [patch.conditions.get(name, rest) for patch in patches]
            conditions[name] = np.insert(given, place, new)
    session = list(readings.session or ("",) * readings.hours.size)
    note = list(readings.note or ("",) * readings.hours.size)
    session[place:place] = [session[host]] * count
    note[place:place] = [patch.note for patch in patches]
    added = replace(
        readings,
        hours=np.insert(readings.hours, place, np.full(count, hour)),
        drive=np.insert(readings.drive, place, [patch.code for patch in patches], axis=0),
        xyz_cd_m2=np.insert(readings.xyz_cd_m2, place, np.ones((count, 3)), axis=0),
        lines=np.insert(readings.lines, place, np.zeros(count)),
        conditions=conditions,
        session=tuple(session),
        note=tuple(note),
        order=None,
        files=(),
    )
    shifted = np.where(problem.rows >= place, problem.rows + count, problem.rows)
    weights = None if problem.weights is None else np.insert(problem.weights, place, np.ones(count))
    return replace(
        problem,
        readings=added,
        weights=weights,
        rows=np.sort(np.concatenate([shifted, np.arange(place, place + count)])),
    )
