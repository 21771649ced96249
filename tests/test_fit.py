"""The fit against a slow twin that solves for all unknowns together, and against its own statistics."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen.criticism.diagnose import parameters_of
from lutgen.criticism.fit.least_squares import Fit, fit
from lutgen.criticism.fit.linear import State, Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.effects import catalogue
from lutgen.errors import LutgenError
from tests.criticism_twin import (
    FAULTS,
    FRESH,
    HOURS,
    TIPS,
    TRUTHS,
    Answer,
    Fault,
    Reading,
    display,
    measured,
    noisy,
    session,
    solve,
    table,
)  # fmt: skip
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text
from tests.virtual_display.spectra import CLASSES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lutgen.colorimetry import Array

pytestmark = pytest.mark.numbers

#: Sessions of the healthy displays.
NULL_HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)

#: A fit stops when the predicted decrease of χ² is below 0.02. Gauss-Newton is then nearer than this, in σ.
NEAR = 0.02


def fitted(
    readings: Sequence[Reading], name: str, form: tuple[str, ...], baseline: str, luminance: str = "free"
) -> Fit:
    problem = Problem.of(table(readings, luminance=luminance), baseline=baseline, instrument="0.002,0.003")
    return fit(problem, (Term.at_rest(catalogue()[name], form),))


def bounds_of(name: str, form: Sequence[str]) -> dict[str, tuple[float, float]]:
    return {key: catalogue()[name].parameters[key].bounds for key in form}


def assert_same(solution: Fit, twin: Answer, *, chi2: float = 1e-4, sigma: float = NEAR) -> None:
    assert solution.chi2 == pytest.approx(twin.chi2, rel=chi2)
    for name, value in twin.values.items():
        assert solution.terms[0].values[name] == pytest.approx(value, abs=sigma * twin.stderr[name])
        assert solution.stderr[0][name] == pytest.approx(twin.stderr[name], rel=0.01)


@pytest.mark.parametrize("name", mostly_slow(TRUTHS, "black-level", "backlight-decay"))
def test_a_fit_ends_where_the_twin_ends_and_near_the_truth(name: str) -> None:
    truth, baseline = TRUTHS[name]
    readings = measured(name)
    twin = solve(readings, FAULTS[name], bounds_of(name, tuple(truth)), fresh=baseline == "first-hour")
    solution = fitted(readings, name, tuple(truth), baseline)
    assert_same(solution, twin)
    for key, value in truth.items():
        assert abs(solution.terms[0].values[key] - value) < 4.0 * solution.stderr[0][key]


def test_two_effects_are_fitted_together_as_the_twin_does() -> None:
    both = Fault(linear=FAULTS["eotf-drift"].linear, xyz=FAULTS["black-level"].xyz)
    # One pair of parameters drives both effects, so the twin needs no separate names: eotf's new is black's new.
    readings = noisy(
        [each for hour in HOURS for each in session(hour)], display(), both, {"new": 0.01, "grown": 0.0}, 2
    )
    problem = Problem.of(table(readings), instrument="0.002,0.003")
    terms = tuple(Term.at_rest(catalogue()[name], ("new",)) for name in ("black-level", "eotf-drift"))
    solution = fit(problem, terms)
    split = Fault(
        linear=lambda linear, tau, p: FAULTS["eotf-drift"].linear(linear, tau, {"new": p["gamma"], "grown": 0.0}),
        xyz=lambda xyz, white, reading, tau, p: FAULTS["black-level"].xyz(
            xyz, white, reading, tau, {"new": p["leak"], "grown": 0.0}
        ),
    )
    twin = solve(readings, split, {"leak": (0.0, 0.03), "gamma": (-0.3, 0.3)})
    assert solution.chi2 == pytest.approx(twin.chi2, rel=1e-4)
    assert solution.terms[0].values["new"] == pytest.approx(twin.values["leak"], abs=NEAR * twin.stderr["leak"])
    assert solution.terms[1].values["new"] == pytest.approx(twin.values["gamma"], abs=NEAR * twin.stderr["gamma"])


@pytest.mark.slow
def test_the_gain_between_two_sessions_of_one_hour_is_fitted_as_the_twin_does() -> None:
    truth, _ = TRUTHS["black-level"]
    patches = [each for hour in HOURS for each in session(hour)] + session(HOURS[-1], "b")
    readings = noisy(patches, display(), FAULTS["black-level"], truth, seed=2)
    solution = fitted(readings, "black-level", tuple(truth), "colour-points")
    assert_same(solution, solve(readings, FAULTS["black-level"], bounds_of("black-level", tuple(truth))))
    assert np.count_nonzero(solution.gains) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["crosstalk", "black-level"])
def test_an_hour_without_tips_is_fitted_nearly_as_the_twin_does(name: str) -> None:
    # In lutgen the tips of such an hour follow the neighbouring hours. In the twin the hour also influences them.
    truth, _ = TRUTHS[name]
    hours = (0.0, 5000.0, 7000.0, 11_000.0, 16_000.0)
    tips = display(hours)
    patches = [each for hour in hours for each in session(hour) if hour != 7000.0 or each.code not in TIPS]
    readings = noisy(patches, tips, FAULTS[name], truth, seed=3)
    twin = solve(readings, FAULTS[name], bounds_of(name, tuple(truth)))
    assert_same(fitted(readings, name, tuple(truth), "colour-points"), twin, chi2=1e-3, sigma=0.1)


def _held(tips: Array, tau: float, p: Mapping[str, float]) -> Array:
    aged = FAULTS["channel-decay"].tips(tips, tau, p)
    return np.asarray(aged * tips[0, 1] / aged[0, 1])


def test_a_held_display_is_fitted_as_the_twin_does() -> None:
    truth = {"red": 0.0, "green": 0.0, "blue": 0.7}
    patches = [each for hour in HOURS for each in session(hour)]
    readings = noisy(patches, display(ageing=0.0), Fault(tips=_held), truth, seed=4)
    only_blue = Fault(
        tips=lambda tips, tau, p: FAULTS["channel-decay"].tips(tips, tau, {"red": 0.0, "green": 0.0, **p})
    )
    twin = solve(readings, only_blue, bounds_of("channel-decay", ("blue",)), fresh=True, held=True)
    assert_same(fitted(readings, "channel-decay", ("blue",), "first-hour", "held"), twin)


def test_parameters_that_trade_off_perfectly_do_not_keep_a_fit_from_its_minimum() -> None:
    # With a constant white, a decay of all channels cannot be seen, but their differences can.
    truth, form = {"red": 0.2, "green": 0.3, "blue": 0.7}, ("red", "green", "blue")
    patches = [each for hour in HOURS for each in session(hour)]
    readings = noisy(patches, display(ageing=0.0), Fault(tips=_held), truth, seed=4)
    twin = solve(readings, FAULTS["channel-decay"], bounds_of("channel-decay", form), fresh=True, held=True)
    solution = fitted(readings, "channel-decay", form, "first-hour", "held")
    assert solution.chi2 == pytest.approx(twin.chi2, rel=1e-3)
    values = solution.terms[0].values
    assert values["blue"] - values["red"] == pytest.approx(0.5, abs=0.02)
    assert values["green"] - values["red"] == pytest.approx(0.1, abs=0.02)


def test_a_parameter_stops_at_its_bound_and_says_so() -> None:
    readings = measured("black-level", values={"new": -0.002, "grown": 0.003})
    solution = fitted(readings, "black-level", ("new", "grown"), "colour-points")
    twin = solve(readings, FAULTS["black-level"], bounds_of("black-level", ("new", "grown")))
    parameters = parameters_of(solution)["black-level"]
    assert parameters["new"]["value"] == 0.0 == catalogue()["black-level"].parameters["new"].bounds[0]
    assert parameters["new"]["at_bound"]
    assert not parameters["grown"]["at_bound"]
    assert solution.chi2 == pytest.approx(twin.chi2, rel=1e-4)


@pytest.mark.parametrize(("name", "form", "why"), [
    ("edge-falloff", ("new",), "nothing was read off the centre"),
    ("warm-up", ("amount",), "nothing was read cold"),
    ("black-level", ("power",), "there is nothing whose growth a power could shape"),
])  # fmt: skip
def test_a_parameter_without_influence_has_no_standard_error(name: str, form: tuple[str, ...], why: str) -> None:
    readings = [each for each in measured("crosstalk") if not each.where]
    solution = fitted(readings, name, form, "colour-points")
    assert np.isinf(solution.stderr[0][form[0]]), why
    assert parameters_of(solution)[name][form[0]]["stderr"] is None
    assert solution.terms[0].values[form[0]] == catalogue()[name].rest()[form[0]]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["black-level", "eotf-drift", "channel-decay"])
def test_standard_errors_are_what_repeated_campaigns_scatter_by(name: str) -> None:
    truth, baseline = TRUTHS[name]
    fits = [fitted(measured(name, seed=seed), name, tuple(truth), baseline) for seed in range(60)]
    for key, value in truth.items():
        values = np.array([each.terms[0].values[key] for each in fits])
        stderr = float(np.mean([each.stderr[0][key] for each in fits]))
        # The standard deviation of 60 draws is known within 9 %, their mean within 0.13 standard deviations.
        assert np.std(values, ddof=1) == pytest.approx(stderr, rel=0.3)
        assert abs(values.mean() - value) < 4.0 * stderr / np.sqrt(60)


@pytest.mark.slow
@pytest.mark.rare(instead="test_standard_errors_are_what_repeated_campaigns_scatter_by")
def test_estimates_of_what_is_not_there_scatter_by_their_standard_errors() -> None:
    """Pulls over 100 healthy spectral displays. The noise is estimated from their replicates."""
    pulls: dict[str, list[float]] = {"black-level grown": [], "crosstalk new": [], "eotf-drift grown": []}
    for seed in range(100):
        text = csv_text(Campaign(display=list(CLASSES)[seed % 4], design="colours", hours=NULL_HOURS, seed=seed))
        problem = Problem.of(read(text, file="null.csv", sha256=""))
        for key, draws in pulls.items():
            name, parameter = key.split()
            end = fit(problem, (Term.at_rest(catalogue()[name], (parameter,)),))
            draws.append(end.terms[0].values[parameter] / end.stderr[0][parameter])
    for key, draws in pulls.items():
        assert 0.8 < np.std(draws) < 1.2, key  # 100 draws: ± 0.07
        assert abs(np.mean(draws)) < 0.35, key


def test_chi2_counts_the_residuals_and_what_gains_and_tips_cost() -> None:
    truth, _ = TRUTHS["crosstalk"]
    hours = (0.0, 5000.0, 7000.0, 11_000.0)
    patches = [each for hour in hours for each in session(hour) if hour != 7000.0 or each.code not in TIPS]
    solution = fitted(
        noisy(patches, display(hours), FAULTS["crosstalk"], truth, seed=5), "crosstalk", ("new",), "colour-points"
    )
    problem, total = solution.problem, 0.0
    for reading, light, cov in zip(problem.xyz, solution.predicted, _covariances(solution), strict=True):
        total += float((reading - light) @ np.linalg.solve(cov, reading - light))
    total += float(((solution.gains / problem.noise.session) ** 2).sum())
    off = (solution.tips - problem.interpolated(solution.tips))[2] / problem.interpolation_sigma[2]
    assert solution.chi2 == pytest.approx(total + float((off**2).sum()), rel=1e-4)
    assert solution.freedom == 3 * len(patches) - 3 * 12 - 1


def _covariances(solution: Fit) -> Array:
    inverse = np.linalg.inv(solution.problem.whitener)
    return np.asarray(inverse @ np.swapaxes(inverse, 1, 2))


def test_rows_left_out_do_not_count() -> None:
    readings = measured("crosstalk")
    wrong = [replace(each, xyz=(9.0, 9.0, 9.0)) if k in {12, 40} else each for k, each in enumerate(readings)]
    problem = Problem.of(table(wrong), instrument="0.002,0.003")
    term = Term.at_rest(catalogue()["crosstalk"], ("new", "grown"))
    weighted = fit(
        Problem.of(table([each for k, each in enumerate(readings) if k not in {12, 40}]), instrument="0.002,0.003"),
        (term,),
    )
    shorter = fit(problem.without([12, 40]), (term,))
    assert shorter.chi2 == pytest.approx(weighted.chi2, rel=1e-9)
    assert shorter.terms[0].values == pytest.approx(weighted.terms[0].values, rel=1e-9)
    assert shorter.readings == weighted.readings == 3 * (len(readings) - 2)
    assert fit(problem, (term,)).chi2 > 10.0 * shorter.chi2


def test_leaving_out_the_last_reading_of_a_tip_is_refused() -> None:
    readings = table(measured("crosstalk"))
    whites = np.flatnonzero((readings.drive == 1.0).all(axis=1) & (readings.hours == HOURS[1]))
    with pytest.raises(LutgenError, match=r"hour 7000: all readings of white or of one primary"):
        fit(Problem.of(readings).without([int(row) for row in whites]))


def test_a_fit_is_the_same_twice_and_in_any_order_of_terms() -> None:
    problem = Problem.of(table(measured("black-level")))
    terms = [Term.at_rest(catalogue()[name], ("new", "grown")) for name in ("black-level", "crosstalk")]
    first, again, turned = fit(problem, terms), fit(problem, terms), fit(problem, terms[::-1])
    assert first.terms == again.terms
    assert first.chi2 == again.chi2
    assert (first.tips == again.tips).all()
    assert turned.chi2 == pytest.approx(first.chi2, rel=1e-6)
    assert turned.terms[1].values == pytest.approx(first.terms[0].values, rel=1e-4)


def test_a_better_start_ends_at_the_same_minimum() -> None:
    solution = fitted(measured("crosstalk"), "crosstalk", ("new", "grown"), "colour-points")
    again = fit(solution.problem, solution.terms, State((), solution.tips, solution.gains))
    assert again.chi2 == pytest.approx(solution.chi2, rel=1e-6)
    np.testing.assert_allclose(
        again.predicted, predict(solution.problem, State(solution.terms, solution.tips, solution.gains)), rtol=1e-5
    )


@pytest.mark.parametrize(("baseline", "luminance", "told"), [
    ("old", "free", "baseline"),
    ("first-hour", "helt", "luminance is 'helt'. Pick one of: held, free"),
])  # fmt: skip
def test_what_is_no_problem_is_refused(baseline: str, luminance: str, told: str) -> None:
    with pytest.raises(LutgenError, match=told):
        Problem.of(table(measured("crosstalk"), luminance=luminance), baseline=baseline)


@pytest.mark.parametrize(("fall", "held"), [(0.01, True), (0.05, False)])
def test_a_white_that_hardly_falls_is_taken_for_held_when_the_file_does_not_say(fall: float, held: bool) -> None:
    tips = {hour: FRESH * (1.0 - fall * hour / HOURS[-1]) for hour in HOURS}
    readings = [
        Reading(hour, code, (float(x), float(y), float(z)))
        for hour in HOURS
        for code, (x, y, z) in zip(TIPS, tips[hour], strict=True)
    ]
    assert Problem.of(table(readings)).held == held
