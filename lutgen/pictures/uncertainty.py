"""How uncertain lifetimes are, where a model says how uncertain it is itself: by drawing models like it.

A refined model keeps the standard errors of its effects' parameters and the noise of a reading. Each draw takes every
fitted parameter from a normal distribution, within its bounds, and moves the tips before the effects so that white and
primaries are seen as before, since these were read; then it adds noise to each tip, that of one reading over the square
root of how often the tip was read at that hour. Correlations between parameters, and between X, Y and Z of a reading,
are in no model file: all are drawn independently, which makes intervals wide rather than narrow.

A model of bare readings says nothing of its uncertainty, and no interval is made up for it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import CHUNK, xyY_to_xyz
from lutgen.display import REFERENCE, LatentTips
from lutgen.pictures.difference import curves_of
from lutgen.pictures.distinct import Colours
from lutgen.readings.rest import TIP_DRIVES

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.colorimetry import Array
    from lutgen.display import AppliedEffect, DisplayModel
    from lutgen.pictures.difference import DifferenceCurve
    from lutgen.readings import Measurements

#: Models that are drawn, and how many are left out at either end: 76 of 80 are 95 %.
DRAWS, OUTSIDE = 80, 2

#: Statistics that get an interval: those of the paper's Table 1.
OF = ("mean", "max")

#: Bits a channel of the coarse colours on which draws are compared with the model itself.
_BITS = 5

#: Hours from and to, either of them None: not within the span.
Interval = tuple[float | None, float | None]

#: Mode → tolerance → statistic → interval.
Intervals = dict[str, dict[float, dict[str, Interval]]]


def intervals(
    colours: Colours,
    model: DisplayModel,
    curves: dict[str, DifferenceCurve],
    tolerances: Sequence[float],
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Intervals | None:
    """Return 95 % intervals of lifetimes; None where the model says nothing of its uncertainty.

    Draws are evaluated on coarse colours; what these change in the model's own lifetimes is taken off. The same model
    gives the same intervals.
    """
    models = drawn(model)
    if not models:
        return None
    few = coarse(colours)
    modes, hours = list(curves), [float(hour) for hour in next(iter(curves.values())).hours]
    own = curves_of(few, model, modes, hours)
    drawn_curves = []
    for done, each in enumerate(models):
        drawn_curves.append(curves_of(few, each, modes, hours))
        progress(done + 1, len(models))

    def interval(mode: str, tolerance: float, statistic: str) -> Interval:
        lives = [each[mode].hours_until(statistic, tolerance) for each in drawn_curves]
        whole, roughly = (one[mode].hours_until(statistic, tolerance) for one in (curves, own))
        shift = whole - roughly if whole is not None and roughly is not None else 0.0
        return _ends(lives, shift, hours[-1])

    return {
        mode: {
            tolerance: {statistic: interval(mode, tolerance, statistic) for statistic in OF} for tolerance in tolerances
        }
        for mode in modes
    }


def _ends(lives: Sequence[float | None], shift: float, last: float) -> Interval:
    ordered = sorted(np.inf if life is None else life + shift for life in lives)
    low, high = ordered[OUTSIDE], ordered[-1 - OUTSIDE]
    return _within(low, last), _within(high, last)


def _within(hours: float, last: float) -> float | None:
    return max(hours, 0.0) if hours <= last else None


def drawn(model: DisplayModel, draws: int = DRAWS) -> list[DisplayModel]:
    """Return models that could as well have been found as this one; none where it says nothing of its uncertainty."""
    relative, floor = (float(model.fit.get(f"noise_{name}", 0.0)) for name in ("relative", "floor_cd_m2"))
    uncertain = any(estimate.stderr for each in model.effects for estimate in each.estimates.values())
    if not uncertain and (model.latent is None or not relative + floor):
        return []
    random = np.random.default_rng(0)
    models = []
    for _ in range(draws):
        other = replace(model, effects=tuple(_moved(each, random) for each in model.effects))
        if model.latent is not None:
            hours, tips = model.latent.hours, model.latent.xyz_cd_m2
            tips = tips + _seen(model, hours) - _seen(other, hours)
            sigma = np.hypot(relative * tips, floor) / _times_read(model.measurements, hours)[..., np.newaxis] ** 0.5
            other = replace(other, latent=LatentTips(hours, tips + sigma * random.standard_normal(tips.shape)))
        models.append(other)
    return models


def _moved(each: AppliedEffect, random: np.random.Generator) -> AppliedEffect:
    """Draw the parameters that were fitted, within their bounds."""
    estimates = {}
    for name, estimate in each.estimates.items():
        low, high = each.effect.parameters[name].bounds
        off = estimate.stderr * random.standard_normal() if estimate.stderr else 0.0
        estimates[name] = replace(estimate, value=min(max(estimate.value + off, low), high)) if off else estimate
    return replace(each, estimates=estimates)


def _seen(model: DisplayModel, hours: Array) -> Array:
    """XYZ in cd/m² of white and primaries as they were read, shape (N, 4, 3)."""
    model = replace(model, conditions=REFERENCE)
    return np.array([xyY_to_xyz(model.shown_tips(float(hour))) for hour in hours])


def _times_read(readings: Measurements, hours: Array) -> Array:
    """How often white and primaries were read at each hour, at least once: (N, 4)."""
    tips = (readings.drive[:, np.newaxis] == TIP_DRIVES).all(axis=-1) & readings.at_rest()[:, np.newaxis]
    return np.array([np.maximum(tips[readings.hours == hour].sum(axis=0), 1) for hour in hours])


def coarse(colours: Colours) -> Colours:
    """Bring colours of the same ``_BITS`` bits a channel together at their mean."""
    size = 1 << 3 * _BITS
    sums = np.zeros((4, size))
    for start in range(0, len(colours), CHUNK):
        part = slice(start, start + CHUNK)
        code, counts = colours.code(part), colours.counts[part]
        levels = np.minimum((code * 2.0**_BITS).astype(np.intp), (1 << _BITS) - 1)
        cell = (levels[:, 0] << 2 * _BITS) + (levels[:, 1] << _BITS) + levels[:, 2]
        for place, values in enumerate((counts, *(code * counts[:, np.newaxis]).T)):
            sums[place] += np.bincount(cell, values, size)
    keys = np.flatnonzero(sums[0]).astype(np.uint32)
    means = (sums[1:, keys] / sums[0, keys]).T
    return Colours(np.arange(len(keys), dtype=np.uint32), sums[0, keys].astype(np.int64), means.__getitem__, _BITS)
