"""The inverse of a display: the drive with which an aged display shows what the display showed when new.

q is the target in the light of the aged primaries, P·q = XYZ. d is the excess of white over its primaries, P·d = D
(``display/paper.py``). The paper's emission is l + d·s, so only the number s is unknown:

``continuous``  s = min l = min_c q_c / (1 + d_c)
``nearest``     Near a primary s = ⅓ of the two smaller channels, the minimum over i of
                ⅓Σ_{j≠i} q_j / (1 + ⅓Σ_{j≠i} d_j). Near white s = ⅓Σq / (1 + ⅓Σd). The result is the drive that lies in
                its own region. If both drives lie in their regions (the jump folds), the result is the drive nearer to
                the requested colour. If no drive lies in its region (the jump leaves a gap), the result is the point on
                the border with the smaller ΔE2000.

For a display with effects the inverse is a search (``display/search.py``). The search solves lattices of code values
from coarse to fine; each lattice starts from the results of the coarser lattice. All other colours start from the
results of their neighbours on the finest lattice.

A drive outside 0..1 is returned unclipped. Clipping each channel gives the drive that the display can show: colours
within reach stay exact, and other colours lose only the light of the clipped channels.
"""

from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import (
    Array,
    code_to_linear,
    delta_e_2000,
    inverse,
    linear_to_code,
    linear_to_lab,
    linear_to_xyz,
    transform,
    xyz_to_linear,
)
from lutgen.display.chain import AgedDisplay
from lutgen.display.effect_chain import jumps, without_steps
from lutgen.display.paper import Matrices, paper_links
from lutgen.display.search import Start, searched
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import UNREACHABLE

#: Tolerance for a drive on the border between white and the primaries: the resolution of float32.
ON_BORDER = 1e-5

#: Tolerance for a drive above 1: a tenth of the tolerance for colours outside the gamut.
_FULL = 1e-7

#: Points along the edges of the lattices whose results are starts; and the largest number of colours that are searched
#: without lattices, because lattices would take more time than they save.
_LATTICES, _FEW = (9, 17, 33), 1000

#: A node's label is 0 near a primary and 2 near white. ``_ONE_SIDE``: an interpolated label up to this comes from nodes
#: with label 0 only. ``_OTHER``: the label near white.
_ONE_SIDE, _OTHER = 1e-9, 2.0

#: Code values whose drives determine the factor of ``scale``: the largest drives lie on corners and edges.
_PROBES = np.array(list(product(np.linspace(0.0, 1.0, 5), repeat=3)))


@dataclass(frozen=True)
class Compensation:
    """The correction for one aged display, as a link. Two corrections are equal exactly when they compute the same."""

    #: The aged display, and the fresh display.
    aged: AgedDisplay
    fresh: AgedDisplay
    #: Factor on the light of the fresh display.
    scale: float = 1.0

    def __call__(self, signal: Array) -> Array:
        """Convert code values (n, 3) to the XYZ (n, 3) that an un-aged sRGB display shows for the drive."""
        return linear_to_xyz(self.drive(signal))

    def target(self, code: Array) -> Array:
        """Return the XYZ, (n, 3), that the aged display should show for code values (n, 3)."""
        return self.fresh.code_to_xyz(code) * self.scale

    def drive(self, code: Array) -> Array:
        """Return the drive in linear light, (n, 3), for code values (n, 3); outside 0..1 for colours out of reach."""
        if len(code) <= _FEW or paper_links(self.aged) is not None:
            return self.drive_from(code, None)
        return self.drive_from(code, _between(_lattice_drives(self), code))

    def drive_from(self, code: Array, start: Start | None) -> Array:
        """Return the same as :meth:`drive`, with ``start`` for :func:`searched`."""
        return drive_of(self.aged, self._goal(code), code_to_linear(code), start)

    def rough(self, code: Array, start: Start | None) -> tuple[Array, Array]:
        """Search a display with effects, not thoroughly; arguments and results as in :func:`searched`."""
        return searched(without_steps(self.aged) or self.aged, self._goal(code), start, thorough=False)

    def _goal(self, code: Array) -> Array:
        return (without_steps(self.fresh) or self.fresh).code_to_xyz(code) * self.scale

    def side(self, linear: Array) -> NDArray[np.uint8]:
        """Return the side of the border of the jump for drives (n, 3): 0 primary, 1 on the border, 2 white; (n,).

        All labels are 0 for a display that does not jump.
        """
        if not self.jumps:
            return np.zeros(len(linear), dtype=np.uint8)
        beyond = _smaller_two(linear) - 1.0
        return np.asarray((beyond > -ON_BORDER).astype(np.uint8) + (beyond > ON_BORDER))

    @property
    def jumps(self) -> bool:
        """Whether the aged display jumps at white's border."""
        paper = paper_links(self.aged)
        return jumps(self.aged) if paper is None else paper[0].name == "nearest"


