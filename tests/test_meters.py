"""Each meter has the noise of its name. All have separate σ for X, Y and Z, and one gain per session."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kurtosis

from tests.generators.meters import (
    CORRELATION,
    DARK_CD_M2,
    FLOOR_CD_M2,
    METERS,
    RATIO,
    RELATIVE,
    SESSION_GAIN,
    WANDER,
    covariance,
)
from tests.generators.truth import Truth

pytestmark = pytest.mark.numbers

SESSIONS = 60


def _truth(light: float, *, each: int = 400) -> Truth:
    """``light`` cd/m² in X, Y and Z, read ``each`` times in each of many sessions."""
    n = SESSIONS * each
    session = np.repeat(np.arange(SESSIONS), each)
    return Truth(
        hours=np.asarray(100.0 * session, dtype=np.float64),
        drive=np.ones((n, 3)),
        xyz_cd_m2=np.full((n, 3), light),
        conditions={},
        session=tuple(f"s{number}" for number in session),
        order=np.random.default_rng(1).permutation(n).astype(float),
        note=("",) * n,
        metadata={},
        hidden={},
    )


def _by_session(name: str, light: float, seed: int = 2) -> np.ndarray:
    """Readings (sessions, readings, 3)."""
    return METERS[name].read(_truth(light), seed).reshape(SESSIONS, -1, 3)


def _within(name: str, light: float) -> np.ndarray:
    """Deviations from each session's mean, (n, 3)."""
    read = _by_session(name, light)
    return np.asarray((read - read.mean(axis=1, keepdims=True)).reshape(-1, 3))


@pytest.mark.parametrize("name", METERS)
def test_the_same_seed_gives_the_same_readings(name: str) -> None:
    truth = _truth(100.0, each=3)
    np.testing.assert_array_equal(METERS[name].read(truth, 4), METERS[name].read(truth, 4))
    assert (METERS[name].read(truth, 5) != METERS[name].read(truth, 4)).any()


@pytest.mark.parametrize("name", METERS)
def test_a_session_shares_a_gain(name: str) -> None:
    means = _by_session(name, 300.0).mean(axis=1)
    # 60 sessions give a standard deviation within 10 %. The memory of the drifting gain adds to the mean's variance.
    assert means[:, 1].std() / 300.0 == pytest.approx(SESSION_GAIN, rel=0.45 if name == "wandering-gain" else 0.3)
    assert np.corrcoef(means.T)[0, 1] > 0.95


@pytest.mark.parametrize("name", [name for name in METERS if name != "quantised"])
def test_z_scatters_more_than_y(name: str) -> None:
    x, y, z = _within(name, 0.01).std(axis=0)
    assert z / y == pytest.approx(RATIO[2], rel=0.05)
    assert x / y == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("name", ["gaussian", "dark-offset", "heavy-tails"])
def test_light_scatters_by_a_share_of_it_and_together(name: str) -> None:
    noise = _within(name, 300.0)
    np.testing.assert_allclose(noise.std(axis=0), 300.0 * RELATIVE * RATIO, rtol=0.1)
    np.testing.assert_allclose(np.corrcoef(noise.T), CORRELATION, atol=0.02)


def test_the_covariance_is_that_of_the_gaussian_meter() -> None:
    for light in (20.0, 300.0):
        sample_covariance = np.cov(_within("gaussian", light).T)
        np.testing.assert_allclose(sample_covariance, covariance(np.full((1, 3), light))[0], rtol=0.06)


def test_the_dark_offset_is_of_a_session() -> None:
    means = _by_session("dark-offset", 0.0).mean(axis=1)
    assert means[:, 1].std() == pytest.approx(DARK_CD_M2, rel=0.3)
    assert _by_session("gaussian", 0.0).mean(axis=1)[:, 1].std() < 0.1 * DARK_CD_M2
    assert _within("dark-offset", 0.0)[:, 1].std() == pytest.approx(FLOOR_CD_M2, rel=0.05)


@pytest.mark.parametrize("light", [0.3, 271.3])
def test_quantised_readings_have_few_digits(light: float) -> None:
    ways = set()
    for seed in range(8):
        cells = {f"{value:.8g}" for value in METERS["quantised"].read(_truth(light, each=4), seed).ravel()}
        hundredths = all(len(cell.partition(".")[2]) <= 2 for cell in cells)
        four = all(len(cell.replace(".", "").lstrip("-0")) <= 4 for cell in cells)
        assert hundredths or four
        ways.add((hundredths, four))
    assert len(ways) > 1


def test_the_gain_wanders_along_the_order_of_reading() -> None:
    truth = _truth(300.0)
    gain = METERS["wandering-gain"].read(truth, 2)[:, 1].reshape(SESSIONS, -1)
    order = truth.order.reshape(SESSIONS, -1)
    in_order = np.take_along_axis(gain, np.argsort(order, axis=1), axis=1)
    early, late = in_order[:, :40].mean(axis=1), in_order[:, -40:].mean(axis=1)
    assert (late - early).std() / 300.0 > WANDER
    as_written = np.abs(gain[:, :40].mean(axis=1) - gain[:, -40:].mean(axis=1)).mean()
    assert as_written < 0.5 * np.abs(late - early).mean()


def test_shot_noise_has_a_variance_proportional_to_light() -> None:
    dim, bright = (_within("shot-noise", light)[:, 1].var() - FLOOR_CD_M2**2 for light in (4.0, 400.0))
    assert bright / dim == pytest.approx(100.0, rel=0.1)


def test_heavy_tails_are_heavy() -> None:
    assert kurtosis(_within("heavy-tails", 300.0)[:, 1]) > 5.0
    assert abs(kurtosis(_within("gaussian", 300.0)[:, 1])) < 0.3


def test_only_meters_that_state_their_gain_say_so() -> None:
    for meter in METERS.values():
        assert ("session_gain" in meter.metadata) == meter.states_gain
    assert {meter.states_gain for meter in METERS.values()} == {True, False}
