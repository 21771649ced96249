"""Code values are rounded to n bits somewhere on their way: the curve has steps, the same at every hour.

d → round(d·(2ⁿ − 1))/(2ⁿ − 1), or, where a calibration table comes first, the same on d^g or on the code of a panel of
gamma γ, (light)^(1/γ); hardware rounds by adding a part of a step and truncating.

A panel may use a part of its codes: ``bits`` is log2 of their number, whole or not.

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
from lutgen.effects.declare import PROPOSED, Parameter, effect

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.effects.scene import Scene


#: Numbers of steps, powers of a table and gammas of a panel that are tried, and the parts of a step that are added.
STEPS = np.arange(15.0, 1024.0)
TABLES, PANELS, ADDED = np.arange(0.4, 2.5, 0.0025), np.arange(1.8, 2.6, 0.0025), (0.5, 0.4, 0.25, 0.0)

#: Numbers of steps where no table bends the codes, and where the best of each part ends: 6, 7, … bits.
ALL_STEPS, PARTS = np.arange(15.0, 4096.0), 2 ** np.arange(6, 12) - 15 + 1

#: Shifts that are worked out at once: the processor keeps so many at hand.
AT_ONCE = 2**15

#: Number of the best settings of each kind that are tried again, and the powers about each of them.
FEW, NEARBY = 3, np.arange(-0.003, 0.003, 0.0001)

#: Step of a code value for a derivative.
STEP = 1e-4


def _proposed(code: Array, judge: Callable[[Array], Array]) -> list[dict[str, float]]:
    """Settings of tables and panels whose shifts of code values agree best with the readings, the best first."""
    # ``code``: code values that were measured, (m,). ``judge``: shifts of these code values, (k, m) → how well each row
    # agrees with the readings, (k,).
    proposals = []
    for part in np.split(ALL_STEPS, PARTS):
        agreement, steps, _ = _looked_at(code, judge, "table_gamma", np.ones(1), 0.5, part)[0]
        proposals.append((agreement, {"bits": float(np.log2(steps + 1.0)), "table_gamma": 1.0}))
    for name, powers, added in [("table_gamma", TABLES, 0.5), *(("panel_gamma", PANELS, added) for added in ADDED)]:
        coarse = sorted(_looked_at(code, judge, name, powers, added, STEPS), reverse=True)[:FEW]
        for _, steps, power in coarse:
            near = _looked_at(code, judge, name, power + NEARBY, added, steps + np.arange(-4.0, 5.0))
            agreement, best, nearest = max(near)
            setting = {"bits": float(np.log2(best + 1.0)), name: nearest}
            proposals.append((agreement, setting if name == "table_gamma" else {**setting, "added": added}))
    return [setting for _, setting in sorted(proposals, key=lambda each: -each[0])]


def _looked_at(  # noqa: PLR0917 - a judge of code values, and a box of settings
    code: Array, judge: Callable[[Array], Array], name: str, powers: Array, added: float, steps: Array
) -> list[tuple[float, float, float]]:
    """Agreement of the best number of steps behind each power, that number, and the power."""
    best_settings = []
    parts = np.array_split(steps, 1 + steps.size * code.size // AT_ONCE)
    for power in powers:
        bent, slope = _bent(code, **{name: float(power)})
        agreement = np.concatenate([judge(_shifts(bent, slope, added, some)) for some in parts])
        best = int(np.argmax(agreement))
        best_settings.append((float(agreement[best]), float(steps[best]), float(power)))
    return best_settings


def _shifts(bent: Array, slope: Array, added: float, steps: Array) -> Array:
    """Shift of each code value by the rounding to so many steps, (k, m); in place, as many thousands are tried."""
    shift = bent * steps[:, np.newaxis]
    shift += added
    shift -= 0.5
    np.maximum(np.rint(shift, out=shift), 0.0, out=shift)
    shift /= steps[:, np.newaxis]
    shift -= bent
    shift /= slope
    return shift


def _bent(code: Array, *, table_gamma: float = 1.0, panel_gamma: float = 0.0) -> tuple[Array, Array]:
    """What is rounded, and its derivative by the code value, (m,) each."""
    if not panel_gamma:
        return code**table_gamma, table_gamma * code ** (table_gamma - 1.0)
    native, further = (np.maximum(code_to_linear(each), 0.0) ** (1.0 / panel_gamma) for each in (code, code + STEP))
    return native, (further - native) / STEP


@effect(
    stage="drive",
    neutral={"bits": 0.0},
    forms=(("bits",), ("bits", "table_gamma"), ("bits", "panel_gamma", "added")),
    propose=_proposed,
    confused_with={
        "eotf-drift": "neighbouring code values: a drift is smooth, steps are not",
        "meter-offset": "the same code again: noise changes, a step does not",
    },
    says="code values are rounded to {bits:.3g} bits",
    source="Kimpe & Tuytschaever 2007, doi:10.1007/s10278-006-1052-3 (depths)",
    bits=Parameter(
        8.0,
        (4.0, 12.0),
        "bit",
        "depth to which code values are rounded, log2 of their number; 0: not at all",
        (4, 5, 6, 7, 8, 9, 10, 11, 12),
    ),
    table_gamma=Parameter(1.0, (0.4, 2.5), "1", "power by which a table bends code values before", PROPOSED),
    panel_gamma=Parameter(0.0, (0.0, 2.6), "1", "gamma of the panel whose code is rounded; 0: none", PROPOSED),
    added=Parameter(0.5, (0.0, 0.5), "1", "part of a step added before truncation; ½ rounds", PROPOSED),
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
    steps, shift = round(2.0**bits - 1.0), added - 0.5
    if panel_gamma:
        native = np.maximum(code_to_linear(code), 0.0) ** (1.0 / panel_gamma)
        return linear_to_code((np.maximum(np.round(native * steps + shift), 0.0) / steps) ** panel_gamma)
    if table_gamma == 1.0:
        return np.asarray(np.maximum(np.round(code * steps + shift), 0.0) / steps)
    bent = np.round(np.maximum(code, 0.0) ** table_gamma * steps + shift)
    return np.asarray((np.maximum(bent, 0.0) / steps) ** (1.0 / table_gamma))
