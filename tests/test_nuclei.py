"""Conspicuity of nuclei: painted nuclei, with known place and ΔE2000, and real nuclei."""

from __future__ import annotations

import csv
import io
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from jsonschema.exceptions import ValidationError
from PIL import Image
from scipy import ndimage
from skimage.color import combine_stains, rgb_from_hdx, rgb_from_hed
from skimage.data import immunohistochemistry
from skimage.io import imread, imsave

from lutgen import DisplayModel, LutgenError, nuclei
from lutgen.display import default_display
from lutgen.names import AGING_MODES
from lutgen.pictures import blocks, conspicuity
from lutgen.pictures.blocks import read_field
from lutgen.pictures.conspicuity import FEWEST, LEAST_PIXELS, PERCENT, contrast_of, outlines, rings_of
from lutgen.pictures.nuclei import read_mask, segment, width_of
from tests.altered import altered
from tests.real_data import real_data
from tests.schemas import validator
from tests.twin import SRGB_XY, Twin, rows_of_csv, srgb_matrix

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

Pixels = Any
HOURS = (0.0, 10_000.0, 18_000.0)

#: The fields of real slides are in the folder of the measured displays.
RARE_FIELD = (
    pytest.mark.rare(instead="test_a_real_field_enlarged_twice_keeps_its_median_contrast_and_not_its_count"),
    pytest.mark.skipif("LUTGEN_REAL_DATA" not in os.environ, reason="needs the fields in LUTGEN_REAL_DATA"),
)

INK, PALE, GROUND = (70, 40, 110), (150, 110, 170), (225, 170, 200)


def save(path: Path, pixels: Pixels) -> Path:
    imsave(path, pixels, check_contrast=False)
    return path


def discs(places: list[tuple[int, int]], radius: float, size: int) -> Pixels:
    """Label image with a disc at each place, numbered 1..n."""
    row, column = np.mgrid[:size, :size]
    labels = np.zeros((size, size), np.uint8)
    for number, (y, x) in enumerate(places, 1):
        labels[np.hypot(row - y, column - x) <= radius] = number
    return labels


