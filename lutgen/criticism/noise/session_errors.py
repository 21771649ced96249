"""Errors that all readings of a session share beside its gain: a dark offset, and a slow wander of the gain.

An instrument's zero differs from session to session, and its gain wanders while a session is read. Both are random
effects: unknowns of each session with a known spread. The spreads are estimated from the campaign, by restricted
maximum likelihood (Patterson & Thompson 1971, doi:10.1093/biomet/58.3.545) on what single sessions tell; a weak prior
keeps them near an ordinary colorimeter's, never at zero by assumption.

What changes smoothly over the hours is a display's, not an instrument's: of many sessions a polynomial in time is left
free while the spread of the offsets is estimated, of few the colour in which they differ most.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import compress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import gammaincinv

from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State
from lutgen.criticism.fit.system import local_columns, prior_rows, spanned
from lutgen.criticism.noise.session_columns import shared_columns
from lutgen.criticism.noise.tails import tails_of, weights_at, weights_of
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.linear import Linear, Term
    from lutgen.criticism.fit.problem import Problem

    #: Gains of three sessions that a line would join: place of a session → which of its gains, and its weight.
    Line = dict[int, tuple[int, float]]

#: No instrument's gain is taken to wander more than this; an assumption.
MOST = 0.02

#: Standard deviation of the prior on both, in powers of e.
PRIOR_SD = 1.0

#: How far from the ordinary spread another one is looked for, and in which steps: powers of e.
REACH, STEP = 7.0, 0.02

#: Share of a gain's change below which a departure tells nothing of it.
TINY = 1e-12

#: Sessions that tell a spread; with fewer the ordinary one is taken.
ENOUGH = 3

#: Sessions from which on a polynomial of so many terms follows whatever a display does over the hours.
MANY, TERMS = 8, 5

#: A meter's own dark signal may grow over its life, as a straight line.
DRIFTING = 2

#: Of an error of which less than this share remains beside tips and gains nothing is told.
LEAST_SEEN = 1e-2


class Told(NamedTuple):
    """What a block tells of errors that its readings share: names (k,), estimates (k,), their covariance (k, k)."""

    hour: float
    names: list[str]
    estimate: Array
    covariance: Array


def with_shared_errors(problem: Problem, terms: Sequence[Term] = ()) -> Problem:
    """Return a problem with its weights and the spreads of offset and wander that sessions show beside ``terms``."""
    problem = replace(problem, offset_cd_m2=0.0, wander=0.0, weights=None)
    plain, fixed = problem, [replace(term, free=()) for term in terms]
    if tails := tails_of(plain):
        # An instrument with heavy tails slips now and then: its slips are weighed down like the rest, not left out.
        problem, plain = problem.with_outliers(), plain.with_outliers()
        found = fit(plain, fixed)
        weights = np.ones(problem.readings.hours.size)
        weights[problem.rows] = weights_of(plain, found.residual, tails)
        if plain.first_readings and plain.first_errors:
            # A slip of the first session is in all later readings of its colour.
            off = plain.first_session_model.error_of_met(plain.first_errors.taken_from(found.linear.residual)[1])
            met = plain.first_readings.met
            weights[problem.rows[met]] = weights_at((off[met] ** 2).sum(axis=1) / tails.scale**2, tails)
        problem, plain = replace(problem, weights=weights), replace(plain, weights=weights)
    found = fit(plain, fixed)
    state = State(found.terms, found.tips, found.gains)
    linear = found.linear
    drive, capped = problem.readings.drive[problem.rows], is_capped(problem.readings)[problem.rows]
    # Only what no effect on curves, mixing or primaries reaches: black, and the capped lens.
    dark = capped | (problem.readings.at_rest()[problem.rows] & (drive == 0).all(axis=1))
    if problem.native:
        # The black of a native display goes with its white, which black alone would not hold in place.
        dark |= problem.is_tip_anchor
    covered = problem.native is not None and np.unique(problem.hour_of[capped]).size > ENOUGH
    if covered:
        # The capped lens alone sees no light of the display, whose black has the first session's offset in it.
        dark = capped
    # Here the first session has an offset like any other, from which those of later ones differ.
    offsets = _told(plain, state, linear, dark, replace(plain, offset_cd_m2=1.0, native=None))
    offset = usual = problem.noise.offset_cd_m2
    if covered:
        offset = _spread(offsets, usual, DRIFTING)
    elif len(offsets) >= MANY:
        offset = _spread(offsets, usual, TERMS)
    elif len(offsets) >= ENOUGH:
        offset = _spread(_beside_the_display(offsets), usual, 1)
    if problem.native and not covered:
        # Black alone holds the spread too small: what a leak might do is left out of it.
        offset *= float(np.sqrt(max(len(offsets), 1)))
    everything = np.ones(problem.rows.size, dtype=bool)
    gains = _told(plain, state, linear._replace(residual=found.residual), everything, replace(plain, wander=1.0))
    return replace(problem, offset_cd_m2=offset, wander=_wander(problem, gains))


def _wander(problem: Problem, told: list[Told]) -> float:
    # What is foretold from hour 0 departs from the readings as the display ages, which is no instrument's gain.
    return problem.noise.wander if problem.from_first_hour else _unsteady(told, problem.noise.wander)


def _unsteady(told: list[Told], least: float) -> float:
    """Spread of gains that makes the median departure from a steady course as large as it should be.

    The smaller one of two: that of the gains as they are, which a misfit of some kinds of readings does not move, and
    that along the axes of their covariance: the noise of white, which all gains of a session share, moves few of these.
    """
    sessions = [part for each in told for part in _by_session(each)]
    found = [each for place in range(len(sessions)) if (each := _departed(sessions, place))]
    if not found:
        return least
    plain = [np.array([off**2, np.diag(noise), gain]) for off, noise, gain in found]
    apart = []
    for off, noise, gain in found:
        variances, axes = np.linalg.eigh(noise)
        apart.append(np.array([(axes.T @ off) ** 2, np.maximum(variances, 0.0), (axes**2).T @ gain]))
    return min(_spread_of_median(np.concatenate(each, axis=1), least) for each in (plain, apart))


def _spread_of_median(departures: Array, least: float) -> float:
    """Spread with which the median of departures (3, k), their squares, noise and gain, is that of χ².

    A departure is beyond that of χ² exactly where its own spread is beyond the one that is sought.
    """
    squares, noise, gain = departures
    usual = 2.0 * float(gammaincinv(0.5, 0.5))
    spread = float(np.sqrt(max(np.median((squares / usual - noise) / np.maximum(gain, TINY)), 0.0)))
    return spread if least < spread < MOST else least


def _by_session(told: Told) -> list[Told]:
    """Part what an hour tells where a name comes again: there another session begins."""
    starts = [0]
    for place, name in enumerate(told.names):
        if name in told.names[starts[-1] : place]:
            starts.append(place)
    parts = [slice(start, end) for start, end in zip(starts, [*starts[1:], len(told.names)], strict=True)]
    return [Told(told.hour, told.names[part], told.estimate[part], told.covariance[part, part]) for part in parts]


def _departed(sessions: list[Told], place: int) -> tuple[Array, Array, Array] | None:
    """How far the gains of a session are from the lines between those of the sessions before and after.

    Departures (k,), their covariance by noise (k, k), and their variances by a spread of 1 (k,); None: of no gain.
    """
    here, lines = sessions[place], []
    for mine, name in enumerate(here.names):
        before = next((at for at in range(place - 1, -1, -1) if name in sessions[at].names), None)
        after = next((at for at in range(place + 1, len(sessions)) if name in sessions[at].names), None)
        if before is None or after is None:
            continue
        start, end = sessions[before].hour, sessions[after].hour
        share = (here.hour - start) / (end - start) if end > start else 0.5
        ends = {at: (sessions[at].names.index(name), size) for at, size in ((before, share - 1.0), (after, -share))}
        lines.append({place: (mine, 1.0), **ends})
    if not lines:
        return None

    def shared(left: Line, right: Line) -> float:
        return sum(
            size * right[at][1] * float(sessions[at].covariance[which, right[at][0]])
            for at, (which, size) in left.items()
            if at in right
        )

    off = np.array([sum(size * sessions[at].estimate[which] for at, (which, size) in each.items()) for each in lines])
    gain = np.array([sum(size**2 for _, size in each.values()) for each in lines])
    return off, np.array([[shared(left, right) for right in lines] for left in lines]), gain


def _told(plain: Problem, state: State, linear: Linear, rows: NDArray[np.bool_], unit: Problem) -> list[Told]:
    """What each block tells of its shared errors of one kind."""
    told = []
    for whole in plain.blocks:
        here = whole[rows[whole]]
        if not here.size:
            continue
        hour = int(plain.hour_of[whole[0]])
        columns, gains = local_columns(plain, linear.local, whole, here)
        prior, off = prior_rows(plain, state, hour, gains, 0)
        names, shared = shared_columns(unit, whole)
        shared = shared[:, np.searchsorted(whole, here)]
        count = len(shared)
        # Either may be of no column, whose length numpy cannot guess.
        local = np.concatenate([columns.reshape(len(columns), 3 * here.size).T, prior])
        asked = np.concatenate([shared.reshape(count, 3 * here.size).T, np.zeros((len(off), count))])
        right = np.concatenate([linear.residual[here].ravel(), off])
        q = spanned(local)
        left, right = asked - q @ (q.T @ asked), right - q @ (q.T @ right)
        # What tips and gains of the block take up altogether, nobody can tell: the gain of the tips themselves.
        seen = np.linalg.norm(left, axis=0) > LEAST_SEEN * np.linalg.norm(asked, axis=0)
        if seen.any():
            covariance = np.linalg.pinv(left[:, seen].T @ left[:, seen], hermitian=True)
            estimate = covariance @ (left[:, seen].T @ right)
            scale = _misfit(asked[:, seen] != 0, right - left[:, seen] @ estimate)
            covariance = covariance * np.outer(scale, scale)
            told.append(Told(float(plain.hours[hour]), list(compress(names, seen)), estimate, covariance))
    return told


def _misfit(moved: NDArray[np.bool_], left: Array) -> Array:
    """Root mean square of what is left of the numbers that each error moves, (k,); 1 at least.

    A gain moves its readings alike. Where they differ among themselves by more than noise, a display's fault does it,
    and what their mean does tells the less of a gain.
    """
    squares = moved.T.astype(float) @ left**2 / np.maximum(moved.sum(axis=0), 1)
    return np.asarray(np.sqrt(np.maximum(squares, 1.0)))


def _beside_the_display(told: list[Told]) -> list[Told]:
    """Estimates without the one colour in which they differ most.

    A leak has one colour, and may take any course; a few sessions tell it from an offset by its colour alone. Sessions
    in which not all of X, Y and Z are seen have no colour.
    """
    most = max(len(each.estimate) for each in told)
    told = [each for each in told if len(each.estimate) == most]
    estimates = np.array([each.estimate for each in told])
    others = np.linalg.svd(estimates - estimates.mean(axis=0))[2][1:]
    return [
        each._replace(estimate=others @ each.estimate, covariance=others @ each.covariance @ others.T) for each in told
    ]


def _spread(told: list[Told], ordinary: float, trend: int) -> float:
    """Spread of largest posterior, restricted likelihood and prior, of what sessions tell beside a trend in time."""
    hours = np.array([each.hour for each in told])
    tau = hours / max(float(hours.max()), 1.0)
    count = min(len(each.estimate) for each in told)

    powers = np.arange(-REACH, REACH, STEP)
    variance = (ordinary * np.exp(powers)) ** 2
    loss = (powers / PRIOR_SD) ** 2
    information, right = np.zeros((powers.size, *(trend * count,) * 2)), np.zeros((powers.size, trend * count))
    for share, (_, _, estimate, covariance) in zip(tau, told, strict=True):
        sigma = covariance[:count, :count] + variance[:, np.newaxis, np.newaxis] * np.eye(count)
        inverse = np.linalg.inv(sigma)
        design = np.kron(np.polynomial.chebyshev.chebvander([2.0 * share - 1.0], trend - 1), np.eye(count))
        weighted = inverse @ estimate[:count]
        loss += np.linalg.slogdet(sigma)[1] + weighted @ estimate[:count]
        information += design.T @ inverse @ design
        right += weighted @ design
    solved = np.linalg.solve(information, right[..., np.newaxis])[..., 0]
    loss += np.linalg.slogdet(information)[1] - (right * solved).sum(axis=1)
    return float(ordinary * np.exp(powers[np.argmin(loss)]))
