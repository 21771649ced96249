"""Each built-in effect follows its formula, and its free forms approximate formulas outside the catalogue."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

from lutgen.colorimetry import D65, code_to_linear, linear_to_code
from lutgen.display.trace import panel, reported
from lutgen.effects import Scene, catalogue, growth
from lutgen.effects.shapes import LEAST_EXPONENT, bent, level_curve
from lutgen.effects.spectra import CMFS
from tests.effect_scenes import TIPS, N, Term, at, one, scene_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

NAMES = tuple(catalogue())

# Literal twins: name, values, scene, input, and expected output, computed by hand or in plain Python.
LINEAR = (0.2, 0.5, 0.9)
HALF = 9000.0
#: exp(−0.4·τ^(2·bend)) at τ = ½ for bends of 2, 1 and ½.
GAINS = np.exp([[-0.4 / 16], [-0.4 / 4], [-0.4 / 2]])


def _faded(gains: list[float]) -> Array:
    """Tips whose primaries have these gains. White's light beyond the sum of its primaries has the mean gain."""
    red, green, blue = (gain * tip for gain, tip in zip(gains, TIPS[1:], strict=True))
    beside = TIPS[0] - TIPS[1] - TIPS[2] - TIPS[3]
    return np.array([[red + green + blue + beside * (sum(gains) / 3), red, green, blue]])


