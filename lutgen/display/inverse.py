"""The display backwards: the drive with which an aged display shows what it showed when it was new.

With q the target in the light of the aged primaries, P·q = XYZ, and d what the white adds to them, P·d = D
(``display/paper.py``), the paper's emission is l + d·s, and only the number s has to be found:

``continuous``  s = min l = min_c q_c / (1 + d_c)
``nearest``     near a primary s = ⅓ of the two smaller channels, the least of ⅓Σ_{j≠i} q_j / (1 + ⅓Σ_{j≠i} d_j) over i;
                near white s = ⅓Σq / (1 + ⅓Σd). The drive that lies in its own region is taken. If both do (the jump
                folds), the one nearer to the colour asked for; if neither does (the jump leaves a gap), the point on
                the border with the smaller ΔE2000.

A display with effects is searched (``display/search.py``): a lattice of code values from coarse to fine, each from the
answers of the coarser one, then any colours from those of their neighbours on the finest.

A drive outside 0..1 is given as it is. Clipped channel by channel it is what the display can do: colours that it
reaches stay exact, and the others lose no more than the channels that do not suffice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import (
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
from lutgen.display.paper import paper_links
from lutgen.display.search import Start, searched
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import UNREACHABLE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display.paper import Matrices

#: On the border between white and the primaries: nearer to it than float32 tells apart.
ON_BORDER = 1e-5

#: A drive may exceed 1 by this: a tenth of what counts as outside.
_FULL = 1e-7

#: Points along the edges of the lattices that are searched for starts. Fewer colours than the second are searched
#: without lattices, which would cost more time than they save.
_LATTICES, _FEW = (9, 17, 33), 1000

#: Interpolated sides: from one alone, and from the other alone, give or take rounding.
_ONE_SIDE, _OTHER = 1e-9, 2.0

#: Code values whose drive decides the factor of ``scale``: the largest lie on corners and edges.
_PROBES = np.array(list(product(np.linspace(0.0, 1.0, 5), repeat=3)))


@dataclass(frozen=True)
class Compensation:
    """The correction for one aged display, as a link: equal to another exactly when it computes the same."""

    #: The display as it is, and as it was.
    aged: AgedDisplay
    fresh: AgedDisplay
    #: Factor on the fresh display's light.
    scale: float = 1.0
    stage: str = "drive"

    def __call__(self, signal: Array) -> Array:
        """(n, 3) code → (n, 3) XYZ in which an un-aged sRGB display shows the drive: so drives pass for colours."""
        return linear_to_xyz(self.drive(signal))

    def target(self, code: Array) -> Array:
        """Code values (n, 3) → the XYZ that the aged display is to show, (n, 3)."""
        return self.fresh.code_to_xyz(code) * self.scale

    def drive(self, code: Array) -> Array:
        """Code values (n, 3) → the drive in linear light, (n, 3); outside 0..1 where the display cannot follow."""
        if len(code) <= _FEW or paper_links(self.aged) is not None:
            return self.drive_from(code, None)
        return self.drive_from(code, _lattice_drives(self).between(code))

    def drive_from(self, code: Array, start: Start | None) -> Array:
        """As :meth:`drive`; ``start`` is that of :func:`searched`."""
        return drive_of(self.aged, self._goal(code), code_to_linear(code), start)

    def rough(self, code: Array, start: Start | None) -> tuple[Array, Array]:
        """Search a display with effects, not thoroughly; results and ``start`` are those of :func:`searched`."""
        return searched(without_steps(self.aged) or self.aged, self._goal(code), start, thorough=False)

    def _goal(self, code: Array) -> Array:
        return (without_steps(self.fresh) or self.fresh).code_to_xyz(code) * self.scale

    def side(self, linear: Array) -> NDArray[np.uint8]:
        """Label drives (n, 3) by the side of the border at which the aged display jumps: 0 primary, 1 on it, 2 white.

        All 0 for a display that does not jump.
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
    """Return the correction for an aged display, in the form of a display: its "aged colour" is the drive to send.

    ``code_to_code`` gives the clipped drive's code values, ``code_to_linear`` the drive unclipped, and
    ``clipped_share`` the share of colours that cannot be reached. One of ``UNREACHABLE`` says what becomes of these.

    Raises LutgenError: unknown ``unreachable``, or a display whose white lies outside its primaries.
    """
    refuse_unknown("way with unreachable colours", unreachable, UNREACHABLE)
    link = _correction(_unnamed(aged), _unnamed(fresh), unreachable)
    return AgedDisplay(aged.mode, aged.hours, (), (link,))


