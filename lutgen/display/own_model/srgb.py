"""The lowest rung: the paper's fresh display, sRGB's curves with white and primaries as measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import code_to_linear
from lutgen.display.trace import tip_shares

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.display.own_model.sample import Sample

NAME = "curves of sRGB with white and primaries as measured"


@dataclass(frozen=True)
class SrgbCurves:
    """Code values (m, 3) → shares of white's X, Y and Z, (m, 3), by the paper's ``nearest`` matrices.

    ``tips`` (4, 3) are the shares of white, red, green and blue.
    """

    tips: Array

    def __call__(self, code: Array) -> Array:
        """See the class."""
        return np.asarray(tip_shares(code_to_linear(code), code, "nearest") @ self.tips)


def fit(sample: Sample) -> SrgbCurves:
    """Take the measured colour points."""
    return SrgbCurves(sample.tips)