TWINS: tuple[tuple[str, Mapping[str, float], Scene, object, object], ...] = (
    ("eotf-drift", {"new": 0.1, "grown": 0.2}, at(HALF), [LINEAR], [[x**1.2 for x in LINEAR]]),
    ("eotf-drift", {"grown": 0.2, "power": 2.0}, at(HALF), [LINEAR], [[x**1.05 for x in LINEAR]]),
    (
        "eotf-drift",
        {"slope_new": 0.2},
        at(),
        [LINEAR],
        [[x ** (1 + 0.2 * (2 * float(linear_to_code(x)) - 1)) for x in LINEAR]],
    ),
    (
        "eotf-drift",
        {"slope_grown": 0.2},
        at(),
        [LINEAR],
        [[x ** (1 + 0.2 * (2 * float(linear_to_code(x)) - 1)) for x in LINEAR]],
    ),
    ("channel-gamma", {"green_new": 0.1, "green_grown": 0.1}, at(HALF), [LINEAR], [[0.2, 0.5**1.15, 0.9]]),
    (
        "channel-gamma",
        {"red_new": 0.1, "red_grown": 0.1, "blue_new": 0.2},
        at(HALF),
        [LINEAR],
        [[0.2**1.15, 0.5, 0.9**1.2]],
    ),
    ("drive-loss", {"new": 0.1, "grown": 0.2}, at(HALF), [LINEAR], [[0.16, 0.4, 0.72]]),
    ("drive-loss", {"grown": 0.2, "power": 2.0}, at(HALF), [LINEAR], [[0.19, 0.475, 0.855]]),
    ("drive-loss", {"blue": 0.1}, at(0.0), [LINEAR], [[0.2, 0.5, 0.81]]),
    (
        "crosstalk",
        {"new": 0.02, "grown": 0.02},
        at(),
        [LINEAR],
        [[0.2 * (1 - 0.04 * 1.4), 0.5 * (1 - 0.04 * 1.1), 0.9 * (1 - 0.04 * 0.7)]],
    ),
    (
        "crosstalk",
        {"red_by_green": 0.1, "red_by_blue": 0.2, "blue_by_red": 0.05, "green_by_blue": 0.01},
        at(),
        [LINEAR],
        [[0.2 * (1 - 0.05 - 0.18), 0.5 * (1 - 0.009), 0.9 * (1 - 0.01)]],
    ),
    ("crosstalk", {"both": 0.1}, at(), [LINEAR], [[0.2 * (1 - 0.045), 0.5 * (1 - 0.018), 0.9 * (1 - 0.01)]]),
    ("loading", {"new": 0.1}, at(code=(0.3, 0.6, 0.9)), [LINEAR], [[x * (1 - 0.06) for x in LINEAR]]),
    (
        "loading",
        {"new": 0.1, "grown": 0.2, "power": 2.0},
        at(HALF, code=(0.3, 0.6, 0.9)),
        [LINEAR],
        [[x * (1 - 0.15 * 0.6) for x in LINEAR]],
    ),
    (
        "loading",
        {"new": 0.1, "bend": 2.0},
        at(code=(1, 1, 1), window=0.1, surround=0.5),
        [LINEAR],
        [[x * (1 - 0.1 * 0.55**2) for x in LINEAR]],
    ),
    ("quantization", {"bits": 4}, at(), [[0.0, 0.5, 1.0]], [[0.0, 8 / 15, 1.0]]),
    ("quantization", {"bits": np.log2(12)}, at(), [[0.0, 0.5, 1.0]], [[0.0, 6 / 11, 1.0]]),
    ("quantization", {"bits": 4, "table_gamma": 2.2}, at(), [[0.0, 0.5, 1.0]], [[0.0, (3 / 15) ** (1 / 2.2), 1.0]]),
    ("recalibration", {"hour": 9000, "gamma": 0.2}, at(HALF), [LINEAR], [[x**1.2 for x in LINEAR]]),
    ("recalibration", {"hour": 9000, "gamma": 0.2, "gain": 0.1}, at(8999.0), [LINEAR], [LINEAR]),
    ("recalibration", {"hour": 9000, "gain": 0.2}, at(), [[0.2, 0.85, 1.0]], [[0.24, 1.0, 1.0]]),
    ("recalibration", {"hour": 9000, "gain": -0.2}, at(), [[0.2, 0.85, 1.0]], [[0.16, 0.68, 0.8]]),
    ("recalibration", {"hour": 9000, "red": 0.2, "gain": 0.1}, at(), [LINEAR], [[1.1 * 0.2**1.2, 0.55, 0.99]]),
    ("edge-falloff", {"new": 0.1, "grown": 0.1}, at(HALF, u=0.0, v=0.0), [[100.0] * 3], [[85.0] * 3]),
    ("edge-falloff", {"new": 0.2}, at(u=1.0, v=0.5), [[100.0] * 3], [[90.0] * 3]),
    # |u|⁴ + |v|⁴ instead of ρ²
    (
        "edge-falloff",
        {"new": 0.2, "exponent": 4, "contour": 4},
        at(u=0.75, v=1.0),
        [[100.0] * 3],
        [[100 * (1 - 0.2 * (0.5**4 + 1) / 2)] * 3],
    ),
    ("edge-falloff", {"new": 0.2, "slope_u": 1.0, "tint_z": 0.5}, at(u=0.0), [[10.0] * 3], [[11.0, 11.0, 11.5]]),
    (
        "black-level",
        {"new": 0.001, "grown": 0.001, "tint_z": 0.2},
        at(),
        [[0.0] * 3],
        [TIPS[0] * 0.002 * [1, 1, 1.2]],
    ),
    ("ambient-reflection", {"reflectance": 0.02}, at(ambient_lx=50.0), [[0.0] * 3], [D65]),
    (
        "ambient-reflection",
        {"reflectance": 0.02, "tint_x": 0.1},
        at(ambient_lx=50.0),
        [[1.0] * 3],
        [1 + D65 * [1.1, 1, 1]],
    ),
    (
        "veiling-glare",
        {"glare": 0.01},
        at(window=0.1, surround=1.0),
        [[10.0] * 3],
        [10 + 0.01 * (0.1 * 10 + 0.9 * TIPS[0])],
    ),
    ("meter-offset", {"offset": 0.01, "offset_z": 0.02}, at(), [[1.0] * 3], [1 + 0.01 * D65 + [0, 0, 0.02]]),
    ("meter-offset", {"offset": 0.01, "grown": 1.0}, at(HALF), [[1.0] * 3], [1 + 0.015 * D65]),
    ("meter-offset", {"offset": 0.01, "per_kelvin": 0.1}, at(temperature_c=35.0), [[1.0] * 3], [1 + 0.01 * np.e * D65]),
    ("meter-drift", {"drift": 0.02, "drift_x": 0.01}, at(HALF), [[1.0] * 3], [[1.015, 1.01, 1.01]]),
    ("warm-up", {"amount": 0.1, "minutes": 30}, at(warmup_min=30.0), TIPS[None], TIPS[None] * (1 - 0.1 / np.e)),
    # 1/(1 + m/τ_w) instead of the exponential
    ("warm-up", {"amount": 0.1, "minutes": 30, "tail": 1}, at(warmup_min=60.0), TIPS[None], TIPS[None] * (1 - 0.1 / 3)),
    ("warm-up", {"amount": 0.1, "tail": 1}, at(warmup_min=np.inf), TIPS[None], TIPS[None]),
    ("temperature", {"slope": -0.003}, at(temperature_c=35.0), TIPS[None], TIPS[None] * 0.97),
    (
        "temperature",
        dict.fromkeys(("red", "green", "blue"), -0.003),
        at(temperature_c=35.0),
        TIPS[None],
        TIPS[None] * 0.97,
    ),
    (
        "temperature-gamma",
        {"slope": 0.01, "red": 0.01, "blue": -0.02},
        at(temperature_c=35.0),
        [LINEAR],
        [[0.2**1.2, 0.5**1.1, 0.9**0.9]],
    ),
    ("temperature-gamma", {"slope": 0.01}, at(temperature_c=25.0), [LINEAR], [LINEAR]),
    (
        "temperature-gamma",
        {"slope": 0.01, "tilt": 0.02},
        at(temperature_c=35.0),
        [[code_to_linear(0.25), code_to_linear(0.5), 1.0]],
        [[code_to_linear(0.25), code_to_linear(0.5) ** 1.1, 1.0]],
    ),
    (
        "dynamic-contrast",
        {"depth": 0.4, "exponent": 2.0},
        at(code=(0.2, 0.4, 0.6), window=0.5, surround=0.0),
        TIPS[None],
        TIPS[None] * (1 - 0.4 * 0.8**2) / (1 - 0.4 * 0.6**2),
    ),
    (
        "dynamic-contrast",
        {"depth": 0.4, "held": 0.0, "average": 2.0},
        at(code=(0.2, 0.4, 0.6), window=0.5, surround=1.0),
        TIPS[None],
        TIPS[None] * (1 - 0.4 * (1 - 0.5 * 0.56 / 3 - 0.5)),
    ),
    (
        "dynamic-contrast",
        {"depth": 0.4, "held": 0.0, "brightest": 0.75},
        at(code=(0.2, 0.4, 0.6), window=0.5, surround=1.0),
        TIPS[None],
        TIPS[None] * (1 - 0.4 * (1 - 0.5 * (0.25 * 0.4 + 0.75 * 0.6) - 0.5)),
    ),
    (
        "dynamic-contrast",  # the weights of luma in sRGB: 0.2126, 0.7152, 0.0722
        {"depth": 0.4, "held": 0.0, "weight_red": 0.2126 / 0.7152 - 1, "weight_blue": 0.0722 / 0.7152 - 1},
        at(code=(0.2, 0.4, 0.6)),
        TIPS[None],
        TIPS[None] * (1 - 0.4 * (1 - 0.2126 * 0.2 - 0.7152 * 0.4 - 0.0722 * 0.6)),
    ),
    ("dynamic-contrast", {"depth": 0.4}, at(code=(0, 0, 0), window=0.1, surround=1.0), TIPS[None], TIPS[None] * 1.6),
    ("dynamic-contrast", {"depth": 0.4}, at(code=(0.3, 0.3, 0.3)), TIPS[None], TIPS[None]),
    ("backlight-decay", {"loss": 0.5}, at(HALF), TIPS[None], TIPS[None] * np.exp(-0.25)),
    (
        "backlight-decay",
        {"rise": 0.03, "rise_h": 1000.0},
        at(1000.0),
        TIPS[None],
        TIPS[None] * (1 + 0.03 * (1 - 1 / np.e)),
    ),
    # 1/(1 + ℓ τ^β), log-logistic; (1 + 2 ℓ τ)^(−1/2)
    ("backlight-decay", {"loss": 0.8, "beta": 2, "tail": 1}, at(HALF), TIPS[None], TIPS[None] / 1.2),
    ("backlight-decay", {"loss": 1.5, "tail": 2}, at(), TIPS[None], TIPS[None] / 2),
    (
        "burn-in-decay",
        {"share": 0.1, "early_h": 500.0, "loss": 0.5, "beta": 2.0},
        at(1000.0),
        TIPS[None],
        TIPS[None] * (0.1 * np.exp(-4) + 0.9 * np.exp(-0.5 / 18)),
    ),
    (
        "burn-in-decay",
        {"share": 0.1, "early_h": 500.0, "red": -0.05, "blue": 0.2},
        at(500.0),
        TIPS[None],
        _faded([1 - 0.05 * (1 - 1 / np.e), 1 - 0.1 * (1 - 1 / np.e), 1 - 0.3 * (1 - 1 / np.e)]),
    ),
    (
        "burn-in-decay",
        {"share": 0.1, "early_h": 18_000.0, "loss": 0.5, "red": 0.2},
        at(HALF),
        TIPS[None],
        _faded([share * np.exp(-0.5) + (1 - share) * np.exp(-0.25) for share in (0.3, 0.1, 0.1)]),
    ),
    ("channel-decay", dict.fromkeys(("red", "green", "blue"), 0.3), at(HALF), TIPS[None], TIPS[None] * np.exp(-0.15)),
    ("stabilizer-headroom", {"headroom": 0.5, "loss": 0.4}, at(HALF), TIPS[None], TIPS[None]),
    ("stabilizer-headroom", {"headroom": 0.5, "loss": 2.0}, at(), TIPS[None], TIPS[None] * 1.5 * np.exp(-2.0)),
    # The parameters of the refined forms.
    (
        "stabilizer-headroom",
        {"headroom": 0.5, "loss": 2.0, "beta": 2.0, "knee": 0.1},
        at(HALF),
        TIPS[None],
        TIPS[None] * ((1 + 1.5**-10) / (1 + np.exp(5.0) * 1.5**-10)) ** 0.1,
    ),
    ("backlight-decay", {"loss": 0.8, "beta": 2.0}, at(HALF), TIPS[None], TIPS[None] * np.exp(-0.2)),
    ("meter-drift", {"drift": 0.02, "drift_z": -0.01, "power": 2.0}, at(HALF), [[1.0] * 3], [[1.005, 1.005, 1.0025]]),
    ("meter-offset", {"offset_x": 0.03}, at(), [[1.0] * 3], [[1.03, 1.0, 1.0]]),
    (
        "ambient-reflection",
        {"reflectance": 0.02, "exponent": 2.0, "tint_z": -0.5},
        at(ambient_lx=50.0),
        [[1.0] * 3],
        [1 + 0.02 * 25.0 * D65 * [1, 1, 0.5]],
    ),
    (
        "veiling-glare",
        {"glare": 0.01, "grown": 0.02, "power": 2.0, "reach": 2.0, "tint_x": 0.5, "tint_z": -0.5},
        at(HALF, window=0.5, surround=1.0),
        [[10.0] * 3],
        [10 + 0.015 * (0.25 * 10 + 0.75 * TIPS[0]) * [1.5, 1, 0.5]],
    ),
    (
        "warm-up",
        {"amount": 0.1, "grown": 0.2, "minutes": 30, "stretch": 2.0, "tint_x": 1.0, "tint_z": -1.0},
        at(HALF, warmup_min=45.0),
        TIPS[None],
        TIPS[None] * (1 - 0.2 * np.exp(-2.25) * np.array([2.0, 1.0, 0.0])),
    ),
    # (1 + q·m/τ_w)^(−1/q)
    (
        "warm-up",
        {"amount": 0.1, "minutes": 30, "tail": 2},
        at(warmup_min=120.0),
        TIPS[None],
        TIPS[None] * (1 - 0.1 / 3),
    ),
    (
        "temperature",
        {"slope": -0.003, "curve": 1e-4, "tint_x": 1.0, "tint_z": -1.0},
        at(temperature_c=35.0),
        TIPS[None],
        TIPS[None] * [1 - 0.04, 1 - 0.02, 1.0],
    ),
    (
        "edge-falloff",
        {"new": 0.2, "slope_v": 0.5, "tint_x": 0.5, "exponent": 2, "contour": 2},
        at(u=0.5, v=1.0),
        [[10.0] * 3],
        [[10 * (1 - 0.2 * 1.5), 10 * (1 - 0.2), 10 * (1 - 0.2)]],
    ),
    # (1.5·|2u − 1|² + 0.5·|2v − 1|²)/2 instead of ρ²
    ("edge-falloff", {"new": 0.2, "stretch": 0.5}, at(u=1.0, v=0.5), [[10.0] * 3], [[10 * (1 - 0.2 * 0.75)] * 3]),
    (
        "black-level",
        {"grown": 0.004, "power": 2.0, "tint_x": -0.2},
        at(HALF),
        [[0.0] * 3],
        [TIPS[0] * 0.001 * [0.8, 1, 1]],
    ),
    # (1 − e^(−s·τ^p))/(1 − e^(−s))
    (
        "black-level",
        {"grown": 0.004, "saturation": 3.0},
        at(HALF),
        [[0.0] * 3],
        [TIPS[0] * 0.004 * (1 - np.exp(-1.5)) / (1 - np.exp(-3.0))],
    ),
    ("drive-loss", {"new": 0.1, "lean": 0.5}, at(), [LINEAR], [[x * (1 - 0.1 * (1 + 0.5 * x)) for x in LINEAR]]),
    ("drive-loss", {"red": 0.1, "green": 0.2, "onset": 0.5}, at(HALF), [LINEAR], [[0.185, 0.425, 0.9]]),
    (
        "crosstalk",
        {"new": 0.1, "exponent": 2.0},
        at(),
        [LINEAR],
        [[0.2 * (1 - 0.106), 0.5 * (1 - 0.085), 0.9 * (1 - 0.029)]],
    ),
    (
        "loading",
        {"new": 0.1, "exponent": 2.0, "weight_red": 1.0, "weight_blue": 3.0},
        at(code=(1.0, 0.0, 0.5), window=0.5, surround=0.6),
        TIPS[None],
        # Weights 2:1:4 of squared code values, for half of the screen
        TIPS[None] * (1 - 0.1 * (0.5 * 3 / 7 + 0.5 * 0.36)),
    ),
    (
        "quantization",
        {"bits": 4, "panel_gamma": 2.0, "added": 0.0},
        at(),
        [[0.0, 0.5, 1.0]],
        # Code 0.5 gives light 0.21404. The root of this light times 15 is 6.94, truncated to 6.
        [[0.0, float(linear_to_code((6 / 15) ** 2)), float(linear_to_code((14 / 15) ** 2))]],
    ),
    ("recalibration", {"hour": 9000, "green": 0.2, "blue": -0.1}, at(), [LINEAR], [[0.2, 0.5**1.2, 0.9**0.9]]),
    # The same Γ at all levels
    (
        "recalibration",
        {"hour": 9000, **dict.fromkeys(("level_00", "level_25", "level_50", "level_75", "level_100"), 0.2)},
        at(),
        [LINEAR],
        [[x**1.2 for x in LINEAR]],
    ),
    (
        "channel-gamma",
        {**dict.fromkeys(("red_00", "red_25", "red_50", "red_75", "red_100"), 0.2), "onset": 0.5},
        at(HALF),
        [LINEAR],
        [[0.2**1.15, 0.5, 0.9]],
    ),
    ("channel-gamma", {"blue_grown": 0.2, "power": 2.0}, at(HALF), [LINEAR], [[0.2, 0.5, 0.9**1.05]]),
    (
        "channel-decay",
        {"green": 0.4, "red": 0.4, "blue": 0.4, "red_bend": 2.0, "blue_bend": 0.5, "power": 2.0},
        at(HALF),
        [[TIPS[1:].sum(axis=0), *TIPS[1:]]],  # white is the sum of its primaries
        [[(TIPS[1:] * GAINS).sum(axis=0), *(TIPS[1:] * GAINS)]],
    ),
)


