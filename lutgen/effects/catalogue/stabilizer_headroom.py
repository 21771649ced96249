"""A sensor holds the luminance until the lamp has no reserve left; then it falls: a knee.

L = min(L_set, L₀·D(t)). Relative to hour 0, L = min(1, (1 + h)·exp(−ℓ·τ^β)). The corner is rounded over ``knee``
nepers.

Meaning of 0 and 1: ``headroom`` 0 is a lamp at its limit from the start, which then fades as in ``backlight-decay``.
``headroom`` 1 is a lamp that could give twice the held light. ``loss`` 1 leaves 1/e of the lamp's own light at 18 000
h.
Valid for a display whose sensor holds white at one set luminance.
Source: of 249 medical displays 4, 20 and 39 could not give 170 cd/m² in three successive years: "Effective luminance
deterioration of medical liquid crystal displays in clinical use", Radiol. Phys. Technol. (2017),
doi:10.1007/s12194-017-0401-x.
Assumption: the form of the knee, and the size of the reserve.
"""

import numpy as np

from lutgen.colorimetry import Array
from lutgen.effects.declare import Parameter, effect
from lutgen.effects.scene import Scene


@effect(
    stage="emission",
    neutral={"loss": 0.0},
    forms=(("headroom", "loss"), ("headroom", "loss", "beta"), ("headroom", "loss", "beta", "knee")),
    baseline="first-hour",
    compensated=False,
    confused_with={
        "backlight-decay": "hours around the knee: held first, or falling from the start",
        "recalibration": "a column or note of events; both change suddenly",
    },
    source="doi:10.1007/s12194-017-0401-x (249 medical displays); form and size: an assumption",
    headroom=Parameter(0.5, (0.0, 6.0), "1", "reserve at hour 0: the lamp's full light over the held light, less 1"),
    loss=Parameter(0.9, (0.0, 8.0), "1", "nepers that the lamp itself has lost by 18 000 h"),
    beta=Parameter(1.0, (0.3, 4.0), "1", "shape of the lamp's loss: 1 exponential, above 1 slow first"),
    knee=Parameter(0.01, (0.001, 0.3), "1", "nepers over which the knee is rounded"),
)
def stabilizer_headroom(tips: Array, scene: Scene, *, headroom: float, loss: float, beta: float, knee: float) -> Array:
    """Hold all tips until the reserve is used, then dim them."""
    reserve = np.log1p(headroom)
    short = knee * np.logaddexp(0.0, (loss * scene.tau**beta - reserve) / knee)
    at_first = knee * np.logaddexp(0.0, -reserve / knee)
    return np.asarray(tips * np.exp(at_first - short)[..., np.newaxis])
