"""Aging that the colour points follow: the primaries' spectra at every hour, and the effects that only hour 0 shows.

A display has natural aging (``natural``) unless one of these effects or ``meter-drift`` is hidden. Then only the hidden
effects age the display, so that the list of hidden effects is complete.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from tests.generators.spectral.laws import LIFE, generator, growth, log_logistic
from tests.generators.spectral.spectra import WAVELENGTHS, uv

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from tests.generators.spectral.displays import Panel

    Aging = Callable[[Panel, NDArray[np.float64], float, np.random.Generator], NDArray[np.float64]]

#: Effect → factors on the primaries' spectra, broadcast to (hours, 3, wavelengths).
AGING: dict[str, Aging] = {}


def primaries(panel: Panel, hours: NDArray[np.float64], hidden: Mapping[str, float], seed: int) -> NDArray[np.float64]:
    """Return the spectra of the primaries (hours, 3, wavelengths) at the hours (hours,)."""
    spectra = np.broadcast_to(panel.primaries, (len(hours), *panel.primaries.shape))
    named = [name for name in AGING if name in hidden]
    if not named and "meter-drift" not in hidden:
        return spectra * natural(panel, hours, generator(seed, "natural aging"))
    for name in named:
        spectra = spectra * AGING[name](panel, hours, hidden[name], generator(seed, name))
    return spectra


def natural(panel: Panel, hours: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """White dims or is held constant, and yellows; channels drift slightly apart. The amounts are random."""
    held = rng.random() < 0.4
    loss = rng.uniform(0.0, 0.04) if held else rng.uniform(0.1, 1.2)
    dimming = log_logistic(hours, loss=loss, power=rng.uniform(0.8, 1.6))
    apart = 1 - growth(hours, rng)[:, None] * rng.uniform(0, 0.03, size=3)
    return (
        dimming[:, None, None]
        * apart[..., None]
        * _yellowed(panel, rng.uniform(0.002, 0.009), growth(hours, rng))
        * _worn(panel, rng.uniform(0.0005, 0.003), growth(hours, rng))
    )


def _amount(panel: Panel, change: Callable[[float], NDArray[np.float64]], target: float, most: float) -> float:
    """Return the amount (at most ``most``) whose factors shift white by ``target`` in u'v'."""
    white = panel.primaries.sum(axis=0)

    def excess(amount: float) -> float:
        return float(np.linalg.norm(uv(white * change(amount)) - uv(white))) - target

    return most if excess(most) <= 0 else float(brentq(excess, 0.0, most, xtol=1e-6))


def _yellowed(panel: Panel, target: float, course: NDArray[np.float64]) -> NDArray[np.float64]:
    """The absorbance falls as a logistic edge in wavelength; white shifts by ``target`` in u'v' at the end."""
    edge = 1 / (1 + np.exp((WAVELENGTHS - 450) / 38))
    amount = _amount(panel, lambda a: np.asarray(10 ** (-a * edge)), target, 3.0)
    return np.asarray(10 ** (-amount * course[:, None, None] * edge))


def _worn(panel: Panel, target: float, course: NDArray[np.float64]) -> NDArray[np.float64]:
    """One emitter of the display class loses light; white shifts by ``target`` in u'v' at the end."""
    share = panel.parts[panel.worn] / np.maximum(panel.lit, 1e-12)
    amount = _amount(panel, lambda a: 1 - a * share, target, 0.9)
    return np.asarray(1 - amount * course[:, None, None] * share)


def _light(factors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return factors of all light, (hours,), in the shape of factors on spectra."""
    return np.asarray(factors[:, None, None])


def backlight_decay(
    panel: Panel, hours: NDArray[np.float64], size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Log-logistic decay: a typical display keeps 38–56 % at 18 000 h."""
    del panel
    return _light(log_logistic(hours, loss=rng.uniform(0.8, 1.6) * size, power=rng.uniform(1.1, 1.6)))


def burn_in_decay(
    panel: Panel, hours: NDArray[np.float64], size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A fast part decays hyperbolically (second-order kinetics); a slow part decays linearly."""
    del panel
    fast, time = min(rng.uniform(0.04, 0.08) * size, 0.5), rng.uniform(250, 900)
    slow = min(rng.uniform(0.1, 0.25) * size, 0.9)
    return _light(fast / (1 + hours / time) + (1 - fast) * (1 - slow * hours / LIFE))


def phosphor_wear(
    panel: Panel, hours: NDArray[np.float64], size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """One emitter loses light with saturation: t/(t + T)."""
    time = rng.uniform(6000, 15000)
    return _worn(panel, 0.009 * size, (hours / (hours + time)) * (1 + time / LIFE))


def yellowing(panel: Panel, hours: NDArray[np.float64], size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Plastics in the light path absorb short wavelengths; logistic in time."""
    return _yellowed(panel, 0.010 * size, growth(hours, rng))


def stabilizer_headroom(
    panel: Panel, hours: NDArray[np.float64], size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """A controller holds the luminance until the reserve of the lamp is used up; the transition is rounded."""
    del panel
    reserve, sharpness = rng.uniform(1.2, 1.5), rng.uniform(20, 50)
    lamp = reserve * log_logistic(hours, loss=1.2 * size, power=1.3)
    held = (1 + lamp**-sharpness) ** (-1 / sharpness)
    return _light(held / held[0])


def channel_decay(
    panel: Panel, hours: NDArray[np.float64], size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Each channel decays as (1 + t/T)^−p, blue the fastest."""
    del panel
    loss = np.clip(np.array([0.18, 0.22, 0.34]) * rng.uniform(0.8, 1.2, size=3) * size, 0, 0.95)
    time = rng.uniform(2000, 6000)
    power = -np.log(1 - loss) / np.log1p(LIFE / time)
    return np.asarray((1 + hours[:, None] / time) ** -power)[..., None]


AGING.update({
    "backlight-decay": backlight_decay,
    "burn-in-decay": burn_in_decay,
    "phosphor-wear": phosphor_wear,
    "yellowing": yellowing,
    "stabilizer-headroom": stabilizer_headroom,
    "channel-decay": channel_decay,
})  # fmt: skip
