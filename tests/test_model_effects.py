"""Models with effects: their values, their files, the LUTs baked from them, and refused input."""

from __future__ import annotations

import json
import pickle
import shutil
import tempfile
import tomllib
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skimage.io import imread, imsave

from lutgen.bake.build import BuildPlan, build
from lutgen.bake.check import check
from lutgen.bake.fidelity import CERTIFIED
from lutgen.bake.manifest import MANIFEST, model_as_json, model_from_json
from lutgen.cli import options
from lutgen.colorimetry import xyY_to_xyz
from lutgen.display import (
    MODES,
    REFERENCE,
    REFERENCES,
    SELECTIONS,
    AppliedEffect,
    Conditions,
    DisplayModel,
    Estimate,
    LatentTips,
    default_display,
    load_model,
    parse_at,
    save_model,
    what_luts_carry,
    what_pictures_carry,
)
from lutgen.display.aging import show
from lutgen.display.effect_chain import without_steps
from lutgen.display.tips import luminance_law
from lutgen.effects import catalogue
from lutgen.effects.expression import parse
from lutgen.effects.own import load_file
from lutgen.errors import LutgenError
from lutgen.pictures.apply import apply_to_image
from lutgen.readings import Measurements, read_measurements
from lutgen.readings.conditions import COLUMNS
from tests.command import error_of, exit_code
from tests.quick import draws, mostly_slow
from tests.twin import PAPER_LAW, Twin, rows_of_csv

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array
    from lutgen.effects import Effect

WHITE = np.ones((1, 3))
HOURS = (0.0, 2750.5, 10_000.0, 18_000.0)
MEASURED = luminance_law("measured")
LAW_HOURS, LAW_FACTORS = np.array(PAPER_LAW).T

GLOW = '''"""A glow over everything. Made up for tests."""
from lutgen.effects import Parameter, effect

@effect(stage="optics", neutral={"amount": 0.0},
        amount=Parameter(0.002, (0.0, 0.05), "1", "share of white over everything, at 18 000 h"))
def glow(xyz, scene, *, amount):
    return xyz + amount * scene.tau * scene.white
'''
LEAK = "leak: xyz + k*tau*white; k=0.002[0,0.05]"


@pytest.fixture(scope="module")
def colours() -> Array:
    random = np.random.default_rng(3)
    greys = np.repeat(np.linspace(0, 1, 52)[:, np.newaxis], 3, axis=1)
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T.astype(float)
    return np.concatenate([random.random((300, 3)), greys, corners])


def named(name: str, values: Mapping[str, float] | None = None) -> AppliedEffect:
    """A built-in effect with these values, and its other parameters at rest. The default is its typical values."""
    effect = catalogue()[name]
    return AppliedEffect.of(effect, effect.typical() if values is None else values)


def a_model(readings: Measurements, *effects: AppliedEffect, **options: Any) -> DisplayModel:
    return DisplayModel(readings, effects=effects, **options)


