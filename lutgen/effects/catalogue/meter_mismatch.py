"""The meter's filters shift in wavelength, and the 3 × 3 matrix of its mismatch changes.

XYZ' = M·XYZ. The matrix M (3 × 3, as in ASTM E1455, for displays of one kind) follows from the XYZ that
x̄(λ − s), ȳ(λ − s) and z̄(λ − s) give for the spectra of the display's primaries. The shift s = Δ·τ^p has one free
number, Δ.

Light is additive, so white, primaries and mixtures pass through the same matrix. Where white and primaries are measured
again in every session, the readings cannot show the mismatch. White and primaries of the first session contain the
mismatch of that session. Only the change of the mismatch is visible, and only where the first session predicts the
later sessions. A free matrix could describe almost every change of white and primaries by aging. A shift of the filters
has a pattern of its own: red and blue lie on opposite flanks of ȳ, so one gains luminance and the other loses
luminance; green hardly changes.

Meaning of 0 and 1: ``shift`` 0 are filters that do not move. ``shift`` 1 are filters that have moved by 1 nm towards
red at 18 000 h.
Valid for three filters that move alike, or for the wavelength scale of a spectroradiometer, of one meter over the whole
campaign. The accuracy is that of the display's spectra. Room light and stray light count as light of the display.
Never baked: a meter adds no light to the display.
Source: the matrix: ASTM E1455; the observer: CIE 15:2018.
Assumption: the shift as the form of the change, and its size of some tenths of a nanometre.
"""

from functools import cache

import numpy as np
import scipy  # its parts load when they are first used: few readings need this effect

from lutgen.colorimetry import Array, inverse
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene
from lutgen.effects.shapes import POWER
from lutgen.effects.spectra import CMFS, WAVELENGTHS, mapped, of_scene


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
    shift=Parameter(0.5, (-4.0, 4.0), "nm", "shift of the filters towards red by 18 000 h"),
    power=POWER,
)
def meter_mismatch(xyz: Array, scene: Scene, *, shift: float, power: float) -> Array:
    """Multiply the readings by the matrix of the shifted filters."""
    if not shift:
        return xyz
    spectra = of_scene(scene.light, "meter-mismatch").spectra
    tau, index = np.unique(scene.tau, return_inverse=True)
    response = _observer()(WAVELENGTHS - shift * tau[:, np.newaxis] ** power)
    before, after = (np.einsum("pl,...lx->...px", spectra, each) for each in (CMFS, np.nan_to_num(response)))
    maps = np.einsum("cp,tpx->txc", inverse(before), after)
    return mapped(xyz, maps[index.reshape(-1)])


@cache
def _observer() -> "scipy.interpolate.CubicSpline":
    """Return a spline of the colour-matching functions, (..., 3); it gives NaN outside the table, where they are 0."""
    return scipy.interpolate.CubicSpline(WAVELENGTHS, CMFS, extrapolate=False)
