"""Instruments by name: their files, users' own files, and the use of their figures in the noise of a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.model import OFFSET_CD_M2, WANDER, estimate_noise
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.criticism.verdict.remarks import NOISY
from lutgen.errors import LutgenError
from lutgen.names import INSTRUMENTS
from lutgen.readings import read_session
from lutgen.readings.instruments import instrument_of
from tests.real_data import real_data
from tests.test_noise import readings, with_noise

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

FOLDER = Path(__file__).parents[1] / "lutgen" / "readings" / "instruments"

OWN = """name = "Ours"
source = "fifty readings of one white"
relative = 0.004
floor_cd_m2 = [0.01, 0.02, 0.03]
decimals = 2
dark_offset_cd_m2 = 0.05
gain_wander = 0.002
"""


def test_a_remark_takes_twice_the_noise_of_the_noisiest_instrument_for_unusual() -> None:
    assert 2.0 * max(instrument_of(name).relative[1] for name in INSTRUMENTS) == NOISY


def own(folder: Path, *changes: tuple[str, str], name: str = "ours.toml") -> str:
    text = OWN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_every_file_is_an_instrument_that_says_where_its_figures_come_from(name: str) -> None:
    instrument = instrument_of(name)
    assert instrument.name
    assert len(instrument.source) > 20
    assert all(1e-5 < value < 0.02 for value in instrument.relative)
    assert all(1e-6 < value < 0.1 for value in instrument.floor_cd_m2)
    text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    assert text.startswith("# ")
    left_out = [key for key in ("dark_offset_cd_m2", "gain_wander") if key not in text]
    assert ("Left out, since nobody published them" in text) == bool(left_out)


def test_an_instrument_is_found_by_being_in_the_folder() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.toml")) == list(INSTRUMENTS)
    assert "i1display-pro" in INSTRUMENTS


def test_two_numbers_and_a_users_own_file_are_instruments_too(tmp_path: Path) -> None:
    bare = instrument_of("0.002,0.003")
    assert (bare.relative, bare.floor_cd_m2, bare.name) == ((0.002,) * 3, (0.003,) * 3, "")
    ours = instrument_of(own(tmp_path))
    assert (ours.name, ours.relative, ours.decimals) == ("Ours", (0.004,) * 3, 2)
    assert ours.ratios == ((1.0, 1.0, 1.0), (0.5, 1.0, 1.5))


WRONG = {
    "neither": (None, "neither", "or an instrument, one of cr-100"),
    "no file": (None, "none.toml", "none.toml: cannot read the instrument: no such file"),
    "no TOML": (("name =", "name"), "", "not an instrument file (TOML)"),
    "unknown key": (("decimals", "digits"), "", "unknown key 'digits'. Pick one of: dark_offset_cd_m2, decimals"),
    "no source": (('source = "fifty readings of one white"\n', ""), "", "needs source"),
    "no share": (("relative = 0.004\n", ""), "", "needs relative, 1 σ: one number, or three"),
    "two numbers": (("[0.01, 0.02, 0.03]", "[0.01, 0.02]"), "", "needs floor_cd_m2"),
    "a share of nothing": (("0.004", "0"), "", "relative = 0 must be a number above 0, at most 0.5"),
    "not a number": (("0.004", "nan"), "", "relative = nan must be"),
    "a truth value": (("0.004", "true"), "", "relative = True must be"),
    "far too much": (("0.05", "500.0"), "", "dark_offset_cd_m2 = 500.0 must be"),
    "half a digit": (("decimals = 2", "decimals = 2.5"), "", "decimals = 2.5 must be a whole number, 0 to 9"),
    "no digit": (("decimals = 2", "significant = 0"), "", "significant = 0 must be a whole number, 1 to 9"),
    "two rules": (("decimals = 2", "decimals = 2\nsignificant = 4"), "", "give decimals or significant, not both"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_no_instrument_is_refused_with_a_sentence(case: str, tmp_path: Path) -> None:
    change, text, sentence = WRONG[case]
    text = text or own(tmp_path, *([change] if change else []))
    with pytest.raises(LutgenError) as refusal:
        instrument_of(text)
    assert sentence in str(refusal.value)
    assert str(refusal.value).endswith(".")


def test_without_replicates_the_noise_is_the_instruments(tmp_path: Path) -> None:
    once = with_noise(readings(repeats=1), 3)
    noise = estimate_noise(once, own(tmp_path))
    assert (noise.source, noise.instrument) == ("instrument", "Ours")
    assert (noise.relative, noise.floor_cd_m2) == (0.004, 0.02)
    np.testing.assert_allclose(np.sqrt(np.diag(noise.covariance(np.zeros((1, 3)))[0])), [0.01, 0.02, 0.03], rtol=0.05)
    assert noise.digits.decimals == 2
    assert (noise.offset_cd_m2, noise.wander) == (0.05, 0.002)


def test_digits_that_the_values_show_count_more_than_the_instruments(tmp_path: Path) -> None:
    once = with_noise(readings(repeats=1), 3)
    printed = np.round(once.xyz_cd_m2, 4)
    changed = type(once)(hours=once.hours, drive=once.drive, xyz_cd_m2=printed, lines=once.lines)
    assert estimate_noise(changed, own(tmp_path)).digits.decimals == 4


def test_replicates_correct_a_named_instrument_and_two_numbers_stand() -> None:
    measured = [with_noise(readings(repeats=8), seed, relative=0.004) for seed in range(6)]
    named = [estimate_noise(each, "i1display-pro") for each in measured]
    assert {each.source for each in named} == {"replicates"}
    assert {each.instrument for each in named} == {"X-Rite i1Display Pro"}
    assert 0.0033 < np.mean([each.relative for each in named]) < 0.0047
    assert estimate_noise(measured[0], "0.0008,0.0002").relative == 0.0008


def test_few_replicates_are_shrunk_towards_the_instrument() -> None:
    exact = readings(repeats=2, hours=(0.0, 9000.0))
    few = [with_noise(exact, seed, relative=0.0009, floor=0.0002) for seed in range(6)]
    z_over_y = {
        name: np.mean([estimate_noise(each, name).floor_ratio[2] for each in few]) for name in (None, "i1display-pro")
    }
    # The same readings, with equal noise in X, Y and Z: two blacks in two sessions hardly show another ratio.
    assert z_over_y[None] < 1.3
    assert 1.8 < z_over_y["i1display-pro"] < instrument_of("i1display-pro").ratios[1][2]


def test_the_dark_offset_and_the_wander_start_from_the_instruments(tmp_path: Path) -> None:
    exact = readings(repeats=1, hours=(0.0, 9000.0))
    ordinary = with_shared_errors(Problem.of(with_noise(exact, 3), instrument="0.002,0.003"))
    assert (ordinary.offset_cd_m2, ordinary.wander) == (OFFSET_CD_M2, WANDER)
    ours = with_shared_errors(Problem.of(with_noise(exact, 3), instrument=own(tmp_path)))
    assert (ours.offset_cd_m2, ours.wander) == (0.05, 0.002)


def test_figures_of_the_i1display_pro_are_those_of_the_published_sessions() -> None:
    white: list[Array] = []
    black: list[Array] = []
    for path in sorted((real_data() / "real" / "jamesits").glob("*.ti3")):
        session = read_session(path)
        assert "i1 DisplayPro" in session.instrument
        for kind, deviations in (("white", white), ("black", black)):
            xyz = session.xyz_cd_m2[session.rows(kind)]
            if len(xyz) >= 3:
                deviations.append(xyz.std(axis=0, ddof=1) / (xyz.mean(axis=0) if kind == "white" else 1.0))
    assert (len(white), len(black)) == (24, 22)
    instrument = instrument_of("i1display-pro")
    np.testing.assert_allclose(np.median(white, axis=0), np.array(instrument.relative), rtol=0.02)
    np.testing.assert_allclose(np.median(black, axis=0), np.array(instrument.floor_cd_m2), rtol=0.02)
