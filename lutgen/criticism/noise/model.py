"""The noise of a reading: a relative part, a floor, shot noise, the last digit, and what its X, Y and Z share.

Covariance of a reading of light M: Σ = C ∘ s sᵀ + D ∘ b bᵀ + diag(q²/12) with s_k² = (a_k·M_k)² + g·|M_k|, C and D the
correlations of X, Y, Z in the bright part and in the floor, and q the step of the last digit. Light that flickers moves
X, Y and Z together; a floor is often each detector's own. Replicates (readings of one session that differ in nothing)
tell a_k, b_k, C and D by maximum likelihood, and g where they ask for it. Few replicates, or none of dark patches,
leave parts of it open; a weak prior then keeps them near an ordinary good colorimeter.

A session's gain, shared by all its readings, cannot be known from one session an hour: the file states it
(``# session_gain: 0.003``), or it is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.noise.covariance import NoisePoints, by_scoring, covariance_of, partials_of
from lutgen.criticism.noise.digits import Digits, digits_of
from lutgen.criticism.noise.replicates import FLOOR_CD_M2, RELATIVE, Replicates, group_means, replicate_groups
from lutgen.readings.instruments import Instrument, session_gain, stated_instrument

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

#: Gain of an ordinary good colorimeter from session to session, 1 σ.
SESSION = 0.003

#: Correlation of X, Y and Z in one reading, where replicates do not tell: between that of simulated colorimeters and
#: the 0.87 to 0.98 of repeated whites of real ones.
CORRELATION = 0.6

#: The same of the floor: between none, where each detector has its own, and that of the bright part.
FLOOR_CORRELATION = 0.3

#: σ of Z over that of Y in real colorimeters: the median of repeated whites of twelve real sessions.
#: The prior lies half way, in powers of e, between that and 1, which simulated colorimeters have.
Z_OVER_Y = 1.74

#: Standard deviations of the weak prior: of sizes and of ratios of X and Z to Y, in powers of e, and of atanh ρ.
PRIOR_SD, RATIO_SD, CORRELATION_SD = 1.3, 0.3, 0.5

#: Step of a parameter for a derivative, in powers of e.
NUDGE = 1e-5

#: Spread of the dark offset, cd/m², and of the gain within a session, of an ordinary colorimeter: assumptions.
OFFSET_CD_M2, WANDER = 0.001, 0.0003

NO_DIGITS = Digits()

#: Contrasts between replicates that are enough to call the noise measured.
ENOUGH = 6

#: Readings of less light may agree to the last digit that an instrument shows.
DARK_CD_M2 = 1.0

#: A replicate further than this many robust sigmas from its fellows is a slip, not noise.
OUTLIER_SIGMA = 12.0


#: Contrasts that the prior counts as, for the bright part and for the floor, whose replicates are few.
PRIOR_CONTRASTS = 2.0, 5.0


@dataclass(frozen=True)
class Noise:
    """Noise of the readings.

    Attributes
    ----------
    relative, floor_cd_m2, session
        1 σ of Y: share of the light; cd/m²; share that a session has in common.
    correlation, floor_correlation
        Of X, Y and Z of one reading, (3, 3): of the part that grows with the light, and of the floor.
    source
        ``replicates``, ``instrument`` (stated) or ``assumed``.
    contrasts
        Independent comparisons between replicates, vectors of three.
    scatter
        Their sum of squares in units of this noise; about 3 × ``contrasts`` when the noise is right.
    outliers
        Rows that replicates show to be wrong, indices of readings.
    copied
        Share of the replicated patches, other than dark ones, whose readings agree to the last digit.
    ratio, floor_ratio
        σ of X, Y, Z over that of Y, of the part that grows with the light and of the floor.
    shot_cd_m2
        Variance of Y per cd/m², which grows with the light, as counted photons have it.
    digits
        How the instrument prints.
    offset_cd_m2, wander
        Spreads that are usual: of the dark offset from session to session, and of the gain within a session.
    instrument
        Name of the instrument that the noise is of, or that it is held near; "" for none.
    known_from
        Contrasts from which the bright part and the floor are known, with what the prior counts; infinite: stated.
    across_sessions
        Whether the replicates lie in different sessions of one hour, whose gains were taken out.

    """

    relative: float
    floor_cd_m2: float
    session: float
    correlation: Array
    source: str
    contrasts: int = 0
    scatter: float = 0.0
    outliers: tuple[int, ...] = ()
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
    instrument: str = ""

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance of readings of light (n, 3): (n, 3, 3)."""
        bright, floor = self._variances(xyz_cd_m2)
        return covariance_of(bright, floor, self.correlation, self.floor_correlation, self.digits.step(xyz_cd_m2))

    def bright_share(self, xyz_cd_m2: Array) -> Array:
        """Share of the variance of readings of light (n, 3) that goes with the light: (n,)."""
        bright, floor = self._variances(xyz_cd_m2)
        return np.asarray(bright.sum(axis=1) / (bright + floor).sum(axis=1))

    def _variances(self, xyz_cd_m2: Array) -> tuple[Array, Array]:
        """Variances of the part that goes with the light (n, 3), and of the floor (3,).

        The inverse of a covariance that was estimated from n contrasts of three numbers is n/(n − 4) too large
        (Muirhead 1982, doi:10.1002/9780470316559, theorem 3.2.12).
        """
        too_small, floor_too_small = (n / max(n - 4.0, 2.0) if np.isfinite(n) else 1.0 for n in self.known_from)
        bright = (self.relative * xyz_cd_m2) ** 2 + self.shot_cd_m2 * np.abs(xyz_cd_m2)
        floor = self.floor_cd_m2 * np.array(self.floor_ratio)
        return too_small * np.array(self.ratio) ** 2 * bright, floor_too_small * floor**2

    def beside_share(self, Y_cd_m2: Array) -> Array:
        """σ of readings of Y (n,) as a share of it, without the part that is the same share of all light: (n,)."""
        return np.asarray(np.sqrt(self.shot_cd_m2 * Y_cd_m2 + self.floor_cd_m2**2) / Y_cd_m2)

    def whitener(self, xyz_cd_m2: Array) -> Array:
        """Matrices (n, 3, 3) that turn residuals of readings into independent ones of variance 1."""
        return np.linalg.inv(np.linalg.cholesky(self.covariance(xyz_cd_m2)))


