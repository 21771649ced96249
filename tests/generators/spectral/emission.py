"""Effects on the display's own light, as spectra (n, wavelengths)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.laws import growth
from tests.generators.spectral.spectra import WAVELENGTHS, luminance, tilt, unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.spectral.scene import Effect, Scene

BOLTZMANN = 8.617e-5  # eV/K
FULLY_WARM = 25.0  # °C, at which the temperature has no effect


def primary_shift(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """At low level, bluish light that leaks past the filter replaces a part of a channel's light: ∝ (1 − d)²."""
    bluish = unit(scene.panel.lit * tilt(4.0))
    part = rng.uniform(0.03, 0.07, size=3) * size * (1 - np.minimum(scene.plan.drive, 1)) ** 2
    moved = scene.linear * part
    return np.asarray(
        spectra
        - np.einsum("nc,ncl->nl", moved, scene.primaries)
        + (moved * luminance(scene.primaries)).sum(axis=1, keepdims=True) * bluish
    )


def black_level(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Closed pixels leak bluish light of their own primary. The leak grows with age: polarisers and crystal scatter.

    An OLED with this fault leaks through its transistors, at least as much as a good LCD.
    """
    grown = 1 + rng.uniform(0.3, 1.5) * growth(scene.hours, rng)
    leak = max(scene.panel.leak, 7e-4) * size * grown[:, None] * (1 - np.clip(scene.linear, 0, 1))
    return np.asarray(spectra + np.einsum("nc,ncl->nl", leak, scene.primaries) * tilt(rng.uniform(0.8, 1.8)))


def loading(spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Inner resistance of the supply: 1/(1 + ξ P) of the screen's power. OLEDs also limit above a threshold."""
    power = (scene.screen * scene.panel.power).sum(axis=1)
    droop = 1 / (1 + rng.uniform(0.03, 0.08) * size * power)
    if scene.panel.name == "WRGB OLED":
        droop = droop / (1 + rng.uniform(0.05, 0.12) * size * np.log1p(np.exp((power - 0.35) / 0.08)) * 0.08 / 0.65)
    return np.asarray(spectra * droop[:, None])


def temperature(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Thermal quenching 1/(1 + A(e^(E(1/kT₀ − 1/kT)) − 1)), stronger at long wavelengths: about −0.3 % per kelvin."""
    kelvin = scene.condition("temperature_c") + 273.15
    rest = FULLY_WARM + 273.15
    slope = rng.uniform(0.002, 0.004) * size
    energy = 0.25  # eV, the order of magnitude known for phosphors and for AlInGaP
    strength = slope * BOLTZMANN * rest**2 / energy
    quenched = strength * np.expm1(energy / BOLTZMANN * (1 / rest - 1 / kelvin))
    return np.asarray(spectra / (1 + quenched[:, None] * tilt(-0.8)))


def warm_up(spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Two exponentials, one of the lamp and one of the housing. Short wavelengths of the lamp warm up first."""
    minutes = scene.condition("warmup_min")
    lamp, housing = rng.uniform(6, 15), rng.uniform(35, 80)
    missing = rng.uniform(0.04, 0.1) * size
    cold = 0.65 * np.exp(-minutes / lamp) + 0.35 * np.exp(-minutes / housing)
    return np.asarray(spectra * (1 - (missing * cold)[:, None] * tilt(-0.6)))


def edge_falloff(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """1/(1 + k ρ⁴), redder towards the corners; the effect grows with the hours."""
    depth = rng.uniform(0.15, 0.3) * size * (1 + rng.uniform(0.5, 1.5) * growth(scene.hours, rng))
    falloff = (depth * scene.radius**4)[:, None] * (550.0 / WAVELENGTHS) ** 0.3
    return np.asarray(spectra / (1 + falloff))


def veiling_glare(
    spectra: NDArray[np.float64], scene: Scene, size: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """The glass scatters the screen's light: more from nearby than from far, more at short wavelengths."""
    near = -np.expm1(-2.5 * np.sqrt(scene.condition("window")))[:, None]
    around = near * scene.linear + (1 - near) * scene.surround
    scattered = np.einsum("nc,ncl->nl", around, scene.primaries)
    return np.asarray(spectra + rng.uniform(0.004, 0.009) * size * scattered * tilt(rng.uniform(0.5, 1.5)))


#: In the order in which they act on the light.
EMISSION: dict[str, Effect] = {
    "primary-shift": primary_shift,
    "black-level": black_level,
    "loading": loading,
    "temperature": temperature,
    "warm-up": warm_up,
    "edge-falloff": edge_falloff,
    "veiling-glare": veiling_glare,
}
