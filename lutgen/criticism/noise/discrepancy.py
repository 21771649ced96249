"""Model discrepancy: errors of a display's own model at colours to which it was not fitted, besides the meter's noise.

A model of a real display has errors of 20 to 150 σ of a meter. With weights by the meter's noise alone, a fit would
follow the dark readings, and explain errors of the model by effects. The standard deviation of the discrepancy has
three parts: a share of each of X, Y and Z, a share of the luminance in the colour of white, and a floor. X, Y and Z are
correlated, different colours are not (Kennedy & O'Hagan 2001, doi:10.1111/1467-9868.00294, without the correlation
between colours). The share of the luminance is for channels that are not additive: the model's error of Z at yellow may
exceed the Z of yellow. All parameters are estimated by maximum likelihood from readings of the first session, each
predicted by a model that was not fitted to it. So changes over the hours do not count as discrepancy.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used: the first comparison needs few of them
from scipy.special import chdtrc

from lutgen.colorimetry import Array, xyz_to_lab
from lutgen.display.native import NativeDisplay
from lutgen.display.own_model.ladder import MISREAD_LAB
from lutgen.display.own_model.native_curves import FEW, added_up, parts_of
from lutgen.display.own_model.sample import first_session_rows, sample_of
from lutgen.errors import LutgenError, listed
from lutgen.readings.rest import is_tip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.criticism.noise.model import Noise
    from lutgen.display.own_model import OwnModel, Sample
    from lutgen.readings import Measurements

#: Starting values and bounds of the search: both shares, and the floor in cd/m².
START, LOW, HIGH = (0.005, 0.005, 0.01), (1e-6, 1e-6, 1e-6), (0.3, 0.3, 10.0)

#: A share, or a floor in cd/m², that is no larger is at the bound of the search: the sentence leaves it out.
NEGLIGIBLE = 1e-5

#: A reading with a larger Mahalanobis distance from the model is a misreading, and is left out.
MISREAD = 8.0

#: Errors of curves are noise, and no discrepancy, if their probability under noise is at least this.
SIGNIFICANT = 0.01

#: Number of rounds, each of which estimates shares and floor, and then the correlation.
ROUNDS = 3

#: Share of light by which readings differ from any model, to compare their errors before the estimate.
SHARE = 0.005


#: Correlation of independent X, Y and Z.
INDEPENDENT = np.eye(3)


@dataclass(frozen=True)
class Discrepancy:
    """1 σ of the error of a model, without noise.

    Attributes
    ----------
    share
        Share of each of X, Y and Z.
    of_luminance
        Share of Y, in the colour of ``white``.
    floor_cd_m2
        Constant part, cd/m².
    correlation
        Correlation of X, Y and Z, (3, 3).
    white
        XYZ of white, (3,); only the ratios count.
    misread
        Readings with a visible error far beyond noise and discrepancy, which the estimate leaves out: their indices in
        the file.

    """

    share: float = 0.0
    of_luminance: float = 0.0
    floor_cd_m2: float = 0.0
    correlation: Array = field(default_factory=lambda: INDEPENDENT)
    white: Array = field(default_factory=lambda: np.ones(3))
    misread: tuple[int, ...] = ()

    def __bool__(self) -> bool:
        """Whether the discrepancy is above 0."""
        return max(self.share, self.of_luminance, self.floor_cd_m2) > 0

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance (n, 3, 3) at light (n, 3)."""
        of_luminance = self.of_luminance * xyz_cd_m2[:, 1:2] * (self.white / self.white[1])
        sigma = np.sqrt((self.share * xyz_cd_m2) ** 2 + of_luminance**2 + self.floor_cd_m2**2)
        return np.asarray(self.correlation * sigma[:, :, np.newaxis] * sigma[:, np.newaxis, :])

    def sentence(self) -> str:
        """State the size in one sentence."""
        parts = (
            (self.share, f"{100 * self.share:.2g} % of X, Y and Z each"),
            (self.of_luminance, f"{100 * self.of_luminance:.2g} % of the luminance"),
            (self.floor_cd_m2, f"{self.floor_cd_m2:.2g} cd/m² at every light"),
        )
        size = listed(part for value, part in parts if value > NEGLIGIBLE)
        return (
            f"Discrepancy of the display's own model: {size or 'nearly none'}, from readings of the first session that "
            f"it had not seen. Errors are judged against noise and discrepancy."
        )


NONE = Discrepancy()


def discrepancy_of(
    residual: Array, xyz_cd_m2: Array, noise: Array, white: Array, rows: NDArray[np.intp]
) -> Discrepancy:
    """Estimate the discrepancy from residuals (n, 3), cd/m², of a model at light (n, 3) to which it was not fitted.

    ``noise``: covariance of the residuals without a discrepancy, (n, 3, 3); ``white``: XYZ, (3,); ``rows``: indices of
    the readings in the file, (n,).
    """
    meter, discrepancy = noise, Discrepancy(*START, white=white)
    size = np.linalg.norm(residual, axis=1) / (SHARE * np.linalg.norm(xyz_cd_m2, axis=1) + np.sqrt(noise[:, 1, 1]))
    is_used = size <= MISREAD * max(float(np.median(size)), 1.0)
    for _ in range(ROUNDS):
        discrepancy = _most_likely(residual[is_used], xyz_cd_m2[is_used], meter[is_used], discrepancy)
        whole = meter + discrepancy.covariance(xyz_cd_m2)
        is_used = np.einsum("ni,nij,nj->n", residual, np.linalg.inv(whole), residual) < MISREAD**2
        sigma = np.sqrt(np.diagonal(whole, axis1=1, axis2=2))
        discrepancy = replace(discrepancy, correlation=_correlation((residual / sigma)[is_used]))
    lab = xyz_to_lab(xyz_cd_m2, white) - xyz_to_lab(np.maximum(xyz_cd_m2 - residual, 0.0), white)
    misread = rows[~is_used & (np.linalg.norm(lab, axis=1) > MISREAD_LAB)]
    return replace(discrepancy, misread=tuple(misread.tolist()))


