"""The spectral estimate: it has the measured tips, and filters act on it as on light."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen import default_display, read_measurements
from lutgen.colorimetry import D65, LINEAR_TO_XYZ, rgb_to_xyz_matrix, xy_to_uv, xyY_to_xyz, xyz_to_xyY
from lutgen.effects import Scene, catalogue, spectra
from lutgen.effects.spectra import (
    BROAD,
    CMFS,
    DEFAULT_CLASS,
    UNSTATED,
    WAVELENGTHS,
    SpectralDisplay,
    class_of,
    lights,
    mapped,
    of_scene,
)
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

CLASSES = tuple(lights())
TIPS = 250.0 * np.vstack([D65, LINEAR_TO_XYZ.T])
ADOBE = 120.0 * np.vstack([D65, rgb_to_xyz_matrix([[0.3127, 0.3290], [0.64, 0.33], [0.21, 0.71], [0.15, 0.06]]).T])
WIDE = np.vstack([D65, rgb_to_xyz_matrix([[0.3127, 0.3290], [0.675, 0.322], [0.265, 0.69], [0.15, 0.06]]).T])


def tips_of_the_default_display() -> Array:
    return xyY_to_xyz(read_measurements(default_display()).tips()[1][0])


def uv(xyz: Array) -> Array:
    return xy_to_uv(xyz_to_xyY(xyz)[..., :2])


def scene_at(hours: Array, light: SpectralDisplay | None) -> Scene:
    return Scene(hours=hours, code=np.ones((len(hours), 3)), white=TIPS[:1], fresh_white=TIPS[:1], light=light)


def through(name: str, signal: Array, hours: Array, light: SpectralDisplay | None, **values: float) -> Array:
    effect = catalogue()[name]
    return effect.function(signal, scene_at(hours, light), **effect.rest() | values)


def test_the_observer_is_that_of_colour_science() -> None:
    import colour

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    np.testing.assert_array_equal(CMFS, observer.values[np.isin(observer.wavelengths, WAVELENGTHS)])


@pytest.mark.parametrize("display_class", CLASSES)
@pytest.mark.parametrize(
    "tips", [TIPS, ADOBE, WIDE, tips_of_the_default_display()], ids=["srgb", "adobe", "wide", "default"]
)
class TestEstimate:
    def test_it_has_the_tips(self, display_class: str, tips: Array) -> None:
        display = SpectralDisplay.of(display_class, tips)
        np.testing.assert_allclose(display.spectra @ CMFS, tips[1:], rtol=1e-9)
        assert display.misfit < 1e-9

    def test_it_is_light(self, display_class: str, tips: Array) -> None:
        display = SpectralDisplay.of(display_class, tips)
        assert display.spectra.shape == (3, 81)
        assert (display.spectra >= 0).all()
        assert (np.abs(np.array(list(display.parts.values())) - 0.5) <= 0.5).all()

    def test_nothing_in_the_way_changes_nothing(self, display_class: str, tips: Array) -> None:
        display = SpectralDisplay.of(display_class, tips)
        xyz = np.random.default_rng(0).uniform(0, 100, size=(5, 3))
        np.testing.assert_allclose(display.through(xyz, np.ones(81)), xyz, rtol=1e-12)
        np.testing.assert_allclose(display.through(xyz, np.full((5, 81), 0.5)), xyz / 2, rtol=1e-12)

    def test_a_filter_acts_as_on_the_light_itself(self, display_class: str, tips: Array) -> None:
        """The slow literal twin: mix the primaries' spectra, filter, and sum."""
        display = SpectralDisplay.of(display_class, tips)
        drive = np.random.default_rng(1).uniform(size=(6, 3))
        passed = 0.2 + 0.8 * np.random.default_rng(2).uniform(size=(6, 81))
        wanted = [
            sum(f * s * c for f, s, c in zip(p, d @ display.spectra, CMFS, strict=True))
            for p, d in zip(passed, drive, strict=True)
        ]
        np.testing.assert_allclose(display.through(drive @ tips[1:], passed), wanted, rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("simulated CCFL-lit medical LCD; stands in for …", "ccfl"),
        ("Cold cathode fluorescent", "ccfl"),
        ("24-inch LCD, white LED edge light", "white-led"),
        ("WLED", "white-led"),
        ("LED-backlit LCD", "white-led"),
        ("RGB LED backlight", "rgb-led"),
        ("RGB-LED", "rgb-led"),
        ("a QD-OLED", "oled"),
        ("LG WOLED television", "wrgb-oled"),
        ("WRGB OLED", "wrgb-oled"),
        ("quantum dot LCD", "quantum-dot"),
        ("QLED, edge lit", "quantum-dot"),
        ("PFS phosphor LED", "pfs-led"),
        ("white LED with KSF phosphor", "pfs-led"),
        ("RG phosphor LED", "green-red-phosphor-led"),
        ("LED with green and red phosphors", "green-red-phosphor-led"),
        ("AMOLED phone", "oled"),
        ("the monitor in room 3", None),
        ("", None),
    ],
)
def test_the_class_is_read_from_what_is_said(text: str, name: str | None) -> None:
    assert class_of(text) == (name or UNSTATED)


