"""The chain of a display with effects, as links: what of it is the same at every hour, and what ages.

Two links: :class:`PanelLink` takes code values to each tip's share of the light, :class:`LightLink` takes those to
XYZ. Effects know luminance in cd/m²; what comes out is relative to the white of the un-aged display, as everywhere.

White's luminance, where a mode holds it, is that under the reference conditions, at which a display's sensor is
calibrated: a corner stays darker than the centre, and a cold display dimmer than a warm one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.display import trace
from lutgen.display.chain import AgedDisplay
from lutgen.display.conditions import REFERENCE
from lutgen.effects import Scene
from lutgen.effects.spectra import SpectralDisplay, class_of
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.display.conditions import Conditions
    from lutgen.display.native import NativeDisplay
    from lutgen.display.trace import Applied

#: Stages whose effects act before the tips come in.
PANEL_STAGES = ("drive", "transfer", "mixing")

#: White as code values.
_WHITE = np.ones((1, 3))

#: Steps of a curve are looked for on a ramp of this many code values: four times as fine as 12 bits.
_RAMP = 2**14

#: Colours on which ``nearest`` and ``continuous`` differ, if they differ at all.
_GREYS_AND_MORE = np.array(list(product((0.3, 0.6, 1.0), repeat=3)))

#: Linear light that differs by less is the same: float32 cannot tell.
_NO_JUMP = 1e-8

#: White's luminance is brought to the wanted one within this share of it, which is rounding alone.
_HELD = 1e-13

#: XYZ of white, red, green, blue, as tuples, so that links can be compared and sent to workers.
FourTips = tuple[tuple[float, ...], ...]


def four_tips(xyz_cd_m2: Array) -> FourTips:
    """Freeze tips of shape (4, 3)."""
    return tuple(tuple(float(value) for value in tip) for tip in xyz_cd_m2)


@dataclass(frozen=True)
class Surroundings:
    """What effects may know besides the signal."""

    hours: float
    #: White, red, green, blue before any effect, now and at hour 0, in cd/m².
    tips: FourTips
    fresh: FourTips
    #: What the readings say of the display's kind, for a spectral estimate.
    display_class: str
    #: Where and when it is seen.
    conditions: Conditions = REFERENCE

    def scene(self, code: Array) -> Scene:
        """Return what surrounds the code values (n, 3)."""
        return Scene(code=code, **self._around)

    @cached_property
    def _around(self) -> dict[str, Any]:
        """What is the same for all code values, by field: a search asks for it thousands of times."""
        return {
            "hours": np.full((1, 1), self.hours),
            "white": np.array(self.tips[:1]),
            "fresh_white": np.array(self.fresh[:1]),
            "capped": np.zeros((1, 1)),
            "light": _spectral_display(self.display_class, self.fresh),
            **{name: np.full((1, 1), value) for name, value in self.conditions.as_dict().items()},
        }


@cache
def _spectral_display(display_class: str, fresh: FourTips) -> SpectralDisplay:
    """Estimate the display's spectra from its class: less than a millisecond, once for all hours."""
    return SpectralDisplay.of(class_of(display_class), np.array(fresh))


@dataclass(frozen=True)
class PanelLink:
    """Code values (n, 3) → each tip's share of the light and the code values again, (n, 7): drive, transfer, mixing.

    ``surroundings`` is None where no effect asks for them: the link is then the same at every hour. ``native`` is the
    fresh display; None: the paper's. The gain of its own model follows in three more columns where it has one.
    """

    applied: tuple[Applied, ...]
    selection: str
    surroundings: Surroundings | None = None
    native: NativeDisplay | None = None
    stage: str = "mixing"

    def __call__(self, signal: Array) -> Array:
        """(n, 3) code → (n, 7)."""
        scene = self.surroundings.scene(signal) if self.surroundings else _nowhere(signal)
        panel = trace.panel(self.applied, scene, self.selection, native=self.native)
        shares = _finite(panel.shares, self.applied)
        gain = () if panel.gain is None else (panel.gain,)
        return np.column_stack([np.broadcast_to(shares, (len(signal), 4)), signal, *gain])


def _nowhere(code: Array) -> Scene:
    return Scene(np.zeros((1, 1)), code, np.ones((1, 3)), np.ones((1, 3)))


@dataclass(frozen=True)
class Fresh:
    """The display that effects act on."""

    #: The paper's choice of matrix.
    selection: str
    #: The fresh display; None: the paper's.
    native: NativeDisplay | None = None
    #: Whether the readings of the first session contain the effects already, so that only what effects change after it
    #: counts; else effects show at hour 0 too.
    told: bool = False

    def panel(self, signal: Array, applied: tuple[Applied, ...], surroundings: Surroundings) -> trace.Panel:
        """Return each tip's share of the light from the signal of a :class:`PanelLink`, (n, 7 or 10)."""
        gain = signal[:, 7:] if signal.shape[1] > 7 else None
        black = self.native.black if self.native else None
        before = trace.Panel(signal[:, :4], black, gain)
        if not (self.told and applied):
            return before
        fresh = surroundings.fresh
        now = Surroundings(0.0, fresh, fresh, surroundings.display_class)
        first = now.scene(signal[:, 4:7])
        plain, changed = (trace.panel(each, first, self.selection, native=self.native) for each in ((), applied))
        return before.begun(*trace.since_first_session(applied, changed, plain, np.array([now.tips]), first))


