"""Standard deviation of a meter's dark offset between sessions, if the display may also leak light.

Readings of the capped lens show the offset alone. Black shows the sum of offset and leak. A leak has one colour, near
that of white: a difference between sessions in other colours is the offset. In the colour of the leak, two models are
compared: the offsets of sessions are independent, but a leak grows along a smooth course in time. The evidence of a
model is the likelihood of the sessions' estimates, averaged over its unknowns: the standard deviation of the offsets,
the size of the leak, and its course.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import log_ndtr, logsumexp

from lutgen.effects.shapes import growth

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.noise.session_columns import SessionEstimate

#: Smallest number of sessions from which the standard deviation is estimated. With fewer sessions the standard
#: deviation of an ordinary meter is used. The second number is for readings of the capped lens.
ENOUGH, ENOUGH_CAPPED = 3, 2

#: A meter's own dark signal may grow over its life: number of terms of its trend, and of sessions that show the trend.
DRIFTING, ENOUGH_DRIFTING = 2, 6

#: Largest distance of the logarithm of the standard deviation from that of an ordinary meter; step of the logarithm for
#: the restricted likelihood, and for the two evidences.
REACH, STEP, EVIDENCE_STEP = 7.0, 0.02, 0.1

#: Range and step of the logarithm of a leak's largest size over the ordinary standard deviation: up to 20 cd/m².
SIZE_REACH, SIZE_STEP = 10.0, 0.5

#: Degrees of freedom of the prior of the logarithm (Student's t). A small number gives heavy tails: the prior does not
#: shrink large offsets much.
FREEDOM = 3.0

#: Logarithm of the ratio of the evidences, 100, above which the blacks show a leak.
ODDS = float(np.log(100.0))

#: Courses of a leak, as in the catalogue: powers of time, and saturations in nepers.
POWERS = (0.3, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)
SATURATIONS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0, 12.0, 20.0)


def offset_sd(estimates: Sequence[SessionEstimate], problem: Problem, *, capped: bool) -> float:
    """Return the standard deviation of the dark offset in cd/m².

    Parameters
    ----------
    estimates
        Offsets of the sessions, in units of the meter's independent offsets.
    problem
        The problem, with the ordinary standard deviation: the mode of the prior.
    capped
        Whether the estimates come from readings of the capped lens.

    """
    ordinary = problem.noise.offset_cd_m2
    if len(estimates) < (ENOUGH_CAPPED if capped else ENOUGH):
        # Under a native baseline black is compared with the black of the first session, which has an offset too.
        return ordinary * float(np.sqrt(max(len(estimates), 1))) if problem.native else ordinary
    if capped:
        return _reml_sd(estimates, ordinary, DRIFTING if len(estimates) >= ENOUGH_DRIFTING else 1)
    # Sessions without an estimate of all of X, Y and Z are left out.
    most = max(len(each.estimate) for each in estimates)
    complete = [each for each in estimates if len(each.estimate) == most]
    if most % 3 == 0:  # without an estimate of X, Y or Z in any session there is no colour to scale
        complete = [_relative_to_white(each, problem) for each in complete]
    # The combination of X, Y and Z that shows a leak with the colour of white best.
    noise = np.mean([each.covariance for each in complete], axis=0) + ordinary**2 * np.eye(most)
    best = np.linalg.solve(noise, _colour_of_white(complete[0].names, problem))
    along = [_in_colours(each, best[np.newaxis] / np.linalg.norm(best)) for each in complete]
    # A leak may be tinted: its colour is the direction in which the estimates change together with this combination.
    # Other colours show offsets alone.
    values, light = (np.array([each.estimate for each in some]) for some in (complete, along))
    tinted = (light - light.mean()).T @ (values - values.mean(axis=0))
    others = [_in_colours(each, np.linalg.svd(tinted)[2][1:]) for each in complete]
    return max(_sd_beside_leak(along, ordinary), _reml_sd(others, ordinary, 1))


def _colour_of_white(names: Sequence[str], problem: Problem) -> Array:
    """Return the colour of white in units of the meter's independent offsets, for each estimate: (k,)."""
    white = np.linalg.solve(problem.noise.dark_offset, problem.measured_tips[0, 0])
    return np.array([white["XYZ".index(name)] for name in names])


def _in_colours(each: SessionEstimate, colours: Array) -> SessionEstimate:
    """Components of an estimate along colours (c, k)."""
    return each._replace(estimate=colours @ each.estimate, covariance=colours @ each.covariance @ colours.T)


