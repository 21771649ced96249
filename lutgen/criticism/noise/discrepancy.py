"""How far a display's own model misses colours that it has not seen, beside the noise of the meter.

A model of a real display is imperfect at 20 to 150 σ of a meter. Weighed by the meter alone a fit serves dark readings
and finds effects in what no model knows. The discrepancy is a share of each of X, Y and Z, a share of the luminance in
the colour of white, and a floor; and the correlation of X, Y and Z (Kennedy & O'Hagan 2001,
doi:10.1111/1467-9868.00294, without the correlation between colours). Where channels do not add up, yellow may miss
more blue light than it has: the error is no share of its own Z, but of its luminance. All is estimated by maximum
likelihood on readings of the first session, each foretold by a model that had not seen it, so that nothing that changes
over the hours is taken for it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used: the first comparison needs few of them
from scipy.special import chdtrc

from lutgen.display.native import NativeDisplay, first_session_rows, sample_of
from lutgen.display.own_model.native_curves import FEW, added_up, parts_of
from lutgen.errors import LutgenError
from lutgen.readings.rest import is_tip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.noise.model import Noise
    from lutgen.display.own_model import Sample
    from lutgen.readings import Measurements

#: Where the search for both shares and cd/m² starts, and its bounds.
START, LOW, HIGH = (0.005, 0.005, 0.01), (1e-6, 1e-6, 1e-6), (0.3, 0.3, 10.0)

#: A reading further off than this, in σ of three numbers, is a misreading, not the model's fault.
MISREAD = 8.0

#: The chance at which noise is taken for what curves miss.
SIGNIFICANT = 0.01

#: Shares and floor are found for the correlation, and the correlation for these, in turns.
ROUNDS = 3


#: X, Y and Z apart.
APART = np.eye(3)


@dataclass(frozen=True)
class Discrepancy:
    """1 σ of what a model misses, beside noise.

    Attributes
    ----------
    share
        Share of each of X, Y and Z.
    of_luminance
        Share of Y, in the colour of ``white``.
    floor_cd_m2
        In cd/m².
    correlation
        Of X, Y and Z, (3, 3).
    white
        XYZ of white, (3,), of which the ratios count.

    """

    share: float = 0.0
    of_luminance: float = 0.0
    floor_cd_m2: float = 0.0
    correlation: Array = field(default_factory=lambda: APART)
    white: Array = field(default_factory=lambda: np.ones(3))

    def __bool__(self) -> bool:
        """Whether there is any."""
        return max(self.share, self.of_luminance, self.floor_cd_m2) > 0

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance at light (n, 3): (n, 3, 3)."""
        of_luminance = self.of_luminance * xyz_cd_m2[:, 1:2] * (self.white / self.white[1])
        sigma = np.sqrt((self.share * xyz_cd_m2) ** 2 + of_luminance**2 + self.floor_cd_m2**2)
        return np.asarray(self.correlation * sigma[:, :, np.newaxis] * sigma[:, np.newaxis, :])

    def sentence(self) -> str:
        """Say its size."""
        return (
            f"Discrepancy of the display's own model: {100 * self.share:.2g} % of X, Y and Z each, "
            f"{100 * self.of_luminance:.2g} % of the luminance and {self.floor_cd_m2:.2g} cd/m², from readings of the "
            f"first session that it had not seen. Errors are judged against noise and discrepancy."
        )


NONE = Discrepancy()


def discrepancy_of(residual: Array, xyz_cd_m2: Array, noise: Array, white: Array) -> Discrepancy:
    """Estimate the discrepancy from what a model missed, (n, 3) in cd/m², of light (n, 3) that it had not seen.

    ``noise``: covariance of what would be missed without a discrepancy, (n, 3, 3); ``white``: XYZ, (3,).
    """
    meter, found = noise, Discrepancy(*START, white=white)
    kept = np.ones(len(residual), dtype=bool)
    for _ in range(ROUNDS):
        found = _most_likely(residual[kept], xyz_cd_m2[kept], meter[kept], found)
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


