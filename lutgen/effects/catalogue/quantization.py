"""Code values are rounded to n bits somewhere on their way: the curve has steps, the same at every hour.

d → round(d·(2ⁿ − 1))/(2ⁿ − 1), or, where a calibration table comes first, the same on d^g or on the code of a panel of
gamma γ, (light)^(1/γ); hardware rounds by adding a part of a step and truncating.

Meaning of 0 and 1: ``bits`` 0 rounds nothing; 1 bit would leave black and white alone, so the search begins at 4.
Valid for one rounding; dithering in space or time blurs its steps.
Source: depths of medical displays, and what a calibration to the greyscale standard needs of them: Kimpe &
Tuytschaever, J. Digit. Imaging 20, 422 (2007), doi:10.1007/s10278-006-1052-3. By rounding alone a calibration through 8
bits costs up to ±4 % of the luminance at d = 0.1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import code_to_linear, linear_to_code
from lutgen.effects.declare import Parameter, effect

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


@effect(
    stage="drive",
    neutral={"bits": 0.0},
    forms=(("bits",), ("bits", "table_gamma"), ("bits", "panel_gamma", "added")),
    confused_with={
        "eotf-drift": "neighbouring code values: a drift is smooth, steps are not",
        "meter-offset": "the same code again: noise changes, a step does not",
    },
    says="code values are rounded to {bits:.0f} bits",
    source="Kimpe & Tuytschaever 2007, doi:10.1007/s10278-006-1052-3 (depths)",
    bits=Parameter(
        8.0, (4.0, 12.0), "bit", "depth to which code values are rounded; 0: not at all", (4, 5, 6, 7, 8, 9, 10, 11, 12)
    ),
    table_gamma=Parameter(
        1.0,
        (0.4, 2.5),
        "1",
        "power by which a table bends code values before",
        (0.45, 0.5, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 2.0, 2.2),
    ),
    panel_gamma=Parameter(
        0.0, (0.0, 2.6), "1", "gamma of the panel whose code is rounded; 0: the code itself", (1.8, 2.0, 2.2, 2.4, 2.6)
    ),
    added=Parameter(0.5, (0.0, 0.5), "1", "part of a step added before truncation; ½ rounds", (0.0, 0.25, 0.4, 0.5)),
)
def quantization(
    code: Array,
    scene: Scene,  # noqa: ARG001 - an effect's signature
    *,
    bits: float,
    table_gamma: float,
    panel_gamma: float,
    added: float,
) -> Array:
    """Round the code values; 0 bits stand for no rounding."""
    if bits < 1:
        return code
    steps, shift = 2.0**bits - 1.0, added - 0.5
    if panel_gamma:
        native = np.maximum(code_to_linear(code), 0.0) ** (1.0 / panel_gamma)
        return linear_to_code((np.maximum(np.round(native * steps + shift), 0.0) / steps) ** panel_gamma)
    if table_gamma == 1.0:
        return np.asarray(np.maximum(np.round(code * steps + shift), 0.0) / steps)
    bent = np.round(np.maximum(code, 0.0) ** table_gamma * steps + shift)
    return np.asarray((np.maximum(bent, 0.0) / steps) ** (1.0 / table_gamma))
