"""The native fresh display: what it fits exactly, when it equals the paper's display, and what it refuses."""

from __future__ import annotations

import shutil
from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_code, xyY_to_xyz, xyz_to_lab
from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.first_session.baselines import first_session
from lutgen.criticism.fit.anchored import anchored, anchored_tips
from lutgen.criticism.fit.least_squares import fit
from lutgen.criticism.fit.linear import State, Term, linearise, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.fit.system import System
from lutgen.criticism.noise.discrepancy import Discrepancy, discrepancy_of_native
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.refine import refine
from lutgen.criticism.search.candidates import STRONG, family, forms_of
from lutgen.criticism.search.explanation import UNCHANGED, is_shown_apart, together
from lutgen.criticism.search.influence import wrong_rows, wrong_sessions
from lutgen.criticism.verdict.pronounce import AGREES, NOTHING_COMPARED
from lutgen.display import MODES, REFERENCES, SELECTIONS, DisplayModel, load_model, save_model, trace
from lutgen.display.native import NativeDisplay
from lutgen.display.tips import luminance_law
from lutgen.display.transfer_curve import TransferCurve, rising_light
from lutgen.effects import Scene, catalogue
from lutgen.errors import LutgenError
from lutgen.readings import Measurements, read_measurements
from tests.native_displays import BLACK, GREYS, LEVELS, MIXTURES, RAMPS, TIPS, Panel, from_8_bit, session, write
from tests.quick import draws, mostly_slow
from tests.readings_text import read
from tests.real_data import real_data
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.criticism.fit.least_squares import Fit

pytestmark = pytest.mark.numbers

EVERYTHING = [*TIPS, BLACK, *GREYS, *RAMPS, *MIXTURES]
SRGB_TIPS = np.array([[0.3127, 0.3290, 200.0], [0.64, 0.33, 0.0], [0.30, 0.60, 0.0], [0.15, 0.06, 0.0]])
CODES = np.array(list(product((0.0, 0.03, 0.2, 0.5, 0.77, 1.0), repeat=3)))


def drawn(count: int, seed: int) -> tuple[list[float], list[float]]:
    """Random points of a rising curve."""
    rng = np.random.default_rng(seed)
    codes = np.sort(rng.uniform(0.01, 0.99, count))
    light = np.sort(rng.uniform(0.0, 1.0, count)) ** 2
    return np.unique(codes).tolist(), light[: np.unique(codes).size].tolist()


@pytest.mark.parametrize("seed", range(20))
def test_the_curve_is_the_monotone_cubic_through_encoded_light(seed: int) -> None:
    curve = TransferCurve.through("red", *drawn(2 + seed % 9, seed))
    oracle = PchipInterpolator(curve.codes, linear_to_code(np.array(curve.light)))
    code = np.linspace(0.0, 1.0, 1001)
    np.testing.assert_allclose(curve(code), code_to_linear(oracle(code)), atol=1e-12)


@draws(60, deadline=None)
@given(st.integers(0, 12), st.integers(0, 10_000))
def test_it_never_falls_and_meets_its_points(count: int, seed: int) -> None:
    curve = TransferCurve.through("red", *drawn(count, seed))
    assert (np.diff(curve(np.linspace(-0.1, 1.1, 4001))) >= -1e-15).all()
    np.testing.assert_allclose(curve(np.array(curve.codes)), curve.light, atol=1e-14)


@pytest.mark.parametrize(("light", "rising"), [
    ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3]),
    ([0.1, 0.3, 0.2, 0.4], [0.1, 0.25, 0.25, 0.4]),
    ([3.0, 2.0, 1.0], [2.0, 2.0, 2.0]),
    ([1.0, 4.0, 3.0, 2.0, 5.0], [1.0, 3.0, 3.0, 3.0, 5.0]),
])  # fmt: skip
def test_neighbours_that_fall_are_averaged(light: list[float], rising: list[float]) -> None:
    np.testing.assert_allclose(rising_light(np.array(light)), rising)


@pytest.mark.parametrize("codes", [RAMPS, GREYS], ids=["ramps", "greys"])
def test_channels_of_a_panel_are_told_apart(codes: list[tuple[float, ...]]) -> None:
    """Greys alone also determine the three channels, by X, Y and Z, if white is the sum of its primaries."""
    panel = Panel() if codes is RAMPS else Panel(extra=(0.0, 0.0, 0.0))
    native = NativeDisplay.of(session(panel, [*TIPS, BLACK, *codes]))
    assert native.source == ("ramps" if codes is RAMPS else "greys")
    level = np.repeat(np.array(LEVELS)[:, np.newaxis], 3, axis=1)
    np.testing.assert_allclose(native.linear(level), level ** np.array(panel.gammas), rtol=1e-9)
    np.testing.assert_allclose(native.black, np.array(panel.black) / panel.xyz((1, 1, 1)), rtol=1e-12)
    assert bool(native.remarks) == (codes is GREYS)


@pytest.mark.parametrize("hours", [0.0, 18_000.0])
def test_absolute_shows_the_panel_itself(hours: float) -> None:
    """Exact at the ramps' codes at hour 0. Later black is nearly the same share of white."""
    panel = Panel()
    model = DisplayModel(
        session(panel, EVERYTHING), baseline="native", reference="absolute", selection="continuous",
        luminance=luminance_law("measured"),
    )  # fmt: skip
    white = np.array(panel.xyz((1, 1, 1)))
    shown = model.at("chroma-luma", hours).code_to_xyz(np.array(MIXTURES + RAMPS)) * white[1]
    truth = np.array([panel.xyz(code, hours) for code in MIXTURES + RAMPS])
    error = delta_e_2000(xyz_to_lab(shown, white), xyz_to_lab(truth, white))
    assert error.max() < 0.35
    assert error[len(MIXTURES) :].max() < (1e-6 if hours == 0 else 0.35)
    paper = DisplayModel(model.measurements, reference="absolute", selection="continuous")
    wrong = paper.at("stable", hours).code_to_xyz(np.array(MIXTURES)) * white[1]
    assert delta_e_2000(xyz_to_lab(wrong, white), xyz_to_lab(truth[: len(MIXTURES)], white)).mean() > 1.0


@pytest.mark.parametrize(("mode", "selection"), list(product(MODES, SELECTIONS)))
def test_relative_is_the_identity_at_hour_0(mode: str, selection: str) -> None:
    model = DisplayModel(session(Panel(), EVERYTHING), baseline="native", selection=selection)
    np.testing.assert_allclose(model.at(mode, 0.0).code_to_code(CODES), CODES, atol=1e-9)


