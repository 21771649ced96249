"""The noise of one reading: a relative part, a floor, shot noise, the last digit, and the correlation of X, Y and Z.

Covariance of a reading of light M: Σ = C ∘ s sᵀ + D ∘ b bᵀ + diag(q²/12) with s_k² = (a_k·M_k)² + g·|M_k|, C and D the
correlations of X, Y, Z in the bright part and in the floor, and q the step of the last digit. Flicker moves X, Y and Z
together; the floor is often independent in each detector. a_k, b_k, C and D are estimated by maximum likelihood from
replicates (readings of one session under equal conditions), and g if the likelihood requires it. If there are few
replicates, or no replicates of dark patches, they do not determine all parameters; a weak prior keeps these near an
ordinary good colorimeter.

The gain of a session, which all its readings share, cannot be estimated from one session an hour: the file states its
σ (``# session_gain: 0.003``), or a default is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.noise.covariance import NoisePoints, by_scoring, covariance_of, partials_of
from lutgen.criticism.noise.digits import Digits, digits_of
from lutgen.criticism.noise.replicates import (
    ENOUGH,
    FLOOR_CD_M2,
    RELATIVE,
    Replicates,
    group_means,
    replicate_groups,
)
from lutgen.criticism.noise.wrong_replicates import OUTLIER_SIGMA, unlike_other_hours, wrong_replicates
from lutgen.readings.instruments import Instrument, session_gain, stated_instrument

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

#: Gain of an ordinary good colorimeter from session to session, 1 σ.
SESSION = 0.003

#: Default correlation of X, Y and Z in one reading: between simulated colorimeters and the 0.87 to 0.98 of repeated
#: whites of real colorimeters.
CORRELATION = 0.6

#: Default correlation in the floor: between 0, of independent detectors, and the correlation of the bright part.
FLOOR_CORRELATION = 0.3

#: Ratio of σ of Z to σ of Y in real colorimeters: the median of repeated whites of twelve real sessions.
#: The prior is the geometric mean of this and of 1, the ratio of simulated colorimeters.
Z_OVER_Y = 1.74

#: Standard deviations of the weak prior: log of sizes, log of ratios of X and Z to Y, atanh of correlations.
PRIOR_SD, RATIO_SD, CORRELATION_SD = 1.3, 0.3, 0.5

#: Step of a parameter, a logarithm or atanh, for a numerical derivative.
NUDGE = 1e-5

#: Assumed standard deviation of an ordinary colorimeter's dark offset, cd/m², and of its gain drift within a session.
OFFSET_CD_M2, WANDER = 0.001, 0.0003

NO_DIGITS = Digits()

#: Readings of less light may agree to the last printed digit by chance.
DARK_CD_M2 = 1.0

#: Number of contrasts to which the prior is equivalent: for the bright part, and for the floor with its few replicates.
PRIOR_CONTRASTS = 2.0, 5.0


@dataclass(frozen=True)
class Noise:
    """Noise of the readings.

    Attributes
    ----------
    relative, floor_cd_m2, session
        1 σ of Y: share of the light; floor, cd/m²; gain of a session, a share that all its readings have in common.
    correlation, floor_correlation
        Correlations of X, Y and Z of one reading, (3, 3): of the part that grows with the light, and of the floor.
    source
        ``replicates``, ``instrument`` (stated) or ``assumed``.
    contrasts
        Number of independent contrasts between replicates, vectors of three.
    scatter
        Sum of squares of the contrasts in units of this noise; about 3 × ``contrasts`` if the noise is right.
    outliers
        Indices of the readings that replicates show to be wrong.
    contradictory
        Indices of pairs of replicates that contradict each other; it is unknown which replicate of a pair is wrong.
    copied
        Share of the replicated patches, other than dark ones, whose readings agree to the last digit.
    ratio, floor_ratio
        Ratio of σ of X, Y, Z to σ of Y, of the part that grows with the light and of the floor.
    shot_cd_m2
        Shot noise: variance of Y per cd/m².
    digits
        Printed digits of the instrument.
    offset_cd_m2, wander
        Usual standard deviations: of the dark offset between sessions, and of the gain drift within a session.
    states_offset
        Whether the instrument states its dark offset, which is then taken as it is.
    instrument
        Name of the instrument whose noise this is, or is the prior; "" for none.
    known_from
        Effective number of contrasts, the prior's included, for the bright part and for the floor; infinite: stated.
    across_sessions
        Whether replicates are compared across the sessions of one hour, after a correction of gains and offsets.

    """

    relative: float
    floor_cd_m2: float
    session: float
    correlation: Array
    source: str
    contrasts: int = 0
    scatter: float = 0.0
    outliers: tuple[int, ...] = ()
    contradictory: tuple[int, ...] = ()
    copied: float = 0.0
    ratio: tuple[float, float, float] = (1.0, 1.0, 1.0)
    floor_ratio: tuple[float, float, float] = (1.0, 1.0, 1.0)
    shot_cd_m2: float = 0.0
    digits: Digits = NO_DIGITS
    known_from: tuple[float, float] = (np.inf, np.inf)
    across_sessions: bool = False
    floor_correlation: Array = field(default_factory=lambda: _matrix(FLOOR_CORRELATION))
    offset_cd_m2: float = OFFSET_CD_M2
    wander: float = WANDER
    states_offset: bool = False
    instrument: str = ""

    @property
    def dark_offset(self) -> Array:
        """Lower triangle (3, 3): X, Y and Z of three independent dark offsets of a session, 1 cd/m² (1 σ) in Y.

        The detectors of a meter have offsets and noise; the same matrix makes X, Y and Z from both.
        """
        return np.asarray(np.array(self.ratio)[:, np.newaxis] * np.linalg.cholesky(self.correlation))

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance (n, 3, 3) of readings of light (n, 3)."""
        bright, floor = self._variances(xyz_cd_m2)
        return covariance_of(bright, floor, self.correlation, self.floor_correlation, self.digits.step(xyz_cd_m2))

    def bright_share(self, xyz_cd_m2: Array) -> Array:
        """Share of the variance of readings of light (n, 3) in the part that grows with the light: (n,)."""
        bright, floor = self._variances(xyz_cd_m2)
        return np.asarray(bright.sum(axis=1) / (bright + floor).sum(axis=1))

    def _variances(self, xyz_cd_m2: Array) -> tuple[Array, Array]:
        """Variances of the part that grows with the light (n, 3), and of the floor (3,).

        The inverse of a covariance estimated from n contrasts of three numbers is too large by n/(n − 4) on average
        (Muirhead 1982, doi:10.1002/9780470316559, theorem 3.2.12).
        """
        factor, floor_factor = (n / max(n - 4.0, 2.0) if np.isfinite(n) else 1.0 for n in self.known_from)
        bright = (self.relative * xyz_cd_m2) ** 2 + self.shot_cd_m2 * np.abs(xyz_cd_m2)
        floor = self.floor_cd_m2 * np.array(self.floor_ratio)
        return factor * np.array(self.ratio) ** 2 * bright, floor_factor * floor**2

    def beside_share(self, Y_cd_m2: Array) -> Array:
        """Relative σ of readings of Y (n,) by shot noise and floor, without the relative part: (n,)."""
        return np.asarray(np.sqrt(self.shot_cd_m2 * Y_cd_m2 + self.floor_cd_m2**2) / Y_cd_m2)

    def whitener(self, xyz_cd_m2: Array) -> Array:
        """Matrices (n, 3, 3) that whiten residuals of readings of light (n, 3)."""
        return np.linalg.inv(np.linalg.cholesky(self.covariance(xyz_cd_m2)))