def compensated(aged: AgedDisplay, fresh: AgedDisplay, *, unreachable: str = "clip") -> AgedDisplay:
    """Return the correction for an aged display, as an ``AgedDisplay`` whose "aged colour" is the corrected drive.

    ``code_to_code`` returns the code values of the clipped drive, ``code_to_linear`` the unclipped drive, and
    ``clipped_share`` the share of colours out of reach. ``unreachable``, one of ``UNREACHABLE``, selects the treatment
    of colours out of reach.

    Raises LutgenError: unknown ``unreachable``, or a display whose white lies outside its primaries.
    """
    refuse_unknown("way with unreachable colours", unreachable, UNREACHABLE)
    link = _correction(_unnamed(aged), _unnamed(fresh), unreachable)
    return AgedDisplay(aged.mode, aged.hours, (), (link,))


def compensation_of(display: AgedDisplay) -> Compensation | None:
    """Return the correction inside a display of :func:`compensated`; None for any other display."""
    match display.tail:
        case (Compensation() as link,):
            return link
    return None


def _unnamed(display: AgedDisplay) -> AgedDisplay:
    """Return the display without mode and hour, so that displays with equal links are equal."""
    return replace(display, mode="", hours=0.0)


@cache
def _correction(aged: AgedDisplay, fresh: AgedDisplay, unreachable: str) -> Compensation:
    whole = Compensation(aged, fresh)
    if unreachable == "clip":
        return whole
    last, drives = 1.0, whole.drive(_PROBES)
    if drives.max() <= 1.0 + _FULL:
        return whole
    low, high = 0.0, 1.0
    while high - low > _FULL:
        middle = 0.5 * (low + high)
        near = Start(drives * (middle / last), np.full((3, 3, len(_PROBES)), np.nan))
        last, drives = middle, replace(whole, scale=middle).drive_from(_PROBES, near)
        low, high = (middle, high) if drives.max() <= 1.0 + _FULL else (low, middle)
    # Rounded down to six decimals, because lutgen prints six decimals: the printed factor is the applied factor.
    return replace(whole, scale=np.floor(low * 1e6) / 1e6)


def _between(nodes: Array, code: Array) -> Start:
    """Interpolate a lattice at code values (n, 3); NaN if the neighbours lie on different sides of a jump."""
    size = round(len(nodes) ** (1 / 3))
    places = code * (size - 1)
    low = np.minimum(places.astype(np.intp), size - 2)
    above = (places - low)[:, :, np.newaxis]
    stride = np.array([size**2, size, 1])
    first, mixed = low @ stride, np.zeros((len(code), nodes.shape[1]))
    for corner in product((0, 1), repeat=3):
        weight = np.prod(np.where(np.array(corner)[:, np.newaxis], above, 1.0 - above), axis=1)
        mixed += weight * nodes.take(first + stride @ corner, axis=0)
    side = mixed[:, 0]
    mixed[(side > _ONE_SIDE) & (side < _OTHER - _ONE_SIDE)] = np.nan
    return Start(code_to_linear(mixed[:, 1:4]), mixed[:, 4:].T.reshape(3, 3, -1))


@lru_cache(maxsize=1)
def _lattice_drives(link: Compensation) -> Array:
    """Search lattices that are uniform in code values, each from the results of the coarser lattice.

    Returns the finest lattice, one row for each node, (n³, 13), blue fastest: side of the jump, code values of the
    drive, slopes. The result is cached for the same display.
    """
    start = None
    for size in _LATTICES:
        axis = np.linspace(0.0, 1.0, size)
        code = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        drives, slopes = link.rough(code, None if start is None else _between(start, code))
        start = np.column_stack([link.side(drives), linear_to_code(drives), slopes.reshape(9, -1).T])
    return np.asarray(start)


