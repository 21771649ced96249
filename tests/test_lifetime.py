"""Lifetimes against a slow twin that computes every pixel at every hour, and options that must not change them."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from jsonschema.exceptions import ValidationError
from skimage.data import immunohistochemistry
from skimage.io import imsave

from lutgen import AppliedEffect, DisplayModel, LutgenError, lifetime
from lutgen.colorimetry import xyY_to_xyz
from lutgen.display import Estimate, LatentTips, default_display
from lutgen.effects import catalogue
from lutgen.names import AGING_MODES
from lutgen.pictures import difference, distinct
from lutgen.pictures.difference import (
    DRAWS,
    STATISTICS,
    DifferenceCurve,
    coarse,
    differences,
    drawn,
    quantile,
    statistics,
)
from lutgen.pictures.distinct import Colours, count_colours
from lutgen.pictures.lifetime import TOLERANCES, binning_error
from lutgen.readings import Measurements
from tests.altered import altered
from tests.schemas import validator
from tests.twin import SRGB_XY, Twin, rows_of_csv, srgb_matrix

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

Pixels = Any
HOURS = (0.0, 2500.0, 9000.0, 18_000.0)


@pytest.fixture(scope="module")
def tissue() -> Pixels:
    return np.asarray(immunohistochemistry())


@pytest.fixture(scope="module")
def refined(model: DisplayModel) -> DisplayModel:
    """A model after `refine`: an effect with standard errors, tips before the effect, and the noise of a reading."""
    leak = catalogue()["black-level"]
    values = {**AppliedEffect.of(leak, {"new": 0.002}).estimates, "new": Estimate(0.002, 0.0004)}
    with_leak = replace(model, effects=(AppliedEffect(leak, values, ("new",)),))
    few = [0.0, 6000.0, 18_000.0]
    latent = LatentTips(np.array(few), np.array([xyY_to_xyz(model.tips.at(hour)) for hour in few]))
    return replace(with_leak, latent=latent, fit={"noise_relative": 0.002, "noise_floor_cd_m2": 0.003})


def save(path: Path, pixels: Pixels) -> Path:
    imsave(path, pixels, check_contrast=False)
    return path


def by_hand(pixels: Pixels, mode: str, hours: float) -> Array:
    """ΔE2000 of every pixel: the paper's steps in plain floats (tests/twin.py), then colour-science."""
    import colour

    rows = rows_of_csv(default_display().read_text(encoding="utf-8"))
    before, after = (Twin(rows, mode=name, hours=hour) for name, hour in (("stable", 0.0), (mode, hours)))

    def lab(display: Twin) -> Array:
        code = [(float(r), float(g), float(b)) for r, g, b in pixels.reshape(-1, 3) / 255.0]
        seen = np.clip([display.linear(each) for each in code], 0.0, 1.0)
        return np.asarray(colour.XYZ_to_Lab(seen @ np.array(srgb_matrix()).T, np.array(SRGB_XY["w"])))

    return np.asarray(colour.delta_E(lab(before), lab(after), method="CIE 2000"))


# The numbers ----------------------------------------------------------------------------------------------------------


def test_the_curve_is_that_of_every_pixel_taken_by_itself(tissue: Pixels, model: DisplayModel, tmp_path: Path) -> None:
    pixels = tissue[100:400:18, 50:450:16]
    (image,) = lifetime([save(tmp_path / "in.png", pixels)], model, hours=HOURS).images
    for mode in AGING_MODES:
        curve = image.curves[mode]
        for hours in HOURS:
            place = curve.hours.tolist().index(hours)
            expected = by_hand(pixels, mode, hours)
            ranked = {f"p{share}": np.quantile(expected, share / 100, method="inverted_cdf") for share in (95, 99)}
            all_of_them = {"mean": expected.mean(), "sd": expected.std(), "largest": expected.max(), **ranked}
            for name, value in all_of_them.items():
                assert getattr(curve, name)[place] == pytest.approx(value, abs=1e-9), (mode, hours, name)
    assert image.curves["chroma"].mean[-1] > 4


