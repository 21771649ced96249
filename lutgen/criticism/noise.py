"""The noise of a reading: a relative part, a floor, and what X, Y and Z of one reading share.

Covariance of a reading of light M: Σ = C ∘ s sᵀ with s_k² = (a·M_k)² + b² and C the correlation of X, Y, Z. Replicates
(readings of one session that differ in nothing) tell a, b and C by maximum likelihood. Few replicates, or none of dark
patches, leave parts of it open; a weak prior then keeps them near an ordinary good colorimeter.

A session's gain, shared by all its readings, cannot be known from one session an hour: the file states it
(``# session_gain: 0.003``), or it is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from lutgen.measurements.conditions.temperature import FEW_KELVINS
from lutgen.measurements.table import is_capped

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.measurements import Measurements

#: An ordinary good colorimeter: 0.2 % of the light, 0.003 cd/m², and 0.3 % from session to session (criticism.md).
RELATIVE, FLOOR_CD_M2, SESSION = 0.002, 0.003, 0.003

#: Correlation of X, Y and Z in one reading (criticism.md: about 0.6), where replicates do not tell.
CORRELATION = 0.6

#: One standard deviation of the weak prior, in powers of e: a factor of about 4 either way.
PRIOR_SD = 1.4

#: Contrasts between replicates that are enough to call the noise measured.
ENOUGH = 6

#: Readings of less light may agree to the last digit that an instrument shows.
DARK_CD_M2 = 1.0

#: A replicate further than this many robust sigmas from its fellows is a slip, not noise.
SLIP = 12.0


@dataclass(frozen=True)
class Noise:
    """Noise of the readings.

    Attributes
    ----------
    relative, floor_cd_m2, session
        1 σ: share of the light; cd/m²; share that a session has in common.
    correlation
        Of X, Y and Z of one reading, (3, 3).
    source
        ``replicates``, ``instrument`` (stated) or ``assumed``.
    contrasts
        Independent comparisons between replicates, vectors of three.
    scatter
        Their sum of squares in units of this noise; about 3 × ``contrasts`` when the noise is right.
    slips
        Rows that replicates show to be wrong, indices of readings.
    copied
        Share of the replicated patches, other than dark ones, whose readings agree to the last digit.

    """

    relative: float
    floor_cd_m2: float
    session: float
    correlation: Array
    source: str
    contrasts: int = 0
    scatter: float = 0.0
    slips: tuple[int, ...] = ()
    copied: float = 0.0

    def covariance(self, xyz_cd_m2: Array) -> Array:
        """Covariance of readings of light (n, 3): (n, 3, 3)."""
        sigma = np.sqrt((self.relative * xyz_cd_m2) ** 2 + self.floor_cd_m2**2)
        return np.asarray(self.correlation * sigma[:, :, np.newaxis] * sigma[:, np.newaxis, :])

    def whitener(self, xyz_cd_m2: Array) -> Array:
        """Matrices (n, 3, 3) that turn residuals of readings into independent ones of variance 1."""
        return np.linalg.inv(np.linalg.cholesky(self.covariance(xyz_cd_m2)))


def replicate_groups(readings: Measurements) -> NDArray[np.intp]:
    """Number the groups of readings that differ in nothing but noise, and in temperature by a few kelvins: (n,)."""
    conditions = {name: np.nan_to_num(values, nan=-1e9) for name, values in readings.conditions.items()}
    if "temperature_c" in conditions:
        # A logged temperature hardly ever repeats to the digit; what it does is taken out of the scatter instead.
        conditions["temperature_c"] = np.nan_to_num(np.round(readings.warmer() / (2 * FEW_KELVINS)), nan=-1e9)
    columns = [readings.hours, *readings.drive.T, *conditions.values()]
    sessions = np.unique(np.array(readings.session or [""] * readings.hours.size), return_inverse=True)[1]
    columns += [sessions.astype(float), is_capped(readings).astype(float)]
    return np.asarray(np.unique(np.column_stack(columns), axis=0, return_inverse=True)[1].reshape(-1))


def replicate_deviations(xyz: Array, groups: NDArray[np.intp], temperature: Array | None) -> Array:
    """Deviation of readings from the mean of their replicates, (n, 3), cd/m².

    Replicates that were read at different temperatures differ by more than noise: a common share of their light per
    kelvin, one for X, Y and Z each, is taken out.
    """
    mean = _group_means(xyz, groups)
    off = xyz - mean
    if temperature is None or np.isnan(temperature).all():
        return off
    warmer = np.nan_to_num(temperature, nan=float(np.nanmedian(temperature)))[:, np.newaxis]
    slope = mean * (warmer - _group_means(warmer, groups))
    weight = 1.0 / (np.abs(mean) * RELATIVE + FLOOR_CD_M2) ** 2
    strength = (weight * slope * slope).sum(axis=0)
    if (strength <= 0).any():
        return off
    return np.asarray(off - slope * (weight * slope * off).sum(axis=0) / strength)


def _group_means(values: Array, groups: NDArray[np.intp]) -> Array:
    count = np.bincount(groups)
    sums = np.stack([np.bincount(groups, column) for column in values.T], axis=1)
    return np.asarray((sums / np.maximum(count, 1)[:, np.newaxis])[groups])


def stated_noise(readings: Measurements, instrument: str | None) -> tuple[float, float] | None:
    """Return (relative, floor) of ``--instrument RELATIVE,FLOOR``, or of the file's metadata, when one states it.

    Raises
    ------
    LutgenError
        Not two numbers above 0.

    """
    if instrument is None:
        metadata = readings.metadata
        if not {"noise_relative", "noise_floor_cd_m2"} <= set(metadata):
            return None
        instrument = f"{metadata['noise_relative']},{metadata['noise_floor_cd_m2']}"
    try:
        relative, floor = (float(part) for part in instrument.split(","))
    except ValueError:
        relative = floor = np.nan
    if not (0 < relative < 1 and 0 < floor < 100):
        message = (
            f"instrument noise {instrument!r}: give two numbers above 0, the relative noise and the floor in cd/m², "
            f"such as 0.002,0.003."
        )
        raise LutgenError(message)
    return relative, floor


def session_gain(readings: Measurements) -> tuple[float, bool]:
    """Return the 1 σ gain of a session and whether the file states it (``# session_gain:``)."""
    text = readings.metadata.get("session_gain", "")
    if not text:
        return SESSION, False
    try:
        gain = float(text)
    except ValueError:
        gain = np.nan
    if not 0 <= gain < 0.5:
        message = f"{readings.file}: session_gain is {text!r}; it is the 1 σ gain of a session, 0..0.5, such as 0.003."
        raise LutgenError(message)
    return gain, True


def estimate_noise(readings: Measurements, instrument: str | None = None) -> Noise:
    """Estimate the noise from replicates, or take it as stated, or assume that of a good colorimeter.

    Raises
    ------
    LutgenError
        A stated noise that is none.

    """
    stated, (session, _) = stated_noise(readings, instrument), session_gain(readings)
    groups = replicate_groups(readings)
    start = stated or (RELATIVE, FLOOR_CD_M2)
    slips = _slips(readings.xyz_cd_m2, groups, start)
    keep = ~np.isin(np.arange(groups.size), slips)
    temperature = readings.conditions.get("temperature_c")
    warm = None if temperature is None else temperature[keep]
    pooled = _Pooled.of(readings.xyz_cd_m2[keep], groups[keep], warm)
    relative, floor, correlation = start[0], start[1], CORRELATION
    source = "instrument" if stated else "assumed"
    if stated is None and pooled.contrasts >= ENOUGH:
        source = "replicates"
        relative, floor, correlation = pooled.most_likely()
    noise = Noise(relative, floor, session, _matrix(correlation), source, pooled.contrasts)
    return replace(noise, scatter=pooled.squares(noise), slips=slips, copied=_copied(readings.xyz_cd_m2, groups))


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
    def of(cls, xyz: Array, groups: NDArray[np.intp], temperature: Array | None) -> _Pooled:
        off = replicate_deviations(xyz, groups, temperature)
        _, first, groups, counts = np.unique(groups, return_index=True, return_inverse=True, return_counts=True)
        groups = groups.reshape(-1)
        mean = _group_means(xyz, groups)[first]
        scatter = np.zeros((counts.size, 3, 3))
        np.add.at(scatter, groups, off[:, :, np.newaxis] * off[:, np.newaxis, :])
        more = counts > 1
        return cls(mean[more], scatter[more], np.asarray(counts[more] - 1, dtype=np.float64))

    @property
    def contrasts(self) -> int:
        return int(self.freedom.sum())

    def squares(self, noise: Noise) -> float:
        if not self.contrasts:
            return 0.0
        return float((np.linalg.inv(noise.covariance(self.mean)) * self.scatter).sum())

    def most_likely(self) -> tuple[float, float, float]:
        """Relative noise, floor and correlation of largest posterior."""
        from scipy.optimize import minimize

        def loss(point: Array) -> float:
            relative, floor, correlation = np.exp(point[0]), np.exp(point[1]), np.tanh(point[2])
            sigma = Noise(relative, floor, 0.0, _matrix(0.999 * correlation), "").covariance(self.mean)
            _, logdet = np.linalg.slogdet(sigma)
            misfit = (self.freedom * logdet).sum() + (np.linalg.inv(sigma) * self.scatter).sum()
            prior = ((point - start) / np.array([PRIOR_SD, PRIOR_SD, 0.5])) ** 2
            return float(misfit + prior.sum())

        # The correlation of three equally correlated numbers cannot fall below -1/2.
        start = np.array([np.log(RELATIVE), np.log(FLOOR_CD_M2), np.arctanh(CORRELATION)])
        bounds = [(np.log(1e-6), np.log(0.3)), (np.log(1e-6), np.log(10.0)), (np.arctanh(-0.45), np.arctanh(0.99))]
        found = minimize(loss, start, method="L-BFGS-B", bounds=bounds)
        relative, floor = np.exp(found.x[:2])
        return float(relative), float(floor), float(0.999 * np.tanh(found.x[2]))


def _slips(xyz: Array, groups: NDArray[np.intp], start: tuple[float, float]) -> tuple[int, ...]:
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
        if each[order[-1]] > SLIP * max(usual, each[order[-2]]):
            found.append(int(here[order[-1]]))
    return tuple(found)
