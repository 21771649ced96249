"""The ladder: rungs in order; each rung is taken only if it lowers the error of held-out readings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from lutgen.colorimetry import Array, delta_e_2000, xyz_to_lab
from lutgen.display.own_model import curves, residual
from lutgen.display.own_model.drive import WAYS, Drive
from lutgen.display.own_model.least_squares import spread
from lutgen.display.own_model.residual import SmoothResidual
from lutgen.display.own_model.sample import FOLDS, Sample
from lutgen.errors import LutgenError

#: Model: code values (m, 3) → shares of white's X, Y and Z, (m, 3). Fit: sample, and constants that the
#: held-out error selects → model.
Model = Callable[[Array], Array]
Fit = Callable[..., Model]

#: Smallest number of distinct mixtures for the ladder: four in every fold.
LEAST_MIXTURES = 20

#: Smallest decrease of the error, in standard errors of the decrease, for which a rung is taken.
CLEAR = 1.0

#: Values of the constants that the held-out error selects, in the order of trials: stiffness of curves, length and
#: noise of the residual.
STIFFNESS = (0.01, 0.001, 0.1, 1.0)
LENGTHS = (0.3, 0.2, 0.12, 0.5, 0.8)
NOISES = (0.3, 0.1, 1.0, 3.0)

#: A reading is misread if its residual exceeds this number of robust standard deviations, and this size in CIELAB
#: units.
MISREAD_SIGMA, MISREAD_LAB = 8.0, 3.0

#: Largest share of misread readings. If more readings contradict the model, the session drifts.
MOST_MISREAD = 0.02


@dataclass(frozen=True)
class Rung:
    """One rung: its name, mean ΔE2000 of held-out mixtures, and whether it was taken."""

    name: str
    error: float
    taken: bool

    def sentence(self) -> str:
        """Return one line about the rung."""
        verdict = "taken" if self.taken else "left out, the error does not fall clearly"
        return f"{self.name[:1].upper()}{self.name[1:]}: held-out mean ΔE2000 {self.error:.3f}, {verdict}."


@dataclass(frozen=True)
class OwnModel:
    """A display's own model."""

    #: The model of the taken rungs, fitted to all readings.
    model: Model
    #: All tried rungs, in order.
    rungs: tuple[Rung, ...]
    #: Shares of white's X, Y and Z at every reading of the sample, (n, 3), from models fitted without the reading's
    #: patch. Black, white and the primaries are in every fit.
    held_out: Array
    #: Indices of readings of the sample that contradict all others and have little weight.
    misread: tuple[int, ...]
    #: The readings of the fit.
    sample: Sample

    def __call__(self, code: Array) -> Array:
        """Return shares of white's X, Y and Z, (m, 3), for code values (m, 3)."""
        return self.model(code)

    def standard_error(self, code: Array) -> Array | None:
        """Return the standard error at code values (m, 3), as shares of white, (m, 3); None without a residual."""
        return self.model.standard_error(code) if isinstance(self.model, SmoothResidual) else None

    @property
    def is_above_curves(self) -> bool:
        """Whether a rung above one curve for each channel was taken."""
        return any(rung.taken for rung in self.rungs[2:])

    @property
    def error(self) -> float:
        """Mean ΔE2000 of held-out mixtures."""
        return mixtures_error(self.sample, self.held_out)

    def held_out_of(self, code: Array) -> Array:
        """Return held-out shares at code values (m, 3), (m, 3); NaN at code values without a reading."""
        known = {tuple(each): share for each, share in zip(self.sample.drive.tolist(), self.held_out, strict=True)}
        return np.array([known.get(tuple(each), np.full(3, np.nan)) for each in code.tolist()])

    def sentences(self) -> tuple[str, ...]:
        """Return one line for every rung and for every reading of little weight."""
        return (*(rung.sentence() for rung in self.rungs), *self.remarks())

    def remarks(self) -> tuple[str, ...]:
        """Return one line for every reading of little weight; for a session that drifts, one line with their number."""
        count, sample = len(self.misread), self.sample
        if count > MOST_MISREAD * len(sample.drive):
            many = f"{count} of {len(sample.drive)} readings contradict the others and count little"
            why = "no model of a display fits these readings. Did brightness change within the session?"
            return (f"{sample.file}: {many}: {why}",)
        codes = [", ".join(f"{value:.4g}" for value in sample.drive[row]) for row in self.misread]
        return tuple(
            f"{sample.file}, line {int(sample.lines[row])}: the reading of code {code} contradicts all others and "
            f"counts little. Measure it again."
            for row, code in zip(self.misread, codes, strict=True)
        )