# Values of a model with effects


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("mode", MODES)
def test_effects_at_rest_leave_the_papers_model_as_it_is(
    mode: str, selection: str, reference: str, readings: Measurements, colours: Array
) -> None:
    effects = [named(name, each.rest()) for name, each in catalogue().items() if each.stage != "selection"]
    plain = DisplayModel(readings, reference=reference, selection=selection)
    for hours in HOURS:
        expected = plain.at(mode, hours).code_to_xyz(colours)
        light = replace(plain, effects=tuple(effects)).at(mode, hours).code_to_xyz(colours)
        # A meter's exposure or a lens cap has no effect here. Only rounding errors remain.
        np.testing.assert_allclose(light, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", [name for name, each in catalogue().items() if each.stage == "instrument"])
def test_effects_of_the_instrument_are_never_baked(name: str, readings: Measurements, colours: Array) -> None:
    plain, metered = DisplayModel(readings), a_model(readings, named(name))
    for mode in MODES:
        assert metered.at(mode, 10_000.0) == plain.at(mode, 10_000.0)
    np.testing.assert_array_equal(
        metered.at("chroma", 10_000.0).code_to_code(colours), plain.at("chroma", 10_000.0).code_to_code(colours)
    )


def test_matrix_switching_is_the_continuous_selection(readings: Measurements) -> None:
    continuous = DisplayModel(readings, selection="continuous")
    assert a_model(readings, named("matrix-switching")).at("chroma", 10_000.0) == continuous.at("chroma", 10_000.0)
    leaking = a_model(readings, named("matrix-switching"), named("black-level")).at("chroma", 10_000.0)
    assert leaking == replace(continuous, effects=(named("black-level"),)).at("chroma", 10_000.0)


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("selection", SELECTIONS)
def test_a_leak_is_what_it_is_when_written_out(
    selection: str, reference: str, readings: Measurements, colours: Array
) -> None:
    """XYZ = (XYZ of the paper's model + κ(t)·q·white), scaled to the mode's luminance; the un-aged white has Y = 1."""
    rows = rows_of_csv(default_display().read_text(encoding="utf-8"))
    new, grown, power, tint_x, tint_z = 0.004, 0.009, 1.7, 0.1, 0.4
    values = {"new": new, "grown": grown, "power": power, "tint_x": tint_x, "tint_z": tint_z}
    model = a_model(readings, named("black-level", values), selection=selection, reference=reference)
    for mode in MODES:
        for hours in HOURS:
            at = 0.0 if mode == "stable" else hours
            twin = Twin(rows, mode="chroma", hours=at, selection=selection, reference=reference)
            leak = (new + grown * (at / 18_000.0) ** power) * np.array([1.0 + tint_x, 1.0, 1.0 + tint_z])
            law = np.interp(hours, LAW_HOURS, LAW_FACTORS) if mode == "chroma-luma" else 1.0
            white = np.array(twin.xyz((1.0, 1.0, 1.0)))
            expected = [law * (np.array(twin.xyz((r, g, b))) + leak * white) / (1 + leak[1]) for r, g, b in colours]
            light = model.at(mode, hours).code_to_xyz(colours)
            np.testing.assert_allclose(light, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", catalogue())
@pytest.mark.parametrize("baseline", ["colour-points", "first-hour"])
def test_modes_keep_the_luminance_of_white_that_leaves_the_display(
    baseline: str, name: str, readings: Measurements
) -> None:
    effects = (named(name),) if catalogue()[name].stage != "viewing" else (named(name), named("black-level"))
    model = a_model(readings, *effects, baseline=baseline)
    for hours in HOURS:
        assert model.at("stable", hours).code_to_xyz(WHITE)[0, 1] == pytest.approx(
            model.at("chroma", 0.0).code_to_xyz(WHITE)[0, 1], abs=1e-12
        )
        if catalogue()[name].stage != "viewing":
            assert model.at("chroma", hours).code_to_xyz(WHITE)[0, 1] == pytest.approx(1.0, abs=1e-12)
            law = np.interp(hours, LAW_HOURS, LAW_FACTORS)
            assert model.at("chroma-luma", hours).code_to_xyz(WHITE)[0, 1] == pytest.approx(law, abs=1e-12)


@pytest.mark.parametrize("name", catalogue())
def test_stable_is_the_un_aged_display_with_its_effects(name: str, readings: Measurements, colours: Array) -> None:
    model = a_model(readings, named(name))
    stable, fresh = model.at("stable", 18_000.0), model.at("chroma", 0.0)
    np.testing.assert_allclose(stable.code_to_xyz(colours), fresh.code_to_xyz(colours), rtol=0, atol=1e-12)


def test_a_luminance_that_cannot_be_held_is_refused(readings: Measurements) -> None:
    # A constant light as bright as white: no backlight can reduce the sum to two thirds of white.
    glare = AppliedEffect.of(parse("glare: xyz + k*fresh_white; k=1[0,10]"), {"k": 1.0})
    with pytest.raises(LutgenError, match=r"hour 18000: no backlight brings white to .* cd/m² .*: glare\."):
        a_model(readings, glare).at("chroma-luma", 18_000.0)


def test_an_additive_light_that_stays_is_held_by_a_backlight_that_gives_way(readings: Measurements) -> None:
    """The added light is not proportional to the tips, so the gain needs a solver."""
    glare = AppliedEffect.of(parse("glare: xyz + k*tau*fresh_white; k=0.1[0,1]"), {"k": 0.2})
    aged = a_model(readings, glare, baseline="first-hour").at("chroma", 18_000.0)
    black, white = aged.code_to_xyz(np.array([[0.0] * 3, [1.0] * 3]))
    assert (black[1], white[1]) == (pytest.approx(0.2, abs=1e-12), pytest.approx(1.0, abs=1e-12))


def test_a_fresh_model_ages_by_its_effects_alone(readings: Measurements, colours: Array) -> None:
    plain = DisplayModel(readings, baseline="first-hour", luminance=MEASURED)
    for mode in MODES:
        np.testing.assert_allclose(plain.at(mode, 12_345.0).code_to_code(colours), colours, rtol=0, atol=1e-12)
    decay = named("backlight-decay", {"loss": 0.9, "beta": 1.4})
    fading = a_model(readings, decay, baseline="first-hour", luminance=MEASURED)
    share = np.exp(-0.9 * (12_345.0 / 18_000.0) ** 1.4)
    white = fading.at("chroma-luma", 12_345.0).code_to_xyz(WHITE)[0, 1]
    assert white == pytest.approx(share, abs=1e-12)
    assert fading.shown_tips(12_345.0)[0, 2] == pytest.approx(readings.tips()[1][0, 0, 2] * share, rel=1e-12)
    held = replace(fading, held=True).at("chroma-luma", 12_345.0)
    assert held.code_to_xyz(WHITE)[0, 1] == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(LutgenError, match="outside the measured span"):
        fading.at("chroma", 18_001.0)


def test_a_fresh_model_needs_no_tips_but_those_of_hour_0(readings: Measurements, tmp_path: Path) -> None:
    lines = default_display().read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line[0].isdigit() or line.startswith("0,")]
    (tmp_path / "mine.csv").write_text("\n".join([*kept, "9000,0.5,0.5,0.5,0.31,0.33,40", ""]))
    mine = read_measurements(tmp_path / "mine.csv")
    with pytest.raises(LutgenError, match="one time only"):
        DisplayModel(mine).at("chroma", 9000.0)
    model = a_model(mine, named("yellowing"), baseline="first-hour")
    np.testing.assert_array_equal(model.tips.hours, [0, 9000])
    everything = a_model(readings, named("yellowing"), baseline="first-hour")
    assert model.at("chroma", 9000.0) == everything.at("chroma", 9000.0)


def test_latent_tips_are_what_the_effects_act_on(readings: Measurements) -> None:
    """The latent tips are the measured tips minus a leak: with the leak, the display shows the measured tips."""
    hours, xyY = readings.tips()
    measured = xyY_to_xyz(xyY)
    leak = 0.01 * hours / 18_000.0
    # Each tip is leak-free light + κ·(leak-free white).
    white = measured[:, 0] / (1.0 + leak)[:, np.newaxis]
    latent = LatentTips(hours, measured - leak[:, np.newaxis, np.newaxis] * white[:, np.newaxis])
    model = a_model(readings, named("black-level", {"grown": 0.01}), latent=latent, reference="absolute")
    for hour in (0.0, 10_000.0, 18_000.0):
        np.testing.assert_allclose(model.shown_tips(hour), DisplayModel(readings).tips.at(hour), rtol=1e-12)
        plain = DisplayModel(readings, reference="absolute").at("chroma", hour)
        full = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        light = model.at("chroma", hour).code_to_xyz(full)
        np.testing.assert_allclose(light, plain.code_to_xyz(full), rtol=0, atol=1e-12)
    black = model.at("chroma", 18_000.0).code_to_xyz(np.zeros((1, 3)))[0, 1]
    assert black == pytest.approx(0.01 / 1.01, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "at"),
    [
        ("edge-falloff", {"u": 0.0, "v": 1.0}),
        ("ambient-reflection", {"ambient_lx": 60.0}),
        ("warm-up", {"warmup_min": 5.0}),
        ("temperature", {"temperature_c": 40.0}),
        ("loading", {"window": 0.1, "surround": 0.9}),
        ("veiling-glare", {"window": 0.1}),
    ],
)
def test_conditions_change_what_depends_on_them_and_nothing_else(
    name: str, at: dict[str, float], readings: Measurements, colours: Array
) -> None:
    model, conditions = a_model(readings, named(name)), Conditions(**at)
    usual = model.at("chroma", 10_000.0).code_to_xyz(colours)
    light = replace(model, conditions=conditions).at("chroma", 10_000.0).code_to_xyz(colours)
    assert np.abs(light - usual).max() > 1e-4
    plain = DisplayModel(readings)
    assert replace(plain, conditions=conditions).at("chroma", 10_000.0) == plain.at("chroma", 10_000.0)
    assert what_luts_carry(replace(plain, conditions=conditions))[1:] == [
        f"Nothing in this model depends on {stated}." for stated in at
    ]


