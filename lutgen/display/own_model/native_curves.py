"""Transfer curves of a native display from all readings of its first session, and whether they beat its ramps'.

A native display adds its colour points up by the paper's matrices, so that one curve a channel is what it can take from
the ladder. Curves of single-channel ramps miss mixtures, which are brighter than their channels together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.display.own_model import scalar_curves
from lutgen.display.own_model.drive import Drive
from lutgen.display.own_model.gain import SPLINES, lit
from lutgen.display.own_model.ladder import STIFFNESS, clearly_better, mixtures_error
from lutgen.display.own_model.sample import FOLDS
from lutgen.display.trace import tip_shares
from lutgen.display.transfer_curve import TransferCurve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.display.own_model.sample import Sample

#: Different mixtures from which on curves are asked of all readings.
LEAST_MIXTURES = 50

#: Points of a curve: eight times as many as a usual ramp's levels.
POINTS = 65


def curves_of(sample: Sample) -> tuple[TransferCurve, TransferCurve, TransferCurve]:
    """Fit red, green and blue on all readings; one that contradicts the others counts little."""
    coefficients = scalar_curves.fit(sample, Drive(), STIFFNESS[0]).coefficients
    codes = np.linspace(0.0, 1.0, POINTS)
    found = []
    for channel, name in enumerate(("red", "green", "blue")):
        start = 1 + channel * SPLINES
        light = lit(codes) @ coefficients[start : start + SPLINES].sum(axis=1)
        found.append(TransferCurve.through(name, codes, np.clip(np.maximum.accumulate(light / light[-1]), 0.0, 1.0)))
    red, green, blue = found
    return red, green, blue


def gain_on_mixtures(sample: Sample, ramps: Sequence[TransferCurve]) -> tuple[float, float] | None:
    """Mean ΔE2000 on mixtures by the ramps' curves, and by those of all readings, held out by patch.

    None where the second is not clearly smaller. The ramps' curves have not seen the mixtures either.
    """
    by_ramps, by_all = _added_up(sample, ramps, sample.drive), np.empty_like(sample.share)
    by_all[sample.fold < 0] = sample.share[sample.fold < 0]
    for fold in range(FOLDS):
        out = sample.fold == fold
        by_all[out] = _added_up(sample, curves_of(sample.part(~out)), sample.drive[out])
    if not clearly_better(sample, by_all, by_ramps):
        return None
    return mixtures_error(sample, by_ramps), mixtures_error(sample, by_all)


def _added_up(sample: Sample, curves: Sequence[TransferCurve], code: Array) -> Array:
    """Shares of white that a native display shows, (m, 3), by the paper's ``nearest`` matrices."""
    linear = np.stack([curve(code[:, channel]) for channel, curve in enumerate(curves)], axis=1)
    shares = tip_shares(linear, code, "nearest")
    return np.asarray(shares @ sample.tips + (1.0 - shares.sum(axis=1))[:, np.newaxis] * sample.black)
