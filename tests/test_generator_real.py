"""The generator that perturbs real sessions: each simulated effect changes what it should, and nothing else."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.generators.real import BASES, KINDS, OUTSIDE, MissingSessionsError, campaign, instrument_noise
from tests.generators.real import sessions as real_sessions
from tests.generators.real.aging import KINDS as DECAYS
from tests.generators.real.designs import COLUMNS
from tests.generators.real.noise import session_spread
from tests.generators.real.response import display, observer, spectra

if TYPE_CHECKING:
    from tests.generators.truth import Truth

Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]

pytestmark = pytest.mark.numbers
needs_sessions = pytest.mark.skipif(
    "LUTGEN_REAL_DATA" not in os.environ, reason="LUTGEN_REAL_DATA is not set: the real sessions are not published here"
)
X61 = "ThinkPad_X61__N121X5-L06__1_2020-05-26_15-02"
SOME = (X61, "ThinkBook_14p__NV140DRM-N62__1_2022-08-01_19-50", "LG_ULTRAWIDE_20220226")


@cache
def simulated(seed: int, kind: str, base: str | None, strength: float = 1.0) -> Truth:
    return campaign(seed, {kind: strength} if kind else {}, base=base)


def masks(truth: Truth) -> dict[str, Mask]:
    """Readings by what is shown, when, and under which condition."""
    drive, rest = truth.drive, {"u": 0.5, "v": 0.5, "ambient_lx": 0.0, "warmup_min": 60.0, "temperature_c": 23.0}
    lit = (drive > 0.001).sum(axis=1)
    away = {column: truth.conditions[column] != value for column, value in rest.items()}
    capped = np.array([note == "lens cap" for note in truth.note])
    window = truth.conditions["window"] < 1
    single = (lit == 1) & (drive.max(axis=1) < 0.999)
    level = np.where(lit > 0, drive.max(axis=1), 0.0)
    return {
        "first": truth.hours == 0,
        "later": truth.hours > 0,
        "last": truth.hours == truth.hours.max(),
        "capped": capped,
        "shrouded": np.array([note == "shrouded" for note in truth.note]),
        "black": (lit == 0) & ~capped,
        "white": (drive > 0.999).all(axis=1),
        "corner": ((drive < 0.001) | (drive > 0.999)).all(axis=1),
        "grey": (np.ptp(drive, axis=1) < 1e-3) & (level > 0.001) & (level < 0.999),
        "middle": (level > 0.35) & (level < 0.7),
        "dark": (level > 0.001) & (level < 0.2),
        "bright": (level > 0.9) & (level < 0.999),
        "single": single,
        "one": (lit <= 1) & ~capped,
        "mixed": lit > 1,
        "off-centre": away["u"] | away["v"],
        "lit room": away["ambient_lx"],
        "cold": away["warmup_min"],
        "warm room": away["temperature_c"],
        "window": window,
        "surround": truth.conditions["surround"] > 0,
        "rest": ~(np.any(list(away.values()), axis=0) | window | capped),
        "all": np.ones(len(truth.hours), dtype=bool),
    }


def select(truth: Truth, words: str) -> Mask:
    """Readings to which all the words apply; "not-" before a word turns it round."""
    known = masks(truth)
    chosen = known["all"]
    for word in words.split(", "):
        chosen = chosen & (~known[word[4:]] if word.startswith("not-") else known[word])
    return chosen


def change(kind: str, base: str | None, seed: int = 3) -> tuple[Truth, Floats]:
    """Largest relative change of XYZ (n,), with a floor of 0.01 % of white, that a hidden effect makes."""
    healthy, hidden = simulated(seed, "", base), simulated(seed, kind, base)
    np.testing.assert_array_equal(healthy.drive, hidden.drive)
    floor = 1e-4 * display(base or X61).white
    difference = np.abs(hidden.xyz_cd_m2 - healthy.xyz_cd_m2) / (healthy.xyz_cd_m2 + floor)
    return hidden, difference.max(axis=1)


# effect, readings that all change by at least so much, readings that stay.
SIGNATURES = (
    ("eotf-drift", "last, grey, middle, rest", 0.01, ("first", "corner")),
    ("drive-loss", "last, white", 0.03, ("first", "black")),
    ("crosstalk", "last, mixed, corner, rest", 0.01, ("first", "one")),
    ("primary-shift", "last, single, dark", 0.004, ("first", "corner")),
    ("black-level", "last, black", 0.5, ("first", "white")),
    ("loading", "white", 0.004, ("black, rest", "capped")),
    ("warm-up", "cold", 0.01, ("rest", "not-cold")),
    ("temperature", "warm room", 0.02, ("rest", "not-warm room")),
    ("edge-falloff", "off-centre", 0.02, ("rest", "not-off-centre")),
    ("veiling-glare", "window, black, surround", 0.5, ("rest", "not-window")),
    ("ambient-reflection", "lit room, black", 0.1, ("rest", "shrouded", "not-lit room")),
    ("meter-offset", "capped", 0.1, ()),
    ("highlight-clip", "later, grey, bright, rest", 0.01, ("first", "corner", "black")),
    ("vivid-mode", "last, single, middle", 0.01, ("first", "grey", "corner")),
    ("local-dimming", "later, dark", 0.02, ("first", "white")),
    ("image-retention", "last, black, rest", 0.0, ("first",)),
)


@needs_sessions
@pytest.mark.parametrize("base", SOME)
@pytest.mark.parametrize(("kind", "where", "least", "nowhere"), SIGNATURES, ids=[row[0] for row in SIGNATURES])
def test_an_effect_changes_readings_where_its_signature_says_and_nowhere_else(
    kind: str, where: str, least: float, nowhere: tuple[str, ...], base: str
) -> None:
    truth, changed = change(kind, base)
    touched = select(truth, where)
    assert touched.any()
    assert changed[touched].min() >= least
    assert changed[touched].max() > 0
    for words in nowhere:
        kept = select(truth, words)
        assert kept.any(), words
        assert changed[kept].max() < 1e-12, words


# effect, readings of which at least half change by at least so much, readings that stay.
PARTIAL = (
    ("quantization", "later, grey, dark, rest", 1e-3, ("first", "black")),
    ("recalibration", "last, grey, rest", 1e-2, ("first", "black")),
    ("uneven-screen", "last, off-centre", 1e-2, ("first", "rest")),
    ("flicker-beat", "later, rest", 1e-3, ("first", "capped")),
    ("automatic-brightness", "later, rest", 1e-3, ("first", "capped")),
)


@needs_sessions
@pytest.mark.parametrize("base", SOME)
@pytest.mark.parametrize(("kind", "where", "least", "nowhere"), PARTIAL, ids=[row[0] for row in PARTIAL])
def test_an_irregular_effect_changes_most_readings_where_it_acts_and_none_elsewhere(
    kind: str, where: str, least: float, nowhere: tuple[str, ...], base: str
) -> None:
    truth, changed = change(kind, base)
    assert np.median(changed[select(truth, where)]) > least
    for words in nowhere:
        kept = select(truth, words)
        assert kept.any(), words
        assert changed[kept].max() < 1e-12, words


@needs_sessions
@pytest.mark.parametrize("kind", ["channel-gamma", "stuck-bit"])
def test_an_effect_of_one_channel_leaves_the_ramps_of_the_others(kind: str) -> None:
    for seed in range(5):
        truth, changed = change(kind, X61, seed)
        single = select(truth, "last, single")
        ramps = [changed[single & (truth.drive[:, channel] > 0.001)].max() for channel in range(3)]
        assert sorted(ramp > 1e-3 for ramp in ramps) == [False, False, True]
        assert min(ramps) < 1e-12
        assert changed[select(truth, "first")].max() < 1e-12
        assert changed[select(truth, "black")].max() < 1e-12


# effect, readings, smallest and largest change over ten displays: about effects.md's typical sizes.
SIZES = (
    ("eotf-drift", "last, grey, middle, rest", 0.05, 0.3),
    ("channel-gamma", "last, grey, middle, rest", 0.02, 0.35),
    ("drive-loss", "last, white, rest", 0.005, 0.2),
    ("crosstalk", "last, white, rest", 0.01, 0.04),
    ("black-level", "last, black, rest", 0.5, 2.0),
    ("loading", "first, white, rest", 0.05, 0.12),
    ("edge-falloff", "last, white, off-centre", 0.05, 0.25),
    ("warm-up", "first, white, cold", 0.002, 0.2),
    ("temperature", "first, warm room", 0.02, 0.04),
    ("ambient-reflection", "lit room, black", 0.05, 80.0),
)


@needs_sessions
@pytest.mark.parametrize(("kind", "where", "low", "high"), SIZES, ids=[row[0] for row in SIZES])
def test_strength_one_is_a_typical_size(kind: str, where: str, low: float, high: float) -> None:
    for seed, base in enumerate(BASES[::3]):
        truth, changed = change(kind, base, seed)
        assert low < changed[select(truth, where)].max() < high


@needs_sessions
@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [
        ("backlight-decay", 0.6, 0.8),
        ("burn-in-decay", 0.9, 0.95),
        ("phosphor-wear", 0.85, 0.95),
        ("yellowing", 0.93, 0.98),
        ("stabilizer-headroom", 0.7, 0.9),
        ("channel-decay", 0.8, 0.95),
        ("meter-drift", 0.97, 0.995),
    ],
)
def test_a_first_hour_effect_ages_white_alone_by_its_typical_size(kind: str, low: float, high: float) -> None:
    for seed in range(6):
        truth = simulated(seed, kind, None)
        white = truth.xyz_cd_m2[select(truth, "white, rest")]
        hours = truth.hours[select(truth, "white, rest")]
        level = white[:, 1] / white[0, 1]
        assert low < level[-1] < high
        assert np.all(np.diff(level) < 1e-9)
        if kind == "stabilizer-headroom":
            assert level[hours <= 6000].min() > 0.97
        if kind in {"phosphor-wear", "yellowing", "channel-decay"}:
            chroma = (white[-1] / white[0])[2] / level[-1]
            assert chroma > 1 if kind == "phosphor-wear" else chroma < 0.97


@needs_sessions
def test_wear_of_the_phosphor_moves_white_by_a_plausible_chromaticity() -> None:
    for base in BASES:
        white = display(base).white
        worn = DECAYS["phosphor-wear"](display(base), np.array([6000.0]), 1.0, np.random.default_rng(1))[0] @ white
        before, after = (np.array([4 * xyz[0], 9 * xyz[1]]) / (xyz @ [1, 15, 3]) for xyz in (white, worn))
        assert 0.002 < np.hypot(*(after - before)) < 0.007


@needs_sessions
@pytest.mark.parametrize("base", BASES)
def test_on_a_healthy_display_re_measured_primaries_carry_every_reading_at_rest(base: str) -> None:
    truth, real = simulated(11, "", base), display(base)
    for hour in np.unique(truth.hours):
        here = (truth.hours == hour) & select(truth, "not-capped")
        drive, xyz = truth.drive[here], truth.xyz_cd_m2[here]
        points = np.array([xyz[np.argmin(np.abs(drive - point).sum(axis=1))] for point in np.eye(4, 3, 0)])
        black = points[3]
        carried = (points[:3] - black).T @ np.linalg.inv(real.primaries)
        measured = np.array([real.xyz_cd_m2[real.patch(tuple(row))] for row in drive])
        predicted = black + (measured - real.black) @ carried.T
        np.testing.assert_allclose(xyz, predicted, rtol=1e-9)


@needs_sessions
def test_hour_zero_of_a_healthy_display_is_what_was_measured() -> None:
    truth, real = simulated(2, "", X61), real_sessions.session(X61)
    for place in np.flatnonzero(select(truth, "first, single, rest")):
        measured = np.abs(real.drive - truth.drive[place]).max(axis=1) < 1e-4
        np.testing.assert_allclose(truth.xyz_cd_m2[place], real.xyz_cd_m2[measured].mean(axis=0), rtol=1e-12)


@needs_sessions
def test_displays_age_plausibly_and_differently() -> None:
    levels, tints = [], []
    for seed in range(30):
        truth = simulated(seed, "", None)
        white = truth.xyz_cd_m2[select(truth, "white, rest")]
        primary = (truth.drive > 0.999).sum(axis=1) == 1
        xyz = truth.xyz_cd_m2[primary & select(truth, "corner, rest")]
        xy = xyz[:, :2] / xyz.sum(axis=1, keepdims=True)
        assert np.abs(xy[:3] - xy[-3:]).max() < 0.02
        levels.append(white[-1, 1] / white[0, 1])
        tints.append(white[-1, 2] / white[0, 2] / levels[-1])
    assert 0.4 < min(levels) < 0.75
    assert 0.999 < max(levels) < 1.03
    assert 0.9 < min(tints) < max(tints) < 1.005  # white yellows
    assert len(np.unique(np.round(tints, 4))) > 20


@needs_sessions
@pytest.mark.parametrize("base", BASES)
def test_every_session_can_be_the_base_of_every_design(base: str) -> None:
    for design, hours, least, most in (("full", 10, 100, 125), ("grey", 10, 24, 45), ("colour", 10, 60, 90)):
        truth = campaign(5, {}, design=design, base=base)
        counts = np.unique(truth.hours, return_counts=True)[1]
        assert len(counts) == hours
        assert least <= counts.min() <= counts.max() <= most
    few = campaign(5, {}, design="few", base=base)
    assert np.unique(few.hours, return_counts=True)[1].tolist() == [30] * 5
    assert few.conditions == {}
    assert truth.metadata["source"] == f"simulated: a real session of {base}, perturbed"


@needs_sessions
@pytest.mark.parametrize("habits", range(8))
def test_habits_change_how_a_campaign_is_written_down_and_nothing_is_left_unexplained(habits: int) -> None:
    truth = campaign(7, {"ambient-reflection": 1.0, "warm-up": 1.0}, habits=habits, base=X61)
    hours = np.unique(truth.hours)
    assert hours[0] == 0
    assert len(hours) == 10
    assert set(truth.conditions) <= set(COLUMNS)
    assert len(set(truth.session)) == 10
    same = (truth.drive > 0.999).all(axis=1)
    for column, values in truth.conditions.items():
        typical = np.isnan(values) if np.isnan(values).any() else values == np.median(values)
        same = same & (typical if column != "surround" else np.isnan(values))
    for hour in hours:
        here = truth.hours == hour
        assert sorted(truth.order[here]) == list(range(here.sum()))
        assert np.ptp(truth.xyz_cd_m2[here & same], axis=0).max() < 1e-9


@needs_sessions
@pytest.mark.parametrize("kind", [*KINDS, *OUTSIDE])
def test_the_same_seed_gives_the_same_numbers_and_strength_zero_none(kind: str) -> None:
    once, again = campaign(4, {kind: 1.0}, design="few"), campaign(4, {kind: 1.0}, design="few")
    np.testing.assert_array_equal(once.xyz_cd_m2, again.xyz_cd_m2)
    np.testing.assert_array_equal(
        campaign(4, {kind: 0.0}, design="few").xyz_cd_m2, campaign(4, {}, design="few").xyz_cd_m2
    )
    assert np.isfinite(once.xyz_cd_m2).all()
    assert once.xyz_cd_m2.min() >= 0


@needs_sessions
def test_noise_has_the_spread_of_the_sessions_own_repeated_readings() -> None:
    truth = campaign(1, {}, base=X61)
    draws = np.array([instrument_noise(truth, seed) for seed in range(40)])
    np.testing.assert_array_equal(draws[0], instrument_noise(truth, 0))
    spread = session_spread(X61)
    white, black = (truth.drive > 0.999).all(axis=1), select(truth, "black")
    relative = draws[:, white] / truth.xyz_cd_m2[white]
    np.testing.assert_allclose(relative.std(axis=(0, 1)), np.sqrt(np.diag(spread.relative)), rtol=0.15)
    np.testing.assert_allclose(draws[:, black].std(axis=(0, 1)), np.sqrt(np.diag(spread.absolute)), rtol=0.15)
    for base in BASES:
        sizes = np.sqrt(np.diag(session_spread(base).relative))
        assert 1e-4 < sizes.min() <= sizes.max() < 0.01


@needs_sessions
@pytest.mark.parametrize("base", BASES)
def test_guessed_spectra_have_the_measured_tristimulus_values_of_the_primaries(base: str) -> None:
    assert spectra(base).min() >= 0
    np.testing.assert_allclose(observer().T @ spectra(base), display(base).primaries, rtol=0.005)


def test_unknown_effects_and_designs_are_refused() -> None:
    with pytest.raises(ValueError, match="moonlight"):
        campaign(0, {"moonlight": 1.0})
    with pytest.raises(ValueError, match="full, grey, colour, few"):
        campaign(0, {}, design="everything")


def test_without_the_real_sessions_an_error_says_what_to_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LUTGEN_REAL_DATA", raising=False)
    with pytest.raises(MissingSessionsError, match="LUTGEN_REAL_DATA"):
        real_sessions.folder()


def test_a_session_of_argyll_is_read_in_absolute_units_with_its_calibration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "real" / "jamesits"
    folder.mkdir(parents=True)
    (folder / "Made_up_1.ti3").write_text(
        'CTI3\n\nLUMINANCE_XYZ_CDM2 "190.0 200.0 210.0"\n\nBEGIN_DATA_FORMAT\nSAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y '
        "XYZ_Z\nEND_DATA_FORMAT\n\nBEGIN_DATA\n1 100 100 100 95 100 105\n2 0 50 0 1 2 0.5\nEND_DATA\nCAL\n\n"
        "BEGIN_DATA_FORMAT\nRGB_I RGB_R RGB_G RGB_B\nEND_DATA_FORMAT\nBEGIN_DATA\n0 0 0 0\n1 1 0.9 0.8\nEND_DATA\n",
        encoding="utf-8",
    )
    monkeypatch.setenv("LUTGEN_REAL_DATA", str(tmp_path))
    read = real_sessions.session("Made_up_1")
    np.testing.assert_allclose(read.drive, np.array([[1, 1, 1], [0, 0.5, 0]]))
    np.testing.assert_allclose(read.xyz_cd_m2, np.array([[190.0, 200, 210], [2, 4, 1]]))
    np.testing.assert_allclose(read.calibration, np.array([[0, 0, 0, 0], [1, 1, 0.9, 0.8]]))


def test_the_generator_shares_no_code_with_lutgen_or_other_generators() -> None:
    for path in (Path(__file__).parent / "generators" / "real").glob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.lstrip().startswith(("from ", "import ")) and ("lutgen" in line or "tests." in line):
                assert "tests.generators.real" in line or "tests.generators.truth" in line, (path.name, line)
