"""``python -m tests.interval_coverage``: how often a parameter ± 1.96 standard errors contains the true value.

Simulated displays of lutgen's own chain have one or two effects, at three to ten times the smallest size that their
readings show, in simple and in refined forms. The same forms are fitted, and the interval of each parameter should
contain the true value. Noise, gains and the meter's drift are estimated from each campaign. ``make hidden`` tests
whether one form is mistaken for another. The exit code is 1 if the share is outside ``GOAL`` by more than twice its
standard error.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.verdict.visibility import visibility
from lutgen.effects import Effect, catalogue
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)

#: Required range of the share.
GOAL = (0.93, 0.97)

#: Number of standard errors on either side that contain 95 % of a normal distribution.
REACH = 1.96

#: Hidden effects, each with its free parameters. The first parameter is the size.
CASES: dict[str, dict[str, tuple[str, ...]]] = {
    "a leak": {"black-level": ("new",)},
    "a leak that grows": {"black-level": ("grown", "new")},
    "a gamma": {"eotf-drift": ("grown",)},
    "an S-curve": {"eotf-drift": ("grown", "slope_grown")},
    "a curve at five levels": {
        "eotf-drift": ("level_50", "level_00", "level_25", "level_75", "level_100", "power"),
    },
    "one channel's gamma": {"channel-gamma": ("red_grown", "red_new")},
    "coupled channels": {"crosstalk": ("new", "grown", "exponent")},
    "a weak supply": {"loading": ("new",)},
    "a weak supply with a bend": {"loading": ("new", "bend")},
    "bluish dark greys": {"primary-shift": ("blue_z", "blue_x")},
    "dark edges": {"edge-falloff": ("new", "grown", "exponent")},
    "glare": {"veiling-glare": ("glare",)},
    "warming up": {"warm-up": ("amount", "minutes")},
    "an offset": {"meter-offset": ("offset",)},
    "a leak and a gamma": {"black-level": ("new",), "eotf-drift": ("grown",)},
    "a leak and warming up": {"black-level": ("new", "grown"), "warm-up": ("amount", "minutes")},
    "coupled channels and dark edges": {"crosstalk": ("new",), "edge-falloff": ("new", "grown", "exponent")},
    "a weak supply and glare": {"loading": ("new", "bend"), "veiling-glare": ("glare",)},
    "an offset and coupled channels": {"meter-offset": ("offset",), "crosstalk": ("new", "exponent")},
}


@dataclass(frozen=True)
class Trial:
    """One parameter of one campaign: the error of the estimate in standard errors."""

    case: str
    parameter: str
    off: float

    @property
    def held(self) -> bool:
        """Return whether the interval contains the true value."""
        return abs(self.off) <= REACH


@cache
def healthy(seed: int) -> Fit:
    """Fit a display without effects, in the full design, read by a good instrument."""
    text = csv_text(Campaign(design="full", hours=HOURS, seed=seed))
    return fit(Problem.of(read(text, file="healthy.csv", sha256="")))


@cache
def _smallest(name: str) -> tuple[str, float]:
    effect = catalogue()[name]
    entry = visibility(healthy(6), [effect])[0]
    return entry.parameter, entry.smallest_detectable or abs(effect.parameters[entry.parameter].value)


def truth(effect: Effect, free: Sequence[str], rng: np.random.Generator) -> Term:
    """Draw an effect: sizes of three to ten smallest sizes, shapes from the middle half of the allowed range."""
    term, (shown, smallest) = Term.at_rest(effect, tuple(free)), _smallest(effect.name)
    values = dict(term.values)
    for name in free:
        low, high = effect.parameters[name].bounds
        if name in effect.neutral:
            unit = smallest * (1.0 if effect.parameters[shown].value >= 0 else -1.0)
            largest = 0.8 * (high if unit > 0 else -low)
            size = min(float(np.exp(rng.uniform(np.log(3.0), np.log(10.0)))) * abs(unit), largest)
            values[name] = effect.neutral[name] + np.sign(unit) * size
        elif low > 0 and high / low > 10.0:
            values[name] = float(np.exp(np.log(low) + rng.uniform(0.25, 0.75) * np.log(high / low)))
        else:
            values[name] = low + rng.uniform(0.25, 0.75) * (high - low)
    return replace(term, values=values)


def trials(case: str, seed: Sequence[int]) -> Iterator[Trial]:
    """Simulate one campaign of a case, fit its effects, and compare each free parameter with the truth."""
    rng = np.random.default_rng([*seed, list(CASES).index(case)])
    base = healthy(6)
    there = tuple(truth(catalogue()[name], free, rng) for name, free in CASES[case].items())
    problem = base.problem
    light = predict(problem, State(there, base.tips, base.gains))
    root = np.linalg.cholesky(problem.noise.covariance(light))
    xyz = problem.readings.xyz_cd_m2.copy()
    xyz[problem.rows] = light + np.einsum("nij,nj->ni", root, rng.standard_normal(light.shape))
    measured = Problem.of(replace(problem.readings, xyz_cd_m2=xyz))
    started = [Term.at_rest(term.effect, term.free) for term in there]
    solution = fit(with_shared_errors(measured, fit(measured, started).terms), started)
    for term, true, errors in zip(solution.terms, there, solution.stderr, strict=True):
        for name in term.free:
            if np.isfinite(errors[name]):
                yield Trial(case, f"{term.effect.name} {name}", (term.values[name] - true.values[name]) / errors[name])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the share for each case and for all cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=15, help="campaigns of each case")
    options = parser.parse_args(arguments)
    results: list[Trial] = []
    for case in CASES:
        here = [trial for number in range(options.repeats) for trial in trials(case, [options.seed, number])]
        results += here
        spread = float(np.sqrt(np.mean([trial.off**2 for trial in here])))
        print(f"{case:34} {sum(trial.held for trial in here):4} of {len(here):4}   root mean square {spread:.2f} σ")
        for name in sorted({trial.parameter for trial in here}):
            print(f"    {name:30}", *(f"{trial.off:.1f}" for trial in here if trial.parameter == name))
    share = sum(trial.held for trial in results) / len(results)
    slack = 2.0 * float(np.sqrt(share * (1.0 - share) / len(results)))
    print(f"all: {share:.3f} of {len(results)} intervals; asked: {GOAL[0]} to {GOAL[1]}")
    return int(not GOAL[0] - slack <= share <= GOAL[1] + slack)


if __name__ == "__main__":
    sys.exit(main())