@pytest.mark.parametrize(("name", "values", "scene", "given", "wanted"), TWINS)
def test_an_effect_does_what_its_formula_says(
    name: str, values: Mapping[str, float], scene: Scene, given: object, wanted: object
) -> None:
    light = one(name, given, scene, **values)
    np.testing.assert_allclose(light, np.broadcast_to(np.asarray(wanted), light.shape), rtol=1e-9, atol=1e-12)


def test_every_effect_has_a_literal_twin_or_a_test_of_its_own() -> None:
    own = {
        "primary-shift",
        "matrix-switching",
        "yellowing",
        "phosphor-wear",
        "meter-mismatch",
    }  # tested below and in test_spectra
    assert {name for name, *_ in TWINS} | own == set(NAMES)


@pytest.mark.parametrize(("hours", "left"), [(0, 1.0), (10_000, 0.67), (18_000, 0.40)])
def test_the_decay_meets_the_papers_luminances(hours: float, left: float) -> None:
    """β = 1.41 and T = 19 150 h give 67 % at 10 000 h and 40 % at 18 000 h."""
    loss = (18_000 / 19_150) ** 1.41
    light = one("backlight-decay", TIPS[None], at(hours), loss=loss, beta=1.41)
    np.testing.assert_allclose(light, TIPS[None] * left, rtol=0.003)


