"""A ramp of readings between black and full drive: where it falls, by noise or by a misread level."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import linear_to_code
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: A ramp that falls by more than so many standard deviations of the difference falls indeed.
FALLS = 3.0

#: Levels of a ramp that may be misread: one, and one more for every so many.
LEVELS_A_MISREADING = 20


def misread_levels(codes: Array, light: Array, sigma: Array) -> list[int]:
    """Places of the levels, (m,) each, without which a ramp does not fall by more than noise; none where it needs many.

    One after the other the level is left out without which the ramp falls least.
    """
    out: list[int] = []
    kept = list(range(codes.size))
    for _ in range(1 + codes.size // LEVELS_A_MISREADING):
        if _fall(light[kept], sigma[kept]) <= FALLS:
            return sorted(out)
        without = [
            _fall(light[kept[:place] + kept[place + 1 :]], sigma[kept[:place] + kept[place + 1 :]])
            for place in range(len(kept))
        ]
        least = min(without)
        # Of two levels that contradict each other the one further from the straight line of its neighbours is wrong.
        worst = max(
            (place for place, fall in enumerate(without) if fall <= max(least, FALLS)),
            key=lambda place: _off_line(codes, light, kept, place),
        )
        out.append(kept.pop(worst))
    return sorted(out) if _fall(light[kept], sigma[kept]) <= FALLS else []


def _fall(light: Array, sigma: Array) -> float:
    """Largest fall of a ramp between black and full drive, in standard deviations of the difference."""
    light, sigma = np.array([0.0, *light, 1.0]), np.array([sigma[0], *sigma, sigma[-1]])
    fall = np.maximum.accumulate(light) - light
    top = np.maximum.accumulate(np.where(fall == 0, np.arange(light.size), 0))
    return float((fall / np.hypot(sigma, sigma[top])).max())


def _off_line(codes: Array, light: Array, kept: list[int], place: int) -> float:
    """How far a level is from the straight line between its neighbours, as the eye sees encoded light."""
    encoded = linear_to_code(np.clip([0.0, *light[kept], 1.0], 0.0, None))
    at = np.array([0.0, *codes[kept], 1.0])
    here = place + 1
    return float(abs(encoded[here] - np.interp(at[here], at[[here - 1, here + 1]], encoded[[here - 1, here + 1]])))


def fallen(codes: Array, light: Array, sigma: Array, who: str) -> str:
    """Say where a ramp falls, if only by noise; "" where it does not.

    ``codes``, ``light``, ``sigma``: code values between 0 and 1, light there relative to full drive, and its standard
    deviation, (m,) each. ``who``: the ramp, for messages. Raises LutgenError: a fall by more than ``FALLS`` standard
    deviations.
    """
    codes, light = np.array([0.0, *codes, 1.0]), np.array([0.0, *light, 1.0])
    sigma = np.array([sigma[0], *sigma, sigma[-1]])
    highest = np.maximum.accumulate(light)
    top = np.maximum.accumulate(np.where(light == highest, np.arange(light.size), 0))
    fall = highest - light
    doubt = np.hypot(sigma, sigma[top])
    worst = int(np.argmax(fall / doubt))
    if fall[worst] > FALLS * doubt[worst]:
        message = (
            f"{who} is not monotonic: {light[top[worst]]:.4g} of full light at code {codes[top[worst]]:.4g}, but "
            f"{light[worst]:.4g} at code {codes[worst]:.4g}, more than noise. Measure these codes again, or leave them "
            f"out."
        )
        raise LutgenError(message)
    return ", ".join(f"from code {codes[top[i]]:.4g} to {codes[i]:.4g}" for i in np.flatnonzero(fall > 0))


def rising_light(light: Array) -> Array:
    """Least-squares rising sequence: pool adjacent violators (Ayer et al. 1955, doi:10.1214/aoms/1177728423)."""
    pools: list[tuple[float, int]] = []
    for value in light.tolist():
        pools.append((value, 1))
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (last, m), (first, n) = pools.pop(), pools.pop()
            pools.append(((first * n + last * m) / (n + m), n + m))
    return np.array([value for value, count in pools for _ in range(count)])
