"""What effects on code values do behind a display's own curves, which know it only roughly.

A code value that an effect moves gives light by the slope of the curve there, and between its levels a curve of few
levels knows its slope to some 15 %. A rounding behind a calibration table moves each code value of each channel by a
part of a step, which the table alone would tell. Beside these doubts it is judged whether an effect explains enough,
and whether others are needed; formulas are fitted without them.
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

#: Share to which a curve through few levels knows its slope between them, 1 σ; ``tests/test_doubts.py`` measures it.
SLOPE = 0.15


def with_drive_errors(found: Fit) -> Fit:
    """Fit the same effects where what those of the stage ``drive`` do is known roughly; as it is, where none are."""
    problem, state = found.problem, State(found.terms, found.tips, found.gains)
    moving = [term for term in found.terms if term.effect.stage == "drive"]
    if not moving or problem.native is None:
        return found
    drive_errors = np.concatenate(
        [_steps(found, term) if term.effect.propose else _slopes(found, term) for term in moving]
    )
    return fit(replace(problem, drive_errors=drive_errors), found.terms, state)


def bic_gain(drive_errors: Fit, effect: Effect) -> float:
    """By how much BIC falls with one of a fit's effects, beside the doubts of the others."""
    others = [term for term in drive_errors.terms if term.effect.name != effect.name]
    without = fit(drive_errors.problem, others, State(tuple(others), drive_errors.tips, drive_errors.gains))
    return without.bic - drive_errors.bic


def _slopes(found: Fit, term: Term) -> Array:
    """Light that the slopes of curves may give or take of what an effect does to X, Y or Z of a colour, (e, n, 3)."""
    still = State(tuple(other for other in found.terms if other is not term), found.tips, found.gains)
    change = SLOPE * (found.predicted - predict(found.problem, still))
    codes, place = found.problem.first_session_model.codes
    of_colour = np.arange(len(codes))[:, np.newaxis] == place
    columns = of_colour[:, np.newaxis, :, np.newaxis] * np.eye(3)[:, np.newaxis] * change
    return np.asarray(columns.reshape(-1, *change.shape))


def _steps(found: Fit, term: Term) -> Array:
    """Light by a shift of one code value of one channel, as large as an effect's shifts are, (e, n, 3)."""
    problem, drive = found.problem, found.problem.readings.drive[found.problem.rows]
    between, later = (drive > 0.0) & (drive < 1.0), problem.hour_of > 0
    moved = term.effect.function(drive, problem.scene(found.tips), **term.values) - drive
    spread = float(np.sqrt(np.mean(np.square(moved[later][between[later]]))))
    columns = []
    for channel in range(3):
        shifted = State((*found.terms, shift_of(problem, channel)), found.tips, found.gains)
        slope = (predict(problem, shifted) - found.predicted) / -STEP
        levels = np.unique(drive[between[:, channel], channel])
        columns += [spread * slope * (drive[:, channel] == level)[:, np.newaxis] for level in levels]
    return np.asarray(columns)