def test_a_primary_shifts_with_its_own_level_only() -> None:
    code = (0.25, 1.0, 0.0)
    light = one(
        "primary-shift", TIPS[None], at(code=code), red_x=0.02, green_z=0.05, blue_x=0.01, blue_z=0.04, level=2.0
    )
    shifts = np.zeros((3, 3))
    shifts[0, 0] = 0.75**2 * 0.02 * TIPS[1].sum()
    shifts[2] = TIPS[3].sum() * np.array([0.01, 0.0, 0.04])
    np.testing.assert_allclose(light[0, 1:], TIPS[1:] + shifts, rtol=1e-12)
    np.testing.assert_allclose(light[0, 0], TIPS[0] + shifts.sum(axis=0), rtol=1e-12)


def test_a_primary_may_shift_by_the_light_of_its_drive() -> None:
    """(1 − d^b)^e at d = ½, b = 2, e = 1, with half of the shift at hour 0."""
    light = one("primary-shift", TIPS[None], at(HALF, code=(0.5, 1, 1)), red_x=0.04, bend=2.0, onset=0.5, power=2.0)
    shift = 0.75 * (0.5 + 0.5 / 4) * 0.04 * TIPS[1].sum() * np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(light[0], np.add(TIPS, [shift, shift, [0.0] * 3, [0.0] * 3]), rtol=1e-12)