@dataclass(frozen=True)
class LightLink:
    """Shares of the tips (n, 7) → XYZ (n, 3): emission, optics, viewing; the tips are those of the surroundings.

    ``scale`` takes cd/m² to what is relative to the un-aged white; ``fresh`` is the display that effects act on.
    """

    applied: tuple[Applied, ...]
    surroundings: Surroundings
    scale: float
    fresh: Fresh
    stage: str = "emission"

    def __call__(self, signal: Array) -> Array:
        """(n, 7 or 10) → XYZ (n, 3)."""
        scene = self.surroundings.scene(signal[:, 4:7])
        before = self.fresh.panel(signal, self.applied, self.surroundings)
        xyz = trace.emitted(self.applied, before, np.array([self.surroundings.tips]), scene)
        xyz = trace.through(self.applied, ("viewing",), xyz, scene)
        return _finite(np.broadcast_to(xyz, (len(signal), 3)) * self.scale, self.applied)


def _finite(signal: Array, applied: tuple[Applied, ...]) -> Array:
    if not np.isfinite(signal).all():
        names = ", ".join(each.effect.name for each in applied)
        message = f"the display gives NaN or infinity for some colours, with these effects and values: {names}."
        raise LutgenError(message)
    return signal


@cache
def makes_steps(each: Applied, surroundings: Surroundings) -> bool:
    """Whether an effect turns a ramp into stairs: most of its rises stand alone between repeated values."""
    if each.effect.stage not in PANEL_STAGES:
        return False
    ramp = np.repeat(np.linspace(0.0, 1.0, _RAMP + 1)[:, np.newaxis], 3, axis=1)
    curve = each.effect.function(ramp, surroundings.scene(ramp), **each.values)
    rises = np.diff(np.broadcast_to(curve, ramp.shape), axis=0) != 0.0
    alone = rises[1:-1] & ~rises[:-2] & ~rises[2:]
    return bool(alone.sum() > 0.5 * rises.sum())


def jumps(aged: AgedDisplay) -> bool:
    """Whether a display with effects jumps at white's border: by ``nearest``, unless its tips add up."""
    panel = next((link for link in (*aged.head, *aged.tail) if isinstance(link, PanelLink)), None)
    if panel is None or panel.selection != "nearest":
        return False
    continuous = replace(panel, selection="continuous")
    head, tail = (tuple(continuous if link is panel else link for link in part) for part in (aged.head, aged.tail))
    other = replace(aged, head=head, tail=tail)
    away = aged.code_to_linear(_GREYS_AND_MORE) - other.code_to_linear(_GREYS_AND_MORE)
    return bool(np.abs(away).max() > _NO_JUMP)


def without_steps(aged: AgedDisplay) -> AgedDisplay | None:
    """Return the display without the effects that make steps, which no table can follow; None where there are none."""
    for link in aged.tail:
        if isinstance(link, PanelLink) and link.surroundings:
            smooth = tuple(each for each in link.applied if not makes_steps(each, link.surroundings))
            if smooth != link.applied:
                tail = tuple(replace(link, applied=smooth) if other is link else other for other in aged.tail)
                return replace(aged, tail=tail)
    return None


@dataclass(frozen=True)
class EffectChain:
    """A display's effects, without an hour: what :class:`~lutgen.display.model.DisplayModel` makes displays of."""

    applied: tuple[Applied, ...]
    conditions: Conditions
    fresh: Fresh

    def at(self, mode: str, hours: float, now: Surroundings, luminance: Callable[[float], float]) -> AgedDisplay:
        """Return the display of ``mode`` at ``hours``.

        ``now``: hour and tips, under the reference conditions. ``luminance``: white's luminance by the effects alone,
        relative to hour 0 → the luminance that the mode gives white.

        Raises LutgenError: white's luminance cannot be brought there, or the effects give NaN or infinity.
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
        """White's emitted luminance relative to hour 0, under the reference conditions."""
        new, aged = self._whites(now)
        return aged / new

    def _whites(self, now: Surroundings) -> tuple[float, float]:
        """Luminance of white in cd/m² at hour 0 and now."""
        return self._white(replace(now, hours=0.0, tips=now.fresh), 1.0), self._white(now, 1.0)

    def tips(self, now: Surroundings) -> Array:
        """XYZ in cd/m² of white, red, green and blue as they leave the display and are seen, shape (4, 3)."""
        now = replace(now, conditions=self.conditions)
        code = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        return LightLink(self.applied, now, 1.0, self.fresh)(self._panel(now)(code))

    def _panel(self, now: Surroundings) -> PanelLink:
        acting = tuple(each for each in self.applied if each.effect.stage in PANEL_STAGES)
        return PanelLink(acting, self.fresh.selection, now if acting else None, self.fresh.native)

    def _white(self, now: Surroundings, gain: float) -> float:
        """Luminance of white in cd/m² as it leaves the display, under the reference conditions."""
        lit = _scaled(now, gain)
        before = self.fresh.panel(self._panel(now)(_WHITE), self.applied, lit)
        white = trace.emitted(self.applied, before, np.array([lit.tips]), lit.scene(_WHITE))
        return float(_finite(np.asarray(white), self.applied)[..., 1].squeeze())

    def _gain(self, now: Surroundings, aged: float, target: float) -> float:
        """Find the factor on all tips that brings white to the luminance ``wanted``, by secants."""
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
