"""Optics yellow: films, glue and light guide absorb more and more of the short wavelengths.

Transmittance exp(−a·g(τ)·e^(−(λ−400 nm)/λ₀)), applied to the display's spectra. The spectra are estimated from the
class of the display. g is a power of time. The depth a is never negative: optics do not become clear again.

Meaning of 0 and 1: ``depth`` 0 is clear optics. ``depth`` 1 transmits 1/e, 37 %, of the light at 400 nm at 18 000 h.
Valid as far as the spectra are. With an estimated spectrum the size is an estimate too. The LUT is correct in both
cases, because it is fitted to XYZ.
Source: all colour LCDs of a radiology practice yellowed over three years, and did so together: "Aging and quality
control of color LCDs for radiologic imaging", J. Digit. Imaging 24, 828 (2011), doi:10.1007/s10278-010-9346-x.
Assumption: the exponential in wavelength, and the size.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER, SATURATION, growth
from lutgen.effects.spectra import WAVELENGTHS, mapped, of_scene


@effect(
    stage="optics",
    neutral={"depth": 0.0},
    forms=(("depth",), ("depth", "power"), ("depth", "power", "reach"), ("depth", "power", "saturation", "reach")),
    baseline="first-hour",
    confused_with={
        "phosphor-wear": "a spectrum; with a guessed one both give the same picture",
        "meter-drift": "a second meter or a check source",
        "channel-decay": "spectra of the primaries: yellowing also moves their chromaticities",
    },
    source="doi:10.1007/s10278-010-9346-x (that displays yellow); form and size: an assumption",
    depth=Parameter(0.1, (0.0, 2.0), "1", "optical depth at 400 nm that has grown by 18 000 h"),
    power=POWER,
    saturation=SATURATION,
    reach=Parameter(60.0, (20.0, 300.0), "nm", "λ₀, over which the depth falls to 1/e towards red"),
)
def yellowing(xyz: Array, scene: Scene, *, depth: float, power: float, saturation: float, reach: float) -> Array:
    """Multiply the display's spectra by the transmittance."""
    if not depth:
        return xyz
    tau, index = np.unique(scene.tau, return_inverse=True)
    size = growth(tau, new=0.0, grown=depth, power=power, saturation=saturation)
    passed = np.exp(-size[:, np.newaxis] * np.exp((400.0 - WAVELENGTHS) / reach))
    return mapped(xyz, of_scene(scene.light, "yellowing").maps(passed)[index.reshape(-1)])
