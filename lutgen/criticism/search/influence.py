"""Find wrong rows and wrong sessions before the search. Otherwise the search fits an effect to them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc

from lutgen.colorimetry import xyz_to_lab
from lutgen.criticism.fit.families import kind_of
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.noise.replicates import ENOUGH, patch_numbers
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.numerals import in_percent, percent
from lutgen.readings.rest import is_tip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.fit.problem import Problem

#: A reading is an outlier if the probability that noise gives a residual of this size anywhere in the file is below
#: this ...
UNLIKELY = 1e-4

#: ... and if its residual exceeds those of the same patch at other times by this factor.
ALONE = 4.0

#: Smallest distance in CIELAB of an exchanged reading from the readings of its patch in other sessions.
FAR = 5.0

#: A session is wrong if the probability that noise gives a misfit of this size is below this.
SURE = 1e-12

#: Ratio of an hour's misfit to that of the median hour: above the first value the hour is bad; up to the second value a
#: later hour is sound.
BAD, SOUND = 4.0, 2.0

#: Offset and drift of sessions are estimated again if they change by more than this factor.
UNSTEADIER = 2.0

#: Largest number of wrong rows. More outliers than this have another cause.
MOST_ROWS = 5

#: Largest share of patches whose replicates may agree to the last digit by chance.
MOST_COPIES = 0.5

#: Largest relative scatter of a colorimeter for displays.
WORST_INSTRUMENT = 0.012

#: Largest error of a native display's own model, as a share of the light: twice that of any real session.
WORST_MODEL = 0.15


@dataclass(frozen=True)
class Suspicion:
    """Suspected faults of the measurement: rows of the file (indices), hours, a sentence, and pairs among the rows.

    The readings of the two rows of a pair in ``exchanged`` were exchanged.
    """

    rows: tuple[int, ...]
    hours: tuple[float, ...]
    sentence: str
    exchanged: tuple[tuple[int, int], ...] = ()


def exchanged_rows(problem: Problem) -> tuple[tuple[int, int], ...]:
    """Return pairs of rows of one session whose readings were exchanged: each is what other sessions read of the other.

    Colours are compared in CIELAB relative to the white of their session, so that no model of the display is needed.
    Each reading must be far from those of its own patch, and at least ``ALONE`` times as near to those of the other.
    """
    lab = xyz_to_lab(problem.xyz, problem.measured_tips[problem.hour_of, 0])
    patch, hour_of = patch_numbers(problem.readings)[problem.rows], problem.hour_of
    usual = np.full_like(lab, np.nan)
    for number in range(int(patch.max()) + 1):
        rows = np.flatnonzero(patch == number)
        # If all readings of a patch are near one another, none is far from the median of others.
        if not rows.size or np.linalg.norm(np.ptp(lab[rows], axis=0)) <= FAR:
            continue
        for hour in np.unique(hour_of[rows]):
            others = rows[hour_of[rows] != hour]
            if np.unique(hour_of[others]).size > 1:
                usual[rows[hour_of[rows] == hour]] = np.median(lab[others], axis=0)
    off = np.linalg.norm(lab - usual, axis=1)  # NaN where ``usual`` is unknown
    pairs = []
    for hour in range(problem.hours.size):
        far = np.flatnonzero((hour_of == hour) & (off > FAR))
        for one, other in combinations(far.tolist() if far.size <= MOST_ROWS else [], 2):
            back = np.linalg.norm(lab[[other, one]] - usual[[one, other]], axis=1)
            if (ALONE * back < off[[one, other]]).all():
                pairs.append((int(problem.rows[one]), int(problem.rows[other])))
    in_pairs = [row for pair in pairs for row in pair]
    return tuple(pairs) if len(in_pairs) == len(set(in_pairs)) else ()


def without_exchanged(problem: Problem) -> tuple[Problem, tuple[tuple[int, int], ...]]:
    """Return the problem without exchanged readings, and the pairs of their rows."""
    pairs = exchanged_rows(problem)
    return problem.without([row for pair in pairs for row in pair]) if pairs else problem, pairs


def sound_fit(problem: Problem, terms: Sequence[Term]) -> tuple[Fit, tuple[tuple[int, int], ...], tuple[int, ...]]:
    """Return the fit of terms without wrong readings, the pairs of exchanged readings, and the other wrong readings."""
    problem, exchanged = without_exchanged(problem)
    base = fit(with_shared_errors(problem, terms), terms)
    wrong = (*wrong_rows(base), *misread_rows(base.problem))
    return fit(base.problem.without(wrong), terms) if wrong else base, exchanged, wrong


def estimated_again(final: Fit, hidden: Sequence[int]) -> Problem:
    """Return a fit's problem without the rows ``hidden``, with errors of sessions estimated under the fit's effects.

    A misfit can hide a drift of the gain or a dark offset, or look like one of them. The problem stays the same object
    if no row is hidden, and offset and drift change by a factor of at most ``UNSTEADIER``.
    """
    problem = final.problem
    again = with_shared_errors(problem.without(hidden), final.terms)
    differ = _differ(again.wander, problem.wander) or _differ(again.offset_cd_m2, problem.offset_cd_m2)
    return again if hidden or differ else problem


def _differ(left: float, right: float) -> bool:
    return max(left, right) > UNSTEADIER * min(left, right)


def wrong_rows(current: Fit) -> tuple[int, ...]:
    """Return the indices of outliers: they contradict the fit, and the same patch at other hours or in replicates.

    An outlier shifts the fitted tips, so that neighbouring readings also look wrong. Therefore the largest outlier is
    removed and the fit is repeated until no outlier is left. If there are more than ``MOST_ROWS``, the result is empty.
    """
    outliers: list[int] = []
    while len(outliers) <= MOST_ROWS:
        worst = _largest_outlier(current)
        if worst is None:
            return tuple(sorted(outliers))
        outliers.append(worst)
        current = fit(current.problem.without([worst]), current.terms)
    return ()


def misread_rows(problem: Problem) -> tuple[int, ...]:
    """Return the indices of readings of a native display's first session that contradict all its other readings.

    A fit predicts a colour from the first session's own reading, so that no residual shows these. Only a colour that
    the file reads once may be misread: a display may also depart from its own model, and does so in each reading. If
    there are more than ``MOST_ROWS`` such readings, the result is empty: the model of the display is wrong there.
    """
    misread = problem.discrepancy.misread
    times = [(problem.readings.drive == problem.readings.drive[row]).all(axis=1).sum() for row in misread]
    once = tuple(row for row, count in zip(misread, times, strict=True) if count == 1)
    return once if len(once) <= MOST_ROWS else ()


def _is_only_tip(problem: Problem) -> NDArray[np.bool_]:
    """Whether each reading, (n,), is the only one of a tip at its hour: without it the model has no tip there."""
    tips = is_tip(problem.drive)
    count = np.stack([np.bincount(problem.hour_of, tip)[problem.hour_of] for tip in tips.T], axis=1)
    return np.asarray((tips & (count == 1)).any(axis=1))


def _largest_outlier(current: Fit) -> int | None:
    """Return the index of the reading that stands out most, or None.

    An outlier stands out from the other readings of its patch, and from those of its colour family, or condition, in
    its session. Where these are too few, it stands out from its whole session.
    """
    problem = current.problem
    size, is_later = (current.residual**2).sum(axis=1), problem.hour_of > 0
    patch = patch_numbers(problem.readings)[problem.rows]
    of_patch, count = _largest_of_others(size, patch)
    of_cell, in_cell = _largest_of_others(size, np.char.add(problem.hour_of.astype(str), kind_of(problem)))
    of_session, _ = _largest_of_others(size, problem.hour_of)
    # A native display is made from its first session and fits it well: the small residuals of this session do not show
    # that a later reading is wrong.
    showing = np.bincount(patch, is_later)[patch] if problem.native else count
    too_few = (count < 3) | (is_later & (showing < 2))
    usual = np.maximum(np.where(too_few, of_session, of_patch), np.where(in_cell > 1, of_cell, of_session))
    ratio = size / np.maximum(usual, 3.0)
    is_noise = size < 1.5 * float(chdtri(3, UNLIKELY / max(size.size, 1)))
    # An effect that grows may show in few readings of the last session alone; it does not pass over a later session.
    may_grow = (problem.hour_of == _last_session(problem, patch)) & (size < size.max())
    ratio[is_noise | may_grow | _is_only_tip(problem)] = 0.0
    worst = int(np.argmax(ratio))
    return int(problem.rows[worst]) if ratio[worst] > ALONE**2 else None


def _last_session(problem: Problem, patch: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the last session that read the patch of each reading, (n,)."""
    last = np.zeros(int(patch.max()) + 1, dtype=np.intp)
    np.maximum.at(last, patch, problem.hour_of)
    return last[patch]


