"""The ladder: rungs in their order, each taken only where it lowers the error of readings that were held out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.display.own_model import curves, residual
from lutgen.display.own_model.drive import WAYS, Drive
from lutgen.display.own_model.least_squares import spread
from lutgen.display.own_model.residual import SmoothResidual
from lutgen.display.own_model.sample import FOLDS
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.colorimetry import Array
    from lutgen.display.own_model.sample import Sample

    #: Code values (m, 3) → shares of white's X, Y and Z, (m, 3), and how to make such a model of a sample.
    Model = Callable[[Array], Array]
    Fit = Callable[[Sample], Model]

#: Different mixtures that a ladder is judged on, at least: four in every fold.
LEAST_MIXTURES = 20

#: A rung is taken when it lowers the error by more than so many standard errors of that difference.
CLEAR = 1.0

#: Constants that the held-out error chooses from: stiffness of curves, length and noise of the residual; tried in this
#: order.
STIFFNESS = (0.01, 0.001, 0.1, 1.0)
LENGTHS = (0.3, 0.2, 0.12, 0.5, 0.8)
NOISES = (0.3, 0.1, 1.0, 3.0)

#: A reading that errs by more than so many robust standard deviations, and by so much in units of CIELAB, is misread.
MISREAD_SIGMA, MISREAD_LAB = 8.0, 3.0

#: If more than this share of a session contradicts the model, the readings are not called misread: the session drifts.
MOST_MISREAD = 0.02


@dataclass(frozen=True)
class Rung:
    """One rung: its name, mean ΔE2000 on mixtures that were held out, and whether it was taken."""

    name: str
    error: float
    taken: bool

    def sentence(self) -> str:
        """Describe the rung in one line."""
        verdict = "taken" if self.taken else "left out, the error does not fall clearly"
        return f"{self.name[:1].upper()}{self.name[1:]}: held-out mean ΔE2000 {self.error:.3f}, {verdict}."


@dataclass(frozen=True)
class OwnModel:
    """A display's own model."""

    #: The rungs that were taken, fitted on all readings.
    model: Model
    #: All that were tried, in their order.
    rungs: tuple[Rung, ...]
    #: Shares of white's X, Y and Z at every reading of the sample, (n, 3), by models fitted without its patch; black,
    #: white and the primaries are in every fit.
    held_out: Array
    #: Indices of the sample's readings that contradict all others and have little weight.
    misread: tuple[int, ...]
    #: The readings that it was fitted on.
    sample: Sample

    def __call__(self, code: Array) -> Array:
        """Code values (m, 3) → shares of white's X, Y and Z, (m, 3)."""
        return self.model(code)

    def standard_error(self, code: Array) -> Array | None:
        """Standard error at code values (m, 3), as shares of white, (m, 3); None without a residual."""
        return self.model.standard_error(code) if isinstance(self.model, SmoothResidual) else None

    @property
    def is_above_curves(self) -> bool:
        """Whether a rung above one curve of each channel was taken."""
        return any(rung.taken for rung in self.rungs[2:])

    @property
    def error(self) -> float:
        """Mean ΔE2000 on mixtures that were held out."""
        return mixtures_error(self.sample, self.held_out)

    def held_out_of(self, code: Array) -> Array:
        """Shares at code values (m, 3) by models fitted without them, (m, 3); NaN at code values that were not read."""
        known = {tuple(each): share for each, share in zip(self.sample.drive.tolist(), self.held_out, strict=True)}
        return np.array([known.get(tuple(each), np.full(3, np.nan)) for each in code.tolist()])

    def sentences(self) -> tuple[str, ...]:
        """Describe every rung, and every reading of little weight, in a line each."""
        return (*(rung.sentence() for rung in self.rungs), *self.remarks())

    def remarks(self) -> tuple[str, ...]:
        """Name the readings of little weight, in a line each; for a session that drifts give only their number."""
        count, said = len(self.misread), []
        if count > MOST_MISREAD * len(self.sample.drive):
            many = (
                f"{self.sample.file}: {count} of {len(self.sample.drive)} readings contradict the others and count "
                f"little: no display's model holds here. Did brightness change within the session?"
            )
            return (many,)
        for row in self.misread:
            code = ", ".join(f"{value:.4g}" for value in self.sample.drive[row])
            said.append(
                f"{self.sample.file}, line {int(self.sample.lines[row])}: the reading of code {code} contradicts all "
                f"others and counts little. Measure it again."
            )
        return tuple(said)


def fit_own_model(sample: Sample) -> OwnModel:
    """Climb the ladder: five-fold cross-validation by patch, on mixtures; deterministic.

    Raises LutgenError: the session has fewer than ``LEAST_MIXTURES`` different mixtures.
    """
    if sample.mixtures < LEAST_MIXTURES:
        raise LutgenError(
            f"{sample.file}: {sample.mixtures} different mixtures; a display's own model is judged on {LEAST_MIXTURES} "
            f"at least. Measure more colours of two or three channels."
        )
    return _Climb(sample).model()


