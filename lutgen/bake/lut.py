"""Baking of one aged display into a table or a matrix."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.fitted_nodes import HEADROOM, LARGEST_MOVE, fit_beside_clip, ramps_at_white
from lutgen.bake.spaces import SPACES, lattice, tetrahedra
from lutgen.colorimetry import CHUNK, XYZ_TO_LINEAR, Array, code_to_linear, in_chunks, linear_to_code, transform
from lutgen.display import AgedDisplay, Compensation
from lutgen.display.chain import Link
from lutgen.display.effect_chain import without_steps
from lutgen.display.inverse import compensation_of
from lutgen.display.paper import on_both_sides, paper_links, selects_nearest
from lutgen.errors import LutgenError

#: Allowed lattice sizes: viewers and graphics cards commonly support them.
SIZES = (17, 33, 65)

#: Values of linear light that differ by at most this are equal: a thousandth of float32's resolution.
EXACT = 1e-10

#: Number of colours that are compared before all colours are compared.
_TELLING = 50

#: Largest number in a table, since numbers in files have one digit before the point.
BRIGHTEST = 9.9

#: The four matrices are equal when no entry differs by more than this. The rounding of float32 is 1e-7.
AGREE = 2e-7


@dataclass(frozen=True)
class Lut:
    """A 3D table from source signal to aged colour."""

    #: The space of its index and of its values: a key of ``SPACES``.
    space: str
    #: Shape (n, n, n, 3), axes blue, green, red: in the flattened table red varies fastest.
    table: Array

    @property
    def size(self) -> int:
        """The number of points along one edge."""
        return int(self.table.shape[0])

    def in_steps(self, largest: int) -> "Lut":
        """Return the table quantised to the integers 0..``largest``, for integer files."""
        return Lut(self.space, np.rint(self.table * largest) / largest)

    def apply(self, code: Array) -> Array:
        """Apply the table to code values (n, 3) by tetrahedral interpolation in double precision."""
        return self.mix(*tetrahedra(code, self.space, self.size))

    def mix(self, nodes: NDArray[np.intp], weights: Array) -> Array:
        """Return weighted sums of lattice points as code values (n, 3).

        ``nodes`` and ``weights``, (n, 4) each, are the results of :func:`tetrahedra`.
        """
        values = self.mix_in_space(nodes, weights)
        return SPACES[self.space].shown(values)

    def mix_in_space(self, nodes: NDArray[np.intp], weights: Array) -> Array:
        """Return weighted sums as :meth:`mix`, but in the table's own space."""
        planes = np.ascontiguousarray(self.table.reshape(-1, 3).T)

        def mixed(nodes: NDArray[np.intp], weights: Array) -> Array:
            values = np.zeros((3, len(nodes)))
            for plane, out in zip(planes, values, strict=True):
                for node, weight in zip(nodes.T, weights.T, strict=True):
                    np.add(out, plane.take(node) * weight, out=out)
            return values.T

        # Channel by channel and in chunks, so that the table's values stay in the processor's cache.
        return in_chunks(mixed, nodes, weights)


@dataclass(frozen=True)
class MatrixLut:
    """The aged display as a matrix from linear light to linear light, shape (3, 3)."""

    matrix: Array
    space: str = "linear"
    size: int = 0

    def apply(self, code: Array) -> Array:
        """Apply the sRGB curve, the matrix and the inverse curve to code values (n, 3), in double precision."""
        return linear_to_code(transform(self.matrix, code_to_linear(code)))


def table_of(lut: Lut | MatrixLut) -> Array:
    """Return the table of a LUT, for a format that only holds tables. Raises TypeError for a matrix."""
    if not isinstance(lut, Lut):
        raise TypeError("this format holds a table, not a matrix")
    return lut.table


def shaper(lut: Lut | MatrixLut, points: int) -> tuple[Array, Array]:
    """Return the curve before a table: code values, and their places along the table's edge.

    The curve has ``points`` points, or two points when the table is indexed by code values.
    """
    code = np.linspace(0.0, 1.0, 2 if lut.space == "code" else points)
    return code, SPACES[lut.space].index(code)


