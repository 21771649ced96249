"""Simulated aging that the colour points follow: one 3 x 3 matrix of XYZ for every hour, applied to the real light.

One matrix transforms black, white, primaries and every mixture. So a model of the real display at hour 0 with
re-measured colour points has the same accuracy at later hours as at hour 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.real.response import WAVELENGTHS, observer, spectra
from tests.generators.real.scene import LIFE_H

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.generators.real.response import Display
    from tests.generators.real.sessions import Array

    # Arguments: display, hours (m,), strength, random generator. Result: matrices (m, 3, 3) of XYZ.
    Decay = Callable[[Display, Array, float, np.random.Generator], Array]


def healthy(display: Display, hours: Array, rng: np.random.Generator) -> Array:
    """Return matrices (m, 3, 3) for the aging of a healthy display, drawn from three classes; simulated.

    ``dimming``: the luminance follows a power of time. ``held``: the luminance is constant, the tint drifts. ``late``:
    the luminance first rises a little, as that of LED lamps does, and then falls. In all classes blue fades more than
    green and red, and the filters lose a little purity.
    """
    age = hours / LIFE_H
    kind = str(rng.choice(["dimming", "held", "late"]))
    loss = rng.uniform(0.1, 0.45)
    level = {
        "dimming": (1.0 + age * rng.uniform(1.0, 4.0)) ** (-loss),
        "held": np.ones_like(age),
        "late": 1.0 + 0.02 * age * np.exp(1.0 - 8.0 * age) * 8.0 - loss * age**2 / (1.0 + age**2),
    }[kind]
    fading = np.array([rng.uniform(0.0, 0.015), rng.uniform(0.0, 0.02), rng.uniform(0.02, 0.08)])
    speed = rng.uniform(0.5, 2.0)
    gains = level[:, None] * (1.0 - fading * (1.0 - np.exp(-speed * age[:, None])) / (1.0 - np.exp(-speed)))
    bleed = np.abs(rng.normal(0.0, 0.0015, (3, 3))) * (1.0 - np.eye(3))
    aged = display.primaries @ (np.eye(3) + bleed * age[:, None, None]) * gains[:, None, :]
    matrices = aged @ np.linalg.inv(display.primaries)
    if kind == "held":
        matrices /= ((matrices @ display.white)[:, 1] / display.white[1])[:, None, None]
    return np.asarray(matrices)


def backlight_decay(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """Lamp decay: a logistic function of the logarithm of time, 30 % at 18 000 h; simulated."""
    del display
    level = 1.0 / (1.0 + _odds(0.30 * strength) * (hours / LIFE_H) ** rng.uniform(1.1, 1.6))
    return _scaled(level)


def burn_in_decay(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """Early loss of a part of the light (second-order kinetics): 6 % within the first hundreds of hours; simulated."""
    del display
    early = rng.uniform(300.0, 900.0)
    return _scaled(1.0 - 0.06 * strength * hours / (hours + early) - 0.02 * strength * hours / LIFE_H)


def stabilizer_headroom(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """A regulator holds the luminance until its reserve is used up. A p-norm rounds the transition; simulated.

    At strength 1 the luminance is 22 % below the set value at 18 000 h. The transition lies at about 40–60 % of the
    life.
    """
    del display
    knee, sharp = rng.uniform(0.4, 0.6), 24.0
    reserve = (1.0 + _odds(min(0.22 * strength, 0.9))) ** (-(hours / LIFE_H - knee) / (1.0 - knee))
    level = (1.0 + reserve**-sharp) ** (-1.0 / sharp)
    return _scaled(level / level[0])


def channel_decay(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """Each emitter ages separately, blue most (organic LEDs): a logistic function of log time; simulated."""
    loss = strength * np.array([rng.uniform(0.08, 0.16), rng.uniform(0.06, 0.12), rng.uniform(0.2, 0.3)])
    power = rng.uniform(0.6, 0.9)
    gains = 1.0 / (1.0 + _odds(loss) * (hours[:, None] / LIFE_H) ** power)
    return np.asarray(display.primaries * gains[:, None, :] @ np.linalg.inv(display.primaries))


def phosphor_wear(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """The yellow phosphor loses more light than the blue chip below 490 nm, on estimated spectra; simulated."""
    wear = strength * 0.12 * (1.0 - (1.0 + hours / rng.uniform(5e3, 9e3)) ** -1.0)
    phosphor = 1.0 / (1.0 + np.exp(-(WAVELENGTHS - 490.0) / 6.0))
    return _filtered(display, 1.0 - wear[:, None] * phosphor)


def yellowing(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """A polymer in front of the panel yellows. Its absorbance falls with a power of the wavelength; simulated.

    11 % at 450 nm at 18 000 h, on estimated spectra. (The literature often draws the absorption edge of aged polymers
    as such a power law.)
    """
    power = rng.uniform(5.0, 8.0)
    absorbed = 0.12 * strength * (hours / LIFE_H) ** rng.uniform(0.8, 1.2)
    return _filtered(display, np.exp(-absorbed[:, None] * (450.0 / WAVELENGTHS) ** power))


def meter_drift(display: Display, hours: Array, strength: float, rng: np.random.Generator) -> Array:
    """The instrument loses sensitivity: 0.8 % in the first year, later more slowly; simulated."""
    del display
    return _scaled(1.0 - 0.008 * strength * (hours / 8766.0) ** rng.uniform(0.7, 0.9))


def _odds(loss: float | Array) -> Array:
    share = np.clip(np.asarray(loss, dtype=np.float64), -0.9, 0.9)
    return np.asarray(share / (1.0 - share))


def _scaled(level: Array) -> Array:
    return np.asarray(level[:, None, None] * np.eye(3))


def _filtered(display: Display, transmittance: Array) -> Array:
    """Return matrices (m, 3, 3) for transmittances (m, 31) in front of the spectra.

    The difference between the estimated spectra and the real light stays.
    """
    lost = np.einsum("mw,wx,wc->mxc", transmittance - 1.0, observer(), spectra(display.name))
    return np.asarray((display.primaries + lost) @ np.linalg.inv(display.primaries))


KINDS: dict[str, Decay] = {
    "backlight-decay": backlight_decay,
    "burn-in-decay": burn_in_decay,
    "phosphor-wear": phosphor_wear,
    "yellowing": yellowing,
    "stabilizer-headroom": stabilizer_headroom,
    "channel-decay": channel_decay,
    "meter-drift": meter_drift,
}