@pytest.mark.parametrize(("mode", "reference", "selection"), list(product(MODES, REFERENCES, SELECTIONS)))
@pytest.mark.parametrize("law", ["paper", "measured"])
def test_a_native_display_that_is_srgb_is_the_papers(mode: str, reference: str, selection: str, law: str) -> None:
    tips = SRGB_TIPS.copy()
    tips[1:, 2] = 200.0 * np.array([0.2126390059, 0.7151686788, 0.0721923154])
    later = tips + np.array([[0.01, 0.02, -60.0], [0.0, 0.0, -9.0], [0.0, 0.01, -40.0], [0.01, 0.0, -5.0]])
    aging = _srgb_readings([tips, later])
    asked: dict[str, Any] = {"reference": reference, "selection": selection, "luminance": luminance_law(law)}
    paper = DisplayModel(aging, **asked)
    native = DisplayModel(aging, baseline="native", **asked)
    for hours in (0.0, 4321.0, 18_000.0):
        one, other = paper.at(mode, hours).code_to_xyz(CODES), native.at(mode, hours).code_to_xyz(CODES)
        np.testing.assert_allclose(other, one, atol=1e-12)


def _srgb_readings(tips: list[Any]) -> Measurements:
    """Tips at hours 0 and 18 000, and at hour 0 exact sRGB ramps of these tips and their black."""
    codes, xyz = [], []
    first = xyY_to_xyz(tips[0])
    for channel, level in product(range(3), LEVELS):
        codes.append([level * float(c == channel) for c in range(3)])
        xyz.append(code_to_linear(level) * first[1 + channel])
    hours = np.array([0.0] * (5 + len(codes)) + [18_000.0] * 4)
    return Measurements(
        hours=hours,
        drive=np.array([*TIPS, BLACK, *codes, *TIPS]),
        xyz_cd_m2=np.array([*first, np.zeros(3), *xyz, *xyY_to_xyz(tips[1])]),
        lines=np.arange(2.0, hours.size + 2.0),
    )


def _with(code: tuple[float, ...], factor: float) -> Callable[[Measurements], Measurements]:
    """The readings with the light of one code multiplied by a factor."""

    def changed(readings: Measurements) -> Measurements:
        here = (readings.drive == np.array(code)).all(axis=1)
        return replace(readings, xyz_cd_m2=np.where(here[:, np.newaxis], factor, 1.0) * readings.xyz_cd_m2)

    return changed


def _without(*codes: tuple[float, ...]) -> Callable[[Measurements], Measurements]:
    return lambda _readings: session(Panel(), [each for each in EVERYTHING if each not in codes])


@pytest.mark.parametrize(("fault", "words"), [
    (lambda readings: _with((0.0, 0.5, 0.0), 0.4)(_with((0.0, 0.78, 0.0), 0.4)(readings)),
     ("ramp of green is not monotonic", "code 0.64", "code 0.78", "Measure these codes")),
    (_without(BLACK), ("no black (code 0, 0, 0)", "--baseline colour-points")),
    (_without(*RAMPS[:5], *GREYS[:5]), ("5 levels or more", "4 of red, 9 of green, 9 of blue, 4 of grey")),
])  # fmt: skip
def test_a_first_session_that_makes_no_native_display_is_refused(
    fault: Callable[[Measurements], Measurements], words: tuple[str, ...]
) -> None:
    with pytest.raises(LutgenError) as refused:
        DisplayModel(fault(session(Panel(), EVERYTHING)), baseline="native")
    for word in words:
        assert word in str(refused.value)


@pytest.mark.parametrize(("code", "factor"), [((0.0, 0.5, 0.0), 0.4), ((0.94, 0.0, 0.0), 1.4), ((0.0, 0.0, 0.36), 4.0)])
def test_one_misread_level_is_left_out_and_named(code: tuple[float, ...], factor: float) -> None:
    native = NativeDisplay.of(_with(code, factor)(session(Panel(), EVERYTHING)))
    right = NativeDisplay.of(session(Panel(), EVERYTHING))
    (remark,) = native.remarks
    name = ("red", "green", "blue")[int(np.argmax(code))]
    assert f"the ramp of {name} contradicts itself at code {max(code):g}: that level is left out" in remark
    at = np.array([code])
    np.testing.assert_allclose(native.linear(at), right.linear(at), atol=0.01)


def brighter_mixtures(codes: list[tuple[float, ...]]) -> Measurements:
    """A panel whose mixtures are brighter than the sum of their channels, mostly in mid-tones."""
    plain = session(Panel(), codes)
    red, green, blue = plain.drive.T
    pairs = red * green * (1.0 - red * green) + green * blue * (1.0 - green * blue)
    return replace(plain, xyz_cd_m2=plain.xyz_cd_m2 * (1.0 + 0.1 * pairs[:, np.newaxis]))


def test_without_mixtures_greys_show_whether_ramps_are_wrong() -> None:
    greys = [(code, code, code) for code in np.round(np.linspace(0.05, 0.95, 19), 3).tolist()]
    codes = [*TIPS, BLACK, *greys, *RAMPS]
    native = NativeDisplay.of(brighter_mixtures(codes))
    assert native.source == "greys"
    assert native.remarks[0].endswith("is solved from XYZ of the greys: ramps of single channels do not predict them.")
    assert NativeDisplay.of(session(Panel(extra=(0.0, 0.0, 0.0)), codes)).source == "ramps"


def with_light_of(readings: Measurements, code: tuple[float, ...], other: tuple[float, ...]) -> Measurements:
    """The readings, but a window hid the patch ``code``: it has the light of ``other``."""
    here, there = ((readings.drive == each).all(axis=1) for each in (code, other))
    xyz = readings.xyz_cd_m2.copy()
    xyz[here] = xyz[there][0]
    return replace(readings, xyz_cd_m2=xyz)


@pytest.mark.parametrize(
    ("code", "other", "says"),
    [
        (GREYS[3], GREYS[6], "other readings contradict line {line}."),
        (MIXTURES[2], GREYS[4], "other readings contradict line {line}."),
        ((1.0, 1.0, 1.0), GREYS[5], "readings of the first session contradict each other by"),
    ],
)
def test_a_misread_patch_of_one_session_is_the_measurements_fault(
    code: tuple[float, ...], other: tuple[float, ...], says: str
) -> None:
    random = np.random.default_rng(5)
    readings = session(Panel(), EVERYTHING, (0.0,))
    readings = replace(readings, xyz_cd_m2=readings.xyz_cd_m2 * random.normal(1.0, 0.002, readings.xyz_cd_m2.shape))
    sound = diagnose(readings, baseline="native").verdict
    assert sound.name == "consistent"
    verdict = diagnose(with_light_of(readings, code, other), baseline="native").verdict
    (line, *_) = readings.lines[(readings.drive == code).all(axis=1)]
    assert verdict.name == "measurement-problem"
    assert says.format(line=int(line)) in verdict.sentence


