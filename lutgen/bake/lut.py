"""Baking one aged display into a table or a matrix."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.beside_clip import fitted_beside_clip
from lutgen.bake.spaces import SPACES
from lutgen.colorimetry import CHUNK, XYZ_TO_LINEAR, code_to_linear, linear_to_code, transform, xyz_to_linear
from lutgen.display.effect_chain import without_steps
from lutgen.display.inverse import compensation_of
from lutgen.display.paper import paper_links
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay, Compensation
    from lutgen.display.chain import Link

#: Lattice sizes on offer: the sizes that viewers and graphics cards commonly take.
SIZES = (17, 33, 65)

#: Linear light that differs by no more is the same: a thousandth of what float32 can tell.
EXACT = 1e-10

#: So many colours are tried before all are.
_TELLING = 50

#: Numbers in a table have one digit before the point.
BRIGHTEST = 9.9

#: The four matrices agree when no entry differs by more than this: 1e-7 is float32's own rounding.
AGREE = 2e-7


@dataclass(frozen=True)
class Lut:
    """A 3D table from source signal to aged colour.

    Attributes
    ----------
    space
        How it is indexed and what it holds: a key of ``SPACES``.
    table
        Shape (n, n, n, 3), axes blue, green, red: red varies fastest when flattened.

    """

    space: str
    table: Array

    @property
    def size(self) -> int:
        """Points along one edge."""
        return int(self.table.shape[0])

    def in_steps(self, largest: int) -> Lut:
        """Return the table as a file holds it whose numbers are whole, 0..``largest``."""
        return Lut(self.space, np.rint(self.table * largest) / largest)

    def apply(self, code: Array) -> Array:
        """Send code values (n, 3) through the table by tetrahedral interpolation in double precision."""
        return self.mix(*tetrahedra(code, self.space, self.size))

    def mix(self, nodes: NDArray[np.intp], weights: Array) -> Array:
        """Sum lattice points by weight, both (n, 4) as from :func:`tetrahedra`: code values (n, 3)."""
        values = self.mix_in_space(nodes, weights)
        return SPACES[self.space].shown(values)

    def mix_in_space(self, nodes: NDArray[np.intp], weights: Array) -> Array:
        """As :meth:`mix`, in the table's own space."""
        # Channel by channel in chunks: what is looked up then stays near the processor.
        planes, values = np.ascontiguousarray(self.table.reshape(-1, 3).T), np.zeros((3, len(nodes)))
        for start in range(0, len(nodes), CHUNK):
            part = slice(start, start + CHUNK)
            for plane, out in zip(planes, values[:, part], strict=True):
                for node, weight in zip(nodes[part].T, weights[part].T, strict=True):
                    np.add(out, plane.take(node) * weight, out=out)
        return values.T


@dataclass(frozen=True)
class MatrixLut:
    """The aged display as a plain matrix from linear light to linear light, shape (3, 3)."""

    matrix: Array
    space: str = "linear"
    size: int = 0

    def apply(self, code: Array) -> Array:
        """Send code values (n, 3) through the sRGB curve, the matrix and back, in double precision."""
        return linear_to_code(transform(self.matrix, code_to_linear(code)))


def table_of(lut: Lut | MatrixLut) -> Array:
    """Return the table of a LUT for a file that holds nothing else. Raises TypeError for a matrix."""
    if not isinstance(lut, Lut):
        message = "this format holds a table, not a matrix"
        raise TypeError(message)
    return lut.table


def shaper(lut: Lut | MatrixLut, points: int) -> tuple[Array, Array]:
    """Return the curve before a table: code values, and their places along the table's edge.

    Of so many points where it bends, of two where the table is indexed in code values.
    """
    code = np.linspace(0.0, 1.0, 2 if lut.space == "code" else points)
    return code, SPACES[lut.space].index(code)


def tetrahedra(code: Array, space: str, size: int) -> tuple[NDArray[np.intp], Array]:
    """Return the four points of a lattice in ``space`` that tetrahedral interpolation mixes, and their weights.

    Code values (n, 3) → flat indices, red fastest, (n, 4), and weights that sum to 1, (n, 4): from the cell's lower
    corner along the axis of the largest share first.
    """
    place = SPACES[space].index(code) * (size - 1)
    corner = np.clip(np.floor(place), 0, size - 2).astype(np.intp)
    share = place - corner
    order = np.argsort(-share, axis=1)
    ordered = np.take_along_axis(share, order, axis=1)
    ends = np.ones((len(place), 1)), np.zeros((len(place), 1))
    weights = -np.diff(np.hstack([ends[0], ordered, ends[1]]), axis=1)
    stride = np.array([1, size, size * size])
    nodes = np.cumsum(np.column_stack([corner @ stride, stride[order]]), axis=1)
    return np.asfortranarray(nodes), np.asfortranarray(weights)


