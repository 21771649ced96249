"""The noise of the readings: from replicates, stated, or assumed; and replicates that are outliers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from lutgen.colorimetry import xyY_to_xyz
from lutgen.criticism.compare.comparison import compare
from lutgen.criticism.diagnose import diagnose
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.digits import Digits, digits_of
from lutgen.criticism.noise.model import CORRELATION, SESSION, Noise, estimate_noise
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.noise.replicates import FLOOR_CD_M2, RELATIVE, replicate_groups
from lutgen.criticism.noise.wrong_replicates import wrong_replicates
from lutgen.errors import LutgenError
from lutgen.readings import Measurements
from tests.criticism_twin import FRESH, TIPS
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

BLACK = (0.0, 0.0, 0.0)
HOURS = (0.0, 4000.0, 9000.0, 18_000.0)


def readings(
    *,
    patches: tuple[tuple[float, float, float], ...] = (*TIPS, BLACK),
    repeats: int = 3,
    hours: tuple[float, ...] = HOURS,
) -> Measurements:
    """Noise-free readings of a constant display. Every session repeats each patch."""
    light = {**dict(zip(TIPS, FRESH, strict=True)), BLACK: np.array([0.2, 0.2, 0.3])}
    rows = [(hour, code) for hour in hours for code in patches for _ in range(repeats)]
    return Measurements(
        hours=np.array([hour for hour, _ in rows]),
        drive=np.array([code for _, code in rows]),
        xyz_cd_m2=np.array([light.get(code, FRESH[0] * code[0] ** 2.2) for _, code in rows]),
        lines=np.arange(2.0, 2.0 + len(rows)),
    )


def with_noise(
    exact: Measurements,
    seed: int,
    relative: float = 0.002,
    floor: float = 0.003,
    correlation: float = 0.6,
    **changes: Any,
) -> Measurements:
    """Readings with Gaussian noise, of which X, Y and Z share a part."""
    rng = np.random.default_rng(seed)
    sigma = np.sqrt((relative * exact.xyz_cd_m2) ** 2 + floor**2)
    shared = rng.standard_normal((exact.hours.size, 1))
    own = rng.standard_normal((exact.hours.size, 3))
    noise = sigma * (np.sqrt(correlation) * shared + np.sqrt(1.0 - correlation) * own)
    return replace(exact, xyz_cd_m2=exact.xyz_cd_m2 + noise, **changes)


def sigma(noise: Noise, light: Array) -> float:
    """Geometric mean of σ of X, Y and Z."""
    return float(np.exp(np.log(np.diagonal(noise.covariance(light[np.newaxis])[0])).mean() / 2))


@pytest.mark.slow
@pytest.mark.parametrize(("relative", "floor", "correlation"), [
    (0.001, 0.0005, 0.6),
    (0.002, 0.003, 0.3),
    (0.005, 0.02, 0.8),
])  # fmt: skip
def test_noise_is_recovered_from_replicates(relative: float, floor: float, correlation: float) -> None:
    exact = readings()
    noisy = [with_noise(exact, seed, relative=relative, floor=floor, correlation=correlation) for seed in range(40)]
    estimates = [estimate_noise(each) for each in noisy]

    def sigma_of(light: Array) -> float:
        return float(np.exp(np.log((relative * light) ** 2 + floor**2).mean() / 2))

    # 32 contrasts of bright patches and 8 of black: one estimate scatters by 13 % and 25 %, the mean of 40 by a sixth.
    assert np.mean([sigma(each, FRESH[0]) for each in estimates]) == pytest.approx(sigma_of(FRESH[0]), rel=0.08)
    darkness = np.exp(np.mean([np.log(sigma(each, np.zeros(3))) for each in estimates]))
    assert darkness == pytest.approx(sigma_of(np.zeros(3)), rel=0.2)
    assert np.mean([each.correlation[0, 2] for each in estimates]) == pytest.approx(correlation, abs=0.08)
    assert {each.source for each in estimates} == {"replicates"}
    assert {each.contrasts for each in estimates} == {40}


def test_the_scatter_of_replicates_is_three_a_contrast_in_units_of_the_noise_they_tell() -> None:
    estimates = [estimate_noise(with_noise(readings(), seed)) for seed in range(20)]
    # Estimates from 32 contrasts of bright patches and 8 of black are uncertain: the noise adds this to the variance.
    assert estimates[0].known_from == (34, 13)
    bright, dark = 34 / 30, 13 / 9
    expected = (32 / bright + 8 / dark) / 40
    assert np.mean([each.scatter / (3 * each.contrasts) for each in estimates]) == pytest.approx(expected, abs=0.02)


def of_detectors(xyz: Array, seed: int) -> Array:
    """Readings of a light whose flicker is the same in X, Y and Z, by detectors that each have a floor."""
    rng = np.random.default_rng(seed)
    flicker, own = 0.002 * rng.standard_normal((len(xyz), 1)), 0.0002 * rng.standard_normal(xyz.shape)
    return np.asarray(xyz * (1.0 + flicker + own) + 0.003 * rng.standard_normal(xyz.shape))


@pytest.mark.slow
def test_the_floor_has_correlations_of_its_own() -> None:
    exact = readings(hours=tuple(1000.0 * k for k in range(10)))
    light, dim = exact.xyz_cd_m2, np.tile([2.0, 2.1, 2.4], (120, 1))
    estimates = [estimate_noise(replace(exact, xyz_cd_m2=of_detectors(light, seed))) for seed in range(24)]
    assert np.mean([each.correlation[0, 1] for each in estimates]) > 0.95
    assert np.mean([each.floor_correlation[0, 1] for each in estimates]) < 0.3
    # A common correlation for both would give 0.01 cd/m².
    assert np.exp(np.mean([np.log(each.floor_cd_m2) for each in estimates])) == pytest.approx(0.003, rel=0.2)
    fresh = [of_detectors(dim, 99 + seed) - dim for seed in range(24)]
    white = [np.einsum("nij,nj->ni", each.whitener(dim), off) for each, off in zip(estimates, fresh, strict=True)]
    assert np.mean(np.square(white)) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    "hours", mostly_slow([(HOURS[:1],), (HOURS,), (tuple(1000.0 * k for k in range(10)),)], HOURS[:1])
)
def test_fresh_readings_scatter_as_the_noise_says_however_few_replicates_told_it(hours: tuple[float, ...]) -> None:
    exact, squares = readings(hours=hours), []
    for seed in range(40):
        noise = estimate_noise(with_noise(exact, seed))
        fresh = with_noise(exact, seed + 5000).xyz_cd_m2 - exact.xyz_cd_m2
        white = np.einsum("nij,nj->ni", noise.whitener(exact.xyz_cd_m2), fresh)
        squares.append((white**2).mean())
    assert np.mean(squares) == pytest.approx(1.0, abs=0.25 if len(hours) == 1 else 0.08)


def test_the_covariance_is_that_of_many_draws() -> None:
    light = np.array([[235.0, 248.0, 268.0], [0.2, 0.2, 0.3]])
    shared = np.full((3, 3), 0.6) + 0.4 * np.eye(3)
    noise = Noise(0.002, 0.003, 0.003, shared, "stated", floor_correlation=shared)
    exact = readings(repeats=2000, hours=(0.0,))
    draws = with_noise(exact, 1).xyz_cd_m2
    for first in (0, 8000):  # of white, of black
        xyz, drawn = exact.xyz_cd_m2[first], draws[first : first + 2000]
        np.testing.assert_allclose(noise.covariance(xyz[np.newaxis])[0], np.cov(drawn.T), rtol=0.12)
    white = np.einsum("nij,njk,nlk->nil", noise.whitener(light), noise.covariance(light), noise.whitener(light))
    np.testing.assert_allclose(white, [np.eye(3)] * 2, atol=1e-9)


def test_without_dark_replicates_the_floor_stays_near_an_ordinary_one() -> None:
    estimates = [estimate_noise(with_noise(readings(patches=TIPS), seed, floor=1e-5)) for seed in range(20)]
    floors = np.array([each.floor_cd_m2 for each in estimates])
    assert (floors > FLOOR_CD_M2 / 4).all()
    assert (floors < FLOOR_CD_M2 * 4).all()
    assert np.mean([each.relative for each in estimates]) == pytest.approx(0.002, rel=0.15)


@pytest.mark.slow
def test_without_replicates_the_noise_is_assumed_and_the_remark_says_so() -> None:
    single = with_noise(readings(repeats=1, patches=(*TIPS, BLACK, *((g, g, g) for g in (0.2, 0.5, 0.8)))), 1)
    noise = estimate_noise(single)
    assert (noise.relative, noise.floor_cd_m2, noise.session) == (RELATIVE, FLOOR_CD_M2, SESSION)
    assert (noise.source, noise.contrasts, noise.scatter) == ("assumed", 0, 0.0)
    assert noise.correlation[0, 1] == CORRELATION
    remarks = diagnose(single).verdict.remarks
    assert remarks[0].startswith(
        "Too few replicates: the noise is assumed, 0.20 % and 0.003 cd/m². Repeat readings three times"
    )


@pytest.mark.parametrize(("relative", "said"), mostly_slow([(0.002, False), (0.009, True)], 0.009))
def test_replicates_that_scatter_more_than_usual_are_remarked(relative: float, said: bool) -> None:
    exact = readings(patches=(*TIPS, BLACK, *((g, g, g) for g in (0.2, 0.5, 0.8))))
    remarks = diagnose(with_noise(exact, 1, relative=relative)).verdict.remarks
    assert any(each.startswith("Repeated readings of a patch differ by 0.") for each in remarks) == said


def test_a_few_whites_that_agree_do_not_make_the_assumed_noise_smaller() -> None:
    """Five whites are equal to the last digit, as in one real session. Repeated blacks give the floor."""
    exact = readings(repeats=1, hours=(0.0, 4000.0))
    white, black = np.flatnonzero(exact.drive.all(axis=1))[:1], np.flatnonzero(~exact.drive.any(axis=1))[:1]
    for dark, floor in ((3, FLOOR_CD_M2), (9, 0.0)):
        again = np.sort([*range(exact.hours.size), *np.repeat(white, 4), *np.repeat(black, dark)])
        several = replace(
            exact, hours=exact.hours[again], drive=exact.drive[again], xyz_cd_m2=exact.xyz_cd_m2[again],
            lines=np.arange(2.0, 2.0 + again.size),
        )  # fmt: skip
        noise = estimate_noise(several)
        assert (noise.source, noise.contrasts) == ("assumed", 4 + dark)
        assert noise.relative == RELATIVE
        assert floor <= noise.floor_cd_m2 <= FLOOR_CD_M2
        assert "assumed, 0.20 % and" in diagnose(several).verdict.remarks[0]


@pytest.mark.parametrize(("metadata", "instrument", "figures"), [
    ({}, "0.004,0.01", (0.004, 0.01, 0.003)),
    ({"noise_relative": "0.001", "noise_floor_cd_m2": "0.0005", "session_gain": "0.01"}, None, (0.001, 0.0005, 0.01)),
    ({"noise_relative": "0.001", "noise_floor_cd_m2": "0.0005"}, "0.004,0.01", (0.004, 0.01, 0.003)),
    ({"session_gain": "0"}, "0.004,0.01", (0.004, 0.01, 0.0)),
])  # fmt: skip
def test_stated_noise_is_taken_as_it_is(
    metadata: dict[str, str], instrument: str | None, figures: tuple[float, float, float]
) -> None:
    noise = estimate_noise(with_noise(readings(), 3, metadata=metadata), instrument)
    assert (noise.relative, noise.floor_cd_m2, noise.session) == figures
    assert noise.source == "instrument"


def test_half_a_statement_is_none() -> None:
    assert estimate_noise(with_noise(readings(), 3, metadata={"noise_relative": "0.001"})).source == "replicates"


@pytest.mark.parametrize(("metadata", "instrument", "told"), [
    ({}, "0.002", "two numbers above 0"),
    ({}, "a,b", "'a,b'"),
    ({}, "0,0.003", "two numbers above 0"),
    ({}, "-0.002,0.003", "two numbers above 0"),
    ({}, "0.2 %,0.003", "two numbers above 0"),
    ({}, "nan,0.003", "two numbers above 0"),
    ({}, "2,0.003", "two numbers above 0"),
    ({"noise_relative": "small", "noise_floor_cd_m2": "0.003"}, None, "small,0.003"),
    ({"session_gain": "0.3 %"}, None, "session_gain is '0.3 %'"),
    ({"session_gain": "-0.1"}, None, "session_gain is '-0.1'"),
    ({"session_gain": "nan"}, None, "session_gain is 'nan'"),
])  # fmt: skip
def test_noise_that_is_none_is_refused(metadata: dict[str, str], instrument: str | None, told: str) -> None:
    with pytest.raises(LutgenError, match=told):
        estimate_noise(with_noise(readings(), 3, metadata=metadata), instrument)


@pytest.mark.parametrize(("row", "by"), [(4, (1.0, 20.0, 0.0)), (13, (0.3, 0.3, 0.3)), (40, (-9.0, -9.0, -9.0))])
def test_a_replicate_that_stands_alone_is_a_slip(row: int, by: tuple[float, float, float]) -> None:
    right = with_noise(readings(), 5)
    xyz: Array = right.xyz_cd_m2.copy()
    xyz[row] += by
    noise = estimate_noise(replace(right, xyz_cd_m2=xyz))
    assert noise.outliers == (row,)
    assert noise.relative == pytest.approx(0.002, rel=0.4)
    assert row not in Problem.of(replace(right, xyz_cd_m2=xyz)).rows


def with_swapped_x_and_z(right: Measurements, row: int) -> Measurements:
    xyz: Array = right.xyz_cd_m2.copy()
    xyz[row] = xyz[row, ::-1]
    return replace(right, xyz_cd_m2=xyz)


GREYS = (*TIPS, BLACK, *((g, g, g) for g in (0.1, 0.25, 0.5, 0.75)))


def test_of_two_replicates_the_patch_at_other_hours_tells_which_slipped() -> None:
    right = with_noise(readings(repeats=2), 5)
    noise = estimate_noise(with_swapped_x_and_z(right, 9))
    assert noise.outliers == (9,)
    assert noise.relative == pytest.approx(estimate_noise(right).relative, rel=0.1)


def test_two_replicates_of_an_hour_alone_do_not_tell_which_slipped_and_neither_counts_as_noise() -> None:
    right = with_noise(readings(patches=GREYS, repeats=2, hours=HOURS[:1]), 5)
    noise = estimate_noise(with_swapped_x_and_z(right, 7))
    assert (noise.outliers, noise.contradictory) == ((), (6, 7))
    assert noise.relative == pytest.approx(estimate_noise(right).relative, rel=0.2)


@pytest.mark.parametrize(
    ("decimals", "relative", "floor"), [(1, 0.0002, 0.0003), (1, 0.0005, 0.001), (2, 0.0002, 0.0003)]
)
def test_two_replicates_that_rounding_moves_apart_do_not_contradict(
    decimals: int, relative: float, floor: float
) -> None:
    exact = readings(patches=GREYS, repeats=2)
    for seed in range(6):
        fine = with_noise(exact, seed, relative=relative, floor=floor)
        noise = estimate_noise(replace(fine, xyz_cd_m2=np.round(fine.xyz_cd_m2, decimals)))
        assert (noise.outliers, noise.contradictory) == ((), ())


@pytest.mark.parametrize("share", [0.05, 1.0])
def test_a_wrong_row_of_a_repeated_patch_is_left_out_and_is_no_heavy_tail(share: float) -> None:
    """The display fades between the hours by more than the smaller error, so that only the fit tells."""
    text = csv_text(Campaign(design="colours", hours=HOURS, seed=3))
    groups = replicate_groups(three := read(text, file="campaign.csv", sha256=""))
    further = {int(line) for group in range(groups.max() + 1) for line in np.sort(three.lines[groups == group])[2:]}
    two = [line for number, line in enumerate(text.splitlines(), start=1) if number not in further]
    right = read("\n".join(two), file="campaign.csv", sha256="")
    groups = replicate_groups(right)
    is_second = np.array([np.flatnonzero(groups == group)[-1] for group in groups]) == np.arange(groups.size)
    is_second &= (np.bincount(groups)[groups] == 2) & (right.hours == HOURS[2])
    row = max(np.flatnonzero(is_second), key=lambda row: np.ptp(right.drive[row]))
    xyz: Array = right.xyz_cd_m2.copy()
    xyz[row] += share * (xyz[row, ::-1] - xyz[row])
    diagnosis = diagnose(right.with_light(xyz))
    assert diagnosis.verdict.name == "measurement-problem"
    assert f"line {int(right.lines[row])}." in diagnosis.verdict.sentence
    assert diagnosis.problem.weights is None


@pytest.mark.slow
@pytest.mark.parametrize("repeats", [3, 5])
@pytest.mark.parametrize(
    "campaigns", [100, pytest.param(500, marks=pytest.mark.rare(instead="test_pure_noise_has_no_outliers"))]
)
def test_pure_noise_has_no_outliers(repeats: int, campaigns: int) -> None:
    exact = readings(repeats=repeats, hours=HOURS[:2])
    assert not [seed for seed in range(campaigns) if estimate_noise(with_noise(exact, seed)).outliers]


def test_replicates_share_hour_code_session_conditions_and_cap() -> None:
    exact = readings(repeats=2, hours=(0.0,))
    n = exact.hours.size
    plain = replicate_groups(exact)
    assert np.unique(plain).size == 5
    apart: list[dict[str, Any]] = [
        {"conditions": {"u": np.where(np.arange(n) == 9, 0.1, 0.5)}},
        {"conditions": {"warmup_min": np.where(np.arange(n) == 9, 3.0, np.nan)}},
        {"session": tuple("b" if k == 9 else "a" for k in range(n))},
        {"note": tuple("Lens cap" if k == 9 else "" for k in range(n))},
    ]
    for changes in apart:
        groups = replicate_groups(replace(exact, **changes))
        assert np.unique(groups).size == 6
        assert np.count_nonzero(groups == groups[9]) == 1
    noted = replicate_groups(replace(exact, note=tuple("window closed" if k == 9 else "" for k in range(n))))
    assert (noted == plain).all()


def test_readings_of_several_sessions_of_one_hour_are_replicates_but_for_their_gains_and_offsets() -> None:
    relative, floor = [], []
    for seed in range(12):
        exact = readings(repeats=3)
        session = np.tile(np.arange(3), exact.hours.size // 3)
        noisy = with_noise(exact, seed)
        rng = np.random.default_rng([seed, 2])
        gains = 1.0 + rng.normal(0.0, 0.02, exact.hours.size)[session, np.newaxis]
        offsets = rng.normal(0.0, 0.03, (3, 3))[session]
        shared = noisy.xyz_cd_m2 * gains + offsets
        estimate = estimate_noise(replace(noisy, xyz_cd_m2=shared, session=tuple(map(str, session))))
        assert (estimate.source, estimate.across_sessions) == ("replicates", True)
        relative.append(estimate.relative)
        floor.append(estimate.floor_cd_m2)
        # Ten contrasts an hour, minus two gains and two offsets.
        assert estimate.contrasts in {23, 24}  # rounded down
    # Gains of 2 % and offsets of 0.03 cd/m² would be ten times the noise.
    assert np.mean(relative) == pytest.approx(0.002, rel=0.1)
    assert np.mean(floor) == pytest.approx(0.003, rel=0.5)


def test_replicates_at_different_temperatures_do_not_count_their_drift_as_noise() -> None:
    by_temperature, blind = [], []
    for seed in range(12):
        exact = readings(repeats=6)
        rng = np.random.default_rng([seed, 1])
        temperature = 25.0 + rng.normal(0.0, 1.0, exact.hours.size)
        drifting = replace(exact, xyz_cd_m2=exact.xyz_cd_m2 * (1.0 - 0.005 * (temperature - 25.0))[:, np.newaxis])
        measured = with_noise(drifting, seed)
        blind.append(estimate_noise(measured).relative)
        by_temperature.append(estimate_noise(replace(measured, conditions={"temperature_c": temperature})).relative)
    assert np.mean(by_temperature) == pytest.approx(0.002, rel=0.08)
    assert np.mean(blind) > 0.004


@pytest.mark.parametrize(("warmer", "groups"), [(8.0, 10), (2.0, 10), (0.5, 5)])
def test_a_hot_room_makes_no_replicates_of_the_usual_one(warmer: float, groups: int) -> None:
    exact = readings(repeats=3, hours=(0.0,))
    temperature = np.where(np.arange(exact.hours.size) % 3, 25.3, 25.3 + warmer)
    assert np.unique(replicate_groups(replace(exact, conditions={"temperature_c": temperature}))).size == groups


def test_pure_error_is_the_scatter_about_the_means_whitened() -> None:
    problem = Problem.of(with_noise(readings(), 7), instrument="0.0015,0.002")
    total, freedom = 0.0, 0
    for hour in HOURS:
        for code in (*TIPS, BLACK):
            here = (problem.readings.hours == hour) & (problem.readings.drive == code).all(axis=1)
            mean = problem.xyz[here].mean(axis=0)
            covariance = problem.noise.covariance(mean[np.newaxis])[0]
            total += sum(float((xyz - mean) @ np.linalg.solve(covariance, xyz - mean)) for xyz in problem.xyz[here])
            freedom += 3 * (int(here.sum()) - 1)
    error = PureError.of(problem)
    assert error.squares == pytest.approx(total)
    assert error.freedom == freedom == 120
    assert total > freedom


def test_pure_error_is_never_below_the_noise_that_is_known() -> None:
    """Replicates that are equal by a coarse last digit agree better than readings of different patches."""
    exact = with_noise(readings(), 7, relative=1e-5, floor=1e-4)
    error = PureError.of(Problem.of(replace(exact, xyz_cd_m2=exact.xyz_cd_m2.round(1))))
    assert error.squares == error.freedom == 120


@pytest.mark.parametrize(("printed", "step"), [
    (lambda values: values.round(2), 0.01),
    (lambda values: values.round(1), 0.1),
    (lambda values: values.round(4), 1e-4),
])  # fmt: skip
def test_a_fixed_number_of_decimals_is_found_from_the_values(printed: Callable[[Array], Array], step: float) -> None:
    values = np.random.default_rng(2).uniform(0.5, 300.0, (40, 3))
    np.testing.assert_allclose(digits_of(printed(values)).step(values), step)


def test_significant_digits_are_found_from_the_values() -> None:
    values = np.exp(np.random.default_rng(2).uniform(np.log(0.05), np.log(300.0), (60, 3)))
    printed = np.array([float(f"{value:.4g}") for value in values.ravel()]).reshape(values.shape)
    digits = digits_of(printed)
    np.testing.assert_allclose(digits.step(np.array([250.0, 25.0, 0.25])), [0.1, 0.01, 1e-4])


def test_values_that_are_not_rounded_have_no_step() -> None:
    values = np.random.default_rng(2).uniform(0.5, 300.0, (40, 3))
    assert (digits_of(values).step(values) == 0).all()
    assert (digits_of(np.ones((3, 3))).step(values) == 0).all()


@pytest.mark.parametrize(("blue", "wrong"), [((0.154, 0.155, 0.154), ()), ((0.154, 0.184, 0.154), (4,))])
def test_one_step_of_the_last_digit_makes_no_replicate_wrong(blue: tuple[float, ...], wrong: tuple[int, ...]) -> None:
    """A step of x is 2 % of blue's Z, ten times the noise of the meter; thirty steps are a slip."""
    digits = Digits(decimals=1, chromaticity=3)
    white = [[0.313, 0.329, 160.4], [0.313, 0.329, 160.5], [0.313, 0.329, 160.3]]
    xyz = xyY_to_xyz(np.array([*white, *([x, 0.042 if x == blue[0] else 0.043, 8.3] for x in blue)]))
    found = wrong_replicates(xyz, np.array([0, 0, 0, 1, 1, 1]), (0.002, 0.003), digits)
    assert found == (wrong, ())


