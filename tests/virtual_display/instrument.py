"""The colorimeter: noise of every reading, and a gain that the readings of a session share.

The design defines three levels of instrument: relative noise, a floor, and the gain of a session, all 1 σ. The noise of
X, Y and Z of one reading has the correlation 0.6, because the flicker of the lamp affects all three.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.virtual_display.spectra import Array

#: Correlation of the noise of X, Y and Z of one reading.
SHARED = 0.6
CORRELATION: Array = np.full((3, 3), SHARED) + (1.0 - SHARED) * np.eye(3)


@dataclass(frozen=True)
class Noise:
    """1 σ of the noise: ``relative`` to the light, ``floor_cd_m2``, and ``session`` gain."""

    relative: float
    floor_cd_m2: float
    session: float

    def times(self, scatter: float) -> Noise:
        """Return an instrument whose readings scatter more by this factor; the session gain is the same."""
        return replace(self, relative=scatter * self.relative, floor_cd_m2=scatter * self.floor_cd_m2)

    def sigma(self, xyz: Array) -> Array:
        """Return 1 σ of X, Y, Z of each reading, same shape as ``xyz``."""
        return np.hypot(self.relative * xyz, self.floor_cd_m2)

    def read(self, xyz: Array, session: NDArray[np.intp], rng: np.random.Generator) -> Array:
        """Return the meter's readings of ``xyz`` (n, 3) in the sessions (n,), numbered from 0."""
        gains = 1.0 + self.session * rng.standard_normal(int(session.max()) + 1)
        seen = xyz * gains[session][:, np.newaxis]
        shared = rng.standard_normal(xyz.shape) @ np.linalg.cholesky(CORRELATION).T
        return np.asarray(seen + self.sigma(seen) * shared)

    def whitened(self, values: Array, xyz: Array) -> Array:
        """Return ``values`` (n, 3, ...) in units of the noise of ``xyz`` (n, 3): unit covariance per reading."""
        root = np.linalg.inv(np.linalg.cholesky(CORRELATION))
        scaled = values / self.sigma(xyz).reshape(*xyz.shape, *(1,) * (values.ndim - 2))
        return np.asarray(np.einsum("ij,nj...->ni...", root, scaled))


NOISE = {
    "lab": Noise(0.001, 0.0005, 0.001),
    "good": Noise(0.002, 0.003, 0.003),
    "cheap": Noise(0.005, 0.02, 0.005),
}
