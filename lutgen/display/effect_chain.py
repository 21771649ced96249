"""The chain of a display with effects, as links that separate the hour-independent part from the aging part.

There are two links. :class:`PanelLink` converts code values to the share of each tip in the light. :class:`LightLink`
converts these shares to XYZ. Effects use luminance in cd/m²; the result of the chain is relative to the white of the
un-aged display.

In a mode that holds white's luminance, the held luminance is the luminance under the reference conditions, at which a
display's sensor is calibrated. So a corner stays darker than the centre, and a cold display stays dimmer than a warm
display.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np

from lutgen.colorimetry import Array
from lutgen.display import trace
from lutgen.display.chain import AgedDisplay
from lutgen.display.conditions import REFERENCE, Conditions
from lutgen.display.native import NativeDisplay
from lutgen.display.trace import Applied
from lutgen.effects import Scene
from lutgen.effects.spectra import SpectralDisplay, class_of
from lutgen.errors import LutgenError
from lutgen.readings.rest import TIP_DRIVES

#: Stages before the emission, whose effects do not depend on the tips.
PANEL_STAGES = ("drive", "transfer", "mixing")

#: White as code values.
_WHITE = np.ones((1, 3))

#: Number of code values of the ramp that reveals steps of a curve: four times as fine as 12 bits.
_RAMP = 2**14

#: Colours that show a difference between ``nearest`` and ``continuous``, if there is one.
_GREYS_AND_MORE = np.array(list(product((0.3, 0.6, 1.0), repeat=3)))

#: Tolerance for equal linear light: smaller than the resolution of float32.
_NO_JUMP = 1e-8

#: Relative tolerance of white's luminance in the secant search: of the size of rounding errors.
_HELD = 1e-13

#: XYZ of white, red, green, blue, as tuples, so that links can be compared and pickled for workers.
FourTips = tuple[tuple[float, ...], ...]


def four_tips(xyz_cd_m2: Array) -> FourTips:
    """Return tips (4, 3) as nested tuples."""
    return tuple(tuple(float(value) for value in tip) for tip in xyz_cd_m2)


@dataclass(frozen=True)
class Surroundings:
    """The inputs of effects besides the signal, for one hour."""

    hours: float
    #: XYZ in cd/m² of white, red, green, blue before any effect, at this hour and at hour 0.
    tips: FourTips
    fresh: FourTips
    #: Description of the display in the readings, for the estimate of its spectra.
    display_class: str
    #: Conditions under which the display is seen.
    conditions: Conditions = REFERENCE

    def scene(self, code: Array) -> Scene:
        """Return the scene of code values (n, 3)."""
        return Scene(code=code, **self._around)

    @cached_property
    def _around(self) -> dict[str, Any]:
        """Fields of the scene that do not depend on code values; cached, because a search uses them often."""
        return {
            "hours": np.full((1, 1), self.hours),
            "white": np.array(self.tips[:1]),
            "fresh_white": np.array(self.fresh[:1]),
            "capped": np.zeros((1, 1)),
            "light": SpectralDisplay.of(class_of(self.display_class), np.array(self.fresh)),
            **{name: np.full((1, 1), value) for name, value in self.conditions.as_dict().items()},
        }


@dataclass(frozen=True)
class PanelLink:
    """Code values (n, 3) → share of each tip in the light, and the code values, (n, 7): drive, transfer, mixing.

    ``surroundings`` is None if no effect needs them; the link is then the same at every hour. ``native`` is the fresh
    display; None: the paper's fresh display. If the fresh display has its own model, the result has three more columns
    with the model's gain.
    """

    applied: tuple[Applied, ...]
    selection: str
    surroundings: Surroundings | None = None
    native: NativeDisplay | None = None

    def __call__(self, signal: Array) -> Array:
        """Convert code values (n, 3) to (n, 7) or (n, 10)."""
        empty = Scene(np.zeros((1, 1)), signal, np.ones((1, 3)), np.ones((1, 3)))
        scene = self.surroundings.scene(signal) if self.surroundings else empty
        panel = trace.panel(self.applied, scene, self.selection, native=self.native)
        shares = _finite(panel.shares, self.applied)
        gain = () if panel.gain is None else (panel.gain,)
        return np.column_stack([np.broadcast_to(shares, (len(signal), 4)), signal, *gain])


@dataclass(frozen=True)
class Fresh:
    """The fresh display on which effects act."""

    #: Selection of the paper's matrix.
    selection: str
    #: The native fresh display; None: the paper's fresh display.
    native: NativeDisplay | None = None
    #: Whether the readings of the first session already contain the effects. Then only the effects' change since hour 0
    #: is applied; otherwise the effects show at hour 0 too.
    contains_effects: bool = False

    def panel(self, signal: Array, applied: tuple[Applied, ...], surroundings: Surroundings) -> trace.Panel:
        """Return the panel from the signal of a :class:`PanelLink`, (n, 7 or 10)."""
        gain = signal[:, 7:] if signal.shape[1] > 7 else None
        black = self.native.black if self.native else None
        before = trace.Panel(signal[:, :4], black, gain)
        if not (self.contains_effects and applied):
            return before
        fresh = surroundings.fresh
        now = Surroundings(0.0, fresh, fresh, surroundings.display_class)
        first = now.scene(signal[:, 4:7])
        plain, changed = (trace.panel(each, first, self.selection, native=self.native) for each in ((), applied))
        return before.relative_to_first_session(
            *trace.since_first_session(applied, changed, plain, np.array([now.tips]), first)
        )


@dataclass(frozen=True)
class LightLink:
    """Shares of the tips (n, 7 or 10) → XYZ (n, 3): emission, optics, viewing, with the tips of ``surroundings``.

    ``scale`` converts cd/m² to XYZ relative to the un-aged white. ``fresh`` is the display on which effects act.
    """

    applied: tuple[Applied, ...]
    surroundings: Surroundings
    scale: float
    fresh: Fresh

    def __call__(self, signal: Array) -> Array:
        """Convert the signal (n, 7 or 10) to XYZ (n, 3)."""
        scene = self.surroundings.scene(signal[:, 4:7])
        before = self.fresh.panel(signal, self.applied, self.surroundings)
        tips = np.array([self.surroundings.tips])
        xyz = trace.emitted(self.applied, before, tips, scene, ("optics", "viewing"))
        return _finite(np.broadcast_to(xyz, (len(signal), 3)) * self.scale, self.applied)


def _finite(signal: Array, applied: tuple[Applied, ...]) -> Array:
    if not np.isfinite(signal).all():
        names = ", ".join(each.effect.name for each in applied)
        raise LutgenError(
            f"the display gives NaN or infinity for some colours, with these effects and values: {names}."
        )
    return signal


@cache
def makes_steps(each: Applied, surroundings: Surroundings) -> bool:
    """Whether an effect turns a ramp into a staircase: most rises have no rise directly before or after them."""
    if each.effect.stage not in PANEL_STAGES:
        return False
    ramp = np.repeat(np.linspace(0.0, 1.0, _RAMP + 1)[:, np.newaxis], 3, axis=1)
    curve = each.effect.function(ramp, surroundings.scene(ramp), **each.values)
    rises = np.diff(np.broadcast_to(curve, ramp.shape), axis=0) != 0.0
    alone = rises[1:-1] & ~rises[:-2] & ~rises[2:]
    return bool(alone.sum() > 0.5 * rises.sum())


def jumps(aged: AgedDisplay) -> bool:
    """Whether a display with effects jumps at white's border: it uses ``nearest``, and its tips are not additive."""
    panel = next((link for link in (*aged.head, *aged.tail) if isinstance(link, PanelLink)), None)
    if panel is None or panel.selection != "nearest":
        return False
    continuous = replace(panel, selection="continuous")
    head, tail = (tuple(continuous if link is panel else link for link in part) for part in (aged.head, aged.tail))
    other = replace(aged, head=head, tail=tail)
    gap = aged.code_to_linear(_GREYS_AND_MORE) - other.code_to_linear(_GREYS_AND_MORE)
    return bool(np.abs(gap).max() > _NO_JUMP)


