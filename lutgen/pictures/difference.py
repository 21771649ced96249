"""ΔE2000 between the colours of the un-aged display and of aged displays, and the uncertainty of lifetimes.

An un-aged sRGB viewer shows both pictures, as ``lutgen apply`` writes the aged picture. The aged light is clipped to
the viewer's gamut; it is not rounded to 8 bits. Lab of both pictures is relative to the viewer's white, D65 with Y = 1,
since the paper's observer is not adapted to the aged white.

The un-aged display is the mode ``stable`` under the same conditions: a leak or a room light that is there from the
first hour is no aging. With the paper's model and the reference ``relative``, the un-aged display shows the picture
unchanged.

The uncertainty of a lifetime comes from models drawn at random around the given model. A refined model file holds the
covariance of its effects' parameters and of the tips before the effects. Each draw takes parameters and tips together
from a normal distribution, with parameters within their bounds.

A model file without a covariance may still state standard errors and the noise of a reading. Then each parameter is
drawn independently. The tips before the effects are shifted so that white and primaries are seen as before, since white
and primaries were read. Each tip gets the noise of one reading divided by the square root of its number of readings at
that hour. X, Y and Z are drawn independently too, so that intervals are too wide rather than too narrow.

A model that was not fitted states no uncertainty, so its lifetimes get no interval.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from lutgen.colorimetry import CHUNK, Array, delta_e_2000, linear_to_lab, xyY_to_xyz, xyz_to_linear
from lutgen.display import REFERENCE, AgedDisplay, AppliedEffect, DisplayModel, LatentTips
from lutgen.display.fitted import FitCovariance
from lutgen.display.on_screen import seen_at
from lutgen.pictures.blocks import threads
from lutgen.pictures.distinct import Colours, Counts
from lutgen.progress import Progress, part_of, unseen
from lutgen.readings.rest import TIP_DRIVES


def differences(
    code: Callable[[slice], Array],
    size: int,
    unaged: AgedDisplay,
    aged: Sequence[AgedDisplay],
    progress: Progress = unseen,
    *,
    places: Callable[[slice], Array] | None = None,
) -> Array:
    """Return ΔE2000 of ``size`` colours at ``places`` on each aged display, (len(aged), size), in threads."""
    result = np.empty((len(aged), size))

    def fill(start: int) -> int:
        part = slice(start, min(start + CHUNK, size))
        first, *others = [seen_at(each, places(part)) for each in (unaged, *aged)] if places else [unaged, *aged]
        colours, heads = code(part), dict[object, Array]()

        def seen(display: AgedDisplay) -> Array:
            if display.head not in heads:
                heads[display.head] = display.head_signal(colours)
            return shown_lab(display.xyz(heads[display.head]))

        before = seen(first)
        for row, display in zip(result[:, part], others, strict=True):
            row[:] = delta_e_2000(before, seen(display))
        return part.stop

    with ThreadPoolExecutor(threads()) as workers:
        for done in workers.map(fill, range(0, size, CHUNK)):
            progress(done, size)
    return result


def shown_lab(xyz: Array) -> Array:
    """Return the Lab that an un-aged sRGB viewer shows for XYZ relative to the un-aged white: (n, 3) → (n, 3)."""
    linear = xyz_to_linear(xyz)
    return linear_to_lab(np.clip(linear, 0.0, 1.0, out=linear))


#: Statistic → its meaning; reports list them in this order.
STATISTICS = {
    "mean": "mean over all pixels",
    "max": "mean + 2 standard deviations: the paper's Max",
    "p95": "95 % of the pixels are at most this different",
    "p99": "99 % of the pixels are at most this different",
    "largest": "the largest of all pixels",
}

#: Attribute of a curve → its name in JSON.
IN_JSON = {
    "hours": "hours",
    "mean": "mean",
    "sd": "sd",
    "max": "mean_plus_2_sd",
    "p95": "p95",
    "p99": "p99",
    "largest": "max",
}

#: Differences in memory at a time (128 MB): this number / the number of colours is the number of displays in a group.
HELD = 1 << 24

#: Bins of the histogram that locates a quantile; then only the values in the quantile's bin are sorted.
_BINS = 4096


@dataclass(frozen=True)
class DifferenceCurve:
    """ΔE2000 of an image in one mode, at increasing hours from 0; every array has shape (h,)."""

    #: Operating hours.
    hours: Array
    #: Mean and standard deviation over all pixels.
    mean: Array
    sd: Array
    #: Smallest ΔE2000 that at least 95 % and 99 % of the pixels do not exceed.
    p95: Array
    p99: Array
    #: Largest ΔE2000 of all pixels.
    largest: Array

    @property
    def max(self) -> Array:
        """The paper's Max: mean + 2 standard deviations."""
        return self.mean + 2.0 * self.sd

    def hours_until(self, statistic: str, tolerance: float) -> float | None:
        """Return the hours until a statistic first reaches ``tolerance``, interpolated linearly; None: never."""
        values: Array = getattr(self, statistic)
        reached = values >= tolerance
        if not reached.any():
            return None
        after = int(np.argmax(reached))
        if after == 0:
            return float(self.hours[0])
        share = (tolerance - values[after - 1]) / (values[after] - values[after - 1])
        return float(self.hours[after - 1] + share * (self.hours[after] - self.hours[after - 1]))


