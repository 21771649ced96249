"""The chain with effects: from code value to the light that a meter would measure, stage by stage.

Without effects the result equals that of the paper's links. Under ``nearest`` the original code values select the
matrix, not the code values after the effects. The selection is a part of the model, and its borders must not move while
a fit changes an effect.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from lutgen.colorimetry import code_to_linear, transform
from lutgen.display.paper import nearest_weights, tip_shares
from lutgen.effects.declare import chain_order

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display.native import NativeDisplay
    from lutgen.effects import Effect, Scene


class Applied(Protocol):
    """An effect and the values of its parameters."""

    @property
    def effect(self) -> Effect:
        """The effect."""

    @property
    def values(self) -> Mapping[str, float]:
        """Value of every parameter."""

    def __hash__(self) -> int:
        """Allow caches of results by effect."""


#: Smallest slope of the effects after the emission, as a share; and the smallest share of white's light for which a
#: factor is computed.
LEAST_RISE, LEAST_LIGHT = 0.05, 1e-9

#: An effect of this stage switches the selection to ``continuous``. The grey of a colour is then its smallest channel;
#: the effect computes another grey if one of its parameters differs from 0.
SELECTION_STAGE = "selection"


def is_soft(each: Applied) -> bool:
    """Whether an effect of the selection computes another grey of a colour than its smallest channel."""
    return each.effect.stage == SELECTION_STAGE and any(each.values.values())


def in_chain_order(applied: Sequence[Applied]) -> list[Applied]:
    """Return effects sorted by stage, then by name, so that their order of addition does not matter."""
    return sorted(applied, key=lambda each: chain_order(each.effect))


def through(applied: Sequence[Applied], stages: tuple[str, ...], signal: Array, scene: Scene) -> Array:
    """Return the signal after the effects of these stages."""
    acting = [each for each in applied if each.effect.stage in stages]
    for each in in_chain_order(acting) if len(acting) > 1 else acting:
        signal = each.effect.function(signal, scene, **each.values)
    return signal


@dataclass(frozen=True)
class Panel:
    """The signal after drive, transfer and mixing: the share of each tip in a colour."""

    #: Shares of white, red, green, blue, (n, 4): XYZ = Σ share · tip.
    shares: Array
    #: For a native display: black K (X, Y and Z of code 0) as shares of white's X, Y and Z; XYZ = K + Σ share · (tip −
    #: K). None: black has no light.
    black: tuple[float, float, float] | None = None
    #: Factor on X, Y and Z from the display's own model, (n, 3); None: 1.
    gain: Array | None = None
    #: Added X, Y and Z as shares of white's X, Y and Z, (n, 3); None: 0.
    offset: Array | None = None

    def emit(self, tips: Array) -> Array:
        """Return XYZ (..., n, 3) for tips (..., n or 1, 4, 3)."""
        return self._with_black(self._sum_of_tips(tips), tips[..., 0, :])

    def emit_by(self, tips: Array, places: Sequence[NDArray[np.intp] | slice]) -> Array:
        """Return XYZ (..., n, 3) for tips (..., k, 4, 3); ``places``: the rows of the colours of each set of tips."""
        xyz = np.empty((*tips.shape[:-3], len(self.shares), 3))
        # Without black and offset nothing reads white: save an array, and let the light overwrite white.
        white = xyz if self.black is None and self.offset is None else np.empty_like(xyz)
        for index, place in enumerate(places):
            of_group = tips[..., index, :, :]
            white[..., place, :] = of_group[..., :1, :]
            xyz[..., place, :] = self.shares[place] @ of_group
        return self._with_black(xyz, white)

    def _with_black(self, xyz: Array, white: Array) -> Array:
        """Return XYZ with black, gain and offset applied; ``white`` (..., n or 1, 3)."""
        if self.black is not None:
            xyz = xyz + self.of_white * white
        if self.gain is not None:
            xyz = self.gain * xyz
        return xyz if self.offset is None else np.asarray(xyz + self.offset * white)

    def _sum_of_tips(self, tips: Array) -> Array:
        if self.shares.ndim == 2 and tips.shape == (1, 4, 3):
            # The same products and sums in the same order, by columns.
            return transform(tips[0].T, self.shares)
        if self.shares.ndim == 2 and tips.ndim == 3:
            return np.asarray(np.einsum("nk,nkc->nc", self.shares, tips))
        white, red, green, blue = np.moveaxis(self.shares, -1, 0)[..., np.newaxis]
        return np.asarray(
            white * tips[..., 0, :] + red * tips[..., 1, :] + green * tips[..., 2, :] + blue * tips[..., 3, :]
        )

    @property
    def of_white(self) -> Array:
        """The light of black in each colour, as shares of white's X, Y and Z, (n, 3)."""
        lit = self.shares.sum(axis=-1)
        return np.asarray((1.0 - lit)[..., np.newaxis] * np.array(self.black or (0.0, 0.0, 0.0)))

    @property
    def linear(self) -> Array:
        """Linear light of each channel, (n, 3)."""
        return self.shares[:, 1:] + self.shares[:, :1]

    def times(self, factor: Array | None) -> Panel:
        """Return the panel with X, Y and Z multiplied by a factor (n, 3); None: 1."""
        if factor is None:
            return self
        return replace(self, gain=factor if self.gain is None else self.gain * factor)

    def with_light(self, linear: Array) -> Panel:
        """Return the panel with linear light, (n, 3), added to the three channels."""
        return replace(self, shares=self.shares + np.concatenate([np.zeros((len(linear), 1)), linear], axis=1))

    def relative_to_first_session(self, factor: Array, offset: Array) -> Panel:
        """Return the panel without the change by the effects at hour 0; arguments from :func:`since_first_session`."""
        return replace(self.times(factor), offset=offset)