def fit_own_model(sample: Sample) -> OwnModel:
    """Return the own model of a sample, by five-fold cross-validation by patch, on mixtures; deterministic.

    Raises LutgenError: the session has fewer than ``LEAST_MIXTURES`` distinct mixtures.
    """
    if sample.mixtures < LEAST_MIXTURES:
        raise LutgenError(
            f"{sample.file}: {sample.mixtures} different mixtures; a display's own model is judged on {LEAST_MIXTURES} "
            f"at least. Measure more colours of two or three channels."
        )
    return _Climb(sample).model()


class _Climb:
    """The state of the ladder: the fit of the taken rungs, its held-out shares, and all tried rungs."""

    def __init__(self, sample: Sample) -> None:
        self.sample = sample
        outs = [sample.fold == fold for fold in range(FOLDS)]
        self.parts = [(out, sample.part(~out)) for out in outs if out.any()]
        self.fit: Fit = lambda part: curves.SrgbCurves(part.tips)
        self.held_out = self._predicted(self.fit)
        self.rungs = [Rung(curves.SRGB_NAME, mixtures_error(sample, self.held_out), taken=True)]

    def model(self) -> OwnModel:
        """Try all rungs, and fit the taken rungs to all readings."""
        drives = [Drive()]
        if self.sample.calibration is not None:
            drives += [Drive(way, self.sample.calibration) for way in WAYS[1:3]]
        clipped = [Drive(WAYS[3], self.sample.clipped)] if self.sample.clipped is not None else []
        self._try(curves.SCALAR_NAME, curves.fit_scalar, STIFFNESS[:3], [Drive(), *clipped])
        _, drive = self._try(curves.XYZ_NAME, curves.fit_xyz, STIFFNESS, [*drives, *clipped])
        self._try(curves.PRODUCTS_NAME, partial(curves.fit_xyz, drive=drive, products=True), STIFFNESS)
        below = cache(self.fit)  # the residual selects its constants with the same fits
        self._try(residual.NAME, lambda part, *chosen: residual.fit(part, below(part), drive, *chosen), LENGTHS, NOISES)
        model = self.fit(self.sample)
        return OwnModel(model, tuple(self.rungs), self.held_out, _misread(self.sample, model), self.sample)

    def _try(self, name: str, fit: Fit, *grids: Sequence[Any]) -> list[Any]:
        """Select a rung's constants by held-out error, one after the other; take the rung if it is clearly better."""
        chosen = [grid[0] for grid in grids]
        held_out = self._predicted(fit, *chosen)
        for place, grid in enumerate(grids):
            for option in grid[1:]:
                other = [*chosen[:place], option, *chosen[place + 1 :]]
                shares = self._predicted(fit, *other)
                if mixtures_error(self.sample, shares) < mixtures_error(self.sample, held_out):
                    chosen, held_out = other, shares
        taken = clearly_better(self.sample, held_out, self.held_out)
        self.rungs.append(Rung(name, mixtures_error(self.sample, held_out), taken))
        if taken:
            self.fit, self.held_out = (lambda part: fit(part, *chosen)), held_out
        return chosen

    def _predicted(self, fit: Fit, *constants: Any) -> Array:
        """Return the shares at every reading, (n, 3), from models fitted without the reading's patch."""
        shares = np.empty_like(self.sample.share)
        known = self.sample.fold < 0
        for out, part in self.parts:
            model = fit(part, *constants)
            shares[out] = model(self.sample.drive[out])
            shares[known] = model(self.sample.drive[known])
        return shares


def clearly_better(sample: Sample, one: Array, other: Array) -> bool:
    """Whether ``one`` has a smaller error on mixtures than ``other``, by more than ``CLEAR`` standard errors."""
    patch = sample.patch[sample.is_mixture]
    gain = (errors_of(sample, other) - errors_of(sample, one))[sample.is_mixture]
    count = np.bincount(patch)
    mean = np.bincount(patch, gain)[count > 0] / count[count > 0]
    return bool(mean.mean() > CLEAR * mean.std(ddof=1) / np.sqrt(mean.size))


def mixtures_error(sample: Sample, share: Array) -> float:
    """Return the mean ΔE2000 of shares (n, 3) on the sample's mixtures; the reference white is the sample's white."""
    return float(errors_of(sample, share)[sample.is_mixture].mean())


def errors_of(sample: Sample, share: Array) -> Array:
    """Return ΔE2000 of shares (n, 3) at every reading, (n,); the reference white is the sample's white."""
    white = sample.white / sample.white[1]
    return np.asarray(delta_e_2000(xyz_to_lab(share * white, white), xyz_to_lab(sample.share * white, white)))


def _misread(sample: Sample, model: Model) -> tuple[int, ...]:
    residuals = (sample.share - model(sample.drive)) * sample.slope
    size = np.linalg.norm(residuals, axis=1)
    return tuple(np.flatnonzero((size > MISREAD_SIGMA * spread(residuals)) & (size > MISREAD_LAB)).tolist())
