"""``Scene``: the input of an effect, which is every reading of a simulated campaign with hour, patch and conditions."""

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
    """The readings of a simulated campaign, in the order of the file's rows.

    Attributes
    ----------
    display
        The real display.
    hours, drive, order
        Hours of operation (n,), nominal code values (n, 3), index in the order of reading (n,).
    u, v, ambient_lx, warmup_min, temperature_c, window, surround
        The true conditions, each (n,): position 0..1, illuminance at the screen, minutes since power-on, room
        temperature in °C, share of the screen's area that the patch covers, code value of the grey around it.
    rest_min, rest_c
        Minutes and temperature of a reading at rest.
    capped
        Whether a cap covers the lens, (n,).

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
        """Return the share of a life, (n,): hours / 18 000."""
        return self.hours / LIFE_H

    def onset(self, hours: float) -> Array:
        """Return a factor (n,) that is 0 at hour 0 and soon approaches 1.

        A real session at hour 0 already contains some effects; a hidden effect of that kind must grow later.
        """
        return np.asarray(1.0 - np.exp(-self.hours / hours))

    def surround_light(self) -> Array:
        """Return the simulated light (n, 3) in cd/m² at hour 0 of the grey around each patch."""
        return self.display.light(np.repeat(self.surround[:, None], 3, axis=1))


# Arguments: the scene, the code values or XYZ in cd/m² (n, 3) to change, the strength, and a random generator.
Effect = Callable[[Scene, "Array", float, np.random.Generator], "Array"]
