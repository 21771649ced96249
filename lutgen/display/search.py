"""Numerical inverse of a display with effects: a search for the drives of all colours at once.

The search is a bounded least-squares problem, solved by Levenberg's damped Gauss-Newton steps with an active set
(Levenberg 1944, doi:10.1090/qam/10666; bounds by projection, Bertsekas 1982, doi:10.1137/0320018). The search minimises
the distance in the light of the aged primaries. For an additive display the nearest drive is then the drive with
clipped channels.

Slopes cost three times as much as a step, so they are reused while steps converge fast (simplified Newton method). The
search of a colour ends when its residual is small enough, not after a fixed number of steps.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import CHUNK, Array, cross, inverse, linear_to_code, transform
from lutgen.display.chain import AgedDisplay

#: Red, green, blue and black as code values.
_TIPS = np.vstack([np.eye(3), np.zeros(3)])

#: Step of the finite differences in linear light: a little more than the square root of double precision.
_STEP = 1e-7

#: Smallest step and largest residual, in linear light, at which the search of a colour ends. For a colour out of reach,
#: rounding errors of the slopes change the drive by up to the first.
_STILL, _FOUND = 1e-8, 1e-11

#: Largest ratio of the sums of squares after and before a step for which the slopes are reused.
_FAST = 1e-4

#: Smallest residual inside 0..1 that counts as a failed search; and the offsets of the drives from which a failed
#: search starts again.
_STUCK_AT, _ASIDE = 1e-6, (0.02, -0.02, 0.08, -0.08)

#: Largest number of steps: for all colours together, for slow colours, and for lattices whose results are only starts.
_FIRST_ROUNDS, _ROUNDS, _ROUGH_ROUNDS = 4, 60, 12

#: Number of rounds without halving of the sum of squares after which the search of a colour inside 0..1 stops: the
#: colour lies at a jump. The damping needs eight rounds to grow from its smallest value to the size of the slopes.
_PATIENCE = 12

#: First and smallest damping, factor of its change, and damping at which a search stops.
_DAMPING, _DAMPED, _STUCK = 1e-8, 10.0, 1e8


class Start(NamedTuple):
    """Starting values of a search: drives, (n, 3), and slopes there, (light, channel, n); NaN: unknown."""

    drive: Array
    slopes: Array


def searched(
    aged: AgedDisplay, xyz: Array, start: Start | None = None, *, thorough: bool = True
) -> tuple[Array, Array]:
    """Return the linear drives for which a display with effects is nearest to ``xyz``, both (n, 3), and slopes.

    If a colour is out of reach, the drive of a limiting channel is its bound plus the missing light.

    ``start``: starting values; default: the drives of an additive display, without slopes. ``thorough``: whether
    colours that were not found at once are searched longer, and from other starts.
    """
    problem = _DriveSearch.of(aged)
    target = problem.light(xyz)
    near = target if start is None else np.where(np.isnan(start.drive), target, start.drive)
    near = np.clip(near, 0.0, 1.0)
    slopes = np.full((3, 3, len(target)), np.nan) if start is None else start.slopes
    # For a colour out of reach, the first step decides on which side of a bend the search ends.
    slopes[:, :, ((near == 0.0) | (near == 1.0)).any(axis=1)] = np.nan
    drive, missing = np.empty_like(target), np.empty_like(target)
    unfinished, rounds = [], _FIRST_ROUNDS if thorough else _ROUGH_ROUNDS
    for first in range(0, len(target), CHUNK):
        part = slice(first, first + CHUNK)
        drive[part], missing[part], late = _descended(problem, target[part], near[part], slopes[:, :, part], rounds)
        unfinished.append(first + late)
    if thorough:
        # The few slow colours are searched together.
        late = np.concatenate(unfinished)
        drive[late], missing[late], _ = _descended(problem, target[late], drive[late], slopes[:, :, late], _ROUNDS)
        _search_stuck_again(problem, target, drive, missing)
    return drive + np.where(_ends(drive, missing), missing, 0.0), slopes


@dataclass(frozen=True)
class _DriveSearch:
    """A display in the light of its own primaries, minus black."""

    aged: AgedDisplay
    to_light: Array
    black: Array

    @classmethod
    def of(cls, aged: AgedDisplay) -> "_DriveSearch":
        xyz = aged.code_to_xyz(_TIPS)
        return cls(aged, inverse((xyz[:3] - xyz[3]).T), xyz[3])

    def light(self, xyz: Array) -> Array:
        return transform(self.to_light, xyz - self.black)

    def shown(self, drive: Array) -> Array:
        return self.light(self.aged.code_to_xyz(linear_to_code(drive)))

    def slopes(self, drive: Array, shown: Array) -> Array:
        """Return the derivatives, (light, channel, n), by differences towards the inside of the cube."""
        step = np.where(drive > 0.5, -_STEP, _STEP)
        # The three shifts in one call: for few colours the overhead of a call exceeds its computation.
        moved = np.tile(drive, (3, 1))
        for channel in range(3):
            moved[channel * len(drive) : (channel + 1) * len(drive), channel] += step[:, channel]
        rises = self.shown(moved).T.reshape(3, 3, len(drive)) - shown.T[:, np.newaxis]
        return np.asarray(rises / step.T)


def _search_stuck_again(problem: _DriveSearch, target: Array, drive: Array, missing: Array) -> None:
    """Search failed colours inside 0..1 from other starts; update ``drive`` and ``missing``, (n, 3), in place."""
    # A jump between a start and the solution stops the search; another start may lie on the solution's side of the
    # jump.
    stuck = np.flatnonzero((np.abs(missing) > _STUCK_AT).any(axis=1) & ~_ends(drive, missing).any(axis=1))
    if not stuck.size:
        return
    starts = np.concatenate([np.clip(drive[stuck] + aside, 0.0, 1.0) for aside in _ASIDE])
    unknown = np.full((3, 3, len(starts)), np.nan)
    again, left, _ = _descended(problem, np.tile(target[stuck], (len(_ASIDE), 1)), starts, unknown, _ROUNDS)
    again, left = (
        np.stack([first[stuck], *np.split(others, len(_ASIDE))]) for first, others in ((drive, again), (missing, left))
    )
    best = np.square(left).sum(axis=2).argmin(axis=0), np.arange(stuck.size)
    drive[stuck], missing[stuck] = again[best], left[best]


def _ends(drive: Array, missing: Array) -> NDArray[np.bool_]:
    """Return whether each channel would have to leave 0..1 for the missing light, (n, 3)."""
    return np.asarray(((drive == 1.0) & (missing > 0.0)) | ((drive == 0.0) & (missing < 0.0)))


def _descended(
    problem: _DriveSearch, target: Array, start: Array, slopes: Array, rounds: int
) -> tuple[Array, Array, NDArray[np.intp]]:
    """Search from drives, (n, 3), and slopes, (3, 3, n), which are updated in place.

    Returns the last drives and the missing light there, both (n, 3), and the indices of unfinished colours.
    """
    drive = start.copy()
    missing = target - problem.shown(drive)
    damping = np.full(len(drive), _DAMPING)
    # Whether a colour needs new slopes, and whether its slopes were computed at its present drive.
    needed = np.isnan(slopes[0, 0])
    taken_here = needed.copy()
    # The sum of squares that a colour must reach, and the round by which it must.
    aim, until = np.full(len(drive), np.inf), np.full(len(drive), _PATIENCE)
    active = np.arange(len(drive))
    for number in range(rounds):
        active = active[_largest(missing[active]) > _FOUND]
        if not active.size:
            break
        anew = active[needed[active]]
        if anew.size:
            slopes[:, :, anew] = problem.slopes(drive[anew], target[anew] - missing[anew])
            taken_here[anew] = True
        current, short, exact, damped = drive[active], missing[active], taken_here[active], damping[active]
        moved = _step(np.take(slopes, active, axis=2), current, short, damped)
        left = target[active] - problem.shown(moved)
        before, after = _dot(short.T, short.T), _dot(left.T, left.T)
        better = after < before
        drive[active[better]], missing[active[better]] = moved[better], left[better]
        needed[active] = np.where(better, after > _FAST * before, ~exact)
        taken_here[active] = exact & ~better
        # A failed step increases the damping only if the slopes belong to the present drive; otherwise the slopes are
        # computed first.
        worse = np.where(exact, damped * _DAMPED, damped)
        damping[active] = np.where(better, np.maximum(damped / _DAMPED, _DAMPING), worse)
        reached = active[after < aim[active]]
        aim[reached], until[reached] = 0.5 * after[after < aim[active]], number + _PATIENCE
        patient = (until[active] > number) | ~((current > 0.0) & (current < 1.0)).all(axis=1)
        moving = (_largest(moved - current) > _STILL) & patient
        active = active[np.where(better, moving, ~exact | (moving & (damping[active] < _STUCK)))]
    return drive, missing, active


def _step(slopes: Array, drive: Array, missing: Array, damping: Array) -> Array:
    """Return the drives after one damped step of the free channels, clipped to 0..1."""
    place, missed = drive.T, missing.T
    uphill = np.stack([_dot(slopes[:, channel], missed) for channel in range(3)])
    free = ~(((place == 0.0) & (uphill < 0.0)) | ((place == 1.0) & (uphill > 0.0)))
    uphill *= free
    slopes = slopes * free
    normal = np.empty_like(slopes)
    for channel in range(3):
        for other in range(channel):
            normal[channel, other] = normal[other, channel] = _dot(slopes[:, channel], slopes[:, other])
        normal[channel, channel] = _dot(slopes[:, channel], slopes[:, channel])
        normal[channel, channel] += np.where(free[channel], damping, 1.0)
    return np.clip(place + _solved(normal, uphill), 0.0, 1.0).T


def _largest(values: Array) -> Array:
    """Return the largest absolute value in each row of (n, 3), (n,); by columns, for speed."""
    first, second, third = np.abs(values).T
    return np.asarray(np.maximum(np.maximum(first, second), third))


def _dot(a: Array, b: Array) -> Array:
    """Return the scalar products over the first axis, (3, n) and (3, n) → (n,)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _solved(matrix: Array, right: Array) -> Array:
    """Solve n symmetric systems by Cramer's rule, (3, 3, n) and (3, n) → (3, n); without LAPACK, like ``inverse``."""
    a, b, c = matrix
    over = np.array([cross(b, c), cross(c, a), cross(a, b)])
    return np.asarray((over * right[:, np.newaxis]).sum(axis=0) / (a * over[0]).sum(axis=0))