def _relative_to_white(each: SessionEstimate, problem: Problem) -> SessionEstimate:
    """Scale an estimate by the change of white since the first session: a leak follows white as white ages."""
    white = problem.measured_tips[:, 0]
    aged = white[np.searchsorted(problem.hours, each.hour)] / white[0]
    # Estimates are in units of the meter's independent offsets, white is in X, Y and Z.
    turn = problem.noise.dark_offset
    scale = np.linalg.inv(turn) @ np.diag(1.0 / aged) @ turn
    return _in_colours(each, np.asarray(np.kron(np.eye(len(each.estimate) // 3), scale), dtype=np.float64))


def _log_prior(logs: Array) -> Array:
    """Logarithm of the prior at logarithms of a standard deviation over the ordinary one, in any shape."""
    return np.asarray(-0.5 * (FREEDOM + 1.0) * np.log1p(logs**2 / FREEDOM))


def _reml_sd(estimates: Sequence[SessionEstimate], ordinary: float, trend: int) -> float:
    """Standard deviation of estimates (REML with a prior) about a polynomial trend in time of ``trend`` terms.

    ``ordinary``: the mode of the prior.
    """
    hours = np.array([each.hour for each in estimates])
    tau = hours / max(float(hours.max()), 1.0)
    count = min(len(each.estimate) for each in estimates)
    logs = np.arange(-REACH, REACH, STEP)
    variance = (ordinary * np.exp(logs)) ** 2
    loss = -2.0 * _log_prior(logs)
    information, right = np.zeros((logs.size, *(trend * count,) * 2)), np.zeros((logs.size, trend * count))
    for share, (_, _, estimate, covariance) in zip(tau, estimates, strict=True):
        sigma = covariance[:count, :count] + variance[:, np.newaxis, np.newaxis] * np.eye(count)
        inverse = np.linalg.inv(sigma)
        design = np.kron(np.polynomial.chebyshev.chebvander([2.0 * share - 1.0], trend - 1), np.eye(count))
        weighted = inverse @ estimate[:count]
        loss += np.linalg.slogdet(sigma)[1] + weighted @ estimate[:count]
        information += design.T @ inverse @ design
        right += weighted @ design
    solved = np.linalg.solve(information, right[..., np.newaxis])[..., 0]
    loss += np.linalg.slogdet(information)[1] - (right * solved).sum(axis=1)
    return float(ordinary * np.exp(logs[np.argmin(loss)]))


def _sd_beside_leak(estimates: Sequence[SessionEstimate], ordinary: float) -> float:
    """Standard deviation of estimates (of one component) by the likelier model: with a leak, or without one."""
    hours = np.array([each.hour for each in estimates])
    light = np.array([each.estimate[0] for each in estimates])
    noise = np.array([each.covariance[0, 0] for each in estimates])
    steps = round(REACH / EVIDENCE_STEP)
    logs = np.asarray(EVIDENCE_STEP * np.arange(-steps, steps + 1), dtype=np.float64)
    sds = ordinary * np.exp(logs)
    weights = 1.0 / (noise + sds[:, np.newaxis] ** 2)
    total = weights.sum(axis=1)

    def product(left: Array, right: Array) -> Array:
        """Weighted product of two courses (n,), each about its mean, for each standard deviation."""
        return np.asarray((weights * left * right).sum(axis=1) - (weights @ left) * (weights @ right) / total)

    without = _log_prior(logs) + 0.5 * (np.log(weights).sum(axis=1) - np.log(total) - product(light, light))
    tau = (hours - hours.min()) / max(float(np.ptp(hours)), 1.0)
    largest = ordinary * np.exp(np.arange(0.0, SIZE_REACH, SIZE_STEP))[:, np.newaxis]
    gains = []
    for power in POWERS:
        for saturation in SATURATIONS:
            course = growth(tau, new=0.0, grown=1.0, power=power, saturation=saturation)
            precision = product(course, course) + largest**-2
            size = product(course, light) / precision
            # A leak grows: half a normal distribution is the prior of its size.
            beyond_zero = np.log(2.0) + log_ndtr(size * np.sqrt(precision))
            gains.append(0.5 * (precision * size**2 - np.log(precision * largest**2)) + beyond_zero)
    every = np.concatenate(gains)
    leaking = without + logsumexp(every, axis=0) - np.log(len(every))
    is_leak = logsumexp(leaking) - logsumexp(without) > ODDS
    return float(sds[np.argmax(leaking if is_leak else without)])
