"""Refining: the error falls step by step, the refined model is nearer to the display, and a file keeps the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest

import lutgen
from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.compare.comparison import compare_problem
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.display_model import terms_of
from lutgen.criticism.refine import Course, Refinement, refine
from lutgen.criticism.search.candidates import family
from lutgen.display import DisplayModel, load_model, save_model
from lutgen.display.tips import luminance_law
from lutgen.errors import LutgenError
from tests import native_displays as native
from tests.criticism_twin import TIPS, Fault, Reading, display, noisy, table
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text, truth

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit
    from lutgen.criticism.search.candidates import Family
    from lutgen.effects import Effect
    from lutgen.readings import Measurements

pytestmark = pytest.mark.numbers

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)
TWO = (("black-level", 0.0016, "same"), ("crosstalk", 0.03, "same"))


def campaign(*hidden: tuple[str, float, str], design: str = "colours") -> Campaign:
    return Campaign(design=design, hours=HOURS, seed=3, hidden=hidden)


@cache
def readings(*hidden: tuple[str, float, str], design: str = "colours") -> Measurements:
    return read(csv_text(campaign(*hidden, design=design)), file="hidden.csv", sha256="1" * 64)


@cache
def both() -> Refinement:
    return refine(readings(*TWO), ["black-level", "crosstalk"])


def test_the_error_falls_with_every_step_down_to_the_floor() -> None:
    ratios = [both().before.ratio, *(step.comparison.ratio for step in both().steps)]
    assert [step.effect for step in both().steps] == ["black-level", "crosstalk"]
    assert all(after < before - 0.1 for before, after in pairwise(ratios))
    assert ratios[0] > 3.0
    # Replicates that determine separate sizes for X, Y and Z have an uncertainty of a tenth for each.
    assert ratios[-1] == pytest.approx(1.0, abs=0.12)
    assert both().final.chi2 / both().final.freedom == pytest.approx(1.0, abs=0.1)
    assert both().after is both().steps[-1].comparison


def test_the_sentence_and_the_json_say_how_far_it_fell() -> None:
    content = both().as_json("mine.toml")
    assert content["sentence"].startswith("With black-level, crosstalk the error falls from ")
    assert f"to {both().after.ratio:.3g} × the noise" in content["sentence"]
    assert [step["added"] for step in content["steps"]] == ["black-level", "crosstalk"]
    rms = [content["before"]["rms_sigma"], *(step["error"]["rms_sigma"] for step in content["steps"])]
    assert rms == sorted(rms, reverse=True)
    assert content["steps"][-1]["error"] == content["after"]
    assert (content["model"], content["verdict"], content["schema"]) == ("mine.toml", None, 2)
    for name in ("black-level", "crosstalk"):
        fitted = [each for each in content["parameters"][name].values() if each["free"]]
        assert fitted
        assert all(each["stderr"] is None or each["stderr"] > 0 for each in fitted)


def test_an_error_that_falls_in_units_of_noise_alone_is_said_to_do_so() -> None:
    refinement = both()
    assert not refinement.sentence().endswith("Mean ΔE2000 does not fall.")
    last = refinement.steps[-1]
    worse = replace(last.comparison, error=replace(last.comparison.error, delta_e_mean=99.0))
    sentence = replace(refinement, steps=(*refinement.steps[:-1], replace(last, comparison=worse))).sentence()
    assert "the error falls" in sentence
    assert sentence.endswith("Mean ΔE2000 does not fall.")


def error(model: DisplayModel, hidden: Campaign, hours: float, code: Array) -> float:
    """Mean ΔE2000 between a model in absolute colours and the true display, each relative to its own first white."""
    absolute = replace(model, reference="absolute", luminance=luminance_law("measured"))
    white = truth(hidden, np.ones((1, 3)), 0.0)[0]
    true = truth(hidden, code, hours) / white[1]
    shown = absolute.at("chroma-luma", hours).code_to_xyz(code)
    return float(delta_e_2000(xyz_to_lab(true, white / white[1]), xyz_to_lab(shown, white / white[1])).mean())


@pytest.mark.parametrize("hours", [0.0, 11_500.0, 18_000.0])
def test_the_refined_model_is_the_true_display_on_colours_that_were_not_measured(hours: float) -> None:
    code = np.random.default_rng(8).random((400, 3)) ** 1.5
    plain, better = (
        error(model, campaign(*TWO), hours, code) for model in (DisplayModel(readings(*TWO)), both().model)
    )
    # A session's gain of 0.3 %, which the tips absorb, changes lightness by 0.1.
    assert better < 0.2
    assert better < 0.3 * plain


def test_a_saved_model_is_the_same_display(tmp_path: Path) -> None:
    (tmp_path / "hidden.csv").write_text(csv_text(campaign(*TWO)))
    refinement = refine(lutgen.read_measurements(tmp_path / "hidden.csv"), ["black-level", "crosstalk"])
    save_model(refinement.model, tmp_path / "mine.toml")
    loaded, code = load_model(tmp_path / "mine.toml"), np.random.default_rng(8).random((100, 3))
    for mode, hours in (("chroma", 0.0), ("chroma", 7000.0), ("chroma-luma", 18_000.0), ("stable", 6000.0)):
        light = loaded.at(mode, hours).code_to_xyz(code)
        np.testing.assert_array_equal(light, refinement.model.at(mode, hours).code_to_xyz(code))
    by_name = {term.effect.name: term for term in refinement.final.terms}
    assert {term.effect.name: term for term in terms_of(loaded)} == by_name
    again = compare_problem(refinement.final.problem, terms_of(loaded))
    assert again.error.rms_sigma == pytest.approx(refinement.after.error.rms_sigma, rel=1e-9)
    assert loaded.effects == refinement.model.effects


def test_the_model_predicts_the_readings_that_it_was_fitted_to() -> None:
    refinement, problem = both(), both().final.problem
    absolute = replace(refinement.model, reference="absolute", luminance=luminance_law("measured"))
    white = absolute.tips_before_effects.xyY[0, 0, 2]
    for index, hours in enumerate(problem.hours):
        here = problem.hour_of == index
        code: Array = problem.readings.drive[problem.rows[here]]
        shown = absolute.at("chroma-luma", float(hours)).code_to_xyz(code)
        # In units of the whole display: relative luminances refer to white with its effects.
        scale = float((shown * refinement.final.predicted[here]).sum() / (shown**2).sum())
        np.testing.assert_allclose(shown * scale, refinement.final.predicted[here], rtol=1e-6, atol=1e-6 * white)


@cache
def _of_two_sessions() -> Course:
    random = np.random.default_rng(1)
    codes = [*native.TIPS, native.BLACK, *native.GREYS, *native.RAMPS, *native.MIXTURES]
    measurements = native.session(native.Panel(), codes)
    light = measurements.xyz_cd_m2 * (1.0 + 0.003 * random.standard_normal((measurements.hours.size, 1)))
    return Course.of(replace(measurements, xyz_cd_m2=light), baseline="native-first-hour", instrument="0.003,0.003")


@pytest.mark.parametrize(
    ("effect", "right"),
    mostly_slow(
        [("channel-decay", True), ("crosstalk", False), ("loading", False), ("eotf-drift", False)],
        "channel-decay",
        "crosstalk",
    ),
)
def test_of_two_sessions_the_colours_of_the_later_one_are_withheld(effect: str, *, right: bool) -> None:
    """Blue fades. Any other effect lowers its own error on one later session, but predicts no withheld colour."""
    refinement = _of_two_sessions().refinement([effect])
    assert refinement.after.ratio < refinement.before.ratio
    assert (refinement.held_out_gain > 0.0) == right == refinement.improves
    assert right or refinement.no_gain() == "Withheld readings are predicted no better"


@pytest.mark.slow
def test_auto_adds_what_a_diagnosis_finds() -> None:
    hidden = readings(("crosstalk", 0.03, "same"))
    diagnosis, refinement = diagnose(hidden), refine(hidden, auto=True)
    by_name = refine(hidden, diagnosis.verdict.effects)
    assert [step.effect for step in refinement.steps] == list(diagnosis.verdict.effects) == ["crosstalk"]
    assert refinement.diagnosis is not None
    assert refinement.diagnosis.verdict == diagnosis.verdict
    assert refinement.model.verdict == refinement.as_json()["verdict"] == "named"
    assert refinement.final.chi2 == pytest.approx(by_name.final.chi2, rel=1e-4)
    assert refinement.after.error.rms_sigma == pytest.approx(diagnosis.after.error.rms_sigma, rel=1e-9)


def test_auto_adds_nothing_to_a_healthy_display() -> None:
    refinement = refine(readings(), auto=True)
    assert refinement.steps == ()
    assert refinement.sentence() == "Nothing was added: the model stays as it was."
    assert not refinement.improves
    assert refinement.to_save.fit["kept"] == "by hand: no effect was added"
    assert refinement.model.verdict == "consistent"
    assert refinement.model.effects == ()
    # White and primaries stay as read. A fit would move them, and far if no effect explains the residuals.
    assert refinement.model.latent is not None
    problem = refinement.final.problem
    np.testing.assert_array_equal(refinement.model.latent.xyz_cd_m2, problem.measured_tips[problem.is_knot])
    assert np.abs(refinement.final.tips[problem.is_knot] - refinement.model.latent.xyz_cd_m2).max() > 1e-4


@pytest.mark.slow
@pytest.mark.rare(instead="test_auto_adds_what_a_diagnosis_finds")
def test_auto_goes_on_from_what_a_model_has() -> None:
    first = refine(readings(*TWO), ["black-level"])
    second = refine(readings(*TWO), auto=True, terms=terms_of(first.model))
    assert [step.effect for step in second.steps] == ["crosstalk"]
    assert {each.effect.name for each in second.model.effects} == {"black-level", "crosstalk"}
    assert second.after.ratio == pytest.approx(both().after.ratio, abs=0.02)


def test_what_luts_cannot_carry_is_said() -> None:
    refinement = refine(readings(("edge-falloff", 0.2, "same"), design="full"), ["edge-falloff"])
    sentences = " ".join(refinement.carried())
    assert "edge-falloff" in sentences
    assert "centre" in sentences
    assert both().carried() == []
    assert refine(readings(("meter-offset", 0.05, "same")), ["meter-offset"]).model.baked == ()


def test_tips_that_effects_hide_are_solved_again() -> None:
    refinement = refine(readings(("black-level", 0.0016, "same")), ["black-level"])
    assert refinement.model.latent is not None
    shown = refinement.model.shown_tips(18_000.0)
    measured = DisplayModel(refinement.model.measurements).tips.at(18_000.0)
    np.testing.assert_allclose(shown[:, 2], measured[:, 2], rtol=0.002)
    assert (refinement.model.latent.xyz_cd_m2[:, 3, 1] < refinement.model.measurements.tips()[1][:, 3, 2]).all()


def test_white_and_primaries_stay_as_they_were_read_where_more_than_noise_is_left() -> None:
    """No named effect describes the curves of this display. The fit would move the tips to compensate."""
    codes = [*native.TIPS, native.BLACK, *native.GREYS, *native.RAMPS, *native.MIXTURES]
    refinement = refine(native.session(native.Panel(), codes), ["crosstalk"])
    assert not refinement.after.agrees
    problem = refinement.final.problem
    here = problem.is_tip_anchor
    white = problem.measured_tips[0, 0, 1]
    shown = refinement.model.shown_tips(18_000.0)
    np.testing.assert_allclose(shown, refinement.model.measurements.tips()[1][-1], rtol=0.005, atol=0.002)
    assert np.abs(refinement.final.predicted[here] - problem.xyz[here]).max() > 0.02 * white
    np.testing.assert_allclose(refinement.after.predicted[here], problem.xyz[here], rtol=0.005, atol=0.002 * white)


def tips_only() -> Measurements:
    return table(
        noisy(
            [Reading(hour, code) for hour in (0.0, 9000.0) for code in TIPS * 3], display((0.0, 9000.0)), Fault(), {}, 1
        )
    )


@pytest.mark.parametrize(("add", "baseline", "told"), [
    (["backlight-decay"], "colour-points", r"hidden by white and primaries .* Add --baseline first-hour"),
    (["backlight-decay"], "native", r"hidden by white and primaries .* Add --baseline native-first-hour"),
    (["yellowing"], "colour-points", "only a fit from the hour-0 display shows it"),
    (["leakage"], "colour-points", r"effect 'leakage'.*Pick one of"),
    (["crosstalk", "crosstalk"], "colour-points", "in the model already"),
])  # fmt: skip
def test_what_cannot_be_added_is_refused(add: list[str], baseline: str, told: str) -> None:
    with pytest.raises(LutgenError, match=told):
        refine(readings(), add, baseline=baseline)


def test_a_misread_reading_that_the_diagnosis_leaves_out_counts_neither_before_nor_after() -> None:
    right = readings(*TWO)
    is_mixture = (np.diff(np.sort(right.drive, axis=1), prepend=0.0, axis=1) > 0.0).all(axis=1)
    mixture = np.flatnonzero(is_mixture & (right.hours == 6000.0))[0]
    light = right.xyz_cd_m2.copy()
    light[mixture] *= 3.0
    refinement = refine(right.with_light(light), auto=True)
    for comparison in (refinement.before, refinement.after):
        assert np.setdiff1d(np.arange(right.hours.size), comparison.problem.rows).tolist() == [mixture]
    assert refinement.before.ratio == pytest.approx(both().before.ratio, rel=0.05)


def test_forms_are_chosen_again_beside_an_effect_without_free_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: list[str] = []

    def noted(base: Fit, effect: Effect, *, freely: bool) -> Family:
        fitted.append(effect.name)
        return family(base, effect, freely=freely)

    monkeypatch.setattr("lutgen.criticism.refine.family", noted)
    final = Course.of(readings()).fit(["crosstalk", "quantization"])
    assert {term.effect.name: len(term.free) for term in final.terms} == {"crosstalk": 1, "quantization": 0}
    assert fitted == ["crosstalk", "quantization", "crosstalk"]


def test_an_effect_that_the_model_has_is_not_added_again() -> None:
    with pytest.raises(LutgenError, match="in the model already"):
        refine(readings(*TWO), ["black-level"], terms=both().final.terms)


def test_too_few_readings_for_the_parameters_are_refused() -> None:
    with pytest.raises(LutgenError, match=r"apart from white and primaries there are 0 .* lutgen plan lists them"):
        refine(tips_only(), ["crosstalk"])


def test_a_fresh_display_is_refined_from_hour_0() -> None:
    hidden = Campaign(
        display="OLED",
        design="colours",
        hours=HOURS,
        seed=3,
        baseline="first-hour",
        hidden=(("channel-decay", 0.3, "same"),),
    )
    refinement = refine(
        read(csv_text(hidden), file="oled.csv", sha256="2" * 64), ["channel-decay"], baseline="first-hour"
    )
    assert refinement.before.ratio > 5.0
    # The gains of three sessions alone change the error over its floor by a quarter, so χ² is the sharper test.
    assert refinement.final.chi2 / refinement.final.freedom == pytest.approx(1.0, abs=0.12)
    assert refinement.after.ratio == pytest.approx(1.0, abs=0.5)
    code = np.random.default_rng(8).random((200, 3))
    assert error(refinement.model, hidden, 18_000.0, code) < 0.3
    assert refinement.model.baseline == "first-hour"
