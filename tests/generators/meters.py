"""Six simulated meters. They deviate from a Gaussian meter as real meters do.

Every meter has a gain that all readings of a session share. Every reading has noise with a separate σ for X, Y and Z.
The sizes are those of a good colorimeter. The ratio of the σ and the correlations are medians of repeated white
readings in twelve real sessions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from tests.generators.truth import Truth

    Array = NDArray[np.float64]

#: 1 σ of Y: relative to the light, as a floor in cd/m², and of the gain that a session shares.
RELATIVE, FLOOR_CD_M2, SESSION_GAIN = 0.002, 0.003, 0.003

#: σ of X, Y, Z relative to the σ of Y. For X no difference is known.
RATIO = np.array([1.0, 1.0, 1.74])

#: Correlations of the relative noise. The floor is noise of the separate detectors, so X, Y and Z have no floor noise
#: in common.
CORRELATION = np.array([[1.0, 0.98, 0.94], [0.98, 1.0, 0.87], [0.94, 0.87, 1.0]])

#: A meter whose rounding is visible has little noise: the standard deviation of its readings is at most a few units of
#: the last digit.
QUIET = 0.25
LAST_DIGIT_CD_M2, SIGNIFICANT_DIGITS = 0.01, 4

#: 1 σ of the black offset of a session in cd/m². Two cables of one meter differed by 0.09 on one day.
DARK_CD_M2 = 0.02

#: 1 σ of the drifting gain, and its correlation time as a share of a session.
WANDER, MEMORY = 0.003, 0.25

#: Shot noise at 100 cd/m², relative to the light. The relative noise falls with the square root of the light.
SHOT_AT_100 = 0.002

#: Degrees of freedom of the heavy-tailed noise.
FREEDOM = 3


@dataclass(frozen=True)
class Meter:
    """One instrument.

    Attributes
    ----------
    name
        Name of the meter in the tables.
    states_gain
        Whether the file states the size of the gain that a session shares.
    noise
        ``noise(seen, truth, random)`` returns the noise that the meter adds to the light at its sensor, (n, 3),
        cd/m².
    finish
        The last step, applied to the sum of light and noise: rounding, or nothing.

    """

    name: str
    states_gain: bool
    noise: Callable[[Array, Truth, np.random.Generator], Array]
    finish: Callable[[Array, np.random.Generator], Array] = lambda xyz, _random: xyz

    def stated(self, truth: Truth) -> Truth:
        """Return the campaign with what a file of this meter's readings states."""
        return replace(truth, metadata={**truth.metadata, **self.metadata})

    @property
    def metadata(self) -> dict[str, str]:
        """Return the ``# key: value`` lines that the meter adds to the file."""
        stated = {"session_gain": f"{SESSION_GAIN:g}"} if self.states_gain else {}
        return {"instrument": f"simulated meter, {self.name}", **stated}

    def read(self, truth: Truth, seed: int) -> Array:
        """Return the readings of the meter, (n, 3), cd/m². Dark readings may be negative."""
        random = np.random.default_rng([seed, 0x3E7E])
        names, session = np.unique(np.array(truth.session), return_inverse=True)
        gain = 1.0 + SESSION_GAIN * random.standard_normal(names.size)
        seen = truth.xyz_cd_m2 * gain[session][:, np.newaxis]
        return np.asarray(self.finish(seen + self.noise(seen, truth, random), random))


def covariance(xyz: Array) -> Array:
    """Return the covariance of one reading of light (n, 3) by a good meter, (n, 3, 3).

    The covariance excludes the gain that the readings of a session share.
    """
    relative = RELATIVE * RATIO * xyz
    floor = np.diag((FLOOR_CD_M2 * RATIO) ** 2)
    return np.asarray(CORRELATION * relative[:, :, np.newaxis] * relative[:, np.newaxis, :] + floor)


def _gaussian(seen: Array, truth: Truth, random: np.random.Generator) -> Array:
    del truth
    together = random.standard_normal(seen.shape) @ np.linalg.cholesky(CORRELATION).T
    alone = random.standard_normal(seen.shape)
    return np.asarray(RATIO * (RELATIVE * seen * together + FLOOR_CD_M2 * alone))


def _dark(seen: Array, truth: Truth, random: np.random.Generator) -> Array:
    names, session = np.unique(np.array(truth.session), return_inverse=True)
    together = random.standard_normal((names.size, 3)) @ np.linalg.cholesky(CORRELATION).T
    return np.asarray(_gaussian(seen, truth, random) + (DARK_CD_M2 * RATIO * together)[session])


def _quiet(seen: Array, truth: Truth, random: np.random.Generator) -> Array:
    return QUIET * _gaussian(seen, truth, random)


def _last_digit(xyz: Array, random: np.random.Generator) -> Array:
    """Round to hundredths of a cd/m² or to four significant digits; one rule for the whole campaign."""
    if random.random() < 0.5:
        return np.asarray(np.round(xyz / LAST_DIGIT_CD_M2) * LAST_DIGIT_CD_M2)
    size = np.floor(np.log10(np.maximum(np.abs(xyz), 1e-12)))
    step = 10.0 ** (size - SIGNIFICANT_DIGITS + 1)
    return np.asarray(np.round(xyz / step) * step)


def _wander(seen: Array, truth: Truth, random: np.random.Generator) -> Array:
    """Return a gain that drifts along the order of reading (an Ornstein–Uhlenbeck process)."""
    gain = np.zeros(truth.order.size)
    names = np.array(truth.session)
    for name in sorted(set(truth.session)):
        rows = np.flatnonzero(names == name)
        rows = rows[np.argsort(truth.order[rows])]
        kept = np.exp(-1.0 / (MEMORY * rows.size))
        steps = random.standard_normal(rows.size)
        state = steps[0]
        for row, step in zip(rows, steps, strict=True):
            state = kept * state + np.sqrt(1.0 - kept**2) * step
            gain[row] = WANDER * state
    return np.asarray(_gaussian(seen, truth, random) + seen * gain[:, np.newaxis])


def _shot(seen: Array, truth: Truth, random: np.random.Generator) -> Array:
    del truth
    photons = SHOT_AT_100 * np.sqrt(100.0 * np.maximum(seen, 0.0)) * random.standard_normal(seen.shape)
    return np.asarray(RATIO * (photons + FLOOR_CD_M2 * random.standard_normal(seen.shape)))


def _tails(seen: Array, truth: Truth, random: np.random.Generator) -> Array:
    """Return noise of a whole reading that follows Student's t distribution.

    The variance equals that of the Gaussian noise: Student's t has the variance ν/(ν−2).
    """
    wide = np.sqrt(FREEDOM / random.chisquare(FREEDOM, (len(seen), 1)))
    return np.asarray(_gaussian(seen, truth, random) * wide * np.sqrt((FREEDOM - 2) / FREEDOM))


METERS = {
    meter.name: meter
    for meter in (
        Meter("gaussian", states_gain=True, noise=_gaussian),
        Meter("dark-offset", states_gain=False, noise=_dark),
        Meter("quantised", states_gain=True, noise=_quiet, finish=_last_digit),
        Meter("wandering-gain", states_gain=False, noise=_wander),
        Meter("shot-noise", states_gain=True, noise=_shot),
        Meter("heavy-tails", states_gain=False, noise=_tails),
    )
}
