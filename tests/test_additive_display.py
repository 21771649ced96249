"""Verdicts on a simulated display of plain formulas, which adds its channels: cases that an outside generator showed.

Light of code d at hour t: fade(t) · (Σ curve(d, t) · (channel + (1 − d) · shift) + leak · white), read with noise.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.fit.anchored import anchored
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_columns import shared_columns
from lutgen.effects import catalogue
from lutgen.report.diagnosis import diagnose_page
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.test_native import bright_mixtures
from tests.test_own_display import campaign as own_campaign

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.readings import Measurements

pytestmark = pytest.mark.numbers

#: XYZ in cd/m² of red, green and blue: primaries of IEC 61966-2-1 at 200 cd/m² of white.
CHANNELS = np.array([[82.48, 42.53, 3.87], [71.52, 143.03, 23.84], [36.09, 14.44, 190.06]])
NO_SHIFT = np.zeros((3, 3))
TIPS = [(1.0, 1.0, 1.0)] * 3 + [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)] * 2
NINE = np.linspace(0.1, 0.9, 9)
HOURS = (0.0, 3000.0, 6000.0, 9000.0, 12_000.0, 15_000.0)


def srgb(code: Array, _hours: float) -> Array:
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def ramps(levels: Array) -> list[tuple[float, ...]]:
    return [tuple(level * np.eye(3)[channel]) for channel in range(3) for level in levels]


def campaign(
    curve: Callable[[Array, float], Array] = srgb,
    *,
    fade: Callable[[float], float] = lambda _hours: 1.0,
    leak: float = 0.0,
    shifts: Array = NO_SHIFT,
    levels: Array = NINE,
    ramp_levels: Array = NINE,
    hours: tuple[float, ...] = HOURS,
    seed: int = 2,
    noise: float = 0.001,
    offset_cd_m2: float = 0.0,
    luminance: str = "# luminance: free\n",
) -> Measurements:
    """Return readings of white, primaries, black, greys, ramps and mixtures in every session."""
    rng = np.random.default_rng(seed)
    mixtures = rng.uniform(0.05, 1.0, (14, 3)).round(3)
    codes = np.array([*TIPS, *[(0.0,) * 3] * 2, *[(each,) * 3 for each in levels], *ramps(ramp_levels), *mixtures])
    rows = []
    for hour in hours:
        channels = curve(codes, hour)
        shifted = channels @ CHANNELS + (channels * (1.0 - codes)) @ shifts
        light = fade(hour) * (shifted + leak * CHANNELS.sum(axis=0))
        seen = light * (1 + noise * rng.standard_normal(light.shape)) + 3.0 * noise * rng.standard_normal(light.shape)
        seen += offset_cd_m2 * rng.standard_normal(3)
        rows += [",".join(f"{x:.7g}" for x in (hour, *code, *xyz)) for code, xyz in zip(codes, seen, strict=True)]
    text = "# display: white LED LCD\n# source: SIMULATED, not measured\n" + luminance + "hour,R,G,B,X,Y,Z\n"
    return read(text + "\n".join(rows) + "\n", file="additive.csv", sha256="")


@pytest.mark.slow
def test_black_fades_with_the_backlight_that_leaks() -> None:
    diagnosis = diagnose(campaign(fade=lambda hour: 1.0 - 0.7 * hour / 18_000.0, leak=0.002), baseline="first-hour")
    assert {*diagnosis.verdict.effects} >= {"backlight-decay", "black-level"}
    (leak,) = [step for step in diagnosis.explanation.steps if step.name == "black-level"]
    assert leak.chosen.term.values["new"] == pytest.approx(0.002, rel=0.02)
    assert abs(leak.chosen.term.values["grown"]) < 1e-4


def test_the_sentence_says_what_is_left_of_white() -> None:
    fade = lambda hour: float(np.exp(-0.9 * hour / 18_000.0))  # noqa: E731
    sentence = diagnose(campaign(fade=fade, hours=HOURS[::5]), baseline="first-hour").verdict.sentence
    assert "the light source fades, so that white keeps 47 % of its light by 15\N{NO-BREAK SPACE}000 h" in sentence


def bent(change: float, code: Array, hours: float) -> Array:
    return srgb(code, hours) ** (1.0 + change * hours / 18_000.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("beside", "leak", "change"),
    [("black-level", 0.0015, 0.0), ("eotf-drift", 0.0, 0.06)],
)
def test_a_fade_beside_another_effect_is_named(beside: str, leak: float, change: float) -> None:
    """A sensor holds the light until a quarter of the reserve is gone; the form of this law contains other laws."""
    fade = lambda hour: min(1.0, 1.25 * (1.0 - 0.9 * hour / 18_000.0))  # noqa: E731
    diagnosis = diagnose(campaign(partial(bent, change), fade=fade, leak=leak), baseline="first-hour")
    assert diagnosis.verdict.name == "several"
    assert {*diagnosis.verdict.effects} == {"stabilizer-headroom", beside}


@pytest.mark.parametrize("luminance", ["", "# luminance: held\n"])
def test_a_drift_of_the_meter_states_the_assumption_that_a_sensor_holds_the_luminance(luminance: str) -> None:
    readings = campaign(fade=lambda hour: 1.0 - 0.03 * hour / 18_000.0, luminance=luminance)
    verdict = diagnose(readings, baseline="first-hour").verdict
    assert verdict.effects == ("meter-drift",)
    assert ("add a line # luminance: free to the file: the cause may then be backlight-decay" in verdict.sentence) is (
        not luminance
    )


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "gamma"), [(1, 2.2), (4, 2.2), (1, 2.5), (4, 2.5)])
def test_an_interpolation_between_few_levels_is_no_effect(gamma: float, seed: int) -> None:
    """A power of the code between seven greys and four levels of each ramp, read in twelve sessions."""
    greys, few = np.array([0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9]), np.array([0.2, 0.4, 0.6, 0.8])
    hours = tuple(np.linspace(0.0, 15_000.0, 12).tolist())
    readings = campaign(
        lambda code, _hours: code**gamma, levels=greys, ramp_levels=few, hours=hours, seed=seed, noise=0.0007
    )
    assert diagnose(readings, baseline="native").verdict.name == "consistent"


@pytest.mark.parametrize("seed", [2, 6])
def test_a_zero_of_the_meter_below_black_is_no_effect(seed: int) -> None:
    """Black has no light, and the meter's zero of the first session is negative: black reads below 0."""
    readings = campaign(lambda code, _hours: code**2.2, seed=seed, offset_cd_m2=0.008)
    dark = (readings.drive == 0).all(axis=1) & (readings.hours == 0)
    assert (readings.xyz_cd_m2[dark].mean(axis=0) < 0).any()
    assert diagnose(readings, baseline="native").verdict.name == "consistent"


