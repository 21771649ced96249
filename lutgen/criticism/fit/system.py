"""Least squares with the local unknowns eliminated: QR reduces every block to equations for the global unknowns.

Golub & Pereyra, SIAM J. Numer. Anal. 10, 413-432 (1973), doi:10.1137/0710036.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy  # its parts load when they are first used: the first comparison needs few of them

from lutgen.criticism.fit.data import readings_at
from lutgen.criticism.fit.linear import State, tip_scale
from lutgen.criticism.fit.local_unknowns import own_columns, prior_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.first_session.errors import FirstErrors
    from lutgen.criticism.fit.linear import Linear, Term
    from lutgen.criticism.fit.problem import Problem


#: Relative cutoff of singular values, the accuracy of a numerical derivative: collinear parameters do not move.
COLLINEAR = 1e-6

#: A triangle is solved by least squares if the ratio of its smallest to its largest diagonal element is smaller.
SINGULAR = 1e-9

#: A parameter's share of the variance in a direction counts as 0 below this.
NEGLIGIBLE_SHARE = 1e-3


class Move(NamedTuple):
    """A step of the global unknowns and the χ² that it predicts."""

    parameters: Array
    chi2: float


class System:
    """The linearised problem with local unknowns eliminated: χ² = ‖z − A δ‖², for a step δ of the global unknowns."""

    def __init__(self, problem: Problem, linear: Linear, state: State, first_errors: FirstErrors | None) -> None:
        """Reduce every block of readings."""
        self.problem, self.linear, self.first_errors = problem, linear, first_errors
        self.global_count = len(linear.free)
        self.effect_count = sum(len(term.free) for term in state.terms)
        corrected, prior_of_errors = without_first_errors(linear, first_errors)
        self.blocks = [Block.of(problem, corrected, state, here) for here in problem.blocks]
        reduced = np.concatenate([*(block.reduced for block in self.blocks), prior_of_errors])
        self.A, self.z = reduced[:, :-1], reduced[:, -1]
        others = self.global_count - (len(problem.curve_modes) if problem.native else 0)
        modes = self.A[:, others:]
        sizes = np.linalg.lstsq(modes, self.z, rcond=1e-9)[0]
        #: The step that changes no effect and sets the curve modes to their best sizes: a state holds no sizes of
        #: modes.
        self.mode_step = np.concatenate([np.zeros(others), sizes])
        residual = self.z - modes @ sizes
        self.chi2 = float(residual @ residual)

    def step(self, terms: Sequence[Term], damping: float = 0.0) -> Move:
        """Best step of the global unknowns within the parameters' bounds."""
        return bounded(self.A, self.z, *limits(terms, self.global_count), damping)

    def moved(self, state: State, parameters: Array) -> State:
        """Return a state after a step of the global unknowns and the local step that it implies."""
        terms, place = [], 0
        for term in state.terms:
            values = np.array([term.values[name] for name in term.free])
            new = np.clip(values + parameters[place : place + values.size], *term.bounds.T)
            terms.append(term.moved(new.tolist()))
            place += values.size
        tips, gains = state.tips.copy(), state.gains.copy()
        scale = tip_scale(self.problem)
        if self.problem.from_first_hour:
            tips = tips + parameters[place : place + 12].reshape(4, 3) * scale
        for block in self.blocks:
            local = block.local_step(parameters)
            if block.tips_of is not None:
                tips[block.tips_of] += local[:12].reshape(4, 3) * scale
                local = local[12:]
            gains[list(block.gains)] += local[: len(block.gains)]
        return State(tuple(terms), tips, gains)

    def covariance(self, terms: Sequence[Term]) -> Array:
        """Covariance of the effects' parameters, (p, p); infinite if the data have no information."""
        if not self.effect_count:
            return np.zeros((0, 0))
        spread, undetermined = self.spread(terms)
        covariance = (spread @ spread.T)[: self.effect_count, : self.effect_count]
        covariance[undetermined, :] = covariance[:, undetermined] = 0.0
        covariance[undetermined, undetermined] = np.inf
        return np.asarray(covariance)

    def spread(self, terms: Sequence[Term]) -> tuple[Array, NDArray[np.bool_]]:
        """Return V (g, k), where V·Vᵀ is the covariance of the global unknowns, and which parameters are undetermined.

        The data have no information on a direction in which parameters may cross their whole range while the readings
        together change by less than one standard deviation. The rank shows no such direction, because derivatives are
        numerical.
        """
        count = self.effect_count
        if not self.global_count:
            return np.zeros((0, 0)), np.zeros(0, dtype=bool)
        size = np.linalg.norm(self.A, axis=0)
        scale = np.where(size > 0, 1.0 / np.where(size > 0, size, 1.0), 1.0)
        if count:
            bounds = np.concatenate([term.bounds for term in terms if term.free])
            scale[:count] = bounds[:, 1] - bounds[:, 0]
        _, s, vt = np.linalg.svd(self.A * scale, full_matrices=False)
        has_parameter = np.abs(vt[:, :count]).max(axis=1, initial=0.0) > NEGLIGIBLE_SHARE
        determined = s > np.where(has_parameter, 1.0, COLLINEAR * max(float(s.max(initial=0.0)), 1e-300))
        undetermined = 1.0 - (vt[determined] ** 2).sum(axis=0)[:count] > NEGLIGIBLE_SHARE
        return vt[determined].T / s[determined] * scale[:, np.newaxis], np.asarray(undetermined)


