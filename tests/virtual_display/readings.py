"""``Readings``: the patches and their conditions, one entry per reading; the design without the measured light."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from tests.virtual_display.spectra import Array

#: Hours at which an effect that grows with age has its full size: the paper's span.
LIFE_H = 18_000.0

#: Panel temperature in °C at which temperature has no effect.
REFERENCE_C = 25.0

LENS_CAP = "lens cap"
SHROUDED = "shrouded"


@dataclass(frozen=True)
class Readings:
    """Patches in reading order, all arrays of n entries.

    Attributes
    ----------
    hours, drive
        Operating hours, and code values 0..1 of shape (n, 3).
    u, v
        Position on the screen, 0..1 from the top left.
    ambient_lx
        Illuminance of the screen by the room.
    warmup_min
        Minutes since power-on, NaN when warm.
    temperature_c
        The panel's temperature.
    window, surround
        Share of the screen that the patch covers, and the code value of the surrounding grey.
    note
        ``lens cap``, ``shrouded`` or empty.

    """

    hours: Array
    drive: Array
    u: Array
    v: Array
    ambient_lx: Array
    warmup_min: Array
    temperature_c: Array
    window: Array
    surround: Array
    note: tuple[str, ...]

    @property
    def n(self) -> int:
        """Return the number of readings."""
        return self.hours.size

    @property
    def tau(self) -> Array:
        """Return the age as a share of the paper's 18 000 h."""
        return self.hours / LIFE_H

    @property
    def capped(self) -> Array:
        """Return 1 where the lens is open, 0 where the cap covers it."""
        return np.array([0.0 if note == LENS_CAP else 1.0 for note in self.note])


def at_rest(drive: ArrayLike, hours: ArrayLike) -> Readings:
    """Patches at the centre of a warm, dark, full screen; ``drive`` (n, 3), ``hours`` (n,) or one for all."""
    colours = np.asarray(drive, dtype=np.float64).reshape(-1, 3)
    n = len(colours)

    def all_at(value: float) -> Array:
        return np.full(n, value)

    return Readings(
        hours=np.broadcast_to(np.asarray(hours, dtype=np.float64), n).copy(),
        drive=colours,
        u=all_at(0.5),
        v=all_at(0.5),
        ambient_lx=all_at(0.0),
        warmup_min=all_at(np.nan),
        temperature_c=all_at(REFERENCE_C),
        window=all_at(1.0),
        surround=all_at(0.0),
        note=("",) * n,
    )


def joined(parts: list[Readings]) -> Readings:
    """Concatenate the tables."""
    arrays = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Readings) if f.name != "note"
    }
    return Readings(note=tuple(note for part in parts for note in part.note), **arrays)