def test_a_class_is_found_by_its_own_name() -> None:
    assert [class_of(name) for name in CLASSES] == list(CLASSES)


def test_where_no_class_is_stated_primaries_name_a_narrow_light_and_leave_a_broad_one_to_the_usual() -> None:
    for name in CLASSES:
        primaries = lights()[name].primaries @ CMFS
        display_class = SpectralDisplay.of(UNSTATED, np.vstack([primaries.sum(axis=0), primaries])).display_class
        assert display_class == (DEFAULT_CLASS if name in BROAD else name)
    assert SpectralDisplay.of(UNSTATED, TIPS).display_class == DEFAULT_CLASS


@pytest.mark.parametrize("name", CLASSES)
def test_typical_light_behind_typical_filters_is_white(name: str) -> None:
    white = (lights()[name].primaries @ CMFS).sum(axis=0)
    assert np.hypot(*(uv(white) - uv(D65))) < 0.012


@pytest.mark.parametrize(
    ("name", "part", "peak", "width"),
    [
        ("pfs-led", "green phosphor (β-SiAlON)", 535.0, 54.0),
        ("pfs-led", "red phosphor (PFS)", 630.0, 12.0),
        ("green-red-phosphor-led", "red phosphor (CaAlSiN₃)", 650.0, 90.0),
        ("quantum-dot", "green dots", 530.0, 24.0),
        ("quantum-dot", "blue chip", 450.0, 20.0),
    ],
)
def test_emitters_peak_where_their_sources_say(name: str, part: str, peak: float, width: float) -> None:
    """On the 5 nm grid."""
    light = lights()[name].parts[part]
    assert WAVELENGTHS[light.argmax()] == peak
    fine = np.interp(np.arange(380.0, 780.0, 0.1), WAVELENGTHS, light)
    assert 0.1 * (fine > fine.max() / 2.0).sum() == pytest.approx(width, abs=3.0)


def test_impossible_primaries_are_come_near_to_and_said() -> None:
    tips = TIPS.copy()
    tips[1, 2] = -0.5  # noise of a dark reading
    display = SpectralDisplay.of("ccfl", tips)
    assert 1e-9 < display.misfit < 0.02
    np.testing.assert_allclose(display.through(TIPS, np.ones(81)), TIPS, rtol=1e-9)


@pytest.mark.parametrize("luminance", [0.0, -1.0, np.nan])
def test_primaries_without_light_are_refused(luminance: float) -> None:
    tips = TIPS.copy()
    tips[2, 1] = luminance
    with pytest.raises(LutgenError, match="give positive, finite X, Y and Z"):
        SpectralDisplay.of("ccfl", tips)


def test_an_unknown_class_is_refused() -> None:
    with pytest.raises(LutgenError, match="Pick one of: ccfl, white-led"):
        SpectralDisplay.of("plasma", TIPS)


@pytest.mark.parametrize("name", ["yellowing", "phosphor-wear", "meter-mismatch"])
def test_without_a_display_nothing_is_guessed(name: str) -> None:
    signal = TIPS[None] if name == "phosphor-wear" else TIPS[:1]
    amplitude = {"yellowing": "depth", "phosphor-wear": "wear", "meter-mismatch": "shift"}[name]
    with pytest.raises(LutgenError, match=f"{name} acts on the display's spectra"):
        through(name, signal, np.array([[9000.0]]), None, **{amplitude: 0.1})
    np.testing.assert_array_equal(through(name, signal, np.array([[9000.0]]), None), signal)
    with pytest.raises(LutgenError):
        of_scene(None, name)


@pytest.mark.parametrize("display_class", CLASSES)
def test_yellowing_moves_white_towards_yellow_and_hardly_the_primaries(display_class: str) -> None:
    light = SpectralDisplay.of(display_class, TIPS)
    before, after = TIPS, through("yellowing", TIPS, np.array([[18_000.0]] * 4), light, depth=0.3)
    assert (after[:, 1] < before[:, 1]).all()
    shift = uv(after) - uv(before)
    assert shift[0, 1] > 0.003  # v' rises towards yellow
    assert after[0, 2] / before[0, 2] < after[0, 0] / before[0, 0]
    assert np.linalg.norm(shift[1]) < 0.5 * np.linalg.norm(shift[0])


