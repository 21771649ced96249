"""Laws of decay, fitted to a history and chosen by evidence (AICc, Hurvich & Tsai 1989, doi:10.1093/biomet/76.2.297).

Every law is linear in its coefficients once its shape is fixed, so that shapes are tried on a grid: nothing can get
stuck, and all bootstrap draws are fitted at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array

#: Powers of time, and of the stretched exponential; and time constants as multiples of the span measured.
_POWERS = np.geomspace(0.25, 3.0, 41)
_CONSTANTS = np.geomspace(0.2, 100.0, 200)


@dataclass(frozen=True)
class Law:
    """A law.

    Attributes
    ----------
    name, formula
        For people.
    parameters
        Numbers that are fitted, shapes among them.
    shapes
        The grid.
    columns
        Shape and time as a multiple of the span, (n,) → what the coefficients multiply, (n, k).

    """

    name: str
    formula: str
    parameters: int
    shapes: Sequence[tuple[float, ...]]
    columns: Callable[[tuple[float, ...], Array], Array]


LAWS = (
    Law("constant", "a", 1, ((),), lambda _s, t: np.ones((t.size, 1))),
    Law("linear", "a + b t", 2, ((),), lambda _s, t: np.column_stack([np.ones(t.size), t])),
    Law("exponential", "a exp(-t/τ)", 2, [(c,) for c in _CONSTANTS], lambda s, t: np.exp(-t / s[0])[:, np.newaxis]),
    Law("power", "a + b t^p", 3, [(p,) for p in _POWERS], lambda s, t: np.column_stack([np.ones(t.size), t ** s[0]])),
    Law(
        "stretched exponential",
        "a exp(-(t/τ)^β)",
        3,
        [(c, p) for c in _CONSTANTS[::5] for p in _POWERS[::2]],
        lambda s, t: np.exp(-((t / s[0]) ** s[1]))[:, np.newaxis],
    ),
)


@dataclass(frozen=True)
class Fitted:
    """One law on one history.

    Attributes
    ----------
    law
        The law.
    shape, coefficients
        The best of the grid, and what multiplies its columns.
    chi2, aicc
        Misfit, and Akaike's criterion corrected for few sessions; infinite where they are too few for the law.

    """

    law: Law
    shape: tuple[float, ...]
    coefficients: Array
    chi2: float
    aicc: float

    def at(self, time: Array) -> Array:
        """Figures at times given as multiples of the span, (n,)."""
        return np.asarray(self.law.columns(self.shape, time) @ self.coefficients)


def fit_laws(time: Array, draws: Array, errors: Array) -> list[list[Fitted]]:
    """Fit every law to every draw, (m, n), at times as multiples of the span, (n,): lists of fits, the best first."""
    scaled = draws / errors
    fits: list[list[Fitted]] = [[] for _ in draws]
    for law in LAWS:
        chi2, coefficients, chosen = _best(law, time, scaled, errors)
        penalty = _penalty(law.parameters, time.size)
        for row, found in enumerate(fits):
            shape = law.shapes[int(chosen[row])]
            found.append(Fitted(law, shape, coefficients[row], float(chi2[row]), float(chi2[row]) + penalty))
    return [sorted(found, key=lambda each: each.aicc) for found in fits]


def _best(law: Law, time: Array, scaled: Array, errors: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return for each draw the lowest χ², its coefficients, and the place of its shape."""
    lowest = np.full(len(scaled), np.inf)
    chosen = np.zeros(len(scaled), dtype=np.int64)
    kept = np.zeros((len(scaled), law.columns(law.shapes[0], time).shape[1]))
    for place, shape in enumerate(law.shapes):
        columns = law.columns(shape, time) / errors[:, np.newaxis]
        found = scaled @ np.linalg.pinv(columns).T
        chi2 = ((scaled - found @ columns.T) ** 2).sum(axis=1)
        better = chi2 < lowest
        lowest[better], chosen[better], kept[better] = chi2[better], place, found[better]
    return lowest, kept, chosen


def _penalty(parameters: int, sessions: int) -> float:
    spare = sessions - parameters - 1
    return 2.0 * parameters + 2.0 * parameters * (parameters + 1) / spare if spare > 0 else np.inf