def test_yellowing_absorbs_by_wavelength() -> None:
    """XYZ of a primary behind exp(−a·τ²·e^(−(λ − 400 nm)/λ₀)), as a sum over its spectrum."""
    scene = at(HALF)
    assert scene.light is not None
    nm = np.arange(380, 781, 5)
    passed = np.exp(-0.8 * 0.25 * np.exp(-(nm - 400) / 50))
    wanted = scene.light.spectra * passed @ CMFS
    light = [one("yellowing", tip[None], scene, depth=0.8, power=2.0, reach=50.0)[0] for tip in TIPS[1:]]
    np.testing.assert_allclose(light, wanted, rtol=1e-9)


def test_worn_phosphors_keep_a_share_of_their_light() -> None:
    scene = at(HALF)
    assert scene.light is not None
    first, second, third = scene.light.parts.values()
    share = 1 - first * (1 - np.exp(-0.8 * 0.25)) - second * (1 - np.exp(-0.4 * 0.25)) - third * (1 - np.exp(-0.05))
    wanted = scene.light.spectra * share @ CMFS
    light = one("phosphor-wear", TIPS[None], scene, wear=0.8, second=0.4, third=0.2, power=2.0)
    np.testing.assert_allclose(light[0, 1:], wanted, rtol=1e-9)