def test_a_reading_that_its_own_model_meets_is_not_misread() -> None:
    """Models without the reading may miss it: without the last level below a clip, a curve cuts the corner."""
    random = np.random.default_rng(11)
    many = [tuple(code) for code in random.uniform(0.05, 1.0, (80, 3)).round(3).tolist()]
    readings = brighter_mixtures([*TIPS, BLACK, *GREYS, *RAMPS, *many])
    problem = Problem.of(readings, baseline="native", instrument="0.002,0.003")
    native = problem.native
    assert native is not None
    assert native.ladder is not None
    (row, *_) = np.flatnonzero((readings.drive == RAMPS[3]).all(axis=1)).tolist()
    held_out = native.ladder.held_out.copy()
    held_out[row] *= 1.4
    missed = replace(native, ladder=replace(native.ladder, held_out=held_out))
    assert not discrepancy_of_native(missed, (), readings, problem.noise).misread
    wrong = replace(readings, xyz_cd_m2=readings.xyz_cd_m2.copy())
    wrong.xyz_cd_m2[row] *= 1.4
    assert Problem.of(wrong, baseline="native", instrument="0.002,0.003").discrepancy.misread == (row,)


@pytest.mark.parametrize("source", ["readings", "srgb"])
def test_curves_of_a_given_source_need_no_mixtures(source: str) -> None:
    readings = session(Panel(), [*TIPS, BLACK, *GREYS, *RAMPS])
    assert NativeDisplay.of(readings, source=source).source == source
    assert NativeDisplay.of(readings).source == "ramps"
    with pytest.raises(LutgenError, match="there is no black"):
        NativeDisplay.of(session(Panel(), [*TIPS, *GREYS, *RAMPS]), source=source)


@pytest.mark.slow
def test_many_mixtures_outvote_the_ramps() -> None:
    rng = np.random.default_rng(11)
    many = [tuple(code) for code in np.round(rng.uniform(0.05, 1.0, (80, 3)), 3).tolist()]
    readings = brighter_mixtures([*TIPS, BLACK, *GREYS, *RAMPS, *many])
    native = NativeDisplay.of(readings)
    assert native.source == "readings"
    assert native.own is not None
    assert native.ladder is not None
    assert native.ladder.error < 0.2 * native.ladder.rungs[0].error
    assert NativeDisplay.of(brighter_mixtures(EVERYTHING)).source == "ramps"
    assert NativeDisplay.of(session(Panel(), [*TIPS, BLACK, *GREYS, *RAMPS, *many])).source == "ramps"
    assert NativeDisplay.of(readings, source="ramps").source == "ramps"
    first = compare(readings, baseline="native", instrument="0.002,0.003").first_session
    by_ramps = first_session(replace(Problem.of(readings), native=NativeDisplay.of(readings, source="ramps")))
    assert first is not None
    assert by_ramps is not None
    assert first.native is not None
    assert by_ramps.native is not None
    assert first.native < 0.8 * by_ramps.native


def test_curves_of_srgb_serve_where_none_of_its_own_is_better() -> None:
    """Each mixture has its own error of 10 %, which fitted curves follow."""
    rng = np.random.default_rng(11)
    many = [tuple(code) for code in np.round(rng.uniform(0.05, 1.0, (60, 3)), 3).tolist()]
    readings = session(Panel(gammas=(2.2, 2.2, 2.2), extra=(0.0, 0.0, 0.0)), [*TIPS, BLACK, *many])
    light = (
        code_to_linear(readings.drive)
        @ np.array(readings.xyz_cd_m2[1:4])
        * rng.uniform(0.9, 1.1, (len(readings.drive), 1))
    )
    mixed = (readings.drive > 0).all(axis=1) & (readings.drive < 1).any(axis=1)
    native = NativeDisplay.of(replace(readings, xyz_cd_m2=np.where(np.atleast_2d(mixed).T, light, readings.xyz_cd_m2)))
    assert native.source == "srgb"
    np.testing.assert_allclose(native.linear(CODES), code_to_linear(CODES), atol=1e-12)
    assert NativeDisplay.from_record(native.as_record()) == native


@pytest.mark.parametrize(("lifted", "source"), [(1.12, "srgb"), (1.0, "greys")])
def test_a_few_mixtures_tell_whether_greys_make_better_curves_than_srgb(lifted: float, source: str) -> None:
    """Only middle greys are brighter than all other colours, as after a calibration of the greys."""
    readings = session(Panel(gammas=(2.2, 2.2, 2.2), extra=(0.0, 0.0, 0.0)), [*TIPS, BLACK, *GREYS, *MIXTURES[:10]])
    grey = (readings.drive == readings.drive[:, :1]).all(axis=1) & (readings.drive[:, 0] % 1.0 > 0)
    light = code_to_linear(readings.drive) if lifted > 1.0 else readings.drive**2.6
    shown = light @ np.array(readings.xyz_cd_m2[1:4]) * np.where(grey, lifted, 1.0)[:, np.newaxis]
    native = NativeDisplay.of(replace(readings, xyz_cd_m2=shown))
    assert native.source == source
    assert any("Curves are those of sRGB" in each for each in native.remarks) == (source == "srgb")


def test_many_mixtures_serve_where_ramps_make_no_curve() -> None:
    rng = np.random.default_rng(11)
    many = [tuple(code) for code in np.round(rng.uniform(0.05, 1.0, (80, 3)), 3).tolist()]
    native = NativeDisplay.of(session(Panel(), [*TIPS, BLACK, *many]))
    assert native.source == "readings"
    levels = np.repeat(np.array([[0.3], [0.5], [0.8]]), 3, axis=1)
    np.testing.assert_allclose(native.linear(levels), levels ** np.array(Panel().gammas), atol=0.03)


def test_a_fall_within_noise_is_averaged_and_said() -> None:
    level = 0.94**2.3
    native = NativeDisplay.of(_with((0.0, 0.94, 0.0), 1.004 / level)(session(Panel(), EVERYTHING)))
    (remark,) = native.remarks
    assert remark.startswith("The ramp of green falls within noise, from code 0.94 to 1")
    assert native.curves[1].light[-2:] == (1.0, 1.0)


def test_a_black_below_0_is_taken_as_0() -> None:
    native = NativeDisplay.of(session(Panel(black=(-0.001, 0.01, 0.01)), EVERYTHING))
    assert native.black[0] == 0.0
    assert "below 0" in native.remarks[0]


def test_a_light_black_is_refused() -> None:
    native = NativeDisplay.of(session(Panel(), EVERYTHING))
    with pytest.raises(LutgenError, match=r"black is 0\.3, 0\.3, 0\.3 .* within 0\.\.0\.2"):
        replace(native, black=(0.3, 0.3, 0.3))


def test_a_lens_cap_is_no_black() -> None:
    readings = session(Panel(), EVERYTHING)
    notes = ["lens cap" if not drive.any() else "" for drive in readings.drive]
    with pytest.raises(LutgenError, match="no black"):
        NativeDisplay.of(replace(readings, note=tuple(notes)))


