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
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize_scalar

from lutgen.criticism.fit import fit
from lutgen.criticism.linear import State
from lutgen.criticism.system import local_columns, prior_rows
from lutgen.criticism.tails import tails_of, weights_of
from lutgen.readings.rest import is_tip
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.linear import Linear, Term
    from lutgen.criticism.problem import Problem

#: Spread of the dark offset, cd/m², and of the gain within a session, of an ordinary colorimeter: assumptions.
OFFSET_CD_M2, WANDER = 0.001, 0.0003

#: Standard deviation of the prior on both, in powers of e.
PRIOR_SD = 1.0

#: Where the search for a spread ends, in powers of e from the ordinary one.
REACH = 7.0

#: Sessions that tell a spread; with fewer the ordinary one is taken.
ENOUGH = 3

#: Sessions from which on a polynomial of so many terms follows whatever a display does over the hours.
MANY, TERMS = 8, 5


def with_shared_errors(problem: Problem, terms: Sequence[Term] = ()) -> Problem:
    """Return a problem with its weights and the spreads of offset and wander that sessions show beside ``terms``."""
    plain = replace(problem, offset_cd_m2=0.0, wander=0.0)
    if tails := tails_of(plain):
        # An instrument with heavy tails slips now and then: its slips are weighed down like the rest, not left out.
        problem, plain = problem.with_slips(), plain.with_slips()
        residual = fit(plain, [replace(term, free=()) for term in terms]).linear.residual
        weights = np.ones(problem.readings.hours.size)
        weights[problem.rows] = weights_of(plain, residual, tails)
        problem, plain = replace(problem, weights=weights), replace(plain, weights=weights)
    found = fit(plain, [replace(term, free=()) for term in terms])
    state = State(found.terms, found.tips, found.gains)
    linear = found.linear
    capped, rest = is_capped(problem.readings)[problem.rows], problem.readings.at_rest()[problem.rows]
    drive = problem.readings.drive[problem.rows]
    # Only what no effect on curves, mixing or primaries reaches: black, the capped lens, and repeated colour points.
    dark = capped | (rest & (drive == 0).all(axis=1))
    offsets = _told(plain, state, linear, dark, replace(plain, offset_cd_m2=1.0))
    offset = OFFSET_CD_M2
    if len(offsets) >= MANY:
        offset = _spread(offsets, OFFSET_CD_M2, TERMS)
    elif len(offsets) >= ENOUGH:
        offset = _spread(_beside_the_display(offsets), OFFSET_CD_M2, 1)
    wander = 0.0
    if problem.readings.order is not None:
        wanders = _told(plain, state, linear, rest & is_tip(drive).any(axis=1), replace(plain, wander=1.0))
        wander = _spread(wanders, WANDER, 1) if len(wanders) > ENOUGH else WANDER
    return replace(problem, offset_cd_m2=offset, wander=wander)


def _told(
    plain: Problem, state: State, linear: Linear, rows: NDArray[np.bool_], unit: Problem
) -> list[tuple[float, Array, Array]]:
    """What each block tells of its shared errors of one kind: hour, estimates (k,) and their covariance (k, k)."""
    told = []
    for whole in plain.blocks:
        here = whole[rows[whole]]
        if not here.size:
            continue
        hour = int(plain.hour_of[whole[0]])
        columns, gains = local_columns(plain, linear, whole, here)
        prior, off = prior_rows(plain, state, hour, gains, 0)
        shared = unit.shared[int(whole[0])][:, np.searchsorted(whole, here)]
        count = len(shared)
        local = np.concatenate([columns.reshape(len(columns), -1).T, prior])
        asked = np.concatenate([shared.reshape(count, -1).T, np.zeros((len(off), count))])
        right = np.concatenate([linear.residual[here].ravel(), off])
        q = np.linalg.qr(local)[0] if local.shape[1] else np.zeros((len(right), 0))
        asked, right = asked - q @ (q.T @ asked), right - q @ (q.T @ right)
        information = asked.T @ asked
        if np.linalg.cond(information) < 1e12:
            covariance = np.linalg.inv(information)
            told.append((float(plain.hours[hour]), covariance @ (asked.T @ right), covariance))
    return told


def _beside_the_display(told: list[tuple[float, Array, Array]]) -> list[tuple[float, Array, Array]]:
    """Estimates without the one colour in which they differ most.

    A leak has one colour, and may take any course; a few sessions tell it from an offset by its colour alone.
    """
    estimates = np.array([estimate for _, estimate, _ in told])
    others = np.linalg.svd(estimates - estimates.mean(axis=0))[2][1:]
    return [(hour, others @ estimate, others @ covariance @ others.T) for hour, estimate, covariance in told]


def _spread(told: list[tuple[float, Array, Array]], ordinary: float, trend: int) -> float:
    """Spread of largest posterior, restricted likelihood and prior, of what sessions tell beside a trend in time."""
    hours = np.array([hour for hour, _, _ in told])
    tau = hours / max(float(hours.max()), 1.0)
    count = min(len(estimate) for _, estimate, _ in told)

    def loss(power: float) -> float:
        variance = (ordinary * np.exp(power)) ** 2
        total, information, right = 0.0, np.zeros((trend * count,) * 2), np.zeros(trend * count)
        for share, (_, estimate, covariance) in zip(tau, told, strict=True):
            sigma = covariance[:count, :count] + variance * np.eye(count)
            inverse = np.linalg.inv(sigma)
            design = np.kron(np.polynomial.chebyshev.chebvander([2.0 * share - 1.0], trend - 1), np.eye(count))
            total += float(np.linalg.slogdet(sigma)[1] + estimate[:count] @ inverse @ estimate[:count])
            information += design.T @ inverse @ design
            right += design.T @ inverse @ estimate[:count]
        total += float(np.linalg.slogdet(information)[1] - right @ np.linalg.solve(information, right))
        return total + (power / PRIOR_SD) ** 2

    found = minimize_scalar(loss, bounds=(-REACH, REACH), method="bounded", options={"xatol": 0.02})
    return float(ordinary * np.exp(found.x))
