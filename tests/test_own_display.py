"""The display's own model with the baseline ``native``: predictions, model files, LUTs, later sessions."""

from __future__ import annotations

import copy
import json
import shutil
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.bake.manifest import model_as_json, model_from_json
from lutgen.colorimetry import delta_e_2000, xyz_to_lab
from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.fit.anchored import anchored
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.discrepancy import Discrepancy, discrepancy_of
from lutgen.criticism.noise.model import estimate_noise
from lutgen.criticism.refine import Refinement, refine
from lutgen.display import DisplayModel, load_model, save_model
from lutgen.display.loaded import LoadedCalibrations
from lutgen.display.native import NativeDisplay
from lutgen.display.own_model.ladder import mixtures_error
from lutgen.display.tips import luminance_law
from lutgen.effects import Scene
from lutgen.errors import LutgenError
from lutgen.readings import Measurements, read_measurements
from tests.native_displays import write
from tests.test_own_model import WHITE, chart, coupled

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from lutgen.colorimetry import Array

pytestmark = [pytest.mark.numbers, pytest.mark.usefixtures("fitted_once")]

#: Repeatability of the simulated meter.
NOISE = 0.0005

LIFE = 18_000.0


def shown(code: Array, hours: float, *, leak: float = 0.0, grown: float = 0.0) -> Array:
    """XYZ in cd/m² of a display with coupled channels, whose light fades by a quarter; a leak follows the light."""
    fading = 1.0 - 0.25 * hours / LIFE
    return np.asarray(fading * (coupled(code) + (leak + grown * hours / LIFE) * WHITE))


def campaign(hours: tuple[float, ...] = (0.0, 6000.0, LIFE), seed: int = 2, **leaks: float) -> Measurements:
    rng = np.random.default_rng(seed)
    code = chart()
    xyz = np.vstack([shown(code, hour, **leaks) for hour in hours])
    xyz *= 1.0 + NOISE * rng.standard_normal((len(xyz), 1)) + NOISE / 2 * rng.standard_normal(xyz.shape)
    when = np.repeat(np.array(hours), len(code))
    drive = np.vstack([code] * len(hours))
    return Measurements(hours=when, drive=drive, xyz_cd_m2=xyz, lines=np.arange(2.0, when.size + 2.0), file="own.csv")


def error(model: DisplayModel, hours: float, **leaks: float) -> float:
    """Mean ΔE2000 of a model at an hour against the true display, on colours without readings."""
    code = np.random.default_rng(77).uniform(0.0, 1.0, (200, 3))
    code = np.vstack([code, 0.2 * code, np.zeros((20, 3))])
    truth = shown(code, hours, **leaks)
    white = shown(np.ones((1, 3)), 0.0, **leaks)[0]
    light = model.at("chroma-luma", hours).code_to_xyz(code) * model.tips_before_effects.xyY[0, 0, 2]
    return float(delta_e_2000(xyz_to_lab(light, white), xyz_to_lab(truth, white)).mean())


def absolute(readings: Measurements, baseline: str) -> DisplayModel:
    return DisplayModel(readings, baseline=baseline, reference="absolute", luminance=luminance_law("measured"))


def test_the_rung_that_was_taken_is_what_native_means() -> None:
    readings = campaign()
    native, paper = compare(readings, baseline="native"), compare(readings)
    assert native.first_session is not None
    assert native.first_session.own is not None
    assert native.error.delta_e_mean < 0.2
    assert native.error.delta_e_mean < paper.error.delta_e_mean / 5
    model = absolute(readings, "native")
    for hours in (0.0, 6000.0, LIFE):
        assert error(model, hours) < 0.2
        assert error(absolute(readings, "colour-points"), hours) > 1.0


def test_readings_of_the_first_session_are_foretold_by_models_that_had_not_seen_them() -> None:
    readings = campaign((0.0, LIFE))
    comparison = compare(readings, baseline="native")
    ladder = Problem.of(readings, baseline="native").native.ladder  # type: ignore[union-attr]
    assert ladder is not None
    sample = ladder.sample
    foretold = mixtures_error(sample, comparison.predicted[readings.hours == 0] / sample.white)
    assert foretold == pytest.approx(ladder.error, rel=0.25)
    assert foretold > 1.2 * mixtures_error(sample, ladder(sample.drive))


