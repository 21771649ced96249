"""Detectability: an effect of the smallest detectable size is detected, and an effect that tips absorb is not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.rehearse import with_readings_of
from lutgen.criticism.verdict.verdict import Verdict
from lutgen.criticism.verdict.visibility import Visibility, threshold, visibility
from lutgen.effects import Effect, Parameter, catalogue, effect
from lutgen.effects.expression import parse
from tests.detection_rate import names_it, report
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text
from tests.virtual_display.designs import DESIGNS
from tests.virtual_display.strength import strength

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.effects import Scene

pytestmark = pytest.mark.numbers

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)


@cache
def healthy(design: str, baseline: str = "colour-points", hours: tuple[float, ...] = HOURS) -> Fit:
    text = csv_text(Campaign(design=design, hours=hours, seed=6, baseline=baseline))
    return fit(with_shared_errors(Problem.of(read(text, file="null.csv", sha256=""), baseline=baseline)))


def seen(effect: Effect | str, design: str = "colours", baseline: str = "colour-points") -> Visibility:
    declared = catalogue()[effect] if isinstance(effect, str) else effect
    return visibility(healthy(design, baseline), [declared])[0]


def detections(effect: Effect, parameter: str, size: float, design: str, seeds: int) -> int:
    """Number of campaigns in which a diagnosis names the effect, on lutgen's own display with the effect."""
    base, rest, count = healthy(design), effect.rest(), 0
    there = Term(effect, rest | {parameter: rest[parameter] + size})
    for seed in range(seeds):
        simulated = with_readings_of(base, there, np.random.default_rng([seed, 0xD]))
        count += names_it(diagnose(simulated.readings).verdict, effect.name)
    return count


FAINT = (
    ("black-level", "greys"),
    ("crosstalk", "colours"),
    ("eotf-drift", "colours"),
    ("meter-offset", "colours"),
    ("primary-shift", "colours"),
    ("edge-falloff", "full"),
    ("warm-up", "full"),
)


NINE_OF_TEN = "test_an_effect_of_the_smallest_detectable_size_is_found_in_nine_of_ten_campaigns"