def _correlation(residual: Array) -> Array:
    """Correlation of X, Y and Z of residuals (n, 3) with mean 0."""
    moments = residual.T @ residual / len(residual) + 1e-12 * INDEPENDENT
    size = np.sqrt(np.diagonal(moments))
    return np.asarray(moments / np.outer(size, size))


def _most_likely(residual: Array, xyz: Array, meter: Array, last: Discrepancy) -> Discrepancy:
    """Maximum-likelihood shares and floor, given the correlation of ``last``."""

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
    """Estimate the discrepancy of a native display from readings of the first session to which it was not fitted.

    ``drawn``: native displays of simulated first sessions, which differ by noise; ``leave_out``: indices of readings to
    ignore.
    """
    if native is None:
        return NONE
    if native.own is None or native.ladder is None:
        return _of_curves(native, drawn, readings, noise, leave_out)
    sample, held_out = native.ladder.sample, native.ladder.held_out
    in_fold = sample.fold >= 0
    residual, light = ((sample.share - held_out) * sample.white)[in_fold], (sample.share * sample.white)[in_fold]
    rows = first_session_rows(readings, leave_out)[in_fold]
    estimate = discrepancy_of(residual, light, noise.covariance(light), sample.white, rows)
    if not estimate.misread:
        return estimate
    # Where a ramp bends sharply, such as where it is clipped, a curve that is fitted without this level is wrong there,
    # and a curve that is fitted with it is right. Such a reading is not misread.
    misread = {int(rows[place]) for place in np.flatnonzero(_visibly_missed(native.ladder)[in_fold])}
    return replace(estimate, misread=tuple(row for row in estimate.misread if row in misread))


def _visibly_missed(own: OwnModel) -> NDArray[np.bool_]:
    """Whether the own model, fitted to all readings of its sample, misses each of the readings visibly, (n,)."""
    white = own.sample.white
    lab = [xyz_to_lab(share * white, white) for share in (own.sample.share, own(own.sample.drive))]
    return np.asarray(np.linalg.norm(lab[0] - lab[1], axis=1) > MISREAD_LAB)


def _of_curves(
    native: NativeDisplay,
    drawn: Sequence[NativeDisplay],
    readings: Measurements,
    noise: Noise,
    leave_out: Sequence[int],
) -> Discrepancy:
    """Estimate the discrepancy of curves of ramps or greys at all other colours; none if noise explains the errors.

    If a session has only the levels of these curves, each level is predicted by a curve through the other levels.
    """
    here = first_session_rows(readings, leave_out)
    sample = sample_of(readings, here)
    on_curves = native.made_from(readings)[here]
    judged = ~on_curves & ~is_tip(sample.drive).any(axis=1)
    usual = predicted = added_up(sample, native.curves, sample.drive)
    if len(np.unique(sample.drive[judged], axis=0)) < FEW:
        judged = on_curves & sample.drive.any(axis=1)
        predicted = _predicted_by_other_levels(native, readings, [*leave_out], sample, judged)
    code, share = sample.drive[judged], sample.share[judged]
    if len(np.unique(code, axis=0)) < FEW:
        return NONE
    residual, light = (share - predicted[judged]) * sample.white, share * sample.white
    covariance = noise.covariance(light) + _of_tips(sample, parts_of(native.curves, code), noise)
    if drawn:
        deviations = np.array([added_up(sample, each.curves, code) - usual[judged] for each in drawn]) * sample.white
        covariance = covariance + np.einsum("kni,knj->nij", deviations, deviations) / len(drawn)
    squares = np.einsum("ni,nij,nj->", residual, np.linalg.inv(covariance), residual)
    # The test is for curves that run through ramps or greys. Smooth curves of all readings miss single levels; a test
    # over all readings would not find this.
    if native.source != "readings" and chdtrc(residual.size, squares) >= SIGNIFICANT:
        return NONE
    return discrepancy_of(residual, light, covariance, sample.white, here[judged])


def _predicted_by_other_levels(
    native: NativeDisplay, readings: Measurements, leave_out: list[int], sample: Sample, judged: NDArray[np.bool_]
) -> Array:
    """Predicted shares of white (n, 3) of a sample's readings; ``judged`` readings by curves without their level."""
    here, predicted = first_session_rows(readings, leave_out), added_up(sample, native.curves, sample.drive)
    for code in np.unique(sample.drive[judged], axis=0):
        level = (sample.drive == code).all(axis=1)
        try:
            others = NativeDisplay.of(readings, [*leave_out, *here[level]], strict=False, source=native.source)
        except LutgenError:  # too few other levels
            continue
        predicted[level] = added_up(sample, others.curves, sample.drive[level])
    return predicted


def _of_tips(sample: Sample, parts: Array, noise: Noise) -> Array:
    """Covariance (m, 3, 3) by the noise of white, primaries and black, whose shares in colours are ``parts`` (m, 5)."""
    light = np.vstack([sample.tips, sample.black]) * sample.white
    counts = [*is_tip(sample.drive).sum(axis=0), (~sample.drive.any(axis=1)).sum()]
    return np.asarray(np.einsum("mk,kij->mij", parts**2 / np.array(counts), noise.covariance(light)))