def drive_of(aged: AgedDisplay, xyz: Array, requested: Array, start: Start | None = None) -> Array:
    """Return the linear drives with which ``aged`` shows ``xyz``, both (n, 3); outside 0..1 for colours out of reach.

    ``requested``: linear light of the requested colours, (n, 3). Of two drives that show the same colour, the result is
    the drive nearer to ``requested``. ``start``: see :func:`searched`.
    """
    paper = paper_links(aged)
    if paper is None:
        return searched(without_steps(aged) or aged, xyz, start)[0]
    selection, emission = paper
    split = _Split.of(emission, selection.name)
    if selection.name == "continuous":
        return split.continuous(xyz)
    return _nearest(aged, split, xyz, requested)


@dataclass(frozen=True)
class _Split:
    """An emission as additive primaries (columns of ``primaries``), and white's excess ``extra`` in their light."""

    primaries: Array
    extra: Array

    @classmethod
    def of(cls, emission: Matrices, selection: str) -> "_Split":
        """Compute the tips from the matrices: T_i reproduces tip i, T'_i every tip except i."""
        t_w, t_r, t_g, t_b = emission.array
        if selection == "nearest":
            primaries, white = np.column_stack([t_r[:, 0], t_g[:, 1], t_b[:, 2]]), t_w.sum(axis=1)
        else:
            primaries, white = t_w, t_r.sum(axis=1)
        extra = transform(inverse(primaries), white) - 1.0
        if extra.min() <= -1.0:
            raise LutgenError(
                "the display's white lies outside its own primaries, so it cannot be inverted. Check the measurements."
            )
        return cls(primaries, extra)

    def light(self, xyz: Array) -> Array:
        """Return XYZ in the light of the primaries, (n, 3)."""
        return transform(inverse(self.primaries), xyz)

    def continuous(self, xyz: Array) -> Array:
        """Return the drives of ``continuous``, (n, 3)."""
        light = self.light(xyz)
        smallest = (light / (1.0 + self.extra)).min(axis=1, keepdims=True)
        return np.asarray(light - self.extra * smallest)

    def near_primary(self, xyz: Array) -> Array:
        """Return the drives of ``nearest``, (n, 3), if a primary is the nearest colour point."""
        light, extra = self.light(xyz), self.extra / 3.0
        others = light.sum(axis=1, keepdims=True) - light
        return np.asarray(light - extra * (others / (1.0 + extra.sum() - extra)).min(axis=1, keepdims=True))

    def near_white(self, xyz: Array) -> Array:
        """Return the drives of ``nearest``, (n, 3), if white is the nearest colour point."""
        light, extra = self.light(xyz), self.extra / 3.0
        return np.asarray(light - extra * (light.sum(axis=1, keepdims=True) / (1.0 + extra.sum())))


def _smaller_two(linear: Array) -> Array:
    """Return the sum of the two smaller channels; above 1 white is the nearest colour point."""
    return np.asarray(linear.sum(axis=1) - linear.max(axis=1))


def _nearest(aged: AgedDisplay, split: _Split, xyz: Array, requested: Array) -> Array:
    white, primary = split.near_white(xyz), split.near_primary(xyz)
    is_white, is_primary = _smaller_two(white) > 1.0, _smaller_two(primary) <= 1.0
    away = [np.square(drive - requested).sum(axis=1) for drive in (white, primary)]
    take_white = np.where(is_white & is_primary, away[0] < away[1], is_white)
    drive = np.where(take_white[:, np.newaxis], white, primary)
    gap = ~is_white & ~is_primary
    if gap.any():
        drive[gap] = _at_border(aged, white[gap], primary[gap], xyz[gap])
    return drive


def _at_border(aged: AgedDisplay, white: Array, primary: Array, xyz: Array) -> Array:
    """Move both drives to their own side of the border; return the drive with the smaller ΔE2000 to ``xyz``."""
    target = linear_to_lab(xyz_to_linear(xyz))
    drives = [_with_sum(white, 1.0 + ON_BORDER / 2), _with_sum(primary, 1.0 - ON_BORDER / 2)]
    shown = [aged.code_to_linear(linear_to_code(np.clip(drive, 0.0, 1.0))) for drive in drives]
    error = [delta_e_2000(linear_to_lab(each), target) for each in shown]
    return np.where((error[0] < error[1])[:, np.newaxis], *drives)


def _with_sum(linear: Array, target: float) -> Array:
    """Return drives (n, 3) with an equal change of the two smaller channels, whose sum becomes ``target``."""
    smaller = np.arange(3) != linear.argmax(axis=1)[:, np.newaxis]
    return np.asarray(linear + smaller * ((target - _smaller_two(linear)) / 2.0)[:, np.newaxis])
