"""``Scene``: the input of an effect, which is the display, the plan, and the light of the pixels before the effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.laws import srgb_to_linear

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.spectral.displays import Panel
    from tests.generators.spectral.plan import Plan


@dataclass(frozen=True)
class Scene:
    """A campaign between two stages of the simulation.

    Attributes
    ----------
    panel, plan
        The new display; the readings.
    primaries
        Spectra of the primaries at each reading's hour, (n, 3, wavelengths).
    linear
        Linear light of the channels of the patch, (n, 3), as the preceding stages have computed it.

    """

    panel: Panel
    plan: Plan
    primaries: NDArray[np.float64]
    linear: NDArray[np.float64]

    @property
    def hours(self) -> NDArray[np.float64]:
        """Return the operating hours of each reading, (n,)."""
        return self.plan.hours[self.plan.hour]

    def condition(self, name: str) -> NDArray[np.float64]:
        """Return the true value of a condition of each reading, (n,)."""
        return self.plan.conditions[name]

    @property
    def surround(self) -> NDArray[np.float64]:
        """Return the linear light of the surround's three equal channels, (n, 1)."""
        return srgb_to_linear(self.condition("surround"))[:, None]

    @property
    def screen(self) -> NDArray[np.float64]:
        """Return the mean linear light of the whole screen, (n, 3): patch and surround, weighted by their areas."""
        share = self.condition("window")[:, None]
        return share * self.linear + (1 - share) * self.surround

    @property
    def radius(self) -> NDArray[np.float64]:
        """Return the distance from the centre, 1 in the corners, (n,)."""
        return np.asarray(np.hypot(self.condition("u") - 0.5, self.condition("v") - 0.5) * np.sqrt(2))

    def before(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values (n, ...) of the preceding reading in the same session; the first reading keeps its own."""
        by_order = np.argsort(self.plan.order, kind="stable")
        earlier = np.empty_like(values)
        earlier[by_order[1:]] = values[by_order[:-1]]
        session = self.plan.session[by_order]
        first = by_order[np.concatenate([[True], session[1:] != session[:-1]])]
        earlier[first] = values[first]
        return earlier

    def place(self) -> NDArray[np.float64]:
        """Return the number of preceding readings in the session, (n,)."""
        order = self.plan.order
        starts = np.full(int(self.plan.session.max()) + 1, np.inf)
        np.minimum.at(starts, self.plan.session, order)
        return np.asarray(order - starts[self.plan.session])


#: Argument and result have the same type: code values or linear light (n, 3), spectra (n, wavelengths), or XYZ (n, 3).
Effect = Callable[["NDArray[np.float64]", Scene, float, np.random.Generator], "NDArray[np.float64]"]