@pytest.mark.parametrize("display_class", ["ccfl", "oled", "rgb-led"])
def test_the_blue_wears_first(display_class: str) -> None:
    light = SpectralDisplay.of(display_class, TIPS)
    after = through("phosphor-wear", TIPS[None], np.array([[18_000.0]]), light, wear=0.3)[0]
    share = after[:, 1] / TIPS[:, 1]
    assert share[3] < share[2] < 1.0
    assert share[3] < share[1] <= 1.0
    assert uv(after)[0, 1] > uv(TIPS)[0, 1]


def test_a_worn_yag_phosphor_leaves_blue() -> None:
    light = SpectralDisplay.of("white-led", TIPS)
    after = through("phosphor-wear", TIPS[None], np.array([[18_000.0]]), light, wear=0.3)[0]
    assert uv(after)[0, 1] < uv(TIPS)[0, 1]
    np.testing.assert_allclose(after[1, :2] / TIPS[1, :2], np.exp(-0.3), rtol=0.02)  # blue's Z comes from the chip


def test_all_parts_worn_alike_leave_the_colour() -> None:
    light = SpectralDisplay.of("white-led", TIPS)
    after = through("phosphor-wear", TIPS[None], np.array([[18_000.0]]), light, wear=0.3, second=0.3)[0]
    np.testing.assert_allclose(after, TIPS * np.exp(-0.3), rtol=0.002)


def test_a_filter_at_each_hour_equals_one_hour_at_a_time() -> None:
    light = SpectralDisplay.of("ccfl", TIPS)
    hours = np.array([0.0, 9000.0, 500.0, 9000.0])[:, None]
    tips = np.random.default_rng(0).uniform(0.5, 1, size=(12, 4, 1, 1)) * TIPS
    together = through("phosphor-wear", tips, hours, light, wear=0.2, second=0.1, power=1.7)
    for index, hour in enumerate(hours):
        alone = through("phosphor-wear", tips[:, index : index + 1], hour[None], light, wear=0.2, second=0.1, power=1.7)
        np.testing.assert_array_equal(together[:, index : index + 1], alone)


def test_maps_multiply_as_matrices_do() -> None:
    rng = np.random.default_rng(0)
    xyz, maps = rng.uniform(size=(4, 5, 3)), rng.uniform(size=(5, 3, 3))
    np.testing.assert_allclose(mapped(xyz, maps), np.einsum("nij,vnj->vni", maps, xyz), rtol=1e-12)


def test_it_is_the_same_each_time() -> None:
    first = SpectralDisplay.of("oled", TIPS)
    spectra._estimated.cache_clear()
    second = SpectralDisplay.of("oled", TIPS)
    assert second is not first
    np.testing.assert_array_equal(first.spectra, second.spectra)


def test_yellowing_of_a_campaign_takes_less_than_two_milliseconds() -> None:
    light = SpectralDisplay.of("ccfl", TIPS)
    hours = np.repeat(np.linspace(0, 18_000, 10), 110)[:, None]
    xyz = np.random.default_rng(0).uniform(0, 250, size=(1100, 3))
    taken = []
    for _ in range(20):
        start = time.process_time()
        through("yellowing", xyz, hours, light, depth=0.1)
        taken.append(time.process_time() - start)
    assert min(taken) < 2e-3


def test_the_default_displays_own_yellowing_is_found_in_its_tips() -> None:
    """A 1 nm spectral model ages the reconstructed display. The estimate of its class must be able to follow."""
    from scipy.optimize import least_squares

    hours, tips = read_measurements(default_display()).tips()
    fresh, last = xyY_to_xyz(tips[0]), xyY_to_xyz(tips[-1])
    light = SpectralDisplay.of(class_of("simulated CCFL-lit medical LCD"), fresh)

    def missed(values: Array) -> Array:
        depth, wear, second = values
        aged = through("phosphor-wear", fresh[None], hours[-1:, None], light, wear=wear, second=second)
        aged = through("yellowing", aged[0], np.repeat(hours[-1:, None], 4, axis=0), light, depth=depth)
        return np.asarray(uv(aged)[:2] - uv(last)[:2]).ravel()

    solution = least_squares(missed, [0.1, 0.1, 0.05], bounds=([0, 0, -0.3], [2, 3, 3]))
    unaged = np.abs(uv(fresh)[0] - uv(last)[0]).max()
    assert np.abs(solution.fun).max() < 0.15 * unaged
