"""Trends, held to decays that are known exactly, and to scipy's fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.optimize import curve_fit

from lutgen import LutgenError
from lutgen.history.decay import LAWS, fit_laws
from lutgen.history.limits import SETS, Limit, limits_of, parse_limit
from lutgen.history.trend import FEWEST, trend
from lutgen.names import LIMIT_SETS
from lutgen.readings.campaign import read_campaign
from lutgen.report.history.campaign import trend_headline
from tests.virtual_sessions.campaigns import life, write
from tests.virtual_sessions.display import State

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.readings.campaign import Campaign

pytestmark = pytest.mark.numbers

DAYS = [0, 250, 500, 800, 1100, 1500]


def fading(folder: Path, life_days: float, *, days: list[int] | None = None, head: str = "", **last: float) -> Campaign:
    """A display whose light falls exponentially; ``last`` changes the state of the last session."""
    days = days or DAYS
    states = [State(aged=np.full(3, np.exp(-day / life_days)) * np.array([1.0, 1.0, 1.0 - day * 3e-5])) for day in days]
    if last:
        states[-1] = State(aged=states[-1].aged, **last)  # type: ignore[arg-type]
    return read_campaign(write(folder, life(states, seed=4), days, head=head))


@pytest.mark.parametrize("life_days", [3000.0, 6000.0])
def test_the_time_of_a_limit_is_that_of_the_known_decay(life_days: float, tmp_path: Path) -> None:
    (found,) = trend(fading(tmp_path, life_days), [parse_limit("white>=55%")]).passings
    truth = -life_days * np.log(0.55)
    assert found.status == "ahead"
    assert found.extrapolated
    assert found.time == pytest.approx(truth, rel=0.12)
    assert found.low is not None
    assert found.low <= truth
    assert found.high is None or found.high >= truth


def test_the_chosen_law_is_near_the_truth_within_the_span() -> None:
    # 40 histories of one exponential decay, each with 1 % of noise.
    rng = np.random.default_rng(11)
    time = np.array(DAYS) / DAYS[-1]
    figures = 200.0 * np.exp(-time / 2.0)
    draws = figures * (1.0 + 0.01 * rng.standard_normal((40, time.size)))
    best = [each[0] for each in fit_laws(time, draws, 0.01 * figures)]
    off = np.array([np.abs(each.at(time) / figures - 1.0).max() for each in best])
    assert np.mean(off < 0.02) >= 0.9


@pytest.mark.parametrize(("name", "truth"), [
    ("constant", lambda t: 3.0 + 0.0 * t),
    ("linear", lambda t: 3.0 - 1.5 * t),
    ("exponential", lambda t: 3.0 * np.exp(-t / 0.9)),
    ("power", lambda t: 3.0 - 1.5 * t**0.4),
])  # fmt: skip
def test_the_law_that_made_a_history_is_chosen(name: str, truth: object) -> None:
    assert callable(truth)
    time = np.linspace(0.0, 1.0, 12)
    (fits,) = fit_laws(time, truth(time)[np.newaxis], np.full(12, 0.01))
    assert fits[0].law.name == name
    np.testing.assert_allclose(fits[0].at(time), truth(time), atol=0.02)


def test_fits_are_those_of_scipy() -> None:
    rng = np.random.default_rng(2)
    time = np.linspace(0.0, 1.0, 10)
    figures = 200.0 * np.exp(-time / 1.3) + rng.normal(0.0, 1.0, 10)
    (fits,) = fit_laws(time, figures[np.newaxis], np.full(10, 1.0))
    found = {each.law.name: each for each in fits}
    (a, tau), _ = curve_fit(lambda t, a, tau: a * np.exp(-t / tau), time, figures, p0=(200.0, 1.0))
    np.testing.assert_allclose(found["exponential"].at(time), a * np.exp(-time / tau), rtol=0.01)
    np.testing.assert_allclose(found["linear"].at(time), np.polyval(np.polyfit(time, figures, 1), time), rtol=1e-9)
    # AICc of n = 10 and k = 2: χ² + 4 + 12 / 7.
    assert found["linear"].aicc == pytest.approx(found["linear"].chi2 + 4.0 + 12.0 / 7.0)


def test_three_sessions_choose_no_slope(tmp_path: Path) -> None:
    found = trend(fading(tmp_path, 3000.0, days=[0, 500, 1000]), [parse_limit("white>=55%")])
    assert found.passings[0].status == "cannot-tell"
    assert found.courses["white"].fits[0].law.name == "constant"
    assert FEWEST == 4
    assert [law.parameters for law in LAWS] == [1, 2, 2, 3, 3]


def test_a_limit_passed_is_passed_at_the_session_that_shows_it(tmp_path: Path) -> None:
    found = trend(fading(tmp_path, 3000.0), [parse_limit("white>=80%"), parse_limit("contrast>=10")])
    # exp(-800 / 3000) is 0.77, exp(-500 / 3000) 0.85.
    assert (found.passings[0].status, found.passings[0].time) == ("passed", 800.0)
    assert (found.passings[1].status, found.passings[1].extrapolated) == ("kept", False)


def test_too_few_sessions_promise_nothing(tmp_path: Path) -> None:
    found = trend(fading(tmp_path, 3000.0, days=[0, 250]), [parse_limit("white>=50%")])
    assert found.passings[0].status == "cannot-tell"
    assert trend_headline(found).endswith("when one will be cannot be told from these sessions.")


def test_a_session_of_another_setting_is_left_out_unless_asked_for(tmp_path: Path) -> None:
    campaign = fading(tmp_path, 6000.0, brightness=1.5)
    limit = [parse_limit("white>=10")]
    found = trend(campaign, limit)
    assert found.why == {5: "brightness"}
    assert found.kept.tolist() == [True] * 5 + [False]
    assert trend(campaign, limit, all_sessions=True).kept.all()


def test_dates_become_hours_where_the_campaign_says_how_many_a_day(tmp_path: Path) -> None:
    days = trend(fading(tmp_path, 3000.0), [])
    hours = trend(fading(tmp_path, 3000.0, head="hours_per_day = 8.0"), [])
    assert (days.history.unit, hours.history.unit) == ("days", "hours")
    np.testing.assert_allclose(hours.history.time, 8.0 * days.history.time)


def test_limits_are_read_as_they_are_written() -> None:
    assert parse_limit("white>=200") == Limit("white", 200.0, "user")
    assert parse_limit(" white-shift <= 0.005 ") == Limit("white-shift", 0.005, "user", above=False)
    assert parse_limit("white>=80%").text == "white>=80%"
    # Samei et al. 2005: 170 and 100 cd/m², luminance ratios 250 and 100, of primary and secondary displays.
    assert [each.value for each in (*limits_of("tg18-primary"), *limits_of("tg18-secondary"))] == [170, 250, 100, 100]
    assert {*LIMIT_SETS} == {*SETS}
    for text, said in (
        ("white", "write a quantity"),
        ("red>=3", "Pick one of: white"),
        ("white>=0", "no number"),
    ):
        with pytest.raises(LutgenError, match=said):
            parse_limit(text)
    with pytest.raises(LutgenError, match="Pick one of"):
        limits_of("none")


def test_campaigns_that_have_no_trend_are_refused(tmp_path: Path) -> None:
    texts = life([State(), State()])
    with pytest.raises(LutgenError, match="a trend is told from two or more"):
        trend(read_campaign(write(tmp_path, texts[:1], [0])), [])
    with pytest.raises(LutgenError, match="sessions months apart"):
        trend(read_campaign(write(tmp_path, texts, [0, 0])), [])