def test_black_and_colour_points_are_those_of_every_hour() -> None:
    """Black and colour points are measured again: an error of the own model must not move them."""
    readings = campaign()
    model = absolute(readings, "native")
    tips = model.tips.xyY[-1, :, 2] / model.tips.xyY[0, 0, 2]
    code = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(model.at("chroma-luma", LIFE).code_to_xyz(code)[:, 1], tips, rtol=1e-6)


@pytest.fixture(scope="module")
def leaking() -> Refinement:
    """A native model, refined on a display whose black leaks from the first hour on and later leaks more."""
    return refine(campaign(leak=0.003, grown=0.006), ["black-level"], baseline="native")


@pytest.mark.parametrize("hours", [0.0, 6000.0, LIFE])
def test_a_refined_native_model_counts_the_first_sessions_leak_once(leaking: Refinement, hours: float) -> None:
    model = replace(leaking.model, reference="absolute", luminance=luminance_law("measured"))
    assert leaking.improves
    assert error(model, hours, leak=0.003, grown=0.006) < 0.25
    without = replace(model, effects=())
    assert hours == 0 or error(without, hours, leak=0.003, grown=0.006) > 0.4


@pytest.fixture(scope="module")
def model_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A native model in a file, with the own model's file beside it."""
    folder = tmp_path_factory.mktemp("model")
    data = write(campaign((0.0, LIFE)), folder / "own.csv")
    save_model(DisplayModel(read_measurements(data), baseline="native", reference="absolute"), folder / "m.toml")
    return folder


@pytest.fixture
def saved(model_folder: Path, tmp_path: Path) -> Path:
    """A copy of that model for a test to change."""
    shutil.copytree(model_folder, tmp_path, dirs_exist_ok=True)
    return tmp_path / "m.toml"


def test_a_model_file_has_the_own_model_beside_it_to_the_last_bit(saved: Path) -> None:
    model = load_model(saved)
    assert model.native is not None
    assert model.native.own == NativeDisplay.of(model.measurements).own
    assert 'own = "m.npz"' in saved.read_text(encoding="utf-8")
    with pytest.raises(LutgenError, match=r"m\.toml: exists already"):
        save_model(model, saved)
    before = saved.with_suffix(".npz").read_bytes(), saved.read_bytes()
    save_model(model, saved, force=True)
    assert (saved.with_suffix(".npz").read_bytes(), saved.read_bytes()) == before


@pytest.mark.parametrize(("content", "words"), [
    (None, ("cannot read the display's own model", "put it back, or make the model again")),
    (b"nothing", ("no .npz of lutgen's", "Make the model again")),
    (b"PK\x03\x04", ("no .npz of lutgen's",)),
])  # fmt: skip
def test_a_missing_or_spoilt_own_model_is_one_clear_sentence(
    saved: Path, content: bytes | None, words: tuple[str, ...]
) -> None:
    file = saved.with_suffix(".npz")
    if content is None:
        file.unlink()
    else:
        file.write_bytes(content)
    with pytest.raises(LutgenError) as refused:
        load_model(saved)
    for word in (str(file), *words):
        assert word in str(refused.value)


def test_another_displays_own_model_is_refused(saved: Path) -> None:
    other = NativeDisplay.of(campaign((0.0, LIFE), seed=9)).own
    assert other is not None
    saved.with_suffix(".npz").write_bytes(other.content)
    with pytest.raises(LutgenError, match="not the one that this model file was written with"):
        load_model(saved)


@pytest.mark.slow
def test_the_first_hour_foretells_all_by_the_displays_own_model() -> None:
    """The model has no aging, and the fading backlight is the only remaining fault."""
    readings = campaign()
    still, moved = compare(readings, baseline="native"), compare(readings, baseline="native-first-hour")
    assert moved.error.delta_e_mean > 5 * still.error.delta_e_mean
    model = absolute(readings, "native-first-hour")
    np.testing.assert_allclose(model.tips.xyY[-1], model.tips.xyY[0])
    refinement = refine(readings, ["backlight-decay"], baseline="native-first-hour")
    assert refinement.after.error.delta_e_mean < 0.05 * moved.error.delta_e_mean


