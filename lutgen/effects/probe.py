"""Seeded synthetic readings and parameters, extreme ones too, on which the contract of an effect is tried.

Blacks, primaries, greys and mixtures at hours from 0 to 18 000, under every condition: at the centre and in the
corners, dark and lit, cold and warm (where the minutes are infinite), small windows on bright surrounds.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import LINEAR_TO_XYZ, code_to_linear, transform
from lutgen.effects.scene import LIFE_H, Scene
from lutgen.effects.spectra import SpectralDisplay
from lutgen.readings.conditions import COLUMNS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.colorimetry import Array
    from lutgen.effects.declare import Effect

    #: Sends a reading through an effect with some values of its parameters.
    Applied = Callable[[Effect, "ProbeReading", Mapping[str, float]], Array]

#: Readings of a probe. The number is not 1, 3 or 4: a wrong formula would broadcast with those and stay unnoticed.
READINGS = 48

#: Number of sets of tips that pass at once, as in fits, which need the derivatives of readings by the tips.
TIPS_AT_ONCE = 12

#: All corners of the parameters' bounds are tried up to this number; of more corners, so many at random.
MAX_CORNERS = 256

#: Results whose difference, relative to the largest signal, is below this are equal but for rounding.
ROUNDING = 1e-12

#: Number of random points inside the bounds of the parameters.
DRAWS = 12

_GREYS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
_HOURS = (0.0, 1.0, 500.0, 4000.0, 9000.0, 14_000.0, LIFE_H)
_FRESH_TIPS = 250.0 * np.array([LINEAR_TO_XYZ.sum(axis=1), *LINEAR_TO_XYZ.T])


@dataclass(frozen=True)
class ProbeReading:
    """What an effect is given: the signal of its stage for some readings, and their scene."""

    signal: Array
    scene: Scene


@cache
def readings(stage: str, *, at_rest: bool = False) -> ProbeReading:
    """Return ``READINGS`` readings under all conditions, or under the reference ones; arrays are read-only."""
    random = np.random.default_rng(3)
    corners = np.array(list(product((0.0, 1.0), repeat=3)))
    greys = np.repeat(np.array(_GREYS)[:, np.newaxis], 3, axis=1)
    mixtures = random.uniform(size=(READINGS - len(corners) - len(greys), 3))
    code = np.concatenate([corners, greys, mixtures])[random.permutation(READINGS)]
    hours = np.resize(_HOURS, (READINGS, 1))
    aged = 1.0 - hours / LIFE_H * np.array([0.3, 0.32, 0.4])
    columns: dict[str, Any] = {
        name: np.concatenate([values[:1] * 6, random.choice(values, READINGS - 6)])[random.permutation(READINGS)]
        for name, values in ((column.name, column.tried) for column in COLUMNS.values())
    }
    # A light of three parts that wear: an effect may let each of them wear.
    light = SpectralDisplay.of("ccfl", _FRESH_TIPS)
    scene = Scene(hours=hours, code=code, white=_FRESH_TIPS[:1] * aged, fresh_white=_FRESH_TIPS[:1], light=light)
    if not at_rest:
        scene = replace(scene, **{name: column[:, np.newaxis] for name, column in columns.items()})
    signal = _signal(stage, scene)
    for array in (signal, *arrays(scene).values()):
        array.flags.writeable = False
    return ProbeReading(signal, scene)


def _signal(stage: str, scene: Scene) -> Array:
    if stage == "drive":
        return scene.code.copy()
    linear = code_to_linear(scene.code)
    if stage in {"transfer", "mixing"}:
        return linear
    # Tips that almost add up, as those of measured displays do.
    primaries = LINEAR_TO_XYZ.T * (scene.white / LINEAR_TO_XYZ.sum(axis=1))[:, np.newaxis]
    if stage == "emission":
        return np.concatenate([scene.white[:, np.newaxis], 0.99 * primaries], axis=1)
    return np.asarray(transform(LINEAR_TO_XYZ, linear) * scene.white / LINEAR_TO_XYZ.sum(axis=1))


def arrays(scene: Scene) -> dict[str, Array]:
    """Return the arrays of a scene by name."""
    names = sorted((field.name for field in fields(scene)), key=lambda name: name in COLUMNS)
    values = {name: getattr(scene, name) for name in names}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


def copied(reading: ProbeReading) -> ProbeReading:
    """Return a reading in arrays of its own, which may be written."""
    own: dict[str, Any] = {name: array.copy() for name, array in arrays(reading.scene).items()}
    return ProbeReading(reading.signal.copy(), replace(reading.scene, **own))


def some(reading: ProbeReading, rows: slice, stage: str) -> ProbeReading:
    """Return the readings of ``rows`` alone."""
    scene: dict[str, Any] = {
        name: array[..., rows, :] if array.shape[-2] > 1 else array for name, array in arrays(reading.scene).items()
    }
    signal = reading.signal[..., rows, :, :] if stage == "emission" else reading.signal[..., rows, :]
    return ProbeReading(signal, replace(reading.scene, **scene))


def at_once(reading: ProbeReading) -> ProbeReading:
    """Return ``TIPS_AT_ONCE`` versions along a leading axis, with other tips and another white in the same scene."""
    factors = np.linspace(0.9, 1.1, TIPS_AT_ONCE)
    signal = np.multiply.outer(factors, reading.signal)
    return ProbeReading(signal, replace(reading.scene, white=np.multiply.outer(factors, reading.scene.white)))


def with_column(reading: ProbeReading, column: str, values: Array) -> ProbeReading:
    """Return the readings with another value of one column each."""
    changed: dict[str, Any] = {column: values}
    return ProbeReading(reading.signal, replace(reading.scene, **changed))


def other_values(column: str) -> Array:
    """Return values of a column that differ from the reference, one a reading."""
    return np.resize(np.array(COLUMNS[column].tried[1:]), (READINGS, 1))


def parameter_corners(bounds: Mapping[str, tuple[float, float]]) -> list[dict[str, float]]:
    """Return every corner of the bounds, or ``MAX_CORNERS`` of them by chance."""
    if 2 ** len(bounds) <= MAX_CORNERS:
        return [dict(zip(bounds, corner, strict=True)) for corner in product(*bounds.values())]
    random = np.random.default_rng(5)
    return [{name: float(random.choice(ends)) for name, ends in bounds.items()} for _ in range(MAX_CORNERS)]


def parameter_draws(bounds: Mapping[str, tuple[float, float]], count: int) -> list[dict[str, float]]:
    """Return ``count`` points inside the bounds, by chance."""
    shares = np.random.default_rng(7).uniform(size=(count, len(bounds)))
    return [
        {
            name: float(low * (1.0 - share) + high * share)
            for share, (name, (low, high)) in zip(row, bounds.items(), strict=True)
        }
        for row in shares
    ]


def draws(effect: Effect) -> list[dict[str, float]]:
    """Return ``DRAWS`` points inside the bounds of the effect's parameters, by chance."""
    return parameter_draws({name: each.bounds for name, each in effect.parameters.items()}, DRAWS)