def panel(
    applied: Sequence[Applied],
    scene: Scene,
    selection: str,
    weights: Array | None = None,
    *,
    native: NativeDisplay | None = None,
) -> Panel:
    """Return the panel of the scene's code values after drive, transfer and mixing, which do not depend on the tips.

    ``native``: the fresh display; None: the paper's fresh display with sRGB's curve and black without light. A display
    with its own model uses ``continuous``, which has no jumps; the own model's gain corrects the choice of matrix.
    """
    if native and native.own:
        selection = "continuous"
    if any(each.effect.stage == SELECTION_STAGE for each in applied):
        selection = "continuous"
    drive = through(applied, ("drive",), scene.code, scene)
    fresh = native.linear(drive) if native else code_to_linear(drive)
    if weights is None and selection == "nearest":
        # If no effect changes the drive, and the curve is sRGB's, the linear light of the code values is already known.
        linear_code = fresh if drive is scene.code and not native else code_to_linear(scene.code)
        weights = nearest_weights(linear_code)
    linear = through(applied, ("transfer", "mixing"), fresh, scene)
    soft = [each for each in applied if is_soft(each)]
    grey = through(soft, (SELECTION_STAGE,), linear, scene)[..., 0] if soft else None
    shares = tip_shares(linear, scene.code, selection, weights, grey)
    return Panel(shares, native.black, native.own_gain(drive)) if native else Panel(shares)


def since_first_session(
    applied: Sequence[Applied], before: Panel, plain: Panel, tips: Array, first: Scene
) -> tuple[Array, Array]:
    """Return factor and offset for :meth:`Panel.relative_to_first_session`.

    The readings of the first session already contain the effects at hour 0. The factor on X, Y and Z, (n, 3), removes
    the change at hour 0 by effects up to the emission. The offset, (n, 3), in shares of white, removes the change at
    hour 0 by effects after the emission. ``first``: code values at hour 0, at rest. ``before``, ``plain``: the panel of
    this scene with and without effects. ``tips``: measured at hour 0, (1, 4, 3).
    """
    target = plain.emit(tips)
    sent = before.emit(through(applied, ("emission",), tips, first))
    white = tips[:, 0]
    lit = sent > LEAST_LIGHT * white
    factor = np.where(lit, target / np.where(lit, sent, 1.0), 1.0)
    behind = ("optics", "viewing", "instrument")
    shown = through(applied, behind, target, first)
    if not (shown != target).any():
        return factor, np.zeros_like(target)
    # A line through two points is exact for effects that add light or multiply light by a factor.
    other = 2.0 * target - shown
    again = through(applied, behind, other, first)
    moved = other != target
    rise = np.where(moved, again - shown, 1.0) / np.where(moved, other - target, 1.0)
    light = other + (target - again) / np.where(rise > LEAST_RISE, rise, 1.0)
    return factor, (light - target) / white


def lit_by(tips: Array, scene: Scene) -> Scene:
    """Return the scene of the effects after the emission: its white is that of the emitted tips (..., n or 1, 4, 3).

    Light that leaks or scatters comes from the aged backlight, not from the backlight before the effects.
    """
    return replace(scene, white=tips[..., 0, :])


def emitted(
    applied: Sequence[Applied], before: Panel, tips: Array, scene: Scene, stages: tuple[str, ...] = ("optics",)
) -> Array:
    """Return the emitted XYZ, (..., n, 3), after emission and ``stages``, for tips (..., n or 1, 4, 3)."""
    tips = through(applied, ("emission",), tips, scene)
    return through(applied, stages, before.emit(tips), lit_by(tips, scene))


def reported(applied: Sequence[Applied], before: Panel, tips: Array, scene: Scene) -> Array:
    """Return the XYZ that a meter reports, (..., n, 3), with room light and errors of the instrument."""
    tips = through(applied, ("emission",), tips, scene)
    return metered(applied, before.emit(tips), lit_by(tips, scene))


def metered(applied: Sequence[Applied], xyz: Array, scene: Scene) -> Array:
    """Return the XYZ that a meter reports, (..., n, 3), for emitted XYZ and the scene of :func:`lit_by`."""
    xyz = through(applied, ("optics", "viewing"), xyz, scene)
    return through(applied, ("instrument",), xyz * (1.0 - scene.capped), scene)
