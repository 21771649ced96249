"""Blacks that differ between sessions by more than the zero of a meter: leaking light, room light, or another zero."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lutgen.criticism.fit.problem import Problem
    from lutgen.criticism.verdict.verdict import Verdict

#: A remark names a dark offset that is larger than usual by this factor.
UNUSUAL = 5.0

#: Largest plausible difference of a meter's zero between sessions, 1 σ in cd/m²; an assumption.
LARGEST_ZERO_CD_M2 = 0.1

#: Effects that add the same light to all readings of a session: light of the display or of the room, the meter's zero.
CAUSES = ("black-level", "ambient-reflection", "meter-offset")


def remark(problem: Problem) -> str:
    """Say that black differs between sessions, and how to find the cause; "" if it does not, or the lens was capped."""
    if problem.offset_cd_m2 <= UNUSUAL * problem.noise.offset_cd_m2 or problem.is_capped.any():
        return ""
    return (
        f"Black differs between sessions by {problem.offset_cd_m2:.2g} cd/m² (1 σ), without a smooth course in time"
        f"{_largest_step(problem)}: the zero of the meter, or a leak of light that these sessions cannot tell from it. "
        f"Read black with the lens capped in every session."
    )


def is_beyond_zero(problem: Problem) -> bool:
    """Whether black differs between sessions by more than the zero of a meter does, and the lens was not capped."""
    return problem.offset_cd_m2 > LARGEST_ZERO_CD_M2 and not problem.is_capped.any()


def or_leak(verdict: Verdict, problem: Problem) -> Verdict:
    """Return the verdict, or ``one-of`` in place of ``consistent`` if black differs by more than a meter's zero does.

    Without readings of the capped lens, the dark offsets of sessions absorb any change of black that has no smooth
    course in time.
    """
    if verdict.name != "consistent" or not is_beyond_zero(problem):
        return verdict
    sentence = (
        f"Black differs between sessions by {problem.offset_cd_m2:.2g} cd/m² (1 σ){_largest_step(problem)}. The "
        f"display leaks light (black-level), the room had light (ambient-reflection), or the zero of the meter changed "
        f"(meter-offset), which it rarely does by more than {LARGEST_ZERO_CD_M2:g} cd/m². Nothing else is above the "
        f"noise."
    )
    remarks = tuple(each for each in verdict.remarks if each != remark(problem))
    return replace(verdict, name="one-of", sentence=sentence, effects=CAUSES, rivals=(CAUSES,), remarks=remarks)


def _largest_step(problem: Problem) -> str:
    """Say between which two sessions black changed most, as part of a sentence; "" if fewer than two show black."""
    dark = problem.is_at_rest & ~problem.is_capped & (problem.drive == 0).all(axis=1)
    hours = np.unique(problem.hour_of[dark])
    if hours.size < 2:
        return ""
    black = np.array([problem.xyz[dark & (problem.hour_of == hour), 1].mean() for hour in hours])
    at = int(np.argmax(np.abs(np.diff(black))))
    before, after = (f"{black[n]:.3g} cd/m² at {problem.hours[hours[n]]:g} h" for n in (at, at + 1))
    return f": {before}, {after}"
