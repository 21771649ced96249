"""Transfer curves of a native display from all readings of its first session, and the choice between sources of curves.

A native display adds its colour points by the paper's matrices, so it can use one rung of the ladder: one curve for
each channel. Curves from single-channel ramps are wrong for mixtures, and mostly for greys too, which are brighter than
the sum of their channels. If no mixtures can judge the curves, greys do (:func:`by_greys`): on an additive display
ramps, which have more readings, give the better curves, also between the greys.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array
from lutgen.display.own_model.curves import fit_scalar, lit
from lutgen.display.own_model.drive import Drive
from lutgen.display.own_model.ladder import STIFFNESS, clearly_better, errors_of, mixtures_error
from lutgen.display.own_model.sample import FOLDS, Sample
from lutgen.display.paper import tip_shares
from lutgen.display.transfer_curve import TransferCurve
from lutgen.errors import LutgenError
from lutgen.readings import TIP_NAMES

#: Curves of red, green and blue.
Curves3 = tuple[TransferCurve, TransferCurve, TransferCurve]

#: Smallest number of distinct mixtures for curves that are fitted to all readings.
LEAST_MIXTURES = 50

#: Smallest number of mixtures that can validate curves.
FEW = 6

#: Source → name in sentences, if the names differ.
NAMES = {"readings": "all readings", "srgb": "sRGB"}

#: Number of points of a curve: eight times the levels of a usual ramp.
POINTS = 65

#: Ramps are used if their error on greys is at most this share of the error of curves from the other greys.
CLEARLY = 0.5

#: Curves from a source, "greys" or "ramps", without the readings (indices of the sample) that are left out. Raises
#: LutgenError: the source has too few levels, or falls.
CurvesFrom = Callable[[str, Sequence[int]], Curves3]


def curves_of(sample: Sample) -> Curves3:
    """Return the curves of red, green and blue fitted to all readings; outliers have little weight."""
    codes, curves = np.linspace(0.0, 1.0, POINTS), []
    of_channels = np.split(fit_scalar(sample, STIFFNESS[0], Drive()).coefficients[1:], 3)
    for name, coefficients in zip(TIP_NAMES[1:], of_channels, strict=True):
        light = lit(codes) @ coefficients.sum(axis=1)
        curves.append(TransferCurve.through(name, codes, np.clip(np.maximum.accumulate(light / light[-1]), 0.0, 1.0)))
    red, green, blue = curves
    return red, green, blue


def srgb_curves() -> Curves3:
    """Return sRGB's curves, which are straight lines in encoded light: the lowest rung."""
    red, green, blue = (TransferCurve(name, (0.0, 1.0), (0.0, 1.0)) for name in TIP_NAMES[1:])
    return red, green, blue


def held_out_of_all(sample: Sample) -> Array:
    """Return shares of white at every reading, (n, 3), from curves fitted without the reading's patch."""
    shares = sample.share.copy()
    for fold in range(FOLDS):
        out = sample.fold == fold
        shares[out] = added_up(sample, curves_of(sample.part(~out)), sample.drive[out])
    return shares


def best_source(sample: Sample, ramps: Curves3 | None, name: str) -> tuple[str, str]:
    """Return the source of the curves with the smallest mean ΔE2000 on mixtures, and the reason in one sentence.

    The error of curves from all readings is held out by patch. Curves from ramps (source ``name``) and sRGB's curves do
    not use mixtures. Curves from all readings replace curves from ramps if they are clearly better. sRGB's curves
    replace both if their error is smaller.
    """
    by_all = held_out_of_all(sample)
    shares = {"readings": by_all, "srgb": added_up(sample, srgb_curves(), sample.drive)}
    if ramps:
        shares[name] = added_up(sample, ramps, sample.drive)
    errors = {each: mixtures_error(sample, share) for each, share in shares.items()}
    chosen = "readings" if ramps is None or clearly_better(sample, by_all, shares[name]) else name
    chosen = "srgb" if errors["srgb"] < errors[chosen] else chosen
    figures = "; ".join(f"{NAMES.get(each, each)} {error:.2f}" for each, error in sorted(errors.items()))
    return chosen, f"Curves are those of {NAMES.get(chosen, chosen)}: mean ΔE2000 on mixtures held out: {figures}."


def added_up(sample: Sample, curves: Curves3, code: Array) -> Array:
    """Return shares of white of a native display, (m, 3), by the paper's ``nearest`` matrices."""
    return np.asarray(parts_of(curves, code) @ np.vstack([sample.tips, sample.black]))


def parts_of(curves: Curves3, code: Array) -> Array:
    """Return the shares of white, red, green, blue and black in each colour, (m, 5)."""
    linear = np.stack([curve(code[:, channel]) for channel, curve in enumerate(curves)], axis=1)
    shares = tip_shares(linear, code, "nearest")
    return np.column_stack([shares, 1.0 - shares.sum(axis=1)])


def by_greys(sample: Sample, is_grey: NDArray[np.bool_], curves_from: CurvesFrom) -> str:
    """Return "ramps" if they predict the greys clearly better than curves from the other greys do, otherwise "greys".

    Five-fold cross-validation by level gives the error of curves from the other greys. ``is_grey``: greys between black
    and white, (n,).
    """
    level = np.unique(sample.drive[is_grey, 0], return_inverse=True)[1].reshape(-1)
    if level.max(initial=0) < FOLDS:
        return "ramps"
    greys = np.flatnonzero(is_grey)
    by_others = sample.share.copy()
    try:
        for fold in range(FOLDS):
            out = greys[level % FOLDS == fold]
            by_others[out] = added_up(sample, curves_from("greys", out.tolist()), sample.drive[out])
        by_ramps = added_up(sample, curves_from("ramps", ()), sample.drive)
    except LutgenError:
        return "ramps"
    other, own = (float(errors_of(sample, share)[is_grey].mean()) for share in (by_others, by_ramps))
    return "ramps" if own <= CLEARLY * other else "greys"