def test_lifetimes_are_where_straight_lines_between_hours_cross(model: DisplayModel, tmp_path: Path) -> None:
    lifetimes = lifetime([save(tmp_path / "in.png", np.full((4, 4, 3), 200, np.uint8))], model)
    (image,) = lifetimes.images
    for mode, tolerance, name in product(AGING_MODES, TOLERANCES, STATISTICS):
        curve_of = image.curves[mode]
        values = getattr(curve_of, name)
        life = curve_of.hours_until(name, tolerance)
        assert life is not None
        assert np.interp(life, curve_of.hours, values) == pytest.approx(tolerance, abs=1e-9)
        assert (values[curve_of.hours < life] < tolerance).all()


def test_lifetimes_hardly_depend_on_the_hours_given(tissue: Pixels, readings: Measurements, tmp_path: Path) -> None:
    file = save(tmp_path / "in.png", tissue[::64, ::64])
    kept = np.isin(readings.hours, (0.0, 18_000.0))
    columns = {name: getattr(readings, name)[kept] for name in ("hours", "drive", "xyz_cd_m2", "lines")}
    for display in map(DisplayModel, (readings, Measurements(**columns))):
        fine = lifetime([file], display, hours=range(0, 18_001, 100)).images[0]
        for hours in (None, (18_000.0,), (700.0, 18_000.0)):
            image = lifetime([file], display, hours=hours).images[0]
            for mode, tolerance, name in product(AGING_MODES, TOLERANCES, STATISTICS):
                life, expected = (each.curves[mode].hours_until(name, tolerance) for each in (image, fine))
                assert life == pytest.approx(expected, abs=30), (hours, mode, tolerance, name)


@pytest.mark.parametrize(
    ("values", "tolerance", "expected"),
    [
        ((0, 1, 2, 3), 3.0, 30.0),
        ((0, 1, 2, 3), 2.5, 25.0),
        ((0, 1, 2, 3), 3.01, None),
        ((0, 4, 1, 9), 2.0, 5.0),
        ((0, 0, 0, 0), 1e-9, None),
        ((0, 5, 5, 5), 5.0, 10.0),
    ],
)
def test_the_first_crossing_counts(values: tuple[float, ...], tolerance: float, expected: float | None) -> None:
    some = np.array(values, dtype=float)
    curve = DifferenceCurve(np.array([0.0, 10.0, 20.0, 30.0]), some, np.zeros(4), some, some, some)
    for name in STATISTICS:
        assert curve.hours_until(name, tolerance) == expected


def test_statistics_are_numpys_on_repeated_values() -> None:
    random = np.random.default_rng(1)
    for size in (1, 2, 7, 1000, 70_000):
        values, counts = random.gamma(2.0, 2.0, size), random.integers(1, 30, size)
        all_of_them = np.repeat(values, counts)
        mean, sd, p95, p99, largest = statistics(values, counts)
        assert mean == pytest.approx(all_of_them.mean(), rel=1e-12)
        assert sd == pytest.approx(all_of_them.std(), rel=1e-9, abs=1e-12)
        expected = [np.quantile(all_of_them, share, method="inverted_cdf") for share in (0.95, 0.99)]
        assert [p95, p99, largest] == [*expected, values.max()]


@pytest.mark.parametrize("values", [[0.0] * 5, [2.5] * 5, [0.0, 0.0, 0.0, 0.0, 1.0], [0.0, 1e-12, 1e-12, 50.0, 50.0]])
def test_quantiles_of_equal_and_far_apart_values(values: list[float]) -> None:
    counts = np.array([7, 1, 2, 3, 87])
    for percent in (1, 50, 95, 99, 100):
        expected = np.quantile(np.repeat(values, counts), percent / 100, method="inverted_cdf")
        assert quantile(np.array(values), counts, percent) == expected


def test_an_image_of_one_colour_has_no_spread(model: DisplayModel, tmp_path: Path) -> None:
    (image,) = lifetime([save(tmp_path / "in.png", np.full((5, 5, 3), (180, 90, 140), np.uint8))], model).images
    for curve in image.curves.values():
        assert not curve.sd.any()
        for name in STATISTICS:
            np.testing.assert_array_equal(getattr(curve, name), curve.mean)
    assert (image.pixels, image.colours) == (25, 1)