def _start(stated: Instrument | None, session: float | None) -> Noise:
    """Noise before any reading is seen: that of an instrument, or an ordinary colorimeter's."""
    session = SESSION if session is None else session
    if stated is None:
        return Noise(RELATIVE, FLOOR_CD_M2, session, _matrix(CORRELATION), "assumed")
    ratio, floor_ratio = stated.ratios
    return Noise(
        *(stated.relative[1], stated.floor_cd_m2[1], session, _matrix(CORRELATION), "instrument"),
        ratio=ratio, floor_ratio=floor_ratio, digits=Digits(stated.decimals, stated.significant),
        offset_cd_m2=stated.dark_offset_cd_m2 or OFFSET_CD_M2, wander=stated.gain_wander or WANDER,
        instrument=stated.name,
    )  # fmt: skip


def estimate_noise(readings: Measurements, instrument: str | None = None) -> Noise:
    """Estimate the noise from replicates, or take it as stated, or assume that of a good colorimeter.

    Two numbers are taken as stated; a named instrument is what replicates are shrunk towards.

    Raises
    ------
    LutgenError
        A stated noise that is none.

    """
    stated = stated_instrument(readings.metadata, instrument)
    start = _start(stated, session_gain(readings.metadata, readings.file))
    groups = replicate_groups(readings)
    outliers = _outliers(readings.xyz_cd_m2, groups, (start.relative, start.floor_cd_m2))
    keep = ~np.isin(np.arange(groups.size), outliers)
    rows, across = np.flatnonzero(keep), False
    pooled = _Pooled.of(readings.xyz_cd_m2[rows], Replicates.of(readings, rows))
    if pooled.bright < ENOUGH:
        wider = _Pooled.of(readings.xyz_cd_m2[rows], Replicates.of(readings, rows, across_sessions=True))
        if across := wider.bright >= ENOUGH:
            pooled = wider
    digits = digits_of(readings.xyz_cd_m2)
    noise = replace(start, contrasts=pooled.contrasts, digits=start.digits if digits == NO_DIGITS else digits)
    noise = replace(noise, across_sessions=across)
    if (stated is None or stated.name) and pooled.contrasts >= ENOUGH:
        # Black alone tells the floor, and nothing of how noise grows with the light.
        source = "replicates" if pooled.bright >= ENOUGH else noise.source
        usual = noise if stated else replace(noise, ratio=(1.0, 1.0, Z_OVER_Y**0.5))
        noise = replace(pooled.most_likely(usual), source=source, known_from=pooled.known_from)
        if source != "replicates":
            noise = _no_smaller(noise, usual, floor_told=pooled.contrasts - pooled.bright >= ENOUGH)
    return replace(
        noise,
        scatter=pooled.squares(noise),
        outliers=_confirmed_outliers(readings.xyz_cd_m2, groups, outliers, noise),
        copied=_copied(readings.xyz_cd_m2, groups),
    )


