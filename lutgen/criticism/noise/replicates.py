"""Replicates: groups of readings that differ by noise only, and their deviations from the mean of their group.

Replicates are readings of one session. If no session has replicates, readings of all sessions of one hour are grouped,
after a correction of the gains and the dark offsets of these sessions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.readings.conditions import OF_COLUMN
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

#: An ordinary good colorimeter, 1 σ: 0.2 % of the light and 0.003 cd/m².
RELATIVE, FLOOR_CD_M2 = 0.002, 0.003

#: Smallest number of contrasts between replicates with which the noise counts as measured.
ENOUGH = 6

#: Number of rounds, each of which estimates the gains and offsets of sessions, and then the means of replicates.
ROUNDS = 20


def replicate_groups(readings: Measurements) -> NDArray[np.intp]:
    """Number of each reading's group; readings of a group differ by noise and scattered conditions only: (n,)."""
    return _numbered([readings.hours, readings.sessions.astype(float), *_patches(readings)])


@dataclass(frozen=True)
class Replicates:
    """Groups of readings that differ by noise only.

    ``groups``: number of each reading's group, (n,). ``deviations``: from the mean of the group, (n, 3), cd/m².
    ``lost``: degrees of freedom, of three values each, spent on gain and offset of the reading's session, (n,).
    """

    groups: NDArray[np.intp]
    deviations: Array
    lost: Array

    @property
    def contrasts(self) -> float:
        """Number of independent contrasts of all groups."""
        return float(np.maximum(np.bincount(self.groups) - 1, 0).sum() - self.lost.sum())

    @classmethod
    def of(cls, readings: Measurements, rows: NDArray[np.intp], *, across_sessions: bool = False) -> Replicates:
        """Group readings, by their indices, within sessions; or within hours, with sessions corrected."""
        xyz = readings.xyz_cd_m2[rows]
        scattered = [values[rows] for name, values in readings.conditions.items() if OF_COLUMN[name].scatters]
        if not across_sessions:
            groups = replicate_groups(readings)[rows]
            return cls(groups, replicate_deviations(xyz, groups, scattered), np.zeros(rows.size))
        groups = _numbered([readings.hours, *_patches(readings)])[rows]
        session = _numbered([readings.hours, readings.sessions.astype(float)])[rows]
        corrected, leverage = _as_one_session(xyz, groups, session)
        _, of_hour = np.unique(readings.hours[rows], return_inverse=True)
        sessions = np.bincount(of_hour[np.unique(session, return_index=True)[1]])[of_hour]
        # S sessions of an hour have S − 1 free gains and offsets: the mean of the sessions is not corrected.
        return cls(groups, replicate_deviations(corrected, groups, scattered), leverage * (sessions - 1) / sessions)


def _as_one_session(xyz: Array, groups: NDArray[np.intp], session: NDArray[np.intp]) -> tuple[Array, Array]:
    """Correct readings for gain and dark offset of their session relative to the other sessions of the hour.

    Return the readings, (n, 3), cd/m², and the leverage of each reading on these gains and offsets, (n,).
    """
    light = group_means(xyz, groups)
    # A group of one reading has no information on the differences of sessions.
    is_replicated = (np.bincount(groups) > 1)[groups][:, np.newaxis]
    weight = is_replicated / (np.abs(light) * RELATIVE + FLOOR_CD_M2) ** 2
    of_gain, of_offset = (np.maximum(_sums(each, session), 1e-300) for each in (weight * light**2, weight))
    corrected = xyz
    for _ in range(ROUNDS):
        deviations = corrected - group_means(corrected, groups)
        # X, Y and Z have a gain each: one gain for all three would absorb more of their common noise than of other
        # noise.
        corrected = corrected - light * (_sums(weight * light * deviations, session) / of_gain)[session]
        deviations = corrected - group_means(corrected, groups)
        corrected = corrected - (_sums(weight * deviations, session) / of_offset)[session]
    return corrected, (weight * light**2 / of_gain[session] + weight / of_offset[session]).mean(axis=1)


def patch_numbers(readings: Measurements) -> NDArray[np.intp]:
    """Number of each reading's patch: readings of one patch have equal conditions, at any hour: (n,)."""
    return _numbered(_patches(readings))


def _patches(readings: Measurements) -> list[Array]:
    """The columns that distinguish patches, (n,) each: code values, conditions, and a capped lens."""
    # All values of a condition that count as rest are one value, although logged minutes, lux or kelvins scatter.
    conditions = [np.nan_to_num(_repeated(readings, name), nan=-1e9, posinf=1e9) for name in readings.conditions]
    return [*readings.drive.T, *conditions, is_capped(readings).astype(float)]


def _numbered(columns: list[Array]) -> NDArray[np.intp]:
    """Number of each distinct row of columns (n,): (n,)."""
    return np.asarray(np.unique(np.column_stack(columns), axis=0, return_inverse=True)[1].reshape(-1))


def _repeated(readings: Measurements, name: str) -> Array:
    """Values of a condition, equal for replicates, (n,)."""
    clusters = OF_COLUMN[name].clusters
    # Logged temperatures rarely agree to the last digit: ``replicate_deviations`` corrects for temperature instead.
    return readings.settled(name) if clusters is None else clusters(readings.above_rest(name))


def replicate_deviations(xyz: Array, groups: NDArray[np.intp], scattered: Sequence[Array]) -> Array:
    """Deviation of readings from the mean of their replicates, (n, 3), cd/m².

    ``scattered``: columns of conditions, (n,) each, whose logged values scatter, such as the temperature. Replicates at
    different values differ by more than noise: for each column the deviations are corrected by a share of the light per
    unit, one for X, Y and Z each, the same for all patches.
    """
    mean = group_means(xyz, groups)
    deviations = xyz - mean
    weight = 1.0 / (np.abs(mean) * RELATIVE + FLOOR_CD_M2) ** 2
    for column in scattered:
        if np.isnan(column).all():
            continue
        values = np.nan_to_num(column, nan=float(np.nanmedian(column)))[:, np.newaxis]
        slope = mean * (values - group_means(values, groups))
        strength = (weight * slope * slope).sum(axis=0)
        if (strength > 0).all():
            deviations = deviations - slope * (weight * slope * deviations).sum(axis=0) / strength
    return np.asarray(deviations)


def group_means(values: Array, groups: NDArray[np.intp]) -> Array:
    """Mean of each reading's group, (n, 3), of values (n, 3)."""
    return np.asarray((_sums(values, groups) / np.maximum(np.bincount(groups), 1)[:, np.newaxis])[groups])


def _sums(values: Array, groups: NDArray[np.intp]) -> Array:
    """Sums of values (n, 3) within groups, (g, 3)."""
    return np.stack([np.bincount(groups, column) for column in values.T], axis=1)