class _Climb:
    """The best model so far, while rungs are tried."""

    def __init__(self, sample: Sample) -> None:
        self.sample = sample
        outs = [sample.fold == fold for fold in range(FOLDS)]
        self.parts = [(out, sample.part(~out)) for out in outs if out.any()]
        self.fit: Fit = curves.fit_srgb
        self.held_out = self._foretold(self.fit)
        self.rungs = [Rung(curves.SRGB_NAME, mixtures_error(sample, self.held_out), taken=True)]

    def model(self) -> OwnModel:
        """Try all rungs, and fit those that were taken on all readings."""
        asked = [Drive()]
        if self.sample.calibration is not None:
            asked += [Drive(way, self.sample.calibration) for way in WAYS[1:3]]
        clipped = [Drive(WAYS[3], self.sample.clipped)] if self.sample.clipped is not None else []

        def scalar(stiffness: float, drive: Drive) -> Fit:
            return partial(curves.fit_scalar, drive=drive, stiffness=stiffness)

        def of_each(stiffness: float, drive: Drive) -> Fit:
            return partial(curves.fit_xyz, drive=drive, stiffness=stiffness)

        def pairs(stiffness: float) -> Fit:
            return partial(curves.fit_xyz, drive=drive, stiffness=stiffness, products=True)

        self._try(curves.SCALAR_NAME, scalar, STIFFNESS[:3], [Drive(), *clipped])
        _, drive = self._try(curves.XYZ_NAME, of_each, STIFFNESS, [*asked, *clipped])
        self._try(curves.PRODUCTS_NAME, pairs, STIFFNESS)
        below = _remembered(self.fit)

        def smooth(length: float, noise: float) -> Fit:
            return lambda sample: residual.fit(sample, below(sample), drive, length, noise)

        self._try(residual.NAME, smooth, LENGTHS, NOISES)
        model = self.fit(self.sample)
        return OwnModel(model, tuple(self.rungs), self.held_out, _misread(self.sample, model), self.sample)

    def _try(self, name: str, make: Callable[..., Fit], *grids: Sequence[Any]) -> list[Any]:
        """Choose a rung's constants by held-out error, one after the other; take the rung where it clearly helps."""
        chosen = [grid[0] for grid in grids]
        held_out = self._foretold(make(*chosen))
        for place, grid in enumerate(grids):
            for option in grid[1:]:
                other = [*chosen[:place], option, *chosen[place + 1 :]]
                tried = self._foretold(make(*other))
                if mixtures_error(self.sample, tried) < mixtures_error(self.sample, held_out):
                    chosen, held_out = other, tried
        taken = clearly_better(self.sample, held_out, self.held_out)
        self.rungs.append(Rung(name, mixtures_error(self.sample, held_out), taken))
        if taken:
            self.fit, self.held_out = make(*chosen), held_out
        return chosen

    def _foretold(self, fit: Fit) -> Array:
        """Shares at every reading, (n, 3), each by a model fitted without its patch."""
        shares = np.empty_like(self.sample.share)
        known = self.sample.fold < 0
        for out, part in self.parts:
            model = fit(part)
            shares[out] = model(self.sample.drive[out])
            shares[known] = model(self.sample.drive[known])
        return shares


def _remembered(fit: Fit) -> Fit:
    """Fit each sample once: the rung above chooses its constants on the same fits."""
    models: dict[int, Model] = {}

    def remembered(sample: Sample) -> Model:
        if id(sample) not in models:
            models[id(sample)] = fit(sample)
        return models[id(sample)]

    return remembered


def clearly_better(sample: Sample, one: Array, other: Array) -> bool:
    """Whether shares (n, 3) miss the mixtures by less than others do, by more than ``CLEAR`` standard errors."""
    patch = sample.patch[sample.is_mixture]
    gain = (_errors(sample, other) - _errors(sample, one))[sample.is_mixture]
    count = np.bincount(patch)
    mean = np.bincount(patch, gain)[count > 0] / count[count > 0]
    return bool(mean.mean() > CLEAR * mean.std(ddof=1) / np.sqrt(mean.size))


def mixtures_error(sample: Sample, share: Array) -> float:
    """Mean ΔE2000 of shares (n, 3) on the sample's mixtures; reference white: the sample's own."""
    return float(_errors(sample, share)[sample.is_mixture].mean())


def _errors(sample: Sample, share: Array) -> Array:
    white = sample.white / sample.white[1]
    return np.asarray(delta_e_2000(xyz_to_lab(share * white, white), xyz_to_lab(sample.share * white, white)))


def _misread(sample: Sample, model: Model) -> tuple[int, ...]:
    left = (sample.share - model(sample.drive)) * sample.slope
    size = np.linalg.norm(left, axis=1)
    return tuple(np.flatnonzero((size > MISREAD_SIGMA * spread(left)) & (size > MISREAD_LAB)).tolist())
