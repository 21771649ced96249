"""Pure error: the scatter of replicates in units of the fit, and the F tests that use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

# scipy.stats calls these functions; importing them directly saves 0.2 s.
from scipy.special import chdtrc, chdtri, fdtrc, fdtri

from lutgen.criticism.first_session.model import ALLOWANCE
from lutgen.criticism.noise.replicates import ENOUGH, Replicates

if TYPE_CHECKING:
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem


@dataclass(frozen=True)
class PureError:
    """Scatter of replicates about their means in units of the fit's noise: the reference of all tests.

    ``squares``, ``freedom``: sum of squares and degrees of freedom. ``allowance``: an effect is admitted only if it
    passes the tests under a variance of this factor times the assumed variance; above 1 if the noise is not measured,
    or if a model discrepancy dominates the noise. Without enough replicates, the tests also accept residuals with this
    variance. ``inside``: the part of a fit's χ² that is scatter of replicates; None: ``squares``. ``correlated``:
    number of correlated readings that count as one independent reading, by the discrepancy of neighbouring colours.
    """

    squares: float
    freedom: int
    allowance: float = 1.0
    inside: float | None = None
    correlated: float = 1.0

    @classmethod
    def of(cls, problem: Problem) -> PureError:
        """Compute the scatter of the readings of a problem; if these have too few replicates, use the stated noise."""
        if problem.discrepancy and not problem.first_readings:  # curves or an own model predict each colour
            return cls(0.0, 0, ALLOWANCE * problem.correlated, correlated=problem.correlated)
        if problem.noise.source == "assumed":
            return cls(0.0, 0, ALLOWANCE)
        counted = problem.counts > 0
        replicates = Replicates.of(
            problem.readings, problem.rows[counted], across_sessions=problem.noise.across_sessions
        )
        white = np.einsum("nij,nj->ni", problem.whitener[counted], replicates.deviations)
        freedom = int(3 * replicates.contrasts)
        # Replicates that are rounded to the same value have too little scatter. The noise model includes the rounding,
        # so the variance of the noise model is the lower bound.
        inside = float((white**2).sum())
        # Replicates do not show whether the error of curves at a colour ages as the channels do, as the model assumes.
        allowance = ALLOWANCE if problem.first_readings else 1.0
        return cls(max(inside, float(freedom)), freedom, allowance, inside=inside)

    @property
    def measured(self) -> bool:
        """Whether there are enough replicates for an F test."""
        return self.freedom >= 3 * ENOUGH

    @property
    def variance(self) -> float:
        """Variance of replicates in units of the noise model's variance; 1 if there are too few replicates."""
        return self.squares / self.freedom if self.measured else 1.0

    @property
    def scale(self) -> float:
        """Variance of replicates, at least 1; ``allowance`` if there are too few replicates."""
        return max(self.variance, 1.0) if self.measured else self.allowance

    def certain_gain(self, gain: float) -> float:
        """Gain in χ² if the noise is estimated from replicates: twice the log-likelihood ratio under Student's t.

        With few replicates a gain above 2 becomes smaller. With many replicates the result is the gain in units of
        their variance.
        """
        gain /= self.scale
        return (self.freedom + 1.0) * float(np.log1p(gain / self.freedom)) if self.measured else gain

    def p_of_gain(self, gain: float, parameters: int) -> float:
        """Probability that an absent effect lowers χ² by this gain or more (F test)."""
        if gain <= 0:
            return 1.0
        if not self.measured:
            return float(chdtrc(parameters, gain / self.allowance))
        return float(fdtrc(parameters, self.freedom, gain / parameters / self.variance))

    def gain_beyond(self, chance: float) -> float:
        """Gain in χ² that an absent effect of one parameter exceeds with probability ``chance`` (F test)."""
        if not self.measured:
            return self.allowance * float(chdtri(1, chance))
        return self.variance * float(fdtri(1, self.freedom, 1.0 - chance))

    def p_of_lack_of_fit(self, fitted: Fit) -> float:
        """Probability that noise alone gives residuals at least as large (F test for lack of fit)."""
        if not self.measured:
            return float(chdtrc(max(fitted.freedom, 1) / self.correlated, fitted.chi2 / self.allowance))
        inside = self.squares if self.inside is None else self.inside
        squares, freedom = fitted.chi2 - inside, fitted.freedom - self.freedom
        if freedom < 1 or squares <= 0:
            return 1.0
        return float(fdtrc(freedom, self.freedom, squares / freedom / self.variance))
