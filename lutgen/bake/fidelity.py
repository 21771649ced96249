"""Fidelity: the errors of a LUT file, as its readers apply it, relative to the display model in double precision.

The certificate's colours are the same for every file: colours uniform in code values, a grey ramp, tissue colours, dark
colours, and pairs of colours. The two colours of a pair lie on both sides of white's border, where the paper's
``nearest`` selection jumps (see ``display/paper.py``). An interpolated table cannot follow a jump of the model. A
clipped table cannot follow the bend of the model at the viewer's gamut. The certificate therefore separates three
groups:

``border``  the pairs, and colours for which the interpolation mixes lattice points from both sides of the border, or
            lattice points that are fitted beside the border; all colours when an effect turns the curves into
            staircases that are finer than any table
``gamut``   other colours for which the interpolation mixes clipped and unclipped lattice points, or lattice points
            directly before the clip, where nodes are fitted
``smooth``  all other colours

Tables err most in dark colours. The set has a larger share of dark colours than a picture has, so they count for the
largest error only.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.figures import MAX_DELTA_E, P99, SLACK, Figures, figures, rounded
from lutgen.bake.fitted_nodes import before_clip, ramps_at_white
from lutgen.bake.littlecms import SourceProfile, source_profile_in
from lutgen.bake.lut import Lut, MatrixLut, Sampler
from lutgen.bake.manifest import FileRecord
from lutgen.bake.readback import TableKind
from lutgen.bake.round_trip import FileIndependent, RoundTrip, round_trip
from lutgen.bake.spaces import lattice, tetrahedra
from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, in_chunks, linear_to_code, linear_to_lab, transform
from lutgen.display import AgedDisplay
from lutgen.display.chain import outside_gamut
from lutgen.display.effect_chain import jumps, without_steps
from lutgen.display.inverse import compensation_of
from lutgen.display.paper import Selection, nearest_weights, selects_nearest
from lutgen.errors import LutgenError

SEED = 20150319

#: Points along an edge of the lattice for which the share of unreachable colours is computed.
_REACH = 33

#: Optical density of the stains per unit of R, G, B absorption: haematoxylin, eosin, DAB
#: (Ruifrok & Johnston, Anal. Quant. Cytol. Histol. 23, 291-299, 2001).
STAINS = np.array([[0.65, 0.70, 0.29], [0.07, 0.99, 0.11], [0.27, 0.57, 0.78]])

#: A lattice point with a smaller weight has no influence: float32 rounds the weight to 0.
INFLUENCE = 1e-6


class Counts(NamedTuple):
    """Numbers of colours: uniform in code values, greys, tissue, pairs on both sides of the border, dark."""

    uniform: int
    grey: int
    tissue: int
    pairs: int
    dark: int = 0


#: The colours of a certificate, and the fewer colours for the choice between candidate tables.
CERTIFIED, JUDGED = Counts(12_500, 1_024, 8_000, 4_096, 2_048), Counts(1_562, 128, 1_000, 512)

#: The flag of a node directly before the clip. The six lower bits are flags of the channels beyond the clip.
_BEFORE = np.uint8(64)

#: The tissue colours among the colours of a certificate.
_TISSUE = slice(CERTIFIED.uniform + CERTIFIED.grey, CERTIFIED.uniform + CERTIFIED.grey + CERTIFIED.tissue)


class TableError(NamedTuple):
    """The errors of a table: over all colours, and over the colours without a jump of the display."""

    all: Figures
    smooth: Figures


@dataclass(frozen=True)
class Certificate:
    """The measured errors of a file, and the share of colours whose aged colour lies outside sRGB.

    For a correction ``clipped_share`` is the share of colours whose drive lies outside the range of the display, and
    ``round_trip`` are the errors of the aged display behind the file.
    """

    smooth: Figures
    gamut: Figures
    border: Figures
    clipped_share: float
    round_trip: RoundTrip | None = None

    def groups(self) -> dict[str, Figures]:
        """Return the figures of each group of colours by name, including the groups of the round trip."""
        everything = {**vars(self), **(vars(self.round_trip) if self.round_trip else {})}
        return {name: value for name, value in everything.items() if isinstance(value, Figures)}

    def as_json(self) -> dict[str, Any]:
        """Return the certificate as JSON data, rounded to the precision of float32 LUTs."""
        content: dict[str, Any] = rounded(asdict(self))
        return content | (content.pop("round_trip") or {})


class Mixing(NamedTuple):
    """The lattice points that tetrahedral interpolation mixes for each colour.

    ``nodes``: flat indices, red fastest, shape (n, 4); the first point of influence replaces a point without influence.
    ``crosses``: whether the points and the colour lie on both sides of white's border. ``beside``: whether one of the
    points is fitted beside this border.
    """

    nodes: NDArray[np.intp]
    crosses: NDArray[np.bool_]
    beside: NDArray[np.bool_]


@dataclass
class Judge:
    """A judge certifies files. It caches data that do not depend on the file: the colours and the model's results."""

    sampler: Sampler = field(default_factory=Sampler)
    _fixed: FileIndependent | None = None
    _mixing: dict[tuple[str, int, int, SourceProfile | None], Mixing] = field(default_factory=dict)
    _tetrahedra: dict[tuple[str, int, int], tuple[NDArray[np.intp], Array]] = field(default_factory=dict)

    @cached_property
    def code(self) -> Array:
        """The certificate's colours, shape (n, 3): code values that are exact in float32."""
        return certificate_colours()

    @cached_property
    def few(self) -> Array:
        """A smaller set of the same kinds of colours, without the dark colours."""
        return certificate_colours(JUDGED)

    def prepare(self, aged: AgedDisplay, *, certify: bool) -> None:
        """Compute the data that all displays with this head share. Forked workers inherit the data."""
        self._model(aged, self.few)
        if certify:
            self._model(aged, self.code)

    def shown(self, lut: Lut) -> Array:
        """Return the code values that a table gives for ``self.code``, (n, 3), in double precision."""
        return lut.mix(*self._tetrahedra_of(lut, self.code))

    def compare(self, code: Array, aged: AgedDisplay, table: TableKind) -> Certificate:
        """Compare ``code``, a file's code values for ``self.code``, with the code values of the model."""
        model = self._model(aged, self.code)
        clipped = outside_gamut(model).mean()
        error = in_chunks(_clipped_delta_e, model, code)
        border = np.arange(len(error)) >= len(error) - 2 * CERTIFIED.pairs
        gamut = np.zeros_like(border)
        if table.size:
            border |= self._crosses(aged, table, self.code)
            gamut = self._mixes_clipped(aged, table) & ~border
        usual = _usual()
        groups = (~border & ~gamut, gamut, border)
        smooth, at_gamut, at_border = (figures(error[group], usual[group]) for group in groups)
        return Certificate(smooth, at_gamut, at_border, float(clipped), self._round_trip(code, aged, border | gamut))

    def _round_trip(self, code: Array, aged: AgedDisplay, border: NDArray[np.bool_]) -> RoundTrip | None:
        link = compensation_of(aged)
        if link is None:
            return None
        drive, lattice = self._model(aged, self.code), self.sampler.linear(aged, _REACH, "code")
        if self._fixed is None or self._fixed.link != link:
            self._fixed = FileIndependent.of(link, self.code, drive, _usual())
        return round_trip(self._fixed, drive, code, border=border, usual=_usual(), tissue=_TISSUE, lattice=lattice)

    def table_error(self, lut: Lut | MatrixLut, aged: AgedDisplay) -> TableError:
        """Return the ΔE2000 of a table, without a file, on ``self.few`` in double precision: equal on every binding."""
        code, model = self.few, self._model(aged, self.few)
        shown = lut.mix(*self._tetrahedra_of(lut, code)) if isinstance(lut, Lut) else lut.apply(code)
        error = in_chunks(_clipped_delta_e, model, shown)
        smooth = np.arange(len(error)) < len(error) - 2 * JUDGED.pairs
        if lut.size:
            smooth &= ~self._crosses(aged, TableKind(lut.space, lut.size, clipped=False), self.few)
        return TableError(figures(error), figures(error[smooth]))

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
        """Return for each colour whether the table mixes colours from both sides of a jump of the display, (n,)."""
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
        nearest = any(isinstance(link, Selection) and link.name == "nearest" for link in aged.head)
        return mixing.crosses & (nearest or jumps(aged))

    def _mixes_clipped(self, aged: AgedDisplay, table: TableKind) -> NDArray[np.bool_]:
        """Return for each colour whether a clipped table mixes clipped and unclipped lattice points, (n,).

        Lattice points directly before the clip count too.
        """
        if not table.clipped:
            return np.zeros(len(self.code), dtype=bool)
        linear = self.sampler.linear(aged, table.size, table.space)
        above, below = linear.T > 1, linear.T < 0
        flags = np.zeros(len(linear), dtype=np.uint8)
        for bit, beyond in enumerate((*above, *below)):
            flags |= beyond.view(np.uint8) << bit
        for channel, own in enumerate(linear.T):
            flags[before_clip(own, channel, table.size)] |= _BEFORE
        mixed = flags[self._mixing_in(table, self.code).nodes]
        return _differ(mixed) | (mixed[:, 0] >= _BEFORE)