def compensation_of(display: AgedDisplay) -> Compensation | None:
    """Return the correction that a display of :func:`compensated` stands for; None for a true display."""
    match display.tail:
        case (Compensation() as link,):
            return link
    return None


def _unnamed(display: AgedDisplay) -> AgedDisplay:
    """Without mode and hour, so that equal displays are equal."""
    return replace(display, mode="", hours=0.0)


@cache
def _correction(aged: AgedDisplay, fresh: AgedDisplay, unreachable: str) -> Compensation:
    whole = Compensation(aged, fresh)
    if unreachable == "clip" or whole.drive(_PROBES).max() <= 1.0 + _FULL:
        return whole
    low, high = 0.0, 1.0
    last, drives = 1.0, whole.drive(_PROBES)
    while high - low > _FULL:
        middle = 0.5 * (low + high)
        near = Start(drives * (middle / last), np.full((3, 3, len(_PROBES)), np.nan))
        last, drives = middle, replace(whole, scale=middle).drive_from(_PROBES, near)
        low, high = (middle, high) if drives.max() <= 1.0 + _FULL else (low, middle)
    # Six decimals are printed and kept: what a reader sees is what was done.
    return replace(whole, scale=np.floor(low * 1e6) / 1e6)


@dataclass(frozen=True, eq=False)
class _LatticeDrives:
    """The drives for a lattice uniform in code values, a row for each node: side of the jump, code values, slopes.

    Shape (n³, 13), blue fastest.
    """

    size: int
    nodes: Array

    def between(self, code: Array) -> Start:
        """Interpolate for code values (n, 3); NaN where neighbours lie on different sides of a jump."""
        places = code * (self.size - 1)
        low = np.minimum(places.astype(np.intp), self.size - 2)
        above = (places - low)[:, :, np.newaxis]
        stride = np.array([self.size**2, self.size, 1])
        first, mixed = low @ stride, np.zeros((len(code), self.nodes.shape[1]))
        for corner in product((0, 1), repeat=3):
            weight = np.prod(np.where(np.array(corner)[:, np.newaxis], above, 1.0 - above), axis=1)
            mixed += weight * self.nodes.take(first + stride @ corner, axis=0)
        side = mixed[:, 0]
        mixed[(side > _ONE_SIDE) & (side < _OTHER - _ONE_SIDE)] = np.nan
        return Start(code_to_linear(mixed[:, 1:4]), mixed[:, 4:].T.reshape(3, 3, -1))


@lru_cache(maxsize=1)
def _lattice_drives(link: Compensation) -> _LatticeDrives:
    """Search the lattices, each from the answers of the coarser one. Kept for the next colours of the same display."""
    coarser: _LatticeDrives | None = None
    for size in _LATTICES:
        axis = np.linspace(0.0, 1.0, size)
        code = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        drives, slopes = link.rough(code, coarser.between(code) if coarser else None)
        coarser = _LatticeDrives(
            size, np.column_stack([link.side(drives), linear_to_code(drives), slopes.reshape(9, -1).T])
        )
    if coarser is None:
        raise AssertionError
    return coarser


