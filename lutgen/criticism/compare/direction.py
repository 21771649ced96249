"""Which way the model errs, in plain words: where most, lighter or darker, towards which hue, added or multiplied."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_lab
from lutgen.criticism.compare.standing_out import telling
from lutgen.criticism.fit.families import dimension, slices
from lutgen.readings.conditions import CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.compare.comparison import Slice
    from lutgen.criticism.fit.problem import Problem

#: Mean ΔL*, Δa* or Δb* below this is not worth a word.
NOTICEABLE = 0.05

#: How a sentence says where a slice lies, by its dimension.
CALLED = {"hour": "at {}", "level": "at levels {}", "family": "on {} patches"} | {
    dimension(each): each.sentence for each in CONDITIONS
}


@dataclass(frozen=True)
class Direction:
    """The worst slice and the mean direction of the error there.

    ``lab`` is measured less predicted, mean ΔL*, Δa*, Δb*; ``kind`` is additive, multiplicative or mixed.
    """

    where: str
    lab: tuple[float, float, float]
    kind: str

    def sentence(self) -> str:
        """Say it."""
        words = ", ".join(_words(self.lab)) or "scattered about the prediction"
        kind = f"; the error is {self.kind}" if self.kind else ""
        return f"It is worst {self.where}, where the display is {words}{kind}." if self.where else ""


def placed(worst: Slice) -> str:
    """Say where a slice lies."""
    said = CALLED[worst.by].format(worst.slice)
    # Black is a level of its own among spans of levels.
    return said.replace("levels", "level") if worst.slice == "0" else said


def _words(lab: tuple[float, float, float]) -> list[str]:
    names = (("lighter", "darker", "L*"), ("redder", "greener", "a*"), ("yellower", "bluer", "b*"))
    return [
        f"{up if value > 0 else down} than predicted (Δ{axis} {value:+.2f})"
        for value, (up, down, axis) in zip(lab, names, strict=True)
        if abs(value) > NOTICEABLE
    ]


def direction(problem: Problem, predicted: Array, judged: NDArray[np.bool_], where: Sequence[Slice]) -> Direction:
    """Find the slice that stands out most, by its error over its floor weighed with its size, and look which way."""
    if not where:
        return Direction("", (0.0, 0.0, 0.0), "")
    worst = max(
        telling(where) or where, key=lambda each: (each.rms_sigma**2 - each.floor_rms_sigma**2) * np.sqrt(each.n)
    )
    here = judged & (slices(problem)[worst.by] == worst.slice)
    white = problem.measured_tips[0, 0]
    lab = (xyz_to_lab(problem.xyz[here], white) - xyz_to_lab(predicted[here], white)).mean(axis=0)
    signed = (float(lab[0]), float(lab[1]), float(lab[2]))
    return Direction(placed(worst), signed, _kind(problem, predicted, judged))


def _kind(problem: Problem, predicted: Array, judged: NDArray[np.bool_]) -> str:
    """Whether the error goes with the light: luminance residuals explained by a constant, or by the luminance."""
    residual, light = (problem.xyz - predicted)[judged, 1], predicted[judged, 1]
    sigma = np.sqrt(problem.covariance(predicted)[judged, 1, 1])
    squares = float(((residual / sigma) ** 2).sum())
    if squares < 2.0 * residual.size:
        return ""
    left = []
    for shape in (np.ones_like(light), light):
        size = (shape * residual / sigma**2).sum() / max(float((shape**2 / sigma**2).sum()), 1e-300)
        left.append(float((((residual - size * shape) / sigma) ** 2).sum()))
    additive, multiplicative = (1.0 - each / squares for each in left)
    if max(additive, multiplicative) < 0.3:
        return ""
    return "additive" if additive > multiplicative else "multiplicative"
