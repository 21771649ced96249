"""White, the primaries and black of a session, and what can happen to them between two sessions, as light.

A pixel's light is the sum of its channels and of what leaks through black. On its way into the file it is dimmed
(settings, aging), has the room's light added, and is turned into XYZ by an instrument whose correction is a matrix::

    XYZ = matrix · (scale · (Σ gain_c · channel_c + leak) + added)

Settings of a channel do not reach the leak; a backlight that ages takes it along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.patches import CHANNELS, mean_xyz, tip

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: The order of the colour points, black among them.
COLOURS = (*CHANNELS, "white", "black")

#: X and Z of room light over its Y: between tungsten and daylight (CIE 15: A 1.10 and 0.36, D65 0.95 and 1.09).
ROOM = np.array([1.0, 1.0, 0.7])

#: Parameter → (numbers, width of its prior). Widths are in natural logarithms but for ``added`` and ``tint`` (Y of room
#: light, and X and Z beside those of ``ROOM``, in cd/m²) and ``matrix`` (shares). Meters agree within some percent;
#: corrections move a primary by tens of percent. ``yellowed`` is light of short wavelengths; ``gamut`` mixes channels.
PARAMETERS: dict[str, tuple[int, float]] = {
    "scale": (1, 0.7),
    "gauge": (1, 0.03),
    "step": (1, 0.25),
    "gains": (3, 0.25),
    "aged": (3, 0.45),
    "added": (1, 1.0),
    "tint": (2, 0.5),
    "matrix": (9, 0.10),
    "yellowed": (1, 0.10),
    "gamut": (9, 0.15),
}

#: Share of Z that is X of short wavelengths: x̄'s smaller peak over z̄'s (CIE 1931, 2°: 0.348 at 442 nm over 1.784).
SHORT = 0.195


@dataclass(frozen=True)
class ColourPoints:
    """White, the primaries and black of a session.

    Attributes
    ----------
    channels
        Light of red, green and blue at full drive, after black, (3, 3).
    extra
        White after black less the sum of the channels, (3,): 0 for an additive display.
    leak
        Black, (3,); zero where it was not read.
    has_black
        Whether it was.

    """

    channels: Array
    extra: Array
    leak: Array
    has_black: bool

    def xyz(self) -> Array:
        """XYZ as read of red, green, blue, white and black, (5, 3)."""
        white = self.channels.sum(axis=0) + self.extra
        return np.vstack([self.channels + self.leak, white + self.leak, self.leak])

    def with_gains(self, gains: Array) -> ColourPoints:
        """Return the colours with each channel's light multiplied; the leak stays."""
        share = float((gains * self.channels[:, 1]).sum() / self.channels[:, 1].sum())
        return ColourPoints(self.channels * gains[:, np.newaxis], self.extra * share, self.leak, self.has_black)


def colour_points(session: Session, *, black_too: bool = True) -> ColourPoints | None:
    """Return the colour points of a session; None where white or a primary was not read, or has no light."""
    tips = [tip(session, name) for name in CHANNELS]
    white, black = mean_xyz(session, "white"), mean_xyz(session, "black") if black_too else None
    found = [each for each in (*tips, white) if each is not None]
    if len(found) < 4:
        return None
    leak = np.zeros(3) if black is None else np.asarray(black, dtype=np.float64)
    channels = np.vstack(found[:3]) - leak
    if channels[:, 1].min() <= 0:
        return None
    return ColourPoints(channels, found[3] - leak - channels.sum(axis=0), leak, black is not None)


def changed(before: ColourPoints, values: Mapping[str, Array]) -> Array:
    """Return XYZ of the colour points after a change, (5, 3). ``values`` are parameters of ``PARAMETERS``; 0: none."""
    log_scale = sum(float(values[name][0]) for name in ("scale", "gauge", "step") if name in values)
    gains = np.exp(values["gains"]) if "gains" in values else np.ones(3)
    leak = before.leak
    if "aged" in values:
        aged = np.exp(values["aged"])
        gains = gains * aged
        leak = leak * float((aged * before.channels[:, 1]).sum() / before.channels[:, 1].sum())
    lit = before.with_gains(gains)
    if "gamut" in values:
        mixed = lit.channels + values["gamut"].reshape(3, 3) @ lit.channels
        lit = ColourPoints(mixed, lit.extra, lit.leak, lit.has_black)
    light = np.exp(log_scale) * ColourPoints(lit.channels, lit.extra, leak, lit.has_black).xyz()
    if "yellowed" in values:
        lost = np.expm1(float(values["yellowed"][0])) * light[:, 2]
        light = light + np.column_stack([SHORT * lost, np.zeros(len(light)), lost])
    if "added" in values:
        tint = values.get("tint", np.zeros(2))
        light = light + float(values["added"][0]) * ROOM + np.array([tint[0], 0.0, tint[1]])
    if "matrix" in values:
        light = light @ (np.eye(3) + values["matrix"].reshape(3, 3)).T
    return np.asarray(light)