# Options without influence --------------------------------------------------------------------------------------------


def curves(images: list[Path], model: DisplayModel, **options: Any) -> list[dict[str, dict[str, list[float]]]]:
    """Every number of every curve, to the last bit."""
    lifetimes = lifetime(images, model, hours=HOURS, **options)
    return [
        {
            mode: {name: getattr(each, name).tolist() for name in ("mean", "sd", *STATISTICS)}
            for mode, each in of.items()
        }
        for of in (image.curves for image in lifetimes.images)
    ]


def test_an_image_tiled_ten_times_or_turned_has_the_same_curve(
    tissue: Pixels, model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = tissue[:60, :75]
    shuffled = np.random.default_rng(2).permutation(part.reshape(-1, 3)).reshape(part.shape)
    monkeypatch.setattr("lutgen.pictures.images.BAND", 1750)
    pictures = {"once": part, "ten": np.tile(part, (5, 2, 1)), "turned": part[::-1], "shuffled": shuffled}
    files = [save(tmp_path / f"{name}.png", pixels) for name, pixels in pictures.items()]
    once, *others = curves(files, model)
    assert others == [once] * 3


def test_groups_of_displays_do_not_show(
    tissue: Pixels, model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = save(tmp_path / "in.png", tissue[:32, :32])
    whole = curves([file], model)
    for held in (1, 9000):
        monkeypatch.setattr(difference, "HELD", held)
        assert curves([file], model) == whole


def test_hours_are_sorted_and_begin_at_0(tissue: Pixels, model: DisplayModel, tmp_path: Path) -> None:
    file = save(tmp_path / "in.png", tissue[:32, :32])
    (image,) = lifetime([file], model, hours=(9000, 2500, 9000)).images
    measured = model.tips.hours[model.tips.hours <= 9000].tolist()
    assert image.curves["chroma"].hours.tolist() == measured
    (usual,) = lifetime([file], model).images
    assert usual.curves["chroma-luma"].hours.tolist() == model.tips.hours.tolist()


def test_fine_images_have_the_curve_of_their_pixels_within_what_is_said(
    tissue: Pixels, model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    smooth = replace(model, selection="continuous")
    fine = tissue[:128, :128].astype(np.uint16) * 257 // 2 + np.random.default_rng(3).integers(
        0, 30_000, (128, 128, 3), dtype=np.uint16
    )
    file = save(tmp_path / "in.tif", fine)
    (exact,) = lifetime([file], smooth, hours=HOURS).images
    assert (exact.bits, exact.binning_error) == (16, 0.0)
    monkeypatch.setattr(distinct, "LIMIT", 6000)
    (binned,) = lifetime([file], smooth, hours=HOURS).images
    assert binned.bits < 8
    assert 0.01 < binned.binning_error < 5
    for mode in AGING_MODES:
        off = np.abs(binned.curves[mode].mean - exact.curves[mode].mean)
        assert off.max() < 0.1 * binned.binning_error
        off = np.abs(binned.curves[mode].largest - exact.curves[mode].largest)
        assert off.max() <= binned.binning_error


def test_the_error_of_bins_is_what_half_a_bin_changes(model: DisplayModel) -> None:
    smooth = replace(model, selection="continuous")
    middle, half = np.array([[0.6, 0.3, 0.4]]), 0.02
    one = Colours(np.zeros(1, np.uint32), np.ones(1, np.int64), lambda keys: middle[keys], 5, half)
    error = binning_error(one, smooth, ["chroma"], [18_000.0])
    inside = middle + half * np.random.default_rng(4).uniform(-1, 1, (2000, 3))
    many = Colours(np.arange(2001), np.ones(2001, int), lambda keys: np.concatenate([middle, inside])[keys], 16)
    values = differences(many.code, 2001, smooth.at("stable", 0.0), [smooth.at("chroma", 18_000.0)])[0]
    spread = np.abs(values[1:] - values[0]).max()
    assert 0.7 * error < spread <= error


# Uncertainty ----------------------------------------------------------------------------------------------------------


def test_a_model_of_bare_readings_has_no_intervals(tissue: Pixels, model: DisplayModel, tmp_path: Path) -> None:
    lifetimes = lifetime([save(tmp_path / "in.png", tissue[:16, :16])], model, hours=HOURS)
    assert drawn(model) == []
    assert lifetimes.images[0].intervals is None
    assert lifetimes.as_json()["images"][0]["modes"]["chroma"]["lifetimes"]["3"]["interval"] is None


@pytest.mark.slow
def test_intervals_hold_the_lifetime_and_are_the_same_again(
    tissue: Pixels, refined: DisplayModel, tmp_path: Path
) -> None:
    file = save(tmp_path / "in.png", tissue[200:264, 200:264])
    first, again = (lifetime([file], refined, hours=HOURS).images[0] for _ in range(2))
    assert first.intervals == again.intervals
    assert first.intervals is not None
    for mode, tolerance, name in product(AGING_MODES, TOLERANCES, ("mean", "max")):
        low, high = first.intervals[mode][tolerance][name]
        life = first.curves[mode].hours_until(name, tolerance)
        assert low is not None
        assert life is not None
        assert low < life
        assert high is None or life < high
        assert (high or 18_000.0) - low < 0.3 * life


@pytest.mark.slow
def test_less_noise_makes_narrower_intervals(tissue: Pixels, refined: DisplayModel, tmp_path: Path) -> None:
    file = save(tmp_path / "in.png", tissue[:32, :32])
    widths = []
    for noise in (0.002, 0.0005):
        quiet = replace(refined, fit={"noise_relative": noise, "noise_floor_cd_m2": 0.0})
        intervals = lifetime([file], quiet, hours=HOURS, tolerances=[2.0]).images[0].intervals
        assert intervals is not None
        low, high = intervals["chroma"][2.0]["mean"]
        assert low is not None
        assert high is not None
        widths.append(high - low)
    assert 1.5 < widths[0] / widths[1] < 8


@pytest.mark.slow
def test_draws_scatter_as_they_should(refined: DisplayModel) -> None:
    models = drawn(refined, 400)
    assert len(drawn(refined)) == DRAWS
    leaks = np.array([each.effects[0].values["new"] for each in models])
    assert leaks.mean() == pytest.approx(0.002, abs=1e-4)
    assert leaks.std() == pytest.approx(0.0004, rel=0.15)
    # White and primaries were read once an hour: the models show the same tips within one reading's noise.
    for hour in (0.0, 18_000.0):
        seen = np.array([xyY_to_xyz(each.shown_tips(hour)) for each in models])
        before = xyY_to_xyz(refined.shown_tips(hour))
        # Twenty standard errors of the leak would move black by 1 cd/m². The remaining movement is of second order.
        np.testing.assert_allclose(seen.mean(axis=0), before, rtol=5e-4, atol=2e-3)
        sigma = np.hypot(0.002 * before, 0.003)
        np.testing.assert_allclose(seen.std(axis=0), sigma, rtol=0.2)


def test_coarse_colours_keep_pixels_and_their_mean(tissue: Pixels, tmp_path: Path) -> None:
    colours = count_colours(save(tmp_path / "in.png", tissue))
    few = coarse(colours)
    assert few.pixels == colours.pixels
    assert len(few) < 0.1 * len(colours)
    mean = tissue.reshape(-1, 3).mean(axis=0) / 255.0
    np.testing.assert_allclose(few.counts @ few.code() / few.pixels, mean, rtol=0, atol=1e-12)


# Output ---------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_json_is_as_the_issue_and_the_schema_say(
    tissue: Pixels, model: DisplayModel, refined: DisplayModel, tmp_path: Path
) -> None:
    files = [save(tmp_path / name, tissue[200:248, 200:248]) for name in ("a.png", "b.png")]
    lifetimes = lifetime(files, model, hours=HOURS, tolerances=(3, 5, 0.25, 90))
    document = json.loads(json.dumps(lifetimes.as_json(), allow_nan=False))
    first, second = document["images"]
    assert (document["schema"], first["file"], second["file"]) == (1, str(files[0]), str(files[1]))
    assert (first["pixels"], first["colours"]) == (
        48 * 48,
        len(np.unique(tissue[200:248, 200:248].reshape(-1, 3), axis=0)),
    )
    chroma = first["modes"]["chroma"]
    assert list(chroma["lifetimes"]) == ["3", "5", "0.25", "90"]
    assert chroma["lifetimes"]["90"]["max"] is None
    faded = first["modes"]["chroma-luma"]["lifetimes"]
    assert faded["3"]["max"] < faded["3"]["mean"] < faded["5"]["mean"]
    (point,) = (each for each in chroma["curve"] if each["hours"] == 9000.0)
    assert point["mean_plus_2_sd"] == pytest.approx(point["mean"] + 2 * point["sd"])
    assert point["mean"] < point["p95"] <= point["p99"] <= point["max"]
    check = validator("lifetime")
    check.validate(document)
    check.validate(json.loads(json.dumps(lifetime(files[:1], refined, hours=HOURS, tissue=True).as_json())))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("schema",), 2),
        (("images", 0, "pixels"), 0),
        (("images", 0, "modes", "faded"), {}),
        (("images", 0, "modes", "chroma", "lifetimes", "3", "max"), "soon"),
        (("images", 0, "modes", "chroma", "lifetimes", "3", "mean"), -1.0),
        (("images", 0, "modes", "chroma", "curve", 0, "sd"), None),
    ],
)
def test_the_schema_refuses_what_is_wrong(
    path: tuple[str | int, ...], value: object, model: DisplayModel, tmp_path: Path
) -> None:
    file = save(tmp_path / "in.png", np.full((2, 2, 3), 120, np.uint8))
    content = lifetime([file], model, hours=(9000,)).as_json()
    with pytest.raises(ValidationError):
        validator("lifetime").validate(altered(content, path, value))