def limits(terms: Sequence[Term], count: int) -> tuple[Array, Array]:
    """Largest allowed steps of each of ``count`` global unknowns down and up, (p,) each: effects come first."""
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    free = [term for term in terms if term.free]
    if free:
        bounds = np.concatenate([term.bounds for term in free])
        values = np.array([term.values[name] for term in free for name in term.free])
        low[: values.size], high[: values.size] = (bounds - values[:, np.newaxis]).T
    return low, high


@dataclass(frozen=True)
class Block:
    """Readings that share local unknowns, reduced by QR: of one hour, or of one session under ``from_first_hour``.

    The shared errors of sessions are no unknowns here, but part of the covariance of the readings. The rows ``upper``
    (L, L + p + 1) determine the local unknowns; the rows ``reduced`` (≤ p + 1, p + 1) are free of local unknowns.
    """

    upper: Array
    reduced: Array
    tips_of: int | None
    gains: tuple[int, ...]

    @classmethod
    def of(cls, problem: Problem, linear: Linear, state: State, whole: NDArray[np.intp]) -> Block:
        """Reduce all readings of a block."""
        columns, gains = own_columns(problem, linear.local, whole, whole)
        at = readings_at(whole)
        parts = np.concatenate([columns, linear.free[:, at], linear.residual[np.newaxis, at]])
        by_readings = problem.marginal[int(whole[0])].whitened(parts.reshape(len(parts), -1))
        hour = int(problem.hour_of[whole[0]])
        prior, off = prior_rows(problem, state, hour, gains, 0)
        local = prior.shape[1]
        by_priors = np.zeros((len(parts), off.size))
        by_priors[:local], by_priors[-1] = prior.T, off
        upper = np.asarray(np.linalg.qr(np.concatenate([by_readings, by_priors], axis=1).T, mode="r"))
        return cls(upper[:local], upper[local:, local:], None if problem.from_first_hour else hour, gains)

    def local_step(self, parameters: Array) -> Array:
        """Best step of the local unknowns, given a step of the global ones."""
        local = self.upper.shape[0]
        if not local:
            return np.zeros(0)
        right = self.upper[:, -1] - self.upper[:, local:-1] @ parameters
        triangle = self.upper[:, :local]
        diagonal = np.abs(np.diag(triangle))
        if diagonal.size == local and diagonal.min() > SINGULAR * diagonal.max():
            return np.asarray(np.linalg.solve(triangle, right))
        return np.asarray(np.linalg.lstsq(triangle, right, rcond=1e-12)[0])


def without_first_errors(linear: Linear, first_errors: FirstErrors | None) -> tuple[Linear, Array]:
    """Subtract the most likely errors of the first session; also return their prior as equations, (e, p + 1)."""
    if not first_errors:
        return linear, np.zeros((0, len(linear.free) + 1))
    both, sizes = first_errors.subtracted_from(np.concatenate([linear.free, linear.residual[np.newaxis]]))
    return linear._replace(free=both[:-1], residual=both[-1]), -sizes.T


def bounded(A: Array, z: Array, low: Array, high: Array, damping: float = 0.0) -> Move:
    """Minimise ‖z − A δ‖² for low ≤ δ ≤ high.

    ``damping`` adds ``damping`` · ‖D δ‖² with D the norms of A's columns (Marquardt, J. SIAM 11, 431-441 (1963),
    doi:10.1137/0111030); the returned χ² does not include this term.
    """
    count = A.shape[1]
    size = np.linalg.norm(A, axis=0)
    size = np.where(size > 0, size, 1.0)
    unit, right = A / size, z
    if damping:
        unit = np.concatenate([unit, np.sqrt(damping) * np.eye(count)])
        right = np.concatenate([z, np.zeros(count)])
    delta = np.linalg.lstsq(unit, right, rcond=COLLINEAR)[0] / size
    if ((delta < low) | (delta > high)).any():
        # Collinear parameters have no unique minimum; the smallest damping makes it unique.
        unit = np.concatenate([unit, COLLINEAR * np.eye(count)])
        right = np.concatenate([right, np.zeros(count)])
        fixed = high <= low
        delta = np.where(fixed, low, 0.0)
        if not fixed.all():
            scaled = low[~fixed] * size[~fixed], high[~fixed] * size[~fixed]
            delta[~fixed] = _within(unit[:, ~fixed], right - unit @ (size * delta), scaled) / size[~fixed]
    residual = z - A @ delta
    return Move(delta, float(residual @ residual))


def _within(A: Array, z: Array, limits: tuple[Array, Array]) -> Array:
    """Minimise ‖z − A x‖² within limits.

    First set the unknowns that the free minimum puts beyond a limit to that limit. If the gradients do not prove this
    to be the minimum, search all active sets.
    """
    free = np.linalg.lstsq(A, z, rcond=None)[0]
    x = np.asarray(np.clip(free, *limits))
    at_limit = x != free
    if not at_limit.all():
        x[~at_limit] = np.linalg.lstsq(A[:, ~at_limit], z - A[:, at_limit] @ x[at_limit], rcond=None)[0]
    uphill = (A[:, at_limit].T @ (A @ x - z)) * np.where(x[at_limit] == limits[0][at_limit], 1.0, -1.0)
    if (np.clip(x, *limits) == x).all() and (uphill >= 0).all():
        return x
    return np.asarray(scipy.optimize.lsq_linear(A, z, limits, method="bvls").x)
