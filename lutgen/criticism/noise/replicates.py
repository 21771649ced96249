"""Replicates: readings that differ in nothing but noise, grouped, and how far each lies from the mean of its group.

They are readings of one session; where sessions repeat nothing, those of all sessions of one hour, but for the gains
and the dark offsets by which sessions differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.readings.conditions.temperature import FEW_KELVINS
from lutgen.readings.table import is_capped

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

#: An ordinary good colorimeter, 1 σ: 0.2 % of the light and 0.003 cd/m².
RELATIVE, FLOOR_CD_M2 = 0.002, 0.003

#: Rounds in which gains and offsets of sessions and means of replicates are found in turn.
ROUNDS = 20


def replicate_groups(readings: Measurements) -> NDArray[np.intp]:
    """Number the groups of readings that differ in nothing but noise, and in temperature by a few kelvins: (n,)."""
    return _numbered([readings.hours, readings.sessions.astype(float), *_patches(readings)])


@dataclass(frozen=True)
class Replicates:
    """Readings that differ in nothing but noise.

    ``groups``: number of each reading's group, (n,). ``deviations``: from the mean of the group, (n, 3), cd/m².
    ``lost``: share of a contrast between replicates that went into gain and offset of the reading's session, (n,).
    """

    groups: NDArray[np.intp]
    deviations: Array
    lost: Array

    @property
    def contrasts(self) -> float:
        """Independent contrasts of all groups."""
        return float(np.maximum(np.bincount(self.groups) - 1, 0).sum() - self.lost.sum())

    @classmethod
    def of(cls, readings: Measurements, rows: NDArray[np.intp], *, across_sessions: bool = False) -> Replicates:
        """Group readings, by their indices, within sessions; or within hours, but for what sessions differ by."""
        xyz, temperature = readings.xyz_cd_m2[rows], readings.conditions.get("temperature_c")
        warm = None if temperature is None else temperature[rows]
        if not across_sessions:
            groups = replicate_groups(readings)[rows]
            return cls(groups, replicate_deviations(xyz, groups, warm), np.zeros(rows.size))
        groups = _numbered([readings.hours, *_patches(readings)])[rows]
        session = _numbered([readings.hours, readings.sessions.astype(float)])[rows]
        steady, leverage = _as_one_session(xyz, groups, session)
        _, of_hour = np.unique(readings.hours[rows], return_inverse=True)
        sessions = np.bincount(of_hour[np.unique(session, return_index=True)[1]])[of_hour]
        # What S sessions of an hour differ by is known but for its mean.
        return cls(groups, replicate_deviations(steady, groups, warm), leverage * (sessions - 1) / sessions)


def _as_one_session(xyz: Array, groups: NDArray[np.intp], session: NDArray[np.intp]) -> tuple[Array, Array]:
    """Readings without the gain and the dark offset by which their session differs from the others of its hour, (n, 3).

    Also the leverage of each reading on them, (n,).
    """
    light = group_means(xyz, groups)
    # A group of one reading says nothing of what sessions differ by.
    told = (np.bincount(groups) > 1)[groups][:, np.newaxis]
    weight = told / (np.abs(light) * RELATIVE + FLOOR_CD_M2) ** 2
    of_gain, of_offset = (np.maximum(_sums(each, session), 1e-300) for each in (weight * light**2, weight))
    steady = xyz
    for _ in range(ROUNDS):
        off = steady - group_means(steady, groups)
        # X, Y and Z apart: a gain of all three would take more of their common noise than of their differences.
        steady = steady - light * (_sums(weight * light * off, session) / of_gain)[session]
        off = steady - group_means(steady, groups)
        steady = steady - (_sums(weight * off, session) / of_offset)[session]
    return steady, (weight * light**2 / of_gain[session] + weight / of_offset[session]).mean(axis=1)


def patch_numbers(readings: Measurements) -> NDArray[np.intp]:
    """Number the readings of the same patch under the same conditions, at whatever hour: (n,)."""
    return _numbered(_patches(readings))


def _patches(readings: Measurements) -> list[Array]:
    """What tells one patch from another, (n,) each: code values, conditions, and a capped lens."""
    # What counts as rest is one condition, however a log of every reading's minutes, lux or kelvins scatters.
    conditions = [np.nan_to_num(_repeated(readings, name), nan=-1e9, posinf=1e9) for name in readings.conditions]
    return [*readings.drive.T, *conditions, is_capped(readings).astype(float)]


def _numbered(columns: list[Array]) -> NDArray[np.intp]:
    return np.asarray(np.unique(np.column_stack(columns), axis=0, return_inverse=True)[1].reshape(-1))


def _repeated(readings: Measurements, name: str) -> Array:
    if name == "temperature_c":
        # A logged temperature hardly ever repeats to the digit; what it does is taken out of the scatter instead.
        return np.asarray(np.round(readings.warmer() / (2 * FEW_KELVINS)))
    return readings.settled(name)


def replicate_deviations(xyz: Array, groups: NDArray[np.intp], temperature: Array | None) -> Array:
    """Deviation of readings from the mean of their replicates, (n, 3), cd/m².

    Replicates that were read at different temperatures differ by more than noise: a common share of their light per
    kelvin, one for X, Y and Z each, is taken out.
    """
    mean = group_means(xyz, groups)
    off = xyz - mean
    if temperature is None or np.isnan(temperature).all():
        return off
    warmer = np.nan_to_num(temperature, nan=float(np.nanmedian(temperature)))[:, np.newaxis]
    slope = mean * (warmer - group_means(warmer, groups))
    weight = 1.0 / (np.abs(mean) * RELATIVE + FLOOR_CD_M2) ** 2
    strength = (weight * slope * slope).sum(axis=0)
    if (strength <= 0).any():
        return off
    return np.asarray(off - slope * (weight * slope * off).sum(axis=0) / strength)


def group_means(values: Array, groups: NDArray[np.intp]) -> Array:
    """Mean of each reading's group, (n, 3), of values (n, 3)."""
    return np.asarray((_sums(values, groups) / np.maximum(np.bincount(groups), 1)[:, np.newaxis])[groups])


def _sums(values: Array, groups: NDArray[np.intp]) -> Array:
    """Sums of values (n, 3) over groups, (g, 3)."""
    return np.stack([np.bincount(groups, column) for column in values.T], axis=1)