def test_filters_that_have_moved_read_every_colour_through_one_matrix() -> None:
    """ȳ and the other curves at λ − 0.5 nm, interpolated in the table by a parabola through three points."""
    scene = at(HALF)
    assert scene.light is not None
    step = 0.5 / 5.0
    before, after = (np.roll(CMFS, by, axis=0) for by in (1, -1))
    moved = CMFS + 0.5 * step * (before - after) + 0.5 * step**2 * (before + after - 2.0 * CMFS)
    tips = scene.light.spectra @ moved
    light = one("meter-mismatch", TIPS[1:], scene, shift=1.0)
    np.testing.assert_allclose(light / tips, 1.0, rtol=0, atol=1e-3)
    assert (light[0, 1] / TIPS[1, 1] > 1.01, light[2, 1] / TIPS[3, 1] < 0.99) == (True, True)
    np.testing.assert_allclose(
        one("meter-mismatch", TIPS[1:].sum(axis=0)[None], scene, shift=1.0)[0], light.sum(axis=0), rtol=1e-12
    )


def test_at_full_drive_primaries_are_the_tips() -> None:
    light = one("primary-shift", TIPS[None], at(code=(1, 1, 1)), red_x=0.02, green_z=0.05, blue_x=0.01, blue_z=0.04)
    np.testing.assert_array_equal(light, TIPS[None])