def test_rounded_chromaticities_spread_x_and_z_as_the_steps_say() -> None:
    """Blue at a dark level: three decimals of x and y are a percent of its light."""
    rng = np.random.default_rng(5)
    x, y, Y = rng.uniform([0.15, 0.05, 0.3], [0.6, 0.35, 300.0], (50, 3)).T
    shown = np.column_stack([np.round(x, 3), np.round(y, 3), np.round(Y, 1)])
    digits = digits_of(xyY_to_xyz(shown))
    assert (digits.chromaticity, digits.decimals, digits.significant) == (3, 1, None)
    light = shown[:1] + rng.uniform(-0.5, 0.5, (100_000, 3)) * [1e-3, 1e-3, 0.1]
    spread = xyY_to_xyz(light).std(axis=0) * 12.0**0.5
    np.testing.assert_allclose(digits.step(xyY_to_xyz(shown[:1]))[0], spread, rtol=0.02)
    # X, Y and Z with decimals of their own are no rounded chromaticities.
    assert digits_of(np.round(xyY_to_xyz(shown), 2)).chromaticity is None
    assert digits_of(xyY_to_xyz(np.column_stack([x, y, Y]))).chromaticity is None


def test_own_sizes_and_correlations_of_x_y_and_z_are_recovered() -> None:
    """Repeated whites of real sessions: Z scatters 1.74 times as much as Y, with correlations 0.98, 0.94, 0.87."""
    ratio = np.array([1.0, 1.0, 1.74])
    rho = np.array([[1.0, 0.98, 0.87], [0.98, 1.0, 0.94], [0.87, 0.94, 1.0]])
    exact, noises = readings(), []
    for seed in range(20):
        rng = np.random.default_rng([seed, 5])
        sigma = np.sqrt((0.002 * ratio * exact.xyz_cd_m2) ** 2 + 0.003**2)
        noise = sigma * (rng.standard_normal((exact.hours.size, 3)) @ np.linalg.cholesky(rho).T)
        noises.append(estimate_noise(replace(exact, xyz_cd_m2=exact.xyz_cd_m2 + noise)))
    assert np.mean([each.ratio[2] for each in noises]) == pytest.approx(1.74, rel=0.1)
    assert np.mean([each.ratio[0] for each in noises]) == pytest.approx(1.0, rel=0.06)
    mean = np.mean([each.correlation for each in noises], axis=0)
    np.testing.assert_allclose(mean[np.triu_indices(3, 1)], [0.98, 0.87, 0.94], atol=0.05)


