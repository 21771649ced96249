"""Round trip of a correction: the colours of the aged display behind a correction, compared with the new display.

The drives are the file's values, clipped to 0..1 as by every display. There are four groups of figures:

``reached``         colours that the aged display can show: the error is due to the table
``reached_border``  colours that it can show, but for which the table mixes across a jump of the display or across the
                    end of its drive
``unreachable``     colours that need more than full drive or less than zero drive: the error is due to the display
``inverse``         the reached colours with the model's inverse instead of a file: the error of the inverse itself
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.figures import Figures, figures
from lutgen.colorimetry import Array, delta_e_2000, linear_to_code, linear_to_lab, xyz_to_linear
from lutgen.display import Compensation
from lutgen.display.chain import outside_gamut


@dataclass(frozen=True)
class RoundTrip:
    """The figures of a correction, and the shares of unreachable colours in a lattice and in the tissue colours.

    The lattice is uniform in code values. ``scale`` is the factor on the light of the un-aged display before the aged
    display is compared with it.
    """

    reached: Figures
    reached_border: Figures
    unreachable: Figures
    inverse: Figures
    unreachable_lattice_share: float
    unreachable_tissue_share: float
    scale: float


@dataclass(frozen=True, eq=False)
class FileIndependent:
    """The file-independent part of a round trip: the target L*a*b*, (n, 3), and the errors of the inverse."""

    link: Compensation
    target: Array
    inverse: Figures

    @classmethod
    def of(cls, link: Compensation, code: Array, drive: Array, usual: NDArray[np.bool_]) -> "FileIndependent":
        """Send code values (n, 3) to the un-aged display, and their unclipped drives (n, 3) to the aged display.

        ``usual``, (n,), is the argument of :func:`figures`.
        """
        target = linear_to_lab(xyz_to_linear(link.target(code)))
        reached = ~outside_gamut(drive)
        exact = linear_to_code(np.clip(drive[reached], 0.0, 1.0))
        shown = linear_to_lab(link.aged.code_to_linear(exact))
        return cls(link, target, figures(delta_e_2000(shown, target[reached]), usual[reached]))


def round_trip(
    fixed: FileIndependent,
    drive: Array,
    code: Array,
    *,
    border: NDArray[np.bool_],
    usual: NDArray[np.bool_],
    tissue: slice,
    lattice: Array,
) -> RoundTrip:
    """Return the figures of colours that pass through a correction's file and then the aged display.

    ``fixed``: the file-independent part. ``drive``: the model's unclipped linear drives for the colours, (n, 3).
    ``code``: the file's code values for the colours, (n, 3). ``border``: whether the file mixes drives from both sides
    of a jump or of the clip, (n,). ``usual``: which colours count for means and quantiles, (n,). ``tissue``: which
    colours are tissue. ``lattice``: the model's linear drives for a lattice, (m, 3).
    """
    aged = fixed.link.aged
    shown = delta_e_2000(linear_to_lab(aged.code_to_linear(np.clip(code, 0.0, 1.0))), fixed.target)
    out = outside_gamut(drive)
    groups = (~out & ~border, ~out & border, out)
    reached, at_border, unreachable = (figures(shown[group], usual[group]) for group in groups)
    shares = float(outside_gamut(lattice).mean()), float(out[tissue].mean())
    return RoundTrip(reached, at_border, unreachable, fixed.inverse, *shares, fixed.link.scale)