def test_unequal_channels_keep_what_white_has_beside_them() -> None:
    light = one("channel-decay", TIPS[None], at(), red=0.1, blue=0.7)[0]
    gain = np.exp([-0.1, 0.0, -0.7])
    np.testing.assert_allclose(light[1:], TIPS[1:] * gain[:, None], rtol=1e-12)
    beside = TIPS[0] - TIPS[1:].sum(axis=0)
    np.testing.assert_allclose(light[0] - light[1:].sum(axis=0), beside * gain.mean(), rtol=1e-9)


def test_matrix_switching_switches_the_selection() -> None:
    scene = scene_of()
    tips = np.broadcast_to(TIPS, (N, 4, 3))
    applied = [Term(catalogue()["matrix-switching"])]
    light = reported(applied, panel(applied, scene, "nearest"), tips, scene)
    np.testing.assert_array_equal(light, reported([], panel([], scene, "continuous"), tips, scene))
    assert (light != reported([], panel([], scene, "nearest"), tips, scene)).any()


def test_a_soft_switching_takes_the_power_mean_for_the_smallest_channel() -> None:
    linear = [[0.5, 0.25, 1.0], [0.2, 0.2, 0.2], [0.5, 0.0, 1.0]]
    harmonic = [3 / (2 + 4 + 1), 0.2, 0.0]
    signal = one("matrix-switching", linear, at(), softness=1.0)
    np.testing.assert_allclose(signal, np.repeat(harmonic, 3).reshape(3, 3), rtol=1e-12)
    power_mean = (np.array(linear[0]) ** -0.5).mean() ** -2
    np.testing.assert_allclose(one("matrix-switching", linear, at(), softness=2.0)[0], power_mean)
    np.testing.assert_allclose(one("matrix-switching", linear, at(), softness=1e-3)[:, 0], [0.25, 0.2, 0], rtol=2e-3)
    # In the chain: Σ l P + D·mean, where D is white's light beyond the sum of its primaries.
    scene = at(code=(0.8, 0.6, 0.9))
    applied = [Term(catalogue()["matrix-switching"], softness=1.0)]
    light = code_to_linear(np.array([0.8, 0.6, 0.9]))
    beside = TIPS[0] - TIPS[1:].sum(axis=0)
    wanted = light @ TIPS[1:] + beside * 3.0 / (1.0 / light).sum()
    signal = reported(applied, panel(applied, scene, "nearest"), TIPS[None], scene)
    np.testing.assert_allclose(signal[0], wanted, rtol=1e-12)


def test_loading_and_crosstalk_part_in_a_window() -> None:
    full, window = at(code=(1, 1, 1)), at(code=(1, 1, 1), window=0.1)
    white = [[1.0, 1.0, 1.0]]
    assert (one("crosstalk", white, full, new=0.02) == one("crosstalk", white, window, new=0.02)).all()
    assert (one("loading", white, full, new=0.02) < one("loading", white, window, new=0.02)).all()


def test_the_meters_offset_stays_with_the_lens_capped() -> None:
    applied = [Term(catalogue()["meter-offset"], offset=0.01), Term(catalogue()["black-level"], new=0.01)]
    scene = at(capped=1.0)
    light = reported(applied, panel(applied, scene, "nearest"), TIPS[None], scene)
    np.testing.assert_allclose(light, [0.01 * D65], rtol=1e-12)


