"""Functions that several effects share: growth in time, a gamma by level, unequal primaries, and the mean of a picture.

*Growth.* :func:`growth` is a power of time (``power``) that may saturate (``saturation``). An effect with several
amplitudes declares them at 18 000 h; ``onset`` is the share of all amplitudes at hour 0.

*Gamma by level.* l' = l^(1 + Γ(d)). Γ is a cubic spline of the code value d with coefficients at five knots: the free
form of each drift of the transfer curve. A constant Γ is a plain power law, so the free form contains the simple form.
The light of codes 0 and 1 does not change. Light stays positive for all coefficients. Uniform cubic B-splines: de Boor,
A Practical Guide to Splines (1978). Two outer coefficients extrapolate the inner coefficients linearly, so that the
spline reproduces constants and straight lines exactly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.effects.declare import Parameter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene

#: Parameters of the growth. ``onset`` is ``GROWING`` (typically 0: no effect at hour 0) or ``LASTING`` (typically 1: a
#: constant effect).
POWER = Parameter(1.0, (0.3, 6.0), "1", "power of time in the growth")
SATURATION = Parameter(0.0, (0.0, 20.0), "1", "saturation of the growth by 18 000 h, in nepers; 0: a power of time")
GROWING = Parameter(0.0, (0.0, 1.5), "1", "share of the size at 18 000 h that is there at hour 0", beside_first=0.0)
LASTING = Parameter(1.0, (0.0, 1.5), "1", "share of the size at 18 000 h that is there at hour 0", beside_first=0.0)

#: Names of the parameters that describe the growth of an effect in time.
COURSE = frozenset(("power", "saturation", "onset"))


def growth(tau: Array, *, new: float, grown: float, power: float, saturation: float = 0.0) -> Array:
    """Return the size at τ of an amplitude: ``new`` at hour 0, ``new`` + ``grown`` at τ = 1, a power of time between.

    With ``saturation`` s the growth is Weibull's law, (1 − e^(−s τ^p))/(1 − e^(−s)): an exponential approach for
    p = 1. For larger powers p the law is an S-curve, within 1 % of most logistic curves.
    """
    size = tau**power
    if saturation:
        size = np.expm1(-saturation * size) / np.expm1(-saturation)
    return new + grown * size


def share_of_final(tau: Array, *, onset: float, power: float, saturation: float = 0.0) -> Array:
    """Return the size at τ as a share of the size at τ = 1, in the shape of ``tau``."""
    return growth(tau, new=onset, grown=1.0 - onset, power=power, saturation=saturation)


#: Smallest exponent of light; keeps the light finite at the bounds of every parameter.
LEAST_EXPONENT = 0.05

#: Polynomial coefficients of four neighbouring B-splines (columns); rows are powers of the position in a segment.
_BASIS = np.array([[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]) / 6.0


def is_knot(name: str) -> bool:
    """Whether a parameter's name is that of a knot of a Γ by level: the name ends with the code value in per cent."""
    return name.rpartition("_")[2].isdigit()


def level_parameters(name: str, meaning: str) -> dict[str, Any]:
    """Return the parameters of the five knots of a Γ by level; ``meaning`` has a place for the code value."""
    codes = {"00": "0", "25": "0.25", "50": "0.5", "75": "0.75", "100": "1"}
    return {f"{name}_{knot}": Parameter(0.0, (-0.6, 2.0), "1", meaning.format(code)) for knot, code in codes.items()}


def level_curve(code: Array, knots: Sequence[float] | Array) -> Array:
    """Return Γ at code values of any shape; ``knots`` are the coefficients at equal steps from code 0 to 1."""
    given = np.asarray(knots, dtype=np.float64)
    padded = np.concatenate([[2 * given[0] - given[1]], given, [2 * given[-1] - given[-2]]])
    segments = given.size - 1
    windows = np.stack([padded[k : k + segments] for k in range(4)])
    pieces = (_BASIS[:, :, np.newaxis] * windows).sum(axis=1)
    place = np.clip(code, 0.0, 1.0) * segments
    index = np.minimum(place.astype(np.intp), segments - 1)
    place -= index
    curve = pieces[3][index]
    for piece in pieces[2::-1]:
        curve *= place
        curve += piece[index]
    return np.asarray(curve)


def bent(light: Array, change: Array) -> Array:
    """Raise light (or code values) to the power 1 + ``change``; shapes broadcast; negative light counts as 0."""
    return np.asarray(np.maximum(light, 0.0) ** np.maximum(1.0 + change, LEAST_EXPONENT))


def scaled(tips: Array, gain: Array) -> Array:
    """Multiply the primaries of tips (..., n or 1, 4, 3) by gains (n or 1, 3).

    White is the sum of the scaled primaries and of the remainder W − R − G − B times the mean gain, so that equal gains
    scale the whole display.
    """
    white, primaries = tips[..., 0, :], tips[..., 1:, :]
    remainder = white - primaries[..., 0, :] - primaries[..., 1, :] - primaries[..., 2, :]
    faded = primaries * gain[..., np.newaxis]
    new_white = faded[..., 0, :] + faded[..., 1, :] + faded[..., 2, :] + remainder * gain.mean(axis=-1, keepdims=True)
    return np.concatenate([new_white[..., np.newaxis, :], faded], axis=-2)


def over_screen(
    scene: Scene, power: float, *, weight_red: float = 0.0, weight_blue: float = 0.0, brightest: float = 0.0
) -> tuple[Array, Array]:
    """Return means of code values to a power: over the whole screen, and over the patch alone, (n, 1) each.

    The mean of a patch has weights 1 + ``weight_red``, 1 and 1 + ``weight_blue``; ``brightest`` is the share, 0 to 1,
    that its largest code value has instead of this mean.
    """
    patch, surround = scene.code, scene.surround
    if power != 1.0:
        patch, surround = np.maximum(patch, 0.0) ** power, np.maximum(surround, 0.0) ** power
    weights = np.array([1.0 + weight_red, 1.0, 1.0 + weight_blue]) / (3.0 + weight_red + weight_blue)
    own = (patch * weights).sum(axis=-1, keepdims=True)
    if brightest:
        own = (1.0 - brightest) * own + brightest * patch.max(axis=-1, keepdims=True)
    return scene.window * own + (1.0 - scene.window) * surround, own