def _start(stated: Instrument | None, session: float | None) -> Noise:
    """Noise before any replicate is used: of the stated instrument, or of an ordinary colorimeter."""
    session = SESSION if session is None else session
    if stated is None:
        return Noise(RELATIVE, FLOOR_CD_M2, session, _matrix(CORRELATION), "assumed")
    ratio, floor_ratio = stated.ratios
    return Noise(
        *(stated.relative[1], stated.floor_cd_m2[1], session, _matrix(CORRELATION), "instrument"),
        ratio=ratio, floor_ratio=floor_ratio, digits=Digits(stated.decimals, stated.significant),
        offset_cd_m2=stated.dark_offset_cd_m2 or OFFSET_CD_M2, wander=stated.gain_wander or WANDER,
        states_offset=stated.dark_offset_cd_m2 is not None, instrument=stated.name,
    )  # fmt: skip


def estimate_noise(readings: Measurements, instrument: str | None = None) -> Noise:
    """Estimate the noise from replicates, or take the stated noise, or assume that of a good colorimeter.

    Two stated numbers are used as they are; a named instrument is the prior of the estimate from replicates.

    Raises
    ------
    LutgenError
        Invalid stated noise.

    """
    stated = stated_instrument(readings.metadata, instrument)
    start = _start(stated, session_gain(readings.metadata, readings.file))
    groups = replicate_groups(readings)
    digits = digits_of(readings.xyz_cd_m2)
    digits = start.digits if digits == NO_DIGITS else digits
    sizes = start.relative, start.floor_cd_m2
    outliers, contradictory = wrong_replicates(readings.xyz_cd_m2, groups, sizes, digits)
    outliers += unlike_other_hours(readings, contradictory) if contradictory else ()
    keep = ~np.isin(np.arange(groups.size), [*outliers, *contradictory])
    rows, across = np.flatnonzero(keep), False
    pooled = _Pooled.of(readings.xyz_cd_m2[rows], Replicates.of(readings, rows))
    if pooled.bright < ENOUGH:
        pooled_across = _Pooled.of(readings.xyz_cd_m2[rows], Replicates.of(readings, rows, across_sessions=True))
        if across := pooled_across.bright >= ENOUGH:
            pooled = pooled_across
    noise = replace(start, contrasts=pooled.contrasts, digits=digits, across_sessions=across)
    if (stated is None or stated.name) and pooled.contrasts >= ENOUGH:
        # Replicates of black alone determine the floor only, not the part that grows with the light.
        source = "replicates" if pooled.bright >= ENOUGH else noise.source
        usual = noise if stated else replace(noise, ratio=(1.0, 1.0, Z_OVER_Y**0.5))
        noise = replace(pooled.most_likely(usual), source=source, known_from=pooled.known_from)
        if source != "replicates":
            noise = _no_smaller(noise, usual, floor_measured=pooled.contrasts - pooled.bright >= ENOUGH)
    return replace(
        noise,
        scatter=pooled.squares(noise),
        outliers=_confirmed_outliers(readings.xyz_cd_m2, groups, outliers, noise),
        contradictory=contradictory,
        copied=_copied(readings.xyz_cd_m2, groups),
    )


