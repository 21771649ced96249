"""How much of the error that is not noise does lutgen's finding remove? Told by the display without noise.

The readings' own noise would drown the answer where an effect is weak. So both models, without and with what was found,
are held against the noise-free readings, each session's gain free. What the tips' own noise leaves in either is taken
off by its expectation: a number for each unknown of the tips. Like the scoring, this imports lutgen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.least_squares import unknowns
from lutgen.criticism.fit.linear import whiten
from tests.virtual_display.campaign import noise_free

if TYPE_CHECKING:
    from lutgen.criticism.diagnose import Diagnosis
    from lutgen.criticism.fit.least_squares import Fit
    from tests.virtual_display.campaign import Campaign
    from tests.virtual_display.spectra import Array


def excess_removed(diagnosis: Diagnosis, campaign: Campaign) -> float:
    """Share of the squared error beyond noise; NaN where the model without effects errs by no more than its tips."""
    problem, explanation = diagnosis.problem, diagnosis.explanation
    real = noise_free(campaign)[problem.rows]
    expected = unknowns(problem) - problem.hours.size
    before = _misfit(explanation.base, real) - expected
    after = _misfit(explanation.final, real) - expected
    return 1.0 - after / before if before > np.sqrt(2.0 * expected) else float("nan")


def _misfit(found: Fit, real: Array) -> float:
    """Σ of squared whitened differences to the noise-free readings (n, 3), with the best gain for every hour."""
    said, true = whiten(found.problem, found.predicted), whiten(found.problem, real)
    total = 0.0
    for hour in range(found.problem.hours.size):
        here = found.problem.hour_of == hour
        mine, other = said[here].ravel(), true[here].ravel()
        left = mine - other * (mine @ other) / (other @ other)
        total += float(left @ left)
    return total
