"""Slices of the readings that a model fits clearly worse than noise explains, and worse than the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lutgen.criticism.compare import Comparison, Slice

#: A slice stands out when its error over noise exceeds 1 by this many standard deviations of that ratio ...
NOTICED = 4.0

#: ... and exceeds the ratio of all readings together by this factor.
BEYOND = 1.1


def standing_out(comparison: Comparison) -> list[Slice]:
    """Slices whose error is more than noise and more than elsewhere, those that stand out most first."""
    noticed = [
        each
        for each in comparison.where
        if over_noise(each) > max(1.0 + NOTICED / (6 * each.n) ** 0.5, BEYOND * comparison.ratio)
    ]
    return sorted(noticed, key=lambda each: -(each.rms_sigma**2 - each.floor_rms_sigma**2) * each.n**0.5)


def over_noise(each: Slice) -> float:
    """Error of a slice over what noise alone gives, by root mean square."""
    return each.rms_sigma / each.floor_rms_sigma if each.floor_rms_sigma else 0.0
