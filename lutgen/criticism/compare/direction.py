"""Direction of the model's error in plain words: place of the largest error, lightness, hue, additive or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xyz_to_lab
from lutgen.criticism.compare.slices import informative, labels_of, prominence, standing_out
from lutgen.readings.conditions import CONDITIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.criticism.compare.slices import Slice
    from lutgen.criticism.fit.problem import Problem

#: A sentence does not mention a mean ΔL*, Δa* or Δb* below this.
NOTICEABLE = 0.05

#: Phrase of a sentence for the place of a slice, by its dimension.
CALLED = {"hour": "at {}", "level": "at levels {}", "family": "on {} patches"} | {
    each.key: each.sentence for each in CONDITIONS
}


@dataclass(frozen=True)
class Direction:
    """The worst slice and the mean direction of the error there.

    ``lab`` is measured minus predicted, mean ΔL*, Δa*, Δb*; ``kind`` is additive, multiplicative or mixed.
    """

    where: str
    lab: tuple[float, float, float]
    kind: str

    def sentence(self) -> str:
        """Return the direction as a sentence."""
        words = ", ".join(_words(self.lab)) or "scattered about the prediction"
        kind = f"; the error is {self.kind}" if self.kind else ""
        return f"It is worst {self.where}, where the display is {words}{kind}." if self.where else ""


def placed(worst: Slice) -> str:
    """Return the place of a slice as a phrase."""
    phrase = CALLED[worst.by].format(worst.slice)
    # Black is a single level; other slices of this dimension are ranges of levels.
    return phrase.replace("levels", "level") if worst.slice == "0" else phrase


def _words(lab: tuple[float, float, float]) -> list[str]:
    names = (("lighter", "darker", "L*"), ("redder", "greener", "a*"), ("yellower", "bluer", "b*"))
    return [
        f"{up if value > 0 else down} than predicted (Δ{axis} {value:+.2f})"
        for value, (up, down, axis) in zip(lab, names, strict=True)
        if abs(value) > NOTICEABLE
    ]


def direction(problem: Problem, predicted: Array, judged: NDArray[np.bool_], where: Sequence[Slice]) -> Direction:
    """Find the slice with the largest excess error, weighted by the root of its size, and the mean direction there."""
    if not where:
        return Direction("", (0.0, 0.0, 0.0), "")
    worst = max(standing_out(where) or informative(where) or where, key=prominence)
    here = judged & (labels_of(problem)[worst.by] == worst.slice)
    white = problem.measured_tips[0, 0]
    lab = (xyz_to_lab(problem.xyz[here], white) - xyz_to_lab(predicted[here], white)).mean(axis=0)
    signed = (float(lab[0]), float(lab[1]), float(lab[2]))
    return Direction(placed(worst), signed, _kind(problem, predicted, judged))


def _kind(problem: Problem, predicted: Array, judged: NDArray[np.bool_]) -> str:
    """Say whether a constant or a factor explains the luminance residuals better; "" if neither explains enough."""
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