def grid(step: int, size: int) -> list[tuple[int, int]]:
    return [(y, x) for y in range(step // 2, size, step) for x in range(step // 2, size, step)]


def painted(labels: Pixels, *, matrix: Pixels = rgb_from_hed, ground: Pixels = 0.0) -> Pixels:
    """Haematoxylin at labels and a second stain elsewhere, by Beer–Lambert, with blur and noise."""
    amounts = np.zeros((*labels.shape, 3))
    amounts[..., 0] = ndimage.gaussian_filter((labels > 0) * 0.1, 0.7)
    amounts[..., 1] = 0.05 - 0.4 * amounts[..., 0]
    amounts[..., 0] += ground
    amounts += np.random.default_rng(5).normal(0.0, 0.001, amounts.shape)
    return np.rint(255 * combine_stains(np.maximum(amounts, 0), matrix)).astype(np.uint8)


def lab_by_hand(code: Pixels, mode: str, hours: float) -> Array:
    """Lab of 8-bit colours on a display, (n, 3): the paper's steps in plain floats, then colour-science."""
    import colour

    display = Twin(rows_of_csv(default_display().read_text(encoding="utf-8")), mode=mode, hours=hours)
    seen = np.clip([display.linear((float(r), float(g), float(b))) for r, g, b in np.array(code) / 255.0], 0.0, 1.0)
    return np.asarray(colour.XYZ_to_Lab(seen @ np.array(srgb_matrix()).T, np.array(SRGB_XY["w"])))


def apart_by_hand(one: Array, other: Array) -> float:
    import colour

    return float(colour.delta_E(one, other, method="CIE 2000"))


# The numbers ----------------------------------------------------------------------------------------------------------


def test_flat_discs_on_a_flat_ground_stand_out_by_what_their_colours_are_apart(
    model: DisplayModel, tmp_path: Path
) -> None:
    labels = discs([(20, 20), (20, 60), (60, 40)], 8, 80)
    pixels = np.array([GROUND, INK, PALE, (200, 60, 60)], np.uint8)[labels]
    image, mask = save(tmp_path / "in.png", pixels), save(tmp_path / "m.png", labels)
    analysis = nuclei(image, model, mask=mask, hours=HOURS)
    assert analysis.nuclei.count == 3
    for mode in AGING_MODES:
        for place, hours in enumerate(HOURS):
            ground, *inks = lab_by_hand([GROUND, INK, PALE, (200, 60, 60)], mode, hours)
            expected = [apart_by_hand(ink, ground) for ink in inks]
            np.testing.assert_allclose(analysis.contrasts[mode].aged[place], expected, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(analysis.contrasts["chroma"].unaged, analysis.contrasts["chroma"].aged[0])


def test_means_are_over_pixels_in_lab(model: DisplayModel, tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    labels = discs([(20, 20), (20, 60)], 8, 80)
    pixels = random.integers(30, 240, (80, 80, 3), dtype=np.uint8)
    analysis = nuclei(
        save(tmp_path / "in.png", pixels), model, mask=save(tmp_path / "m.png", labels), hours=HOURS, modes=["chroma"]
    )
    for each in (1, 2):
        inside = pixels[labels == each]
        around = pixels[analysis.rings.labels == each]
        expected = apart_by_hand(
            lab_by_hand(inside, "chroma", 18_000.0).mean(axis=0), lab_by_hand(around, "chroma", 18_000.0).mean(axis=0)
        )
        assert analysis.contrasts["chroma"].aged[2, each - 1] == pytest.approx(expected, abs=1e-9)


def test_statistics_are_those_of_the_nuclei(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs(grid(25, 100), 6, 100)
    pixels = np.array([GROUND, *np.linspace((40, 20, 80), (200, 150, 190), 16).astype(int)], np.uint8)[labels]
    analysis = nuclei(
        save(tmp_path / "in.png", pixels), model, mask=save(tmp_path / "m.png", labels), hours=HOURS, loss=8
    )
    for each in analysis.contrasts.values():
        for place in range(3):
            np.testing.assert_allclose(each.percentiles[place], np.percentile(each.aged[place], PERCENT))
            assert each.change[place] == pytest.approx(np.median(each.aged[place]) / np.median(each.unaged) - 1)
            assert each.lost[place] == np.mean(
                [a < 0.92 * u for a, u in zip(each.aged[place], each.unaged, strict=True)]
            )
    assert 0 < analysis.contrasts["chroma-luma"].lost[2] <= 1


def test_depth_of_storage_does_not_matter(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([(20, 20)], 8, 40)
    pixels = np.array([GROUND, INK], np.uint8)[labels]
    mask = save(tmp_path / "m.png", labels)
    files = [save(tmp_path / "8.png", pixels), save(tmp_path / "16.tif", pixels.astype(np.uint16) * 257)]
    single, double = (nuclei(file, model, mask=mask, hours=HOURS).contrasts["chroma"].aged for file in files)
    np.testing.assert_array_equal(single, double)


def test_what_is_transparent_is_neither_nucleus_nor_ring(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([(20, 20)], 8, 40)
    pixels = np.dstack([np.array([GROUND, INK], np.uint8)[labels], np.full((40, 40), 255, np.uint8)])
    mask = save(tmp_path / "m.png", labels)
    whole = nuclei(save(tmp_path / "whole.png", pixels), model, mask=mask, hours=HOURS)
    pixels[:, 18:] = (0, 255, 0, 0)
    part = nuclei(save(tmp_path / "part.png", pixels), model, mask=mask, hours=HOURS)
    assert not part.nuclei.labels[:, 18:].any()
    assert not part.rings.labels[:, 18:].any()
    np.testing.assert_allclose(part.contrasts["chroma"].aged, whole.contrasts["chroma"].aged, rtol=1e-12)


#: Exif's Orientation → quarter turns, anticlockwise, by which viewers turn a picture.
TURNS = {3: 2, 6: 3}


@pytest.mark.parametrize("orientation", TURNS)
def test_image_and_mask_are_turned_as_their_files_ask(orientation: int, model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([(14, 20), (40, 30), (20, 50)], 6, 60)[:, :-6]
    exif = Image.Exif()
    exif[0x0112] = orientation
    for name, stored in (("image", np.array([GROUND, INK, PALE, INK], np.uint8)[labels]), ("mask", labels)):
        Image.fromarray(stored).save(tmp_path / f"{name}.tif", exif=exif)
        save(tmp_path / f"{name}.png", np.rot90(stored, TURNS[orientation]))
    upright = nuclei(tmp_path / "image.png", model, mask=tmp_path / "mask.png", hours=HOURS)
    assert upright.nuclei.count == 3
    for mask in ("mask.png", "mask.tif"):
        analysis = nuclei(tmp_path / "image.tif", model, mask=tmp_path / mask, hours=HOURS)
        np.testing.assert_array_equal(analysis.nuclei.labels, upright.nuclei.labels)
        np.testing.assert_array_equal(analysis.contrasts["chroma"].aged, upright.contrasts["chroma"].aged)
        np.testing.assert_array_equal(analysis.field.rgb(), upright.field.rgb())


# Intervals ------------------------------------------------------------------------------------------------------------


def test_intervals_are_as_wide_as_theory_says() -> None:
    random = np.random.default_rng(2)
    unaged = random.normal(20.0, 3.0, 2000)
    aged = np.stack([unaged, unaged * random.normal(0.9, 0.05, 2000)])
    contrast = contrast_of(unaged, aged, 10.0)
    assert contrast.intervals is not None
    low, high = contrast.intervals[1, 0]
    # The standard error of a median is 1.2533 σ/√n.
    assert high - low == pytest.approx(2 * 1.96 * 1.2533 * aged[1].std() / 2000**0.5, rel=0.2)
    low, high = contrast.intervals[1, 2]
    assert low < 0.5 < high
    assert high - low == pytest.approx(2 * 1.96 * 0.5 / 2000**0.5, rel=0.2)
    # The values are paired: the change has a much smaller uncertainty than either median.
    low, high = contrast.intervals[1, 1]
    assert low < -0.1 < high
    assert contrast.intervals[0, 1].tolist() == [0.0, 0.0]


def test_intervals_are_the_same_again_and_do_not_depend_on_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    unaged = np.random.default_rng(3).normal(20.0, 3.0, 50)
    first = contrast_of(unaged, unaged[np.newaxis] ** 0.9, 10.0).intervals
    monkeypatch.setattr(conspicuity, "_HELD", 120)
    np.testing.assert_array_equal(first, contrast_of(unaged, unaged[np.newaxis] ** 0.9, 10.0).intervals)


def test_few_nuclei_have_no_interval_and_equal_colours_no_change() -> None:
    few = np.linspace(1, 2, FEWEST)
    assert contrast_of(few, few[np.newaxis], 10.0).intervals is not None
    assert contrast_of(few[1:], few[np.newaxis, 1:], 10.0).intervals is None
    none = contrast_of(np.zeros(20), np.zeros((1, 20)), 10.0)
    assert np.isnan(none.change).all()
    assert not none.lost.any()
    (point,) = none.points(np.zeros(1))
    assert (point["change"], point["change_interval"], point["median"]) == (None, None, 0.0)


# Rings ----------------------------------------------------------------------------------------------------------------


def test_rings_lie_around_their_nucleus_and_near_no_other(tmp_path: Path) -> None:
    labels = discs([(20, 20), (20, 40), (60, 30), (60, 60)], 8, 80)
    field = read_field(save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[np.minimum(labels, 1)]))
    mask = read_mask(save(tmp_path / "m.png", labels), field)
    segments, rings, ringless = rings_of(mask, field.visible)
    assert (segments.count, ringless) == (4, 0)
    assert (rings.gap, rings.width) == (2, round(segments.width / 3))
    for y, x in np.argwhere(rings.labels > 0):
        nearest = [np.hypot(*(np.argwhere(labels == each) - (y, x)).T).min() for each in range(1, 5)]
        assert rings.gap < min(nearest) <= rings.gap + rings.width
        assert nearest[rings.labels[y, x] - 1] == min(nearest)
    around = np.bincount(rings.labels.ravel())[1:]
    assert around[2] > around[0] > 200


def test_what_is_dark_and_does_not_count_is_in_no_ring(tmp_path: Path) -> None:
    labels = discs([(20, 20), (60, 60)], 8, 80)
    labels[18:22, 33:35] = 3
    field = read_field(save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[np.minimum(labels, 1)]))
    segments, rings, _ = rings_of(read_mask(save(tmp_path / "m.png", labels), field, min_area=20), field.visible)
    assert (segments.count, segments.small) == (2, 1)
    for y, x in np.argwhere(rings.labels > 0):
        speck, *counted = (np.hypot(*(np.argwhere(labels == each) - (y, x)).T).min() for each in (3, 1, 2))
        assert speck >= min(counted)
        assert speck > rings.gap
    assert rings.labels[:, :28].any()


def test_a_nucleus_walled_in_by_others_is_left_out(tmp_path: Path) -> None:
    labels = np.zeros((60, 60), np.uint8)
    labels[10:50, 10:50] = 1
    labels[20:40, 20:40] = 2
    field = read_field(save(tmp_path / "in.png", np.array([GROUND, INK, PALE], np.uint8)[labels]))
    segments, rings, ringless = rings_of(read_mask(save(tmp_path / "m.png", labels), field), field.visible)
    assert (segments.count, ringless) == (1, 1)
    assert set(np.unique(segments.labels)) == {-1, 0, 1}
    assert np.count_nonzero(rings.labels == 1) > LEAST_PIXELS


def test_outlines_are_edges() -> None:
    labels = np.zeros((5, 6), np.int32)
    labels[1:4, 1:3], labels[1:4, 3:5] = 1, 2
    edge = outlines(labels)
    assert edge[1:4, 1:5].all()
    assert np.count_nonzero(edge) == 12
    assert not outlines(np.ones((4, 4), np.int32)).any()


# Finding nuclei -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("matrix", "stain", "message"),
    [
        (rgb_from_hed, "auto", "(H&E, by its colours)"),
        (rgb_from_hdx, "auto", "(haematoxylin and DAB, by its colours)"),
        (rgb_from_hdx, "hdab", "(haematoxylin and DAB)"),
    ],
)
def test_painted_nuclei_are_found_where_they_were_painted(
    matrix: Pixels, stain: str, message: str, tmp_path: Path
) -> None:
    labels = discs(grid(25, 150), 7, 150)
    field = read_field(save(tmp_path / "in.png", painted(labels, matrix=matrix)))
    segments = segment(field, stain=stain)
    assert segments.count == 36
    assert message in segments.method
    both = np.count_nonzero((segments.labels > 0) & (labels > 0))
    assert 2 * both / (np.count_nonzero(segments.labels > 0) + np.count_nonzero(labels)) > 0.95
    # One to one: each painted disc matches exactly one label.
    pairs = {(int(a), int(b)) for a, b in zip(labels[labels > 0], segments.labels[labels > 0], strict=True) if b > 0}
    assert len(pairs) == 36
    assert segments.width == pytest.approx(14, abs=2)


def test_touching_nuclei_are_parted(tmp_path: Path) -> None:
    places = [(y, x + shift) for y, x in grid(50, 200) for shift in (-7, 7)]
    field = read_field(save(tmp_path / "in.png", painted(discs(places, 8, 200))))
    assert segment(field).count == len(places)


def test_nuclei_are_found_where_the_ground_is_darker_than_the_threshold(tmp_path: Path) -> None:
    labels = discs(grid(25, 200), 7, 200)
    ground = np.where(np.arange(200) >= 175, 0.08, 0.0)
    segments = segment(read_field(save(tmp_path / "in.png", painted(labels, ground=ground))))
    pairs = {(int(a), int(b)) for a, b in zip(labels[labels > 0], segments.labels[labels > 0], strict=True) if b > 0}
    assert segments.count == len(pairs) == 64


def test_specks_folds_and_lumens_are_no_nuclei(tmp_path: Path) -> None:
    labels = discs(grid(25, 150), 7, 150)
    labels[:, 100:] = 0
    labels[20:130, 110:140] = 99
    labels[10:13, 100:103] = 98
    field = read_field(save(tmp_path / "in.png", painted(labels)))
    segments = segment(field)
    assert segments.count == 24
    assert not (segments.labels[:, 100:] > 0).any()
    assert segments.large >= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "field",
    [
        "immunohistochemistry",
        pytest.param("he_a", marks=RARE_FIELD),
        pytest.param("he_b", marks=RARE_FIELD),
    ],
)
def test_a_real_field_enlarged_twice_keeps_its_median_contrast_and_not_its_count(
    field: str, model: DisplayModel, tmp_path: Path
) -> None:
    if field == "immunohistochemistry":
        once = immunohistochemistry()
    else:
        once = imread(Path(os.environ["LUTGEN_REAL_DATA"], "images", f"{field}.png"))[..., :3]
    twice = np.clip(np.rint(ndimage.zoom(once.astype(float), (2, 2, 1), order=3)), 0, 255).astype(np.uint8)
    small, large = (
        nuclei(save(tmp_path / f"{name}.png", each), model, hours=HOURS)
        for name, each in (("one", once), ("two", twice))
    )
    assert 1.0 < large.nuclei.count / small.nuclei.count < 1.5
    assert 1.4 < large.nuclei.width / small.nuclei.width < 2.1
    for mode in AGING_MODES:
        np.testing.assert_allclose(small.contrasts[mode].median, large.contrasts[mode].median, rtol=0.05)


def test_painted_nuclei_at_twice_the_resolution_are_the_same_nuclei(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([place for place in grid(25, 150) if sum(place) % 3], 6, 150)
    once = painted(labels)
    twice = ndimage.zoom(once, (2, 2, 1), order=1)
    small, large = (
        nuclei(save(tmp_path / name, pixels), model, hours=HOURS)
        for name, pixels in (("1.png", once), ("2.png", twice))
    )
    assert small.nuclei.count == large.nuclei.count > 15
    assert large.nuclei.width == pytest.approx(2 * small.nuclei.width, rel=0.15)
    for mode in AGING_MODES:
        one, two = small.contrasts[mode], large.contrasts[mode]
        np.testing.assert_allclose(one.median, two.median, rtol=0.05)
        np.testing.assert_allclose(one.change, two.change, atol=0.01)


def test_width_is_that_of_most_of_the_area() -> None:
    labels = discs(grid(30, 150), 9, 150)
    labels[::30, ::30] = 1
    assert width_of(labels > 0) == pytest.approx(18, abs=1.5)
    assert width_of(np.zeros((9, 9), np.bool_)) == 0.0


def test_real_immunohistochemistry(model: DisplayModel, tmp_path: Path) -> None:
    analysis = nuclei(save(tmp_path / "ihc.png", np.asarray(immunohistochemistry())), model, hours=HOURS)
    assert 250 < analysis.nuclei.count < 400
    assert "DAB" in analysis.nuclei.method
    chroma, luma = (analysis.contrasts[mode] for mode in AGING_MODES)
    assert chroma.median[0] == pytest.approx(9.0, abs=1.0)
    assert luma.change[2] == pytest.approx(-0.24, abs=0.05)
    assert luma.change[2] < chroma.change[2] < 0
    # Nuclei are bluer than DAB and stroma: haematoxylin transmits blue and absorbs red.
    pixels = np.asarray(immunohistochemistry()).astype(float)
    blueness = pixels[..., 2] - pixels[..., 0]
    assert blueness[analysis.nuclei.labels > 0].mean() > blueness[analysis.rings.labels > 0].mean() + 15


@pytest.mark.parametrize(("name", "count", "unaged"), [("he_a", 1360, 22.5), ("he_b", 955, 30.1)])
def test_real_haematoxylin_and_eosin(name: str, count: int, unaged: float, model: DisplayModel) -> None:
    analysis = nuclei((real_data() / f"images/{name}.png"), model, hours=HOURS)
    assert "H&E" in analysis.nuclei.method
    assert analysis.nuclei.count == pytest.approx(count, rel=0.15)
    chroma, luma = (analysis.contrasts[mode] for mode in AGING_MODES)
    assert chroma.median[0] == pytest.approx(unaged, abs=2.0)
    assert chroma.change[2] > 0
    assert luma.change[2] < -0.1


# Masks ----------------------------------------------------------------------------------------------------------------


def test_masks_of_every_kind_say_the_same(tmp_path: Path) -> None:
    labels = discs([(20, 20), (20, 60), (60, 40)], 8, 80)
    field = read_field(save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[np.minimum(labels, 1)]))
    white = np.where(labels > 0, 255, 0).astype(np.uint8)
    kinds = {
        "labels.png": labels,
        "wide.png": labels.astype(np.uint16) * 300,
        "wide.tif": labels.astype(np.uint32) * 70_000,
        "float.tif": labels.astype(np.float32),
        "white.png": white,
        "rgb.png": np.dstack([white] * 3),
        "rgba.png": np.dstack([white] * 3 + [np.full((80, 80), 255, np.uint8)]),
    }
    for name, values in kinds.items():
        mask = read_mask(save(tmp_path / name, values), field)
        assert mask.count == 3, name
        np.testing.assert_array_equal(mask.labels, labels)
        assert name in mask.method


def test_labels_part_what_touches(tmp_path: Path) -> None:
    labels = np.zeros((40, 40), np.uint8)
    labels[10:30, 10:20], labels[10:30, 20:30] = 7, 9
    field = read_field(save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[np.minimum(labels, 1)]))
    assert read_mask(save(tmp_path / "m.png", labels), field).count == 2
    assert read_mask(save(tmp_path / "w.png", np.minimum(labels, 1) * 255), field).count == 1


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("m.png", np.ones((39, 40), np.uint8), r"m\.png: the mask has 40 × 39 pixels, the image .*in\.png 40 × 40"),
        ("m.png", np.zeros((40, 40), np.uint8), r"m\.png: the mask is empty: every pixel is 0"),
        ("m.tif", np.full((40, 40), 0.5, np.float32), r"pixel \(0, 0\) of the mask is 0\.5; labels are whole numbers"),
        ("m.tif", np.full((40, 40), np.nan, np.float32), r"pixel \(0, 0\) of the mask is nan"),
        ("m.tif", np.full((40, 40), -3, np.int16), r"pixel \(0, 0\) of the mask is -3"),
        ("m.png", np.full((40, 40, 3), (255, 0, 0), np.uint8), r"the mask is coloured"),
        ("m.jpg", np.full((40, 40), 255, np.uint8), r"m\.jpg: the mask is neither PNG nor TIFF"),
        ("m.png", np.eye(40, dtype=np.uint8) * np.arange(40, dtype=np.uint8)[::-1] % 5, r"4 values are scattered"),
    ],
)
def test_bad_masks_are_refused(name: str, values: Pixels, message: str, model: DisplayModel, tmp_path: Path) -> None:
    image = save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[discs([(20, 20)], 8, 40)])
    with pytest.raises(LutgenError, match=message):
        nuclei(image, model, mask=save(tmp_path / name, values), hours=HOURS)


