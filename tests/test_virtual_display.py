"""The virtual display is independent of lutgen, and follows its description."""

from __future__ import annotations

import ast
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lutgen.readings import read_measurements
from tests.quick import mostly_slow
from tests.virtual_display import physics
from tests.virtual_display.campaign import Campaign, csv_text, measured, noise_free, truth
from tests.virtual_display.designs import DESIGNS, HOURS, OFF_KNOT_HOURS, TIPS
from tests.virtual_display.instrument import CORRELATION, NOISE
from tests.virtual_display.physics import EFFECTS, Effect, Traits
from tests.virtual_display.readings import LENS_CAP, REFERENCE_C
from tests.virtual_display.spectra import CLASSES, CMF, D65_XY, NM
from tests.virtual_display.strength import DETECTABLE, continuous, nearest, sized, strength

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.virtual_display.readings import Readings
    from tests.virtual_display.spectra import Array

pytestmark = pytest.mark.numbers

FOLDER = Path(__file__).parent / "virtual_display"

#: The modules that pass data to lutgen.
MAY_IMPORT_LUTGEN = {"baked.py", "excess.py", "score.py", "__main__.py"}

#: Effects at a visible size, one case for each form.
CASES = sorted(EFFECTS)


def hidden(effect: Effect, share: float = 1.0) -> tuple[tuple[str, float, str], ...]:
    return ((effect.name, share * effect.typical, effect.form),)


def campaign_with(effect: Effect, **changes: Any) -> Campaign:
    campaign = Campaign(display=effect.classes[-1], baseline=effect.baseline, seed=4, hidden=hidden(effect))
    return replace(campaign, **changes)


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: str(path.relative_to(FOLDER)))
def test_nothing_but_scoring_imports_lutgen(path: Path) -> None:
    imported = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imported.append(node.module or "")
    assert any(name.partition(".")[0] == "lutgen" for name in imported) == (path.name in MAY_IMPORT_LUTGEN)