def _largest_of_others(size: Array, group: NDArray[Any]) -> tuple[Array, NDArray[np.intp]]:
    """Return for each reading the largest ``size`` of the others in its group (0: none), and the size of the group."""
    order = np.lexsort((-size, group))
    _, first, place, count = np.unique(group[order], return_index=True, return_inverse=True, return_counts=True)
    ordered = size[order]
    others = ordered[first][place]
    others[first] = np.where(count > 1, ordered[np.minimum(first + 1, size.size - 1)], 0.0)
    back = np.argsort(order)
    return others[back], count[place][back]


def wrong_sessions(current: Fit, scale: float) -> tuple[float, ...]:
    """Return the hours with nearly all of the misfit, if all other sessions are sound.

    At least one sound session must be later, because a display that has aged does not recover. ``scale`` is the
    variance of the noise in the units of the fit.
    """
    problem = current.problem
    if problem.from_first_hour or problem.hours.size < 4:
        return ()
    # Few sessions hold readings away from rest, such as other places on the screen: compare sessions at rest only.
    rest = problem.is_at_rest
    count = np.bincount(problem.hour_of[rest], minlength=problem.hours.size)
    if not count.all():
        return ()
    squares = (current.residual[rest] ** 2).sum(axis=1) / scale
    mean = np.bincount(problem.hour_of[rest], squares) / (3 * count)
    # A bad hour also raises the misfit of its neighbours; the second condition excludes the neighbours.
    usual = float(np.median(mean))
    bad = np.flatnonzero((mean > BAD * usual) & (mean > 0.05 * mean.max()))
    # If the display has changed, a native display's first session differs from all later sessions.
    bad = bad[bad > 0] if problem.native else bad
    sure = all(chdtrc(3 * count[hour], mean[hour] * 3 * count[hour]) < SURE for hour in bad)
    if not 1 <= bad.size <= 2 or not sure:
        return ()
    # Any model fits white and primaries: a session of these alone does not count as sound.
    shows = np.unique(problem.hour_of[rest & ~problem.is_tip_anchor])
    others = np.setdiff1d(shows, bad)
    # A native display is made from its first session: the small misfit of this session says nothing about later ones.
    judged = others[others > 0] if problem.native else others
    if not (others > bad[0]).any() or (mean[judged] > SOUND * usual).any():
        return ()
    if problem.native and _agrees_with_first(current, bad.tolist(), scale):
        return ()
    return tuple(float(problem.hours[hour]) for hour in bad)


