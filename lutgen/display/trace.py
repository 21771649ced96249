"""The chain with effects: from code value to the light that a meter would see, stage by stage.

Without effects it computes what the paper's links do. Which of the four matrices a colour uses under ``nearest`` is
decided by the code values that were asked for, not by what effects have made of them: the selection is bookkeeping
of the model, and its borders are to stay where they are while an effect is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from lutgen.colorimetry import code_to_linear, transform
from lutgen.display.paper import continuous_weights, nearest_weights
from lutgen.effects import STAGES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display.native import NativeDisplay
    from lutgen.effects import Effect, Scene


class Applied(Protocol):
    """An effect and the values of its parameters."""

    @property
    def effect(self) -> Effect:
        """The effect."""
        ...

    @property
    def values(self) -> Mapping[str, float]:
        """Every parameter's value."""
        ...

    def __hash__(self) -> int:
        """Allow what is computed of an effect to be kept."""
        ...


#: Effects behind the panel let through more than this share of the light; less light of white than that has no factor.
LEAST_RISE, LEAST_LIGHT = 0.05, 1e-9

#: An effect of this stage switches the selection to ``continuous``; with values beside 0 it says itself how much of a
#: colour is grey, instead of its smallest channel.
SELECTION_STAGE = "selection"


def is_soft(each: Applied) -> bool:
    """Whether an effect says itself how much of a colour is grey, instead of the paper's ``continuous``."""
    return each.effect.stage == SELECTION_STAGE and any(each.values.values())


def in_chain_order(applied: Sequence[Applied]) -> list[Applied]:
    """Sort effects by stage, each stage's by name: the order never depends on that of adding them."""
    order = list(STAGES)
    return sorted(applied, key=lambda each: (order.index(each.effect.stage), each.effect.name))


def through(applied: Sequence[Applied], stages: tuple[str, ...], signal: Array, scene: Scene) -> Array:
    """Send a signal through the effects of some stages."""
    acting = [each for each in applied if each.effect.stage in stages]
    for each in in_chain_order(acting) if len(acting) > 1 else acting:
        signal = each.effect.function(signal, scene, **each.values)
    return signal


@dataclass(frozen=True)
class Panel:
    """The signal behind drive, transfer and mixing: linear light per channel and its share of each tip."""

    #: XYZ = Σ share · tip over white, red, green, blue: (n, 4).
    shares: Array
    #: X, Y and Z of code 0, K, as shares of white's, for a native display: XYZ = K + Σ share · (tip − K). None: black
    #: gives no light.
    black: tuple[float, float, float] | None = None
    #: Factor of X, Y and Z by the display's own model, (n, 3); None: 1.
    gain: Array | None = None
    #: X, Y and Z that are added, as shares of white's, (n, 3); None: 0.
    offset: Array | None = None

    def emit(self, tips: Array) -> Array:
        """XYZ (..., n, 3) of tips (..., n or 1, 4, 3)."""
        return self._beside(self._added_up(tips), tips[..., 0, :])

    def emit_by(self, tips: Array, places: Sequence[NDArray[np.intp] | slice]) -> Array:
        """XYZ (..., n, 3) of tips (..., k, 4, 3), each of which holds for the colours at its places."""
        xyz = np.empty((*tips.shape[:-3], len(self.shares), 3))
        white = xyz if self.black is None and self.offset is None else np.empty_like(xyz)
        for index, place in enumerate(places):
            of_group = tips[..., index, :, :]
            white[..., place, :] = of_group[..., :1, :]
            xyz[..., place, :] = self.shares[place] @ of_group
        return self._beside(xyz, white)

    def _beside(self, xyz: Array, white: Array) -> Array:
        """XYZ with what there is beside the shares of the tips; ``white`` (..., n or 1, 3)."""
        if self.black is not None:
            xyz = xyz + self.of_white * white
        if self.gain is not None:
            xyz = self.gain * xyz
        return xyz if self.offset is None else np.asarray(xyz + self.offset * white)

    def _added_up(self, tips: Array) -> Array:
        if self.shares.ndim == 2 and tips.shape == (1, 4, 3):
            # The same products and sums in the same order, column by column.
            return transform(tips[0].T, self.shares)
        if self.shares.ndim == 2 and tips.ndim == 3:
            return np.asarray(np.einsum("nk,nkc->nc", self.shares, tips))
        white, red, green, blue = np.moveaxis(self.shares, -1, 0)[..., np.newaxis]
        return np.asarray(
            white * tips[..., 0, :] + red * tips[..., 1, :] + green * tips[..., 2, :] + blue * tips[..., 3, :]
        )

    @property
    def of_white(self) -> Array:
        """What black adds: shares of white's X, Y and Z, (n, 3)."""
        lit = self.shares.sum(axis=-1)
        return np.asarray((1.0 - lit)[..., np.newaxis] * np.array(self.black or (0.0, 0.0, 0.0)))

    @property
    def linear(self) -> Array:
        """Linear light of each channel, (n, 3)."""
        return self.shares[:, 1:] + self.shares[:, :1]

    def times(self, factor: Array | None) -> Panel:
        """Return the panel with X, Y and Z brighter by a factor (n, 3); None: 1."""
        if factor is None:
            return self
        return replace(self, gain=factor if self.gain is None else self.gain * factor)

    def with_light(self, linear: Array) -> Panel:
        """Return the panel with so much more light of the three channels, (n, 3)."""
        return replace(self, shares=self.shares + np.concatenate([np.zeros((len(linear), 1)), linear], axis=1))

    def begun(self, factor: Array, offset: Array) -> Panel:
        """Return the panel whose effects begin with the first session (:func:`since_first_session`)."""
        return replace(self.times(factor), offset=offset)