@dataclass
class Sampler:
    """Evaluates aged displays on lattices, computing what does not age once for all hours and modes.

    The drives of a correction, which cost a search, are kept until those of another correction are asked for.
    """

    _signals: dict[tuple[object, tuple[Link, ...]], Array] = field(default_factory=dict)
    _drives: dict[object, Array] = field(default_factory=dict)
    _correction: Compensation | None = None

    def linear(self, aged: AgedDisplay, size: int, space: str) -> Array:
        """Aged linear light, unclipped, on a lattice uniform in ``space``: shape (size³, 3), red fastest."""
        return self.linear_of(aged, (size, space), lambda: lattice(size, space))

    def linear_of(self, aged: AgedDisplay, name: object, code: Callable[[], Array]) -> Array:
        """Aged linear light, unclipped, of the code values that go by a name, both (n, 3)."""
        correction = compensation_of(aged)
        if correction is None:
            return self._linear(aged, name, code)
        if correction != self._correction:
            self._drives, self._correction = {}, correction
        if name not in self._drives:
            self._drives[name] = self._linear(aged, name, code)
        return self._drives[name]

    def _linear(self, aged: AgedDisplay, name: object, code: Callable[[], Array]) -> Array:
        key = (name, aged.head)
        if key not in self._signals:
            self._signals[key] = aged.head_signal(code())
        return xyz_to_linear(aged.xyz(self._signals[key]))

    def lut(self, aged: AgedDisplay, size: int, space: str, *, clip: bool, whole: bool = False) -> Lut:
        """Bake a table; ``clip`` to the viewer's sRGB gamut, or leave aged colours outside it as they are.

        Beside the clip nodes are fitted; not where the file holds ``whole`` numbers, which cannot exceed white, and not
        in a correction, whose numbers are a display's drive.
        """
        values = SPACES[space].held(self.linear(aged, size, space)).reshape(size, size, size, 3)
        if clip:
            plain = whole or compensation_of(aged) is not None
            return Lut(space, np.clip(values, 0.0, 1.0) if plain else fitted_beside_clip(values))
        if np.abs(values).max() > BRIGHTEST:
            message = (
                f"{aged.mode} at {aged.hours:g} h: colours reach {np.abs(values).max():.3g} times what a viewer shows, "
                f"more than a table holds. Check the model's effects and the conditions (--at)."
            )
            raise LutgenError(message)
        return Lut(space, values)

    def candidates(
        self, aged: AgedDisplay, size: int, *spaces: str, clip: bool, largest: int | None = None
    ) -> list[Lut | MatrixLut]:
        """Bake the tables that the most faithful is chosen from: one in each space; ``clip`` to what viewers show.

        A display with stairs in its curves is baked without them too: a coarse table of stairs can err more than none.
        ``largest`` is for files that hold whole numbers, 0..``largest``.
        """
        smooth = without_steps(aged)
        displays = [aged, smooth] if smooth else [aged]
        whole = largest is not None
        luts = [self.lut(each, size, space, clip=clip, whole=whole) for each in displays for space in spaces]
        return [lut.in_steps(largest) if largest else lut for lut in luts]


def lattice(size: int, space: str) -> Array:
    """Code values of a lattice uniform in ``space``: shape (size³, 3), red fastest."""
    axis = SPACES[space].code(np.linspace(0.0, 1.0, size))
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([red, green, blue], axis=-1).reshape(-1, 3)


def as_matrix(aged: AgedDisplay) -> MatrixLut | None:
    """Return the display as one matrix in linear light when it is one: the sRGB curve and four equal matrices."""
    paper = paper_links(aged)
    if paper is None:
        return None
    selection, emission = paper
    used = emission.array if selection.name == "nearest" else emission.array[1:]
    if np.ptp(used, axis=0).max() > AGREE:
        return None
    return MatrixLut(transform(XYZ_TO_LINEAR, used.mean(axis=0).T).T)


def is_tetrahedral(aged: AgedDisplay) -> bool:
    """Whether the display is exactly a 2 × 2 × 2 tetrahedral table in linear light.

    The paper's is with ``continuous``. With effects it is when they only scale, tint and add light: that is found out
    on a lattice.
    """
    paper = paper_links(aged)
    if paper is not None:
        return paper[0].name == "continuous"
    corners, code = lattice(2, "linear"), lattice(17, "code")
    table = Lut("linear", aged.code_to_linear(corners).reshape(2, 2, 2, 3))
    # A few colours tell of most displays that they are not; a correction with effects searches for all the others.
    for some in (code[:: len(code) // _TELLING], code):
        away = table.mix_in_space(*tetrahedra(some, "linear", 2)) - aged.code_to_linear(some)
        if np.abs(away).max() > EXACT:
            return False
    return True
