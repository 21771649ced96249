"""What a fit has found, as a display model keeps it: effects with their estimates, and the tips before them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import xyz_to_xyY
from lutgen.display.tips import Tips
from lutgen.errors import LutgenError, pick_one

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.effects import Effect


@dataclass(frozen=True)
class Estimate:
    """A parameter's value in its own unit, ± ``stderr`` (None where it was not fitted, or the data say nothing)."""

    value: float
    stderr: float | None = None
    at_bound: bool = False

    def __post_init__(self) -> None:
        """Take numpy's numbers as Python's, so that files print them alike."""
        known = self.stderr is not None and isfinite(self.stderr)
        object.__setattr__(self, "value", float(self.value))
        object.__setattr__(self, "stderr", float(self.stderr) if self.stderr is not None and known else None)
        object.__setattr__(self, "at_bound", bool(self.at_bound))


@dataclass(frozen=True, eq=False)
class AppliedEffect:
    """An effect and what is known of its parameters.

    Equal to another exactly when both say the same of the same function.

    Attributes
    ----------
    effect
        The effect.
    estimates
        Parameter → estimate: all of the effect's parameters, in its order.
    free
        Names of those that were fitted.

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
        """Apply an effect with some values; its other parameters stay at rest."""
        return cls(effect, {name: Estimate(value) for name, value in (effect.rest() | dict(values)).items()})

    def __post_init__(self) -> None:
        """Check all values against the effect's declaration."""
        _check_names(self.effect, self.estimates)
        _check_names(self.effect, self.free)
        who = f"effect {self.effect.name!r}"
        for name, parameter in self.effect.parameters.items():
            if name not in self.estimates:
                message = (
                    f"{who}: parameter {name!r} is missing. Give its value in {parameter.unit}: {parameter.meaning}."
                )
                raise LutgenError(message)
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
        """Every parameter's value."""
        return {name: estimate.value for name, estimate in self.estimates.items()}

    @property
    def _content(self) -> tuple[Any, ...]:
        effect = self.effect
        return effect.name, effect.stage, effect.function, tuple(self.estimates.items()), self.free

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AppliedEffect) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)


def _check_names(effect: Effect, names: Mapping[str, Any] | tuple[str, ...]) -> None:
    for name in names:
        if name not in effect.parameters:
            raise pick_one(f"parameter of effect {effect.name!r}", name, effect.parameters or ["none: it has none"])


@dataclass(frozen=True)
class LatentTips:
    """White and primaries of the display before its effects, as a fit found them.

    Raises LutgenError: shapes do not fit, hours do not increase from 0, or a tip is not finite or gives no light.
    """

    #: Increasing from 0, shape (N,).
    hours: Array
    #: XYZ in cd/m² of white, red, green, blue, shape (N, 4, 3).
    xyz_cd_m2: Array

    def __post_init__(self) -> None:
        """Check shapes, hours and light."""
        hours = np.asarray(self.hours, dtype=np.float64)
        xyz = np.asarray(self.xyz_cd_m2, dtype=np.float64)
        object.__setattr__(self, "hours", hours)
        object.__setattr__(self, "xyz_cd_m2", xyz)
        if not hours.size or hours.ndim != 1 or xyz.shape != (hours.size, 4, 3):
            message = (
                f"latent tips: {hours.size} hours need {hours.size} × 4 × 3 numbers: X, Y, Z of white, red, green and "
                f"blue at each; these are {' × '.join(map(str, xyz.shape)) or 'none'}."
            )
            raise LutgenError(message)
        if hours[0] != 0 or not (np.diff(hours) > 0).all() or not np.isfinite(hours).all():
            raise LutgenError("latent tips: hours must be finite and increase from 0.")
        if not np.isfinite(xyz).all():
            raise LutgenError("latent tips: X, Y and Z must be finite numbers, in cd/m².")
        if (xyz[..., 1] <= 0).any() or (xyz.sum(axis=-1) <= 0).any():
            raise LutgenError("latent tips: Y of white and primaries must be above 0 cd/m².")

    def over_time(self, source: str) -> Tips:
        """Return the tips as a history. Raises LutgenError when it is none."""
        return Tips(self.hours, xyz_to_xyY(self.xyz_cd_m2), source=f"latent tips of {source}")


def constant_tips(hours: Array, xyY: Array, source: str) -> Tips:
    """Return tips that are xyY, shape (4, 3), at every one of the hours (N,)."""
    return Tips(hours, np.repeat(xyY[np.newaxis], hours.size, axis=0), source=source)
