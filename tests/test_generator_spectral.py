"""The spectral simulator: a healthy display is the sum of its primaries, each kind acts where the catalogue says."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import colour
import numpy as np
import pytest

from tests.generators.spectral import KINDS, OUTSIDE, campaign
from tests.generators.spectral.displays import MAKES, panel_of
from tests.generators.spectral.spectra import STEP, WAVELENGTHS, uv, xyz

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.generators.truth import Truth

pytestmark = pytest.mark.numbers

REST = {
    "u": 0.5,
    "v": 0.5,
    "ambient_lx": 0.0,
    "warmup_min": 120.0,
    "temperature_c": 25.0,
    "window": 1.0,
    "surround": 0.0,
}
SEEDS = (1, 2, 3, 5, 8)
ABSORBED = (
    "backlight-decay",
    "burn-in-decay",
    "phosphor-wear",
    "yellowing",
    "stabilizer-headroom",
    "channel-decay",
    "meter-drift",
)
EXACT = 1e-9  # relative: rounding of sums over 201 wavelengths


@cache
def simulated(seed: int, *kinds: str) -> Truth:
    return campaign(seed, dict.fromkeys(kinds, 1.0))


def linear(code: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(colour.models.eotf_sRGB(code))


def groups(truth: Truth) -> NDArray[np.str_]:
    """The part of the design to which each reading of habit 0 belongs."""
    drive, note = truth.drive, np.array(truth.note)
    lit, grey, top = (drive > 0).sum(axis=1), np.ptp(drive, axis=1) == 0, drive.max(axis=1)
    condition = {name: truth.conditions.get(name, np.full(len(top), rest)) for name, rest in REST.items()}
    choices = {
        "cap": note == "lens cap",
        "shroud": note == "shrouded",
        "hot": condition["temperature_c"] > 25,
        "dark window": (condition["window"] < 1) & (condition["surround"] == 0),
        "bright window": condition["window"] < 1,
        "cold": condition["warmup_min"] < 120,
        "lit room": condition["ambient_lx"] > 0,
        "position": (condition["u"] != 0.5) | (condition["v"] != 0.5),
        "black": top == 0,
        "white": grey & (top == 1),
        "grey": grey,
        "primary": (lit == 1) & (top == 1),
        "ramp": lit == 1,
        "secondary": lit == 2,
        "mixture": lit == 3,
    }
    return np.select(list(choices.values()), list(choices), default="none")


def residual(truth: Truth) -> dict[str, NDArray[np.float64]]:
    """Group → largest |reading − sum of the hour's primaries| at 18 000 h, XYZ over white's Y (3,)."""
    group, last = groups(truth), truth.hours == truth.hours.max()
    measured = [truth.xyz_cd_m2[last & (group == "primary") & (truth.drive[:, c] == 1)].mean(axis=0) for c in range(3)]
    light = np.where((group == "cap")[:, None], 0.0, linear(truth.drive)) @ np.array(measured)
    off = np.abs(truth.xyz_cd_m2 - light) / np.sum(measured, axis=0)[1]
    return {str(name): off[last & (group == name)].max(axis=0) for name in np.unique(group)}


def white(truth: Truth) -> NDArray[np.float64]:
    """XYZ of white at rest at each hour, (hours, 3)."""
    chosen = groups(truth) == "white"
    return np.array([truth.xyz_cd_m2[chosen & (truth.hours == h)].mean(axis=0) for h in np.unique(truth.hours)])


def moved(first: NDArray[np.float64], last: NDArray[np.float64]) -> float:
    chromaticity = [colour.xy_to_Luv_uv(colour.XYZ_to_xy(value)) for value in (first, last)]
    return float(np.linalg.norm(chromaticity[1] - chromaticity[0]))


@pytest.mark.parametrize("habit", range(6))
@pytest.mark.parametrize("design", ["full", "grey", "colour", "few"])
def test_a_healthy_display_is_the_sum_of_its_primaries_under_any_condition(design: str, habit: int) -> None:
    truth = campaign(11 + habit, {}, design=design, habits=habit)
    for hour in np.unique(truth.hours):
        now = (truth.hours == hour) & (np.array(truth.note) != "lens cap")
        primaries = np.array([truth.xyz_cd_m2[now & (truth.drive == row).all(axis=1)][0] for row in np.eye(3)])
        np.testing.assert_allclose(truth.xyz_cd_m2[now], linear(truth.drive[now]) @ primaries, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_display_ages(seed: int) -> None:
    first, *_, last = white(simulated(seed))
    assert 0.4 < last[1] / first[1] < 1.0
    assert 0.002 < moved(first, last) < 0.015
    assert last[2] / last[1] < first[2] / first[1]  # yellower


#: Groups that show codes between 0 and 1.
CODED = "grey ramp secondary mixture position lit-room cold dark-window bright-window hot"

#: Kind → groups that must deviate from the sum of the primaries. The other groups must not.
WHERE = {
    "recalibration": CODED,
    "quantization": CODED,
    "drive-loss": CODED,
    "eotf-drift": CODED,
    "channel-gamma": CODED,
    "primary-shift": CODED,
    "crosstalk": "white grey secondary mixture position lit-room cold dark-window bright-window hot",
    "loading": f"white {CODED}",
    "temperature": "hot",
    "warm-up": "cold",
    "edge-falloff": "position",
    "veiling-glare": "dark-window bright-window",
    "ambient-reflection": "lit-room",
    "black-level": f"white black shroud {CODED}",
    "meter-offset": f"white black shroud cap {CODED}",
    **dict.fromkeys(ABSORBED, ""),
    "viewing-angle": "position",
    "mura": "position",
    "auto-brightness": "lit-room",
    "flicker-aliasing": CODED,
    "local-dimming": CODED,
}


@pytest.mark.parametrize("kind", WHERE)
def test_a_kind_shows_where_its_signature_says_and_nowhere_else(kind: str) -> None:
    expected = {name.replace("-", " ") for name in WHERE[kind].split()}
    shown: set[str] = set()
    for seed in SEEDS:
        off = residual(simulated(seed, kind))
        shown |= {name for name, value in off.items() if value.max() > EXACT}
    assert shown - {"primary"} == expected


def test_the_tables_name_every_kind() -> None:
    of_time = {"dynamic-contrast", "static-dimming", "image-retention", "pwm-beat"}  # by order of reading
    assert set(WHERE) | of_time == {*KINDS, *OUTSIDE}
    assert len(KINDS) == 22
    assert not set(KINDS) & set(OUTSIDE)


#: Kind, group, then the range of the largest residual at 18 000 h over white's Y, in percent.
SIZES = [
    ("quantization", "grey", 0.05, 2.0),
    ("drive-loss", "grey", 0.1, 1.5),
    ("eotf-drift", "grey", 1.0, 4.0),
    ("recalibration", "grey", 2.0, 6.0),
    ("channel-gamma", "ramp", 0.2, 4.0),
    ("crosstalk", "white", 0.8, 4.0),
    ("loading", "white", 1.5, 15.0),
    ("black-level", "black", 0.07, 0.5),
    ("temperature", "hot", 1.0, 4.0),
    ("warm-up", "cold", 3.0, 11.0),
    ("edge-falloff", "position", 5.0, 25.0),
    ("ambient-reflection", "lit room", 0.3, 6.0),
    ("veiling-glare", "bright window", 0.1, 1.2),
    ("meter-offset", "cap", 0.0005, 0.03),
    ("image-retention", "black", 0.01, 0.5),
    ("local-dimming", "grey", 0.5, 5.0),
    ("mura", "position", 0.5, 6.0),
    ("viewing-angle", "position", 0.5, 5.0),
    ("auto-brightness", "lit room", 4.0, 20.0),
    ("pwm-beat", "grey", 0.1, 3.0),
    ("flicker-aliasing", "grey", 0.2, 3.0),
    ("static-dimming", "white", 2.0, 11.0),
    ("dynamic-contrast", "dark window", 0.4, 10.0),
]


@pytest.mark.parametrize(("kind", "group", "least", "most"), SIZES)
def test_a_strength_of_one_is_a_typical_size(kind: str, group: str, least: float, most: float) -> None:
    for seed in SEEDS:
        assert least < 100 * residual(simulated(seed, kind))[group][1] < most


@pytest.mark.parametrize(("kind", "group", "least", "most"), [row for row in SIZES if row[0] != "quantization"])
def test_half_the_strength_is_about_half_the_size(kind: str, group: str, least: float, most: float) -> None:
    del least, most
    whole, half = (residual(campaign(3, {kind: strength}))[group][1] for strength in (1.0, 0.5))
    assert 0.4 < half / whole < 0.6


#: Kind, then the ranges of white's Y at 18 000 h over new and of its shift in u'v'.
AGES = [
    ("backlight-decay", (0.35, 0.6), (0.0, 1e-9)),
    ("burn-in-decay", (0.65, 0.9), (0.0, 1e-9)),
    ("phosphor-wear", (0.8, 1.0), (0.008, 0.010)),
    ("yellowing", (0.93, 1.0), (0.009, 0.011)),
    ("stabilizer-headroom", (0.5, 0.75), (0.0, 1e-9)),
    ("channel-decay", (0.7, 0.86), (0.004, 0.03)),
    ("meter-drift", (0.98, 1.02), (0.0, 0.001)),
]


@pytest.mark.parametrize(("kind", "light", "shift"), AGES)
@pytest.mark.parametrize("seed", SEEDS)
def test_kinds_seen_from_hour_0_move_white_by_a_typical_size(
    kind: str, light: tuple[float, float], shift: tuple[float, float], seed: int
) -> None:
    first, *_, last = white(simulated(seed, kind))
    assert light[0] < last[1] / first[1] < light[1]
    assert shift[0] <= moved(first, last) < shift[1]


@pytest.mark.parametrize("kind", ["eotf-drift", "channel-gamma", "drive-loss", "recalibration", *ABSORBED])
def test_what_grows_with_the_hours_is_absent_at_hour_0(kind: str) -> None:
    new = simulated(4).hours == 0
    np.testing.assert_allclose(simulated(4, kind).xyz_cd_m2[new], simulated(4).xyz_cd_m2[new], rtol=1e-9)


def test_a_held_display_keeps_its_white_until_a_knee() -> None:
    luminance = white(simulated(2, "stabilizer-headroom"))[:, 1]
    assert luminance[4] / luminance[0] > 0.99
    assert luminance[-1] / luminance[-2] < 0.95


def test_what_is_brighter_than_its_sum_is_so_at_most_displays_with_crosstalk() -> None:
    above = 0
    for seed in range(30):
        truth = simulated(seed, "crosstalk")
        group, new = groups(truth), truth.hours == 0
        above += (
            truth.xyz_cd_m2[new & (group == "white")][0, 1] > truth.xyz_cd_m2[new & (group == "primary")][:3, 1].sum()
        )
    assert 15 < above < 28


def test_effects_do_not_disturb_each_others_numbers() -> None:
    one, two = simulated(6, "temperature"), simulated(6, "temperature", "edge-falloff")
    centre = groups(one) != "position"
    np.testing.assert_array_equal(one.xyz_cd_m2[centre], two.xyz_cd_m2[centre])


@pytest.mark.parametrize("habit", range(6))
def test_the_same_seed_gives_the_same_numbers_and_another_seed_others(habit: int) -> None:
    hidden = dict.fromkeys((*KINDS, *OUTSIDE), 0.3)
    one, again, other = (campaign(seed, hidden, habits=habit) for seed in (7, 7, 9))
    np.testing.assert_array_equal(one.xyz_cd_m2, again.xyz_cd_m2)
    assert (one.session, one.note, one.metadata) == (again.session, again.note, again.metadata)
    assert not np.allclose(one.xyz_cd_m2[:5], other.xyz_cd_m2[:5], rtol=1e-3)
    assert np.isfinite(one.xyz_cd_m2).all()
    assert (one.xyz_cd_m2 >= 0).all()


@pytest.mark.parametrize(
    ("design", "readings", "hours"), [("full", 1070, 10), ("colour", 620, 10), ("grey", 250, 10), ("few", 150, 5)]
)
def test_designs_have_their_readings(design: str, readings: int, hours: int) -> None:
    truth = campaign(1, {}, design=design)
    assert (len(truth.hours), len(np.unique(truth.hours))) == (readings, hours)
    assert (truth.hours.min(), truth.hours.max()) == (0, 18000)


def test_habits_write_what_their_laboratory_would() -> None:
    one, two, three, four, five = (campaign(1, {}, habits=habit) for habit in range(1, 6))
    assert (one.conditions["warmup_min"] == 60).all()
    assert one.session[0] == "2019-03-04"
    assert (two.conditions["ambient_lx"] == 5).all()
    assert np.abs(two.conditions["temperature_c"] - 24.3).max() < 1
    assert set(np.unique(three.conditions["window"])) == {0.1, 0.9}
    assert (np.diff(three.order) < 0).any()
    assert len(set(four.session)) == 3 * len(np.unique(four.hours))
    for name in set(four.session):
        drive = four.drive[np.array(four.session) == name]
        assert all(
            (drive == point).all(axis=1).any() for point in ([1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0])
        )
    assert not any((five.conditions[name] == rest).any() for name, rest in REST.items())
    for truth in (one, two, three, four, five):
        assert sorted(truth.order) == list(range(len(truth.order)))
        assert next(iter(truth.metadata)) == "simulated"


#: Class: white's Y, then x and y of R, G, B, within 0.03 of the data sheets of the class.
CLASSES = {
    "CCFL LCD": ((220, 420), ((0.65, 0.34), (0.30, 0.61), (0.15, 0.07))),
    "white LED LCD": ((250, 500), ((0.64, 0.34), (0.31, 0.61), (0.15, 0.06))),
    "RGB LED LCD": ((200, 400), ((0.69, 0.30), (0.19, 0.71), (0.15, 0.07))),
    "quantum dot LCD": ((300, 650), ((0.685, 0.31), (0.22, 0.70), (0.15, 0.05))),
    "PFS LED LCD": ((300, 800), ((0.685, 0.31), (0.27, 0.65), (0.15, 0.06))),
    "WRGB OLED": ((120, 300), ((0.67, 0.33), (0.28, 0.66), (0.14, 0.06))),
}


@pytest.mark.parametrize("name", MAKES)
@pytest.mark.parametrize("seed", SEEDS)
def test_each_class_has_the_white_and_the_primaries_of_its_kind(name: str, seed: int) -> None:
    light, points = CLASSES[name]
    primaries = xyz(panel_of(name, np.random.default_rng(seed)).primaries)
    assert light[0] <= primaries.sum(axis=0)[1] <= light[1]
    np.testing.assert_allclose(colour.XYZ_to_xy(primaries), points, atol=0.035)
    np.testing.assert_allclose(colour.XYZ_to_xy(primaries.sum(axis=0)), [0.3127, 0.3290], atol=0.015)


def test_sums_over_wavelengths_agree_with_colour_science() -> None:
    spectrum = panel_of("CCFL LCD", np.random.default_rng(0)).primaries.sum(axis=0)
    shape = colour.SpectralShape(380, 780, STEP)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    expected = 683 * STEP * spectrum @ observer.values
    np.testing.assert_allclose(xyz(spectrum), expected, rtol=1e-6)
    np.testing.assert_allclose(uv(spectrum), colour.xy_to_Luv_uv(colour.XYZ_to_xy(expected)), rtol=1e-6)
    assert len(WAVELENGTHS) == len(shape.wavelengths)


@pytest.mark.parametrize("kind", [*KINDS, *OUTSIDE])
def test_light_stays_light_at_four_times_the_size_and_a_strength_of_0_is_healthy(kind: str) -> None:
    strong, none = campaign(5, {kind: 4.0}), campaign(5, {kind: 0.0})
    assert np.isfinite(strong.xyz_cd_m2).all()
    assert (strong.xyz_cd_m2 >= 0).all()
    np.testing.assert_array_equal(none.xyz_cd_m2, simulated(5).xyz_cd_m2)
    assert not np.array_equal(strong.xyz_cd_m2, none.xyz_cd_m2)


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="Pick one of: recalibration"):
        campaign(1, {"gremlins": 1.0})
    with pytest.raises(ValueError, match="from 0 on"):
        campaign(1, {"loading": -1.0})
    with pytest.raises(ValueError, match="Pick one of: full"):
        campaign(1, {}, design="huge")


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parent / "generators" / "spectral").glob("*.py")), ids=lambda p: p.name
)
def test_the_generator_imports_nothing_of_what_it_judges(path: Path) -> None:
    allowed = ("tests.generators.spectral", "tests.generators.truth")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        assert not [
            name for name in names if name.split(".")[0] in {"lutgen", "tests"} and not name.startswith(allowed)
        ]
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 250
