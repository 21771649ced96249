"""How well a hidden effect shows in a campaign, beside what re-measured white and primaries take up.

The change that the effect makes to the noise-free light, less the nearest that white, red, green and blue can explain,
in units of a good meter's noise. A native display's own model has in it what the effect does to the colours of the
first session: only what differs from that later, or under other conditions, can show. A test for one further parameter
on about 3000 values asks for ΔBIC ≥ 6, a chi-square of ln 3000 + 6 = 14: a strength of 6.5 passes that in 99 % of
campaigns. That is the smallest detectable size here.
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

#: Multiples of a typical size at which an effect changes nothing, and beyond which none is hidden.
NOTHING, MOST = 1e-9, 10.0

#: Sizes are solved until the strength is the target within this share, in so many steps at most.
TOLERANCE, STEPS = 0.05, 14


#: Light below this, in cd/m², is that of a capped lens.
DARKEST = 1e-6

#: Colours between which what an effect has done is interpolated.
NEIGHBOURS = 12


class Sized(NamedTuple):
    """A multiple of the typical size, and how many times the smallest detectable size that is."""

    size: float
    multiple: float


def sized(
    hiding: Callable[[float], Truth], target: float, *, baseline: str, discrepancy: tuple[float, float] = (0.0, 0.0)
) -> Sized:
    """Solve for the size, in typical ones, at which the effect is ``target`` times its smallest detectable size.

    ``hiding(size)`` is the campaign, ``baseline`` what it is diagnosed against. Where the target is beyond ``MOST``, or
    between two steps, the nearest is taken.
    """
    healthy = hiding(NOTHING)
    whitener = _whitener(healthy.xyz_cd_m2, discrepancy)
    low, high, size = 0.0, MOST, 1.0
    best = Sized(size, 0.0)
    for _ in range(STEPS):
        changed = hiding(size).xyz_cd_m2 - healthy.xyz_cd_m2
        found = Sized(size, _left(healthy, changed, whitener, baseline) / DETECTABLE)
        if abs(np.log(max(found.multiple, 1e-12) / target)) <= abs(np.log(max(best.multiple, 1e-12) / target)):
            best = found
        if abs(found.multiple / target - 1.0) < TOLERANCE or (found.multiple < target and size >= MOST):
            break
        low, high = (size, high) if found.multiple < target else (low, size)
        size = size * target / max(found.multiple, 1e-9)
        if not low < size < high:
            size = min(MOST, np.sqrt(max(low, 1e-6) * high)) if low < 0.9 * MOST else MOST
    return best


def shown(hiding: Callable[[float], Truth], size: float, *, baseline: str, discrepancy: tuple[float, float]) -> float:
    """How many times its smallest detectable size an effect has at ``size`` typical ones."""
    healthy = hiding(NOTHING)
    changed = hiding(size).xyz_cd_m2 - healthy.xyz_cd_m2
    return _left(healthy, changed, _whitener(healthy.xyz_cd_m2, discrepancy), baseline) / DETECTABLE


def _whitener(xyz: Array, discrepancy: tuple[float, float]) -> Array:
    share, floor = discrepancy
    wrong = np.eye(3) * ((share * xyz) ** 2 + floor**2)[:, np.newaxis, :]
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance(xyz) + wrong)))


def _left(healthy: Truth, changed: Array, whitener: Array, baseline: str) -> float:
    """Norm of what white and primaries leave of the change (n, 3), which each hour has anew, or hour 0 alone."""
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
    """Change (n, 3) of each reading by the share by which its colour's light has changed in the first session.

    Between the colours that it has read at rest, which is how most readings are made, that share is interpolated.
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