def test_white_is_held_under_the_reference_conditions_so_a_cold_display_is_dimmer(readings: Measurements) -> None:
    cold = a_model(readings, named("warm-up"), conditions=Conditions(warmup_min=0.0)).at("chroma", 0.0)
    lost = catalogue()["warm-up"].parameters["amount"].value if "amount" in catalogue()["warm-up"].parameters else None
    white = cold.code_to_xyz(WHITE)[0, 1]
    assert white < 0.99
    if lost is not None:
        assert white == pytest.approx(1.0 - lost, abs=1e-9)


def test_effects_that_give_nan_are_named(readings: Measurements) -> None:
    model = a_model(readings, AppliedEffect.of(parse("broken: xyz + sqrt(1 - 9*k)*k*white; k=0.01[0,1]"), {"k": 0.5}))
    with pytest.raises(LutgenError, match=r"NaN or infinity for some colours.*broken"):
        model.at("chroma", 18_000.0)


# Applied effects and latent tips


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"newest": 0.1}, "unknown parameter of effect 'black-level' 'newest'. Pick one of: new, grown"),
        ({"new": 0.5}, "new = 0.5 lies outside its bounds 0..0.03"),
        ({"new": -0.001}, "outside its bounds"),
        ({"new": float("nan")}, "parameter 'new' is nan"),
        ({"power": float("inf")}, "parameter 'power' is inf"),
    ],
)
def test_values_that_the_effect_does_not_take_are_refused(values: dict[str, float], says: str) -> None:
    with pytest.raises(LutgenError) as error:
        named("black-level", values)
    assert says in str(error.value)


def test_every_parameter_needs_an_estimate_and_free_names_are_known() -> None:
    effect = catalogue()["black-level"]
    estimates = {name: Estimate(value) for name, value in effect.rest().items()}
    with pytest.raises(LutgenError, match="'newest'"):
        AppliedEffect(effect, estimates, ("newest",))
    del estimates["new"]
    with pytest.raises(LutgenError, match=r"parameter 'new' is missing.*share of white"):
        AppliedEffect(effect, estimates)


@pytest.mark.parametrize(
    ("hours", "xyz", "says"),
    [
        ([0.0, 1.0], np.ones((1, 4, 3)), "2 hours need 2 × 4 × 3 numbers"),
        ([0.0], np.ones((1, 3, 3)), "1 × 3 × 3"),
        ([], np.ones((0, 4, 3)), "0 hours"),
        ([1.0, 2.0], np.ones((2, 4, 3)), "increase from 0"),
        ([0.0, 0.0], np.ones((2, 4, 3)), "increase from 0"),
        ([0.0, np.nan], np.ones((2, 4, 3)), "increase from 0"),
        ([0.0], np.full((1, 4, 3), np.nan), "finite numbers"),
        ([0.0], -np.ones((1, 4, 3)), "above 0"),
    ],
)
def test_latent_tips_that_are_no_history_are_refused(hours: Any, xyz: Any, says: str) -> None:
    with pytest.raises(LutgenError) as error:
        LatentTips(hours, xyz)
    assert says in str(error.value)


def test_models_with_singular_tips_or_an_effect_twice_are_refused(readings: Measurements) -> None:
    hours, xyY = readings.tips()
    line = np.repeat(xyY_to_xyz(xyY[:, :1]), 4, axis=1) * np.array([1.0, 0.3, 0.4, 0.3])[:, np.newaxis]
    with pytest.raises(LutgenError, match=r"fitted white and primaries of .*lie on one line"):
        DisplayModel(readings, latent=LatentTips(hours, line))
    with pytest.raises(LutgenError, match="'black-level' is given twice"):
        a_model(readings, named("black-level"), named("black-level", {"new": 0.0}))
    with pytest.raises(LutgenError, match=r"unknown baseline 'old'\. Pick one of: colour-points, first-hour"):
        DisplayModel(readings, baseline="old")


def test_effects_stand_in_the_order_of_the_light_whatever_the_order_of_adding(readings: Measurements) -> None:
    names = ("black-level", "drive-loss", "crosstalk", "edge-falloff", "meter-offset")
    model = a_model(readings, *map(named, names))
    order = [each.effect.name for each in model.effects]
    assert order == ["drive-loss", "crosstalk", "black-level", "edge-falloff", "meter-offset"]
    assert a_model(readings, *map(named, reversed(names))).at("chroma", 1.0) == model.at("chroma", 1.0)


def test_displays_with_effects_can_be_compared_hashed_and_sent_to_workers(
    readings: Measurements, tmp_path: Path
) -> None:
    (tmp_path / "glow.py").write_text(GLOW)
    (glow,) = load_file(tmp_path / "glow.py")
    applied = (named("eotf-drift"), AppliedEffect.of(glow, glow.typical()), AppliedEffect.of(parse(LEAK), {"k": 0.01}))
    model = a_model(readings, *applied)
    aged, again = model.at("chroma", 10_000.0), pickle.loads(pickle.dumps(model)).at("chroma", 10_000.0)  # noqa: S301
    assert aged == again
    assert hash((aged.head, aged.tail)) == hash((again.head, again.tail))
    assert aged != model.at("chroma", 10_001.0)
    assert aged != a_model(readings, *applied[:2]).at("chroma", 10_000.0)


# Model files


def refined(readings: Measurements, *effects: AppliedEffect, **options: Any) -> DisplayModel:
    """A model as refine makes it, with every entry that a file can hold."""
    hours, xyY = readings.tips()
    applied = AppliedEffect(
        catalogue()["black-level"],
        {name: Estimate(value) for name, value in catalogue()["black-level"].rest().items()}
        | {"grown": Estimate(0.1 / 3, 1e-5, at_bound=False), "tint_z": Estimate(1.0, 0.25, at_bound=True)},
        ("grown", "tint_z"),
    )
    everything: dict[str, Any] = {
        "selection": "continuous",
        "latent": LatentTips(hours, xyY_to_xyz(xyY)),
        "conditions": Conditions(ambient_lx=60.0),
        "verdict": "named",
        "fit": {
            "sentence": 'Black "leaks"; κ = 0.033.',
            "readings": np.int64(640),
            "rms_sigma_after": np.float64(1.02),
        },
    }
    return a_model(readings, applied, *effects, **everything | options)