def tip_shares(
    linear: Array, code: Array, selection: str, weights: Array | None = None, grey: Array | None = None
) -> Array:
    """Share of each tip in a colour, (n, 4), whose linear light is (n, 3): the paper's emission by its closed form.

    With D = W − R − G − B: ``continuous`` gives Σ l_c P_c + D·(smallest channel), ``nearest`` gives
    Σ l_c P_c + ⅓D·(Σ l − Σ_i w_i l_i), w_i the share of primary i's matrix. ``weights`` are those of ``nearest`` when
    they are known already, (n, 4). ``grey``: what to take for the smallest channel, (n,); None: itself.
    """
    if selection == "nearest":
        weights = nearest_weights(code_to_linear(code)) if weights is None else weights
    else:
        weights = continuous_weights(linear)
    # Channel by channel: numpy adds along a short last axis many times slower.
    red, green, blue = np.moveaxis(linear, -1, 0)
    _, *(of_red, of_green, of_blue) = weights.T
    extra = of_red * red + of_green * green + of_blue * blue
    if selection == "nearest":
        extra = (red + green + blue - extra) / 3.0
    if grey is not None:
        extra = grey
    return np.stack([extra, red - extra, green - extra, blue - extra], axis=-1)


def panel(
    applied: Sequence[Applied],
    scene: Scene,
    selection: str,
    weights: Array | None = None,
    *,
    native: NativeDisplay | None = None,
) -> Panel:
    """Follow the code values through drive, transfer and mixing: what does not depend on the tips.

    The fresh display is ``native``, or where that is None the paper's: sRGB's curve, black without light. An own model
    makes up for whichever matrix is taken: its display takes the continuous ones, which jump nowhere.
    """
    if native and native.own:
        selection = "continuous"
    if any(each.effect.stage == SELECTION_STAGE for each in applied):
        selection = "continuous"
    drive = through(applied, ("drive",), scene.code, scene)
    fresh = native.linear(drive) if native else code_to_linear(drive)
    if weights is None and selection == "nearest":
        # Where no effect touches the drive, and the curve is sRGB's, the light that was asked for is known already.
        asked = fresh if drive is scene.code and not native else code_to_linear(scene.code)
        weights = nearest_weights(asked)
    linear = through(applied, ("transfer", "mixing"), fresh, scene)
    soft = [each for each in applied if is_soft(each)]
    grey = through(soft, (SELECTION_STAGE,), linear, scene)[..., 0] if soft else None
    shares = tip_shares(linear, scene.code, selection, weights, grey)
    return Panel(shares, native.black, native.own_gain(drive)) if native else Panel(shares)


def since_first_session(
    applied: Sequence[Applied], before: Panel, plain: Panel, tips: Array, first: Scene
) -> tuple[Array, Array]:
    """Return factor and offset for :meth:`Panel.begun`: the readings of the first session contain its effects already.

    The factor of X, Y and Z, (n, 3), takes out what effects up to the emission do at hour 0; the offset, (n, 3), as
    shares of white, what effects behind the emission do. ``first``: code values at hour 0, at rest. ``before``,
    ``plain``: the panel of that scene with the effects and without. ``tips``: as measured at hour 0, (1, 4, 3).
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
    # A line through two points is exact for what effects do: to add light, and to take a share of it.
    other = 2.0 * target - shown
    again = through(applied, behind, other, first)
    moved = other != target
    rise = np.where(moved, again - shown, 1.0) / np.where(moved, other - target, 1.0)
    light = other + (target - again) / np.where(rise > LEAST_RISE, rise, 1.0)
    return factor, (light - target) / white


def emitted(applied: Sequence[Applied], before: Panel, tips: Array, scene: Scene) -> Array:
    """XYZ that leaves the display, (..., n, 3): emission and optics, from tips (..., n or 1, 4, 3)."""
    return through(applied, ("optics",), before.emit(through(applied, ("emission",), tips, scene)), scene)


def reported(applied: Sequence[Applied], before: Panel, tips: Array, scene: Scene) -> Array:
    """XYZ that a meter reports, (..., n, 3): with the room's light and the instrument's own faults."""
    return metered(applied, before.emit(through(applied, ("emission",), tips, scene)), scene)


def metered(applied: Sequence[Applied], xyz: Array, scene: Scene) -> Array:
    """XYZ that a meter reports, (..., n, 3), of what the display emits."""
    xyz = through(applied, ("optics", "viewing"), xyz, scene)
    return through(applied, ("instrument",), xyz * (1.0 - scene.capped), scene)


#: Number of sets of code values whose answers are kept, and the most numbers that such a set may hold: a table is kept,
#: an image is not.
KEPT, MOST = 8, 30_000


class Remembered:
    """The last few answers about code values, which nobody may alter: a fit asks about the same code values often."""

    def __init__(self) -> None:
        self._answers: dict[tuple[tuple[int, ...], bytes], Array] = {}

    def of(self, code: Array, compute: Callable[[], Array]) -> Array:
        """Return the answer for code values (..., 3); ``compute`` gives it where none is kept."""
        if code.size > MOST:
            return compute()
        key = code.shape, code.tobytes()
        answer = self._answers.pop(key, None)
        if answer is None:
            answer = compute()
            answer.flags.writeable = False
        self._answers[key] = answer
        # Threads may ask at once: the second thread then finds that the first has removed the old answers.
        for old in list(self._answers)[:-KEPT]:
            self._answers.pop(old, None)
        return answer
