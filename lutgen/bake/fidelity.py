"""Fidelity: a LUT file as its readers apply it, against the display model in double precision.

The certificate's colours are the same for every file: uniform in code values, a grey ramp, tissue, and pairs that
hug the border at which the paper's ``nearest`` selection jumps: white's (see ``display/paper.py``). No interpolated
table can follow the model where it jumps, and none that is clipped where it bends at the viewer's gamut; figures are
therefore given apart:

``border``  the pairs, and colours for which the interpolation mixes lattice points from both sides of the border, or
            points that are fitted beside it; all colours where an effect makes stairs of the curves, finer than any
            table
``gamut``   other colours for which it mixes lattice points that the table clips with others that it does not, or points
            right before the clip, where nodes are fitted
``smooth``  all the rest

Dark colours, where tables err most, are more than a picture's share: they count for the largest error alone.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lutgen.bake.figures import Figures, figures, rounded
from lutgen.bake.fitted_nodes import before_clip, ramps_at_white
from lutgen.bake.littlecms import SourceProfile, source_profile_in
from lutgen.bake.lut import Lut, Sampler
from lutgen.bake.readback import TableKind
from lutgen.bake.round_trip import RoundTrip, Without, round_trip
from lutgen.bake.spaces import lattice, tetrahedra
from lutgen.colorimetry import code_to_linear, delta_e_2000, in_chunks, linear_to_code, linear_to_lab, transform
from lutgen.display.chain import outside_gamut
from lutgen.display.effect_chain import jumps, without_steps
from lutgen.display.inverse import compensation_of
from lutgen.display.paper import Selection, nearest_weights, selects_nearest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.bake.lut import MatrixLut
    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay

SEED = 20150319

#: Points along an edge of the lattice whose share out of reach is told.
_REACH = 33

#: Optical density of the stains per unit of R, G, B absorption: haematoxylin, eosin, DAB
#: (Ruifrok & Johnston, Anal. Quant. Cytol. Histol. 23, 291-299, 2001).
STAINS = np.array([[0.65, 0.70, 0.29], [0.07, 0.99, 0.11], [0.27, 0.57, 0.78]])


#: A lattice point with a smaller share has no influence: float32 rounds the share to 0.
INFLUENCE = 1e-6


class Counts(NamedTuple):
    """How many colours of each kind: uniform in code values, greys, tissue, pairs on both sides of the border, dark."""

    uniform: int
    grey: int
    tissue: int
    pairs: int
    dark: int = 0


#: A certificate's colours, and those on which a table by itself is judged when candidates are chosen.
CERTIFIED, JUDGED = Counts(12_500, 1_024, 8_000, 4_096, 2_048), Counts(1_562, 128, 1_000, 512)

#: The mark of a node right before the clip, beside six of the channels beyond it.
_BEFORE = np.uint8(64)

#: Where tissue lies among a certificate's.
_TISSUE = slice(CERTIFIED.uniform + CERTIFIED.grey, CERTIFIED.uniform + CERTIFIED.grey + CERTIFIED.tissue)


class TableError(NamedTuple):
    """The error of a table over some colours: over all of them, and over those without a jump of the display."""

    all: Figures
    smooth: Figures


@dataclass(frozen=True)
class Certificate:
    """The measured error of a file, and the share of colours whose aged colour lies outside sRGB.

    For a correction: whose drive lies outside what the display has, and what the aged display shows through the file.
    """

    smooth: Figures
    gamut: Figures
    border: Figures
    clipped_share: float
    round_trip: RoundTrip | None = None

    def groups(self) -> dict[str, Figures]:
        """Return the groups of colours by name, those of the round trip too."""
        everything = {**vars(self), **(vars(self.round_trip) if self.round_trip else {})}
        return {name: value for name, value in everything.items() if isinstance(value, Figures)}

    def as_json(self) -> dict[str, Any]:
        """Return plain numbers, rounded to the precision of float32 LUTs."""
        content: dict[str, Any] = rounded(asdict(self))
        return content | (content.pop("round_trip") or {})


class Mixing(NamedTuple):
    """The lattice points that tetrahedral interpolation mixes for each colour.

    ``nodes``: flat indices, red fastest, shape (n, 4); a point without influence is replaced by the first. ``crosses``:
    whether they lie on both sides of white's border; ``beside``: whether one of them is fitted beside it.
    """

    nodes: NDArray[np.intp]
    crosses: NDArray[np.bool_]
    beside: NDArray[np.bool_]


@dataclass
class Judge:
    """Certifies files. Keeps what does not depend on the file: the colours, and what the sampler knows of the model."""

    sampler: Sampler = field(default_factory=Sampler)
    _without: Without | None = None
    _mixing: dict[tuple[str, int, int, SourceProfile | None], Mixing] = field(default_factory=dict)
    _tetrahedra: dict[tuple[str, int, int], tuple[NDArray[np.intp], Array]] = field(default_factory=dict)

    @cached_property
    def code(self) -> Array:
        """The certificate's colours, shape (n, 3), code values that float32 holds exactly."""
        return certificate_colours()

    @cached_property
    def few(self) -> Array:
        """A smaller set of the same mix."""
        return certificate_colours(JUDGED)

    def prepare(self, aged: AgedDisplay, *, certify: bool) -> None:
        """Compute what every display with this head shares, before workers are forked, which then inherit it."""
        self._model(aged, self.few)
        if certify:
            self._model(aged, self.code)

    def shown(self, lut: Lut) -> Array:
        """Code values that a table gives for ``self.code``, (n, 3), in double precision."""
        return lut.mix(*self._tetrahedra_of(lut, self.code))

    def compare(self, code: Array, aged: AgedDisplay, table: TableKind) -> Certificate:
        """Compare the code values that a file gave for ``self.code`` with the model's."""
        model = self._model(aged, self.code)
        clipped = outside_gamut(model).mean()
        error = in_chunks(_seen_apart, model, code)
        border = np.arange(len(error)) >= len(error) - 2 * CERTIFIED.pairs
        gamut = np.zeros_like(border)
        if table.size:
            border |= self._crosses(aged, table, self.code)
            gamut = self._mixes_clipped(aged, table) & ~border
        usual = _usual()
        smooth, gamut_error, border_error = (
            figures(error[group], usual[group]) for group in (~border & ~gamut, gamut, border)
        )
        return Certificate(
            smooth,
            gamut_error,
            border_error,
            float(clipped),
            self._round_trip(code, aged, border | gamut),
        )

    def _round_trip(self, code: Array, aged: AgedDisplay, border: NDArray[np.bool_]) -> RoundTrip | None:
        link = compensation_of(aged)
        if link is None:
            return None
        drive, lattice = self._model(aged, self.code), self.sampler.linear(aged, _REACH, "code")
        if self._without is None or self._without.link != link:
            self._without = Without.of(link, self.code, drive, _usual())
        return round_trip(self._without, drive, code, border=border, usual=_usual(), tissue=_TISSUE, lattice=lattice)

    def table_error(self, lut: Lut | MatrixLut, aged: AgedDisplay) -> TableError:
        """ΔE2000 of a table by itself, in double precision on some colours: the same on every binding."""
        error = self._table_errors(lut, aged)
        smooth = np.arange(len(error)) < len(error) - 2 * JUDGED.pairs
        if lut.size:
            smooth &= ~self._crosses(aged, TableKind(lut.space, lut.size, clipped=False), self.few)
        return TableError(figures(error), figures(error[smooth]))

    def _table_errors(self, lut: Lut | MatrixLut, aged: AgedDisplay) -> Array:
        code, model = self.few, self._model(aged, self.few)
        shown = lut.mix(*self._tetrahedra_of(lut, code)) if isinstance(lut, Lut) else lut.apply(code)
        return in_chunks(_seen_apart, model, shown)

    def _tetrahedra_of(self, lut: Lut, code: Array) -> tuple[NDArray[np.intp], Array]:
        key = (lut.space, lut.size, len(code))
        if key not in self._tetrahedra:
            self._tetrahedra[key] = tetrahedra(code, lut.space, lut.size)
        return self._tetrahedra[key]

    def _model(self, aged: AgedDisplay, code: Array) -> Array:
        return self.sampler.linear_of(aged, len(code), lambda: code)

    def _mixing_in(self, table: TableKind, code: Array, source: SourceProfile | None = None) -> Mixing:
        key = (table.space, table.size, len(code), source)
        if key not in self._mixing:
            self._mixing[key] = mixing_of(code, table.space, table.size, source)
        return self._mixing[key]

    def _crosses(self, aged: AgedDisplay, table: TableKind, code: Array) -> NDArray[np.bool_]:
        """Whether a table mixes colours from both sides of a jump of the display for each colour, (n,)."""
        link = compensation_of(aged)
        if without_steps(link.aged if link else aged) is not None:
            return np.ones(len(code), dtype=bool)
        if link and link.jumps:
            drives = self.sampler.linear(aged, table.size, table.space)
            own = link.side(self._model(aged, code))
            return _differ(np.column_stack([own, link.side(drives)[self._mixing_in(table, code).nodes]]))
        mixing = self._mixing_in(table, code, source_profile_in(aged))
        if selects_nearest(aged):
            return mixing.crosses | mixing.beside
        return mixing.crosses & _jumps(aged)

    def _mixes_clipped(self, aged: AgedDisplay, table: TableKind) -> NDArray[np.bool_]:
        """Whether a colour's lattice points lie on both sides of the gamut's boundary, for a clipped table."""
        # Or one of them lies right before the clip.
        if not table.clipped:
            return np.zeros(len(self.code), dtype=bool)
        linear = self.sampler.linear(aged, table.size, table.space)
        above, below = linear.T > 1, linear.T < 0
        beside = np.zeros(len(linear), dtype=np.uint8)
        for bit, side in enumerate((*above, *below)):
            beside |= side.view(np.uint8) << bit
        for channel, own in enumerate(linear.T):
            beside[before_clip(own, channel, table.size)] |= _BEFORE
        mixed = beside[self._mixing_in(table, self.code).nodes]
        return _differ(mixed) | (mixed[:, 0] >= _BEFORE)