def test_shot_noise_is_found_where_replicates_ask_for_it() -> None:
    exact = readings(patches=(*TIPS, BLACK, *((g, g, g) for g in (0.1, 0.25, 0.5, 0.75))))
    shot, none = [], []
    for seed in range(10):
        rng = np.random.default_rng([seed, 6])
        sigma = np.sqrt(0.0016 * exact.xyz_cd_m2 + 0.001**2)
        noise = sigma * rng.standard_normal(exact.xyz_cd_m2.shape)
        shot.append(estimate_noise(replace(exact, xyz_cd_m2=exact.xyz_cd_m2 + noise)).shot_cd_m2)
        none.append(estimate_noise(with_noise(exact, seed)).shot_cd_m2)
    assert np.count_nonzero(shot) >= 9
    assert np.median(shot) == pytest.approx(0.0016, rel=0.3)
    assert np.count_nonzero(none) <= 1


def test_shot_noise_of_a_sensor_for_z_that_sees_less_light_is_larger() -> None:
    exact = readings(patches=(*TIPS, BLACK, *((g, g, g) for g in (0.1, 0.25, 0.5, 0.75))))
    sigma = np.sqrt(0.0004 * exact.xyz_cd_m2 * np.square((1.0, 1.0, 1.8)) + 0.001**2)
    ratios, scatter = [], []
    for seed in range(20):
        rng = np.random.default_rng([seed, 8])
        noise = estimate_noise(
            replace(exact, xyz_cd_m2=exact.xyz_cd_m2 + sigma * rng.standard_normal(exact.xyz_cd_m2.shape))
        )
        fresh = sigma * rng.standard_normal(exact.xyz_cd_m2.shape)
        ratios.append(noise.ratio[2])
        scatter.append((np.einsum("nij,nj->ni", noise.whitener(exact.xyz_cd_m2), fresh) ** 2).mean(axis=0))
    assert np.median(ratios) == pytest.approx(1.8, rel=0.1)
    # The variance of X, of Y given X, and of Z given X and Y.
    np.testing.assert_allclose(np.mean(scatter, axis=0), 1.0, atol=0.15)


