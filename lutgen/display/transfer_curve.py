"""A measured transfer curve: code value to linear light of one channel, monotone by construction.

The light of a measured ramp may fall, by noise or by a misread level. :func:`misread_levels` and :func:`fallen` find
such levels, and :func:`rising_light` makes the ramp monotone.

Between its points a curve is a piecewise cubic without overshoot (Fritsch & Carlson, SIAM J. Numer. Anal. 17, 238-246
(1980), doi:10.1137/0717021; slopes by the weighted harmonic mean of Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5,
300-304 (1984), doi:10.1137/0905021). The cubic interpolates sRGB-encoded light, in which every display's curve is
nearly straight: few points reproduce an sRGB display exactly, and errors near black have perceptual weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lutgen.colorimetry import Array, code_to_linear, linear_to_code
from lutgen.errors import LutgenError


@dataclass(frozen=True)
class TransferCurve:
    """Points of a curve from (0, 0) to (1, 1), and their interpolation.

    Raises LutgenError: fewer than two points, other ends, codes that do not increase, or light that falls. The message
    names channel and codes.
    """

    #: Name of the channel, for messages.
    channel: str
    #: Code values, increasing from 0 to 1, and linear light relative to code 1, non-decreasing from 0 to 1.
    codes: tuple[float, ...]
    light: tuple[float, ...]

    def __post_init__(self) -> None:
        codes, light = np.array(self.codes, dtype=np.float64), np.array(self.light, dtype=np.float64)
        who = f"native display: the curve of {self.channel}"
        if codes.ndim != 1 or codes.shape != light.shape or codes.size < 2:
            raise LutgenError(f"{who} needs as many codes as lights, two at least; it has {codes.size}, {light.size}.")
        ends = (codes[0], light[0], codes[-1], light[-1])
        if ends != (0.0, 0.0, 1.0, 1.0) or not np.isfinite(light).all() or not (np.diff(codes) > 0).all():
            raise LutgenError(f"{who} must run from code 0, light 0 to code 1, light 1, its codes increasing.")
        falls = np.flatnonzero(np.diff(light) < 0)
        if falls.size:
            first = int(falls[0])
            raise LutgenError(
                f"{who} is not monotonic: its light falls from {light[first]:.4g} at code {codes[first]:.4g} to "
                f"{light[first + 1]:.4g} at code {codes[first + 1]:.4g}. Correct these points, or measure them again."
            )
        object.__setattr__(self, "codes", tuple(codes.tolist()))
        object.__setattr__(self, "light", tuple(light.tolist()))

    @classmethod
    def through(cls, channel: str, codes: Sequence[float] | Array, light: Sequence[float] | Array) -> "TransferCurve":
        """Return the curve through points between the ends; the ends (0, 0) and (1, 1) are added."""
        inner = [(code, each) for code, each in zip(codes, light, strict=True) if 0.0 < code < 1.0]
        return cls(channel, (0.0, *(code for code, _ in inner), 1.0), (0.0, *(each for _, each in inner), 1.0))

    def __call__(self, code: Array) -> Array:
        """Convert code values of any shape to linear light; outside 0..1 extrapolate encoded light linearly."""
        knots, encoded, slopes = self._spline
        within = np.clip(code, 0.0, 1.0)
        piece = np.clip(np.searchsorted(knots, within, side="right") - 1, 0, knots.size - 2)
        width = (knots[1:] - knots[:-1])[piece]
        rise = (encoded[1:] - encoded[:-1])[piece]
        place = (within - knots[piece]) / width
        # Hermite's cubic as a straight line plus a bend from the slopes, so that straight lines are exact.
        start, end = slopes[piece] * width - rise, slopes[piece + 1] * width - rise
        bend = place * (1.0 - place) * ((1.0 - place) * start - place * end)
        shown = encoded[piece] + place * rise + bend
        beyond = np.where(code < 0.0, slopes[0], slopes[-1]) * (code - within)
        return code_to_linear(shown + beyond)

    @cached_property
    def _spline(self) -> tuple[Array, Array, Array]:
        """Knots, sRGB-encoded light at the knots, and its slopes, (K,) each."""
        knots, encoded = np.array(self.codes), linear_to_code(np.array(self.light))
        # The encoding of 1 differs from 1 in the last bit.
        encoded[-1] = 1.0
        width = np.diff(knots)
        return knots, encoded, _slopes(width, np.diff(encoded) / width)


def _slopes(width: Array, secant: Array) -> Array:
    """Return slopes at the knots without overshoot, (K,), from widths and non-negative secants, (K − 1,)."""
    if secant.size == 1:
        return np.repeat(secant, 2)
    slopes = np.zeros(secant.size + 1)
    before, after = secant[:-1], secant[1:]
    rising = (before > 0) & (after > 0)
    near, far = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
    with np.errstate(divide="ignore"):
        mean = (near + far) / (near / before + far / after)
    slopes[1:-1] = np.where(rising, mean, 0.0)
    slopes[0] = _end_slope(width[0], width[1], secant[0], secant[1])
    slopes[-1] = _end_slope(width[-1], width[-2], secant[-1], secant[-2])
    return slopes


def _end_slope(width: float, next_width: float, secant: float, next_secant: float) -> float:
    """Return the end slope of a parabola through the last three points, clipped to 0..3 secants against overshoot."""
    slope = ((2 * width + next_width) * secant - width * next_secant) / (width + next_width)
    return float(np.clip(slope, 0.0, 3.0 * secant))


#: Largest fall of a ramp that counts as noise, in standard deviations of the difference.
FALLS = 3.0

#: A ramp may have one misread level, and one more for each of this number of levels.
LEVELS_A_MISREADING = 20


def misread_levels(codes: Array, light: Array, sigma: Array) -> list[int]:
    """Return the indices of misread levels, without which a ramp falls within noise; [] if there are too many.

    Each step removes one level. Of the levels whose removal leaves a fall within noise, or otherwise the smallest fall,
    it is the level with the largest distance from the line of its neighbours. ``codes``, ``light``, ``sigma``: (m,)
    each.
    """
    out: list[int] = []
    kept = list(range(codes.size))
    for _ in range(1 + codes.size // LEVELS_A_MISREADING):
        if _fall(light[kept], sigma[kept]) <= FALLS:
            return sorted(out)
        others = [kept[:place] + kept[place + 1 :] for place in range(len(kept))]
        without = [_fall(light[rows], sigma[rows]) for rows in others]
        least = min(without)
        # Of two levels that contradict each other, the level that is off the line of its neighbours is wrong.
        worst = max(
            (place for place, fall in enumerate(without) if fall <= max(least, FALLS)),
            key=lambda place: _off_line(codes, light, kept, place),
        )
        out.append(kept.pop(worst))
    return sorted(out) if _fall(light[kept], sigma[kept]) <= FALLS else []


def _falls(light: Array, sigma: Array) -> tuple[Array, Array, Array]:
    """Return the falls of a ramp from black to full drive, their standard deviations, and where each begins."""
    light, sigma = np.array([0.0, *light, 1.0]), np.array([sigma[0], *sigma, sigma[-1]])
    fall = np.maximum.accumulate(light) - light
    top = np.maximum.accumulate(np.where(fall == 0, np.arange(light.size), 0))
    return fall, np.hypot(sigma, sigma[top]), top


def _fall(light: Array, sigma: Array) -> float:
    """Return the largest fall of a ramp in its standard deviations."""
    fall, uncertainty, _ = _falls(light, sigma)
    return float((fall / uncertainty).max())


def _off_line(codes: Array, light: Array, kept: list[int], place: int) -> float:
    """Return the distance of a level from the line between its neighbours, in encoded light."""
    encoded = linear_to_code(np.clip([0.0, *light[kept], 1.0], 0.0, None))
    at = np.array([0.0, *codes[kept], 1.0])
    here = place + 1
    return float(abs(encoded[here] - np.interp(at[here], at[[here - 1, here + 1]], encoded[[here - 1, here + 1]])))


def fallen(codes: Array, light: Array, sigma: Array, who: str) -> str:
    """Return where a ramp falls within noise, in words; "" for a ramp that does not fall.

    ``codes``, ``light``, ``sigma``: code values between 0 and 1, light there relative to full drive, and its standard
    deviation, (m,) each. ``who``: the ramp, for messages.

    Raises LutgenError: a fall by more than ``FALLS`` standard deviations.
    """
    fall, uncertainty, top = _falls(light, sigma)
    codes, light = np.array([0.0, *codes, 1.0]), np.array([0.0, *light, 1.0])
    worst = int(np.argmax(fall / uncertainty))
    if fall[worst] > FALLS * uncertainty[worst]:
        raise LutgenError(
            f"{who} is not monotonic: {light[top[worst]]:.4g} of full light at code {codes[top[worst]]:.4g}, but "
            f"{light[worst]:.4g} at code {codes[worst]:.4g}, more than noise. Measure these codes again, or leave them "
            f"out."
        )
    return ", ".join(f"from code {codes[top[i]]:.4g} to {codes[i]:.4g}" for i in np.flatnonzero(fall > 0))


def rising_light(light: Array) -> Array:
    """Return the least-squares non-decreasing sequence (pooling: Ayer et al. 1955, doi:10.1214/aoms/1177728423)."""
    pools: list[tuple[float, int]] = []
    for value in light.tolist():
        pools.append((value, 1))
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (last, m), (first, n) = pools.pop(), pools.pop()
            pools.append(((first * n + last * m) / (n + m), n + m))
    return np.array([value for value, count in pools for _ in range(count)])
