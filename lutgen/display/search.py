"""Drives of a display with effects, which has no closed inverse: searched, all colours at once.

Bounded least squares by Levenberg's damped Gauss-Newton steps with an active set (Levenberg 1944,
doi:10.1090/qam/10666; bounds by projection, Bertsekas 1982, doi:10.1137/0320018). What is made small is the distance in
the light of the aged primaries: for a display that adds up, the nearest drive is then the one clipped by channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import CHUNK, inverse, linear_to_code, transform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display.chain import AgedDisplay

#: Red, green, blue and black as code values.
_TIPS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])

#: Difference in linear light from which slopes are taken: the square root of what doubles resolve, and some.
_STEP = 1e-7

#: A colour is done when its drive moves by less, or is off by less; both in linear light.
_STILL, _FOUND = 1e-11, 1e-11

#: What is missing inside 0..1 by more than this was not found; then other starts are tried, so far aside.
_STUCK_AT, _ASIDE = 1e-6, (0.02, -0.02, 0.08, -0.08)

#: Steps at most; where the damping starts and stays above, by how much it changes, and where it gives up.
_ROUNDS = 60
_DAMPING, _DAMPED, _STUCK = 1e-8, 10.0, 1e8


def searched(aged: AgedDisplay, xyz: Array) -> Array:
    """Return the linear drives with which a display with effects comes nearest to ``xyz``, both (n, 3).

    Where a channel would have to leave 0..1, it does by what is missing.
    """
    problem = _Problem.of(aged)
    result = np.empty_like(xyz)
    for start in range(0, len(xyz), CHUNK):
        part = slice(start, start + CHUNK)
        result[part] = _nearest_drives(problem, problem.light(xyz[part]))
    return result


@dataclass(frozen=True)
class _Problem:
    """A display in the light of its own primaries, above its black."""

    aged: AgedDisplay
    to_light: Array
    black: Array

    @classmethod
    def of(cls, aged: AgedDisplay) -> _Problem:
        xyz = aged.code_to_xyz(_TIPS)
        return cls(aged, inverse((xyz[:3] - xyz[3]).T), xyz[3])

    def light(self, xyz: Array) -> Array:
        return transform(self.to_light, xyz - self.black)

    def shown(self, drive: Array) -> Array:
        return self.light(self.aged.code_to_xyz(linear_to_code(drive)))

    def slopes(self, drive: Array, shown: Array) -> Array:
        """Derivatives, (n, light, channel), into the cube."""
        columns = []
        for channel in range(3):
            step = np.where(drive[:, channel] > 0.5, -_STEP, _STEP)
            moved = drive.copy()
            moved[:, channel] += step
            columns.append((self.shown(moved) - shown) / step[:, np.newaxis])
        return np.stack(columns, axis=-1)


def _nearest_drives(problem: _Problem, wanted: Array) -> Array:
    start = np.clip(wanted, 0.0, 1.0)
    drive, missing = _descended(problem, wanted, start)
    for aside in _ASIDE:
        # A jump between a start and its goal stops the descent: from the other side of it, there may be none between.
        stuck = np.flatnonzero((np.abs(missing) > _STUCK_AT).any(axis=1) & ~_ends(drive, missing).any(axis=1))
        if not stuck.size:
            break
        again, left = _descended(problem, wanted[stuck], np.clip(drive[stuck] + aside, 0.0, 1.0))
        better = np.square(left).sum(axis=1) < np.square(missing[stuck]).sum(axis=1)
        drive[stuck[better]], missing[stuck[better]] = again[better], left[better]
    return drive + np.where(_ends(drive, missing), missing, 0.0)


def _ends(drive: Array, missing: Array) -> NDArray[np.bool_]:
    """Whether a channel would have to leave 0..1 for what is missing, (n, 3)."""
    return np.asarray(((drive == 1.0) & (missing > 0.0)) | ((drive == 0.0) & (missing < 0.0)))


def _descended(problem: _Problem, wanted: Array, start: Array) -> tuple[Array, Array]:
    """Follow the descent from some drives; where it ends, and what is missing there, both (n, 3)."""
    drive = start.copy()
    missing = wanted - problem.shown(drive)
    damping = np.full(len(drive), _DAMPING)
    active = np.arange(len(drive))
    for _ in range(_ROUNDS):
        active = active[np.abs(missing[active]).max(axis=1) > _FOUND]
        if not active.size:
            break
        here, short = drive[active], missing[active]
        moved = _step(problem.slopes(here, wanted[active] - short), here, short, damping[active])
        left = wanted[active] - problem.shown(moved)
        better = np.square(left).sum(axis=1) < np.square(short).sum(axis=1)
        drive[active[better]], missing[active[better]] = moved[better], left[better]
        damping[active] = np.where(better, np.maximum(damping[active] / _DAMPED, _DAMPING), damping[active] * _DAMPED)
        moving = np.where(better, np.abs(moved - here).max(axis=1) > _STILL, damping[active] < _STUCK)
        active = active[moving]
    return drive, missing


def _step(slopes: Array, drive: Array, missing: Array, damping: Array) -> Array:
    """One damped step, by the channels that are free to move; kept within 0..1."""
    uphill = np.einsum("nij,ni->nj", slopes, missing)
    free = ~(((drive == 0.0) & (uphill < 0.0)) | ((drive == 1.0) & (uphill > 0.0)))
    slopes = slopes * free[:, np.newaxis, :]
    normal = np.einsum("nij,nik->jkn", slopes, slopes)
    for channel in range(3):
        normal[channel, channel] += np.where(free[:, channel], damping, 1.0)
    return np.clip(drive + _solved(normal, (uphill * free).T).T, 0.0, 1.0)


def _solved(matrix: Array, right: Array) -> Array:
    """Solve n systems by Cramer's rule: (3, 3, n) symmetric, (3, n) → (3, n). Without LAPACK, as ``inverse``."""
    a, b, c = matrix
    over = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)])
    return np.asarray((over * right[:, np.newaxis]).sum(axis=0) / (a * over[0]).sum(axis=0))


def _cross(a: Array, b: Array) -> Array:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
