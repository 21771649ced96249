"""Simulate after compensate: what an aged display shows through a correction, against what the new one showed.

The drives are the file's, clipped to 0..1 as every display clips them. Colours are told apart:

``reached``         those that the aged display can show: the error that is left is the table's
``reached_border``  the same, but the table mixes across a jump of the display, or across the end of its drive
``unreachable``     those that need more than full drive, or less than none: the loss is the display's
``inverse``         the reached colours by the model's inverse itself, without a file: the inverse's own error
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.figures import Figures, figures
from lutgen.colorimetry import delta_e_2000, linear_to_code, linear_to_lab, xyz_to_linear
from lutgen.display.chain import outside_gamut

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display import Compensation


@dataclass(frozen=True)
class RoundTrip:
    """The figures of a correction, and the shares of colours out of reach: of a lattice's, and of the tissue colours.

    The lattice is uniform in code values. ``scale`` is the factor on the light of the un-aged display that the aged
    one is compared with.
    """

    reached: Figures
    reached_border: Figures
    unreachable: Figures
    inverse: Figures
    unreachable_lattice_share: float
    unreachable_tissue_share: float
    scale: float


@dataclass(frozen=True, eq=False)
class Without:
    """The part of a round trip that depends on no file: the L*a*b* to be shown, (n, 3), and the inverse's own error."""

    link: Compensation
    target: Array
    inverse: Figures

    @classmethod
    def of(cls, link: Compensation, asked: Array, drive: Array, usual: NDArray[np.bool_]) -> Without:
        """Send code values (n, 3) to the un-aged display, and their unclipped drives (n, 3) to the aged one.

        ``usual``, (n,), is for :func:`figures`.
        """
        target = linear_to_lab(xyz_to_linear(link.target(asked)))
        reached = ~outside_gamut(drive)
        exact = linear_to_code(np.clip(drive[reached], 0.0, 1.0))
        shown = linear_to_lab(link.aged.code_to_linear(exact))
        return cls(link, target, figures(delta_e_2000(shown, target[reached]), usual[reached]))


def round_trip(
    without: Without,
    drive: Array,
    code: Array,
    *,
    border: NDArray[np.bool_],
    usual: NDArray[np.bool_],
    tissue: slice,
    lattice: Array,
) -> RoundTrip:
    """Send colours through a correction's file and then to the aged display.

    ``without``: the same without a file. ``drive``: the model's linear drives for the colours, unclipped, (n, 3).
    ``code``: the file's code values for them, (n, 3). ``border``: whether the file mixes drives from both sides of a
    jump, or of the end of what it clips to, (n,). ``usual``: which of the colours tell means and quantiles, (n,).
    ``tissue``: which of the colours are tissue. ``lattice``: the model's linear drives for a lattice, (m, 3).
    """
    aged = without.link.aged
    shown = delta_e_2000(linear_to_lab(aged.code_to_linear(np.clip(code, 0.0, 1.0))), without.target)
    out = outside_gamut(drive)
    reached, reached_border, unreachable = (
        figures(shown[group], usual[group]) for group in (~out & ~border, ~out & border, out)
    )
    return RoundTrip(
        reached=reached,
        reached_border=reached_border,
        unreachable=unreachable,
        inverse=without.inverse,
        unreachable_lattice_share=float(outside_gamut(lattice).mean()),
        unreachable_tissue_share=float(out[tissue].mean()),
        scale=without.link.scale,
    )
