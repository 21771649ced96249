"""A measured uniformity of the screen, as an effect without parameters: the light of a place over that of the middle.

X, Y and Z each have a ratio, of the brightest grey that was read at enough places. Between the places the logarithm of
the ratio is a thin plate spline, which meets every reading; beyond the outermost places their values hold, since
nothing was read there.

Source: J. Duchon, Splines minimizing rotation-invariant semi-norms in Sobolev spaces (1977), doi:10.1007/BFb0086566.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.display.fitted import AppliedEffect
from lutgen.effects import Effect
from lutgen.errors import LutgenError
from lutgen.readings.session import DRIVE_TOLERANCE

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

    from lutgen.colorimetry import Array
    from lutgen.effects import Scene
    from lutgen.readings.session import Session

#: The name of the effect.
NAME = "measured-uniformity"

#: Places that a table has at least, and how far from the middle the nearest of them may be, in shares of a side.
LEAST_PLACES, MIDDLE = 5, 0.1

#: Points along each side of the table in which pixels are looked up, by bilinear interpolation.
SIDE = 65


@dataclass(frozen=True, eq=False)
class MeasuredUniformity:
    """What was read at several places of one screen."""

    #: Shares from the left and the top, (p, 2), each once.
    places: Array
    #: X, Y and Z there over those of the middle, (p, 3).
    ratio: Array
    #: The code value that was read.
    grey: float
    #: The table.
    file: str = field(default="<memory>")
    sha256: str = ""

    @classmethod
    def of(cls, session: Session) -> MeasuredUniformity:
        """Take the brightest grey that was read at ``LEAST_PLACES`` places or more, one of them in the middle.

        Raises LutgenError: the session has no such grey, or a reading of it without light.
        """
        if session.positions is None:
            raise LutgenError(
                f"{session.file}: the readings state no positions on the screen. Give a uniformity table, or readings "
                f"with the columns u and v."
            )
        is_grey = np.ptp(session.drive, axis=1) <= DRIVE_TOLERANCE
        for grey in np.unique(session.drive[is_grey, 0])[::-1]:
            rows = is_grey & (session.drive[:, 0] == grey)
            places, which = np.unique(session.positions[rows], axis=0, return_inverse=True)
            if len(places) >= LEAST_PLACES and grey > 0.0:
                count = np.bincount(which.reshape(-1))
                xyz = np.stack([np.bincount(which.reshape(-1), each) / count for each in session.xyz[rows].T], axis=1)
                return cls(places, _over_middle(places, xyz, session.file), float(grey), session.file, session.sha256)
        raise LutgenError(
            f"{session.file}: no grey was read at {LEAST_PLACES} places or more. Measure white in the middle, near the "
            f"corners, and better on a grid over the whole screen."
        )

    @property
    def applied(self) -> AppliedEffect:
        """The effect, for the list of a model's effects."""
        text = f"The screen's uniformity as measured: {self.file}"
        effect = Effect(NAME, "optics", {}, {}, (), self._dimmed, needs=("u", "v"), text=text, origin=self.file)
        return AppliedEffect(effect, {})

    def sentence(self) -> str:
        """Say what the table holds."""
        low, high = (f"{100 * share:.0f}" for share in (self.ratio[:, 1].min(), self.ratio[:, 1].max()))
        return (
            f"{Path(self.file).name}: grey {self.grey:.3g} at {len(self.places)} places has {low} to {high} % of its "
            f"luminance in the middle. The table is taken for every hour, and the un-aged display for even."
        )

    def _dimmed(self, xyz: Array, scene: Scene, /, **_none: float) -> Array:
        """XYZ (..., n, 3) of the middle → that of the scene's places."""
        u, v = np.broadcast_arrays(scene.u, scene.v)
        at = np.column_stack([u.reshape(-1), v.reshape(-1)])
        low, high = self.places.min(axis=0), self.places.max(axis=0)
        return np.asarray(xyz * self._table(np.clip(at, low, high)))

    @cached_property
    def _table(self) -> RegularGridInterpolator:
        from scipy.interpolate import RBFInterpolator, RegularGridInterpolator

        try:
            spline = RBFInterpolator(self.places, np.log(self.ratio), kernel="thin_plate_spline")
        except np.linalg.LinAlgError:
            raise LutgenError(
                f"{self.file}: all places lie on one line, and say nothing of the rest of the screen. Measure near all "
                f"four corners."
            ) from None
        axes = np.linspace(self.places.min(axis=0), self.places.max(axis=0), SIDE).T
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return RegularGridInterpolator(tuple(axes), np.exp(spline(nodes.reshape(-1, 2))).reshape(SIDE, SIDE, 3))


def _over_middle(places: Array, xyz: Array, file: str) -> Array:
    away = np.abs(places - 0.5).max(axis=1)
    nearest = int(np.argmin(away))
    if away[nearest] > MIDDLE:
        u, v = places[nearest]
        raise LutgenError(
            f"{file}: the place nearest to the middle of the screen is u = {u:g}, v = {v:g}. Measure the middle too: "
            f"the model is that of the middle."
        )
    if (xyz <= 0.0).any():
        u, v = places[int(np.argmax((xyz <= 0.0).any(axis=1)))]
        raise LutgenError(f"{file}: a reading at u = {u:g}, v = {v:g} has no light. Measure a brighter grey.")
    return np.asarray(xyz / xyz[nearest])
