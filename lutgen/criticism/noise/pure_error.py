"""The yardstick of all tests: how far replicates scatter, in the units of the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc, fdtri  # what scipy.stats computes with, without its 0.2 s of import

from lutgen.criticism.first_session.model import ALLOWANCE, COLOURS
from lutgen.criticism.noise.replicates import Replicates

if TYPE_CHECKING:
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.problem import Problem


@dataclass(frozen=True)
class PureError:
    """Scatter of replicates about their means in the fit's own units: the yardstick of all tests.

    ``allowance``: factor of the variance up to which nothing is found, where nobody measured the noise, or a model's
    discrepancy outweighs it. ``inside``: the part of a fit's χ² that replicates make, where it is not ``squares``.
    ``alike``: how many readings err as one, which a model's discrepancy makes of neighbouring colours.
    """

    squares: float
    freedom: int
    allowance: float = 1.0
    inside: float | None = None
    alike: float = 1.0

    @classmethod
    def of(cls, problem: Problem) -> PureError:
        """Take the scatter from the readings that count; the stated noise where there are too few replicates."""
        # Colours of the first session are foretold by how they age; others are missed as their neighbours are.
        if problem.discrepancy and not problem.first_readings:
            sessions = problem.hours.size if problem.native and problem.native.own else 1
            alike = max(1.0, problem.rows.size / sessions / COLOURS)
            return cls(0.0, 0, ALLOWANCE * alike, alike=alike)
        if problem.noise.source == "assumed":
            return cls(0.0, 0, ALLOWANCE)
        counted = problem.counts > 0
        found = Replicates.of(problem.readings, problem.rows[counted], across_sessions=problem.noise.across_sessions)
        white = np.einsum("nij,nj->ni", problem.whitener[counted], found.deviations)
        freedom = int(3 * found.contrasts)
        # Replicates that share a rounding agree better than their noise does: the noise model, which knows the last
        # digit, is the least yardstick.
        inside = float((white**2).sum())
        # Replicates say nothing of how well what curves miss of a colour ages as its channels do.
        allowance = ALLOWANCE if problem.first_readings else 1.0
        return cls(max(inside, float(freedom)), freedom, allowance, inside=inside)

    @property
    def measured(self) -> bool:
        """Whether there are replicates enough to serve as a yardstick."""
        return self.freedom >= 18

    @property
    def variance(self) -> float:
        """Variance of what replicates scatter in units of the noise model's; 1 where there are too few."""
        return self.squares / self.freedom if self.measured else 1.0

    @property
    def scale(self) -> float:
        """The same, 1 at least; where nobody measured the noise, what is allowed."""
        return max(self.variance, 1.0) if self.measured else self.allowance

    def p_of_gain(self, gain: float, parameters: int) -> float:
        """Probability that an effect that is not there lowers χ² by so much (F test)."""
        if gain <= 0:
            return 1.0
        if not self.measured:
            return float(chdtrc(parameters, gain / self.allowance))
        return float(fdtrc(parameters, self.freedom, gain / parameters / self.variance))

    def gain_beyond(self, chance: float) -> float:
        """Gain in χ² that an effect of one parameter that is not there reaches with this probability (F test)."""
        if not self.measured:
            return self.allowance * float(chdtri(1, chance))
        return self.variance * float(fdtri(1, self.freedom, 1.0 - chance))

    def p_of_lack_of_fit(self, found: Fit) -> float:
        """Probability that noise alone leaves so much (F test for lack of fit)."""
        if not self.measured:
            return float(chdtrc(max(found.freedom, 1) / self.alike, found.chi2 / self.allowance))
        inside = self.squares if self.inside is None else self.inside
        squares, freedom = found.chi2 - inside, found.freedom - self.freedom
        if freedom < 1 or squares <= 0:
            return 1.0
        return float(fdtrc(freedom, self.freedom, squares / freedom / self.variance))
