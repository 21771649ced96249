"""The last figure: the error of the LUT that lutgen bakes from its finding, compared with the display itself.

Nobody measured the colours and hours of the comparison: the colours are random with a seed, and the hours are the
middles between sessions. The luminance is held, so that a session's gain on white has no effect. Like the scoring, this
module imports lutgen.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.lut import Sampler
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_xyz, xyz_to_lab
from lutgen.criticism.display_model import model_of
from tests.virtual_display.campaign import truth

if TYPE_CHECKING:
    from lutgen.criticism.diagnose import Diagnosis
    from tests.virtual_display.campaign import Campaign

COLOURS, HOURS, SEED = 300, 3, 1931

#: Points along an edge of the table. This is the larger of the available sizes, so that the table's interpolation error
#: is smaller than the noise.
SIZE = 65


def error_of_lut(diagnosis: Diagnosis, campaign: Campaign) -> float:
    """Return the mean ΔE2000 between the LUT of the refined model and the display, with white's luminance held."""
    model = model_of(diagnosis.explanation.final, diagnosis, diagnosis.comparison, diagnosis.after)
    model = replace(model, reference="absolute")
    rng = np.random.default_rng(SEED)
    code = rng.random((COLOURS, 3))
    known = diagnosis.problem.hours
    gaps = rng.choice(known.size - 1, min(HOURS, known.size - 1), replace=False)
    errors = []
    for hour in (known[gaps] + known[gaps + 1]) / 2:
        lut = Sampler().lut(model.at("chroma", float(hour)), SIZE, "code", clip=False)
        shown = linear_to_xyz(code_to_linear(lut.apply(code)))
        white = truth(campaign, np.ones((1, 3)), float(hour))[0]
        real = truth(campaign, code, float(hour)) / white[1]
        errors.append(delta_e_2000(xyz_to_lab(shown, white / white[1]), xyz_to_lab(real, white / white[1])).mean())
    return float(np.mean(errors))
