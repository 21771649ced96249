"""Wrong rows and wrong sessions: faults of the measurement, found before they are smeared into an effect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.noise.replicates import patch_numbers
from lutgen.readings.rest import TIP_DRIVES

if TYPE_CHECKING:
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem

#: A reading is suspected when noise gives so large a residual less often than this in the whole file.
UNLIKELY = 1e-4

#: ... and when it stands out by this factor from readings of the same patch at other times.
ALONE = 4.0

#: Chance that noise alone makes a session look so bad.
SURE = 1e-12

#: Misfit of an hour over that of the median hour from which on the hour is bad, and up to which a later one is sound.
BAD, SOUND = 4.0, 2.0

#: More rows than this are no slips: something else is wrong.
MOST_ROWS = 5

#: Replicates of more patches than this share do not agree to the last digit by chance.
MOST_COPIES = 0.5

#: No colorimeter that is used on displays scatters by more than this share of the light.
WORST_INSTRUMENT = 0.012


@dataclass(frozen=True)
class Suspicion:
    """A fault of the measurement: rows of the file (indices), hours, and a sentence."""

    rows: tuple[int, ...]
    hours: tuple[float, ...]
    sentence: str


def wrong_rows(found: Fit) -> tuple[int, ...]:
    """Indices of readings that contradict both the fit and their own kin: same patch, other hours or replicates.

    A slip pulls at the tips and makes its neighbours look wrong: so the worst is left out, the rest fitted again, until
    no reading stands alone. When there is no end to it, none of them was a slip.
    """
    out: list[int] = []
    while len(out) <= MOST_ROWS:
        worst = _worst_alone(found)
        if worst is None:
            return tuple(sorted(out))
        out.append(worst)
        found = fit(found.problem.without([worst]), found.terms)
    return ()


def _is_only_tip(problem: Problem, index: int) -> bool:
    """Whether a reading is the only one of a tip at its hour, without which the model has nothing to start from."""
    drive = problem.readings.drive[problem.rows]
    alike = (drive == drive[index]).all(axis=1) & (problem.hour_of == problem.hour_of[index])
    return bool((drive[index] == TIP_DRIVES).all(axis=1).any() and alike.sum() == 1)


def _worst_alone(found: Fit) -> int | None:
    """Index of the reading with the largest residual, when it stands alone."""
    problem = found.problem
    size = (found.residual**2).sum(axis=1)
    worst = int(np.argmax(size))
    if size[worst] < 1.5 * float(chdtri(3, UNLIKELY / max(size.size, 1))) or _is_only_tip(problem, worst):
        return None
    kin = patch_numbers(problem.readings)[problem.rows]
    others = np.flatnonzero(kin == kin[worst])
    if others.size < 3:
        others = np.flatnonzero(problem.hour_of == problem.hour_of[worst])
    usual = float(np.max(size[others[others != worst]], initial=0.0))
    return int(problem.rows[worst]) if size[worst] > ALONE**2 * max(usual, 3.0) else None


def wrong_sessions(found: Fit, scale: float) -> tuple[float, ...]:
    """Hours at which nearly all of the misfit sits although later hours are sound: no aging comes and goes.

    ``scale`` is the variance of the noise in the fit's own units.
    """
    problem = found.problem
    if problem.from_first_hour or problem.hours.size < 4:
        return ()
    # Conditions that few sessions hold, as places on the screen, say nothing of the session.
    rest = problem.readings.at_rest()[problem.rows]
    count = np.bincount(problem.hour_of[rest], minlength=problem.hours.size)
    if not count.all():
        return ()
    squares = (found.residual[rest] ** 2).sum(axis=1) / scale
    mean = np.bincount(problem.hour_of[rest], squares) / (3 * count)
    # An hour that only leans on a bad neighbour is not meant.
    usual = float(np.median(mean))
    bad = np.flatnonzero((mean > BAD * usual) & (mean > 0.05 * mean.max()))
    # From a native display's first session all later ones differ where the display has changed.
    bad = bad[bad > 0] if problem.native else bad
    sure = all(chdtrc(3 * count[hour], mean[hour] * 3 * count[hour]) < SURE for hour in bad)
    if not 1 <= bad.size <= 2 or not sure or bad[0] == problem.hours.size - bad.size:
        return ()
    later = np.setdiff1d(np.arange(bad[0], problem.hours.size), bad)
    if (mean[later] > SOUND * usual).any():
        return ()
    return tuple(float(problem.hours[hour]) for hour in bad)


def suspicious_noise(problem: Problem) -> str:
    """Say what is wrong with the scatter of replicates, if anything."""
    noise = problem.noise
    if noise.source == "instrument" and noise.contrasts >= 6:
        ratio = noise.scatter / (3 * noise.contrasts)
        if fdtrc(3 * noise.contrasts, 1e6, ratio) < 1e-6 and ratio > 2.0:
            return f"replicates scatter {np.sqrt(ratio):.1f} times as much as the stated noise of the instrument allows"
    if noise.source == "replicates" and noise.copied > MOST_COPIES:
        return (
            f"replicates of {noise.copied:.0%} of the patches agree to the last digit, so they are copies and say "
            f"nothing of the noise; give each reading of its own, or state the noise with --instrument"
        )
    if noise.source == "replicates" and noise.relative > WORST_INSTRUMENT:
        return f"replicates scatter by {noise.relative:.1%} of the light, more than any colorimeter in order does"
    return ""
