"""How far a display's own model misses colours that it has not seen, beside the noise of the meter.

A model of a real display is imperfect at 20 to 150 σ of a meter. Weighed by the meter alone a fit serves dark readings
and finds effects in what no model knows. The discrepancy is a share of the light and a floor, common to X, Y and Z, and
their correlation (Kennedy & O'Hagan 2001, doi:10.1111/1467-9868.00294, without the correlation between colours). It
is estimated by maximum likelihood on readings of the first session, each foretold by a model that had not seen it, so
that nothing that changes over the hours is taken for it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used: the first comparison needs few of them

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.criticism.noise import Noise
    from lutgen.display.native import NativeDisplay

#: Where the search for share and cd/m² starts, and its bounds.
START, LOW, HIGH = (0.005, 0.01), (1e-6, 1e-6), (0.3, 10.0)

#: A reading further off than this, in σ of three numbers, is a misreading, not the model's fault.
MISREAD = 8.0

#: Share and floor are found for the correlation, and the correlation for these, in turns.
ROUNDS = 3


#: X, Y and Z apart.
APART = np.eye(3)


@dataclass(frozen=True)
class Discrepancy:
    """1 σ of what a model misses, beside noise: a share of the light, cd/m², and the correlation of X, Y and Z."""

    share: float = 0.0
    floor_cd_m2: float = 0.0
    correlation: Array = field(default_factory=lambda: APART)

    def __bool__(self) -> bool:
        """Whether there is any."""
        return self.share > 0 or self.floor_cd_m2 > 0

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance at light (n, 3): (n, 3, 3)."""
        sigma = np.hypot(self.share * xyz_cd_m2, self.floor_cd_m2)
        return np.asarray(self.correlation * sigma[:, :, np.newaxis] * sigma[:, np.newaxis, :])

    def sentence(self) -> str:
        """Say its size."""
        return (
            f"Discrepancy of the display's own model: {100 * self.share:.2g} % and {self.floor_cd_m2:.2g} cd/m², from "
            f"readings of the first session that it had not seen. Errors are judged against noise and discrepancy."
        )


NONE = Discrepancy()


def discrepancy_of(residual: Array, xyz_cd_m2: Array, noise: Noise) -> Discrepancy:
    """Estimate the discrepancy from what a model missed, (n, 3) in cd/m², of light (n, 3) that it had not seen."""
    meter, found = noise.covariance(xyz_cd_m2), Discrepancy(*START)
    kept = np.ones(len(residual), dtype=bool)
    for _ in range(ROUNDS):
        found = _most_likely(residual[kept], xyz_cd_m2[kept], meter[kept], found.correlation)
        whole = meter + found.covariance(xyz_cd_m2)
        kept = np.einsum("ni,nij,nj->n", residual, np.linalg.inv(whole), residual) < MISREAD**2
        sigma = np.sqrt(np.diagonal(whole, axis1=1, axis2=2))
        found = replace(found, correlation=_correlation((residual / sigma)[kept]))
    return found


def _correlation(off: Array) -> Array:
    """Correlation of X, Y and Z in what was missed, (n, 3), whose mean is 0."""
    moments = off.T @ off / len(off) + 1e-12 * APART
    size = np.sqrt(np.diagonal(moments))
    return np.asarray(moments / np.outer(size, size))


def _most_likely(residual: Array, xyz: Array, meter: Array, correlation: Array) -> Discrepancy:
    def at(point: Array) -> Discrepancy:
        return Discrepancy(float(np.exp(point[0])), float(np.exp(point[1])), correlation)

    def loss(point: Array) -> float:
        covariance = meter + at(point).covariance(xyz)
        squares = np.einsum("ni,ni->", residual, np.linalg.solve(covariance, residual[..., np.newaxis])[..., 0])
        return float(np.linalg.slogdet(covariance)[1].sum() + squares)

    bounds = list(zip(np.log(LOW), np.log(HIGH), strict=True))
    return at(scipy.optimize.minimize(loss, np.log(START), method="L-BFGS-B", bounds=bounds).x)


def discrepancy_of_own(native: NativeDisplay | None, noise: Noise) -> Discrepancy:
    """What the display's own model misses of the first session; none where it has no such model."""
    if native is None or native.own is None or native.ladder is None:
        return NONE
    sample, held_out = native.ladder.sample, native.ladder.held_out
    seen = sample.fold >= 0
    return discrepancy_of(((sample.share - held_out) * sample.white)[seen], (sample.share * sample.white)[seen], noise)