def _clipped_delta_e(linear: Array, code: Array) -> Array:
    """Return the ΔE2000 between linear light and code values, both clipped to 0..1, (n, 3) → (n,)."""
    shown = code_to_linear(np.clip(code, 0.0, 1.0))
    return delta_e_2000(linear_to_lab(np.clip(linear, 0.0, 1.0)), linear_to_lab(shown))


def _usual() -> NDArray[np.bool_]:
    """Return which colours of a certificate count for means and quantiles: all except the dark colours, (n,)."""
    before, pairs = CERTIFIED.uniform + CERTIFIED.grey + CERTIFIED.tissue, 2 * CERTIFIED.pairs
    return np.repeat([True, False, True], [before, CERTIFIED.dark, pairs])


def certificate_colours(counts: Counts = CERTIFIED) -> Array:
    """Return the certificate's colours, shape (n, 3): uniform, greys, tissue, dark, then both colours of each pair.

    The dark colours are squares of uniform code values. A table errs most in its first cells, where the curves bend
    most. The dark colours count for the largest error, but not for the mean and the 99 % quantile.
    """
    random = np.random.default_rng(SEED)
    uniform = random.random((counts.uniform, 3))
    grey = np.repeat(np.linspace(0.0, 1.0, counts.grey)[:, np.newaxis], 3, axis=1)
    tissue, pairs = tissue_colours(random, counts.tissue), border_pairs(random, counts.pairs)
    dark = random.random((counts.dark, 3)) ** 2
    code = np.concatenate([uniform, grey, tissue, dark, pairs])
    return code.astype(np.float32).astype(np.float64)


