"""The detectability of a hidden effect in a campaign, beyond what re-measured white and primaries explain.

The strength is a norm of the change that the effect makes to the noise-free light, minus the nearest change that white,
red, green and blue can explain, in units of a good meter's noise. The own model of a native display already contains
the effect's change of the colours of the first session. So only differences at later hours or under other conditions
are visible. A test for one further parameter on about 3000 values requires ΔBIC ≥ 6, that is, a chi-square of ln 3000 +
6 = 14. A strength of 6.5 passes this test in 99 % of campaigns. This strength defines the smallest detectable size
here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator

from tests.generators.meters import SESSION_GAIN, covariance

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.generators.meters import Array
    from tests.generators.truth import Truth

DETECTABLE = 6.5

#: Multiples of a typical size: an effect below the first changes nothing; no hidden effect exceeds the second.
NOTHING, MOST = 1e-9, 10.0

#: Relative tolerance on the strength when solving for the size, and the maximum number of steps.
TOLERANCE, STEPS = 0.05, 14


#: Light below this, in cd/m², comes from a capped lens.
DARKEST = 1e-6

#: Number of neighbouring colours for the interpolation of an effect's change.
NEIGHBOURS = 12


class Sized(NamedTuple):
    """A multiple of the typical size, and the same size in smallest detectable sizes."""

    size: float
    multiple: float


def sized(
    hiding: Callable[[float], Truth], target: float, *, baseline: str, discrepancy: tuple[float, float] = (0.0, 0.0)
) -> Sized:
    """Solve for the size, in typical sizes, at which the effect is ``target`` times its smallest detectable size.

    ``hiding(size)`` returns the campaign; ``baseline`` is the model of the diagnosis. If the target is beyond ``MOST``,
    or between two steps, return the nearest size.
    """
    healthy = hiding(NOTHING)
    whitener = _whitener(healthy.xyz_cd_m2, discrepancy)
    low, high, size = 0.0, MOST, 1.0
    best = Sized(size, 0.0)
    for _ in range(STEPS):
        changed = hiding(size).xyz_cd_m2 - healthy.xyz_cd_m2
        solution = Sized(size, _left(healthy, changed, whitener, baseline) / DETECTABLE)
        if abs(np.log(max(solution.multiple, 1e-12) / target)) <= abs(np.log(max(best.multiple, 1e-12) / target)):
            best = solution
        if abs(solution.multiple / target - 1.0) < TOLERANCE or (solution.multiple < target and size >= MOST):
            break
        low, high = (size, high) if solution.multiple < target else (low, size)
        size = size * target / max(solution.multiple, 1e-9)
        if not low < size < high:
            size = min(MOST, np.sqrt(max(low, 1e-6) * high)) if low < 0.9 * MOST else MOST
    return best


def shown(hiding: Callable[[float], Truth], size: float, *, baseline: str, discrepancy: tuple[float, float]) -> float:
    """Return the size of an effect in smallest detectable sizes, given ``size`` in typical sizes."""
    healthy = hiding(NOTHING)
    changed = hiding(size).xyz_cd_m2 - healthy.xyz_cd_m2
    return _left(healthy, changed, _whitener(healthy.xyz_cd_m2, discrepancy), baseline) / DETECTABLE


def _whitener(xyz: Array, discrepancy: tuple[float, float]) -> Array:
    share, floor = discrepancy
    wrong = np.eye(3) * ((share * xyz) ** 2 + floor**2)[:, np.newaxis, :]
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance(xyz) + wrong)))


def _left(healthy: Truth, changed: Array, whitener: Array, baseline: str) -> float:
    """Return the norm of the residual of the change (n, 3) after white and primaries.

    White and primaries are re-measured at each hour, or known at hour 0 alone.
    """
    code = healthy.drive
    if baseline == "native":
        changed = changed - _in_the_first_session(healthy, changed)
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    least = linear.min(axis=1, keepdims=True)
    shares = np.hstack([least, linear - least])
    target = np.einsum("nij,nj->ni", whitener, changed)
    columns = np.einsum("nij,nk->nikj", whitener, shares).reshape(len(code), 3, 12)
    if baseline != "first-hour":
        hours = [healthy.hours == hour for hour in np.unique(healthy.hours)]
        return float(np.sqrt(sum(_misfit(target[here].ravel(), columns[here].reshape(-1, 12)) for here in hours)))
    _, place = np.unique(np.array(healthy.session), return_inverse=True)
    sessions = int(place.max()) + 1
    light = SESSION_GAIN * np.einsum("nij,nj->ni", whitener, healthy.xyz_cd_m2)
    gains = light[:, :, np.newaxis] * np.eye(sessions)[place][:, np.newaxis, :]
    design = np.hstack([columns.reshape(-1, 12), gains.reshape(-1, sessions)])
    prior = np.hstack([np.zeros((sessions, 12)), np.eye(sessions)])
    return float(np.sqrt(_misfit(np.concatenate([target.ravel(), np.zeros(sessions)]), np.vstack([design, prior]))))


def _in_the_first_session(healthy: Truth, changed: Array) -> Array:
    """Return the change (n, 3) of each reading, predicted from the relative change of its colour in the first session.

    The relative change is interpolated between the colours that the session reads at rest (most readings are at rest).
    """
    rest = healthy.xyz_cd_m2[:, 1] > DARKEST
    for values in healthy.conditions.values():
        known, times = np.unique(values, return_counts=True)
        usual = known[np.argmax(times)]
        rest &= (values == usual) | (np.isnan(values) & np.isnan(usual))
    first = np.flatnonzero(rest & (healthy.hours == healthy.hours.min()))
    codes, one = np.unique(healthy.drive[first], axis=0, return_index=True)
    share = changed[first[one]] / healthy.xyz_cd_m2[first[one]]
    between = RBFInterpolator(codes, share, neighbors=min(NEIGHBOURS, len(codes)), kernel="linear")
    return np.asarray(between(healthy.drive) * healthy.xyz_cd_m2)


def _misfit(target: Array, columns: Array) -> float:
    solution = np.linalg.lstsq(columns, target, rcond=1e-10)[0]
    return float(np.sum((target - columns @ solution) ** 2))