def test_only_the_baseline_native_takes_a_native_display() -> None:
    readings = session(Panel(), EVERYTHING)
    with pytest.raises(LutgenError, match="Take the baseline native"):
        DisplayModel(readings, native=NativeDisplay.of(readings))


@pytest.fixture(scope="module")
def model_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A refined native model in a file."""
    folder = tmp_path_factory.mktemp("model")
    data = write(session(Panel(leaking=0.4, fading=0.0), EVERYTHING, (0.0, 6000.0, 18_000.0)), folder / "panel.csv")
    refinement = refine(read_measurements(data), ["black-level"], baseline="native", instrument="0.002,0.003")
    save_model(refinement.model, folder / "native.toml")
    return folder


@pytest.fixture
def saved(model_folder: Path, tmp_path: Path) -> Path:
    """A copy of that model for a test to change."""
    shutil.copytree(model_folder, tmp_path, dirs_exist_ok=True)
    return tmp_path / "native.toml"


def test_a_model_file_keeps_the_native_display_to_the_last_bit(saved: Path) -> None:
    model = load_model(saved)
    assert model.native == NativeDisplay.of(model.measurements)
    save_model(model, saved.with_name("again.toml"))
    assert saved.with_name("again.toml").read_bytes() == saved.read_bytes()


@pytest.mark.parametrize(("old", "new", "words"), [
    ("  [0.5, 0.", "  [0.5, 0.9", ("the curve of red is not monotonic", "code 0.5")),
    ("  [0.0, 0.0],", "  [0.0, 0.1],", ("must run from code 0, light 0",)),
    ("  [0.0, 0.0],", "  [0.0],", ("rows of two numbers",)),
    ('source = "ramps"', 'source = "guess"', ("Pick one of: ramps, greys",)),
    ('baseline = "native"', 'baseline = "colour-points"', ("Take the baseline native",)),
])  # fmt: skip
def test_a_model_file_with_another_native_display_is_refused(
    saved: Path, old: str, new: str, words: tuple[str, ...]
) -> None:
    text = saved.read_text(encoding="utf-8")
    assert old in text
    saved.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(LutgenError) as refused:
        load_model(saved)
    for word in (str(saved), *words):
        assert word in str(refused.value)


#: Effects that a diagnosis leaves out: most of them, so that it is quick, or none.
AMONG = {
    "effects near black": sorted({*catalogue()} - {"black-level", "meter-offset", "ambient-reflection", "eotf-drift"}),
    "all effects": [],
}


def simulated(*hidden: tuple[str, float, str]) -> Measurements:
    hours = (0.0, 3000.0, 6000.0, 12_000.0, 18_000.0)
    table: Measurements = read(
        csv_text(Campaign(design="colours", hours=hours, hidden=hidden, seed=2)), file="", sha256=""
    )
    return table


@pytest.mark.parametrize("among", mostly_slow(AMONG, "effects near black"))
def test_what_was_there_from_the_first_day_is_no_misfit(among: str) -> None:
    readings = simulated(("black-level", 0.002, "constant"))
    paper, native = compare(readings), compare(readings, baseline="native")
    assert not paper.agrees
    assert native.agrees
    assert diagnose(readings, baseline="native", without=AMONG[among]).verdict.name == "consistent"


@pytest.mark.slow
def test_what_changes_still_is() -> None:
    readings = simulated(("eotf-drift", 0.12, "same"))
    verdict = diagnose(readings, baseline="native").verdict
    assert (verdict.name, verdict.effects) == ("named", ("eotf-drift",))


def test_a_tip_read_once_is_never_left_out() -> None:
    """The fit cannot start without the tip, so the tip stays even as an outlier."""
    solution = fit(Problem.of(session(Panel(), EVERYTHING), baseline="native", instrument="0.004,0.01"))
    residual = np.zeros_like(solution.residual)
    residual[EVERYTHING.index(TIPS[2])] = 100.0
    vars(solution)["residual"] = residual
    assert wrong_rows(solution) == ()


@pytest.mark.parametrize(("size", "is_wrong"), [(30.0, False), (100.0, True)])
def test_a_first_session_does_not_show_a_later_reading_to_be_wrong(size: float, *, is_wrong: bool) -> None:
    """The model goes through the first session: if the display has changed, only later readings have a residual."""
    both = session(Panel(), [*EVERYTHING, BLACK, BLACK])
    columns = {name: getattr(both, name)[:-2] for name in ("hours", "drive", "xyz_cd_m2", "lines")}
    readings = replace(both, **columns)  # black three times at first, then once
    solution = fit(Problem.of(readings, baseline="native", instrument="0.004,0.01"))
    residual = np.zeros_like(solution.residual)
    residual[readings.hours > 0, 0] = 10.0
    black = len(EVERYTHING) + 2 + EVERYTHING.index(BLACK)
    residual[black, 0] = size
    vars(solution)["residual"] = residual
    assert (black in wrong_rows(solution)) is is_wrong


def test_levels_that_its_curves_run_through_are_no_white_and_primaries() -> None:
    readings = session(Panel(), [*TIPS, BLACK, *GREYS], hours=(0.0,))
    sentence = compare(readings, baseline="native").sentence()
    assert "nothing but white, primaries, and the levels that the display's own curves run through" in sentence
    verdict = diagnose(readings, baseline="native").verdict
    assert (verdict.name, verdict.sentence) == ("consistent", AGREES)
    tips_alone = session(Panel(), TIPS, hours=(0.0,))
    assert "nothing but white and primaries, which the model takes as given" in compare(tips_alone).sentence()
    assert diagnose(tips_alone).verdict.sentence == NOTHING_COMPARED


@pytest.mark.parametrize(
    ("more", "sentence_part"),
    mostly_slow([(1.02, "at 18000 h it is 2.0 % more than predicted from 0 h"), (1.0, "")], 1.02),
)
def test_what_a_whole_session_has_more_is_said_beside_nothing_else(more: float, sentence_part: str) -> None:
    """The comparison fails, since the usual gain of a session is 0.3 %. No effect is named for the difference."""
    codes = [*TIPS, *TIPS, BLACK, *GREYS, *RAMPS, *MIXTURES]
    readings = session(Panel(fading=0.0), codes)
    noise = 0.002 * np.random.default_rng(4).normal(size=readings.hours.size)
    light = np.where(readings.hours > 0, more, 1.0) + noise
    moved = replace(readings, xyz_cd_m2=readings.xyz_cd_m2 * light[:, np.newaxis])
    verdict = diagnose(moved, baseline="native-first-hour", instrument="0.002,0.003").verdict
    assert verdict.name == "consistent"
    if sentence_part:
        assert sentence_part in verdict.sentence
    else:
        assert verdict.sentence == AGREES


@pytest.mark.slow
def test_a_session_of_another_brightness_is_said_where_nothing_explains_it() -> None:
    """A display that was dimmed to two thirds and whose menu made greens paler."""
    readings = session(Panel(fading=0.0), [*TIPS, *TIPS, BLACK, *GREYS, *RAMPS, *MIXTURES])
    paler = np.where(readings.drive[:, 1] > readings.drive[:, [0, 2]].max(axis=1), 0.5, 1.0)
    dimmed = np.where(readings.hours > 0, 0.66 * paler, 1.0)
    moved = replace(readings, xyz_cd_m2=readings.xyz_cd_m2 * dimmed[:, np.newaxis])
    verdict = diagnose(moved, baseline="native-first-hour", instrument="0.002,0.003").verdict
    assert verdict.name == "unexplained"
    (remark,) = (each for each in verdict.remarks if each.startswith("Whole sessions differ in light: at 0 h it is"))
    assert "lutgen sessions explain" in remark


def test_a_failure_that_mean_colour_differences_hide_is_placed() -> None:
    """Black doubles by 0.02 cd/m²: many σ of a good meter, but no mean colour difference."""
    readings = session(Panel(fading=0.0, black=(0.02, 0.02, 0.03)), [*TIPS, BLACK, BLACK, *GREYS, *RAMPS, *MIXTURES])
    noise = np.random.default_rng(6).normal(size=(readings.hours.size, 1))
    light = readings.xyz_cd_m2 * (1.0 + 0.006 * noise)
    light[(readings.hours > 0) & ~readings.drive.any(axis=1)] += 0.02
    comparison = compare(replace(readings, xyz_cd_m2=light), baseline="native", instrument="0.01,0.0005")
    assert comparison.error.delta_e_mean <= comparison.floor.delta_e_mean
    assert "the noise in few readings, or in dark ones: mean ΔE2000" in comparison.sentence()


def test_noise_of_the_first_session_is_no_aging(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error of the curves' points is the same at every later hour. A fit without this error finds false drifts.

    The selection would take sRGB's curves for this display. The test forces the curves of its ramps.
    """
    monkeypatch.setattr("lutgen.display.native.clearly_better", lambda *_: True)
    problem = Problem.of(simulated(), baseline="native")
    assert problem.native is not None
    assert problem.native.source == "ramps"
    open_to_noise = fit(problem)
    taken_for_true = fit(replace(problem, drawn=()))
    assert open_to_noise.chi2 < open_to_noise.freedom + 3 * np.sqrt(2 * open_to_noise.freedom)
    assert taken_for_true.chi2 > taken_for_true.freedom + 3 * np.sqrt(2 * taken_for_true.freedom)