def _no_smaller(noise: Noise, usual: Noise, *, floor_measured: bool) -> Noise:
    """Return the noise, but not smaller than ``usual``: a few bright patches may agree by chance."""
    floor = noise.floor_cd_m2 if floor_measured else max(noise.floor_cd_m2, usual.floor_cd_m2)
    return replace(noise, relative=max(noise.relative, usual.relative), floor_cd_m2=floor)


def _confirmed_outliers(
    xyz: Array, groups: NDArray[np.intp], outliers: tuple[int, ...], noise: Noise
) -> tuple[int, ...]:
    """Suspected outliers that are far from the median in units of the noise, estimated without the outliers."""
    confirmed = []
    for row in outliers:
        here = groups == groups[row]
        here[row] = False
        middle = np.median(xyz[here], axis=0)
        deviation = noise.whitener(middle[np.newaxis])[0] @ (xyz[row] - middle)
        if float(deviation @ deviation) > (OUTLIER_SIGMA / 2) ** 2:
            confirmed.append(row)
    return tuple(confirmed)


def _matrix(correlation: float) -> Array:
    """Correlation matrix (3, 3) with equal correlations."""
    return np.full((3, 3), correlation) + (1.0 - correlation) * np.eye(3)


def _copied(xyz: Array, groups: NDArray[np.intp]) -> float:
    """Share of groups of replicates, other than dark ones, that agree to the last digit."""
    agree = [
        bool((xyz[here] == xyz[here[0]]).all())
        for group in np.flatnonzero(np.bincount(groups) > 1)
        if xyz[here := np.flatnonzero(groups == group), 1].mean() > DARK_CD_M2
    ]
    return float(np.mean(agree)) if agree else 0.0