def _no_smaller(noise: Noise, usual: Noise, *, floor_told: bool) -> Noise:
    """Keep noise from being taken for smaller than usual, since a few bright patches happen to agree."""
    floor = noise.floor_cd_m2 if floor_told else max(noise.floor_cd_m2, usual.floor_cd_m2)
    return replace(noise, relative=max(noise.relative, usual.relative), floor_cd_m2=floor)


def _confirmed_outliers(
    xyz: Array, groups: NDArray[np.intp], outliers: tuple[int, ...], noise: Noise
) -> tuple[int, ...]:
    """Those of the suspected outliers that stand far off in units of the noise that the others have."""
    found = []
    for row in outliers:
        middle = np.median(xyz[groups == groups[row]], axis=0)
        off = noise.whitener(middle[np.newaxis])[0] @ (xyz[row] - middle)
        if float(off @ off) > (OUTLIER_SIGMA / 2) ** 2:
            found.append(row)
    return tuple(found)


def _matrix(correlation: float) -> Array:
    return np.full((3, 3), correlation) + (1.0 - correlation) * np.eye(3)


def _copied(xyz: Array, groups: NDArray[np.intp]) -> float:
    """Share of groups of replicates, but for dark ones, that agree to the last digit."""
    alike = [
        bool((xyz[here] == xyz[here[0]]).all())
        for group in np.flatnonzero(np.bincount(groups) > 1)
        if xyz[here := np.flatnonzero(groups == group), 1].mean() > DARK_CD_M2
    ]
    return float(np.mean(alike)) if alike else 0.0


