"""A rounding of code values behind calibration tables that nobody knows, on a display with its own model.

A rounding shifts each code value of each channel by a part of a step. Which part depends on the table before the
rounding. If the table is known, or near a power, a formula gives all shifts. Otherwise a formula gives a few shifts,
and the search adds effects that explain some of the others. Therefore the shifts of all code values are unknowns here,
as large as those of the rounding (:mod:`lutgen.criticism.first_session.slope_errors`). If these shifts leave only
noise, are jagged, and none is far larger than the others, the rounding takes the place of the other effects.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.criticism.first_session.slope_errors import bic_gain, with_drive_errors
from lutgen.criticism.search.candidates import STRONG, family
from lutgen.criticism.search.explanation import changes_colours, together
from lutgen.criticism.search.free_term import leaves_only_noise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.noise.pure_error import PureError
    from lutgen.criticism.search.candidates import Candidate
    from lutgen.effects import Effect


def rounding_behind_table(
    chosen: Sequence[Candidate], base: Fit, effects: Sequence[Effect], error: PureError
) -> list[Candidate]:
    """Return a rounding, alone or beside one effect of ``chosen``, that explains the readings with unknown shifts.

    Effects on code values, curves and mixing are not tried beside the rounding: these readings cannot tell them from
    the shifts. The list is empty if there is no such rounding, if the display has no own model, or if ``chosen`` leaves
    only noise.
    """
    rounding = next((effect for effect in effects if effect.propose), None)
    if not chosen or rounding is None or base.problem.native is None:
        return []
    if leaves_only_noise(together(base, chosen), error):
        return []
    others = [[each] for each in chosen if not changes_colours(each.effect)]
    for beside in ([], *others):
        around = together(base, beside)
        shifts = around.score.code_shifts
        if not shifts.is_jagged or not shifts.are_of_one_step:
            continue
        best = family(around, rounding).best
        lenient = with_drive_errors(best.fit)
        is_needed = best.fit.bic < around.bic - STRONG
        are_needed = all(bic_gain(lenient, each.effect) > STRONG for each in beside)
        if is_needed and are_needed and leaves_only_noise(lenient, error):
            return [*beside, best]
    return []
