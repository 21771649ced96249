"""Effects on code values are known only roughly on a display with curves of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.first_session.slope_errors import SLOPE, with_drive_errors
from lutgen.criticism.fit.least_squares import fit, start_state
from lutgen.criticism.fit.linear import Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.session_errors import with_shared_errors
from lutgen.display.transfer_curve import TransferCurve, rising_light
from lutgen.effects import catalogue
from lutgen.readings import read_measurements
from tests.generators.meters import METERS
from tests.generators.real import campaign
from tests.generators.table import table
from tests.native_displays import BLACK, GREYS, MIXTURES, RAMPS, TIPS, Panel, session
from tests.readings_text import read
from tests.real_data import needs_sessions, real_data

pytestmark = pytest.mark.numbers

CODES = [*TIPS, *TIPS, BLACK, BLACK, *GREYS, *GREYS, *RAMPS, *MIXTURES]
HOURS = (0.0, 6000.0, 12_000.0, 18_000.0)


def test_what_a_loss_of_drive_does_is_known_as_the_slopes_of_curves_are() -> None:
    """A coarse curve's slope between its levels is uncertain, and so is the predicted effect of a loss of drive."""
    random = np.random.default_rng(4)
    still = session(Panel(), CODES, HOURS)
    effect, other = (catalogue()[name].since_first_session() for name in ("drive-loss", "eotf-drift"))
    exact = Problem.of(still, baseline="native")
    lost = predict(exact, start_state(exact, [Term.at_rest(effect, ("grown",), grown=0.05)]))
    _, place = np.unique(still.drive, axis=0, return_inverse=True)
    slope = 1.0 + SLOPE * random.standard_normal((place.max() + 1, 3))[place.reshape(-1)]
    xyz = still.xyz_cd_m2 + slope * (lost - predict(exact, start_state(exact, ())))
    xyz *= 1.0 + 0.002 * random.standard_normal(xyz.shape)
    problem = with_shared_errors(Problem.of(replace(still, xyz_cd_m2=xyz), baseline="native"), ())
    solution = fit(problem, [Term.at_rest(effect, ("grown",), grown=0.04)])
    beside = with_drive_errors(solution)
    assert solution.chi2 > 1.5 * solution.freedom
    assert beside.chi2 < 1.2 * beside.freedom
    # Without the effect there are no errors of drive, and other effects have none.
    assert with_drive_errors(fit(problem)).problem.drive_errors is None
    assert with_drive_errors(fit(problem, [Term.at_rest(other, ("grown",))])).problem.drive_errors is None


@pytest.mark.slow
def test_a_rounding_that_came_later_behind_tables_that_nobody_knows_is_told() -> None:
    """A calibration gives each channel a table. A 6-bit cable after the tables moves each code differently."""
    random, powers = np.random.default_rng(6), np.array([1.12, 0.93, 1.05])
    still = session(Panel(), CODES, HOURS)
    rounded = (np.round(still.drive**powers * 63.0) / 63.0) ** (1.0 / powers)
    drive = np.where(still.hours[:, np.newaxis] > 0, rounded, still.drive)
    xyz = np.array([Panel().xyz(code, hour) for code, hour in zip(drive.tolist(), still.hours.tolist(), strict=True)])
    xyz *= 1.0 + 0.002 * random.standard_normal(xyz.shape)
    verdict = diagnose(replace(still, xyz_cd_m2=xyz), baseline="native").verdict
    assert (verdict.name, verdict.effects[0]) == ("one-of", "quantization")


@pytest.mark.slow
@pytest.mark.rare(instead="test_a_rounding_that_came_later_behind_tables_that_nobody_knows_is_told")
def test_a_rounding_behind_tables_that_are_no_powers_is_told_beside_a_leak() -> None:
    random, levels = np.random.default_rng(8), np.linspace(0.0, 1.0, 1025)
    still = session(Panel(), [*CODES, *random.uniform(0.05, 0.95, (200, 3)).round(3).tolist()], HOURS)
    drive, later = still.drive.copy(), still.hours > 0
    for channel, (bow, wave) in enumerate(((0.1, 0.026), (-0.08, 0.022), (0.12, -0.024))):
        curve = levels + bow * np.sin(np.pi * levels) + wave * np.sin(3.0 * np.pi * levels)
        rounded = np.round(np.interp(drive[later, channel], levels, curve) * 63.0) / 63.0
        drive[later, channel] = np.interp(rounded, curve, levels)
    xyz = np.array([Panel().xyz(code, hour) for code, hour in zip(drive.tolist(), still.hours.tolist(), strict=True)])
    white = still.xyz_cd_m2[(still.drive == 1.0).all(axis=1)][0]
    full = still.drive.any(axis=1) & np.isin(still.drive, (0.0, 1.0)).all(axis=1)
    xyz += np.where(full, 0.0, 0.002 * still.hours / 18_000.0)[:, np.newaxis] * white
    xyz *= 1.0 + 0.002 * random.standard_normal(xyz.shape)
    diagnosis = diagnose(replace(still, xyz_cd_m2=xyz), baseline="native")
    assert set(diagnosis.verdict.effects) == {"black-level", "quantization"}
    assert any("The number of bits is uncertain" in remark for remark in diagnosis.verdict.remarks)


@pytest.mark.slow
@needs_sessions
def test_on_a_real_display_a_loss_of_drive_is_no_shift_of_primaries_too() -> None:
    """The residual of the display's own curves is no larger than noise, but has a pattern that primary-shift fits."""
    seed, meter = 811668018, METERS["gaussian"]
    truth = campaign(seed, {"drive-loss": 1.284}, design="full", habits=2)
    text = table(meter.stated(truth), meter.read(truth, seed), order=True)
    verdict = diagnose(read(text, file="real.csv", sha256=""), baseline="native").verdict
    assert (verdict.name, verdict.effects) == ("one-of", ("drive-loss",))


@needs_sessions
def test_a_curve_through_some_ten_levels_knows_its_slopes_as_well_as_is_assumed() -> None:
    """Greys of real sessions: slopes between all levels against a curve through every fifth to tenth level."""
    off = []
    for path in sorted(real_data().glob("real/*/*.ti3")):
        readings = read_measurements(path)
        grey = (readings.drive == readings.drive[:, :1]).all(axis=1)
        codes, place = np.unique(np.round(readings.drive[grey, 0], 6), return_inverse=True)
        if codes.size < 40:
            continue
        light = np.bincount(place, readings.xyz_cd_m2[grey, 1]) / np.bincount(place)
        light = (light - light[0]) / (light[-1] - light[0])
        step, each = round((codes.size - 1) / 11), []
        for start in range(step):
            few = np.unique([0, *range(start, codes.size, step), codes.size - 1])
            curve = TransferCurve.through("red", codes[few], np.clip(rising_light(light[few]), 0.0, 1.0))
            each.append((np.diff(curve(codes)) / np.diff(light))[codes[1:] > 0.1] - 1.0)
        off.append(float(np.median(np.abs(np.concatenate(each)))) / 0.6745)
    assert len(off) >= 20
    assert np.median(off) == pytest.approx(SLOPE, rel=0.3)