def _most_likely(residual: Array, xyz: Array, meter: Array, last: Discrepancy) -> Discrepancy:
    def at(point: Array) -> Discrepancy:
        share, of_luminance, floor = np.exp(point).tolist()
        return replace(last, share=share, of_luminance=of_luminance, floor_cd_m2=floor)

    def loss(point: Array) -> float:
        covariance = meter + at(point).covariance(xyz)
        squares = np.einsum("ni,ni->", residual, np.linalg.solve(covariance, residual[..., np.newaxis])[..., 0])
        return float(np.linalg.slogdet(covariance)[1].sum() + squares)

    bounds = list(zip(np.log(LOW), np.log(HIGH), strict=True))
    return at(scipy.optimize.minimize(loss, np.log(START), method="L-BFGS-B", bounds=bounds).x)


def discrepancy_of_native(
    native: NativeDisplay | None,
    drawn: Sequence[NativeDisplay],
    readings: Measurements,
    noise: Noise,
    leave_out: Sequence[int] = (),
) -> Discrepancy:
    """What a native display misses of the readings of the first session that it was not made of.

    ``drawn``: the display as the noise of that session might have had it; ``leave_out``: readings that do not count.
    """
    if native is None:
        return NONE
    if native.own is None or native.ladder is None:
        return _of_curves(native, drawn, readings, noise, leave_out)
    sample, held_out = native.ladder.sample, native.ladder.held_out
    seen = sample.fold >= 0
    missed, light = ((sample.share - held_out) * sample.white)[seen], (sample.share * sample.white)[seen]
    return discrepancy_of(missed, light, noise.covariance(light), sample.white)


def _of_curves(
    native: NativeDisplay,
    drawn: Sequence[NativeDisplay],
    readings: Measurements,
    noise: Noise,
    leave_out: Sequence[int],
) -> Discrepancy:
    """What curves of ramps or greys miss of all other colours; none where noise alone would miss as much.

    Where a session has nothing but the levels of these curves, each level is told by a curve through the others.
    """
    here = first_session_rows(readings, leave_out)
    sample = sample_of(readings, here)
    on_curves = native.made_from(readings)[here]
    judged = ~on_curves & ~is_tip(sample.drive).any(axis=1)
    usual = told = added_up(sample, native.curves, sample.drive)
    if len(np.unique(sample.drive[judged], axis=0)) < FEW:
        judged = on_curves & sample.drive.any(axis=1)
        told = _told_by_other_levels(native, readings, [*leave_out], sample, judged)
    code, share = sample.drive[judged], sample.share[judged]
    if len(np.unique(code, axis=0)) < FEW:
        return NONE
    missed, light = (share - told[judged]) * sample.white, share * sample.white
    covariance = noise.covariance(light) + _of_tips(sample, parts_of(native.curves, code), noise)
    if drawn:
        off = np.array([added_up(sample, each.curves, code) - usual[judged] for each in drawn]) * sample.white
        covariance = covariance + np.einsum("kni,knj->nij", off, off) / len(drawn)
    squares = np.einsum("ni,nij,nj->", missed, np.linalg.inv(covariance), missed)
    # Curves of ramps and greys run through these; smooth ones of all readings miss some levels, which others hide.
    if native.source != "readings" and chdtrc(missed.size, squares) >= SIGNIFICANT:
        return NONE
    return discrepancy_of(missed, light, covariance, sample.white)


def _told_by_other_levels(
    native: NativeDisplay, readings: Measurements, leave_out: list[int], sample: Sample, judged: NDArray[np.bool_]
) -> Array:
    """Shares of white (n, 3) of a sample's readings, those that are judged by curves made without their level."""
    here, told = first_session_rows(readings, leave_out), added_up(sample, native.curves, sample.drive)
    for code in np.unique(sample.drive[judged], axis=0):
        level = (sample.drive == code).all(axis=1)
        try:
            others = NativeDisplay.of(readings, [*leave_out, *here[level]], strict=False, source=native.source)
        except LutgenError:  # too few levels are left
            continue
        told[level] = added_up(sample, others.curves, sample.drive[level])
    return told


def _of_tips(sample: Sample, parts: Array, noise: Noise) -> Array:
    """Covariance by the noise of white, primaries and black, of which colours have ``parts`` (m, 5): (m, 3, 3)."""
    light = np.vstack([sample.tips, sample.black]) * sample.white
    counts = [*is_tip(sample.drive).sum(axis=0), (~sample.drive.any(axis=1)).sum()]
    return np.asarray(np.einsum("mk,kij->mij", parts**2 / np.array(counts), noise.covariance(light)))