@pytest.mark.slow
@pytest.mark.parametrize(("faint", "draws", "low", "high", "luck"), [
    # With a true rate of nine in ten, 20 draws give 15 or more in 99 of 100 cases.
    (FAINT[:1], 20, 0.75, 1.0, 0.15),
    pytest.param(FAINT, 40, 0.85, 0.95, 0.06, marks=pytest.mark.rare(instead=NINE_OF_TEN)),
])  # fmt: skip
def test_an_effect_of_the_smallest_detectable_size_is_found_in_nine_of_ten_campaigns(
    faint: tuple[tuple[str, str], ...], draws: int, low: float, high: float, luck: float
) -> None:
    detected, smaller = {}, {}
    for name, design in faint:
        effect, entry = catalogue()[name], seen(name, design)
        assert entry.visible
        assert entry.smallest_detectable is not None
        size = entry.smallest_detectable * (1.0 if effect.parameters[entry.parameter].value >= 0 else -1.0)
        detected[name] = detections(effect, entry.parameter, size, design, draws)
        smaller[name] = detections(effect, entry.parameter, size / 3.0, design, draws // 2)
    assert low <= sum(detected.values()) / (draws * len(faint)) <= high, detected
    assert min(detected.values()) >= 0.65 * draws, detected
    assert sum(smaller.values()) / (draws // 2 * len(faint)) < luck, smaller


def test_an_effect_whose_shortest_form_frees_more_must_be_larger() -> None:
    """``recalibration`` has no form of one parameter: a search pays for its date too."""
    base, effect = healthy("colours"), catalogue()["recalibration"]
    entry = seen(effect)
    assert entry.smallest_detectable is not None
    assert threshold(base) < threshold(base, 2) < threshold(base, 3)
    _, left = base.score.switched(Term.at_rest(effect, (), hour=9000.0, **{entry.parameter: entry.smallest_detectable}))
    assert left == pytest.approx(threshold(base, 2), rel=0.02)


def test_a_verdict_that_names_an_effect_in_a_set_counts_as_found() -> None:
    set_of_two = Verdict("one-of", "", ("loading",), (("loading", "crosstalk"),))
    nothing, other = Verdict("consistent", ""), Verdict("named", "", ("loading",))
    text, is_right = report({"crosstalk": [set_of_two] * 9 + [nothing], "loading": [other] * 9 + [nothing]})
    assert is_right
    assert "crosstalk              9 of  10  consistent" in text
    assert "found: 18 of 20 = 0.900" in text
    assert not report({"crosstalk": [other] * 10})[1]


@pytest.mark.parametrize(("name", "form", "parameter"), [
    ("crosstalk", "same", "new"),
    ("meter-offset", "same", "offset"),
    ("black-level", "constant", "new"),
])  # fmt: skip
def test_the_size_is_that_of_the_independent_simulator(name: str, form: str, parameter: str) -> None:
    campaign = Campaign(design="colours", hours=HOURS, seed=6)
    effect = replace(catalogue()[name], forms=((parameter,),), refined=1)
    problem = Problem.of(read(csv_text(campaign), file="null.csv", sha256=""), instrument="0.002,0.003")
    # The simulator's floor has the same correlation as its other noise.
    noise = replace(problem.noise, floor_correlation=problem.noise.correlation)
    base = fit(replace(problem, noise=noise))
    size = visibility(base, [effect])[0].smallest_detectable
    assert size is not None
    shown = strength(replace(campaign, hidden=((name, size, form),)))
    assert shown == pytest.approx(threshold(base), rel=0.07)


@pytest.mark.parametrize("formula", ["xyz*(1+k*tau); k=0.01[-0.5,0.5]", "xyz*exp(-k*tau**2); k=0.1[-1,1]"])
def test_a_gain_of_everything_is_absorbed_by_the_tips_and_seen_from_hour_0(formula: str) -> None:
    effect = parse(f"all: {formula}")
    entry = seen(effect)
    assert entry.absorbed == pytest.approx(1.0, abs=1e-9)
    assert entry.smallest_detectable is None or entry.smallest_detectable > 100.0
    assert not entry.visible
    fresh = seen(effect, baseline="first-hour")
    assert fresh.visible
    assert fresh.smallest_detectable is not None
    assert fresh.smallest_detectable < 0.1  # the session gains are 0.3 %


@pytest.mark.parametrize("design", DESIGNS)
def test_absorbed_is_a_share(design: str) -> None:
    for baseline in ("colour-points", "first-hour"):
        for each in visibility(healthy(design, baseline), catalogue().values()):
            assert each.absorbed is None or -1e-9 <= each.absorbed <= 1.0 + 1e-9, each
            assert each.smallest_detectable is None or each.smallest_detectable > 0.0


@pytest.mark.parametrize("name", [name for name, each in catalogue().items() if each.needs])
def test_without_its_columns_an_effect_cannot_be_seen(name: str) -> None:
    entry = seen(name)
    assert not entry.visible
    assert entry.smallest_detectable is None
    assert seen(name, "full").visible


@pytest.mark.parametrize("name", [name for name, each in catalogue().items() if each.baseline == "colour-points"])
def test_tips_alone_show_nothing_that_is_visible_beside_them(name: str) -> None:
    if name != "matrix-switching":  # matrix-switching leaves its trace in the sum of the tips
        assert not seen(name, "tips").visible


@pytest.mark.parametrize("name", [name for name, each in catalogue().items() if each.baseline == "first-hour"])
def test_what_only_hour_0_shows_is_visible_from_there(name: str) -> None:
    assert seen(name, "colours", "first-hour").visible


def test_more_readings_show_smaller_effects() -> None:
    few, many = (
        visibility(healthy("colours", "colour-points", hours), [catalogue()["crosstalk"]])[0]
        for hours in (HOURS[:2], HOURS)
    )
    assert few.smallest_detectable is not None
    assert many.smallest_detectable is not None
    # Five sessions in place of two: √2.5 as precise. More readings need a slightly larger gain.
    # The noise is known better by a tenth.
    assert few.smallest_detectable / many.smallest_detectable == pytest.approx(1.1 * np.sqrt(2.5), rel=0.1)


def test_more_noise_hides_larger_effects() -> None:
    # Both noises are above the noise of the readings. Below it the scatter of the replicates would determine the size.
    text = csv_text(Campaign(design="colours", hours=HOURS, seed=6))
    sizes = []
    for noise in ("0.003,0.009", "0.009,0.027"):
        base = fit(Problem.of(read(text, file="null.csv", sha256=""), instrument=noise))
        sizes.append(visibility(base, [catalogue()["meter-offset"]])[0].smallest_detectable or 0.0)
    assert sizes[1] == pytest.approx(3.0 * sizes[0], rel=0.01)


def test_an_effect_without_a_size_is_visible_at_its_mildest_setting() -> None:
    entry = seen("quantization")
    base, effect = healthy("colours"), catalogue()["quantization"]
    assert (entry.parameter, entry.unit) == ("bits", "bit")
    assert entry.smallest_detectable is not None
    for bits in range(4, 13):
        light = predict(
            base.problem, State((Term(effect, effect.rest() | {"bits": float(bits)}),), base.tips, base.gains)
        )
        exact = replace(base.problem.readings, xyz_cd_m2=light)
        distance = fit(replace(base.problem, readings=exact)).chi2 ** 0.5
        assert (distance >= threshold(base)) == (bits <= entry.smallest_detectable)


@effect(stage="optics", neutral={"hour": 1e5}, hour=Parameter(9000.0, (0.0, 1e5), "h", "date of the film", "gaps"))
def film(xyz: Array, scene: Scene, /, *, hour: float) -> Array:
    """A film on the screen dims the display and adds stray light from a date on."""
    return np.where(scene.hours >= hour, 0.95 * xyz + 0.001 * scene.white, xyz)


def test_of_an_effect_that_is_a_date_the_latest_visible_date_is_given() -> None:
    found = seen(film)
    assert (found.parameter, found.visible, found.smallest_detectable) == ("hour", True, 14_750.0)


def test_an_effect_whose_sizes_are_all_held_is_not_visible() -> None:
    held = replace(catalogue()["crosstalk"], forms=())
    assert seen(held) == Visibility("crosstalk", "", "", visible=False, smallest_detectable=None, absorbed=None)
