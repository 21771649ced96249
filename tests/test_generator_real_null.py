"""The generator that perturbs real sessions: healthy displays, designs, habits, noise and reading of sessions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.generators.real import BASES, KINDS, OUTSIDE, MissingSessionsError, campaign, instrument_noise
from tests.generators.real import sessions as real_sessions
from tests.generators.real.designs import COLUMNS
from tests.generators.real.groups import select
from tests.generators.real.noise import session_spread
from tests.generators.real.response import display, observer, spectra
from tests.quick import mostly_slow
from tests.real_data import needs_sessions

if TYPE_CHECKING:
    from pathlib import Path

    from tests.generators.truth import Truth

pytestmark = pytest.mark.numbers
X61 = "ThinkPad_X61__N121X5-L06__1_2020-05-26_15-02"


def healthy(seed: int, base: str | None = None) -> Truth:
    return campaign(seed, {}, base=base)


@needs_sessions
@pytest.mark.parametrize("base", mostly_slow(BASES, *BASES[::5]))
def test_on_a_healthy_display_re_measured_primaries_carry_every_reading_at_rest(base: str) -> None:
    truth, real = healthy(11, base), display(base)
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
    truth, real = healthy(2, X61), real_sessions.session(X61)
    for place in np.flatnonzero(select(truth, "first, single, rest")):
        measured = np.abs(real.drive - truth.drive[place]).max(axis=1) < 1e-4
        np.testing.assert_allclose(truth.xyz_cd_m2[place], real.xyz_cd_m2[measured].mean(axis=0), rtol=1e-12)


@needs_sessions
def test_displays_age_plausibly_and_differently() -> None:
    levels, tints = [], []
    for seed in range(30):
        truth = healthy(seed)
        white = truth.xyz_cd_m2[select(truth, "white, rest")]
        primary = (truth.drive > 0.999).sum(axis=1) == 1
        xyz = truth.xyz_cd_m2[primary & select(truth, "corner, rest")]
        xy = xyz[:, :2] / xyz.sum(axis=1, keepdims=True)
        assert np.abs(xy[:3] - xy[-3:]).max() < 0.02
        levels.append(white[-1, 1] / white[0, 1])
        tints.append(white[-1, 2] / white[0, 2] / levels[-1])
    assert 0.4 < min(levels) < 0.75
    assert 0.999 < max(levels) < 1.03
    assert 0.9 < min(tints) < max(tints) < 1.005  # white turns yellow
    assert len(np.unique(np.round(tints, 4))) > 20


@needs_sessions
@pytest.mark.parametrize("base", mostly_slow(BASES, *BASES[::5]))
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
@pytest.mark.parametrize("base", mostly_slow(BASES, *BASES[::5]))
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
