"""Rows of ``bench``: the speed of comparison and diagnosis, and the gain of lutgen's shortcuts over the naive methods.

The readings are simulated (``tests/virtual_display``): 1094 readings at 10 hours. Eight hours are sessions of the full
design; at the two hours between them white and primaries are not read. A further campaign has half of the sessions, and
only its hidden effect ages the display. The goals: a comparison within 2 s, a diagnosis within 10 s, and at most 500 MB
of memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from examples.racing import LUTGEN, Peer, against_limit, peak_memory, race, run, seconds_of
from lutgen import read_measurements
from lutgen.criticism.fit.heldout import cells, held_out
from lutgen.criticism.fit.least_squares import fit, start_state
from lutgen.criticism.fit.linear import State, Term, predict, tip_scale, whiten
from lutgen.criticism.fit.problem import Problem
from lutgen.effects import catalogue
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from examples.racing import Row
    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit

DIAGNOSE_LIMIT_S, COMPARE_LIMIT_S, MEMORY_LIMIT_MB = 10.0, 2.0, 500.0

SESSIONS = (0.0, 1000.0, 2500.0, 4500.0, 6000.0, 8500.0, 11_500.0, 18_000.0)

#: Hidden effects: name of the row → effects as (name, size, form). ``other`` is a formula that lutgen does not have.
HIDDEN = {
    "nothing hidden": (),
    "one effect hidden": (("black-level", 0.0006, "other"),),
    "two effects hidden": (("black-level", 0.0006, "other"), ("eotf-drift", 0.15, "same")),
    "two effects of typical size hidden": (("black-level", 0.0016, "other"), ("warm-up", 0.1, "other")),
}

#: Hidden effects of the campaign that is diagnosed from hour 0.
WORN = (("phosphor-wear", 0.2, "other"),)

#: The effect that is fitted in races against the naive methods, and its free parameters.
FITTED = ("black-level", ("new", "grown", "power", "tint_x", "tint_z"))

#: Relative decrease of χ² at which the naive fit stops, about that of lutgen's own fit.
GAIN = 2e-5

#: Step between the cells that the naive method refits; its time is scaled to all cells.
EVERY = 10


@dataclass(frozen=True)
class Work:
    """The amount of work: the sessions' hours and design, and the repetitions of commands and of races.

    ``worn``: the hours of the sessions of the display that is diagnosed from hour 0.
    """

    sessions: tuple[float, ...] = SESSIONS
    worn: tuple[float, ...] = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)
    design: str = "full"
    commands: int = 3
    races: int = 3

    @classmethod
    def quick(cls) -> Work:
        """Return few readings for every row."""
        few = (0.0, 1000.0, 2500.0)
        return cls(few, few, design="colours", commands=1, races=1)


def criticism(work: Work, folder: Path) -> Iterator[Row]:
    """Yield all rows."""
    files = {}
    for name, hidden in HIDDEN.items():
        files[name] = folder / f"{name.replace(' ', '-')}.csv"
        campaign = Campaign(design=work.design, hours=work.sessions, hidden=hidden)
        files[name].write_text(csv_text(campaign), encoding="utf-8")
    problem = Problem.of(read_measurements(files["one effect hidden"]))
    size = f"{problem.rows.size} readings at {problem.hours.size} hours"
    yield from _commands(work, files, size, folder)
    yield _from_hour_0(work, folder)
    yield _fitting(work, problem, size)
    yield _confirming(work, problem)


def _commands(work: Work, files: dict[str, Path], size: str, folder: Path) -> Iterator[Row]:
    """Time `lutgen compare` and `lutgen diagnose` as processes, with the whole catalogue and its refined forms."""
    *_, hardest = files
    yield _timed(work, f"compare {size}, {hardest}", ["compare", str(files[hardest])], COMPARE_LIMIT_S)
    for name, file in files.items():
        yield _timed(work, f"diagnose {size}, {name}", ["diagnose", str(file)], DIAGNOSE_LIMIT_S)
    peaks = [peak_memory([*LUTGEN, "diagnose", str(files[hardest])], folder) for _ in range(work.commands)]
    yield against_limit("peak memory of that diagnosis (PSS)", peaks, MEMORY_LIMIT_MB, "MB")


def _from_hour_0(work: Work, folder: Path) -> Row:
    """Time `lutgen diagnose` on a display whose later white and primaries are predicted from the first session."""
    file = folder / "worn.csv"
    campaign = Campaign(design=work.design, hours=work.worn, hidden=WORN, baseline="first-hour")
    file.write_text(csv_text(campaign), encoding="utf-8")
    hours = campaign.readings.hours
    title = f"diagnose {hours.size} readings at {np.unique(hours).size} hours, phosphor-wear from hour 0"
    return _timed(work, title, ["diagnose", str(file), "--baseline", "first-hour"], DIAGNOSE_LIMIT_S)


def _timed(work: Work, title: str, arguments: list[str], limit: float) -> Row:
    command = partial(run, [*LUTGEN, *arguments])
    return against_limit(title, [seconds_of(command) for _ in range(work.commands)], limit, "s")


def _fitting(work: Work, problem: Problem, size: str) -> Row:
    """Race two fits of the same effect to the same readings: tips eliminated, or all unknowns at once."""
    name, form = FITTED
    terms = (Term.at_rest(catalogue()[name], form),)
    at_once = AllAtOnce(problem, terms)
    mine, theirs = fit(problem, terms).chi2, at_once.chi2()
    # Both fits stop where another step reduces χ² by almost nothing.
    if abs(mine - theirs) > 1e-3 * theirs:
        raise SystemExit(f"bench: the fits end elsewhere: chi2 {mine:.2f}, and {theirs:.2f} by least_squares")
    unknowns = f"{at_once.start.size - len(form)} unknowns of white, primaries and gains"
    title = f"fit of {name}, {len(form)} parameters and {unknowns}, {size}"
    peer = Peer("scipy.optimize.least_squares, all unknowns at once", at_once.chi2)
    return race(title, partial(fit, problem, terms), peer, times=work.races)[0]


@dataclass(frozen=True)
class AllAtOnce:
    """The naive fit: parameters, tips of every hour and session gains in one vector, derivatives by differences.

    The prediction, its noise and the priors on tips and gains are lutgen's own.
    """

    problem: Problem
    terms: tuple[Term, ...]

    @property
    def start(self) -> Array:
        """Return the initial vector."""
        state = start_state(self.problem, self.terms)
        values = [term.values[name] for term in self.terms for name in term.free]
        return np.concatenate([values, (state.tips / tip_scale(self.problem)).ravel(), state.gains])

    def chi2(self) -> float:
        """Fit, and return χ²."""
        start = self.start
        bounds = np.full((2, start.size), np.inf) * [[-1.0], [1.0]]
        count = sum(len(term.free) for term in self.terms)
        bounds[:, :count] = np.concatenate([term.bounds for term in self.terms]).T
        solution = least_squares(self._residuals, start, bounds=bounds, x_scale="jac", ftol=GAIN)
        return float(2.0 * solution.cost)

    def _residuals(self, vector: Array) -> Array:
        problem, place, terms = self.problem, 0, []
        for term in self.terms:
            terms.append(term.moved([float(value) for value in vector[place : place + len(term.free)]]))
            place += len(term.free)
        tips = vector[place : place + 12 * problem.hours.size].reshape(-1, 4, 3) * tip_scale(problem)
        gains = vector[place + tips.size :]
        residual = whiten(problem, problem.xyz - predict(problem, State(tuple(terms), tips, gains)))
        between = ~problem.is_knot
        off = (problem.interpolated(tips) - tips)[between] / problem.interpolation_sigma[between]
        return np.concatenate([residual.ravel(), off.ravel(), gains / max(problem.noise.session, 1e-6)])


def _confirming(work: Work, problem: Problem) -> Row:
    """Race the error of withheld cells: one step from the full fit, or a fit without each cell."""
    name, form = FITTED
    solution = fit(problem, (Term.at_rest(catalogue()[name], form),))
    withheld = cells(problem)
    some = withheld[::EVERY]
    mine, theirs = float(solution.withheld.squares[::EVERY].sum()), _refitted(solution)
    # For a nearly linear problem, one step gives the result of a fit.
    if abs(mine - theirs) > 0.02 * theirs:
        raise SystemExit(f"bench: withheld readings are missed by {mine:.1f} after a step, by {theirs:.1f} after a fit")
    peer = Peer(f"a fit for each, {len(some)} timed", partial(_refitted, solution), None, len(withheld) / len(some))
    title = f"held-out error of that fit, {len(withheld)} cells"
    ours = partial(held_out, problem, solution.terms, solution.projection)
    return race(title, ours, peer, times=work.races)[0]


def _refitted(solution: Fit) -> float:
    """Return the squared whitened error of every ``EVERY``-th cell, each predicted by a fit to all other readings."""
    problem, error = solution.problem, 0.0
    start = solution.state
    for cell in cells(problem)[::EVERY]:
        rest = problem.without([int(row) for row in problem.rows[cell]])
        again = fit(rest, solution.terms, start)
        left = whiten(problem, problem.xyz - predict(problem, State(again.terms, again.tips, again.gains)))[cell]
        error += float((left**2).sum())
    return error