@dataclass(frozen=True)
class _Pooled:
    """Groups of replicates: mean (g, 3), scatter matrix (g, 3, 3) and degrees of freedom (g,)."""

    mean: Array
    scatter: Array
    freedom: Array

    @classmethod
    def of(cls, xyz: Array, replicates: Replicates) -> _Pooled:
        off = replicates.deviations
        _, first, groups, counts = np.unique(
            replicates.groups, return_index=True, return_inverse=True, return_counts=True
        )
        groups = groups.reshape(-1)
        mean = group_means(xyz, groups)[first]
        scatter = np.zeros((counts.size, 3, 3))
        np.add.at(scatter, groups, off[:, :, np.newaxis] * off[:, np.newaxis, :])
        more = counts > 1
        freedom = np.asarray(counts - 1 - np.bincount(groups, replicates.lost), dtype=np.float64)
        return cls(mean[more], scatter[more], np.maximum(freedom[more], 0.0))

    @property
    def contrasts(self) -> int:
        return int(self.freedom.sum())

    @property
    def bright(self) -> int:
        """Contrasts of patches at which an ordinary colorimeter's noise goes with the light."""
        return int(self.freedom[self.mean[:, 1] > FLOOR_CD_M2 / RELATIVE].sum())

    @property
    def known_from(self) -> tuple[float, float]:
        """Contrasts of bright patches and of dark ones, to which the prior adds."""
        return self.bright + PRIOR_CONTRASTS[0], self.contrasts - self.bright + PRIOR_CONTRASTS[1]

    def squares(self, noise: Noise) -> float:
        if not self.contrasts:
            return 0.0
        return float((np.linalg.inv(noise.covariance(self.mean)) * self.scatter).sum())

    def most_likely(self, start: Noise) -> Noise:
        """Return the noise of largest posterior; with shot noise where that gains more than a parameter is worth.

        Sizes, ratios and partial correlations are free in logarithms and atanh, so that every point is a covariance.
        """
        best, without = self._minimised(start, shot=False)
        with_shot, gained = self._minimised(start, shot=True)
        return with_shot if without - gained > np.log(3.0 * self.contrasts) else best

    def _minimised(self, start: Noise, *, shot: bool) -> tuple[Noise, float]:
        middle = np.array(
            [
                *np.log([start.relative, start.floor_cd_m2, *start.ratio[::2], *start.floor_ratio[::2]]),
                *partials_of(CORRELATION),
                *partials_of(FLOOR_CORRELATION),
                -8.0,
            ]
        )
        spread = np.array([PRIOR_SD] * 2 + [RATIO_SD] * 4 + [CORRELATION_SD] * 6 + [4.0])
        low = np.array([np.log(1e-6)] * 2 + [-2.0] * 4 + [-0.5] * 6 + [-16.0])
        high = np.array([np.log(0.3), np.log(10.0)] + [2.0] * 4 + [3.2] * 6 + [0.0])
        free = slice(None) if shot else slice(None, -1)
        middle, spread, low, high = middle[free], spread[free], low[free], high[free]

        rounding = start.digits.step(self.mean)

        def loss(point: Array) -> tuple[float, Array, Array]:
            nudged = point + NUDGE * np.eye(point.size)
            sigma, *moved = NoisePoints.at(np.vstack([point, nudged]), shot=shot).covariances(self.mean, rounding)
            inverse = np.linalg.inv(sigma)
            misfit = (self.freedom * np.linalg.slogdet(sigma)[1]).sum() + (inverse * self.scatter).sum()
            off = (point - middle) / spread
            by_sigma = self.freedom[:, np.newaxis, np.newaxis] * inverse - inverse @ self.scatter @ inverse
            change = (np.array(moved) - sigma) / NUDGE
            slope = np.einsum("nij,pnij->p", by_sigma, change)
            whitened = inverse @ change
            curvature = np.einsum("n,pnij,qnji->pq", self.freedom, whitened, whitened)
            return (
                float(misfit + (off**2).sum()),
                slope + 2.0 * off / spread,
                curvature + np.diag(2.0 / spread**2),
            )

        point, least = by_scoring(loss, middle, low, high)
        return replace(start, **NoisePoints.at(point[np.newaxis], shot=shot).first()), least


def _outliers(xyz: Array, groups: NDArray[np.intp], start: tuple[float, float]) -> tuple[int, ...]:
    """Replicates that stand alone, in groups of three or more: further from the others' median than noise goes."""
    found: list[int] = []
    deviations, rows = [], []
    for group in np.flatnonzero(np.bincount(groups) >= 3):
        here = np.flatnonzero(groups == group)
        middle = np.median(xyz[here], axis=0)
        sigma = np.sqrt((start[0] * middle) ** 2 + start[1] ** 2)
        deviations.append(np.abs((xyz[here] - middle) / sigma).max(axis=1))
        rows.append(here)
    if not rows:
        return ()
    # The scale comes from the data: the median over groups of their second largest deviation, untouched by a slip.
    usual = max(float(np.median([np.sort(each)[-2] for each in deviations])), 0.05)
    for each, here in zip(deviations, rows, strict=True):
        order = np.argsort(each)
        if each[order[-1]] > OUTLIER_SIGMA * max(usual, each[order[-2]]):
            found.append(int(here[order[-1]]))
    return tuple(found)