def _seen_apart(linear: Array, code: Array) -> Array:
    """ΔE2000 between linear light and code values, each clipped to what a viewer shows, (n, 3) → (n,)."""
    shown = code_to_linear(np.clip(code, 0.0, 1.0))
    return delta_e_2000(linear_to_lab(np.clip(linear, 0.0, 1.0)), linear_to_lab(shown))


def _usual() -> NDArray[np.bool_]:
    """Whether each colour of a certificate is none of the dark ones, which count for the largest error alone, (n,)."""
    before, pairs = CERTIFIED.uniform + CERTIFIED.grey + CERTIFIED.tissue, 2 * CERTIFIED.pairs
    return np.repeat([True, False, True], [before, CERTIFIED.dark, pairs])


def certificate_colours(counts: Counts = CERTIFIED) -> Array:
    """Return the certificate's colours, shape (n, 3): uniform, greys, tissue, dark, then both colours of each pair.

    Dark ones are squares of uniform code values: where curves bend most, in the first cells of a table, it errs most.
    They count for the largest error, and not for the mean and the 99 % quantile.
    """
    random = np.random.default_rng(SEED)
    uniform = random.random((counts.uniform, 3))
    grey = np.repeat(np.linspace(0.0, 1.0, counts.grey)[:, np.newaxis], 3, axis=1)
    tissue, pairs = tissue_colours(random, counts.tissue), border_pairs(random, counts.pairs)
    dark = random.random((counts.dark, 3)) ** 2
    code = np.concatenate([uniform, grey, tissue, dark, pairs])
    return code.astype(np.float32).astype(np.float64)


