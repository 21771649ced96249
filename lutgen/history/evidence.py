"""How well a change explains white, primaries and black of a session: fit, misfit and Bayesian evidence.

Parameters have Gaussian priors (widths in ``colour_points.PARAMETERS``); the evidence is Laplace's approximation about
the best fit (MacKay 2003, Information Theory, Inference, and Learning Algorithms, ch. 27), which pays for every number
that a cause needs, so that a matrix of nine does not beat a factor because it can bend.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.colour_points import PARAMETERS, changed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.colorimetry import Array
    from lutgen.history.colour_points import ColourPoints

#: What two sessions of an unchanged display differ by, 1 σ: all light alike (warmth, where the meter sat), each
#: channel's light, each number of a reading, as shares; and cd/m² of any reading. The Dell and the LG of the shared
#: data, and colour_points pairs read on one day, repeat so.
ALIKE, CHANNEL, READING, FLOOR_CD_M2 = 0.010, 0.006, 0.0025, 0.03

#: A display whose white is not the sum of its primaries by this much chooses its brightness by content: its light is
#: then uncertain by such a share of what is missing from the sum.
BY_CONTENT, UNCERTAIN = 0.04, 0.6

#: Black is a small number that instruments read badly: its share.
BLACK = 0.04

_STEPS = 12


@dataclass(frozen=True)
class ColourFit:
    """A change, fitted.

    Attributes
    ----------
    values
        Parameter → its numbers.
    chi2
        Misfit of the readings; there are fifteen numbers, or twelve without black.
    evidence
        Natural logarithm, up to a constant that all fits of a pair share.
    residual
        Read less explained, (5, 3).

    """

    values: dict[str, Array]
    chi2: float
    evidence: float
    residual: Array


def covariance(before: ColourPoints, after: Array, *, noise: float, loose: float = 0.0) -> Array:
    """Covariance of the fifteen numbers of ``after``, (5, 3), when the display did not change.

    ``noise`` is the sessions' own, as a share; ``loose`` the share by which a primary's colour may move besides.
    """
    size = np.abs(after)
    share = np.array([READING] * 4 + [BLACK])[:, np.newaxis]
    variance = (share**2 + noise**2) * size**2 + FLOOR_CD_M2**2
    variance[:4] += loose**2 * size[:4] ** 2
    if not before.has_black:
        variance[4] = 1e9
    made = np.diag(variance.ravel())
    wild = UNCERTAIN * _by_content(before, after)
    common = (np.hypot(ALIKE, wild) * after).ravel()
    made += np.outer(common, common)
    total, own = after[:3].sum(axis=0), np.hypot(CHANNEL, wild)
    for channel in range(3):
        alone = np.zeros((5, 3))
        alone[channel] = own * after[channel]
        alone[3] = own * after[3] * np.abs(after[channel]) / np.maximum(total, 1e-9)
        made += np.outer(alone.ravel(), alone.ravel())
    return np.asarray(made)


def _by_content(before: ColourPoints, after: Array) -> float:
    """Share that is missing from both sums of the primaries, or in excess; 0 unless both are off."""
    light = after[:4, 1] - after[4, 1]
    off = abs(float(light[3] / light[:3].sum()) - 1.0), abs(float(before.extra[1] / before.channels[:, 1].sum()))
    return max(off) if min(off) >= BY_CONTENT else 0.0


def fit(before: ColourPoints, after: Array, free: Sequence[str], *, noise: float, loose: float = 0.0) -> ColourFit:
    """ColourFit the parameters ``free`` by Gauss and Newton's steps, damped where one overshoots."""
    counts = [PARAMETERS[name][0] for name in free]
    width = np.repeat([PARAMETERS[name][1] for name in free], counts).astype(np.float64)
    spread = covariance(before, after, noise=noise, loose=loose)
    lower = np.linalg.cholesky(spread)

    def split(theta: Array) -> dict[str, Array]:
        return dict(zip(free, np.split(theta, np.cumsum(counts)[:-1]), strict=True)) if counts else {}

    def residual(theta: Array) -> Array:
        left = np.linalg.solve(lower, (after - changed(before, split(theta))).ravel())
        return np.concatenate([left, theta / width])

    theta = np.zeros(width.size)
    here = residual(theta)
    slope = np.zeros((here.size, width.size))
    for _ in range(_STEPS if width.size else 0):
        slope = _slope(residual, theta, here)
        step = np.linalg.lstsq(slope, -here, rcond=None)[0]
        shrink = 1.0
        while shrink > 1e-3 and (there := residual(theta + shrink * step)) @ there > here @ here:
            shrink *= 0.5
        if shrink <= 1e-3:
            break
        theta, here = theta + shrink * step, residual(theta + shrink * step)
        if float(np.abs(step).max()) < 1e-6:
            break
    chi2 = float(here[:15] @ here[:15])
    # Widths of the posterior over those of the prior, of each parameter: Occam's factor.
    curved = slope[:15] * width
    occam = float(np.linalg.slogdet(np.eye(width.size) + curved.T @ curved)[1])
    # The covariance's own size, against that without looseness: what lets more happen explains less.
    plain = np.linalg.slogdet(covariance(before, after, noise=noise))[1]
    evidence = -0.5 * (float(here @ here) + occam + float(np.linalg.slogdet(spread)[1] - plain))
    return ColourFit(split(theta), chi2, evidence, after - changed(before, split(theta)))


def _slope(residual: Callable[[Array], Array], theta: Array, here: Array) -> Array:
    columns = []
    for place in range(theta.size):
        nudged = theta.copy()
        nudged[place] += 1e-5
        columns.append((residual(nudged) - here) / 1e-5)
    return np.column_stack(columns)
