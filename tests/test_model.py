"""The display model against its literal twin and against properties of any display."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lutgen.colorimetry import (
    CHUNK,
    LINEAR_TO_XYZ,
    code_to_linear,
    delta_e_2000,
    linear_to_code,
    linear_to_lab,
    transform,
    xyY_to_xyz,
)
from lutgen.display import MODES, REFERENCES, SELECTIONS, DisplayModel, default_display, load_model
from lutgen.display.paper import averaged_matrices, matrices_of, nearest_weights, three_point_matrices
from lutgen.display.tips import luminance_law
from lutgen.errors import LutgenError
from lutgen.readings import Measurements, read_measurements
from tests.quick import draws
from tests.twin import PAPER_LAW, Law, Row, Twin, rows_of_csv

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

DRIVES = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
#: Hours on a measured time, between two times, at a kink of the paper's law, and at both ends.
HOURS = (0.0, 2750.5, 9999.9, 10_000.0, 17_123.456, 18_000.0)


def measured(hours: list[float], xyY: Array) -> Measurements:
    """Measurements of tips xyY in cd/m², shape (N, 4, 3), at N hours."""
    return Measurements(
        hours=np.repeat(hours, 4),
        drive=np.tile(DRIVES, (len(hours), 1)),
        xyz_cd_m2=xyY_to_xyz(xyY).reshape(-1, 3),
        lines=np.arange(4.0 * len(hours)),
    )


def twin_rows(readings: Measurements) -> list[Row]:
    """The tips of measurements in the twin's format."""
    hours, tips = readings.tips()
    rows = []
    for hour, four in zip(hours.tolist(), tips.tolist(), strict=True):
        for drive, (x, y, luminance) in zip(DRIVES.tolist(), four, strict=True):
            rows.append(Row(hour, (drive[0], drive[1], drive[2]), (x, y, luminance)))
    return rows


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return rows_of_csv(Path(default_display()).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def aging() -> Measurements:
    """A display that ages in all ways at once: irregular times, luminance that falls and then rises, wide gamut."""
    hours = [0.0, 700.0, 12_345.6, 18_000.0]
    fresh = np.array([[0.31, 0.33, 400.0], [0.68, 0.32, 90.0], [0.26, 0.69, 280.0], [0.15, 0.055, 35.0]])
    drift = np.array([[0.03, 0.035, -150.0], [-0.02, 0.01, -40.0], [0.02, -0.03, -90.0], [0.01, 0.03, -20.0]])
    return measured(hours, np.array([fresh + share * drift for share in (0.0, 0.2, 1.0, 0.7)]))


@pytest.fixture(scope="module")
def colours() -> Array:
    """Code values: random, greys, 8-bit codes, corners, and colours on and near every border of the model."""
    random = np.random.default_rng(7)
    greys = np.repeat(np.linspace(0, 1, 257)[:, np.newaxis], 3, axis=1)
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T.astype(float)
    codes = random.integers(0, 256, (600, 3)) / 255
    return np.concatenate([random.random((1000, 3)), greys, codes, corners, border_colours(random)])


def border_colours(random: np.random.Generator) -> Array:
    """Code values on r'=g', g'=b', r'=b', r'+g'=1, … in linear light, and 1e-3, 1e-6 and 1e-12 beside them.

    No step is near 1e-9, where rounding decides the rule for ties.
    """
    linear = []
    for first, second in ((0, 1), (1, 2), (0, 2)):
        for mirror in (False, True):
            for step in (0.0, 1e-12, -1e-12, 1e-6, -1e-6, 1e-3, -1e-3):
                colour = random.uniform(0.01, 0.99, (20, 3))
                colour[:, second] = (1 - colour[:, first] if mirror else colour[:, first]) + step
                linear.append(colour)
    return linear_to_code(np.clip(np.concatenate(linear), 0, 1))


@pytest.mark.parametrize("display", ["default", "aging"])
@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("mode", MODES)
def test_the_fast_model_does_what_its_literal_twin_does(
    *,
    mode: str,
    selection: str,
    reference: str,
    display: str,
    readings: Measurements,
    aging: Measurements,
    rows: list[Row],
    colours: Array,
) -> None:
    data = readings if display == "default" else aging
    # The twin's own reader reads the tips of the default display.
    data_rows = rows if display == "default" else twin_rows(aging)
    model = DisplayModel(data, reference=reference, selection=selection, luminance=luminance_law("paper"))
    # Between knots the test uses every third colour of the twin; at other hours every twelfth is enough.
    for hours in HOURS if mode != "stable" else HOURS[:2]:
        some = colours[:: 3 if hours == 2750.5 else 12]
        twin = Twin(data_rows, mode=mode, hours=hours, reference=reference, selection=selection)
        aged = model.at(mode, hours)
        listed = [(red, green, blue) for red, green, blue in some.tolist()]
        np.testing.assert_allclose(aged.code_to_xyz(some), [twin.xyz(code) for code in listed], rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            aged.code_to_linear(some), [twin.linear(code) for code in listed], rtol=0, atol=1e-12
        )
        np.testing.assert_allclose(aged.code_to_code(some), [twin.code(code) for code in listed], rtol=0, atol=1e-12)


def test_the_twin_test_meets_every_region_and_every_tie(colours: Array) -> None:
    shares = nearest_weights(code_to_linear(colours))
    met = {tuple(np.flatnonzero(row)) for row in shares}
    # w, r, g, b alone; each pair with a border inside the cube; greys below ½; all four at ½.
    pairs = {(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)}
    assert {(0,), (1,), (2,), (3,), (1, 2, 3)} | pairs <= met


@pytest.mark.parametrize("law", ["measured", "table"])
@pytest.mark.parametrize("hours", HOURS)
def test_the_other_luminance_laws_do_what_the_twin_does(
    law: str, hours: float, aging: Measurements, colours: Array, tmp_path: Path
) -> None:
    table: Law | None = None
    name = law
    if law == "table":
        table = ((0.0, 1.0), (5000.0, 1.05), (20_000.0, 0.2))
        file = tmp_path / "mine.csv"
        file.write_text("hour,factor\n0,1\n5000,1.05\n20000,0.2\n")
        name = str(file)
    aged = DisplayModel(aging, luminance=luminance_law(name)).at("chroma-luma", hours)
    twin = Twin(twin_rows(aging), mode="chroma-luma", hours=hours, law=table)
    expected = [twin.xyz((red, green, blue)) for red, green, blue in colours[::10].tolist()]
    np.testing.assert_allclose(aged.code_to_xyz(colours[::10]), expected, rtol=0, atol=1e-12)


# Properties of any plausible display


@st.composite
def tips(draw: st.DrawFn, *, additive: bool = False) -> Array:
    """Plausible xyY of white and primaries, (4, 3). Each is near a real display's tip, and additive only on request."""
    centres = [(0.3127, 0.3290), (0.64, 0.33), (0.30, 0.60), (0.15, 0.06)]
    shift = draw(arrays(np.float64, (4, 2), elements=st.floats(-0.025, 0.025)))
    luminance = draw(arrays(np.float64, 4, elements=st.floats(0.8, 1.25)))
    white = draw(st.floats(100.0, 2000.0))  # far above luminances that are refused as relative
    xyY = np.column_stack([np.array(centres) + shift, white * luminance * [1.0, 0.21, 0.72, 0.07]])
    if additive:
        total = xyY_to_xyz(xyY[1:]).sum(axis=0)
        xyY[0] = [total[0] / total.sum(), total[1] / total.sum(), total[1]]
    return xyY


@st.composite
def histories(draw: st.DrawFn) -> Measurements:
    """Measurements at 2 to 4 times over 18 000 h. Each chromaticity drifts by at most 0.014, luminances freely.

    A larger drift would move sRGB's red out of the chromaticity diagram (x + y > 1), and such a reading is refused.
    """
    inner = draw(st.lists(st.floats(1.0, 17_999.0), max_size=2, unique=True))
    hours = [0.0, *sorted(inner), 18_000.0]
    fresh = draw(tips())
    drift = draw(arrays(np.float64, (len(hours), 4, 2), elements=st.floats(-0.007, 0.007)))
    gain = draw(arrays(np.float64, (len(hours), 4), elements=st.floats(0.3, 1.1)))
    xyY = np.repeat(fresh[np.newaxis], len(hours), axis=0)
    xyY[..., :2] += drift
    # No reading has x + y > 1: a larger drift ends at the edge of the diagram.
    xyY[..., :2] *= np.minimum(1.0, 0.999 / xyY[..., :2].sum(axis=-1, keepdims=True))
    xyY[..., 2] *= gain
    return measured(hours, xyY)


codes = arrays(np.float64, (40, 3), elements=st.floats(0.0, 1.0))


@given(tips())
def test_each_t_reproduces_its_colour_point_and_each_t_prime_the_other_three(xyY: Array) -> None:
    xyz = xyY_to_xyz(xyY)
    primed = three_point_matrices(xyz)
    final = averaged_matrices(primed)
    scale = np.abs(xyz).max()
    for i in range(4):
        np.testing.assert_allclose(final[i] @ DRIVES[i], xyz[i], rtol=0, atol=1e-13 * scale)
        for j in set(range(4)) - {i}:
            np.testing.assert_allclose(primed[i] @ DRIVES[j], xyz[j], rtol=0, atol=1e-13 * scale)


@given(tips(additive=True))
def test_tips_that_add_up_make_all_four_matrices_equal(xyY: Array) -> None:
    additive = xyY_to_xyz(xyY[1:]).T
    for selection in SELECTIONS:
        matrices = matrices_of(xyY, selection).array
        expected = np.broadcast_to(additive, (4, 3, 3))
        np.testing.assert_allclose(matrices, expected, rtol=0, atol=1e-13 * np.abs(additive).max())


@pytest.mark.parametrize(
    ("name", "by", "stays"),
    [
        ("red", (0.02, 0.0), True),
        ("red", (0.07, 0.0), False),  # sRGB's red after this shift: x + y = 1.04
        ("blue", (0.0, -0.05), True),
        ("blue", (0.0, -0.07), False),  # sRGB's blue after this shift: y = -0.01
    ],
)
def test_a_primary_with_which_srgbs_would_leave_all_colours_is_refused(
    name: str, by: tuple[float, float], stays: bool
) -> None:
    fresh = np.array([[0.31, 0.33, 100.0], [0.58, 0.34, 20.0], [0.30, 0.60, 70.0], [0.16, 0.12, 10.0]])
    moved = fresh.copy()
    moved[["white", "red", "green", "blue"].index(name), :2] += by
    model = DisplayModel(measured([0.0, 1000.0], np.stack([fresh, moved])))
    assert np.isfinite(
        DisplayModel(model.measurements, reference="absolute").at("chroma", 1000.0).code_to_xyz(DRIVES)
    ).all()
    if stays:
        assert np.isfinite(model.at("chroma", 1000.0).code_to_xyz(DRIVES)).all()
    else:
        with pytest.raises(
            LutgenError,
            match=f"by hour 1000 {name} has moved so far .* lies outside all real colours.*--reference absolute",
        ):
            model.at("chroma", 1000.0).code_to_xyz(DRIVES)


def test_tips_that_do_not_add_up_make_four_different_matrices(readings: Measurements) -> None:
    """Exclude that the property above holds only because the matrices are always equal."""
    for selection in SELECTIONS:
        matrices = DisplayModel(readings, selection=selection).matrices("chroma", 18_000.0).array
        assert min(np.abs(matrices[i] - matrices[j]).max() for i in range(4) for j in range(i)) > 1e-4


@given(histories(), codes, st.sampled_from(sorted(SELECTIONS)), st.sampled_from(sorted(MODES)))
def test_hour_0_relative_is_the_identity(data: Measurements, code: Array, selection: str, mode: str) -> None:
    aged = DisplayModel(data, selection=selection).at(mode, 0.0)
    np.testing.assert_allclose(aged.code_to_code(code), code, rtol=0, atol=1e-12)


@given(histories(), codes, st.floats(0.0, 18_000.0))
def test_stable_is_hour_0_at_every_hour(data: Measurements, code: Array, hours: float) -> None:
    for reference in REFERENCES:
        model = DisplayModel(data, reference=reference)
        np.testing.assert_array_equal(
            model.at("stable", hours).code_to_xyz(code), model.at("chroma", 0.0).code_to_xyz(code)
        )


@given(histories(), st.floats(0.0, 18_000.0), st.sampled_from(sorted(SELECTIONS)))
def test_at_the_colour_points_the_model_shows_the_measured_colours(
    data: Measurements, hours: float, selection: str
) -> None:
    model = DisplayModel(data, reference="absolute", selection=selection)
    times, tips_then = data.tips()
    at_hour = [np.interp(hours, times, tips_then[:, i, k]) for i in range(4) for k in range(3)]
    xyY = np.reshape(at_hour, (4, 3))
    held = xyY_to_xyz(xyY) / xyY[0, 2]
    np.testing.assert_allclose(model.at("chroma", hours).code_to_xyz(DRIVES), held, rtol=0, atol=1e-12)


@pytest.mark.slow
@given(histories(), codes, st.floats(0.0, 18_000.0), st.floats(0.3, 10.0))
def test_the_unit_of_luminance_is_of_no_consequence(
    data: Measurements, code: Array, hours: float, factor: float
) -> None:
    brighter = measured(np.unique(data.hours).tolist(), data.tips()[1] * [1.0, 1.0, factor])
    for reference in REFERENCES:
        for mode in MODES:
            for law in (luminance_law("paper"), luminance_law("measured")):
                one = DisplayModel(data, reference=reference, luminance=law).at(mode, hours)
                other = DisplayModel(brighter, reference=reference, luminance=law).at(mode, hours)
                np.testing.assert_allclose(other.code_to_xyz(code), one.code_to_xyz(code), rtol=0, atol=1e-12)


@given(histories(), codes, st.floats(0.3, 10.0))
def test_scaling_the_later_luminance_of_all_tips_scales_xyz_as_measured_and_is_held_by_chroma(
    data: Measurements, code: Array, factor: float
) -> None:
    """Y of all tips × factor from the second time on: at the last hour, XYZ of law `measured` scales with it."""
    times, xyY = data.tips()
    dimmer = xyY * np.where(np.arange(len(times)) > 0, factor, 1.0)[:, np.newaxis, np.newaxis] ** [0.0, 0.0, 1.0]
    scaled = measured(times.tolist(), dimmer)
    law = luminance_law("measured")
    last = float(times[-1])
    for reference in REFERENCES:
        one, other = (DisplayModel(d, reference=reference, luminance=law) for d in (data, scaled))
        np.testing.assert_allclose(
            other.at("chroma-luma", last).code_to_xyz(code),
            factor * one.at("chroma-luma", last).code_to_xyz(code),
            rtol=1e-11,
            atol=1e-12,
        )
        np.testing.assert_allclose(
            other.at("chroma", last).code_to_xyz(code), one.at("chroma", last).code_to_xyz(code), rtol=0, atol=1e-12
        )


@given(tips(), st.floats(0.1, 10.0), codes, st.sampled_from(sorted(SELECTIONS)))
def test_scaling_y_of_all_tips_scales_xyz(xyY: Array, factor: float, code: Array, selection: str) -> None:
    from lutgen.display.paper import Selection

    signal = Selection(selection)(code_to_linear(code))
    one, other = matrices_of(xyY, selection)(signal), matrices_of(xyY * [1, 1, factor], selection)(signal)
    np.testing.assert_allclose(other, factor * one, rtol=1e-12, atol=1e-11 * factor * xyY[0, 2])


@given(histories(), st.floats(0.0, 18_000.0), st.sampled_from(REFERENCES), st.sampled_from(sorted(SELECTIONS)))
def test_chroma_holds_the_luminance_of_white_and_chroma_luma_follows_the_law(
    data: Measurements, hours: float, reference: str, selection: str
) -> None:
    white = np.ones((1, 3))
    model = DisplayModel(data, reference=reference, selection=selection, luminance=luminance_law("paper"))
    assert model.at("chroma", hours).code_to_xyz(white)[0, 1] == pytest.approx(1.0, abs=1e-12)
    expected = np.interp(hours, [row[0] for row in PAPER_LAW], [row[1] for row in PAPER_LAW])
    assert model.at("chroma-luma", hours).code_to_xyz(white)[0, 1] == pytest.approx(expected, abs=1e-12)
    free = DisplayModel(data, reference=reference, selection=selection, luminance=luminance_law("measured"))
    times, xyY = data.tips()
    expected = np.interp(hours, times, xyY[:, 0, 2]) / xyY[0, 0, 2]
    assert free.at("chroma-luma", hours).code_to_xyz(white)[0, 1] == pytest.approx(expected, rel=1e-12)


# `continuous`


@given(histories(), st.floats(0.0, 18_000.0), st.integers(0, 2**32 - 1))
@draws(50)
def test_continuous_does_not_jump_at_its_borders(data: Measurements, hours: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    linear = random.uniform(0.0, 1.0, (60, 3))
    # First the two smallest channels are equal, then all three; each side of the border by 1e-7.
    linear[:, 1] = linear[:, 0] = linear.min(axis=1)
    linear[40:, 2] = linear[40:, 0]
    for channel in range(3):
        beside = np.roll(linear, channel, axis=1)
        step = 1e-7 * np.eye(3)[random.integers(0, 3, 60)]
        aged = DisplayModel(data, selection="continuous").at("chroma", hours)
        ways = [aged.code_to_xyz(linear_to_code(beside + sign * step)) for sign in (-1.0, 1.0)]
        slope = np.abs(aged.tail[0].array).max()  # type: ignore[attr-defined]
        assert np.abs(ways[0] - ways[1]).max() <= 2e-7 * slope * 3 + 1e-12


@given(histories(), st.floats(0.0, 18_000.0), arrays(np.float64, (200, 3), elements=st.floats(0.0, 1.0)))
@draws(50)
def test_both_selections_are_the_additive_display_plus_a_share_of_what_it_lacks(
    data: Measurements, hours: float, linear: Array
) -> None:
    """The model in closed form, derived by hand from the paper's steps 2 and 3.

    With D = XYZ_w − XYZ_r − XYZ_g − XYZ_b, T'_w = [XYZ_r XYZ_g XYZ_b] and T'_r = T'_w + D·(1,0,0) and so on. Hence
    ``continuous`` adds D·min(r',g',b'). ``nearest`` adds ⅓D·(r'+g'+b') near white, and elsewhere ⅓D times the sum
    without the largest channel: no jump between two primaries, and a jump of ⅓D·max(r',g',b') at white's borders.
    """
    # A separate test covers ties with white.
    linear = linear[np.abs(np.sort(linear, axis=1)[:, :2].sum(axis=1) - 1) > 1e-6]
    total, low, high = linear.sum(axis=1), linear.min(axis=1), linear.max(axis=1)
    near_white = total - high > 1
    shares = {"nearest": np.where(near_white, total, total - high) / 3, "continuous": low}
    for selection, share in shares.items():
        aged = DisplayModel(data, reference="absolute", selection=selection).at("chroma", hours)
        white, *primaries = aged.code_to_xyz(DRIVES)
        lacking = white - np.sum(primaries, axis=0)
        expected = linear @ np.array(primaries) + share[:, np.newaxis] * lacking
        np.testing.assert_allclose(aged.code_to_xyz(linear_to_code(linear)), expected, rtol=0, atol=3e-9)


def test_nearest_jumps_at_whites_borders_so_the_test_of_continuity_can_fail(readings: Measurements) -> None:
    aged = DisplayModel(readings, selection="nearest").at("chroma", 18_000.0)
    beside = np.array([[0.9, 0.3, 0.7 - 1e-7], [0.9, 0.3, 0.7 + 1e-7]])
    ways = aged.code_to_xyz(linear_to_code(beside))
    assert np.abs(ways[0] - ways[1]).max() > 1e-4


@pytest.mark.slow
@given(histories(), st.floats(0.0, 18_000.0))
def test_continuous_is_a_2x2x2_tetrahedral_table_in_linear_light(data: Measurements, hours: float) -> None:
    """Interpolate literally: from black along the axis of the largest channel, then the next, then the last."""
    aged = DisplayModel(data, selection="continuous").at("chroma-luma", hours)
    random = np.random.default_rng(0)
    linear = random.random((50, 3))
    expected = []
    for colour in linear:
        order = np.argsort(-colour)
        corner = np.zeros(3)
        value = np.zeros(3)
        at_corner = np.zeros(3)
        for channel in order:
            corner[channel] = 1.0
            here = aged.code_to_xyz(corner[np.newaxis])[0]
            value = value + colour[channel] * (here - at_corner)
            at_corner = here
        expected.append(value)
    np.testing.assert_allclose(aged.code_to_xyz(linear_to_code(linear)), expected, rtol=0, atol=1e-12)


# Ties


def test_greys_below_code_188_use_the_mean_of_the_three_primaries_matrices_exactly(readings: Measurements) -> None:
    grey = np.repeat(np.arange(188)[:, np.newaxis] / 255, 3, axis=1)
    shares = nearest_weights(code_to_linear(grey))
    np.testing.assert_array_equal(shares, np.tile([0.0, 1 / 3, 1 / 3, 1 / 3], (188, 1)))
    aged = DisplayModel(readings).at("chroma", 18_000.0)
    mean = DisplayModel(readings).matrices("chroma", 18_000.0).array[1:].mean(axis=0)
    np.testing.assert_allclose(aged.code_to_xyz(grey), transform(mean, code_to_linear(grey)), rtol=1e-15, atol=0)


def test_greys_from_code_188_on_use_whites_matrix_exactly(readings: Measurements) -> None:
    grey = np.repeat(np.arange(188, 256)[:, np.newaxis] / 255, 3, axis=1)
    np.testing.assert_array_equal(nearest_weights(code_to_linear(grey)), np.tile([1.0, 0.0, 0.0, 0.0], (68, 1)))
    aged = DisplayModel(readings).at("chroma", 18_000.0)
    white = DisplayModel(readings).matrices("chroma", 18_000.0).array[0]
    np.testing.assert_allclose(aged.code_to_xyz(grey), transform(white, code_to_linear(grey)), rtol=1e-15, atol=0)


@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("toward", [0.0, 2.0])
@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_grey_nudged_by_the_last_bit_of_one_channel_stays_where_it_was(
    selection: str, toward: float, channel: int, readings: Measurements
) -> None:
    grey = np.repeat(np.linspace(0.001, 0.999, 999)[:, np.newaxis], 3, axis=1)
    nudged = grey.copy()
    nudged[:, channel] = np.nextafter(grey[:, channel], toward)
    assert (nudged != grey).any(axis=1).all()
    for mode in MODES:
        aged = DisplayModel(readings, selection=selection).at(mode, 17_000.0)
        np.testing.assert_allclose(aged.code_to_xyz(nudged), aged.code_to_xyz(grey), rtol=0, atol=1e-12)


def test_points_within_1e_9_share_and_others_do_not() -> None:
    linear = np.array(
        [[0.4, 0.4, 0.1], [0.4, 0.4 + 1e-10, 0.1], [0.4, 0.4 + 1e-7, 0.1], [0.5, 0.5, 0.5], [0.7, 0.3, 0.2]]
    )
    expected = [
        [0, 1 / 2, 1 / 2, 0],
        [0, 1 / 2, 1 / 2, 0],
        [0, 0, 1, 0],
        [1 / 4, 1 / 4, 1 / 4, 1 / 4],
        [0, 1, 0, 0],
    ]
    np.testing.assert_array_equal(nearest_weights(linear), expected)


def test_the_papers_own_example_selects_blue() -> None:
    np.testing.assert_array_equal(nearest_weights(np.array([[0.02, 0.012, 0.99]])), [[0, 0, 0, 1]])


# Luminance laws and hours


@pytest.mark.parametrize(
    ("hours", "factor"), [(0, 1.0), (5000, 0.835), (10_000, 0.67), (14_000, 0.535), (18_000, 0.40)]
)
def test_the_papers_law_has_the_papers_numbers(hours: float, factor: float, readings: Measurements) -> None:
    model = DisplayModel(readings)
    assert model.luminance.factor(hours, model.tips) == pytest.approx(factor, abs=1e-15)


@pytest.mark.parametrize("hours", [-1e-9, -1.0, 18_000.000_001, 1e9, float("nan"), float("inf")])
@pytest.mark.parametrize("mode", MODES)
def test_hours_outside_the_measured_span_are_refused(mode: str, hours: float, readings: Measurements) -> None:
    with pytest.raises(LutgenError, match=r"outside the measured span 0\.\.18000 h"):
        DisplayModel(readings).at(mode, hours)


def test_the_papers_law_is_not_extrapolated(aging: Measurements) -> None:
    longer = measured([0.0, 30_000.0], aging.tips()[1][:2])
    model = DisplayModel(longer, luminance=luminance_law("paper"))
    model.at("chroma", 25_000.0)
    with pytest.raises(LutgenError, match=r"outside the span 0\.\.18000 h of the luminance law 'paper'"):
        model.at("chroma-luma", 25_000.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "at least two rows"),
        ("0,1\n", "at least two rows"),
        ("1,1\n2,0.5\n", "increasing from 0"),
        ("0,1\n0,0.5\n", "increasing from 0"),
        ("0,1\n2,0.5\n1,0.7\n", "increasing from 0"),
        ("0,1\n100,0\n", "above 0"),
        ("0,1\n100,-0.5\n", "above 0"),
        ("0,1\n100,nan\n", "two numbers"),
        ("0,1\n100,inf\n", "two numbers"),
        ("0,0.4\n18000,1\n", "the first of them 0,1"),
        ("0,1.01\n18000,0.4\n", "the first of them 0,1"),
        ("0,100\n100,67\n", "at most 10"),
        ("0,1\n100,half\n", "two numbers"),
        ("0,1\n100,0,5\n", "two numbers"),
        ("0;1\n100;0,5\n", "two numbers"),
    ],
)
def test_a_bad_luminance_table_is_refused(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "law.csv"
    path.write_text(text)
    with pytest.raises(LutgenError, match=says) as error:
        luminance_law(str(path))
    assert "law.csv" in str(error.value)


def test_a_file_without_an_end_is_not_read_to_it(tmp_path: Path) -> None:
    for name, read in (("law.csv", luminance_law), ("display.csv", read_measurements), ("model.toml", load_model)):
        endless = tmp_path / name
        endless.symlink_to("/dev/zero")
        with pytest.raises(LutgenError, match="larger than"):
            read(str(endless))


@pytest.mark.parametrize("name", ["papers", "", "mine.txt"])
def test_an_unknown_law_names_the_choices(name: str) -> None:
    with pytest.raises(LutgenError, match="Pick one of: paper, measured"):
        luminance_law(name)


def test_a_luminance_table_that_is_missing_or_binary_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match="cannot read the luminance table"):
        luminance_law(str(tmp_path / "none.csv"))
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(LutgenError, match="cannot read the luminance table"):
        luminance_law(str(tmp_path / "binary.csv"))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"reference": "relativ"}, "unknown reference 'relativ'. Pick one of: relative, absolute"),
        ({"selection": "next"}, "unknown selection 'next'. Pick one of: nearest, continuous"),
    ],
)
def test_an_unknown_option_names_the_choices(options: dict[str, Any], says: str, readings: Measurements) -> None:
    with pytest.raises(LutgenError) as error:
        DisplayModel(readings, **options)
    assert says in str(error.value)


