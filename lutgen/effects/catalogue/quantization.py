"""Code values are rounded to n bits somewhere on their way: the curve has steps, the same at every hour.

d' = round(d·(2ⁿ − 1))/(2ⁿ − 1). Where a calibration table comes first, the rounding acts on d^g instead of d. Where the
panel's own code is rounded, the rounding acts on (light)^(1/γ), with γ the gamma of the panel. Hardware rounds by
adding a part of a step and truncating. A panel may use a part of its codes: ``bits`` is log2 of their number, whole or
not.

A cable, driver or mode with fewer bits may be installed later: a fit tries one date in every gap between two sessions.
A display's own model contains the rounding of the first session, so with this model the rounding begins after the first
session.

The forms: ``bits`` alone rounds d at every hour; with ``since`` from that hour on. With ``table_gamma`` d^g is rounded,
with ``panel_gamma`` and ``added`` the panel's own code.

Meaning of 0 and 1: ``bits`` 0 rounds nothing. ``bits`` 1 would leave only black and white, so the search begins at 4.
Valid for one rounding. Dithering in space or time blurs the steps.
Source: depths of medical displays, and the depth that a calibration to the greyscale standard needs: Kimpe &
Tuytschaever, J. Digit. Imaging 20, 422 (2007), doi:10.1007/s10278-006-1052-3. By rounding alone a calibration through 8
bits costs up to ±4 % of the luminance at d = 0.1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, code_to_linear, linear_to_code
from lutgen.effects.declare import PROPOSED, Parameter, effect
from lutgen.effects.scene import SOON_H, Scene

#: Numbers of steps to try after a table or a panel's gamma: all numbers up to 10 bits, and the numbers of 11 and 12
#: bits.
STEPS = np.array([*range(15, 1024), 2047, 4095], dtype=np.uint32)

#: Powers of a table to try, gammas of a panel to try, and the parts of a step that hardware adds. From one power to the
#: next a rounding to 10 bits moves by a tenth of a step at most.
TABLES, PANELS, ADDED = np.arange(0.5, 2.0, 0.0002), np.arange(1.8, 2.6, 0.0005), (0.5, 0.4, 0.25, 0.0)

#: One step, in the 32-bit integers that count parts of a step.
TURN = 2.0**32

#: Numbers of steps to try without a table, and the indices at which they are split: 6, 7, … bits. The search keeps the
#: best number of each part.
ALL_STEPS, PARTS = np.arange(15.0, 4096.0), 2 ** np.arange(6, 12) - 15 + 1

#: Number of neighbouring powers of which the search keeps the best; number of these best powers that the search
#: refines; offsets of the refining powers, in units of the spacing of the powers.
ALIKE, FEW, NEARBY = 20, 60, np.linspace(-1.0, 1.0, 17)

#: Step of a code value for a numerical derivative.
STEP = 1e-4


@dataclass(frozen=True)
class _ShiftEvidence:
    """Evidence of the readings on the shift of each code value (m,): gradient ``pull`` (m,), ``information`` (m, m)."""

    code: Array
    pull: Array
    information: Array

    @cached_property
    def light(self) -> Array:
        """Linear light of the code values, and of code values that are larger by ``STEP``, (2, m)."""
        return np.maximum(code_to_linear([self.code, self.code + STEP]), 0.0)

    @cached_property
    def alone(self) -> Array:
        """Information on each shift alone, (m,)."""
        return np.diag(self.information)

    def bent(self, *, table_gamma: float = 1.0, panel_gamma: float = 0.0) -> tuple[Array, Array]:
        """Return the quantity that is rounded, and its derivative by the code value, (m,) each."""
        if not panel_gamma:
            return self.code**table_gamma, table_gamma * self.code ** (table_gamma - 1.0)
        native, further = self.light ** (1.0 / panel_gamma)
        return native, (further - native) / STEP

    def gain(self, shifts: Array) -> Array:
        """Return the gain in χ², (k,), of k sets of shifts (k, m)."""
        return np.asarray(2.0 * shifts @ self.pull - ((shifts @ self.information) * shifts).sum(axis=1))

    def of_steps(self, bent: Array, slope: Array, added: float) -> NDArray[np.float32]:
        """Return the approximate gain of rounding to each of ``STEPS``, (s,); neglect covariances."""
        # 2³² is a whole step: a product of 32-bit integers wraps at 2³², and the remainder is the part of a step.
        turn = np.rint(bent * TURN).astype(np.uint64).astype(np.uint32)
        part = STEPS[:, np.newaxis] * turn
        part += np.uint32(added * TURN)
        shift = part.astype(np.float32)
        shift *= np.float32(-1.0 / TURN)
        shift += np.float32(added)
        along = shift @ (self.pull / slope).astype(np.float32)
        shift *= shift
        size = shift @ (self.alone / slope**2).astype(np.float32)
        return np.asarray(2.0 * along / STEPS - size / STEPS.astype(np.float32) ** 2)


def _proposed(code: Array, pull: Array, information: Array) -> tuple[list[dict[str, float]], int]:
    """Return settings of tables and panels whose shifts of code values fit the readings best, best first."""
    evidence = _ShiftEvidence(code, pull, information)
    proposals = []
    for part in np.split(ALL_STEPS, PARTS):
        gain, steps, _ = _best_steps(evidence, "table_gamma", 1.0, 0.5, part)
        proposals.append((gain, {"bits": float(np.log2(steps + 1.0)), "table_gamma": 1.0}))
    kinds = [("table_gamma", TABLES, 0.5), *(("panel_gamma", PANELS, added) for added in ADDED)]
    for name, powers, added in kinds:
        for power, steps in _promising(evidence, name, powers, added):
            near = power + (powers[1] - powers[0]) * NEARBY
            refined = [_best_steps(evidence, name, float(each), added, np.array([steps])) for each in near]
            gain, best, nearest = max(refined)
            setting = {"bits": float(np.log2(best + 1.0)), name: nearest}
            proposals.append((gain, setting if name == "table_gamma" else {**setting, "added": added}))
    tried = ALL_STEPS.size + sum(powers.size for _, powers, _ in kinds) * STEPS.size
    return [setting for _, setting in sorted(proposals, key=lambda each: -each[0])], tried


def _promising(evidence: _ShiftEvidence, name: str, powers: Array, added: float) -> list[tuple[float, float]]:
    """Return the powers and numbers of steps with the largest gains; of ``ALIKE`` neighbouring powers only the best."""
    results = []
    for power in powers:
        gain = evidence.of_steps(*evidence.bent(**{name: float(power)}), added)
        best = int(np.argmax(gain))
        results.append((float(gain[best]), float(power), float(STEPS[best])))
    neighbours = [max(results[start : start + ALIKE]) for start in range(0, len(results), ALIKE)]
    return [(power, steps) for _, power, steps in sorted(neighbours, reverse=True)[:FEW]]


def _best_steps(
    evidence: _ShiftEvidence, name: str, power: float, added: float, steps: Array
) -> tuple[float, float, float]:
    """Return the gain of the best number of steps after a power, that number, and the power."""
    bent, slope = evidence.bent(**{name: power})
    gain = evidence.gain(_shifts(bent, slope, added, steps))
    best = int(np.argmax(gain))
    return float(gain[best]), float(steps[best]), power


def _shifts(bent: Array, slope: Array, added: float, steps: Array) -> Array:
    """Return the shift of each code value by rounding to ``steps`` (k,), (k, m); compute in place, for speed."""
    shift = bent * steps[:, np.newaxis]
    shift += added
    shift -= 0.5
    np.maximum(np.rint(shift, out=shift), 0.0, out=shift)
    shift /= steps[:, np.newaxis]
    shift -= bent
    shift /= slope
    return shift


@effect(
    stage="drive",
    neutral={"bits": 0.0},
    forms=(("bits",), ("bits", "since"), ("bits", "table_gamma"), ("bits", "panel_gamma", "added")),
    refined=2,
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
        "depth to which code values are rounded, log2 of their number; 0: no rounding",
        (4, 5, 6, 7, 8, 9, 10, 11, 12),
    ),
    table_gamma=Parameter(
        1.0, (0.4, 2.5), "1", "power by which a table bends the code values before the rounding", PROPOSED
    ),
    panel_gamma=Parameter(0.0, (0.0, 2.6), "1", "gamma of the panel whose code is rounded; 0: no panel code", PROPOSED),
    added=Parameter(0.5, (0.0, 0.5), "1", "part of a step added before truncation; ½ rounds", PROPOSED),
    since=Parameter(0.0, (0.0, 100_000.0), "h", "hour from which codes are rounded", "gaps", beside_first=SOON_H),
)
def quantization(
    code: Array, scene: Scene, *, bits: float, table_gamma: float, panel_gamma: float, added: float, since: float
) -> Array:
    """Round the code values; 0 bits mean no rounding."""
    if bits < 1:
        return code
    rounded = _rounded(code, bits, table_gamma, panel_gamma, added)
    return rounded if since <= 0 else np.where(scene.hours >= since, rounded, code)


def _rounded(code: Array, bits: float, table_gamma: float, panel_gamma: float, added: float) -> Array:
    steps, shift = round(2.0**bits - 1.0), added - 0.5
    if panel_gamma:
        native = np.maximum(code_to_linear(code), 0.0) ** (1.0 / panel_gamma)
        return linear_to_code((np.maximum(np.round(native * steps + shift), 0.0) / steps) ** panel_gamma)
    if table_gamma == 1.0:
        return np.asarray(np.maximum(np.round(code * steps + shift), 0.0) / steps)
    bent = np.round(np.maximum(code, 0.0) ** table_gamma * steps + shift)
    return np.asarray((np.maximum(bent, 0.0) / steps) ** (1.0 / table_gamma))