@pytest.mark.parametrize(
    "knots", [(0.1, 0.1, 0.1, 0.1, 0.1), (-0.2, -0.1, 0.0, 0.1, 0.2), (0.3, -0.1, 0.05, 0.2, -0.4)]
)
def test_the_level_curve_is_a_cubic_spline(knots: tuple[float, ...]) -> None:
    code = np.linspace(0, 1, 101)
    padded = [2 * knots[0] - knots[1], *knots, 2 * knots[-1] - knots[-2]]
    spline = BSpline(np.arange(-3, 8) * 0.25, padded, 3)
    np.testing.assert_allclose(level_curve(code, knots), spline(code), atol=1e-14)


def test_free_levels_contain_the_plain_gamma_and_the_slope() -> None:
    scene = scene_of()
    linear = np.random.default_rng(0).uniform(size=(N, 3))
    levels = [f"level_{code}" for code in ("00", "25", "50", "75", "100")]
    plain = one("eotf-drift", linear, scene, grown=0.1, slope_grown=0.04)
    free = one("eotf-drift", linear, scene, **dict(zip(levels, np.linspace(0.06, 0.14, 5), strict=True)))
    np.testing.assert_allclose(free, plain, rtol=1e-12)


def test_light_is_bent_but_never_below_the_least_exponent() -> None:
    np.testing.assert_allclose(bent(np.array([0.0, 0.5, 1.0]), np.array(-3.0)), [0.0, 0.5**LEAST_EXPONENT, 1.0])


def test_growth_contains_powers_and_s_curves() -> None:
    tau = np.linspace(0, 1, 11)
    np.testing.assert_allclose(growth(tau, new=0.1, grown=0.2, power=1.3), 0.1 + 0.2 * tau**1.3)
    exponential = growth(tau, new=0.0, grown=1.0, power=1.0, saturation=3.0)
    np.testing.assert_allclose(exponential, (1 - np.exp(-3 * tau)) / (1 - np.exp(-3)), rtol=1e-12)
    tiny = growth(tau, new=0.0, grown=1.0, power=1.3, saturation=1e-9)
    np.testing.assert_allclose(tiny, tau**1.3, rtol=1e-8)


@pytest.mark.parametrize("steepness", [6.0, 9.0, 12.0])
@pytest.mark.parametrize("middle", [0.3, 0.5, 0.7])
def test_growth_comes_near_logistic_curves(steepness: float, middle: float) -> None:
    tau = np.linspace(0, 1, 21)
    raw = 1 / (1 + np.exp(-steepness * (tau - middle)))
    wanted = (raw - raw[0]) / (raw[-1] - raw[0])
    start, bounds = (0.0, 1.0, 2.0, 3.0), ([-1, -3, 0.3, 0], [2, 3, 6, 20])

    def missed(values: Array) -> Array:
        new, grown, power, saturation = values
        return np.asarray(growth(tau, new=new, grown=grown, power=power, saturation=saturation) - wanted)

    assert np.sqrt((least_squares(missed, start, bounds=bounds).fun ** 2).mean()) < 0.01


# Forms outside the catalogue, and the largest permitted error of the catalogue's freest form: (name, formula, limit).
HIDDEN: tuple[tuple[str, Callable[[Array, float], Array], float], ...] = (
    ("a symmetric S in linear light", lambda light, size: light + size * light * (1 - light) * (2 * light - 1), 5e-4),
    (
        "a bump in code values",
        lambda light, size: light * np.exp(size * np.sin(np.pi * linear_to_code(light)) ** 2),
        1e-3,
    ),
    ("an offset gamma", lambda light, size: ((light**0.5 + size / 4) / (1 + size / 4)) ** 2 * (light > 0), 3e-3),
)


@pytest.mark.parametrize(("hidden", "limit"), [each[1:] for each in HIDDEN], ids=[each[0] for each in HIDDEN])
def test_free_levels_come_near_other_curves(hidden: Callable[[Array, float], Array], limit: float) -> None:
    code = np.linspace(0.1, 1, 40)
    light_there = np.interp(code, linear_to_code(np.linspace(0, 1, 5001)), np.linspace(0, 1, 5001))
    wanted = hidden(light_there, 0.1)

    def missed(knots: Array) -> Array:
        return bent(light_there, level_curve(code, knots)) - wanted

    solution = least_squares(missed, np.zeros(5))
    assert np.abs(solution.fun).max() < limit
    assert np.abs(solution.fun).max() < 0.2 * np.abs(missed(np.zeros(5))).max()
