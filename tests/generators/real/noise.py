"""New noise with the standard deviations of a real session's repeated readings: simulated noise of measured size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.real.sessions import BASES, session

if TYPE_CHECKING:
    from tests.generators.real.sessions import Array
    from tests.generators.truth import Truth

SOURCE = "simulated: a real session of {}, perturbed"
_POOLED_WEIGHT = 3  # differences; as many as a session with four white readings has


@dataclass(frozen=True)
class Spread:
    """Covariances (3, 3) of repeated readings, and the mean black (3,).

    The covariance at white is relative to the light; the covariance at black is in (cd/m²)².
    """

    relative: Array
    absolute: Array
    black: Array


def instrument_noise(truth: Truth, seed: int) -> Array:
    """Draw simulated noise (n, 3) in cd/m². The caller adds it to ``truth.xyz_cd_m2``.

    The noise is normal, with the covariance of the session's own repeated whites (relative) and blacks (absolute).
    Raises ValueError for a truth of another generator, and MissingSessionsError if LUTGEN_REAL_DATA is not set.
    """
    before, after = SOURCE.split("{}")
    source = truth.metadata.get("source", "")
    if not (source.startswith(before) and source.endswith(after)):
        raise ValueError(f"The source {source!r} is no real session; only campaigns of this generator are allowed.")
    spread = session_spread(source[len(before) : len(source) - len(after)])
    rng = np.random.default_rng([seed, 0x6E6F6973])
    count = len(truth.hours)
    relative = rng.multivariate_normal(np.zeros(3), spread.relative, count, method="eigh")
    absolute = rng.multivariate_normal(np.zeros(3), spread.absolute, count, method="eigh")
    above_black = np.maximum(truth.xyz_cd_m2 - spread.black, 0.0)  # the covariance of black contains both parts
    return np.asarray(above_black * relative + absolute)


@cache
def session_spread(name: str) -> Spread:
    """Return the measured covariances of one session's repeated readings.

    A session repeats white and black at most four times. So the result is an average of its covariance and the typical
    covariance of all sessions, which has the weight of three differences.
    """
    parts = []
    for own, pooled in zip(_differences(name), _typical(), strict=True):
        parts.append((own.T @ own / 2.0 + _POOLED_WEIGHT * pooled) / (len(own) + _POOLED_WEIGHT))
    measured = session(name)
    black = measured.xyz_cd_m2[(measured.drive < 0.001).all(axis=1)].mean(axis=0)
    return Spread(relative=parts[0], absolute=parts[1], black=black)


def _differences(name: str) -> tuple[Array, Array]:
    """Return the differences of successive whites (relative) and of successive blacks (absolute), (m, 3) each.

    Half the mean square of successive differences estimates the variance even under slow drift (von Neumann 1941,
    doi:10.1214/aoms/1177731677).
    """
    measured = session(name)
    white = measured.xyz_cd_m2[(measured.drive > 0.999).all(axis=1)]
    black = measured.xyz_cd_m2[(measured.drive < 0.001).all(axis=1)]
    return np.diff(white, axis=0) / white.mean(axis=0), np.diff(black, axis=0)


@cache
def _typical() -> tuple[Array, Array]:
    """Return the covariances of a typical session: the mean shape of all sessions, with their median size."""
    typical = []
    for which in (0, 1):
        differences = [_differences(name)[which] for name in BASES]
        every = np.array([part.T @ part / (2.0 * len(part)) for part in differences if len(part)])
        size = np.trace(every, axis1=1, axis2=2)
        shape = np.mean(every[size > 0] / size[size > 0, None, None], axis=0)
        typical.append(np.asarray(shape * np.median(size)))
    return typical[0], typical[1]
