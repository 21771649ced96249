"""``Scene``: the inputs of an effect besides the signal."""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from lutgen.readings.conditions import COLUMNS
from lutgen.readings.conditions.position import PLACE, radius
from lutgen.readings.conditions.temperature import REFERENCE_C

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.spectra import SpectralDisplay

__all__ = ["LIFE_H", "REFERENCE_C", "CodeScene", "HourScene", "Scene"]

#: Hours at which τ = 1: the paper's 18 000 h.
LIFE_H = 18_000.0

#: An hour after the first session and before every later session.
SOON_H = 1e-6


@cache
def _column(value: float) -> Array:
    """Return a column of one value, (1, 1). All scenes share it, so nobody may write into it."""
    column = np.full((1, 1), value)
    column.flags.writeable = False
    return column


if TYPE_CHECKING:

    class _SceneColumns:
        """The columns of conditions; ``COLUMNS`` holds their names."""

        def __getattr__(self, name: str) -> Array: ...

else:
    #: One field for each column of conditions, (n, 1) or (1, 1). The default is the usual value: centre, dark room,
    #: warm, ….
    _SceneColumns = make_dataclass(
        "_SceneColumns",
        [
            (name, np.ndarray, field(default_factory=partial(_column, column.usual), kw_only=True))
            for name, column in COLUMNS.items()
        ],
        frozen=True,
        namespace={"__module__": __name__},
    )


@dataclass(frozen=True)
class HourScene:
    """A scene of hours, without code values and conditions: enough for most effects of the stage ``emission``.

    ``hours`` is (n, 1); ``white`` and ``fresh_white`` are (..., n, 3), as in :class:`Scene`.
    """

    hours: Array
    white: Array
    fresh_white: Array
    light: SpectralDisplay | None

    @property
    def tau(self) -> Array:
        """Hours as a share of ``LIFE_H``."""
        return self.hours / LIFE_H


@dataclass(frozen=True)
class CodeScene(HourScene):
    """A scene of hours and code values (n, 3), without conditions: enough for most effects on code values."""

    code: Array


@dataclass(frozen=True)
class Scene(_SceneColumns):
    """Hours, code values, white, conditions and spectra of n readings, in arrays that broadcast with the signal.

    Attributes
    ----------
    hours
        Operating hours, (n, 1) or (1, 1).
    code
        Code values of the patches, before any effect, (n, 3).
    white, fresh_white
        XYZ in cd/m² of the display's white at that hour and at hour 0, before any effect, (..., n or 1, 3). For effects
        after the stage ``emission``, ``white`` is the white that this stage emits.
    u, v, ambient_lx, warmup_min, temperature_c, window, surround, …
        The columns of conditions. ``warmup_min`` of a warm display is infinite.
    capped
        1 where the meter's lens was capped, so that no light of the display reaches the meter; otherwise 0.
    light
        The display's spectra.

    """

    hours: Array
    code: Array
    white: Array
    fresh_white: Array
    capped: Array = field(default_factory=lambda: _column(0.0))
    light: SpectralDisplay | None = None

    @property
    def tau(self) -> Array:
        """Hours as a share of ``LIFE_H``."""
        return self.hours / LIFE_H

    @property
    def radius(self) -> Array:
        """ρ, distance from the centre of the screen; 1 in the corners."""
        return radius({name: getattr(self, name) for name in PLACE})

    @property
    def mean_drive(self) -> Array:
        """Mean code value of the whole screen, patch and surround."""
        return np.asarray(self.window * self.code.mean(axis=-1, keepdims=True) + (1.0 - self.window) * self.surround)
