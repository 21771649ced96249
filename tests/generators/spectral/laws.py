"""Functions of time and of level that several effects share."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

LIFE = 18_000.0  # hours at which the sizes of effects are defined


def generator(seed: int, name: str) -> np.random.Generator:
    """Return a separate random generator for each name, so that a hidden effect changes no number of another effect."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def growth(hours: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Logistic growth in time: 0 when new, 1 at 18 000 h; the time of steepest growth and the width are random."""
    middle, width = rng.uniform(4000, 11000), rng.uniform(2500, 6000)

    def s(t: NDArray[np.float64] | float) -> NDArray[np.float64]:
        return np.asarray(1 / (1 + np.exp(-(np.asarray(t) - middle) / width)))

    return np.asarray((s(hours) - s(0.0)) / (s(LIFE) - s(0.0)))


def log_logistic(hours: NDArray[np.float64], *, loss: float, power: float) -> NDArray[np.float64]:
    """1/(1 + (t/T)^p); the value at 18 000 h is 1/(1 + ``loss``)."""
    return np.asarray(1 / (1 + loss * (hours / LIFE) ** power))


def srgb_to_linear(code: NDArray[np.float64]) -> NDArray[np.float64]:
    """The sRGB transfer function, IEC 61966-2-1. Code values below 0 give 0; the curve continues above 1."""
    code = np.maximum(code, 0.0)
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def sign(rng: np.random.Generator) -> float:
    """Return 1 or −1 at random."""
    return float(rng.choice([-1.0, 1.0]))
