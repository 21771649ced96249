"""How the errors of what a fit has found hang together, as a model file keeps it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from lutgen.colorimetry import Array

#: Significant digits that a covariance keeps: a file says no more, and a model is the one that its file gives.
DIGITS = 7

#: Share by which rounding may make a correlation larger than 1.
LOOSE = 1e-5


@dataclass(frozen=True, eq=False)
class FitCovariance:
    """How the errors of all that a fit found hang together.

    Raises LutgenError: shapes do not fit, a number is not finite, or the matrix is no covariance.
    """

    #: Effect and parameter of each fitted number.
    of: tuple[tuple[str, str], ...]
    #: Covariance in the parameters' own units, (p, p), or with the latent tips behind them, (p + 12·n, p + 12·n): X, Y
    #: and Z in cd/m² of white, red, green and blue at each hour, or at hour 0 where all hours are foretold from it.
    matrix: Array

    def __post_init__(self) -> None:
        """Round, and check that it is a covariance."""
        matrix, count = np.asarray(self.matrix, dtype=np.float64), len(self.of)
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape[0] < count:
            message = f"covariance: {count} parameters need {count} rows and columns, and 12 more an hour of tips."
            raise LutgenError(message)
        if (matrix.shape[0] - count) % 12:
            message = (
                f"covariance: {matrix.shape[0]} rows are {matrix.shape[0] - count} beside those of parameters; tips "
                f"take 12 an hour."
            )
            raise LutgenError(message)
        if not np.isfinite(matrix).all():
            raise LutgenError("covariance: all numbers must be finite.")
        size = np.sqrt(np.maximum(np.diagonal(matrix), 0.0))
        if not (np.abs(matrix) <= np.outer(size, size) * (1.0 + LOOSE) + np.finfo(float).tiny).all():
            raise LutgenError("covariance: a number is larger than the errors of its row and column allow.")
        rounded = np.array([[float(f"{value:.{DIGITS - 1}e}") for value in row] for row in matrix.tolist()])
        lower = np.tril(rounded.reshape(matrix.shape))
        object.__setattr__(self, "matrix", lower + np.tril(lower, -1).T)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FitCovariance) and self.of == other.of and np.array_equal(self.matrix, other.matrix)

    def __hash__(self) -> int:
        return hash((self.of, self.matrix.tobytes()))

    def as_record(self) -> dict[str, Any]:
        """Return what files hold of it."""
        rows = [row[: place + 1] for place, row in enumerate(self.matrix.tolist())]
        return {"of": [".".join(names) for names in self.of], "rows": rows}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> FitCovariance:
        """Make it again of what :meth:`as_record` gave. Raises LutgenError where that is none."""
        try:
            of = tuple((str(effect), str(name)) for effect, name in (str(each).rsplit(".", 1) for each in record["of"]))
            rows = [[float(value) for value in row] for row in record["rows"]]
        except (KeyError, TypeError, ValueError):
            rows, of = [[0.0, 0.0]], ()
        if any(len(row) != place + 1 for place, row in enumerate(rows)):
            message = (
                "[covariance]: of is a list of EFFECT.PARAMETER, rows are lists of numbers: one in the first row, and "
                "one more in each that follows."
            )
            raise LutgenError(message)
        matrix = np.zeros((len(rows), len(rows)))
        matrix[np.tril_indices(len(rows))] = [value for row in rows for value in row]
        return cls(of, matrix + np.tril(matrix, -1).T)

    def check(self, free: Collection[tuple[str, str]], hours: int) -> None:
        """Raise LutgenError unless it is of some ``free`` parameters, and of no tips or those of so many ``hours``."""
        other = next((each for each in self.of if each not in free or self.of.count(each) > 1), None)
        if other:
            why = "is there twice" if other in free else "is not a fitted parameter"
            message = f"[covariance]: {'.'.join(other)} {why}. Name each fitted parameter once, as EFFECT.PARAMETER."
            raise LutgenError(message)
        if self.hours not in {0, hours}:
            message = f"[covariance]: it holds the tips of {self.hours} hours, but {hours} are fitted. Leave them out."
            raise LutgenError(message)

    def among(self, free: Collection[tuple[str, str]]) -> FitCovariance:
        """Return what it says of those of its parameters that are among ``free``, and of the tips."""
        kept = [place for place, each in enumerate(self.of) if each in free]
        places = [*kept, *range(len(self.of), len(self.matrix))]
        return FitCovariance(tuple(self.of[place] for place in kept), self.matrix[np.ix_(places, places)])

    @property
    def hours(self) -> int:
        """Number of hours whose tips it holds."""
        return (len(self.matrix) - len(self.of)) // 12

    def drawn(self, random: np.random.Generator, low: Array, high: Array) -> tuple[Array, Array]:
        """Draw deviations of the parameters within ``low`` and ``high``, (p,), and of the tips, (n, 4, 3).

        Where a bound stops a parameter, the tips follow it as far.
        """
        count = len(self.of)
        asked = self._root @ random.standard_normal(len(self.matrix))
        held = np.clip(asked[:count], low, high)
        tips = asked[count:] + self._follow @ (held - asked[:count])
        return held, tips.reshape(-1, 4, 3)

    @cached_property
    def _root(self) -> Array:
        values, vectors = np.linalg.eigh(self.matrix)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    @cached_property
    def _follow(self) -> Array:
        count = len(self.of)
        return np.asarray(self.matrix[count:, :count] @ np.linalg.pinv(self.matrix[:count, :count], hermitian=True))