def test_curves_of_ramps_that_are_no_better_than_srgbs_are_not_taken() -> None:
    """The lowest rung stays unless a few mixtures clearly prefer another rung."""
    own_model = Problem.of(simulated(), baseline="native").native
    assert own_model is not None
    assert own_model.source == "srgb"
    assert "own are not clearly better (mean ΔE2000 on mixtures: ramps 0." in " ".join(own_model.remarks)


def test_compare_says_how_far_the_paper_is_from_the_first_session() -> None:
    readings = session(Panel(), EVERYTHING)
    first = compare(readings, instrument="0.002,0.003").first_session
    assert first is not None
    assert first.readings == len(MIXTURES) + len(GREYS)
    assert first.native is not None
    assert first.native < 0.3
    assert first.paper > 1.0
    assert first.is_another
    tips_alone = session(Panel(), [*TIPS, *MIXTURES])
    lacking = compare(tips_alone, instrument="0.002,0.003").first_session
    assert lacking is not None
    assert lacking.native is None
    assert "native" not in lacking.sentence()


@pytest.mark.parametrize(("name", "dates", "paper", "native"), mostly_slow([
    ("LG_ULTRAWIDE", ("20220226", "14-05-2022", "17-06-2022"), 2.0, 0.5),
    # Each reading of the first session is predicted by a model that was fitted without the reading.
    ("DELL_P2715Q", ("20220226", "14-05-2022"), 3.0, 0.22),
], "DELL_P2715Q"))  # fmt: skip
def test_real_displays_are_nearer_to_their_own_first_session(
    name: str, dates: tuple[str, ...], paper: float, native: float
) -> None:
    files = [next((real_data() / "real" / "ickc").glob(f"{name}_{date}_*.csv")) for date in dates]
    readings = from_8_bit(files, [1000.0 * k for k in range(len(files))])
    own = compare(readings, baseline="native", instrument="0.004,0.01")
    usual = compare(readings, instrument="0.004,0.01")
    assert own.first_session is not None
    assert own.first_session.native is not None
    assert own.first_session.paper > paper
    assert own.first_session.native < native
    assert own.error.delta_e_mean < usual.error.delta_e_mean


def bright_mixtures(*hidden: tuple[str, float, str], without: str = "none") -> Measurements:
    """Mixtures brighter than the curves predict, as on real displays (products of code values). Tips are unchanged.

    ``without``: start of the lines to leave out.
    """
    text = csv_text(Campaign(design="full", hours=(0.0, 6000.0, 18_000.0), hidden=hidden, seed=8))
    lines = [line for line in text.splitlines() if not line.startswith(without)]
    return with_brighter_mixtures(read("\n".join(lines), file="a.csv", sha256=""))


def with_brighter_mixtures(readings: Measurements) -> Measurements:
    lit = (readings.drive > 0).sum(axis=1, keepdims=True) > 1
    pairs = np.sin(np.pi * readings.drive).clip(0.0).prod(axis=1, keepdims=True)
    return replace(readings, xyz_cd_m2=readings.xyz_cd_m2 * (1.0 + 0.04 * lit * pairs))


@pytest.mark.parametrize(
    ("sizes", "told"),
    [
        (
            (0.001, 0.002, 0.015),
            "0.1 % of X, Y and Z each, 0.2 % of the luminance and 0.015 cd/m² at every light, from",
        ),
        ((1e-6, 0.0034, 1e-6), "model: 0.34 % of the luminance, from"),
        ((1e-6, 1e-6, 1e-6), "model: nearly none, from"),
    ],
)
def test_a_discrepancy_says_only_the_parts_that_it_has(sizes: tuple[float, float, float], told: str) -> None:
    share, of_luminance, floor = sizes
    assert told in Discrepancy(share=share, of_luminance=of_luminance, floor_cd_m2=floor).sentence()


def test_what_curves_miss_of_mixtures_is_a_discrepancy() -> None:
    """Few mixtures make no own model: the residuals of the curves on the first day predict the later errors."""
    plain = Campaign(design="full", hours=(0.0, 2500.0, 6000.0, 11_500.0, 18_000.0), seed=8)
    assert not Problem.of(read(csv_text(plain), file="a.csv", sha256=""), baseline="native").discrepancy
    bright = bright_mixtures()
    assert Problem.of(bright, baseline="native").discrepancy
    # Fits predict later mixtures from the first session. The baked model has only the curves.
    sentence = compare(bright_mixtures(("black-level", 0.01, "same")), baseline="native").sentence()
    assert sentence.startswith("The model as it is baked, with curves alone, fails by")


