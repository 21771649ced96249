"""Rung: products of code values, three terms for each of X, Y and Z beside the curves.

Mixtures are brighter than their channels together, mostly in mid-tones. Products of code values d_i·d_j tell so better
than products of light, which act on the brightest colours alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.display.own_model import xyz_curves

if TYPE_CHECKING:
    from lutgen.display.own_model.drive import Drive
    from lutgen.display.own_model.sample import Sample
    from lutgen.display.own_model.xyz_curves import Curves

NAME = "products of code values"


def fit(sample: Sample, drive: Drive, stiffness: float) -> Curves:
    """Fit curves and products together: curves that were fitted without them have taken in their mean."""
    return xyz_curves.fit(sample, drive, stiffness, products=True)
