"""The results of a fit in a display model: effects with estimates, the tips before the effects, and their covariance.

:func:`record_of` returns the entry of an effect in a file, and :func:`found_by` returns the effect of such an entry.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import Array, xyz_to_xyY
from lutgen.display.tips import Tips
from lutgen.effects.declare import BUILT_IN, CODE
from lutgen.errors import LutgenError, pick_one, reason_of
from lutgen.files import bytes_at_most

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from lutgen.effects import Effect

#: Message about an invalid [covariance].
_RECORD = (
    "[covariance]: of is a list of EFFECT.PARAMETER, rows are lists of numbers: one in the first row, and one more in "
    "each that follows."
)


@dataclass(frozen=True)
class Estimate:
    """A parameter's value and standard error in its own unit; ``stderr`` None: not fitted, or not determined."""

    value: float
    stderr: float | None = None
    at_bound: bool = False

    def __post_init__(self) -> None:
        # NumPy's numbers become Python's, so that files contain the same text.
        known = self.stderr is not None and isfinite(self.stderr)
        object.__setattr__(self, "value", float(self.value))
        object.__setattr__(self, "stderr", float(self.stderr) if self.stderr is not None and known else None)
        object.__setattr__(self, "at_bound", bool(self.at_bound))


@dataclass(frozen=True, eq=False)
class AppliedEffect:
    """An effect with estimates of its parameters.

    Two applied effects are equal exactly when function, estimates and fitted parameters are equal.

    Attributes
    ----------
    effect
        The effect.
    estimates
        Parameter → estimate, for all parameters, in the effect's order.
    free
        Names of the fitted parameters.

    Raises
    ------
    LutgenError
        A parameter is unknown, missing, not finite or outside its bounds.

    """

    effect: Effect
    estimates: Mapping[str, Estimate]
    free: tuple[str, ...] = ()

    @classmethod
    def of(cls, effect: Effect, values: Mapping[str, float]) -> AppliedEffect:
        """Return an effect with some values; the other parameters are at rest."""
        return cls(effect, {name: Estimate(value) for name, value in (effect.rest() | dict(values)).items()})

    def __post_init__(self) -> None:
        who, known = f"effect {self.effect.name!r}", self.effect.parameters
        for name in (*self.estimates, *self.free):
            if name not in known:
                raise pick_one(f"parameter of {who}", name, known or ["none: it has none"])
        for name, parameter in self.effect.parameters.items():
            if name not in self.estimates:
                raise LutgenError(
                    f"{who}: parameter {name!r} is missing. Give its value in {parameter.unit}: {parameter.meaning}."
                )
            value, (low, high) = self.estimates[name].value, parameter.bounds
            if not isfinite(value):
                raise LutgenError(f"{who}: parameter {name!r} is {value:g}. Give a finite number.")
            if not low <= value <= high and value != self.effect.neutral.get(name):
                message = f"{who}: {name} = {value:g} lies outside its bounds {low:g}..{high:g} ({parameter.unit})."
                raise LutgenError(message)
        object.__setattr__(self, "estimates", {name: self.estimates[name] for name in self.effect.parameters})
        object.__setattr__(self, "free", tuple(name for name in self.effect.parameters if name in self.free))

    @cached_property
    def values(self) -> dict[str, float]:
        """Value of every parameter."""
        return {name: estimate.value for name, estimate in self.estimates.items()}

    @property
    def _content(self) -> tuple[Any, ...]:
        effect = self.effect
        return effect.name, effect.stage, effect.function, tuple(self.estimates.items()), self.free

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AppliedEffect) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)