def test_missing_and_damaged_masks_are_refused(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([(20, 20)], 8, 40)
    image = save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[labels])
    with pytest.raises(LutgenError, match=r"gone\.png: cannot read the mask: no such file"):
        nuclei(image, model, mask=tmp_path / "gone.png")
    whole = save(tmp_path / "m.png", labels).read_bytes()
    (tmp_path / "m.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(LutgenError, match=r"m\.png: the mask is damaged"):
        nuclei(image, model, mask=tmp_path / "m.png")


def test_images_without_nuclei_are_refused(model: DisplayModel, tmp_path: Path) -> None:
    flat = save(tmp_path / "flat.png", np.full((40, 40, 3), 200, np.uint8))
    noise = np.random.default_rng(4).normal((225, 170, 200), 3.0, (80, 80, 3)).astype(np.uint8)
    specks = painted(discs(grid(25, 100), 0.5, 100))
    with pytest.raises(LutgenError, match=r"flat\.png: all pixels have one colour"):
        nuclei(flat, model)
    with pytest.raises(LutgenError, match=r"noise\.png: no nuclei were found: nothing holds clearly more haematoxylin"):
        nuclei(save(tmp_path / "noise.png", noise), model)
    with pytest.raises(LutgenError, match=r"specks\.png: no nuclei were found"):
        nuclei(save(tmp_path / "specks.png", specks), model)
    discs_of = save(tmp_path / "discs.png", painted(discs(grid(25, 100), 7, 100)))
    with pytest.raises(LutgenError, match=r"16 spots are smaller than 5000 pixels"):
        nuclei(discs_of, model, min_area=5000)
    clear = save(tmp_path / "clear.png", np.zeros((20, 20, 4), np.uint8))
    with pytest.raises(LutgenError, match=r"every pixel is transparent"):
        nuclei(clear, model)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stain": "giemsa"}, r"unknown stain 'giemsa'\. Pick one of: auto, he, hdab"),
        ({"source": "hdr"}, r"unknown source 'hdr'"),
        ({"modes": ("faded",)}, r"unknown mode 'faded'"),
        ({"hours": (20_000,)}, r"hour 20000 is outside the measured span"),
        ({"hours": range(10_001)}, r"10001 hours are more than 10000"),
        ({"min_area": 0}, r"--min-area 0: give the pixels of the smallest nucleus, at least 1"),
        ({"loss": 0}, r"--loss 0: give the loss in per cent, above 0 and below 100"),
        ({"loss": float("nan")}, r"--loss nan"),
        ({"mask": "m.png", "stain": "he"}, r"--mask says where the nuclei are: leave --stain out"),
    ],
)
def test_bad_questions_are_refused(options: dict[str, Any], message: str, model: DisplayModel, tmp_path: Path) -> None:
    image = save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[discs([(20, 20)], 8, 40)])
    with pytest.raises(LutgenError, match=message):
        nuclei(image, model, **options)


