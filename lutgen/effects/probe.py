"""Seeded synthetic readings and parameters, including extreme values, for the check of an effect's contract.

The readings are blacks, primaries, greys and mixtures at hours from 0 to 18 000, under every condition: in the centre
and in the corners, in dark and lit rooms, with a cold and a warm display (infinite minutes), with small windows on
bright surrounds.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from lutgen.colorimetry import LINEAR_TO_XYZ, Array, code_to_linear, transform
from lutgen.effects.declare import Effect
from lutgen.effects.scene import LIFE_H, Scene
from lutgen.effects.spectra import SpectralDisplay
from lutgen.readings.conditions import COLUMNS

#: Function that applies an effect, with values of its parameters, to a reading.
Applied = Callable[[Effect, "ProbeReading", Mapping[str, float]], Array]

#: Number of readings of a probe. Not 1, 3 or 4, because a wrong formula could broadcast with 1, 3 or 4 unnoticed.
READINGS = 48

#: Number of sets of tips on a leading axis. Fits use such an axis for the derivatives of readings by the tips.
TIPS_AT_ONCE = 12

#: Largest number of corners of the parameters' bounds; if there are more corners, this number is drawn at random.
MAX_CORNERS = 256

#: Tolerance for rounding errors, relative to the largest signal.
ROUNDING = 1e-12

#: Number of random points inside the bounds of the parameters.
DRAWS = 12

_GREYS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
_HOURS = (0.0, 1.0, 500.0, 4000.0, 9000.0, 14_000.0, LIFE_H)
_FRESH_TIPS = 250.0 * np.array([LINEAR_TO_XYZ.sum(axis=1), *LINEAR_TO_XYZ.T])


@dataclass(frozen=True)
class ProbeReading:
    """The inputs of an effect for some readings: the signal of its stage, and the scene."""

    signal: Array
    scene: Scene


@cache
def readings(stage: str, *, at_rest: bool = False) -> ProbeReading:
    """Return ``READINGS`` readings under all conditions, or under reference conditions, in read-only arrays."""
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
    # A light source with three wearing parts, for the effects that wear each part.
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
    # Almost additive tips, like the tips of measured displays.
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
    """Return a copy of a reading in writable arrays."""
    own: dict[str, Any] = {name: array.copy() for name, array in arrays(reading.scene).items()}
    return ProbeReading(reading.signal.copy(), replace(reading.scene, **own))


def some(reading: ProbeReading, rows: slice, stage: str) -> ProbeReading:
    """Return the readings of ``rows``."""
    scene: dict[str, Any] = {
        name: array[..., rows, :] if array.shape[-2] > 1 else array for name, array in arrays(reading.scene).items()
    }
    signal = reading.signal[..., rows, :, :] if stage == "emission" else reading.signal[..., rows, :]
    return ProbeReading(signal, replace(reading.scene, **scene))


def at_once(reading: ProbeReading) -> ProbeReading:
    """Return ``TIPS_AT_ONCE`` versions along a leading axis, with different tips and whites in the same scene."""
    factors = np.linspace(0.9, 1.1, TIPS_AT_ONCE)
    signal = np.multiply.outer(factors, reading.signal)
    return ProbeReading(signal, replace(reading.scene, white=np.multiply.outer(factors, reading.scene.white)))


def parameter_corners(bounds: Mapping[str, tuple[float, float]]) -> list[dict[str, float]]:
    """Return every corner of the bounds, or ``MAX_CORNERS`` random corners."""
    if 2 ** len(bounds) <= MAX_CORNERS:
        return [dict(zip(bounds, corner, strict=True)) for corner in product(*bounds.values())]
    random = np.random.default_rng(5)
    return [{name: float(random.choice(ends)) for name, ends in bounds.items()} for _ in range(MAX_CORNERS)]


def parameter_draws(bounds: Mapping[str, tuple[float, float]], count: int) -> list[dict[str, float]]:
    """Return ``count`` random points inside the bounds."""
    shares = np.random.default_rng(7).uniform(size=(count, len(bounds)))
    low, high = np.array(list(bounds.values())).reshape(-1, 2).T
    return [dict(zip(bounds, row, strict=True)) for row in (low * (1.0 - shares) + high * shares).tolist()]


def draws(effect: Effect) -> list[dict[str, float]]:
    """Return ``DRAWS`` random points inside the bounds of the effect's parameters."""
    return parameter_draws({name: each.bounds for name, each in effect.parameters.items()}, DRAWS)


def same(first: Array, second: Array) -> bool:
    """Whether two results agree within rounding errors."""
    scale = max(float(np.nanmax(np.abs(first), initial=0.0)), float(np.nanmax(np.abs(second), initial=0.0)))
    return first.shape == second.shape and np.allclose(first, second, rtol=0, atol=ROUNDING * scale, equal_nan=True)


def reacts_to(effect: Effect) -> tuple[str, ...]:
    """Return the columns of the readings that change the result of the effect, whether ``needs`` names them or not.

    The effect must satisfy the contract; the caller handles exceptions of its function.
    """
    with np.errstate(all="ignore"):
        return tuple(column for column in COLUMNS if reacts(effect, column, _apply, at_rest=False))


def reacts(effect: Effect, column: str, apply: Applied, *, at_rest: bool) -> bool:
    """Whether another value of a column changes the result, at the typical parameters or at random parameters."""
    reading = readings(effect.stage, at_rest=at_rest)
    # One value for each reading, different from the reference value.
    values: Any = {column: np.resize(np.array(COLUMNS[column].tried[1:]), (READINGS, 1))}
    other = ProbeReading(reading.signal, replace(reading.scene, **values))
    return any(
        not same(apply(effect, reading, values), apply(effect, other, values))
        for values in (effect.typical(), *draws(effect))
    )


def _apply(effect: Effect, reading: ProbeReading, values: Mapping[str, float]) -> Array:
    given = copied(reading)
    return effect.function(given.signal, given.scene, **values)