def test_csv_is_table_1_a_line_an_image_and_mode(tissue: Pixels, model: DisplayModel, tmp_path: Path) -> None:
    files = [save(tmp_path / name, tissue[:32, :32]) for name in ("a, b.png", "c.png")]
    lifetimes = lifetime(files, model, hours=HOURS, tolerances=(3, 60))
    rows = list(csv.DictReader(io.StringIO(lifetimes.as_csv())))
    assert [(row["file"], row["mode"]) for row in rows] == [(str(file), mode) for file in files for mode in AGING_MODES]
    life = lifetimes.images[0].curves["chroma"].hours_until("max", 3.0)
    assert float(rows[0]["max_3"]) == pytest.approx(life, abs=0.05)
    assert rows[0]["mean_60"] == ""


@pytest.mark.slow
def test_progress_rises_to_the_whole(tissue: Pixels, refined: DisplayModel, tmp_path: Path) -> None:
    files = [save(tmp_path / name, tissue[:16, :16]) for name in ("a.png", "b.png")]
    calls: list[tuple[int, int]] = []
    lifetime(files, refined, hours=(9000,), progress=lambda done, total: calls.append((done, total)))
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)
    assert calls[-1] == (2000, 2000)


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerances": (3, -1)}, r"tolerance -1: a tolerated ΔE2000 is a finite number above 0"),
        ({"tolerances": (0,)}, r"tolerance 0:"),
        ({"tolerances": (float("nan"),)}, r"tolerance nan:"),
        ({"tolerances": ()}, r"no tolerance was given"),
        ({"hours": (20_000,)}, r"hour 20000 is outside the measured span 0\.\.18000 h"),
        ({"hours": range(10_001)}, r"10001 hours are more than 10000"),
        ({"modes": ("faded",)}, r"unknown mode 'faded'\. Pick one of: stable, chroma, chroma-luma"),
        ({"source": "hdr"}, r"unknown source 'hdr'\. Pick one of: auto, signal, linear"),
    ],
)
def test_bad_questions_are_refused(options: dict[str, Any], message: str, model: DisplayModel, tmp_path: Path) -> None:
    file = save(tmp_path / "in.png", np.full((2, 2, 3), 120, np.uint8))
    with pytest.raises(LutgenError, match=message):
        lifetime([file], model, **options)


def test_no_image_and_a_missing_one_are_refused(model: DisplayModel, tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=r"no image was given"):
        lifetime([], model)
    with pytest.raises(LutgenError, match=r"gone\.png: there is no such image"):
        lifetime([tmp_path / "gone.png"], model)