def drive_of(aged: AgedDisplay, xyz: Array, asked: Array, start: Start | None = None) -> Array:
    """Return the linear drives with which ``aged`` shows ``xyz``, both (n, 3); outside 0..1 where it cannot.

    ``asked`` decides where two drives show the same: linear light (n, 3), to which the nearer is taken. ``start`` is
    for a display that is searched: see :func:`searched`.
    """
    paper = paper_links(aged)
    if paper is None:
        return searched(without_steps(aged) or aged, xyz, start)[0]
    selection, emission = paper
    split = _Split.of(emission, selection.name)
    if selection.name == "continuous":
        return split.continuous(xyz)
    return _nearest(aged, split, xyz, asked)


@dataclass(frozen=True)
class _Split:
    """An emission as additive primaries, the columns of ``primaries``, and what white adds, in their light."""

    primaries: Array
    extra: Array

    @classmethod
    def of(cls, emission: Matrices, selection: str) -> _Split:
        """Take the tips from the matrices: T_i meets tip i, T'_i every tip but i."""
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
        """XYZ in the light of the primaries, (n, 3)."""
        return transform(inverse(self.primaries), xyz)

    def continuous(self, xyz: Array) -> Array:
        """Drives by ``continuous``, (n, 3)."""
        light = self.light(xyz)
        smallest = (light / (1.0 + self.extra)).min(axis=1, keepdims=True)
        return np.asarray(light - self.extra * smallest)

    def near_primary(self, xyz: Array) -> Array:
        """Drives by ``nearest``, if that is a primary, (n, 3)."""
        light, extra = self.light(xyz), self.extra / 3.0
        others = light.sum(axis=1, keepdims=True) - light
        return np.asarray(light - extra * (others / (1.0 + extra.sum() - extra)).min(axis=1, keepdims=True))

    def near_white(self, xyz: Array) -> Array:
        """Drives by ``nearest``, if that is white, (n, 3)."""
        light, extra = self.light(xyz), self.extra / 3.0
        return np.asarray(light - extra * (light.sum(axis=1, keepdims=True) / (1.0 + extra.sum())))


def _smaller_two(linear: Array) -> Array:
    """Sum of the two smaller channels, which passes 1 where white becomes the nearest colour point."""
    return np.asarray(linear.sum(axis=1) - linear.max(axis=1))


def _nearest(aged: AgedDisplay, split: _Split, xyz: Array, asked: Array) -> Array:
    white, primary = split.near_white(xyz), split.near_primary(xyz)
    is_white, is_primary = _smaller_two(white) > 1.0, _smaller_two(primary) <= 1.0
    away = [np.square(drive - asked).sum(axis=1) for drive in (white, primary)]
    take_white = np.where(is_white & is_primary, away[0] < away[1], is_white)
    drive = np.where(take_white[:, np.newaxis], white, primary)
    gap = ~is_white & ~is_primary
    if gap.any():
        drive[gap] = _at_border(aged, white[gap], primary[gap], xyz[gap])
    return drive


def _at_border(aged: AgedDisplay, white: Array, primary: Array, xyz: Array) -> Array:
    """Move both drives to the border, each to its own side of it, and take the one that looks more like ``xyz``."""
    wanted = linear_to_lab(xyz_to_linear(xyz))
    drives = [_moved(white, 1.0 + ON_BORDER / 2), _moved(primary, 1.0 - ON_BORDER / 2)]
    error = [
        delta_e_2000(linear_to_lab(aged.code_to_linear(linear_to_code(np.clip(drive, 0.0, 1.0)))), wanted)
        for drive in drives
    ]
    return np.where((error[0] < error[1])[:, np.newaxis], *drives)


def _moved(linear: Array, target: float) -> Array:
    """Drives (n, 3) whose two smaller channels are raised or lowered alike until they sum to ``wanted``."""
    smaller = np.arange(3) != linear.argmax(axis=1)[:, np.newaxis]
    return np.asarray(linear + smaller * ((target - _smaller_two(linear)) / 2.0)[:, np.newaxis])