def tissue_colours(random: np.random.Generator, count: int) -> Array:
    """Return 8-bit code values of stained tissue: random amounts of haematoxylin, eosin and DAB, by Beer-Lambert."""
    amounts = random.gamma([[1.2, 0.9, 0.3]], [[0.35, 0.25, 0.35]], (count, 3))
    light = 0.95 * 10.0 ** -transform(STAINS.T, amounts)
    return np.asarray(np.round(linear_to_code(light) * 255.0) / 255.0)


def border_pairs(random: np.random.Generator, count: int) -> Array:
    """Return pairs of code values on both sides of white's border in ``nearest``, 1e-4 to 1e-2 of linear light apart.

    White is nearer than the nearest primary where the other two channels sum to more than 1.
    """
    # Seven in twenty random colours have their projection on the border inside the cube: four times as many are enough.
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
    """Return the lattice points that tetrahedral interpolation mixes for each colour, and whether they cross a border.

    A colour crosses when a lattice point of influence and the colour lie on different sides of white's border. The
    profile ``source`` of the picture is applied to both before this test.
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
    """Return for each row of labels, shape (n, k), whether its labels differ, (n,)."""
    first, *others = labels.T
    return np.asarray(np.logical_or.reduce([other != first for other in others]))


def _region(weights: Array) -> NDArray[np.uint8]:
    """Label colours by the weight of white: 0 for no weight, 1 on the border, 2 for the full weight."""
    white = weights[:, 0]
    return np.asarray((white > 0).astype(np.uint8) + (white == 1))


@dataclass(frozen=True)
class Budget:
    """Limits for the largest ΔE2000 of the smooth colours, and for its 99 % quantile.

    None: ``MAX_DELTA_E`` and ``P99``, or the certified figure of the file if that is larger.
    """

    max_delta_e: float | None = None
    p99: float | None = None

    def __post_init__(self) -> None:
        """Raise LutgenError for a limit that is not finite or is negative."""
        for option, limit in (("--max-delta-e", self.max_delta_e), ("--p99", self.p99)):
            if limit is not None and not 0 <= limit < inf:
                raise LutgenError(f"{option} {limit:g}: a colour difference ΔE2000 from 0 on, such as 0.1.")

    def limits(self, record: FileRecord | None, group: str) -> tuple[float, float]:
        """Return the limits for a group of a file's colours: largest ΔE2000 and 99 % quantile."""
        of_group = ((record.certificate if record else None) or {}).get(group)
        certified = of_group if isinstance(of_group, dict) else {}
        return (
            max(MAX_DELTA_E, _figure(certified, "max") + SLACK) if self.max_delta_e is None else self.max_delta_e,
            max(P99, _figure(certified, "p99") + SLACK) if self.p99 is None else self.p99,
        )


def over_budget(certificate: Certificate, record: FileRecord | None, budget: Budget) -> list[str]:
    """Describe where a certificate exceeds the budget, or is worse than the certificate in the file's record."""
    problems = []
    # A table of very few points mixes across a jump of the model everywhere, so that no colour is smooth.
    group, note = ("smooth", "") if certificate.smooth.colours else ("border", " (no colour of this table is smooth)")
    max_delta_e, p99 = budget.limits(record, group)
    for figure, limit, option in (("max", max_delta_e, "--max-delta-e"), ("p99", p99, "--p99")):
        value = getattr(certificate.groups()[group], figure)
        if value > limit:
            problem = f"{group} ΔE2000 {figure} is {value:.4f}, over the budget of {limit:g} ({option}){note}"
            problems.append(f"fidelity: {problem}")
    for group, before in ((record.certificate if record else None) or {}).items():
        now = certificate.groups().get(group)
        if isinstance(before, dict) and now is not None:
            compared = [(name, getattr(now, name), _figure(before, name)) for name in ("mean", "p99", "max")]
            if any(value > limit + SLACK for _, value, limit in compared):
                texts = [f"{name} {value:.4f} (certified {limit:.4f})" for name, value, limit in compared]
                problems.append(f"fidelity: {group} ΔE2000 is worse than certified: {', '.join(texts)}")
    return problems


def _figure(group: Mapping[str, Any], name: str) -> float:
    value = group.get(name)
    return float(value) if isinstance(value, int | float) else 0.0