def test_an_unknown_mode_names_the_choices(readings: Measurements) -> None:
    with pytest.raises(LutgenError, match="Pick one of: stable, chroma, chroma-luma"):
        DisplayModel(readings).at("croma", 0.0)


# Clipping, shapes and chunks


def test_the_clipped_share_counts_colours_outside_the_viewers_gamut(readings: Measurements, rows: list[Row]) -> None:
    code = np.random.default_rng(8).random((3000, 3))
    twin = Twin(rows, mode="chroma", hours=18_000.0)
    outside = 0
    for red, green, blue in code.tolist():
        linear = twin.linear((red, green, blue))
        outside += min(linear) < -1e-6 or max(linear) > 1 + 1e-6
    model = DisplayModel(readings)
    assert 0 < outside < 3000
    assert model.at("chroma", 18_000.0).clipped_share(code) == outside / 3000
    assert model.at("chroma", 0.0).clipped_share(code) == 0.0


def test_the_viewers_code_stays_within_0_and_1_and_equals_the_unclipped_one_inside(aging: Measurements) -> None:
    code = np.random.default_rng(9).random((5000, 3))
    aged = DisplayModel(aging, reference="absolute").at("chroma", 18_000.0)
    shown, linear = aged.code_to_code(code), aged.code_to_linear(code)
    assert shown.min() == 0.0
    # 1.055 · 1 − 0.055 is one bit below 1 in floating point.
    assert 1.0 - 2**-53 <= shown.max() <= 1.0
    inside = (linear >= 0) & (linear <= 1)
    np.testing.assert_array_equal(shown[inside], linear_to_code(linear)[inside])