#: Displays whose native model predicts later sessions in different ways: by curves, by the first session's readings of
#: single colours, by an own model.
PREDICTED_BY: dict[str, Callable[[], Measurements]] = {
    "curves": partial(campaign, noise=1e-4),
    "first readings": bright_mixtures,
    "own model": own_campaign,
}


@pytest.mark.parametrize("way", PREDICTED_BY)
def test_the_zero_of_the_first_session_counts_where_the_prediction_contains_it_and_there_only(way: str) -> None:
    """Black of the first session reads below 0 in X only. The meter's zero of that session changes a little."""
    readings = PREDICTED_BY[way]()
    first = readings.hours == 0
    black = readings.xyz_cd_m2[first & (readings.drive == 0).all(axis=1)].mean(axis=0)
    zero, change = np.array([-0.05 - black[0], 0.04, 0.03]), np.array([0.0012, 0.0009, -0.0006])

    def posed(offset: Array) -> Problem:
        shifted = readings.with_light(readings.xyz_cd_m2 + first[:, np.newaxis] * offset)
        return replace(Problem.of(shifted, baseline="native"), offset_cd_m2=1.0)

    before, after = ((each, each.xyz - anchored(each, ())) for each in (posed(zero), posed(zero + change)))
    problem = before[0]
    assert problem.native
    assert [share > 0 for share in problem.native.black] == [False, True, True]
    assert (bool(problem.first_readings), bool(problem.native.own)) == (way == "first readings", way == "own model")
    sizes = np.linalg.solve(problem.noise.dark_offset, change)
    expected = np.tensordot(sizes, problem.first_session_model.errors[-3:], axes=1) / change
    seen = (after[1] - before[1]) / change
    is_black, later = ~problem.drive.any(axis=1), problem.hour_of > 0
    assert expected[is_black] == pytest.approx(seen[is_black], abs=0.05)
    dark = later & (problem.drive.mean(axis=1) < 0.5)
    assert expected[dark].mean(axis=0) == pytest.approx(seen[dark].mean(axis=0), abs=0.1)
    assert "X" not in shared_columns(problem, problem.blocks[0], problem.whitener)[0]


