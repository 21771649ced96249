"""The meter's filters move along the wavelengths, and its 3 × 3 mismatch changes.

XYZ' = M·XYZ, M from what x̄(λ − s), ȳ(λ − s) and z̄(λ − s) read of the display's primaries, s = Δ·τ^p: a 3 × 3 matrix
for displays of one kind (ASTM E1455), of which one number is free.

Light adds up, so white, primaries and mixtures go through the same matrix. Where white and primaries are measured again
in every session nothing is left that could show it, and what the mismatch is in the first session is in the display
itself; only its change shows, and only where the first session foretells the others. A free matrix would say almost all
that aging does to white and primaries; a shift of the filters has a pattern of its own: red and blue, on the flanks of
ȳ, gain and lose luminance against each other, and green hardly changes.

Meaning of 0 and 1: ``shift`` 0 are filters that stay where they are; 1 are filters that have moved by 1 nm towards red
by 18 000 h.
Valid for three filters that move alike, or the wavelength scale of a spectroradiometer, of one meter over the whole
campaign; as far as the display's spectra are known. Room light and stray light count as light of the display.
Never baked: a meter adds no light to the display.
Source: the matrix: ASTM E1455; the observer: CIE 15:2018.
Assumption: the shift as the form of the change, and its size, some tenths of a nanometre.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used: few readings need this effect

from lutgen.colorimetry import inverse
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.shapes import POWER
from lutgen.effects.spectra import CMFS, WAVELENGTHS, mapped, of_scene

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="instrument",
    neutral={"shift": 0.0},
    forms=(("shift",), ("shift", "power")),
    baseline="first-hour",
    confused_with={
        "meter-drift": "a check source",
        "phosphor-wear": "a second meter, or spectra of the primaries",
        "yellowing": "a second meter, or spectra of the primaries",
        "channel-decay": "a second meter, or spectra of the primaries",
    },
    says="the meter's filters move by {shift:.2g} nm in 18 000 h",
    source="ASTM E1455 (the matrix); form and size: an assumption",
    shift=Parameter(0.5, (-4.0, 4.0), "nm", "way of the filters towards red by 18 000 h"),
    power=POWER,
)
def meter_mismatch(xyz: Array, scene: Scene, *, shift: float, power: float) -> Array:
    """Read the display's light with filters that have moved."""
    if not shift:
        return xyz
    spectra = of_scene(scene.light, "meter-mismatch").spectra
    tau, index = np.unique(scene.tau, return_inverse=True)
    response = _observer()(WAVELENGTHS - shift * tau[:, np.newaxis] ** power)
    before, after = (np.einsum("pl,...lx->...px", spectra, each) for each in (CMFS, np.nan_to_num(response)))
    maps = np.einsum("cp,tpx->txc", inverse(before), after)
    return mapped(xyz, maps[index.reshape(-1)])


@cache
def _observer() -> scipy.interpolate.CubicSpline:
    """Colour-matching functions at any wavelength, (..., 3); not a number beyond the table, where they are 0."""
    return scipy.interpolate.CubicSpline(WAVELENGTHS, CMFS, extrapolate=False)
