"""The generator that perturbs real sessions: each simulated effect changes only its own readings."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.generators.real import BASES, KINDS, OUTSIDE, campaign
from tests.generators.real.aging import KINDS as DECAYS
from tests.generators.real.groups import select
from tests.generators.real.response import display
from tests.quick import mostly_slow
from tests.real_data import needs_sessions

if TYPE_CHECKING:
    from tests.generators.truth import Truth

Floats = NDArray[np.float64]

pytestmark = pytest.mark.numbers
X61 = "ThinkPad_X61__N121X5-L06__1_2020-05-26_15-02"
SOME = (X61, "ThinkBook_14p__NV140DRM-N62__1_2022-08-01_19-50", "LG_ULTRAWIDE_20220226")


@cache
def simulated(seed: int, kind: str, base: str | None) -> Truth:
    return campaign(seed, {kind: 1.0} if kind else {}, base=base)


def change(kind: str, base: str | None, seed: int = 3) -> tuple[Truth, Floats]:
    """Largest relative change of XYZ (n,) by a hidden effect, with a floor of 0.01 % of white."""
    healthy, hidden = simulated(seed, "", base), simulated(seed, kind, base)
    np.testing.assert_array_equal(healthy.drive, hidden.drive)
    floor = 1e-4 * display(base or X61).white
    difference = np.abs(hidden.xyz_cd_m2 - healthy.xyz_cd_m2) / (healthy.xyz_cd_m2 + floor)
    return hidden, difference.max(axis=1)


def assert_unchanged(truth: Truth, changed: Floats, nowhere: tuple[str, ...]) -> None:
    for words in nowhere:
        kept = select(truth, words)
        assert kept.any(), words
        assert changed[kept].max() < 1e-12, words


# effect, readings that all change by at least this share, readings that stay.
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
@pytest.mark.parametrize("base", mostly_slow(SOME, X61))
@pytest.mark.parametrize(("kind", "where", "least", "nowhere"), SIGNATURES, ids=[row[0] for row in SIGNATURES])
def test_an_effect_changes_readings_where_its_signature_says_and_nowhere_else(
    kind: str, where: str, least: float, nowhere: tuple[str, ...], base: str
) -> None:
    truth, changed = change(kind, base)
    touched = select(truth, where)
    assert touched.any()
    assert changed[touched].min() >= least
    assert changed[touched].max() > 0
    assert_unchanged(truth, changed, nowhere)


# effect, readings of which at least half change by at least this share, readings that stay.
PARTIAL = (
    ("quantization", "later, grey, dark, rest", 1e-3, ("first", "black")),
    ("recalibration", "last, grey, rest", 1e-2, ("first", "black")),
    ("uneven-screen", "last, off-centre", 1e-2, ("first", "rest")),
    ("flicker-beat", "later, rest", 1e-3, ("first", "capped")),
    ("automatic-brightness", "later, rest", 1e-3, ("first", "capped")),
)


@needs_sessions
@pytest.mark.parametrize("base", mostly_slow(SOME, X61))
@pytest.mark.parametrize(("kind", "where", "least", "nowhere"), PARTIAL, ids=[row[0] for row in PARTIAL])
def test_an_irregular_effect_changes_most_readings_where_it_acts_and_none_elsewhere(
    kind: str, where: str, least: float, nowhere: tuple[str, ...], base: str
) -> None:
    truth, changed = change(kind, base)
    assert np.median(changed[select(truth, where)]) > least
    assert_unchanged(truth, changed, nowhere)


ONE_CHANNEL = ("channel-gamma", "stuck-bit")


@needs_sessions
@pytest.mark.parametrize("kind", ONE_CHANNEL)
def test_an_effect_of_one_channel_leaves_the_ramps_of_the_others(kind: str) -> None:
    for seed in range(5):
        truth, changed = change(kind, X61, seed)
        single = select(truth, "last, single")
        ramps = [changed[single & (truth.drive[:, channel] > 0.001)].max() for channel in range(3)]
        assert sorted(ramp > 1e-3 for ramp in ramps) == [False, False, True]
        assert min(ramps) < 1e-12
        assert changed[select(truth, "first")].max() < 1e-12
        assert changed[select(truth, "black")].max() < 1e-12


# effect, readings, smallest and largest change over ten displays: near the typical sizes of the catalogue.
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
    for seed, base in enumerate(BASES[::9]):
        truth, changed = change(kind, base, seed)
        assert low < changed[select(truth, where)].max() < high


# effect, smallest and largest luminance of white at 18 000 h, relative to hour 0.
FADING = (
    ("backlight-decay", 0.6, 0.8),
    ("burn-in-decay", 0.9, 0.95),
    ("phosphor-wear", 0.85, 0.95),
    ("yellowing", 0.93, 0.98),
    ("stabilizer-headroom", 0.7, 0.9),
    ("channel-decay", 0.8, 0.95),
    ("meter-drift", 0.97, 0.995),
)


@needs_sessions
@pytest.mark.parametrize(("kind", "low", "high"), FADING, ids=[row[0] for row in FADING])
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


def test_the_tables_above_hold_every_effect_once() -> None:
    held = [*(row[0] for row in (*SIGNATURES, *PARTIAL, *FADING)), *ONE_CHANNEL]
    assert sorted(held) == sorted((*KINDS, *OUTSIDE))


def test_the_generator_shares_no_code_with_lutgen_or_other_generators() -> None:
    for path in (Path(__file__).parent / "generators" / "real").glob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.lstrip().startswith(("from ", "import ")) and ("lutgen" in line or "tests." in line):
                assert "tests.generators.real" in line or "tests.generators.truth" in line, (path.name, line)