def same(model: DisplayModel, other: DisplayModel) -> None:
    """Fail unless the two models are equal."""
    assert model.effects == other.effects
    assert model.measurements.sha256 == other.measurements.sha256
    for field in ("reference", "selection", "luminance", "baseline", "held", "conditions", "verdict", "fit"):
        assert getattr(model, field) == getattr(other, field), field
    if model.latent is None or other.latent is None:
        assert model.latent is other.latent
    else:
        np.testing.assert_array_equal(model.latent.hours, other.latent.hours)
        np.testing.assert_array_equal(model.latent.xyz_cd_m2, other.latent.xyz_cd_m2)


def test_a_saved_model_is_read_back_whole(readings: Measurements, tmp_path: Path) -> None:
    model = refined(readings, named("edge-falloff"), named("meter-offset"))
    save_model(model, tmp_path / "my.toml")
    again = load_model(tmp_path / "my.toml")
    same(model, again)
    assert again.at("chroma", 9000.0) == model.at("chroma", 9000.0)
    save_model(again, tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_bytes() == (tmp_path / "my.toml").read_bytes()
    content = tomllib.loads((tmp_path / "my.toml").read_text(encoding="utf-8"))
    assert [each["name"] for each in content["effects"]] == ["black-level", "edge-falloff", "meter-offset"]
    grown = content["effects"][0]["parameters"]["grown"]
    assert grown == {
        "value": 0.1 / 3, "stderr": 1e-5, "unit": "1", "bounds": [-0.03, 0.06], "free": True, "at_bound": False,
    }  # fmt: skip


def test_saving_replaces_nothing_unasked(readings: Measurements, tmp_path: Path) -> None:
    path = tmp_path / "my.toml"
    path.write_text("mine")
    with pytest.raises(LutgenError, match=r"exists already\. Add --force"):
        save_model(refined(readings), path)
    assert path.read_text() == "mine"
    save_model(refined(readings), path, force=True)
    same(load_model(path), refined(readings))
    with pytest.raises(LutgenError, match="is a folder"):
        save_model(refined(readings), tmp_path, force=True)
    with pytest.raises(LutgenError, match="come from no file"):
        save_model(replace(refined(readings), measurements=replace(readings, sha256="")), tmp_path / "other.toml")


@given(
    new=st.floats(0.0, 0.03),
    power=st.floats(0.3, 3.0),
    stderr=st.none() | st.floats(0.0, 1e300),
    text=st.text(st.characters(codec="utf-8"), max_size=30),
    number=st.floats(allow_nan=False, allow_infinity=False),
    at_bound=st.booleans(),
)
@draws(32)
def test_every_number_and_text_survives_a_file(
    *, new: float, power: float, stderr: float | None, text: str, number: float, at_bound: bool
) -> None:
    readings = read_measurements(default_display())
    effect = catalogue()["black-level"]
    estimates = {name: Estimate(value) for name, value in effect.rest().items()}
    estimates |= {"new": Estimate(new, stderr, at_bound), "power": Estimate(power)}
    fit = {f"{text} text": text, "number": number}
    model = a_model(readings, AppliedEffect(effect, estimates, ("new",)), verdict=text, fit=fit)
    with tempfile.TemporaryDirectory() as folder:
        save_model(model, Path(folder) / "a.toml")
        again = load_model(Path(folder) / "a.toml")
        save_model(again, Path(folder) / "b.toml")
        assert (Path(folder) / "a.toml").read_bytes() == (Path(folder) / "b.toml").read_bytes()
    same(model, again)


def test_readings_are_named_relative_to_the_file_and_must_not_have_changed(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    shutil.copyfile(default_display(), tmp_path / "data" / "mine.csv")
    mine = read_measurements(tmp_path / "data" / "mine.csv")
    save_model(refined(mine, luminance=luminance_law("measured")), tmp_path / "models.d/my.toml")
    content = tomllib.loads((tmp_path / "models.d/my.toml").read_text(encoding="utf-8"))
    assert content["display"] == {"file": "../data/mine.csv", "sha256": mine.sha256}
    assert load_model(tmp_path / "models.d/my.toml").luminance == luminance_law("measured")
    text = (tmp_path / "data/mine.csv").read_text()
    (tmp_path / "data/mine.csv").write_text(text.replace("0.31270", "0.31280", 1))
    with pytest.raises(LutgenError, match=r"my\.toml: the readings .*mine\.csv have changed.*lutgen refine"):
        load_model(tmp_path / "models.d/my.toml")


def test_a_luminance_table_of_the_users_own_is_kept_in_the_file(readings: Measurements, tmp_path: Path) -> None:
    (tmp_path / "law.csv").write_text("hour,factor\n0,1\n5000,1.05\n20000,0.2\n")
    law = luminance_law(str(tmp_path / "law.csv"))
    save_model(DisplayModel(readings, luminance=law), tmp_path / "my.toml")
    (tmp_path / "law.csv").unlink()
    assert load_model(tmp_path / "my.toml").luminance == law


def test_own_effects_are_found_again_by_their_file_or_their_text(readings: Measurements, tmp_path: Path) -> None:
    (tmp_path / "effects").mkdir()
    file = tmp_path / "effects" / "glow.py"
    file.write_text(GLOW)
    (glow,) = load_file(file)
    model = a_model(readings, AppliedEffect.of(glow, {"amount": 0.01}), AppliedEffect.of(parse(LEAK), {"k": 0.003}))
    path = tmp_path / "my.toml"
    save_model(model, path)
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    assert [each["origin"] for each in content["effects"]] == ["effects/glow.py", LEAK]
    assert load_model(path).at("chroma", 9000.0) == model.at("chroma", 9000.0)
    file.write_text(GLOW.replace("+ amount", "- amount"))
    with pytest.raises(LutgenError, match=r"effect 'glow': its file .*glow\.py has changed"):
        load_model(path)
    assert load_model(path, effects={"glow": glow}).effects == model.effects
    file.unlink()
    with pytest.raises(LutgenError, match=r"effect 'glow': cannot read its file .*glow\.py: no such file"):
        load_model(path)


def test_an_effect_that_a_program_declared_cannot_be_saved(readings: Measurements, tmp_path: Path) -> None:
    declared: Effect = replace(catalogue()["black-level"], name="of-mine", origin="code, module tests")
    with pytest.raises(LutgenError, match=r"effect 'of-mine' was declared in code.*Put it into a \.py file"):
        save_model(a_model(readings, AppliedEffect.of(declared, {})), tmp_path / "my.toml")


EFFECT = '[[effects]]\nname = "black-level"\n'
WHOLE = EFFECT + "".join(
    f"[effects.parameters.{name}]\nvalue = {value}\n" for name, value in catalogue()["black-level"].rest().items()
)
TIPS = "[tips]\nhours = [0.0, 9000.0]\nxyz_cd_m2 = "
LIGHT = "[[95.0, 100.0, 108.0], [41.0, 21.0, 2.0], [36.0, 72.0, 12.0], [18.0, 7.0, 95.0]]"

BAD_FILES: list[tuple[str, str]] = [
    ("schema = 9", "schema is 9; this version of lutgen reads `schema = 1`"),
    ("schema = 1\n[fit", "not a model file (TOML)"),
    ("colour = 3", "unknown key 'colour' in the file. Pick one of: schema, display"),
    ("[model]\nbaselin = 'colour-points'", "unknown key 'baselin' in [model]. Pick one of: baseline"),
    ("[model]\nbaseline = 'tip'", "unknown baseline 'tip'. Pick one of: colour-points, first-hour"),
    ("[model]\nheld = 'yes'", "[model]: held is 'yes'; it must be true or false"),
    ("[model]\nselection = 3", "[model]: selection is 3; it must be a text"),
    ("[model]\nluminance_table = [[0.0, 1.0, 3.0]]", "rows of two numbers"),
    ("[model]\nluminance = 'law'\nluminance_table = [[0.0, 1.0]]", "at least two rows"),
    ("[display]\nsha256 = 'abc'", "have changed since the model was made"),
    ("[display]\nfile = 'none.csv'", "none.csv"),
    ("[conditions]\nlux = 60", "unknown condition 'lux'. Pick one of: u, v, ambient_lx"),
    ("[conditions]\nu = 3", "condition u = 3: must be the position from the left"),
    ("[conditions]\nu = 'left'", "[conditions]: u is 'left'; it must be a finite number"),
    ("[conditions]\nu = nan", "[conditions]: u is nan; it must be a finite number"),
    ("[fit]\nverdict = 3", "[fit]: verdict is 3; it must be a text"),
    ("[fit]\nrms = [1.0]", "[fit]: rms is [1.0]; it must be a text or a number"),
    ("fit = 3", "[fit] is a table, not 3"),
    ("effects = 3", "effects is a list of tables"),
    ("effects = [3]", "[[effects]] is a table, not 3"),
    ("[[effects]]", "unknown effect ''. Pick one of: "),
    ("[[effects]]\nname = 'black'", "unknown effect 'black'. Pick one of: "),
    ("[[effects]]\nname = 'black'\norigin = 'none.py'", "cannot read its file"),
    ("[[effects]]\nname = 'glow'\norigin = 'xyz + + k'", "xyz + + k"),
    (EFFECT + "stage = 'optics'", "unknown key 'stage' in [[effects]]"),
    (EFFECT, "parameter 'new' is missing"),
    (WHOLE.replace("[effects.parameters.new]\nvalue = 0.0\n", ""), "parameter 'new' is missing"),
    (WHOLE + "[effects.parameters.newest]\nvalue = 0.0", "unknown parameter of effect 'black-level' 'newest'"),
    (WHOLE.replace("new]\nvalue = 0.0", "new]\nvalue = 0.5"), "new = 0.5 lies outside its bounds 0..0.03"),
    (WHOLE.replace("new]\nvalue = 0.0", "new]\nvalue = nan"), "'new': value is nan; it must be a finite number"),
    (WHOLE.replace("new]\nvalue = 0.0", "new]\nvalue = 'much'"), "'new': value is 'much'; it must be a finite number"),
    (WHOLE.replace("new]\nvalue = 0.0", "new]\nvalue = true"), "'new': value is True; it must be a finite number"),
    (WHOLE.replace("new]\nvalue = 0.0", "new]\nstderr = 0.0"), "'new': value is missing; it must be a finite number"),
    (WHOLE.replace("new]\n", "new]\nstderr = -1.0\n"), "a standard error is never negative"),
    (WHOLE.replace("new]\n", "new]\nunit = 'cd/m²'\n"), "its unit is 'cd/m²', but the effect takes '1'"),
    (WHOLE.replace("new]\n", "new]\nbounds = [0.0]\n"), "bounds are two numbers"),
    (WHOLE.replace("new]\n", "new]\nfree = 1\n"), "'new': free is 1; it must be true or false"),
    (WHOLE.replace("new]\n", "new]\nerror = 1\n"), "unknown key 'error' in effect 'black-level': parameter 'new'"),
    (WHOLE + WHOLE, "'black-level' is given twice"),
    (EFFECT + "parameters = 3", "[parameters] is a table, not 3"),
    (TIPS + "[]", "2 hours need 2 × 4 × 3 numbers"),
    (TIPS + f"[{LIGHT}]", "these are 1 × 4 × 3"),
    (TIPS + f"[{LIGHT}, {LIGHT[:-1]}]", "not a model file"),
    (TIPS + f"[{LIGHT}, [[1.0]]]", "xyz_cd_m2 is [[["),
    (TIPS.replace("9000.0", "0.0") + f"[{LIGHT}, {LIGHT}]", "hours must be finite and increase from 0"),
    (TIPS + f"[{LIGHT}, {LIGHT.replace('100.0', 'nan')}]", "must be finite numbers"),
    (TIPS + f"[{LIGHT}, {LIGHT.replace('100.0', '-100.0')}]", "above 0 cd/m²"),
    (TIPS + f"[{LIGHT}, [{', '.join(4 * ['[95.0, 100.0, 108.0]'])}]]", "lie on one line"),
    ("[tips]\nhour = [0.0]", "unknown key 'hour' in [tips]. Pick one of: hours, xyz_cd_m2"),
    ("[covariance]\nmatrix = [[1.0]]", "unknown key 'matrix' in [covariance]. Pick one of: of, rows"),
    ("[covariance]\nof = ['black-level.new']", "[covariance]: of is a list of EFFECT.PARAMETER"),
    ("[covariance]\nof = ['new']\nrows = [[1.0]]", "[covariance]: of is a list of EFFECT.PARAMETER"),
    ("[covariance]\nof = ['a.b', 'a.c']\nrows = [[1.0], [1.0]]", "one in the first row, and one more in each"),
    ("[covariance]\nof = ['a.b']\nrows = [['much']]", "rows are lists of numbers"),
    ("[covariance]\nof = ['a.b']\nrows = [[1.0]]", "a.b is not a fitted parameter"),
    (WHOLE + "[covariance]\nof = ['black-level.new']\nrows = [[1.0]]", "black-level.new is not a fitted parameter"),
]


@pytest.mark.parametrize(("text", "says"), BAD_FILES, ids=range(len(BAD_FILES)))
def test_a_bad_model_file_is_one_sentence_and_exit_code_2(
    text: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text if text.startswith("schema") else f"schema = 1\n{text}\n", encoding="utf-8")
    code = exit_code(monkeypatch, "build", "--model", path, "-o", tmp_path / "out", "--hours", "0")
    output = capsys.readouterr()
    assert (code, output.out) == (2, "")
    assert output.err.startswith(f"lutgen: error: {path}: ")
    assert output.err.count("\n") == 1
    assert says in output.err
    assert not (tmp_path / "out").exists()


# --at


def test_conditions_are_named_alike_everywhere() -> None:
    assert list(REFERENCE.as_dict()) == list(COLUMNS)


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        ((), {}),
        (("ambient_lx=60",), {"ambient_lx": 60}),
        (("u=0,v=1", "window=0.1"), {"u": 0, "v": 1, "window": 0.1}),
        ((" surround = 0.5 , temperature_c = -3 ",), {"surround": 0.5, "temperature_c": -3}),
        (("warmup_min=5",), {"warmup_min": 5}),
        (("warmup_min=warm",), {}),
    ],
)
def test_at_reads_lists_and_repetitions(texts: tuple[str, ...], expected: dict[str, float]) -> None:
    assert parse_at(texts).stated() == expected


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("ambient_lx", "write NAME=VALUE, such as ambient_lx=60. Names: u, v, ambient_lx"),
        ("", "write NAME=VALUE"),
        ("u=0,", "write NAME=VALUE"),
        ("lux=60", "unknown condition 'lux'. Pick one of: u, v, ambient_lx, warmup_min"),
        ("u=left", "'left' is not a number"),
        ("u=0,5", "write NAME=VALUE"),
        ("u=0,u=1", "gives u twice"),
        ("u=2", "the position from the left, 0..1"),
        ("ambient_lx=-1", "light in lux"),
        ("ambient_lx=nan", "give a finite number"),
        ("ambient_lx=inf", "give a finite number"),
        ("warmup_min=inf", "give a finite number"),
        ("window=0", "share of the screen"),
        ("temperature_c=500", "degrees Celsius"),
    ],
)
def test_conditions_that_are_not_allowed_are_one_sentence(
    text: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in (("build", "-o", tmp_path / "out"), ("show",), ("apply", "x.png", "-o", tmp_path / "y.png")):
        more = ("--mode", "chroma", "--hours", "1") if command[0] == "apply" else ()
        assert exit_code(monkeypatch, *command, *more, "--at", text) == 2
        output = capsys.readouterr()
        assert says in error_of(output.err)
        assert output.err.startswith("lutgen: error: ")


def test_conditions_of_the_command_line_come_over_those_of_the_file(readings: Measurements, tmp_path: Path) -> None:
    save_model(refined(readings, conditions=Conditions(u=0.0, ambient_lx=9.0)), tmp_path / "my.toml")
    model = options.model_from(
        display=None, model=str(tmp_path / "my.toml"), selection=None, reference=None, luminance=None, at=("u=1",)
    )
    assert model.conditions == Conditions(u=1.0, ambient_lx=9.0)


def test_what_luts_carry_names_what_is_fixed_and_what_is_left_out(readings: Measurements) -> None:
    effects = ("black-level", "edge-falloff", "ambient-reflection", "warm-up", "meter-offset", "quantization")
    model = a_model(readings, *map(named, effects))
    quantized = (
        "quantization gives the curves steps that are smaller than the spacing of a LUT; the error is part of 'border'."
    )
    assert what_luts_carry(model) == [
        "Baked at: centre, dark room, warm.",
        "warm-up depends on the minutes since power-on, which a LUT cannot carry.",
        "edge-falloff depends on position, which a LUT cannot carry.",
        "ambient-reflection depends on the room's light, which a LUT cannot carry.",
        "meter-offset is left out: it belongs to the instrument, not to the display.",
        quantized,
    ]
    elsewhere = replace(model, conditions=Conditions(u=0.1, ambient_lx=60, warmup_min=5, temperature_c=30, window=0.1))
    assert what_pictures_carry(elsewhere)[0] == (
        "Shown at: position u = 0.1, v = 0.5, room light 60 lx, 5 min after power-on, 30 °C, a window of 10 % in a "
        "surround of code value 0."
    )
    assert what_luts_carry(a_model(readings, named("black-level"))) == []
    assert what_luts_carry(DisplayModel(readings)) == []


# Baking


@pytest.mark.parametrize("name", mostly_slow(catalogue(), "black-level", "eotf-drift"))
def test_every_effect_builds_checks_and_applies(name: str, readings: Measurements, tmp_path: Path) -> None:
    effect = catalogue()[name]
    model = a_model(readings, named(name), baseline=effect.baseline)
    built = build(model, BuildPlan((9000.0,), modes=("chroma",)), tmp_path / "built", jobs=1)
    result = check(tmp_path / "built", jobs=1)
    assert result.findings == ()
    for path, certificate in result.certificates.items():
        if name == "quantization":
            # 8-bit steps: a table that smooths the steps has an error of half a step at most, 0.25 step in the mean.
            assert (certificate.smooth.colours, certificate.gamut.colours) == (0, 0)
            assert certificate.border.mean < 0.35
        else:
            assert certificate.smooth.max < (0.5 if path.endswith(".cube") else 0.2), path
            assert certificate.smooth.p99 < (0.05 if path.endswith(".cube") else 0.04), path
            assert certificate.smooth.colours > 0.59 * sum(CERTIFIED)
    assert [record.kind for record in built.manifest.files].count("lut") == 2
    picture = np.random.default_rng(4).integers(0, 256, (16, 16, 3), dtype=np.uint8)
    imsave(tmp_path / "in.png", picture, check_contrast=False)
    aged = model.at("chroma", 9000.0)
    apply_to_image(tmp_path / "in.png", tmp_path / "out.png", aged)
    expected = np.rint(aged.code_to_code(picture / 255) * 255)
    assert np.abs(imread(tmp_path / "out.png") - expected).max() <= 0.5


def test_effects_that_only_add_and_scale_light_need_a_clf_of_eight_points(
    readings: Measurements, tmp_path: Path
) -> None:
    effects = [named(name) for name in ("black-level", "edge-falloff", "yellowing", "channel-decay")]
    model = a_model(readings, *effects, selection="continuous")
    plan = BuildPlan((9000.0, 18_000.0), modes=("chroma", "chroma-luma"), formats=("clf",))
    built = build(model, plan, tmp_path / "built", jobs=1)
    for record in built.manifest.files:
        if record.kind == "lut":
            assert (record.size, record.space) == (2, "linear")
            assert record.certificate is not None
            assert record.certificate["smooth"]["max"] < 0.005
            assert record.bytes < 5000


def test_stairs_are_found_and_nothing_else_is_taken_for_them(readings: Measurements) -> None:
    for name in catalogue():
        aged = a_model(readings, named(name)).at("chroma", 18_000.0)
        assert (without_steps(aged) is not None) == (name == "quantization"), name
    for bits in (4.0, 12.0):
        stepped = a_model(readings, named("quantization", {"bits": bits}), named("drive-loss")).at("chroma", 9000.0)
        smooth = without_steps(stepped)
        assert smooth is not None
        assert [each.effect.name for link in smooth.tail[:1] for each in link.applied] == ["drive-loss"]  # type: ignore[attr-defined]
    knee = AppliedEffect.of(parse("knee: min(code, 1 - k); k=0.1[0,1]"), {"k": 0.7})
    assert without_steps(a_model(readings, knee).at("chroma", 0.0)) is None


@pytest.mark.slow
def test_two_processes_write_the_bytes_of_one_with_own_effects_too(readings: Measurements, tmp_path: Path) -> None:
    (tmp_path / "glow.py").write_text(GLOW)
    (glow,) = load_file(tmp_path / "glow.py")
    model = a_model(readings, AppliedEffect.of(glow, glow.typical()), AppliedEffect.of(parse(LEAK), {"k": 0.01}))
    plan = BuildPlan((0.0, 3333.3, 10_000.0), modes=tuple(MODES), cubesize=17)
    build(model, plan, tmp_path / "one", jobs=1)
    build(model, plan, tmp_path / "two", jobs=2)
    for file in (tmp_path / "one").rglob("*.*"):
        if file.is_file():
            assert file.read_bytes() == (tmp_path / "two" / file.relative_to(tmp_path / "one")).read_bytes()
    assert check(tmp_path / "two", jobs=2).passed


def test_a_lut_says_which_effects_and_conditions_it_holds(readings: Measurements, tmp_path: Path) -> None:
    model = refined(readings, named("edge-falloff"), baseline="first-hour", conditions=Conditions(u=0.0))
    build(model, BuildPlan((9000.0,), modes=("chroma",), cubesize=17, certify=False), tmp_path / "built", jobs=1)
    for name in ("aged.cube", "aged.clf"):
        text = (tmp_path / "built/chroma/9000h" / name).read_text(encoding="utf-8")
        assert "effect: black-level (new 0, grown 0.0333333, " in text
        assert "effect: edge-falloff (" in text
        assert "at: u = 0" in text
        assert "baseline: white and primaries of hour 0 alone" in text
    content = json.loads((tmp_path / "built" / MANIFEST).read_text(encoding="utf-8"))["model"]
    assert content["carries"] == what_luts_carry(model)
    assert content["conditions"] == {"u": 0.0}


def test_colours_beyond_what_a_table_holds_are_refused(readings: Measurements, tmp_path: Path) -> None:
    reflecting = named("ambient-reflection", {"reflectance": 0.6})
    sunlit = a_model(readings, reflecting, conditions=Conditions(ambient_lx=200_000.0))
    plan = BuildPlan((0.0,), modes=("chroma",), formats=("clf",), certify=False)
    with pytest.raises(LutgenError, match=r"chroma at 0 h: colours reach .* times what a viewer shows.*--at"):
        build(sunlit, plan, tmp_path / "built", jobs=1)


# The manifest, and stale builds


@pytest.mark.parametrize("baseline", ["colour-points", "first-hour"])
def test_a_manifest_gives_the_model_back(baseline: str, readings: Measurements, tmp_path: Path) -> None:
    model = refined(
        readings, named("phosphor-wear"), named("meter-drift"), baseline=baseline, held=baseline == "first-hour"
    )
    content = json.loads(json.dumps(model_as_json(model, tmp_path)))
    again = model_from_json(content, where=str(tmp_path / MANIFEST))
    assert again.at("chroma", 9000.0).code_to_xyz(WHITE) == pytest.approx(
        model.at("chroma", 9000.0).code_to_xyz(WHITE), abs=1e-12
    )
    assert json.loads(json.dumps(model_as_json(again, tmp_path)))["effects"] == content["effects"]
    assert (again.held, again.baseline, again.conditions) == (model.held, model.baseline, model.conditions)


def test_a_model_without_effects_adds_nothing_to_the_manifest(readings: Measurements, tmp_path: Path) -> None:
    (tmp_path / "plain.toml").write_text("schema = 1\n")
    for model in (DisplayModel(readings), load_model(tmp_path / "plain.toml")):
        assert set(model_as_json(model, tmp_path)) == {"display", "reference", "selection", "luminance"}


@pytest.fixture(scope="module")
def pristine(readings: Measurements, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a model of an own effect, and its build."""
    folder = tmp_path_factory.mktemp("glow")
    (folder / "glow.py").write_text(GLOW)
    (glow,) = load_file(folder / "glow.py")
    save_model(a_model(readings, AppliedEffect.of(glow, {"amount": 0.01})), folder / "my.toml")
    plan = BuildPlan((9000.0,), modes=("chroma",), formats=("clf",), cubesize=17)
    build(load_model(folder / "my.toml"), plan, folder / "built", jobs=1)
    return folder


@pytest.fixture
def built(pristine: Path, tmp_path: Path) -> Path:
    """A copy of that folder for a test to change."""
    return Path(shutil.copytree(pristine, tmp_path, dirs_exist_ok=True))


def problems(folder: Path, model: DisplayModel | None = None) -> str:
    result = check(folder / "built", model=model, jobs=1)
    return "\n".join([*(finding.problem for finding in result.findings), *result.remarks])


def test_a_build_is_true_to_its_own_model(built: Path) -> None:
    assert problems(built) == ""
    assert problems(built, load_model(built / "my.toml")) == ""


@pytest.mark.slow
def test_a_build_is_stale_when_its_model_has_changed(built: Path) -> None:
    text = (built / "my.toml").read_text(encoding="utf-8")
    (built / "my.toml").write_text(text.replace("value = 0.01 ", "value = 0.010001 "), encoding="utf-8")
    stale = "stale: the build was made from another version of the model my.toml; build again"
    assert problems(built) == stale
    assert problems(built, load_model(built / "my.toml")) == stale
    (built / "my.toml").write_text("schema = 1\n[")
    assert problems(built).startswith("stale: the model has changed and cannot be read")
    (built / "my.toml").unlink()
    assert problems(built) == "the model file my.toml was not found; its copy in the manifest was used"


def test_a_build_needs_the_files_of_its_own_effects(built: Path) -> None:
    (built / "glow.py").write_text(GLOW.replace("+ amount", "- amount"))
    assert "its model cannot be used: effect 'glow': its file" in problems(built)
    (built / "glow.py").unlink()
    assert "its model cannot be used: effect 'glow': cannot read its file" in problems(built)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"effects": [', '"effects": 3, "x": ['),
        ('"name": "glow"', '"name": "glare"'),
        ('"name": "glow"', '"nom": "glow"'),
        ('"origin": "../glow.py"', '"origin": 5'),
        ('"amount": 0.01', '"amount": "much"'),
        ('"amount": 0.01', '"amount": 7'),
        ('"parameters": {', '"parameters": 3, "y": {'),
        ('"file": "../my.toml"', '"file": 5'),
        ('"file": "../my.toml"', '"conditions": {"lux": 5}'),
        ('"file": "../my.toml"', '"conditions": 5'),
        ('"file": "../my.toml"', '"latent": {"hours": [0]}'),
        ('"file": "../my.toml"', '"baseline": "old"'),
    ],
)
def test_a_damaged_model_in_a_manifest_is_a_finding(built: Path, old: str, new: str) -> None:
    manifest = built / "built" / MANIFEST
    text = manifest.read_text(encoding="utf-8")
    assert old in text
    manifest.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert "its model cannot be used" in problems(built)


def test_a_build_that_was_moved_with_its_model_can_be_built_again(built: Path, tmp_path: Path) -> None:
    (tmp_path / "deeper" / "down").mkdir(parents=True)
    moved = (built / "built").rename(tmp_path / "deeper" / "down" / "built")
    plan = BuildPlan((9000.0,), modes=("chroma",), formats=("clf",), cubesize=17)
    build(load_model(built / "my.toml"), plan, moved, jobs=1)
    assert check(moved, jobs=1).passed


# The command line


def test_the_commands_take_a_model_with_effects(
    readings: Measurements, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save_model(refined(readings, named("edge-falloff"), named("meter-offset")), "my.toml")
    imsave("in.png", np.full((8, 8, 3), 99, np.uint8), check_contrast=False)
    corner = ("--model", "my.toml", "--at", "u=0,v=0")
    options = ("--hours", "9000", "--mode", "chroma", "--jobs", "1")
    assert exit_code(monkeypatch, "build", *corner, *options, "-o", "built") == 0
    output = capsys.readouterr().out
    assert "Baked at: position u = 0, v = 0, room light 60 lx." in output
    assert "edge-falloff depends on position, which a LUT cannot carry." in output
    assert "meter-offset is left out" in output
    assert exit_code(monkeypatch, "build", "--model", "my.toml", *options, "-o", "centre") == 0
    capsys.readouterr()
    for folder in ("built", "centre"):
        assert exit_code(monkeypatch, "check", folder, "--jobs", "1") == 0
        assert exit_code(monkeypatch, "check", folder, *corner[:2], "--jobs", "1") == 0
        lut = f"{folder}/chroma/9000h/aged.clf"
        code = exit_code(monkeypatch, "check", lut, *corner, "--mode", "chroma", "--hours", "9000")
        assert code == (folder == "centre")
    assert exit_code(monkeypatch, "check", "built", "--at", "u=0") == 2
    capsys.readouterr()
    apply = ("apply", "in.png", "--mode", "chroma", "--hours", "9000")
    assert exit_code(monkeypatch, *apply, *corner, "-o", "corner.png", "--json") == 0
    remarks = json.loads(capsys.readouterr().out)["remarks"]
    assert remarks[0] == "Shown at: position u = 0, v = 0, room light 60 lx."
    assert exit_code(monkeypatch, *apply, "--model", "my.toml", "-o", "centre.png") == 0
    assert imread("corner.png").mean() < imread("centre.png").mean() - 1
    assert "edge-falloff depends on position" in capsys.readouterr().out
    assert exit_code(monkeypatch, *apply, "--build", "built", "--at", "u=0", "-o", "y.png") == 2


def test_show_tells_the_effects_and_their_errors(
    readings: Measurements, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    model = refined(readings, named("meter-offset"), baseline="first-hour", latent=None)
    save_model(model, tmp_path / "my.toml")
    assert exit_code(monkeypatch, "show", "--model", tmp_path / "my.toml", "--plot", tmp_path / "page.png") == 0
    output = capsys.readouterr().out
    assert "The model's effects (named):" in output
    assert "black-level: grown 0.033333 ± 0.000010, tint_z 1.00 ± 0.25 (at its bound)" in output
    assert "meter-offset: offset 0.01 cd/m²" in output
    assert "meter-offset is left out" in output
    assert exit_code(monkeypatch, "show", "--model", tmp_path / "my.toml", "--json") == 0
    content = json.loads(capsys.readouterr().out)["model"]
    assert content["verdict"] == "named"
    assert content["effects"][0]["parameters"]["grown"] == {
        "value": 0.1 / 3, "stderr": 1e-5, "at_bound": False, "unit": "1", "free": True,
    }  # fmt: skip
    shown = show(a_model(readings, named("backlight-decay"), baseline="first-hour"))
    assert all(later < earlier for earlier, later in pairwise(shown.luminance[:, 0]))
