"""The share of the error beyond noise that lutgen's finding removes, measured on noise-free readings.

If an effect is weak, the noise of the readings hides the answer. So two models, one without and one with the finding,
are compared with the noise-free readings; each session's gain is free. The noise of the tips adds an error to both
models. Its expectation, one unit for each unknown of the tips, is subtracted. Like the scoring, this module imports
lutgen.
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
    """Return the removed share of the squared error beyond noise.

    The share is NaN if the error of the model without effects is not larger than the error from the noise of its tips.
    """
    problem, explanation = diagnosis.problem, diagnosis.explanation
    lines = problem.readings.lines.astype(int)  # the order of readings is not that of the file
    real = noise_free(campaign)[(lines - lines.min())[problem.rows]]
    expected = unknowns(problem) - problem.hours.size
    before = _misfit(explanation.base, real) - expected
    after = _misfit(explanation.final, real) - expected
    return 1.0 - after / before if before > np.sqrt(2.0 * expected) else float("nan")


def _misfit(solution: Fit, real: Array) -> float:
    """Return Σ of squared whitened differences to the noise-free readings (n, 3), with the best gain for every hour."""
    predicted, true = whiten(solution.problem, solution.predicted), whiten(solution.problem, real)
    total = 0.0
    for hour in range(solution.problem.hours.size):
        here = solution.problem.hour_of == hour
        mine, other = predicted[here].ravel(), true[here].ravel()
        residual = mine - other * (mine @ other) / (other @ other)
        total += float(residual @ residual)
    return total
