"""Share of the excess error that each effect explains, in mean ΔE2000, which measures visible differences.

The unit of χ² is the noise of the meter, which is most sensitive to dark patches. An effect may explain nine tenths of
χ² and still be the less visible effect.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.fit.anchored import anchored, noise_only

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.fit.linear import Term
    from lutgen.criticism.search.explanation import Step


def shares_of_delta_e(base: Fit, final: Fit, steps: Sequence[Step]) -> dict[str, float]:
    """Return, for each admitted effect, the share of the excess mean ΔE2000 that returns in a fit without it.

    The other effects are refitted without it; error that they then explain does not count for this effect. ``base`` is
    the fit without any of the effects, ``final`` the fit with all of them. The excess is the mean ΔE2000 of ``base``
    minus that of noise alone. If seeded noise gives as much as the excess, all shares are 0. Shares of effects that act
    on the same colours need not add to 1.
    """
    problem = base.problem
    # Colours that the first session has not read are excluded: the errors of the curves there would dominate.
    judged, white = ~problem.is_anchor & (problem.counts == 1.0), problem.measured_tips[0, 0]
    if not judged.any():
        return {step.name: 0.0 for step in steps}

    def mean(predicted: Array, measured: Array) -> float:
        delta_e = delta_e_2000(xyz_to_lab(predicted, white), xyz_to_lab(measured, white))
        return float(delta_e[judged].mean())

    def error(terms: Sequence[Term]) -> float:
        return mean(anchored(problem, terms), problem.xyz)

    plain = anchored(problem, base.terms)
    floor = [mean(plain, plain + residual) for residual in noise_only(problem, plain)]
    excess, least = mean(plain, problem.xyz) - float(np.mean(floor)), error(final.terms)
    if excess <= max(floor) - float(np.mean(floor)):
        return {step.name: 0.0 for step in steps}
    return {step.name: min(max(error(step.without.terms) - least, 0.0) / excess, 1.0) for step in steps}