@pytest.mark.parametrize("shape", [(3,), (0, 3), (5, 3), (4, 6, 3)])
def test_an_image_of_any_shape_keeps_it(shape: tuple[int, ...], readings: Measurements) -> None:
    aged = DisplayModel(readings).at("chroma", 10_000.0)
    routines: list[Callable[[Array], Array]] = [aged.code_to_code, aged.code_to_linear, aged.code_to_xyz]
    for routine in routines:
        assert routine(np.full(shape, 0.5)).shape == shape


def test_chunks_leave_no_seam(readings: Measurements) -> None:
    code = np.random.default_rng(10).random((2 * CHUNK + 5, 3))
    aged = DisplayModel(readings).at("chroma-luma", 12_345.0)
    whole = aged.code_to_code(code)
    for start in (0, CHUNK - 2, 2 * CHUNK - 2):
        part = slice(start, start + 7)
        np.testing.assert_array_equal(whole[part], aged.code_to_code(code[part]))


def test_evaluating_does_not_write_into_the_image(readings: Measurements) -> None:
    code = np.full((10, 3), 0.25)
    DisplayModel(readings).at("chroma", 10_000.0).code_to_code(code)
    assert (code == 0.25).all()


# Sizes that the paper and model.md state


def test_white_drifts_more_than_primaries_and_toward_yellow_in_the_default_display(readings: Measurements) -> None:
    shown = DisplayModel(readings).at("chroma", 18_000.0).code_to_linear(DRIVES)
    lab = linear_to_lab(shown)
    fresh = linear_to_lab(DRIVES)
    assert lab[0, 2] - fresh[0, 2] > 5
    assert delta_e_2000(lab[0], fresh[0]) > delta_e_2000(lab[1:], fresh[1:]).max()


