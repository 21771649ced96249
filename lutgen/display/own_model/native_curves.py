"""Transfer curves of a native display from all readings of its first session, and the choice between sources of curves.

A native display adds its colour points by the paper's matrices, so it can use one rung of the ladder: one curve for
each channel. Curves from single-channel ramps are wrong for mixtures, which are brighter than the sum of their
channels.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.display.own_model.curves import fit_scalar, lit
from lutgen.display.own_model.drive import Drive
from lutgen.display.own_model.ladder import STIFFNESS, clearly_better, mixtures_error
from lutgen.display.own_model.sample import FOLDS, Sample
from lutgen.display.paper import tip_shares
from lutgen.display.transfer_curve import TransferCurve

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


def curves_of(sample: Sample) -> Curves3:
    """Return the curves of red, green and blue fitted to all readings; outliers have little weight."""
    codes, curves = np.linspace(0.0, 1.0, POINTS), []
    of_channels = np.split(fit_scalar(sample, STIFFNESS[0], Drive()).coefficients[1:], 3)
    for name, coefficients in zip(("red", "green", "blue"), of_channels, strict=True):
        light = lit(codes) @ coefficients.sum(axis=1)
        curves.append(TransferCurve.through(name, codes, np.clip(np.maximum.accumulate(light / light[-1]), 0.0, 1.0)))
    red, green, blue = curves
    return red, green, blue


def straight() -> Curves3:
    """Return sRGB's curves, the lowest rung."""
    red, green, blue = (TransferCurve(name, (0.0, 1.0), (0.0, 1.0)) for name in ("red", "green", "blue"))
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
    shares = {"readings": by_all, "srgb": added_up(sample, straight(), sample.drive)}
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