@pytest.mark.slow
def test_a_curve_that_a_loss_of_drive_explains_as_well_is_one_of_both() -> None:
    lost = lambda code, hours: np.expm1(4.0 * (1.0 - 0.08 * hours / 18_000.0) * code) / np.expm1(4.0)  # noqa: E731
    verdict = diagnose(campaign(lost), baseline="native").verdict
    assert verdict.name == "one-of"
    assert {*verdict.effects} == {"drive-loss", "eotf-drift"}


@pytest.mark.slow
def test_the_page_does_not_contradict_a_small_finding() -> None:
    """A leak too small for the mean; only rivals of the leak need readings that are missing here."""
    diagnosis = diagnose(campaign(leak=0.00002))
    assert {"black-level", "ambient-reflection"} <= {*diagnosis.verdict.effects}
    (blind,) = [remark for remark in diagnosis.verdict.remarks if "could not have seen" in remark]
    assert "ambient-reflection" not in blind
    assert "veiling-glare" in blind
    text = "\n".join(part for part in diagnose_page(diagnosis, catalogue(), "x.csv") if isinstance(part, str))
    assert "All readings together hardly show it" in text
    assert "agrees with the measurements" not in text


def test_the_page_does_not_contradict_a_consistent_verdict() -> None:
    """Errors that readings share make a comparison of single readings fail where a diagnosis finds nothing."""
    diagnosis = diagnose(campaign())
    assert diagnosis.verdict.name == "consistent"
    error = replace(diagnosis.comparison.error, rms_sigma=2.0 * diagnosis.comparison.floor.rms_sigma)
    shared = replace(diagnosis, comparison=replace(diagnosis.comparison, error=error))
    text = "\n".join(part for part in diagnose_page(shared, catalogue(), "x.csv") if isinstance(part, str))
    assert "differ from the model by 2 × the noise of single readings" in text
    assert "Errors that many readings share explain the difference" in text
    assert " fails by " not in text


@pytest.mark.parametrize("seed", mostly_slow([2, 3, 4], 4))
def test_small_shifts_of_two_primaries_are_one_effect(seed: int) -> None:
    shifts = 0.0009 * np.array([[0, 0, 0], [-CHANNELS[1].sum(), 0, 0], [0, 0, CHANNELS[2].sum()]])
    verdict = diagnose(campaign(seed=seed, shifts=shifts)).verdict
    assert (verdict.name, verdict.effects) == ("named", ("primary-shift",))


def test_replicates_that_agree_by_chance_are_no_fault() -> None:
    """One healthy display of 300: noise alone gives such a misfit beside such replicates in 3 of 1000 campaigns."""
    assert diagnose(campaign(seed=169, hours=HOURS[:3])).verdict.name == "consistent"