def test_slides_and_large_pictures_are_refused_before_they_are_read(
    model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(LutgenError, match=r"s\.svs: is a slide\. Give a field of it"):
        nuclei("s.svs", model)
    monkeypatch.setattr(blocks, "FIELD_PIXELS", 1000)
    image = save(tmp_path / "in.png", np.zeros((40, 40, 3), np.uint8))
    with pytest.raises(LutgenError, match=r"in\.png: 40 × 40 pixels are more than the 1,000 in which nuclei"):
        nuclei(image, model)


def test_crowded_masks_are_refused_where_there_is_no_ring(model: DisplayModel, tmp_path: Path) -> None:
    labels = np.ones((40, 40), np.uint8)
    labels[:, 20:] = 2
    full = save(tmp_path / "full.png", np.full((40, 40), 255, np.uint8))
    image = save(tmp_path / "in.png", np.array([GROUND, INK, PALE], np.uint8)[labels])
    with pytest.raises(LutgenError, match=r"no nucleus \(of 2\) has room around it for a ring"):
        nuclei(image, model, mask=save(tmp_path / "m.png", labels))
    with pytest.raises(LutgenError, match=r"no nucleus \(of 1\) has room"):
        nuclei(image, model, mask=full)


def test_without_scikit_image_it_says_what_to_install_and_masks_still_work(
    model: DisplayModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    labels = discs(grid(25, 100), 7, 100)
    image, mask = save(tmp_path / "in.png", painted(labels)), save(tmp_path / "m.png", labels)

    monkeypatch.setitem(sys.modules, "skimage.color", None)  # as if skimage were not installed
    with pytest.raises(LutgenError, match=r"scikit-image, which cannot be imported .*pip install lutgen\[nuclei\]"):
        nuclei(image, model)
    assert nuclei(image, model, mask=mask, hours=HOURS).nuclei.count == 16


# Output ---------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def document(model: DisplayModel, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("document")
    image = save(folder / "in.png", painted(discs(grid(25, 150), 7, 150)))
    content: dict[str, Any] = json.loads(json.dumps(nuclei(image, model, hours=HOURS).as_json(), allow_nan=False))
    return content


def test_json_is_as_the_schema_says(document: dict[str, Any]) -> None:
    validator("nuclei").validate(document)
    assert (document["nuclei"], document["width"], document["loss_percent"]) == (36, 150, 10.0)
    point = document["modes"]["chroma-luma"][2]
    assert point["hours"] == 18_000.0
    assert point["p5"] <= point["p25"] <= point["median"] <= point["p75"] <= point["p95"]
    low, high = point["change_interval"]
    assert low <= point["change"] <= high


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("schema",), 2),
        (("nuclei",), 0),
        (("modes",), {}),
        (("modes", "faded"), []),
        (("modes", "chroma", 0, "median"), None),
        (("modes", "chroma", 0, "lost_share"), 1.5),
        (("modes", "chroma", 0, "change_interval"), [0.1]),
        (("loss_percent",), 100),
    ],
)
def test_the_schema_refuses_what_is_wrong(path: tuple[str | int, ...], value: object, document: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        validator("nuclei").validate(altered(document, path, value))


def test_csv_is_a_line_a_nucleus(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([(20, 20), (50, 60)], 8, 80)
    pixels = np.array([GROUND, INK, PALE], np.uint8)[labels]
    analysis = nuclei(save(tmp_path / "in.png", pixels), model, mask=save(tmp_path / "m.png", labels), hours=HOURS)
    rows = list(csv.DictReader(io.StringIO(analysis.as_csv())))
    assert [(row["nucleus"], row["x"], row["y"]) for row in rows] == [("1", "20.0", "20.0"), ("2", "60.0", "50.0")]
    for each, row in enumerate(rows):
        assert int(row["pixels"]) == np.count_nonzero(labels == each + 1)
        assert int(row["ring_pixels"]) == np.count_nonzero(analysis.rings.labels == each + 1)
        assert float(row["unaged"]) == pytest.approx(analysis.contrasts["chroma"].unaged[each], abs=5e-5)
        last = analysis.contrasts["chroma-luma"].aged[2, each]
        assert float(row["chroma-luma_18000h"]) == pytest.approx(last, abs=5e-5)


def test_progress_rises_to_the_whole(model: DisplayModel, tmp_path: Path) -> None:
    labels = discs([(20, 20)], 8, 40)
    image, mask = save(tmp_path / "in.png", np.array([GROUND, INK], np.uint8)[labels]), save(tmp_path / "m.png", labels)
    calls: list[tuple[int, int]] = []
    nuclei(image, model, mask=mask, hours=HOURS, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(done, 6) for done in range(1, 7)]