def test_the_discrepancy_is_what_was_put_in_beside_the_noise() -> None:
    rng = np.random.default_rng(3)
    light = WHITE * rng.uniform(0.0, 1.0, (3000, 3)) ** 2.2
    noise = estimate_noise(campaign(), "0.001,0.003")
    truth = Discrepancy(0.008, 0.006, 0.05, np.full((3, 3), 0.7) + 0.3 * np.eye(3), WHITE)
    root = np.linalg.cholesky(noise.covariance(light) + truth.covariance(light))
    off = np.einsum("nij,nj->ni", root, rng.standard_normal(light.shape))
    discrepancy = discrepancy_of(off, light, noise.covariance(light), WHITE, np.arange(len(off)))
    assert discrepancy.share == pytest.approx(truth.share, rel=0.06)
    assert discrepancy.of_luminance == pytest.approx(truth.of_luminance, rel=0.06)
    assert discrepancy.floor_cd_m2 == pytest.approx(truth.floor_cd_m2, rel=0.06)
    np.testing.assert_allclose(discrepancy.correlation, truth.correlation, atol=0.05)
    none = discrepancy_of(np.zeros_like(off), light, noise.covariance(light), WHITE, np.arange(len(off)))
    assert max(none.share, none.of_luminance) < 1e-4


def test_one_session_is_a_display_at_hour_0() -> None:
    model = DisplayModel(campaign((0.0,)), baseline="native")
    assert model.reference == "absolute"
    assert error(replace(model, luminance=luminance_law("measured")), 0.0) < 0.2
    with pytest.raises(LutgenError, match=r"at one time only .* hour 5000 is asked.*or take hour 0"):
        model.at("chroma", 5000.0)
    assert DisplayModel(campaign((0.0, LIFE))).reference == "relative"


def test_one_session_is_refined() -> None:
    """An error from the first hour on is no aging: refine keeps the error and says so."""
    refinement = refine(campaign((0.0,)), ["crosstalk"], baseline="native")
    assert refinement.model.reference == "absolute"
    assert refinement.after.error.delta_e_mean == pytest.approx(refinement.before.error.delta_e_mean, rel=0.05)


INPUT = np.linspace(0.0, 1.0, 256)

#: The tables of the graphics card: a lowered blue on the first day, later a raised blue with another curve.
LOADED = {
    0.0: np.column_stack([INPUT, INPUT, 0.98 * INPUT, 0.92 * INPUT]),
    LIFE: np.column_stack([INPUT, 0.99 * INPUT**1.15, 0.98 * INPUT**1.15, 0.935 * INPUT**1.15]),
}


def sent(code: Array, hours: float) -> Array:
    curves = LOADED[0.0 if hours < LIFE else LIFE]
    return np.stack([np.interp(code[:, k], curves[:, 0], curves[:, 1 + k]) for k in range(3)], axis=1)


def recalibrated(calibrations: Mapping[float, Array] = LOADED) -> Measurements:
    """The campaign of a display with a new calibration before its last session."""
    readings = campaign()
    rng = np.random.default_rng(5)
    xyz = np.vstack([shown(sent(chart(), hour), hour) for hour in np.unique(readings.hours)])
    xyz *= 1.0 + NOISE * rng.standard_normal((len(xyz), 1))
    return replace(readings, xyz_cd_m2=xyz, calibrations=calibrations)


@pytest.mark.slow
def test_a_calibration_that_the_files_hold_is_no_aging() -> None:
    known, unknown = (compare(recalibrated(calibrations=each), baseline="native") for each in (LOADED, {}))
    assert known.error.delta_e_mean < 0.2
    assert unknown.error.delta_e_mean > 3 * known.error.delta_e_mean


def test_beside_a_known_calibration_the_first_day_foretells_all_but_the_fading() -> None:
    def share(calibrations: Mapping[float, Array]) -> Array:
        problem = Problem.of(recalibrated(calibrations=calibrations), baseline="native-first-hour")
        last = (problem.hour_of == 2) & (problem.xyz[:, 1] > 0.02 * WHITE[1])
        return np.asarray(problem.xyz[last, 1] / anchored(problem, ())[last, 1])

    known, unknown = share(LOADED), share({})
    assert known == pytest.approx(0.75, rel=0.02)
    assert unknown.std() > 0.03