@dataclass(frozen=True)
class LatentTips:
    """Fitted white and primaries of the display before its effects.

    Raises LutgenError: inconsistent shapes, hours that do not increase from 0, or a tip that is not finite or has no
    light.
    """

    #: Hours, increasing from 0, (N,).
    hours: Array
    #: XYZ in cd/m² of white, red, green, blue, (N, 4, 3).
    xyz_cd_m2: Array

    def __post_init__(self) -> None:
        hours = np.asarray(self.hours, dtype=np.float64)
        xyz = np.asarray(self.xyz_cd_m2, dtype=np.float64)
        object.__setattr__(self, "hours", hours)
        object.__setattr__(self, "xyz_cd_m2", xyz)
        if not hours.size or hours.ndim != 1 or xyz.shape != (hours.size, 4, 3):
            raise LutgenError(
                f"[tips]: {hours.size} hours need {hours.size} × 4 × 3 numbers: X, Y, Z of white, red, green and "
                f"blue at each; these are {' × '.join(map(str, xyz.shape)) or 'none'}."
            )
        if hours[0] != 0 or not (np.diff(hours) > 0).all() or not np.isfinite(hours).all():
            raise LutgenError("[tips]: hours must be finite and increase from 0.")
        if not np.isfinite(xyz).all():
            raise LutgenError("[tips]: X, Y and Z must be finite numbers, in cd/m².")
        if (xyz[..., 1] <= 0).any() or (xyz.sum(axis=-1) <= 0).any():
            raise LutgenError("[tips]: Y of white and primaries must be above 0 cd/m².")

    def over_time(self, source: str) -> Tips:
        """Return the tips over time. Raises LutgenError: the primaries lie on a line."""
        return Tips(self.hours, xyz_to_xyY(self.xyz_cd_m2), source=f"fitted white and primaries of {source}")


def constant_tips(hours: Array, xyY: Array, source: str) -> Tips:
    """Return tips with the same xyY, (4, 3), at all hours (N,)."""
    return Tips(hours, np.repeat(xyY[np.newaxis], hours.size, axis=0), source=source)


#: Significant digits of a covariance. Files hold this number of digits, and a model must equal the model of its file.
DIGITS = 7

#: Tolerance of a correlation above 1, for rounding.
LOOSE = 1e-5


@dataclass(frozen=True, eq=False)
class FitCovariance:
    """The covariance of all fitted parameters and latent tips.

    Raises LutgenError: inconsistent shapes, a number that is not finite, or a matrix that is no covariance.
    """

    #: Effect and name of each fitted parameter.
    of: tuple[tuple[str, str], ...]
    #: Covariance in the parameters' own units, (p, p); or with the latent tips after the parameters, (p + 12·n, p +
    #: 12·n): X, Y and Z in cd/m² of white, red, green and blue at each hour, or only at hour 0 if hour 0 predicts all
    #: hours.
    matrix: Array

    def __post_init__(self) -> None:
        matrix, count = np.asarray(self.matrix, dtype=np.float64), len(self.of)
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape[0] < count:
            raise LutgenError(
                f"covariance: {count} parameters need {count} rows and columns, and 12 more for each hour of [tips]."
            )
        if (matrix.shape[0] - count) % 12:
            raise LutgenError(
                f"covariance: of {matrix.shape[0]} rows, {matrix.shape[0] - count} are not of parameters. White and "
                f"primaries need 12 rows for each hour."
            )
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
        """Return the entries of a model file."""
        rows = [row[: place + 1] for place, row in enumerate(self.matrix.tolist())]
        return {"of": [".".join(names) for names in self.of], "rows": rows}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> FitCovariance:
        """Return the covariance of a record of :meth:`as_record`. Raises LutgenError: an invalid record."""
        try:
            of = tuple((str(effect), str(name)) for effect, name in (str(each).rsplit(".", 1) for each in record["of"]))
            rows = [[float(value) for value in row] for row in record["rows"]]
        except (KeyError, TypeError, ValueError):
            raise LutgenError(_RECORD) from None
        if any(len(row) != place + 1 for place, row in enumerate(rows)):
            raise LutgenError(_RECORD)
        matrix = np.zeros((len(rows), len(rows)))
        matrix[np.tril_indices(len(rows))] = [value for row in rows for value in row]
        return cls(of, matrix + np.tril(matrix, -1).T)

    def check(self, free: Collection[tuple[str, str]], hours: int) -> None:
        """Raise LutgenError unless all parameters are in ``free``, once each, with tips of ``hours`` hours or none."""
        other = next((each for each in self.of if each not in free or self.of.count(each) > 1), None)
        if other:
            why = "is there twice" if other in free else "is not a fitted parameter"
            raise LutgenError(
                f"[covariance]: {'.'.join(other)} {why}. Name each fitted parameter once, as EFFECT.PARAMETER."
            )
        if self.hours not in {0, hours}:
            raise LutgenError(
                f"[covariance]: it holds white and primaries of {self.hours} hours, but {hours} are fitted. "
                f"Delete the rows of white and primaries."
            )

    def among(self, free: Collection[tuple[str, str]]) -> FitCovariance:
        """Return the covariance of the parameters in ``free``, and of the tips."""
        kept = [place for place, each in enumerate(self.of) if each in free]
        places = [*kept, *range(len(self.of), len(self.matrix))]
        return FitCovariance(tuple(self.of[place] for place in kept), self.matrix[np.ix_(places, places)])

    @property
    def hours(self) -> int:
        """Number of hours with tips."""
        return (len(self.matrix) - len(self.of)) // 12

    def drawn(self, random: np.random.Generator, low: Array, high: Array) -> tuple[Array, Array]:
        """Draw deviations of the parameters within ``low`` and ``high``, (p,), and of the tips, (n, 4, 3).

        If a bound clips a parameter, the tips are corrected by their regression on the parameter.
        """
        count = len(self.of)
        drawn = self._root @ random.standard_normal(len(self.matrix))
        clipped = np.clip(drawn[:count], low, high)
        tips = drawn[count:] + self._regression @ (clipped - drawn[:count])
        return clipped, tips.reshape(-1, 4, 3)

    @cached_property
    def _root(self) -> Array:
        values, vectors = np.linalg.eigh(self.matrix)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    @cached_property
    def _regression(self) -> Array:
        """Regression of the tips on the parameters, (12·n, p)."""
        count = len(self.of)
        return np.asarray(self.matrix[count:, :count] @ np.linalg.pinv(self.matrix[:count, :count], hermitian=True))


