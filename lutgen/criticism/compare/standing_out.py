"""Slices of the readings that a model fits clearly worse than noise explains, and worse than the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.criticism.compare.comparison import Comparison, Slice

#: A slice stands out when its error over noise exceeds 1 by this many standard deviations of that ratio ...
NOTICED = 4.0

#: ... and exceeds the ratio of the readings that it is compared with by this factor: of all, or, since the values of a
#: condition are compared on the same patches, of all values of its condition.
BEYOND = 1.1

#: Dimensions into which every reading falls; others are conditions.
OF_EVERY_READING = ("hour", "level", "family")


def standing_out(comparison: Comparison) -> list[Slice]:
    """Slices whose error is more than noise and more than elsewhere, those that stand out most first."""
    usual = _usual(comparison.where)
    noticed = [
        each
        for each in comparison.where
        if over_noise(each) > max(1.0 + NOTICED / (6 * each.n) ** 0.5, BEYOND * usual[each.by])
    ]
    return sorted(noticed, key=lambda each: -(each.rms_sigma**2 - each.floor_rms_sigma**2) * each.n**0.5)


def telling(where: Sequence[Slice]) -> list[Slice]:
    """Slices that can say where a model errs: those of a condition only where it makes a difference."""
    usual = _usual(where)
    return [each for each in where if each.by in OF_EVERY_READING or over_noise(each) > BEYOND * usual[each.by]]


def _usual(where: Sequence[Slice]) -> dict[str, float]:
    return {by: _together([each for each in where if each.by == by]) for by in {each.by for each in where}}


def _together(slices: Sequence[Slice]) -> float:
    """Error over noise of all slices of one dimension together."""
    error = sum(each.n * each.rms_sigma**2 for each in slices)
    floor = sum(each.n * each.floor_rms_sigma**2 for each in slices)
    return float((error / floor) ** 0.5) if floor else 0.0


def over_noise(each: Slice) -> float:
    """Error of a slice over what noise alone gives, by root mean square."""
    return each.rms_sigma / each.floor_rms_sigma if each.floor_rms_sigma else 0.0