@pytest.mark.parametrize("baseline", ["native", "native-first-hour"])
def test_a_model_shows_the_calibration_of_its_hour(baseline: str) -> None:
    model = replace(absolute(recalibrated(), baseline), held=False)
    code = np.random.default_rng(77).uniform(0.05, 1.0, (100, 3))
    for hours in (0.0, 6000.0, LIFE):
        truth = shown(sent(code, hours), hours if baseline == "native" else 0.0)
        light = model.at("chroma-luma", hours).code_to_xyz(code) * model.tips_before_effects.xyY[0, 0, 2]
        white = shown(sent(np.ones((1, 3)), 0.0), 0.0)[0]
        assert delta_e_2000(xyz_to_lab(light, white), xyz_to_lab(truth, white)).mean() < 0.2, hours


def test_a_manifest_keeps_the_calibrations_that_a_model_goes_by(tmp_path: Path) -> None:
    model = absolute(recalibrated(), "native")
    record = json.loads(json.dumps(model_as_json(model, tmp_path)))
    again = model_from_json(record, where=str(tmp_path / "manifest.json"))
    assert again.known == model.known
    code = chart()
    assert again.at("chroma", LIFE).code_to_xyz(code) == pytest.approx(model.at("chroma", LIFE).code_to_xyz(code))


def test_a_change_of_the_calibration_goes_to_other_processes() -> None:
    (known,) = absolute(recalibrated(), "native").known
    assert known.effect.stage == "drive"
    assert copy.copy(known) == known


def test_the_same_calibration_at_all_sessions_changes_nothing() -> None:
    same = dict.fromkeys((0.0, LIFE), LOADED[0.0])
    assert LoadedCalibrations.of(recalibrated(calibrations=same), measured_tips=True) == ()
    assert LoadedCalibrations.of(recalibrated(calibrations={LIFE: LOADED[LIFE]}), measured_tips=True) == ()
    assert DisplayModel(recalibrated()).known == ()


def test_a_change_of_the_calibration_is_said_with_its_ends() -> None:
    (known,) = absolute(recalibrated(), "native").known
    (sentence,) = known.sentences()
    assert "By hour 18000 another calibration was loaded: red lowered from 1.000 to 0.990" in sentence
    assert "blue raised from 0.920 to 0.935" in sentence


def test_a_code_value_beyond_the_first_days_full_drive_goes_on() -> None:
    (known,) = LoadedCalibrations.of(recalibrated(), measured_tips=False)
    scene = Scene(np.full((1, 1), LIFE), np.ones((1, 3)), np.ones((1, 3)), np.ones((1, 3)))
    drive = known.effect.function(np.ones((1, 3)), scene)
    assert drive == pytest.approx(np.array([[0.99, 1.0, 0.935 / 0.92]]), abs=1e-6)


def test_what_an_own_model_misses_at_a_colour_point_stays_there() -> None:
    """The reading of full red is 8 % too bright: the model keeps red as read, and mixtures near the own model."""
    readings = campaign((0.0,))
    red = (readings.drive == [1.0, 0.0, 0.0]).all(axis=1)
    xyz = np.where(red[:, np.newaxis], 1.08, 1.0) * readings.xyz_cd_m2
    problem = Problem.of(replace(readings, xyz_cd_m2=xyz), baseline="native")
    ladder = problem.native.ladder  # type: ignore[union-attr]
    assert ladder is not None
    missed = xyz[red].mean(axis=0) / ladder.sample.white - ladder(np.array([[1.0, 0.0, 0.0]]))[0]
    assert missed[0] > 0.01
    prediction = anchored(problem, ())
    # The fit of red follows its reading, with little influence of the mixtures: twice the error, not ten times.
    assert mixtures_error(ladder.sample, prediction / ladder.sample.white) < 3.0 * ladder.error
    np.testing.assert_allclose(prediction[red], xyz[red], rtol=0.01)