def test_absolute_differs_from_relative_by_the_displays_own_primaries(readings: Measurements) -> None:
    absolute = DisplayModel(readings, reference="absolute").at("chroma", 0.0)
    _, xyY = readings.tips()
    np.testing.assert_allclose(absolute.code_to_xyz(DRIVES), xyY_to_xyz(xyY[0]) / xyY[0, 0, 2], rtol=0, atol=1e-12)
    relative = DisplayModel(readings).at("chroma", 0.0)
    np.testing.assert_allclose(relative.code_to_xyz(DRIVES), DRIVES @ LINEAR_TO_XYZ.T, rtol=0, atol=1e-12)


# Model files


def test_a_model_file_says_what_the_options_say(tmp_path: Path, aging: Measurements) -> None:
    rows_text = ["hour,R,G,B,x,y,Y"]
    rows_text += [
        ",".join(repr(float(value)) for value in (row.hour, *row.drive, *row.xyY)) for row in twin_rows(aging)
    ]
    (tmp_path / "mine.csv").write_text("\n".join(rows_text) + "\n")
    (tmp_path / "law.csv").write_text("0,1\n18000,0.5\n")
    model_file = tmp_path / "mine.toml"
    model_file.write_text(
        'schema = 1\n[display]\nfile = "mine.csv"\n'
        '[model]\nreference = "absolute"\nselection = "continuous"\nluminance = "law.csv"\n'
    )
    model = load_model(model_file)
    code = np.random.default_rng(11).random((100, 3))
    expected = DisplayModel(
        aging, reference="absolute", selection="continuous", luminance=luminance_law(str(tmp_path / "law.csv"))
    ).at("chroma-luma", 9000.0)
    np.testing.assert_allclose(
        model.at("chroma-luma", 9000.0).code_to_code(code), expected.code_to_code(code), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "schema"),
        ("schema = 2\n", "schema is 2"),
        ("schema = 1\n[display\n", "not a model file"),
        ("schema = 1\nextra = 1\n", "unknown key 'extra'"),
        ('schema = 1\n[model]\nmode = "chroma"\n', "unknown key 'mode'"),
        ("schema = 1\n[model]\nreference = 1\n", "reference is 1; it must be a text"),
        ("schema = 1\ndisplay = 3\n", "[display] is a table"),
        ('schema = 1\n[model]\nreference = "both"\n', "unknown reference 'both'"),
        ('schema = 1\n[model]\nluminance = "both"\n', "unknown luminance law 'both'"),
        ('schema = 1\n[display]\nfile = "none.csv"\n', "none.csv"),
    ],
)
def test_a_bad_model_file_is_refused(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(LutgenError) as error:
        load_model(path)
    assert says in str(error.value)


def test_a_model_file_that_is_missing_or_binary_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match="cannot read the model"):
        load_model(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(LutgenError, match="not a model file"):
        load_model(tmp_path / "binary.toml")
    (tmp_path / "deep.toml").write_text("schema = " + "[" * 100_000)
    with pytest.raises(LutgenError, match="not a model file"):
        load_model(tmp_path / "deep.toml")