def same(first: Array, second: Array) -> bool:
    """Say whether two results agree but for rounding."""
    scale = max(float(np.nanmax(np.abs(first), initial=0.0)), float(np.nanmax(np.abs(second), initial=0.0)))
    return first.shape == second.shape and np.allclose(first, second, rtol=0, atol=ROUNDING * scale, equal_nan=True)


def reacts_to(effect: Effect) -> tuple[str, ...]:
    """Return the columns of the readings that change the result of the effect, named in its ``needs`` or not.

    The effect keeps the contract: a function that raises is the caller's to handle.
    """
    with np.errstate(all="ignore"):
        return tuple(column for column in COLUMNS if reacts(effect, column, _apply, at_rest=False))


def reacts(effect: Effect, column: str, apply: Applied, *, at_rest: bool) -> bool:
    """Say whether another value of a column changes the result, with the typical parameters or with drawn ones."""
    reading = readings(effect.stage, at_rest=at_rest)
    other = with_column(reading, column, other_values(column))
    return any(
        not same(apply(effect, reading, values), apply(effect, other, values))
        for values in (effect.typical(), *draws(effect))
    )


def _apply(effect: Effect, reading: ProbeReading, values: Mapping[str, float]) -> Array:
    given = copied(reading)
    return effect.function(given.signal, given.scene, **values)
