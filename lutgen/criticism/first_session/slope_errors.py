"""Uncertainty of effects on code values with a display's own curves.

An effect that shifts a code value changes the light by the slope of the curve, and a curve through few levels gives its
slope between them to some 15 %. If the display rounds after a calibration table, each code value of each channel is
shifted by an unknown fraction of a step, because the readings do not hold the table. The errors of slopes and steps are
unknowns in the tests of whether an effect explains enough and whether others are needed; the formulas of effects are
fitted without them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.fit.code_shifts import STEP, shift_of
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, predict

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.linear import Term
    from lutgen.effects import Effect

#: Relative error (1 σ) of the slope of a curve between its levels, if levels are few; measured by
#: ``tests/test_slope_errors.py``.
SLOPE = 0.15


def with_drive_errors(fitted: Fit) -> Fit:
    """Fit the effects again, with errors of the effects of stage ``drive``; return the fit itself if it has none."""
    problem = fitted.problem
    drive_terms = [term for term in fitted.terms if term.effect.stage == "drive"]
    if not drive_terms or problem.native is None:
        return fitted
    drive_errors = np.concatenate(
        [_steps(fitted, term) if term.effect.propose else _slopes(fitted, term) for term in drive_terms]
    )
    return fit(replace(problem, drive_errors=drive_errors), fitted.terms, fitted.state)


def bic_with_drive_errors(with_errors: Fit, fitted: Fit) -> float:
    """BIC of a fit with drive errors, comparable with fits without: the errors have a prior, and lower the likelihood.

    For errors with a normal prior, -2 ln of the likelihood is χ² plus the logarithm of the ratio of two determinants:
    prior covariance of the errors over posterior covariance.
    """
    return with_errors.bic + _spread(with_errors) - _spread(fitted)


def _spread(fitted: Fit) -> float:
    errors = fitted.first_errors
    return -float(np.linalg.slogdet(errors.inverse)[1]) if errors else 0.0


def bic_gain(fitted: Fit, effect: Effect) -> float:
    """Fall of BIC by one of the effects of a fit with drive errors, compared with the fit without this effect."""
    others = [term for term in fitted.terms if term.effect.name != effect.name]
    return fitted.with_terms(others).bic - fitted.bic


def _slopes(fitted: Fit, term: Term) -> Array:
    """1 σ errors of an effect's change of X, Y or Z of one colour, by the slopes of curves, (e, n, 3), cd/m²."""
    without = State(tuple(other for other in fitted.terms if other is not term), fitted.tips, fitted.gains)
    change = SLOPE * (fitted.predicted - predict(fitted.problem, without))
    codes, place = fitted.problem.first_session_model.codes
    of_colour = np.arange(len(codes))[:, np.newaxis] == place
    columns = of_colour[:, np.newaxis, :, np.newaxis] * np.eye(3)[:, np.newaxis] * change
    return np.asarray(columns.reshape(-1, *change.shape))


def _steps(fitted: Fit, term: Term) -> Array:
    """Change of the light if one code value of one channel shifts by the effect's RMS shift, (e, n, 3), cd/m²."""
    problem, drive = fitted.problem, fitted.problem.drive
    is_between, later = (drive > 0.0) & (drive < 1.0), problem.hour_of > 0
    shift = term.effect.function(drive, problem.scene(fitted.tips), **term.values) - drive
    rms_shift = float(np.sqrt(np.mean(np.square(shift[later][is_between[later]]))))
    columns = []
    for channel in range(3):
        shifted = State((*fitted.terms, shift_of(problem, channel)), fitted.tips, fitted.gains)
        slope = (predict(problem, shifted) - fitted.predicted) / -STEP
        levels = np.unique(drive[is_between[:, channel], channel])
        columns += [rms_shift * slope * (drive[:, channel] == level)[:, np.newaxis] for level in levels]
    return np.asarray(columns)