def _agrees_with_first(current: Fit, bad: list[int], scale: float) -> bool:
    """Whether the sessions ``bad`` follow a native display's first session and agree with it.

    Then the display changed after them. Because most sessions come after the change, the fit takes the difference for
    an error of the first session, and the few sessions before the change stand out.
    """
    problem = current.problem
    if bad != list(range(1, len(bad) + 1)):
        return False
    before = fit(problem.without(problem.rows[problem.hour_of > bad[-1]].tolist()), current.terms)
    return before.chi2 < SOUND * scale * before.freedom


def suspicious_noise(problem: Problem) -> str:
    """Say what is wrong with the scatter of replicates, or of a first session; "" if nothing is wrong."""
    noise = problem.noise
    if noise.source == "instrument" and noise.contrasts >= ENOUGH:
        ratio = noise.scatter / (3 * noise.contrasts)
        if fdtrc(3 * noise.contrasts, 1e6, ratio) < 1e-6 and ratio > 2.0:
            return f"replicates scatter {np.sqrt(ratio):.1f} times as much as the stated noise of the instrument allows"
    of_model = max(problem.discrepancy.share, problem.discrepancy.of_luminance)
    if of_model > WORST_MODEL:
        return (
            f"readings of the first session contradict each other by {percent(of_model)} of their light, more than "
            f"those of a steady display. White, a primary or black may be misread, or the brightness changed"
        )
    if noise.source == "replicates" and noise.copied > MOST_COPIES:
        return (
            f"replicates of {in_percent(noise.copied)} of the patches agree to the last digit, so they are copies of "
            f"one reading and do not show the noise; enter every single reading, or state the noise with --instrument"
        )
    if noise.source == "replicates" and noise.relative > WORST_INSTRUMENT:
        scatter = in_percent(noise.relative, 1)
        return f"replicates scatter by {scatter} of the light, more than those of any sound colorimeter"
    return ""