@pytest.mark.slow
def test_what_a_formula_misses_reaches_earlier_sessions_and_proves_no_other_effect() -> None:
    """The residual of a recalibration's formula moves the curves of the first session, from which all are predicted."""
    base = fit(with_shared_errors(Problem.of(bright_mixtures(("recalibration", 0.1, "same")), baseline="native")))
    formula = next(each for each in forms_of(base, catalogue()["recalibration"]) if len(each.form) <= 3)
    without = together(base, [formula])
    shift = family(without, catalogue()["primary-shift"]).best
    both = together(base, [formula, shift])
    unchanged = (np.abs(without.score.switched_on(formula.term)) < UNCHANGED).all(axis=1)
    gain = (without.residual[unchanged] ** 2).sum() - (both.residual[unchanged] ** 2).sum()
    assert gain > STRONG + len(shift.form) * np.log(both.readings)
    assert not is_shown_apart(shift, [formula.term], without, both)


@pytest.mark.parametrize("name", ["temperature-gamma", "ambient-reflection"])
def test_a_column_with_one_value_in_all_rows_gives_no_effect_a_signature(name: str) -> None:
    """The prediction is relative to the first session, which has the same temperature and the same room light."""
    codes = [*TIPS * 2, BLACK, *GREYS, *RAMPS, *MIXTURES]
    plain = session(Panel(), codes, hours=(0.0, 9000.0, 18_000.0))
    effect = catalogue()[name]
    seen = []
    for constants in ({}, {"temperature_c": 24.3, "ambient_lx": 5.0}):
        problem = Problem.of(replace(plain, constants=constants), baseline="native", instrument="0.002,0.003")
        term = Term.at_rest(effect, effect.forms[0], **effect.typical())
        seen.append(problem.panel((term,)).emit(problem.measured_tips[problem.hour_of]))
        seen.append(predict(problem, State((term,), problem.measured_tips, np.zeros(problem.gain_count))))
    assert np.array_equal(seen[0], seen[2])
    assert np.array_equal(seen[1], seen[3])


@pytest.mark.slow
def test_a_diagnosis_takes_what_curves_miss_of_mixtures_for_no_aging() -> None:
    assert diagnose(bright_mixtures(), baseline="native").verdict.name == "consistent"


def test_smooth_curves_of_all_readings_have_a_discrepancy_though_most_mixtures_lie_within_noise() -> None:
    """A smooth curve fits 125 mixtures but not one dark grey: the first session predicts the later greys."""
    random = np.random.default_rng(17)
    cube = [tuple(code) for code in product((0.0, 0.25, 0.5, 0.75, 1.0), repeat=3)]
    greys = [(level, level, level) for level in np.round(np.linspace(0.03, 0.97, 16), 2).tolist()]
    gamma = Panel(gammas=(2.2, 2.2, 2.2), extra=(0.0, 0.0, 0.0))
    read = session(gamma, [*cube, *greys, *TIPS, *TIPS, BLACK, BLACK], (0.0, 3000.0, 9000.0))
    light = read.xyz_cd_m2 * (1.0 + 0.003 * random.standard_normal((read.hours.size, 1)))
    light += 0.005 * random.standard_normal(light.shape)
    measured = replace(read, xyz_cd_m2=light)
    problem = Problem.of(measured, baseline="native")
    assert problem.native
    curves = replace(problem.native, own=None, ladder=None)
    assert curves.source == "readings"
    loud = replace(problem.noise, relative=0.01, floor_cd_m2=0.1)
    assert discrepancy_of_native(curves, problem.drawn, measured, loud)
    # Curves of ramps pass through the ramps: residuals of mixtures within the noise are no discrepancy.
    of_ramps = replace(curves, source="ramps")
    assert not discrepancy_of_native(of_ramps, problem.drawn, measured, loud)


def greys_at_new_levels(uneven: float) -> Measurements:
    """A healthy display whose curve is uneven by a share of its light. Each session reads other levels."""
    rng, ends = np.random.default_rng(3), np.array([*TIPS, BLACK] * 3)
    panel = Panel(gammas=(2.2, 2.2, 2.2), extra=(0.0, 0.0, 0.0), fading=0.0)
    hours = np.repeat((0.0, 9000.0, 18_000.0), len(ends) + 30)
    levels = np.round(np.linspace(0.03, 0.95, 30) + np.array([[0.0], [0.007], [0.013]]), 4)
    drive = np.concatenate([part for each in levels for part in (ends, np.repeat(each, 3).reshape(-1, 3))])
    xyz = np.array([panel.xyz(code) for code in drive.tolist()])
    bent = (drive > 0).all(axis=1) & (drive < 1).all(axis=1)
    xyz = xyz * (1.0 + uneven * bent * np.sin(97.0 * drive[:, 0]))[:, np.newaxis]
    xyz *= 1.0 + 0.002 * rng.standard_normal(xyz.shape)
    return Measurements(
        hours=hours, drive=drive, xyz_cd_m2=xyz, lines=np.arange(2.0, hours.size + 2.0), file="greys.csv"
    )


def test_what_a_curve_misses_between_its_levels_is_a_discrepancy() -> None:
    """A first session of greys alone tests its own curve: a curve through the other levels predicts each level."""
    even, uneven = greys_at_new_levels(0.0), greys_at_new_levels(0.02)
    discrepancies = [Problem.of(readings, baseline="native").discrepancy for readings in (even, uneven)]
    shares = [np.hypot(each.share, each.of_luminance) for each in discrepancies]
    assert shares[0] < 0.005
    assert shares[1] > 0.01


@pytest.mark.slow
def test_a_diagnosis_takes_what_a_curve_misses_between_its_levels_for_no_aging() -> None:
    assert diagnose(greys_at_new_levels(0.02), baseline="native").verdict.name == "consistent"


@pytest.mark.slow
def test_a_change_smaller_than_what_curves_miss_is_named() -> None:
    """The first reading of a colour predicts its later readings, and holds the residual of the curves."""
    diagnosis = diagnose(bright_mixtures(("eotf-drift", 0.015, "same")), baseline="native")
    assert (diagnosis.verdict.name, diagnosis.verdict.effects) == ("named", ("eotf-drift",))
    assert "matrix-switching" not in {family.name for family in diagnosis.explanation.first}
    smaller = diagnose(bright_mixtures(("eotf-drift", 0.01, "same")), baseline="native").verdict
    assert smaller.effects[0] == "eotf-drift"  # of one change of 1 % its kin, drive-loss, cannot be excluded