@pytest.mark.parametrize("outliers", [(), (3,)])
def test_an_instrument_with_heavy_tails_keeps_its_outliers(outliers: tuple[int, ...]) -> None:
    problem = Problem.of(with_noise(readings(), 3))
    problem = replace(problem, noise=replace(problem.noise, outliers=outliers)).without(outliers)
    again = problem.with_outliers()
    assert again.rows.tolist() == list(range(problem.readings.hours.size))
    assert again.xyz.shape == (again.rows.size, 3)
    assert again.noise.outliers == ()


@pytest.mark.slow
def test_heavy_tails_are_no_problem_of_the_measurement() -> None:
    exact = readings(hours=tuple(1000.0 * k for k in range(10)))
    wide = np.sqrt(3.0 / np.random.default_rng(5).chisquare(3.0, (exact.hours.size, 1))) / np.sqrt(3.0)
    light = exact.xyz_cd_m2
    diagnosis = diagnose(exact.with_light(light + wide * (with_noise(exact, 5).xyz_cd_m2 - light)))
    assert diagnosis.problem.weights is not None
    # The display's black leaks 0.2 cd/m².
    assert "black-level" in diagnosis.verdict.effects


def test_noise_of_a_capped_reading_is_that_of_the_meter_whatever_code_values_the_file_gives() -> None:
    """The noise of white reaches the predictions of lit patches; behind a cap there is no light of the display."""
    text = csv_text(Campaign(design="full", hours=(0.0, 6000.0), seed=3))
    lines = [line.split(",") for line in text.splitlines()]
    for cells in lines:
        if cells[-1] == "lens cap":
            assert cells[1:4] == ["0", "0", "0"]
            cells[1:4] = ["1", "1", "1"]
    black, white = (
        compare(read(each, file="cap.csv", sha256="")) for each in (text, "\n".join(",".join(cells) for cells in lines))
    )
    assert white.floor.rms_sigma == pytest.approx(black.floor.rms_sigma, rel=0.02)
    assert white.error.rms_sigma == pytest.approx(black.error.rms_sigma, rel=0.02)
