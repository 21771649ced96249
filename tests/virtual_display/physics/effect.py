"""``Effect`` and its input ``Scene``, and the decorator that enters an effect into the list."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tests.virtual_display.spectra import CLASSES, Array

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.virtual_display.readings import Readings

STAGES = ("drive", "transfer", "mixing", "emission", "optics", "viewing", "instrument")
LCDS = tuple(name for name, emission in CLASSES.items() if emission.lcd)


@dataclass(frozen=True)
class Traits:
    """Parameters that differ between two displays with the same fault, drawn from the campaign's seed.

    Attributes
    ----------
    channel
        The channel of a fault that affects one channel.
    sign
        Direction of a fault that can have either sign.
    onset
        τ at which a sudden fault appears, between 0.3 and 0.7, and at least 100 h away from any default session.
    lamp_k
        Colour temperature of the room's lamp.

    """

    channel: int
    sign: float
    onset: float
    lamp_k: float

    @classmethod
    def drawn(cls, seed: int) -> Traits:
        """Draw the traits of the display with this seed."""
        rng = np.random.default_rng([seed, 0x7A])
        return cls(
            channel=int(rng.integers(3)),
            sign=float(rng.choice([-1.0, 1.0])),
            onset=float(rng.choice([0.31, 0.42, 0.57, 0.7])),
            lamp_k=float(rng.choice([2900.0, 4000.0, 5000.0])),
        )


@dataclass(frozen=True)
class Scene:
    """The input of an effect besides the signal.

    Attributes
    ----------
    readings
        The patches and their conditions.
    primaries
        Spectra of the primaries at full drive at each reading's hour, before any hidden effect, (n, 3, 81).
    wearing
        Share of these spectra that comes from the phosphor or emitter that ages first, (n, 3, 81).
    traits
        Parameters of this display's faults.

    """

    readings: Readings
    primaries: Array
    wearing: Array
    traits: Traits

    @property
    def tau(self) -> Array:
        """Return the age, (n, 1)."""
        return self.readings.tau[:, np.newaxis]

    @property
    def code(self) -> Array:
        """Return the requested code values, (n, 3)."""
        return self.readings.drive

    @cached_property
    def linear(self) -> Array:
        """Return the requested linear light, (n, 3)."""
        return code_to_linear(self.code)

    @cached_property
    def white(self) -> Array:
        """Return white's spectrum at each reading's hour, (n, 81)."""
        return np.asarray(self.primaries.sum(axis=1))

    @cached_property
    def screen_light(self) -> Array:
        """Return the mean linear light of the whole screen, patch and surround, per channel, (n, 3)."""
        window, surround = self.readings.window[:, np.newaxis], self.readings.surround[:, np.newaxis]
        return np.asarray(window * self.linear + (1.0 - window) * code_to_linear(surround))

    def spectrum(self, linear: Array) -> Array:
        """Return the spectrum of linear light (n, 3) on this display without its fault, (n, 81)."""
        return np.asarray(np.einsum("nc,ncl->nl", linear, self.primaries))


@dataclass(frozen=True)
class Effect:
    """A hidden effect.

    Attributes
    ----------
    name, form, stage
        See the package's docstring.
    act
        ``act(signal, scene, size)`` returns the signal after the effect.
    typical, largest
        Plausible sizes, in ``unit``.
    unit
        Unit of the size.
    baseline
        ``colour-points`` if the effect is visible beside re-measured tips, ``first-hour`` if it is visible only
        against hour 0.
    classes
        Display classes that can have the effect.

    """

    name: str
    form: str
    stage: str
    act: Callable[[Array, Scene, float], Array]
    typical: float
    largest: float
    unit: str
    baseline: str
    classes: tuple[str, ...]


#: Every effect, by name and form.
EFFECTS: dict[tuple[str, str], Effect] = {}


def effect(
    name: str,
    form: str,
    *,
    stage: str,
    typical: float,
    unit: str,
    largest: float | None = None,
    baseline: str = "colour-points",
    classes: tuple[str, ...] = tuple(CLASSES),
) -> Callable[[Callable[[Array, Scene, float], Array]], Callable[[Array, Scene, float], Array]]:
    """Enter the decorated function into ``EFFECTS``; ``largest`` is 10 × ``typical`` unless that is absurd."""

    def enter(act: Callable[[Array, Scene, float], Array]) -> Callable[[Array, Scene, float], Array]:
        bound = 10.0 * typical if largest is None else largest
        EFFECTS[name, form] = Effect(name, form, stage, act, typical, bound, unit, baseline, classes)
        return act

    return enter


def code_to_linear(code: Array) -> Array:
    """Convert sRGB code values to linear light (IEC 61966-2-1)."""
    return np.where(code <= 0.04045, code / 12.92, ((np.maximum(code, 0.0) + 0.055) / 1.055) ** 2.4)


def linear_to_code(linear: Array) -> Array:
    """Convert linear light to sRGB code values (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0) ** (1.0 / 2.4) - 0.055)


def late(tau: Array) -> Array:
    """An S-curve of time: 0 at 0, 1 at 1, steepest at τ = 0.55. The catalogue has a power instead."""

    def logistic(t: Array | float) -> Array:
        return np.asarray(1.0 / (1.0 + np.exp((0.55 - t) / 0.13)))

    return (logistic(tau) - logistic(0.0)) / (logistic(1.0) - logistic(0.0))