def without_steps(aged: AgedDisplay) -> AgedDisplay | None:
    """Return the display without the effects that make steps, which no table represents; None: no such effects."""
    for link in aged.tail:
        if isinstance(link, PanelLink) and link.surroundings:
            smooth = tuple(each for each in link.applied if not makes_steps(each, link.surroundings))
            if smooth != link.applied:
                tail = tuple(replace(link, applied=smooth) if other is link else other for other in aged.tail)
                return replace(aged, tail=tail)
    return None


@dataclass(frozen=True)
class EffectChain:
    """A display's effects and conditions, without an hour; :meth:`at` returns the display at an hour."""

    applied: tuple[Applied, ...]
    conditions: Conditions
    fresh: Fresh

    def at(self, mode: str, hours: float, now: Surroundings, luminance: Callable[[float], float]) -> AgedDisplay:
        """Return the display of ``mode`` at ``hours``.

        ``now``: hour and tips, under the reference conditions. ``luminance``: a function from white's luminance with
        the effects alone to white's luminance in the mode, both relative to hour 0.

        Raises LutgenError: no gain gives white this luminance, or the effects give NaN or infinity.
        """
        new, aged = self._whites(now)
        target = luminance(aged / new) * new
        lit = _scaled(now, self._gain(now, aged, target))
        panel = self._panel(replace(now, conditions=self.conditions))
        light = LightLink(self.applied, replace(lit, conditions=self.conditions), 1.0 / new, self.fresh)
        if panel.surroundings is None:
            return AgedDisplay(mode, hours, (panel,), (light,))
        return AgedDisplay(mode, hours, (), (panel, light))

    def dimming(self, now: Surroundings) -> float:
        """Return white's emitted luminance relative to hour 0, under the reference conditions."""
        new, aged = self._whites(now)
        return aged / new

    def _whites(self, now: Surroundings) -> tuple[float, float]:
        """Return the luminance of white in cd/m² at hour 0 and at the hour of ``now``."""
        return self._white(replace(now, hours=0.0, tips=now.fresh), 1.0), self._white(now, 1.0)

    def tips(self, now: Surroundings) -> Array:
        """Return XYZ in cd/m² of white, red, green and blue under the model's conditions, (4, 3)."""
        now = replace(now, conditions=self.conditions)
        return LightLink(self.applied, now, 1.0, self.fresh)(self._panel(now)(TIP_DRIVES))

    def _panel(self, now: Surroundings) -> PanelLink:
        acting = tuple(each for each in self.applied if each.effect.stage in PANEL_STAGES)
        return PanelLink(acting, self.fresh.selection, now if acting else None, self.fresh.native)

    def _white(self, now: Surroundings, gain: float) -> float:
        """Return white's emitted luminance in cd/m², under the reference conditions, with all tips times ``gain``."""
        lit = _scaled(now, gain)
        before = self.fresh.panel(self._panel(now)(_WHITE), self.applied, lit)
        white = trace.emitted(self.applied, before, np.array([lit.tips]), lit.scene(_WHITE))
        return float(_finite(np.asarray(white), self.applied)[..., 1].squeeze())

    def _gain(self, now: Surroundings, aged: float, target: float) -> float:
        """Return the factor on all tips that gives white the luminance ``target``, by the secant method."""
        last, was, gain = 1.0, aged, target / aged if aged > 0 else np.nan
        for _ in range(50):
            if not 0 < gain < np.inf:
                break
            reached = self._white(now, gain)
            if abs(reached - target) <= _HELD * target:
                return gain
            slope = (reached - was) / (gain - last) if gain != last else 0.0
            last, was, gain = gain, reached, gain + (target - reached) / slope if slope > 0 else np.nan
        names = ", ".join(each.effect.name for each in self.applied)
        raise LutgenError(
            f"hour {now.hours:g}: no backlight brings white to {target:.4g} cd/m² with these effects: {names}. "
            f"Check their values."
        )


def _scaled(now: Surroundings, gain: float) -> Surroundings:
    return replace(now, tips=four_tips(np.array(now.tips) * gain)) if gain != 1.0 else now