def curves_of(
    colours: Colours, model: DisplayModel, modes: Sequence[str], hours: Sequence[float], progress: Progress = unseen
) -> dict[str, DifferenceCurve]:
    """Return the curve of each mode, at increasing ``hours``; errors as :meth:`DisplayModel.at`."""
    unaged = model.at("stable", 0.0)
    displays = [model.at(mode, hour) for mode in modes for hour in hours]
    size = len(colours)
    group = max(HELD // size, 1)
    rows: list[tuple[float, ...]] = []
    for first in range(0, len(displays), group):
        some = displays[first : first + group]
        part = part_of(progress, first * size, len(some) * size, len(displays) * size)
        rows += [statistics(each, colours.counts) for each in differences(colours.code, size, unaged, some, part)]
    table = np.array(rows).reshape(len(modes), len(hours), -1)
    return {mode: DifferenceCurve(np.array(hours), *part.T) for mode, part in zip(modes, table, strict=True)}


def statistics(values: Array, counts: Counts) -> tuple[float, float, float, float, float]:
    """Return mean, standard deviation, 95 % and 99 % quantile, and largest of values (n,), weighted by ``counts``."""
    total = int(counts.sum())
    parts = [slice(start, start + CHUNK) for start in range(0, len(values), CHUNK)]
    mean = sum(float((values[part] * (counts[part] / total)).sum()) for part in parts)
    square = sum(float(((values[part] - mean) ** 2 * (counts[part] / total)).sum()) for part in parts)
    largest = float(values.max())
    # Rounding may give a mean of equal values that is above these values.
    return (min(mean, largest), square**0.5, quantile(values, counts, 95), quantile(values, counts, 99), largest)


def quantile(values: Array, counts: Counts, percent: int) -> float:
    """Return the smallest value that ``percent`` of the values ≥ 0, (n,), weighted by ``counts``, do not exceed."""
    total, largest = int(counts.sum()), float(values.max())
    if values.min() == largest:
        return largest
    scale = (_BINS - 1) / largest
    histogram = np.zeros(_BINS)
    parts = [slice(start, start + CHUNK) for start in range(0, len(values), CHUNK)]
    for part in parts:
        histogram += np.bincount((values[part] * scale).astype(np.intp), counts[part], _BINS)
    below = np.concatenate([[0.0], np.cumsum(histogram)])
    place = int(np.argmax(below[1:] * 100.0 >= total * float(percent)))
    in_bin = (part.start + np.flatnonzero((values[part] * scale).astype(np.intp) == place) for part in parts)
    inside = np.concatenate(list(in_bin))
    inside = inside[np.argsort(values[inside], kind="stable")]
    reached = (below[place] + np.cumsum(counts[inside])) * 100.0 >= total * float(percent)
    return float(values[inside[int(np.argmax(reached))]])


#: Number of drawn models, and how many are left out at each end: 76 of 80 are 95 %.
DRAWS, OUTSIDE = 80, 2

#: Most hours at which the curve of a drawn model is computed.
HOURS_OF_DRAWS = 12

#: Statistics that get an interval: the statistics of the paper's Table 1.
WITH_INTERVAL = ("mean", "max")

#: Bits per channel of the coarse colours, for which curves of drawn models and of the model itself are computed.
_BITS = 5

#: Low and high end in hours; None for an end beyond the span of hours.
Interval = tuple[float | None, float | None]

#: Mode → tolerance → statistic → interval.
Intervals = dict[str, dict[float, dict[str, Interval]]]


def intervals(
    colours: Colours,
    model: DisplayModel,
    curves: dict[str, DifferenceCurve],
    tolerances: Sequence[float],
    progress: Progress = unseen,
) -> Intervals | None:
    """Return 95 % intervals of lifetimes; None if the model states no uncertainty."""
    models = drawn(model)
    if not models:
        return None
    few = coarse(colours)
    modes, span = list(curves), next(iter(curves.values())).hours
    # The width of an interval comes from coarse colours at a few hours. The interval is then shifted by the difference
    # between the exact lifetime and the lifetime of the coarse colours.
    places = np.unique(np.linspace(0, span.size - 1, HOURS_OF_DRAWS).round().astype(int))
    hours = [float(hour) for hour in span[places]]
    own = curves_of(few, model, modes, hours)
    drawn_curves = []
    for done, each in enumerate(models):
        drawn_curves.append(curves_of(few, each, modes, hours))
        progress(done + 1, len(models))

    def interval(mode: str, tolerance: float, statistic: str) -> Interval:
        exact, coarse_life = (each[mode].hours_until(statistic, tolerance) for each in (curves, own))
        shift = exact - coarse_life if exact is not None and coarse_life is not None else 0.0
        lives = (each[mode].hours_until(statistic, tolerance) for each in drawn_curves)
        ordered = sorted(np.inf if life is None else life + shift for life in lives)
        low, high = (max(end, 0.0) if end <= hours[-1] else None for end in (ordered[OUTSIDE], ordered[-1 - OUTSIDE]))
        return low, high

    return {
        mode: {
            tolerance: {statistic: interval(mode, tolerance, statistic) for statistic in WITH_INTERVAL}
            for tolerance in tolerances
        }
        for mode in modes
    }


def drawn(model: DisplayModel, draws: int = DRAWS) -> list[DisplayModel]:
    """Return models drawn from the uncertainty that a model states; none if the model states no uncertainty."""
    if model.covariance is None:
        return _independent_draws(model, draws)
    random, known = np.random.default_rng(0), model.covariance.among(model.fitted)
    return [_joint_draw(model, known, random) for _ in range(draws)]


def _joint_draw(model: DisplayModel, known: FitCovariance, random: np.random.Generator) -> DisplayModel:
    """Draw parameters and tips together from their covariance."""
    of = {each.effect.name: each for each in model.effects}
    values = np.array([of[effect].values[name] for effect, name in known.of])
    bounds = np.array([of[effect].effect.parameters[name].bounds for effect, name in known.of]).reshape(-1, 2)
    off, tips = known.drawn(random, *(bounds.T - values))
    effects = dict(of)
    for (effect, name), value in zip(known.of, (values + off).tolist(), strict=True):
        estimates = effects[effect].estimates
        moved = {**estimates, name: replace(estimates[name], value=value)}
        effects[effect] = replace(effects[effect], estimates=moved)
    latent = model.latent
    if latent is not None and known.hours:
        latent = LatentTips(latent.hours, latent.xyz_cd_m2 + tips)
    return replace(model, effects=tuple(effects.values()), latent=latent)


def _independent_draws(model: DisplayModel, draws: int) -> list[DisplayModel]:
    relative, floor = (float(model.fit.get(f"noise_{name}", 0.0)) for name in ("relative", "floor_cd_m2"))
    uncertain = any(estimate.stderr for each in model.effects for estimate in each.estimates.values())
    if not uncertain and (model.latent is None or not relative + floor):
        return []
    random = np.random.default_rng(0)
    models = []
    for _ in range(draws):
        other = replace(model, effects=tuple(_moved(each, random) for each in model.effects))
        if model.latent is not None:
            hours, tips, readings = model.latent.hours, model.latent.xyz_cd_m2, model.measurements
            tips = tips + _seen(model, hours) - _seen(other, hours)
            # Number of readings of white and primaries at each hour, at least 1: (N, 4).
            read = (readings.drive[:, np.newaxis] == TIP_DRIVES).all(axis=-1) & readings.at_rest()[:, np.newaxis]
            times = np.array([np.maximum(read[readings.hours == hour].sum(axis=0), 1) for hour in hours])
            sigma = np.hypot(relative * tips, floor) / times[..., np.newaxis] ** 0.5
            other = replace(other, latent=LatentTips(hours, tips + sigma * random.standard_normal(tips.shape)))
        models.append(other)
    return models


def _moved(each: AppliedEffect, random: np.random.Generator) -> AppliedEffect:
    """Draw the fitted parameters, within their bounds."""
    estimates = {}
    for name, estimate in each.estimates.items():
        low, high = each.effect.parameters[name].bounds
        off = estimate.stderr * random.standard_normal() if estimate.stderr else 0.0
        estimates[name] = replace(estimate, value=min(max(estimate.value + off, low), high)) if off else estimate
    return replace(each, estimates=estimates)


def _seen(model: DisplayModel, hours: Array) -> Array:
    """Return XYZ in cd/m² of white and primaries under the conditions of the readings, shape (N, 4, 3)."""
    model = replace(model, conditions=REFERENCE)
    return np.array([xyY_to_xyz(model.shown_tips(float(hour))) for hour in hours])


def coarse(colours: Colours) -> Colours:
    """Merge colours that have the same ``_BITS`` highest bits per channel; each merged colour is their mean."""
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