def tissue_colours(random: np.random.Generator, count: int) -> Array:
    """Stained tissue by Beer-Lambert: random amounts of haematoxylin, eosin and DAB, 8-bit code values."""
    amounts = random.gamma([[1.2, 0.9, 0.3]], [[0.35, 0.25, 0.35]], (count, 3))
    light = 0.95 * 10.0 ** -transform(STAINS.T, amounts)
    return np.asarray(np.round(linear_to_code(light) * 255.0) / 255.0)


def border_pairs(random: np.random.Generator, count: int) -> Array:
    """Pairs of colours on both sides of white's border in ``nearest``, 1e-4 to 1e-2 of linear light apart.

    White is nearer than the nearest primary where the other two channels sum to more than 1.
    """
    # Of random colours, seven in twenty are led to a border that lies inside the cube.
    linear = random.random((4 * count, 3))
    others = 1.0 - (linear == linear.max(axis=1, keepdims=True))
    beyond = (linear * others).sum(axis=1) - 1.0
    on_border = linear - (beyond / 2)[:, np.newaxis] * others
    step = (10.0 ** random.uniform(-4, -2, len(linear)) / np.sqrt(8))[:, np.newaxis] * others
    pairs = np.stack([on_border - step, on_border + step], axis=1)
    inside = ((pairs >= 0) & (pairs <= 1)).all(axis=(1, 2))
    switching = nearest_weights(pairs[:, 0])[:, 0] < nearest_weights(pairs[:, 1])[:, 0]
    return linear_to_code(pairs[inside & switching][:count].reshape(-1, 3))


def mixing_of(code: Array, space: str, size: int, source: SourceProfile | None = None) -> Mixing:
    """Find the lattice points that tetrahedral interpolation mixes for each colour, and whether it crosses a border.

    A colour crosses when a lattice point of influence lies on another side of white's border than itself; both as the
    display gets them, behind the picture's own profile.
    """
    sent = source or np.asarray
    nodes, weight = tetrahedra(code, space, size)
    first = np.argmax(weight > INFLUENCE, axis=1)
    nodes = np.where(weight > INFLUENCE, nodes, nodes[np.arange(len(code)), first][:, np.newaxis])
    region = _region(nearest_weights(code_to_linear(sent(lattice(size, space)))))
    own = _region(nearest_weights(code_to_linear(sent(code))))
    fitted = np.zeros(size**3, dtype=bool)
    fitted[ramps_at_white(space, size)[0]] = True
    return Mixing(nodes, _differ(np.column_stack([own, region[nodes]])), np.asarray(fitted[nodes].any(axis=1)))


def _differ(labels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Whether the labels in a row, shape (n, k), are not all the same."""
    first, *others = labels.T
    return np.asarray(np.logical_or.reduce([other != first for other in others]))


def _region(weights: Array) -> NDArray[np.uint8]:
    """Label colours by white's share: 0 none, 1 on the border, 2 all."""
    white = weights[:, 0]
    return np.asarray((white > 0).astype(np.uint8) + (white == 1))


def _jumps(aged: AgedDisplay) -> bool:
    return jumps(aged) or any(isinstance(link, Selection) and link.name == "nearest" for link in aged.head)