@dataclass
class Sampler:
    """A sampler evaluates aged displays on lattices. It computes the part that does not age once for all hours.

    The drives of a correction need a search. They are cached until the drives of another correction are computed.
    """

    _signals: dict[tuple[object, tuple[Link, ...]], Array] = field(default_factory=dict)
    _drives: dict[object, Array] = field(default_factory=dict)
    _correction: Compensation | None = None

    def linear(self, aged: AgedDisplay, size: int, space: str) -> Array:
        """Return unclipped aged linear light on a lattice uniform in ``space``: shape (size³, 3), red fastest."""
        if compensation_of(aged):
            return self.linear_of(aged, (size, space), lambda: lattice(size, space))
        return _on_lattice(aged, self._lattice(aged, size, space)[: size**3], size, np.asarray)

    def linear_of(self, aged: AgedDisplay, name: object, code: Callable[[], Array]) -> Array:
        """Return unclipped aged linear light of the code values ``code()``, both (n, 3). ``name`` is the cache key."""
        correction = compensation_of(aged)
        if correction is None:
            return in_chunks(aged.linear, self._signal(aged, name, lambda: aged.head_signal(code())))
        if correction != self._correction:
            self._drives, self._correction = {}, correction
        if name not in self._drives:
            # All colours at once, so that the search treats all slowly converging colours together.
            self._drives[name] = aged.linear(aged.head_signal(code()))
        return self._drives[name]

    def _signal(self, aged: AgedDisplay, name: object, compute: Callable[[], Array]) -> Array:
        key = (name, aged.head)
        if key not in self._signals:
            self._signals[key] = compute()
        return self._signals[key]

    def _lattice(self, aged: AgedDisplay, size: int, space: str) -> Array:
        """Return the signal of a lattice after the display's head, (m, k).

        For a display with a jump, the signals of the nodes beside the jump follow, once for each side of the jump.
        """
        jumps = selects_nearest(aged)

        def signals() -> Array:
            signal = aged.head_signal(lattice(size, space))
            return np.concatenate([signal, on_both_sides(signal[ramps_at_white(space, size)[0]])]) if jumps else signal

        return self._signal(aged, (size, space, jumps), signals)

    def lut(self, aged: AgedDisplay, size: int, space: str, *, clip: bool, whole: bool = False) -> Lut:
        """Bake a table. With ``clip`` clip aged colours to the viewer's sRGB gamut, else keep them.

        Nodes beside the clip are fitted. A file of ``whole`` numbers cannot exceed white, so its nodes end at white.
        Tables of corrections are not fitted beside the clip, since their numbers are a display's drives. Nodes beside
        the jump of the paper's display are fitted too.
        """
        held, correction = SPACES[space].held, compensation_of(aged)
        if correction:
            values = held(self.linear(aged, size, space)).copy()
        else:
            values = _on_lattice(aged, self._lattice(aged, size, space), size, held)
        values, beside = values[: size**3], values[size**3 :]
        table = values.reshape(size, size, size, 3)
        top = 1.0 if whole or correction else HEADROOM
        if clip and not correction:
            fit_beside_clip(table, top)
        elif clip:
            np.clip(table, 0.0, top, out=table)
        if len(beside):
            nodes, shares = ramps_at_white(space, size)
            white, primary = beside.reshape(2, -1, 3)
            moved = values[nodes] + np.clip(shares[:, np.newaxis] * (white - primary), -LARGEST_MOVE, LARGEST_MOVE)
            values[nodes] = np.clip(moved, 0.0, top) if clip else moved
        if not clip and np.abs(values).max() > BRIGHTEST:
            raise LutgenError(
                f"{aged.mode} at {aged.hours:g} h: colours reach {np.abs(values).max():.3g} times what a viewer shows, "
                f"more than a table holds. Check the model's effects and the conditions (--at)."
            )
        return Lut(space, table)

    def candidates(
        self, aged: AgedDisplay, size: int, *spaces: str, clip: bool, largest: int | None = None
    ) -> list[Lut | MatrixLut]:
        """Bake one candidate table in each space. ``clip`` clips to the viewer's gamut, as in :meth:`lut`.

        A display with staircases in its curves is also baked without the staircases, since a coarse table can err more
        with them than without them. ``largest`` is for files of integers 0..``largest``.
        """
        smooth = without_steps(aged)
        displays = [aged, smooth] if smooth else [aged]
        whole = largest is not None
        luts = [self.lut(each, size, space, clip=clip, whole=whole) for each in displays for space in spaces]
        return [lut.in_steps(largest) if largest else lut for lut in luts]


def _on_lattice(aged: AgedDisplay, signal: Array, size: int, held: Callable[[Array], Array]) -> Array:
    """Return the values of a table, (n, 3), for the signal after the display's head, (n, k).

    The signal is a lattice, red fastest, and then other colours.
    """
    # The paper's display adds channels. Each channel is constant over planes of the lattice. The sum of red and green
    # is therefore computed once for all steps of blue.
    paper = paper_links(aged)
    if paper is None:
        return in_chunks(lambda part: held(aged.linear(part)), signal)
    matrix, end, axis = paper[1].to_linear, size**3, signal[:size, 0]
    used, result = signal[:end, 3].reshape(size, -1), np.empty((len(signal), 3), order="F")
    planes = [np.add.outer(green * axis, red * axis).ravel() for red, green, _, _ in matrix]
    steps = CHUNK // size**2
    light, product = np.empty((3, steps, size**2)), np.empty((steps, size**2))
    for first in range(0, size, steps):
        own, here = used[first : first + steps], axis[first : first + steps, np.newaxis]
        part, shared = light[:, : len(own)], product[: len(own)]
        for out, plane, (_, _, blue, share) in zip(part, planes, matrix, strict=True):
            np.add(plane, blue * here, out=out)
            np.add(out, np.multiply(own, share, out=shared), out=out)
        start = first * size**2
        result[start : start + own.size] = held(part.reshape(3, -1).T)
    if len(signal) > end:
        result[end:] = held(transform(matrix, signal[end:]))
    return result


def as_matrix(aged: AgedDisplay) -> MatrixLut | None:
    """Return the display as one matrix in linear light; None unless it is the sRGB curve with four equal matrices."""
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

    The paper's display is such a table with the selection ``continuous``. A display with effects is such a table when
    the effects only scale, tint and add light. This is tested on a lattice.
    """
    paper = paper_links(aged)
    if paper is not None:
        return paper[0].name == "continuous"
    corners, code = lattice(2, "linear"), lattice(17, "code")
    table = Lut("linear", aged.code_to_linear(corners).reshape(2, 2, 2, 3))
    # A few colours show the difference of most displays. This saves the search of a correction for all other colours.
    for some in (code[:: len(code) // _TELLING], code):
        away = table.mix_in_space(*tetrahedra(some, "linear", 2)) - aged.code_to_linear(some)
        if np.abs(away).max() > EXACT:
            return False
    return True