@dataclass(frozen=True)
class _Pooled:
    """Groups of replicates: mean (g, 3), scatter matrix (g, 3, 3) and degrees of freedom (g,)."""

    mean: Array
    scatter: Array
    freedom: Array

    @classmethod
    def of(cls, xyz: Array, replicates: Replicates) -> _Pooled:
        deviations = replicates.deviations
        _, first, groups, counts = np.unique(
            replicates.groups, return_index=True, return_inverse=True, return_counts=True
        )
        groups = groups.reshape(-1)
        mean = group_means(xyz, groups)[first]
        scatter = np.zeros((counts.size, 3, 3))
        np.add.at(scatter, groups, deviations[:, :, np.newaxis] * deviations[:, np.newaxis, :])
        replicated = counts > 1
        freedom = np.asarray(counts - 1 - np.bincount(groups, replicates.lost), dtype=np.float64)
        return cls(mean[replicated], scatter[replicated], np.maximum(freedom[replicated], 0.0))

    @property
    def contrasts(self) -> int:
        return int(self.freedom.sum())

    @property
    def bright(self) -> int:
        """Number of contrasts of patches at which the relative part dominates an ordinary colorimeter's noise."""
        return int(self.freedom[self.mean[:, 1] > FLOOR_CD_M2 / RELATIVE].sum())

    @property
    def known_from(self) -> tuple[float, float]:
        """Effective number of contrasts of bright patches and of dark ones, the prior's included."""
        return self.bright + PRIOR_CONTRASTS[0], self.contrasts - self.bright + PRIOR_CONTRASTS[1]

    def squares(self, noise: Noise) -> float:
        """Sum of squares of the contrasts in units of a noise."""
        if not self.contrasts:
            return 0.0
        return float((np.linalg.inv(noise.covariance(self.mean)) * self.scatter).sum())

    def most_likely(self, start: Noise) -> Noise:
        """Return the noise of largest posterior; with shot noise if that gains more than BIC's penalty of a parameter.

        The search uses logarithms of sizes and ratios and atanh of partial correlations: every point is a covariance.
        """
        without_shot, without_loss = self._minimised(start, shot=False)
        with_shot, with_shot_loss = self._minimised(start, shot=True)
        return with_shot if without_loss - with_shot_loss > np.log(3.0 * self.contrasts) else without_shot

    def _minimised(self, start: Noise, *, shot: bool) -> tuple[Noise, float]:
        """Noise of largest posterior, and −2 log of that posterior up to a constant."""
        mean = np.array(
            [
                *np.log([start.relative, start.floor_cd_m2, *start.ratio[::2], *start.floor_ratio[::2]]),
                *partials_of(CORRELATION),
                *partials_of(FLOOR_CORRELATION),
                -8.0,
            ]
        )
        sd = np.array([PRIOR_SD] * 2 + [RATIO_SD] * 4 + [CORRELATION_SD] * 6 + [4.0])
        low = np.array([np.log(1e-6)] * 2 + [-2.0] * 4 + [-0.5] * 6 + [-16.0])
        high = np.array([np.log(0.3), np.log(10.0)] + [2.0] * 4 + [3.2] * 6 + [0.0])
        free = slice(None) if shot else slice(None, -1)
        mean, sd, low, high = mean[free], sd[free], low[free], high[free]

        rounding = start.digits.step(self.mean)

        def loss(point: Array) -> tuple[float, Array, Array]:
            nudged = point + NUDGE * np.eye(point.size)
            sigma, *nudged_sigma = NoisePoints.at(np.vstack([point, nudged]), shot=shot).covariances(
                self.mean, rounding
            )
            inverse = np.linalg.inv(sigma)
            misfit = (self.freedom * np.linalg.slogdet(sigma)[1]).sum() + (inverse * self.scatter).sum()
            off = (point - mean) / sd
            by_sigma = self.freedom[:, np.newaxis, np.newaxis] * inverse - inverse @ self.scatter @ inverse
            change = (np.array(nudged_sigma) - sigma) / NUDGE
            gradient = np.einsum("nij,pnij->p", by_sigma, change)
            whitened = inverse @ change
            hessian = np.einsum("n,pnij,qnji->pq", self.freedom, whitened, whitened)
            return (
                float(misfit + (off**2).sum()),
                gradient + 2.0 * off / sd,
                hessian + np.diag(2.0 / sd**2),
            )

        point, loss_at_point = by_scoring(loss, mean, low, high)
        return replace(start, **NoisePoints.at(point[np.newaxis], shot=shot).first()), loss_at_point