def test_errors_of_the_first_session_are_unknowns_of_known_size() -> None:
    """χ² equals the χ² of one large system with tips, shared errors and errors of the first session as unknowns."""
    problem = with_shared_errors(Problem.of(bright_mixtures(), baseline="native"))
    problem = replace(problem, rows=problem.rows[problem.is_knot[problem.hour_of]])
    solution = fit(problem)
    errors, state = solution.first_errors, State((), solution.tips, solution.gains)
    assert errors is not None
    linear = linearise(problem, state)
    columns, system = errors.columns.toarray(), System(problem, linear, state, errors)
    tips = [np.zeros((3 * problem.rows.size, 12)) for _ in problem.blocks]
    shared = [np.zeros((3 * problem.rows.size, len(problem.shared[int(here[0])]))) for here in problem.blocks]
    for block, here in enumerate(problem.blocks):
        rows = (3 * here[:, np.newaxis] + np.arange(3)).ravel()
        tips[block][rows] = linear.local[:12, here].reshape(12, -1).T
        shared[block][rows] = problem.shared[int(here[0])].reshape(shared[block].shape[1], -1).T
    bound = np.concatenate([columns, *shared], axis=1)
    free = np.concatenate(tips, axis=1)
    whole = np.block([[free, bound], [np.zeros((bound.shape[1], free.shape[1])), np.eye(bound.shape[1])]])
    right = np.concatenate([linear.residual.ravel(), np.zeros(bound.shape[1])])
    residual = right - whole @ np.linalg.lstsq(whole, right, rcond=1e-12)[0]
    assert system.chi2 == pytest.approx(float(residual @ residual), rel=1e-9)
    assert 0.8 < solution.chi2 / solution.freedom < 1.25


def test_white_and_primaries_do_not_hang_on_the_last_digit_of_a_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tips are at full drive, where the curves are exact: rounding must not let a curve's modes move tips."""
    readings = session(replace(Panel(), leaking=0.6, fading=0.0), EVERYTHING, (0.0, 9000.0, 18_000.0))

    def tips() -> Array:
        leak = catalogue()["black-level"]
        term = Term(leak, leak.rest() | {"grown": 0.003, "tint_x": 0.02, "tint_z": -0.13})
        problem = Problem.of(readings, baseline="native", selection="continuous")
        return anchored_tips(with_shared_errors(problem, (term,)).as_baked, (term,))

    exact, curve = tips(), TransferCurve.__call__
    for least in (1e-12, 1e-10, 1e-8):
        monkeypatch.setattr(TransferCurve, "__call__", lambda self, code, e=least: curve(self, code) * (1.0 + e))
        assert tips() == pytest.approx(exact, rel=1e-6)


def test_tips_of_a_display_with_residual_light_meet_their_readings() -> None:
    """The colour of each channel changes along its ramp; tips are solved from few readings, but predicted by all."""
    readings = bright_mixtures()
    alone = (readings.drive > 0).sum(axis=1, keepdims=True) == 1
    shifted = 0.05 * alone * np.sin(np.pi * readings.drive).sum(axis=1, keepdims=True) * [1.0, 0.0, -1.0]
    problem = Problem.of(readings.with_light(readings.xyz_cd_m2 * (1.0 + shifted)), baseline="native")
    assert problem.first_readings
    assert len(problem.first_readings.residual_light.ramps) == 3
    term = Term.at_rest(catalogue()["drive-loss"].since_first_session(), ("grown",), grown=0.05)
    for drive in ((1.0, 1.0, 1.0), (0.0, 1.0, 0.0)):
        last = problem.is_tip_anchor & (problem.hour_of == problem.hours.size - 1)
        last &= (problem.drive == drive).all(axis=1)
        predicted = anchored(problem, (term,))[last]
        assert predicted == pytest.approx(problem.xyz[last].mean(axis=0)[np.newaxis].repeat(last.sum(), axis=0), 2e-3)


def test_a_slip_of_the_first_session_says_little_of_its_colour() -> None:
    problem = Problem.of(bright_mixtures(), baseline="native")
    memory = problem.first_readings
    assert memory
    colour = int(memory.colour.max())
    drive = problem.readings.drive
    code = drive[problem.rows][memory.colour == colour][0]
    weights = np.where((drive == code).all(axis=1) & (problem.readings.hours == 0), 0.01, 1.0)
    slipped = replace(problem, weights=weights).first_readings
    assert slipped
    wider = np.where(memory.colour == colour, 10.0, 1.0)[:, np.newaxis, np.newaxis]
    assert slipped.error == pytest.approx(memory.error * wider, rel=1e-9)


@pytest.mark.parametrize("among", mostly_slow(AMONG, "effects near black"))
def test_a_dark_offset_that_differs_from_session_to_session_is_no_leak_of_a_native_display(among: str) -> None:
    readings = bright_mixtures()
    hours, place = np.unique(readings.hours, return_inverse=True)
    dark = np.random.default_rng(4).normal(0.0, 0.03, (hours.size, 3))[place.reshape(-1)]
    wandering = replace(readings, xyz_cd_m2=readings.xyz_cd_m2 + dark)
    problem = with_shared_errors(Problem.of(wandering, baseline="native"))
    assert problem.offset_cd_m2 > 5.0 * problem.noise.offset_cd_m2
    assert diagnose(wandering, baseline="native", without=AMONG[among]).verdict.name == "consistent"


@pytest.mark.parametrize(
    ("native", "hour", "wrong"),
    [
        (False, 0.0, (0.0,)),
        (True, 0.0, ()),
        (False, 500.0, (500.0,)),
        (False, 3000.0, (3000.0,)),
        (True, 3000.0, (3000.0,)),
    ],
)
def test_the_first_session_of_a_native_display_is_no_wrong_one(
    native: bool, hour: float, wrong: tuple[float, ...]
) -> None:
    """All later sessions differ from the first session if the display changes: this is no sign of a bad session."""
    hours = np.array([0.0, 500.0, 3000.0, 6000.0, 9000.0])
    hour_of = np.repeat(np.arange(5), 40)
    residual = (
        np.random.default_rng(1).normal(size=(200, 3)) * np.where(hours[hour_of] == hour, 30.0, 1.0)[:, np.newaxis]
    )
    problem = SimpleNamespace(
        from_first_hour=False, native=native or None, hours=hours, hour_of=hour_of, rows=np.arange(200),
        is_at_rest=np.ones(200, dtype=bool), is_tip_anchor=np.zeros(200, dtype=bool),
    )  # fmt: skip
    assert wrong_sessions(cast("Fit", SimpleNamespace(problem=problem, residual=residual)), 1.0) == wrong