def record_of(effect: Effect, folder: Path) -> dict[str, str]:
    """Return the entry of an effect in a model file or manifest in ``folder``: ``origin``, and a file's ``sha256``.

    The origin is ``built-in``, the path of a .py file relative to ``folder``, a package, or an expression. Raises
    LutgenError: a running program declared the effect, or its file is missing.
    """
    if not effect.origin.endswith(".py"):
        if effect.origin.startswith(CODE):
            raise LutgenError(
                f"effect {effect.name!r} was declared in code ({effect.origin}), where a file cannot find it again. "
                "Put it into a .py file of its own."
            )
        return {"origin": effect.origin}
    file = Path(effect.origin)
    origin = Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    return {"origin": origin, "sha256": _sha256(file, effect.name)}


def found_by(name: str, record: Mapping[str, str], folder: Path) -> Effect:
    """Return the effect of an entry of :func:`record_of` in a file in ``folder``.

    Raises LutgenError: the effect is missing, its file has changed, or a user's effect breaks the contract.
    """
    from lutgen.effects.contract import refuse_unsound
    from lutgen.effects.own import recall

    origin = record.get("origin", BUILT_IN)
    if not origin.endswith(".py"):
        return recall(name, origin)
    file = folder / origin
    now, was = _sha256(file, name), record.get("sha256", "")
    if was and now != was:
        raise LutgenError(
            f"effect {name!r}: its file {file} has changed (SHA-256 {now[:12]}…, was {was[:12]}…), so the effect "
            f"may differ. Restore the file, or make the model again with the new file (lutgen refine)."
        )
    refuse_unsound([file])
    return recall(name, str(file))


def _sha256(file: Path, name: str) -> str:
    from lutgen.effects.own import MAX_BYTES

    try:
        return hashlib.sha256(bytes_at_most(file, MAX_BYTES, none="file of effects")).hexdigest()
    except OSError as error:
        raise LutgenError(
            f"effect {name!r}: cannot read its file {file}: {reason_of(error)}. Put it back there."
        ) from None
