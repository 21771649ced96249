"""Slices of the readings that a model fits clearly worse than noise explains, and worse than the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.compare import Comparison, Slice

#: A slice stands out when its error over noise exceeds 1 by this many standard deviations of that ratio ...
NOTICED = 4.0

#: ... and exceeds the ratio of the readings that it is compared with by this factor: of all, or, since the values of a
#: condition are compared on the same patches, of all values of its condition.
BEYOND = 1.1


def standing_out(comparison: Comparison) -> list[Slice]:
    """Slices whose error is more than noise and more than elsewhere, those that stand out most first."""
    dimensions = {each.by for each in comparison.where}
    usual = {by: _together([each for each in comparison.where if each.by == by]) for by in dimensions}
    noticed = [
        each
        for each in comparison.where
        if over_noise(each) > max(1.0 + NOTICED / (6 * each.n) ** 0.5, BEYOND * usual[each.by])
    ]
    return sorted(noticed, key=lambda each: -(each.rms_sigma**2 - each.floor_rms_sigma**2) * each.n**0.5)


def _together(slices: Sequence[Slice]) -> float:
    """Error over noise of all slices of one dimension together."""
    error = sum(each.n * each.rms_sigma**2 for each in slices)
    floor = sum(each.n * each.floor_rms_sigma**2 for each in slices)
    return float((error / floor) ** 0.5) if floor else 0.0


def over_noise(each: Slice) -> float:
    """Error of a slice over what noise alone gives, by root mean square."""
    return each.rms_sigma / each.floor_rms_sigma if each.floor_rms_sigma else 0.0