@pytest.mark.parametrize("rounded", [(1,), (2, 3, 4, 5, 6)])
def test_a_session_that_agrees_with_the_first_is_not_wrong_although_all_later_ones_differ(
    rounded: tuple[int, ...],
) -> None:
    """Rounding from the third session on, where the display's own model has errors: the fit blames the first session.

    Most sessions have the rounding. So the second session, which agrees with the first, stands alone.
    """
    hours = (0.0, 900.0, 3000.0, 6000.0, 9000.0, 13_000.0, 18_000.0)
    campaign = Campaign(design="colours", hours=hours, seed=8)
    plain, steps = (
        read(csv_text(replace(campaign, hidden=hidden)), file="a.csv", sha256="")
        for hidden in ((), (("quantization", 1.0 / 63.0, "same"),))
    )
    has_steps = np.isin(plain.hours, [hours[at] for at in rounded])[:, np.newaxis]
    mixed = replace(plain, xyz_cd_m2=np.where(has_steps, steps.xyz_cd_m2, plain.xyz_cd_m2))
    base = fit(with_shared_errors(Problem.of(with_brighter_mixtures(mixed), baseline="native")))
    assert wrong_sessions(base, 1.0) == ((900.0,) if rounded == (1,) else ())


@pytest.mark.parametrize(
    ("bad", "at_rest", "wrong"),
    [
        ((1,), True, (500.0,)),
        ((1, 3), True, (500.0, 6000.0)),
        ((1, 4), True, (500.0, 9000.0)),
        ((3, 4), True, ()),
        ((1, 3), False, ()),
    ],
)
def test_a_session_is_wrong_where_other_later_ones_are_sound_and_not_for_conditions_that_others_lack(
    bad: tuple[int, ...], at_rest: bool, wrong: tuple[float, ...]
) -> None:
    hours, hour_of = np.array([0.0, 500.0, 3000.0, 6000.0, 9000.0]), np.repeat(np.arange(5), 60)
    rest = np.tile(np.arange(60) < 40, 5)
    size = np.where(np.isin(hour_of, bad) & (rest if at_rest else ~rest), 30.0, 1.0)[:, np.newaxis]
    problem = SimpleNamespace(
        from_first_hour=False, native=None, hours=hours, hour_of=hour_of, rows=np.arange(300),
        is_at_rest=rest, is_tip_anchor=np.zeros(300, dtype=bool),
    )  # fmt: skip
    residual = np.random.default_rng(1).normal(size=(300, 3)) * size
    assert wrong_sessions(cast("Fit", SimpleNamespace(problem=problem, residual=residual)), 1.0) == wrong


@pytest.mark.parametrize("native", [None, True])
def test_a_session_is_not_wrong_where_an_earlier_one_is_not_sound(native: bool | None) -> None:
    """After a recalibration at 6000 h, a fit of all sessions leaves most misfit at the hours before."""
    hours, hour_of = np.array([0.0, 2000.0, 4000.0, 6000.0, 8000.0, 10_000.0, 12_000.0]), np.repeat(np.arange(7), 40)
    problem = SimpleNamespace(
        from_first_hour=False, native=native, hours=hours, hour_of=hour_of, rows=np.arange(280),
        is_at_rest=np.ones(280, dtype=bool), is_tip_anchor=np.zeros(280, dtype=bool),
    )  # fmt: skip
    size = np.array([1.0, 5.0, 7.5, 3.0, 3.0, 3.0, 3.0])[hour_of]
    residual = np.random.default_rng(1).normal(size=(280, 3)) * size[:, np.newaxis]
    assert wrong_sessions(cast("Fit", SimpleNamespace(problem=problem, residual=residual)), 1.0) == ()


def test_a_session_of_white_and_primaries_alone_is_no_sound_one() -> None:
    """The misfit is at the last hour with mixtures. Later only white and primaries were read, which always fit."""
    hours, hour_of = np.array([0.0, 500.0, 3000.0, 6000.0, 9000.0, 9500.0]), np.repeat(np.arange(6), 40)
    problem = SimpleNamespace(
        from_first_hour=False, native=None, hours=hours, hour_of=hour_of, rows=np.arange(240),
        is_at_rest=np.ones(240, dtype=bool), is_tip_anchor=hour_of == 5,
    )  # fmt: skip
    size = np.array([1.0, 1.0, 1.0, 1.0, 30.0, 1.0])[hour_of]
    residual = np.random.default_rng(1).normal(size=(240, 3)) * size[:, np.newaxis]
    assert wrong_sessions(cast("Fit", SimpleNamespace(problem=problem, residual=residual)), 1.0) == ()


def test_the_first_session_is_not_wrong_where_later_ones_have_white_and_primaries_alone() -> None:
    hours, hour_of = np.array([0.0, 500.0, 3000.0, 6000.0, 9000.0]), np.repeat(np.arange(5), 40)
    problem = SimpleNamespace(
        from_first_hour=False, native=None, hours=hours, hour_of=hour_of, rows=np.arange(200),
        is_at_rest=np.ones(200, dtype=bool), is_tip_anchor=hour_of > 0,
    )  # fmt: skip
    residual = np.random.default_rng(1).normal(size=(200, 3)) * np.where(hour_of == 0, 30.0, 1.0)[:, np.newaxis]
    assert wrong_sessions(cast("Fit", SimpleNamespace(problem=problem, residual=residual)), 1.0) == ()


def test_of_an_effect_a_native_display_holds_what_was_there_at_first() -> None:
    """The sizes of an effect at hour 0 are then no unknowns."""
    sentence = catalogue()["crosstalk"].since_first_session()
    assert sentence.forms[0] == ("grown",)
    assert not {"new", "onset"} & {name for form in sentence.forms for name in form}
    assert sentence.rest()["onset"] == 0.0
    assert catalogue()["edge-falloff"].since_first_session() is catalogue()["edge-falloff"]


@pytest.mark.parametrize(("name", "size"), [("veiling-glare", {"glare": 0.1}), ("black-level", {"new": 0.02})])
def test_the_first_sessions_readings_contain_the_light_that_is_added_at_hour_0(
    name: str, size: dict[str, float]
) -> None:
    """Factor and offset take the effect out of the panel, so that the meter reads at hour 0 what it has read."""
    tips = np.array([[[95.0, 100.0, 109.0], [41.0, 21.0, 2.0], [36.0, 72.0, 12.0], [18.0, 7.0, 95.0]]])
    code = np.array([[1.0, 1.0, 1.0], [0.5, 0.5, 0.5], [0.2, 0.6, 0.1], [0.0, 0.0, 0.3]])
    scene = Scene(hours=np.zeros((1, 1)), code=code, white=tips[:, 0], fresh_white=tips[:, 0])
    plain = trace.panel((), scene, "continuous")
    term = Term.at_rest(catalogue()[name], (), **size)
    factor, offset = trace.since_first_session((term,), plain, plain, tips, scene)
    shown = trace.reported((term,), plain.relative_to_first_session(factor, offset), tips, scene)
    np.testing.assert_allclose(shown, plain.emit(tips), rtol=1e-12)
    # The effect alone would have changed the readings.
    assert np.abs(trace.reported((term,), plain, tips, scene) / plain.emit(tips) - 1.0).max() > 0.01