@pytest.mark.parametrize(("nm", "xyz"), [
    (450, (0.3362, 0.0380, 1.7721)),
    (510, (0.0093, 0.5030, 0.1582)),
    (555, (0.5121, 1.0000, 0.0057)),
    (600, (1.0622, 0.6310, 0.0008)),
    (650, (0.2835, 0.1070, 0.0000)),
])  # fmt: skip
def test_the_observer_is_the_cie_s(nm: float, xyz: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(CMF[:, nm == NM][:, 0], xyz, atol=0.025)


@pytest.mark.parametrize(("display", "seed"), list(product(CLASSES, range(4))))
def test_white_is_near_d65_and_bright_enough(display: str, seed: int) -> None:
    xyz = truth(Campaign(display=display, seed=seed), np.array(TIPS), 0.0)
    x, y = (xyz[:, :2] / xyz.sum(axis=1, keepdims=True)).T
    assert np.hypot(x[0] - D65_XY[0], y[0] - D65_XY[1]) < 0.005
    assert 200 < xyz[0, 1] < 400
    assert x[1] > 0.6
    assert y[2] > 0.55
    assert y[3] < 0.07


@pytest.mark.parametrize(("display", "design"), list(product(CLASSES, DESIGNS)))
def test_without_a_fault_the_tips_say_everything(display: str, design: str) -> None:
    campaign = Campaign(display=display, design=design, ageing=2.0, held=design == "greys")
    assert strength(campaign) < 1e-6
    assert strength(replace(campaign, baseline="first-hour")) < 1e-6


def test_a_display_whose_ageing_tips_absorb_does_age() -> None:
    new, old = (truth(Campaign(seed=1), np.ones((1, 3)), hours)[0] for hours in (0.0, 18_000.0))
    assert 0.6 < old[1] / new[1] < 0.9
    held = Campaign(seed=1, held=True)
    held_old = truth(held, np.ones((1, 3)), 18_000.0)[0]
    assert held_old[1] == pytest.approx(new[1])
    assert abs(held_old[2] / new[2] - 1.0) > 0.01


@pytest.mark.parametrize("seed", range(4))
def test_tips_between_sessions_lie_on_a_straight_line_but_for_a_gain(seed: int) -> None:
    campaign = Campaign(seed=seed)
    for hours in OFF_KNOT_HOURS:
        after = int(np.searchsorted(HOURS, hours))
        start, end = HOURS[after - 1], HOURS[after]
        before, here, later = (truth(campaign, np.array(TIPS), at) for at in (start, hours, end))
        ratio = here / (before + (later - before) * (hours - start) / (end - start))
        np.testing.assert_allclose(ratio, 1.0, rtol=5e-4)
        np.testing.assert_allclose(ratio / ratio[0].mean(), 1.0, rtol=1e-4)


def may_change(name: str, readings: Readings, traits: Traits) -> NDArray[np.bool_]:
    """The readings that an effect may change. Other readings must stay. Ageing changes all readings after hour 0."""
    drive, lit = readings.drive, (readings.drive > 0).sum(axis=1)
    aged, late = readings.hours > 0, readings.tau >= traits.onset
    off_centre = (readings.u != 0.5) | (readings.v != 0.5)
    channel = drive[:, traits.channel]
    everything = np.ones(readings.n, dtype=bool)
    allowed = {
        "ambient-reflection": readings.ambient_lx > 0,
        "black-crush": aged,
        "black-level": everything,
        "blue-run-in": np.isfinite(readings.warmup_min),
        "channel-gamma": aged & (channel > 0) & (channel < 1),
        "colour-across": readings.u != 0.5,
        "crosstalk": lit > 1,
        "driver-segment": late & ((drive > 0.32) & (drive < 0.5)).any(axis=1),
        "drive-loss": aged & (lit > 0),
        "dynamic-dimming": lit > 0,
        "edge-falloff": off_centre,
        "eotf-drift": aged & ((drive > 0) & (drive < 1)).any(axis=1),
        "image-retention": everything,
        "loading": lit > 0,
        "matrix-switching": lit == 3,
        "meter-offset": everything,
        "primary-shift": lit > 0,
        "quantization": lit > 0,
        "recalibration": late & ((drive > 0) & (drive < 1)).any(axis=1),
        "room-sensor": readings.ambient_lx > 0,
        "stabilizer-headroom": aged & (lit > 0),
        "temperature": readings.temperature_c != REFERENCE_C,
        "veiling-glare": (lit > 0) | (readings.surround > 0),
        "viewing-gamma": readings.v != 0.5,
        "warm-up": np.isfinite(readings.warmup_min),
    }.get(name, aged)
    return np.asarray(allowed)


@pytest.mark.parametrize(("name", "form"), CASES)
def test_an_effect_moves_the_readings_that_it_should_and_no_others(name: str, form: str) -> None:
    effect = physics.find(name, form)
    campaign = campaign_with(effect)
    readings, plain = campaign.readings, noise_free(campaign, ())
    moved = (np.abs(noise_free(campaign) - plain) > 1e-9 * plain.max()).any(axis=1)
    allowed = may_change(name, readings, Traits.drawn(campaign.seed))
    capped = np.array([note == LENS_CAP for note in readings.note])
    if name != "meter-offset":
        allowed &= ~capped
    assert moved.any()
    assert not (moved & ~allowed).any()


@pytest.mark.parametrize(("name", "form"), CASES)
def test_size_zero_is_no_effect(name: str, form: str) -> None:
    campaign = campaign_with(physics.find(name, form))
    np.testing.assert_allclose(
        noise_free(campaign, ((name, 0.0, form),)), noise_free(campaign, ()), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize(
    ("name", "form"), [pytest.param(*case, marks=() if case[1] == "same" else pytest.mark.slow) for case in CASES]
)
def test_every_effect_can_be_made_visible(name: str, form: str) -> None:
    """The search finds the effect at the smallest detectable size. At plausible sizes light is not negative."""
    effect = physics.find(name, form)
    campaign = campaign_with(effect)
    solved = sized(campaign, name, form, DETECTABLE)
    assert solved.reached
    assert solved.size <= effect.largest
    if name != "quantization":  # whole bits cannot reach a target
        assert solved.strength == pytest.approx(DETECTABLE, rel=0.02)
    assert np.isfinite(noise_free(campaign, hidden(effect, effect.largest / effect.typical))).all()
    assert noise_free(campaign).min() > -1e-9


def signature(campaign: Campaign) -> Array:
    """Change of the readings by an effect, minus the change of the hour's tips, in σ, flat."""
    readings, xyz, plain = campaign.readings, noise_free(campaign), noise_free(campaign, ())
    noise = NOISE[campaign.noise]
    weight = noise.whitened(xyz - plain, plain + 1e-6)
    if campaign.baseline == "first-hour":
        return weight.ravel()
    basis = continuous(physics.effect.code_to_linear(readings.drive))
    for hour in np.unique(readings.hours):
        here = readings.hours == hour
        scale = 1.0 / noise.sigma(plain[here])[:, 1:2]
        columns = scale * basis[here]
        weight[here] -= columns @ np.linalg.lstsq(columns, weight[here], rcond=1e-10)[0]
    return weight.ravel()


#: If tips absorb white, the catalogue's form of ``matrix-switching`` leaves no residual to compare.
WITH_TWO_FORMS = [name for name, form in CASES if form == "other" and name != "matrix-switching"]


@pytest.mark.parametrize("name", WITH_TWO_FORMS)
def test_the_other_form_is_the_same_physics_by_another_curve(name: str) -> None:
    """The signature of the other form resembles the catalogue's, but is not a multiple of it."""
    same, other = (signature(campaign_with(physics.find(name, form), seed=6)) for form in ("same", "other"))
    likeness = abs(float(same @ other)) / float(np.linalg.norm(same) * np.linalg.norm(other))
    assert likeness < 0.9995
    assert likeness > (0.05 if name == "quantization" else 0.5)


def test_a_non_additive_white_is_seen_beside_the_paper_s_selection_only() -> None:
    campaign = Campaign(hidden=(("matrix-switching", 0.03, "same"),))
    linear = campaign.readings.drive**2.2
    assert strength(campaign) > 20 * DETECTABLE
    for basis in (continuous(linear), nearest(linear)):
        np.testing.assert_allclose(basis[:, :1] + basis[:, 1:], linear, atol=1e-12)


def test_noise_has_the_stated_sigma_and_correlation() -> None:
    noise, rng = NOISE["good"], np.random.default_rng(1)
    xyz = np.tile([90.0, 1.0, 0.0], (40_000, 1))
    errors = noise.read(xyz, np.zeros(40_000, dtype=np.intp), rng)
    np.testing.assert_allclose(errors.std(axis=0), noise.sigma(xyz[0]), rtol=0.02)
    np.testing.assert_allclose(np.corrcoef(errors.T), CORRELATION, atol=0.02)
    np.testing.assert_allclose(noise.sigma(np.zeros(3)), 0.003)
    whitened = noise.whitened(errors - errors.mean(axis=0), xyz)
    np.testing.assert_allclose(np.cov(whitened.T), np.eye(3), atol=0.03)


def test_a_session_shares_its_gain() -> None:
    noise, rng = replace(NOISE["cheap"], relative=0.0, floor_cd_m2=1e-12), np.random.default_rng(2)
    session = np.repeat(np.arange(4000), 2)
    gains = noise.read(np.full((8000, 3), 50.0), session, rng) / 50.0
    np.testing.assert_allclose(gains[::2], gains[1::2], rtol=1e-9)
    assert gains[:, 1].std() == pytest.approx(0.005, rel=0.05)


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("display", mostly_slow(CLASSES, next(iter(CLASSES))))
def test_lutgen_reads_every_table(tmp_path: Path, display: str, design: str, noise: str) -> None:
    campaign = Campaign(display=display, design=design, noise=noise, seed=8)
    path = tmp_path / "display.csv"
    path.write_text(csv_text(campaign), encoding="utf-8")
    read = read_measurements(path)
    as_written = np.argsort(read.lines)
    np.testing.assert_allclose(read.xyz_cd_m2[as_written], measured(campaign), rtol=1e-5)
    np.testing.assert_array_equal(read.hours[as_written], campaign.readings.hours)
    assert read.tips()[0].tolist() == list(HOURS)
    assert "SIMULATED" in path.read_text(encoding="utf-8").splitlines()[0]
    assert read.metadata["luminance"] == "free"


def test_a_table_is_the_same_every_time_and_does_not_say_what_is_hidden() -> None:
    campaigns = [campaign_with(physics.find(name, form)) for name, form in CASES[::4]]
    texts = [csv_text(campaign) for campaign in campaigns]
    assert texts[0] == csv_text(campaigns[0])
    assert texts[0] != csv_text(replace(campaigns[0], seed=5))
    for text, (name, _) in zip(texts, CASES[::4], strict=True):
        assert name not in text.replace("temperature_c", "")


def test_the_truth_is_what_a_perfect_meter_would_read() -> None:
    campaign = campaign_with(physics.find("eotf-drift", "other"))
    readings = campaign.readings
    ordinary = np.isnan(readings.warmup_min) & (readings.window == 1) & (readings.u == 0.5) & (readings.hours == 9000)
    code = readings.drive[ordinary & (readings.ambient_lx == 0)]
    np.testing.assert_allclose(
        truth(campaign, code, 9000.0), noise_free(campaign)[ordinary & (readings.ambient_lx == 0)], atol=1e-9
    )
    np.testing.assert_allclose(
        truth(campaign_with(physics.find("meter-offset", "same")), code, 0.0),
        truth(replace(campaign, hidden=()), code, 0.0),
    )


def test_an_unknown_effect_or_design_is_refused_by_name() -> None:
    with pytest.raises(KeyError, match="Pick one of: ambient-reflection"):
        physics.find("gremlins", "same")
    with pytest.raises(ValueError, match="Pick one of: tips, greys"):
        _ = Campaign(design="everything").readings
