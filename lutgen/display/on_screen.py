"""A display with position-dependent light: the position of a picture on the screen, and the display at each position.

The conditions u and v give effects the position of a reading. Each pixel of a picture has its own position, which no
LUT can carry.

A measured uniformity of the screen is an effect without parameters: the light at a position over the light in the
centre, one ratio each for X, Y and Z, of the brightest grey that was read at enough positions. A thin plate spline
interpolates the logarithm of the ratio between the readings (J. Duchon, Splines minimizing rotation-invariant
semi-norms in Sobolev spaces, 1977, doi:10.1007/BFb0086566). Outside the outermost readings the ratio stays constant.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.cells import number_list
from lutgen.colorimetry import Array, in_chunks
from lutgen.display.chain import AgedDisplay, Link
from lutgen.display.effect_chain import LightLink, PanelLink, Surroundings
from lutgen.display.fitted import AppliedEffect
from lutgen.display.model import DisplayModel
from lutgen.effects import Effect, Scene
from lutgen.effects.probe import reacts_to
from lutgen.errors import LutgenError
from lutgen.numerals import in_percent
from lutgen.readings.conditions.position import PLACE
from lutgen.readings.session import DRIVE_TOLERANCE, Session

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

#: Name of the effect of a measured uniformity.
NAME = "measured-uniformity"

#: Smallest number of positions in a table, and largest distance of the nearest position from the centre of the screen,
#: in shares of a side.
LEAST_PLACES, MIDDLE = 5, 0.1

#: Points along each side of the grid on which the spline is evaluated; pixels are interpolated bilinearly in the grid.
SIDE = 65


@dataclass(frozen=True, eq=False)
class MeasuredUniformity:
    """Readings of one grey at several positions of a screen."""

    #: Positions as shares from the left and the top, (p, 2), without repetition.
    places: Array
    #: X, Y and Z at each position over X, Y and Z in the centre, (p, 3).
    ratio: Array
    #: Code value of the grey.
    grey: float
    #: The file of the table, and the hash of its bytes.
    file: str = field(default="<memory>")
    sha256: str = ""

    @classmethod
    def of(cls, session: Session) -> "MeasuredUniformity":
        """Return the table of the brightest grey that was read at ``LEAST_PLACES`` positions or more, with the centre.

        Raises LutgenError: the session has no such grey, or one of its readings has no light.
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
                which = which.reshape(-1)
                xyz = np.stack([np.bincount(which, each) / np.bincount(which) for each in session.xyz[rows].T], axis=1)
                return cls(places, _over_middle(places, xyz, session.file), float(grey), session.file, session.sha256)
        raise LutgenError(
            f"{session.file}: no grey was read at {LEAST_PLACES} places or more. Measure white in the middle, near the "
            f"corners, and better on a grid over the whole screen."
        )

    @property
    def applied(self) -> AppliedEffect:
        """The uniformity as an effect of a model."""
        text = f"The screen's uniformity as measured: {self.file}"
        effect = Effect(NAME, "optics", {}, {}, (), self._dimmed, needs=PLACE, text=text, origin=self.file)
        return AppliedEffect(effect, {})

    def sentence(self) -> str:
        """Return a sentence on the content of the table."""
        low, high = (f"{100 * share:.0f}" for share in (self.ratio[:, 1].min(), self.ratio[:, 1].max()))
        return (
            f"{Path(self.file).name}: grey {self.grey:.3g} at {len(self.places)} places has {low} to {high} % of its "
            f"luminance in the middle. The table applies at every hour; the un-aged display is assumed to be uniform."
        )

    def _dimmed(self, xyz: Array, scene: Scene, /, **_none: float) -> Array:
        """Convert XYZ (..., n, 3) in the centre to XYZ at the positions of the scene."""
        u, v = np.broadcast_arrays(scene.u, scene.v)
        at = np.column_stack([u.reshape(-1), v.reshape(-1)])
        low, high = self.places.min(axis=0), self.places.max(axis=0)
        return np.asarray(xyz * self._table(np.clip(at, low, high)))

    @cached_property
    def _table(self) -> "RegularGridInterpolator":
        from scipy.interpolate import RBFInterpolator, RegularGridInterpolator

        try:
            spline = RBFInterpolator(self.places, np.log(self.ratio), kernel="thin_plate_spline")
        except np.linalg.LinAlgError:
            raise LutgenError(
                f"{self.file}: all places lie on one line, so the rest of the screen is not measured. Measure near all "
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


@dataclass(frozen=True)
class OnScreen:
    """The position of a picture on the screen, and its measured uniformity. Raises LutgenError: no such position."""

    #: Position and size of the picture, as shares of the screen's width and height.
    left: float = 0.0
    top: float = 0.0
    width: float = 1.0
    height: float = 1.0
    #: A measured table; None: only the model's effects depend on the position.
    uniformity: MeasuredUniformity | None = None

    def __post_init__(self) -> None:
        sides = ((self.left, self.width), (self.top, self.height))
        if not all(start >= 0.0 and size > 0.0 and start + size <= 1.0 + 1e-9 for start, size in sides):
            raise LutgenError(
                f"a picture at {self.left:g},{self.top:g} of size {self.width:g},{self.height:g} does not lie on the "
                f"screen. Left, top, width and height are shares of the screen, such as 0.25,0.25,0.5,0.5."
            )

    @classmethod
    def parse(cls, text: str, uniformity: MeasuredUniformity | None = None) -> "OnScreen":
        """Parse LEFT,TOP,WIDTH,HEIGHT. Raises LutgenError: another form, or a picture that is not inside the screen."""
        shares = number_list(text)
        if shares is None or len(shares) != 4:
            raise LutgenError(
                f"--place {text}: give left, top, width and height as shares of the screen, such as 0.25,0.25,0.5,0.5."
            )
        return cls(*shares, uniformity)

    def aged(self, model: DisplayModel) -> DisplayModel:
        """Return the model with the measured uniformity.

        Raises LutgenError: nothing in the model depends on the position, both the model and a table do, or the model's
        conditions state a position.
        """
        stated = [name for name in model.conditions.stated() if name in PLACE]
        if stated:
            raise LutgenError(f"--at {stated[0]} gives one position; a picture covers many. Leave it out.")
        names = [each.effect.name for each in model.baked if set(PLACE) & set(reacts_to(each.effect))]
        if self.uniformity is None:
            if not names:
                raise LutgenError(
                    "nothing in this model depends on the place on the screen. Give a uniformity table (--uniformity), "
                    "or a --model with an effect that depends on it, such as edge-falloff."
                )
            return model
        if names:
            raise LutgenError(
                f"{names[0]} of the model and the uniformity table both say how the screen darkens, and would count "
                f"twice. Leave one of them out."
            )
        return replace(model, effects=(*model.effects, self.uniformity.applied))

    @staticmethod
    def unaged(model: DisplayModel) -> AgedDisplay:
        """Return the display for comparison with aged displays: mode ``stable``, without the measured uniformity."""
        even = tuple(each for each in model.effects if each.effect.name != NAME)
        return replace(model, effects=even).at("stable", 0.0)

    def places(self, first: int, count: int, shape: tuple[int, int], orientation: int = 1) -> Array:
        """Return u and v, (count, 2), of ``count`` pixels from pixel ``first`` on, row by row, of a stored picture.

        ``shape``: rows and columns of the stored picture. ``orientation``: TIFF's orientation of the file, 1 to 8; the
        picture appears on the screen in this orientation.
        """
        down, across = np.divmod(np.arange(first, first + count), shape[1])
        down, across = (down + 0.5) / shape[0], (across + 0.5) / shape[1]
        if orientation in (5, 6, 7, 8):
            down, across = across, down
        if orientation in (3, 4, 7, 8):
            down = 1.0 - down
        if orientation in (2, 3, 6, 7):
            across = 1.0 - across
        return np.stack([self.left + self.width * across, self.top + self.height * down], axis=1)

    def sentences(self) -> list[str]:
        """Return sentences on the position of the picture, and on the uniformity table."""
        where = "fills the screen"
        if (self.left, self.top, self.width, self.height) != (0.0, 0.0, 1.0, 1.0):
            left, right, top, bottom = map(
                in_percent, (self.left, self.left + self.width, self.top, self.top + self.height)
            )
            where = f"lies from {left} to {right} of the screen's width and from {top} to {bottom} of its height"
        table = [self.uniformity.sentence()] if self.uniformity else []
        return [f"The picture {where}. No LUT carries what depends on the place.", *table]

    def as_json(self) -> dict[str, Any]:
        """Return position, size and uniformity table as JSON."""
        table = self.uniformity
        return {
            "left": self.left,
            "top": self.top,
            "width": self.width,
            "height": self.height,
            "uniformity": {"file": table.file, "sha256": table.sha256} if table else None,
        }


@dataclass(frozen=True, eq=False)
class _Placed(Surroundings):
    """Surroundings with a position for each row of the signal: u and v, (n, 2)."""

    place: Array = field(default_factory=lambda: np.full((1, 2), 0.5))

    def scene(self, code: Array) -> Scene:
        """Return the scene of code values (n, 3)."""
        where: dict[str, Any] = {"u": self.place[:, :1], "v": self.place[:, 1:]}
        return replace(super().scene(code), **where)


def seen_at(aged: AgedDisplay, place: Array) -> AgedDisplay:
    """Return the display with a position for each of n colours: u and v, (n, 2)."""
    return replace(aged, tail=tuple(_placed(link, place) for link in aged.tail))


def linear_at(aged: AgedDisplay, code: Array, place: Array) -> Array:
    """Convert code values (n, 3) at positions (n, 2) to linear sRGB of the aged colours (n, 3), unclipped."""
    return in_chunks(lambda some, at: seen_at(aged, at).linear(aged.head_signal(some)), code, place)


def _placed(link: Link, place: Array) -> Link:
    if not isinstance(link, PanelLink | LightLink) or link.surroundings is None:
        return link
    now = link.surroundings
    return replace(link, surroundings=_Placed(now.hours, now.tips, now.fresh, now.display_class, now.conditions, place))
