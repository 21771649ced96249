"""What an effect may look at: every reading of a simulated campaign with its hour, patch and conditions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.real.response import Display
    from tests.generators.real.sessions import Array

LIFE_H = 18_000.0  # hours that the catalogue calls one life


@dataclass(frozen=True)
class Scene:
    """The readings of a simulated campaign, in the order in which they are written.

    Attributes
    ----------
    display
        The real display.
    hours, drive, order
        Hours of operation (n,), the nominal code values (n, 3), place in the order of reading (n,).
    u, v, ambient_lx, warmup_min, temperature_c, window, surround
        The true conditions, each (n,): place 0..1, illuminance at the screen, minutes since power-on, room
        temperature in °C, share of the screen's area that the patch covers, code value of the grey around it.
    rest_min, rest_c
        Minutes and temperature of a reading at rest.
    capped
        Whether the lens is covered, (n,).

    """

    display: Display
    hours: Array
    drive: Array
    order: Array
    u: Array
    v: Array
    ambient_lx: Array
    warmup_min: Array
    temperature_c: Array
    window: Array
    surround: Array
    rest_min: float
    rest_c: float
    capped: NDArray[np.bool_]

    @property
    def age(self) -> Array:
        """Share of a life, (n,): hours / 18 000."""
        return self.hours / LIFE_H

    def onset(self, hours: float) -> Array:
        """0 at hour 0, then soon 1, (n,): what a real session at hour 0 holds already must come up later."""
        return np.asarray(1.0 - np.exp(-self.hours / hours))

    def surround_light(self) -> Array:
        """Simulated light (n, 3) in cd/m² at hour 0 of the grey around each patch."""
        return self.display.light(np.repeat(self.surround[:, None], 3, axis=1))


# Both take the scene, what they change (code values or XYZ in cd/m², (n, 3)), the strength and a generator.
Effect = Callable[[Scene, "Array", float, np.random.Generator], "Array"]
