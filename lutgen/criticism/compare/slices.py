"""Size of the errors of all readings, of one reading, and of groups of readings; which groups have large errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

#: A slice stands out if its error over noise exceeds 1 by this many standard deviations of that ratio ...
NOTICED = 4.0

#: ... and if it exceeds the ratio of all slices of the same dimension by this factor. Slices of a condition are
#: compared only with each other, because they hold the same patches.
BEYOND = 1.1

#: Dimensions to which every reading belongs; other dimensions are conditions.
OF_EVERY_READING = ("hour", "level", "family")


@dataclass(frozen=True)
class Errors:
    """Size of residuals: ΔE2000 (reference white: white of hour 0), and root mean square in σ of the noise."""

    delta_e_mean: float
    delta_e_p95: float
    delta_e_max: float
    rms_sigma: float


@dataclass(frozen=True)
class Slice:
    """Errors of readings that belong together.

    ``mean_residual_xyz`` is measured minus predicted in cd/m²; the floors are the errors that noise alone gives.
    """

    by: str
    slice: str
    n: int
    delta_e_mean: float
    rms_sigma: float
    mean_residual_xyz: tuple[float, float, float]
    floor_delta_e_mean: float
    floor_rms_sigma: float


@dataclass(frozen=True)
class Reading:
    """One reading and its error."""

    line: int
    hour: float
    code: tuple[float, float, float]
    delta_e: float
    sigma: float


def standing_out(where: Sequence[Slice]) -> list[Slice]:
    """Return the slices with errors above the noise and above those of other slices, the most prominent first."""
    usual = _usual(where)
    prominent = [
        each for each in where if over_noise(each) > max(1.0 + NOTICED / (6 * each.n) ** 0.5, BEYOND * usual[each.by])
    ]
    return sorted(prominent, key=prominence, reverse=True)


def prominence(each: Slice) -> float:
    """Return the excess error of a slice, weighted by the root of its number of readings."""
    return float((each.rms_sigma**2 - each.floor_rms_sigma**2) * each.n**0.5)


def informative(where: Sequence[Slice]) -> list[Slice]:
    """Return the slices that can locate the error: a slice of a condition only if its error exceeds the usual."""
    usual = _usual(where)
    return [each for each in where if each.by in OF_EVERY_READING or over_noise(each) > BEYOND * usual[each.by]]


def _usual(where: Sequence[Slice]) -> dict[str, float]:
    """Return the error over noise of each dimension."""
    return {by: _together([each for each in where if each.by == by]) for by in {each.by for each in where}}


def _together(slices: Sequence[Slice]) -> float:
    """Return the error over noise of all slices of one dimension together."""
    error = sum(each.n * each.rms_sigma**2 for each in slices)
    floor = sum(each.n * each.floor_rms_sigma**2 for each in slices)
    return float((error / floor) ** 0.5) if floor else 0.0


def over_noise(each: Slice) -> float:
    """Return the error of a slice over that of noise alone, by root mean square."""
    return each.rms_sigma / each.floor_rms_sigma if each.floor_rms_sigma else 0.0
