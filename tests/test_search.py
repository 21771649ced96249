"""Trying effects: fitted forms, their penalty, and the distinction of an effect from chance."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import colour
import numpy as np
import pytest
from scipy import special, stats

from lutgen.criticism.fit.code_shifts import CodeShifts
from lutgen.criticism.fit.least_squares import Fit, fit, switching_penalty
from lutgen.criticism.fit.linear import Term, predict
from lutgen.criticism.fit.problem import Problem
from lutgen.criticism.noise.pure_error import PureError
from lutgen.criticism.search import candidates, stepwise
from lutgen.criticism.search.candidates import (
    STRONG,
    Family,
    _with_time_course,
    best_start,
    bic,
    contenders,
    families,
    family,
    forms_of,
)
from lutgen.criticism.search.forms import simple_forms
from lutgen.criticism.search.one_for_several import inside_limits, near_the_best, one_for_several
from lutgen.effects import Effect, catalogue
from lutgen.effects.shapes import COURSE
from lutgen.errors import LutgenError
from tests.criticism_twin import FAULTS, TRUTHS, display, measured, noisy, session, table
from tests.quick import mostly_slow
from tests.readings_text import read
from tests.virtual_display.campaign import Campaign, csv_text
from tests.virtual_display.spectra import CLASSES

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array
    from lutgen.criticism.search.candidates import Candidate

pytestmark = pytest.mark.numbers

HOURS = (0.0, 2500.0, 6000.0, 11_500.0, 18_000.0)


@cache
def base_of(name: str) -> Fit:
    return fit(Problem.of(table(measured(name)), instrument="0.002,0.003"))


@cache
def healthy(seed: int) -> Fit:
    """A display without an effect, of each class in turn."""
    text = csv_text(Campaign(display=list(CLASSES)[seed % 4], design="colours", hours=HOURS, seed=seed))
    return fit(Problem.of(read(text, file="null.csv", sha256="")))


@cache
def campaign(design: str = "colours", seed: int = 3, **hidden: tuple[float, str]) -> Fit:
    effects = tuple((name.replace("_", "-"), size, form) for name, (size, form) in hidden.items())
    text = csv_text(Campaign(design=design, hours=HOURS, seed=seed, hidden=effects))
    return fit(Problem.of(read(text, file="campaign.csv", sha256="")))


@pytest.mark.parametrize(("name", "parameter", "tolerance"), [
    ("ambient-reflection", "reflectance", 1e-6),  # linear
    ("black-level", "grown", 0.01),
    ("crosstalk", "grown", 0.1),
    ("eotf-drift", "grown", 0.1),
])  # fmt: skip
def test_a_first_step_promises_what_the_fit_gains(name: str, parameter: str, tolerance: float) -> None:
    base, term = base_of(name), Term.at_rest(catalogue()[name], (parameter,))
    gained = base.chi2 - fit(base.problem, (term,)).chi2
    assert base.score.gain(term, (parameter,)) == pytest.approx(gained, rel=tolerance)


def test_what_cannot_be_absorbed_is_what_least_squares_leaves() -> None:
    base, term = base_of("crosstalk"), Term.at_rest(catalogue()["crosstalk"], ("new",))
    raw, left = base.score.seen(term, "new")
    # The oracle: all twelve unknowns of each hour, changed one by one, in one dense matrix.
    columns = []
    for hour, tip, axis in product(range(3), range(4), range(3)):
        tips = base.tips.copy()
        tips[hour, tip, axis] *= 1.001
        moved = base.problem.predict((), base.problem.panel(()), tips) - base.predicted
        columns.append(np.einsum("nij,nj->ni", base.problem.whitener, moved).ravel())
    matrix = np.array(columns).T
    rest = raw - matrix @ np.linalg.lstsq(matrix, raw, rcond=None)[0]
    assert np.linalg.norm(left) == pytest.approx(np.linalg.norm(rest), rel=1e-6)
    assert np.linalg.norm(left) < np.linalg.norm(raw)


def test_simple_forms_are_always_tried_and_refined_ones_where_they_are_worth_it() -> None:
    null, grown = campaign(), campaign(black_level=(0.002, "other"))
    effect = catalogue()["black-level"]
    plain, curved = family(null, effect), family(grown, effect)
    assert {plain.simple.form, curved.simple.form} <= {*effect.forms[: effect.refined]}
    assert curved.simple.fit.bic <= family(grown, effect, longest=1).simple.fit.bic
    assert plain.tried < curved.tried <= len(effect.forms)
    assert not plain.best.refined
    assert curved.best.refined
    assert curved.best.form in effect.forms[effect.refined :]


def test_the_best_form_is_that_of_the_least_bic_and_every_form_is_charged_for_its_parameters() -> None:
    base = campaign(black_level=(0.002, "other"))
    tried = forms_of(base, catalogue()["black-level"])
    n = np.log(3 * base.problem.rows.size)
    for each in tried:
        assert bic(each) == pytest.approx(each.fit.chi2 + len(each.form) * n)
        assert each.gain == pytest.approx(base.chi2 - each.fit.chi2)
    assert [bic(each) for each in tried] == sorted(bic(each) for each in tried)
    assert family(base, catalogue()["black-level"]).best.form == tried[0].form


def test_families_come_in_the_order_given_and_hopeless_ones_are_not_refined() -> None:
    base = campaign(black_level=(0.002, "other"))
    effects = [catalogue()[name] for name in ("eotf-drift", "black-level", "crosstalk")]
    all_of_them, near = list(families(base, effects)), list(families(base, effects, within=10.0))
    assert [each.name for each in all_of_them] == [each.name for each in near] == [each.name for each in effects]
    assert bic(near[1].best) == bic(all_of_them[1].best)
    assert near[0].tried <= effects[0].refined


def test_contenders_are_those_below_the_limit_best_first() -> None:
    base = campaign("greys", crosstalk=(0.0015, "same"))
    effects = [each for each in catalogue().values() if each.baseline == "colour-points"]
    limit = min(bic(each.best) for each in families(base, effects)) + STRONG
    candidates = contenders(base, effects, limit)
    assert {each.name for each in candidates} >= {"crosstalk", "loading"}
    assert [bic(each.best) for each in candidates] == sorted(bic(each.best) for each in candidates)
    assert all(bic(each.best) < limit for each in candidates)
    assert not contenders(base, effects, -np.inf)


@pytest.mark.slow
def test_grids_are_tried_one_by_one_and_charged_as_a_parameter() -> None:
    base = campaign(quantization=(1.0 / 255.0, "same"))
    forms = family(base, catalogue()["quantization"])
    assert forms.best.form == ("bits",)
    assert forms.best.term.values["bits"] == 8.0
    assert forms.best.fit.parameters == 0
    assert bic(forms.best) == pytest.approx(forms.best.fit.chi2 + np.log(3 * base.problem.rows.size))
    by_hand = {
        bits: fit(base.problem, (Term.at_rest(catalogue()["quantization"], ("bits",), bits=bits),)).chi2
        for bits in (7.0, 8.0, 9.0)
    }
    assert min(by_hand, key=lambda bits: by_hand[bits]) == 8.0
    assert forms.best.fit.chi2 == pytest.approx(by_hand[8.0])


@pytest.mark.slow
@pytest.mark.parametrize(("form", "steps"), [("same", 201), ("other", 173)])
def test_any_number_of_steps_behind_any_table_is_found(form: str, steps: int) -> None:
    base = campaign(quantization=(1.0 / steps, form))
    candidate = family(base, catalogue()["quantization"]).best
    assert round(2.0 ** candidate.term.values["bits"] - 1.0) == steps
    if form == "other":  # a panel of gamma 2.2, with 0.4 of a step added before truncation
        assert candidate.term.values["panel_gamma"] == pytest.approx(2.2, abs=0.003)
        assert candidate.term.values["added"] == 0.4
    assert candidate.fit.chi2 < 1.1 * candidate.fit.freedom < 0.9 * base.chi2
    assert candidate.settings > 1e6


def behind_a_table(code: Array) -> Array:
    return np.asarray((np.round(code**0.9165 * 719.0) / 719.0) ** (1.0 / 0.9165))


def in_a_panel(code: Array) -> Array:
    """Quantise to the 11 bits of a panel of gamma 2.2, with 0.4 of a step added before truncation."""
    native = np.floor(colour.models.eotf_sRGB(code) ** (1.0 / 2.2) * 2047.0 + 0.4) / 2047.0
    return np.asarray(colour.models.eotf_inverse_sRGB(native**2.2))


@pytest.mark.parametrize(
    ("rounded", "steps", "setting"),
    mostly_slow(
        [(behind_a_table, 719, {"table_gamma": 0.9165}), (in_a_panel, 2047, {"panel_gamma": 2.2, "added": 0.4})],
        behind_a_table,
    ),
)
def test_the_rounding_that_codes_ask_for_is_proposed_first(
    rounded: Callable[[Array], Array], steps: int, setting: dict[str, float]
) -> None:
    rng = np.random.default_rng(4)
    code, propose = (
        np.sort(rng.choice(np.arange(12, 250), 45, replace=False)) / 255.0,
        catalogue()["quantization"].propose,
    )
    shared = rng.uniform(0.0, 0.2, (45, 45)) / 45.0
    information = 1e9 * (np.eye(45) + shared + shared.T)
    pull = information @ (rounded(code) - code) + rng.normal(0.0, 3e4, 45)
    assert propose is not None
    best, looked_at = propose(code, pull, information)
    assert round(2.0 ** best[0]["bits"] - 1.0) == steps
    assert best[0] == pytest.approx({"bits": best[0]["bits"]} | setting, abs=1e-3)
    assert looked_at > 1e7


@pytest.mark.slow
@pytest.mark.parametrize(("lost", "are_of_one_step"), [(0.0, True), (0.2, False)])
def test_no_shift_of_a_rounding_is_far_larger_than_the_others(lost: float, *, are_of_one_step: bool) -> None:
    """A display that gives no light below a code value shifts this code value by many steps."""
    rng = np.random.default_rng(5)
    code = np.linspace(0.05, 0.95, 60)
    shifts = rng.uniform(-0.5, 0.5, 60) / 63.0
    shifts[0] -= lost
    information = 1e8 * np.eye(60)
    known = CodeShifts(code, information, information @ shifts + rng.normal(0.0, 1e4, 60))
    assert known.is_jagged
    assert known.are_of_one_step is are_of_one_step


@pytest.mark.slow
def test_a_rounding_is_proposed_beside_another_effect_though_its_simplest_formula_explains_nothing() -> None:
    hidden = {"quantization": (1.0 / 2047.0, "other"), "black_level": (2e-3, "same")}
    base = campaign("full", 3, **hidden)
    beside = family(base, catalogue()["black-level"]).best.fit
    limit = beside.bic - STRONG
    best = {each.name: each.best for each in families(beside, [catalogue()["quantization"]], limit=limit)}
    assert bic(best["quantization"]) < limit
    simplest = fit(beside.problem, (*beside.terms, Term.at_rest(catalogue()["quantization"], ("bits",), bits=11.0)))
    assert simplest.chi2 > beside.chi2 - 6.0


def with_light_of(problem: Problem, name: str, **values: float) -> Fit:
    """Add to the readings what an effect of the catalogue changes; fit without the effect."""
    effect = catalogue()[name]
    null = fit(problem)
    changed = predict(problem, null.state._replace(terms=(Term(effect, effect.rest() | values),)))
    shown = replace(problem.readings, xyz_cd_m2=problem.readings.xyz_cd_m2 + changed - null.predicted)
    return fit(Problem.of(shown, baseline="first-hour" if problem.from_first_hour else "colour-points"))


@cache
def from_hour_0() -> Problem:
    text = csv_text(Campaign(design="colours", seed=3, baseline="first-hour", ageing=0.0))
    return Problem.of(read(text, file="burnt.csv", sha256=""), baseline="first-hour")


@cache
def burnt() -> Fit:
    """Channels that burn in unequally, with a stretched course: no declared form has ``beta`` beside the channels."""
    values = {"share": 0.06, "red": -0.02, "blue": 0.05, "early_h": 400.0, "beta": 0.7, "loss": 0.1}
    return with_light_of(from_hour_0(), "burn-in-decay", **values)


def test_two_forms_of_an_effect_are_joined_where_a_display_needs_both() -> None:
    effect, base = catalogue()["burn-in-decay"], burnt()
    tried = {frozenset(each.form): each for each in forms_of(base, effect, freely=True)}
    declared = min((tried[form] for form in map(frozenset, effect.forms) if form in tried), key=bic)
    best = min(tried.values(), key=bic)
    assert best.form not in effect.forms
    assert {*declared.form, "beta"} == {*best.form}
    assert bic(best) < bic(declared) - STRONG
    assert best.term.values["beta"] == pytest.approx(0.7, abs=0.1)
    assert forms_of(fit(from_hour_0()), effect, freely=True)[0].form in effect.forms


def test_joined_forms_that_make_a_simple_form_are_no_refinement() -> None:
    base, effect = campaign(black_level=(0.002, "same")), catalogue()["black-level"]
    alone = next(each for each in forms_of(base, effect) if each.form == ("new",))
    both = candidates._joined_with(base, alone, ("grown",))
    assert both is not None
    assert (set(both.form), both.refined) == ({"new", "grown"}, False)


def test_a_form_at_its_limit_is_neither_the_best_nor_as_good_where_another_explains_as_much() -> None:
    def fitted(size: float, gain: float, *, is_at_limit: bool) -> Any:
        effect, fit = SimpleNamespace(name="fade"), SimpleNamespace(bic=1000.0 - gain)
        return SimpleNamespace(effect=effect, fit=fit, gain=gain, is_at_limit=is_at_limit, refined=False, size=size)

    limit, near, alike = (
        fitted(size, gain, is_at_limit=size > 9) for size, gain in ((10.0, 900.0), (0.2, 880.0), (0.3, 876.0))
    )
    chosen = Family.of([limit, near, alike])
    assert (chosen.best, chosen.alike) == (near, (alike,))
    far = fitted(0.1, 500.0, is_at_limit=False)
    assert Family.of([limit, far]).best is limit


def test_an_effect_whose_simple_form_is_held_starts_at_rest() -> None:
    """A display's own model contains the sizes of hour 0, so that no simple form may be left."""
    effect = replace(catalogue()["black-level"], forms=(("power",),), refined=0)
    assert simple_forms(effect) == ((),)
    assert best_start(campaign(), effect).free == ()


def test_one_effect_that_leaves_noise_replaces_several_of_its_kind_that_do_not() -> None:
    base, effects, error = burnt(), [*catalogue().values()], PureError.of(burnt().problem)
    pair = [family(base, catalogue()[name]).best for name in ("yellowing", "backlight-decay")]
    (alone,) = one_for_several(pair, effects, base, error)
    assert (alone.effect.name, alone.fit.parameters) == ("burn-in-decay", 6)
    assert not one_for_several(pair[:1], effects, base, error)
    mixed = [pair[0], family(base, catalogue()["black-level"]).best]
    assert not one_for_several(mixed, effects, base, error)
    others = [effect for effect in effects if effect.name not in {"burn-in-decay", "channel-decay"}]
    assert not one_for_several(pair, others, base, error)


def test_the_form_of_an_only_effect_that_leaves_a_free_term_is_replaced_by_one_that_explains_nearly_all() -> None:
    """The light falls to one side, and with another course than the simple form has; the other form has both."""
    problem = campaign("full").problem
    base = with_light_of(problem, "edge-falloff", new=0.05, grown=0.1, power=0.6, slope_u=0.3)
    error = PureError.of(base.problem)
    tried = forms_of(base, catalogue()["edge-falloff"])
    simple = next(each for each in tried if each.form == ("new", "grown"))
    (freer,) = stepwise._freer([simple], base, error)
    assert "slope_u" in freer.form
    assert freer.fit.chi2 < 1.2 * freer.fit.freedom < 0.5 * simple.fit.chi2
    assert stepwise._freer([freer], base, error) == [freer]


def test_three_exponents_that_differ_are_a_formula_of_a_recalibration() -> None:
    """The display answers red with a larger exponent and blue with a smaller one: one exponent explains nothing."""
    problem = campaign().problem
    base = with_light_of(problem, "recalibration", hour=float(problem.hours[2]), red=0.05, blue=-0.05)
    best = family(base, catalogue()["recalibration"]).best
    assert set(best.form) == {"hour", "red", "green", "blue"}
    assert not best.refined
    assert best.fit.chi2 < 1.2 * best.fit.freedom


def test_a_formula_is_judged_in_the_course_of_the_long_form() -> None:
    base = campaign(eotf_drift=(0.05, "other"))
    tried = {each.form: each for each in forms_of(base, catalogue()["eotf-drift"])}
    formula = tried["grown",]
    (long,) = [each for form, each in tried.items() if "power" in form and len(form) == max(map(len, tried))][:1]
    refitted = _with_time_course(base, formula, long)
    assert set(refitted.form) == {"grown"} | (COURSE & set(long.form))
    assert formula.gain <= refitted.gain <= long.gain + 1.0
    assert _with_time_course(base, refitted, long) is refitted


@pytest.mark.parametrize("hidden", [{}, {"eotf_drift": (0.01, "same")}])
def test_what_is_smooth_proposes_no_rounding(hidden: dict[str, tuple[float, str]]) -> None:
    assert campaign(**hidden).score.proposed(catalogue()["quantization"]) == ([], 1)


def test_a_soft_border_between_colour_points_is_found() -> None:
    base = campaign(matrix_switching=(0.01, "other"))  # the harmonic mean of the channels, not the smallest channel
    candidate = family(base, catalogue()["matrix-switching"]).best
    assert candidate.form == ("softness",)
    assert candidate.term.values["softness"] == pytest.approx(1.0, abs=0.1)
    assert candidate.fit.chi2 < 1.1 * candidate.fit.freedom < 0.9 * base.chi2


def test_an_hour_between_sessions_is_found_among_the_gaps() -> None:
    base = campaign(recalibration=(0.05, "same"))
    candidate = family(base, catalogue()["recalibration"]).simple
    hour = catalogue()["recalibration"].forms[0][-1]
    gaps = (np.array(HOURS[1:]) + np.array(HOURS[:-1])) / 2
    gridded = [name for name in candidate.form if catalogue()["recalibration"].parameters[name].grid]
    assert len(gridded) == 1, hour
    assert candidate.term.values[gridded[0]] in gaps
    by_hand = []
    for gap in gaps:
        term = Term.at_rest(catalogue()["recalibration"], candidate.form, **{gridded[0]: float(gap)})
        by_hand.append(fit(base.problem, (term,)).chi2)
    assert candidate.term.values[gridded[0]] == gaps[int(np.argmin(by_hand))]
    assert candidate.fit.chi2 == pytest.approx(min(by_hand), rel=1e-3)


def test_what_happens_between_sessions_needs_two_of_them() -> None:
    base = fit(Problem.of(table(noisy(session(0.0), display(), FAULTS["crosstalk"], {"new": 0.0, "grown": 0.0}, 1))))
    with pytest.raises(LutgenError, match="between two sessions"):
        family(base, catalogue()["recalibration"])


def test_a_shape_far_from_its_typical_value_is_found() -> None:
    text = csv_text(Campaign(design="full", hours=HOURS, seed=3, hidden=(("warm-up", 0.1, "same"),)))
    base = fit(Problem.of(read(text, file="cold.csv", sha256="")))
    candidate = family(base, catalogue()["warm-up"]).best
    for start in (3.0, 20.0, 100.0):
        alone = fit(base.problem, (Term.at_rest(catalogue()["warm-up"], candidate.form, minutes=start),))
        assert candidate.fit.chi2 <= alone.chi2 + 0.1


def test_an_effect_that_begins_beyond_a_threshold_is_found() -> None:
    text = csv_text(
        Campaign(design="colours", seed=3, baseline="first-hour", hidden=(("stabilizer-headroom", 0.6, "same"),))
    )
    base = fit(Problem.of(read(text, file="knee.csv", sha256=""), baseline="first-hour"))
    effect: Effect = catalogue()["stabilizer-headroom"]
    assert family(base, effect).best.gain > 0.9 * (base.chi2 - base.freedom)


@pytest.mark.slow
def test_another_selection_costs_more_than_its_luck() -> None:
    penalty, gains = [], []
    for seed in range(60):
        base = healthy(seed)
        candidate = family(base, catalogue()["matrix-switching"]).best
        assert (candidate.form, candidate.fit.parameters) == ((), 0)
        assert bic(candidate) == pytest.approx(candidate.fit.chi2 + switching_penalty(base.problem))
        gains.append(candidate.gain)
        penalty.append(switching_penalty(base.problem))
    assert max(gains) < min(penalty)
    assert np.std(gains) < np.sqrt(12.0 * len(HOURS))
    assert np.mean(gains) == pytest.approx(0.0, abs=3.0)


@pytest.mark.parametrize(("gain", "parameters"), [(4.0, 1), (12.0, 1), (25.0, 3), (200.0, 6)])
def test_the_chance_of_a_gain_is_the_f_distribution_s(gain: float, parameters: int) -> None:
    error = PureError(squares=75.0, freedom=60)
    ratio = gain / parameters / (75.0 / 60.0)
    # Abramowitz & Stegun 26.6.2.
    exact = special.betainc(30.0, parameters / 2.0, 60.0 / (60.0 + parameters * ratio))
    assert error.p_of_gain(gain, parameters) == pytest.approx(exact)


def test_without_replicates_the_chance_is_that_of_chi_square() -> None:
    assert PureError(0.0, 0).p_of_gain(7.0, 2) == pytest.approx(np.exp(-3.5))
    assert PureError(17.0, 17).p_of_gain(7.0, 2) == pytest.approx(np.exp(-3.5))
    assert PureError(18.0, 18).p_of_gain(7.0, 2) > np.exp(-3.5)
    assert PureError(18.0, 18).p_of_gain(-1.0, 2) == 1.0


@pytest.mark.slow
def test_what_noise_leaves_of_healthy_displays_is_as_probable_as_it_should_be() -> None:
    chances = []
    for seed in range(60):
        base = healthy(seed)
        chances.append(PureError.of(base.problem).p_of_lack_of_fit(base))
    # The uncertainty of the noise from replicates is added: a gain may be slightly more probable, never less.
    assert stats.kstest(chances, "uniform", alternative="greater").pvalue > 0.01
    assert stats.kstest(chances, "uniform").pvalue > 0.001


def test_what_a_fault_leaves_is_improbable_until_it_is_added() -> None:
    truth, _ = TRUTHS["crosstalk"]
    patches = [each for hour in HOURS for each in session(hour)]
    readings = noisy(patches, display(HOURS), FAULTS["crosstalk"], truth, seed=2)
    problem = Problem.of(table(readings))
    error, term = PureError.of(problem), Term.at_rest(catalogue()["crosstalk"], ("new", "grown"))
    assert error.p_of_lack_of_fit(fit(problem)) < 1e-6
    assert error.p_of_lack_of_fit(fit(problem, (term,))) > 0.01


def test_an_exchange_ends_where_it_does_not_lower_bic(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two exchanges, each better before all forms are chosen again and none after it, would alternate forever."""
    base = campaign()
    black, gamma, crosstalk = (
        family(base, catalogue()[name]).best for name in ("black-level", "eotf-drift", "crosstalk")
    )

    def better(_base: Fit, _effects: list[Effect], limit: float) -> list[Family]:
        promising = replace(gamma, fit=replace(gamma.fit, chi2=limit - 100.0))
        return [Family(gamma.effect, promising, promising, 1)]

    monkeypatch.setattr(stepwise, "contenders", better)
    monkeypatch.setattr(stepwise, "refined", lambda chosen, _base: chosen)
    assert stepwise._exchanged([black, crosstalk], [gamma.effect], base) is None


def fitted_family(chi2: float, *, at_limit: bool = False) -> Any:
    """A family of its own effect that leaves ``chi2`` of 10 000 on 800 degrees of freedom."""
    fitted = SimpleNamespace(chi2=chi2, freedom=800)
    best = SimpleNamespace(fit=fitted, gain=10_000.0 - chi2, is_at_limit=at_limit, effect=object())
    return SimpleNamespace(best=best, effect=best.effect)


@pytest.mark.parametrize(("best", "rivals", "kept"), [
    (850.0, (1200.0, 1500.0, 1900.0), 2),  # half again the noise is no clear difference: up to 1800
    (1000.0, (1500.0, 2700.0, 2900.0), 2),  # ten times what the best leaves beyond noise: up to 2800
    (5000.0, (9000.0,), 1),  # no formula is exact
])  # fmt: skip
def test_of_effects_that_explain_nearly_all_those_that_leave_far_more_are_no_rivals(
    best: float, rivals: tuple[float, ...], kept: int
) -> None:
    families = [fitted_family(chi2) for chi2 in (best, *rivals)]
    assert near_the_best(families, cast("PureError", SimpleNamespace(scale=1.0))) == families[: 1 + kept]
    assert near_the_best([], cast("PureError", SimpleNamespace(scale=1.0))) == []


def test_an_effect_at_its_limit_gives_way_and_no_family_is_listed_twice() -> None:
    inside, other = fitted_family(100.0), fitted_family(400.0)
    at_limit = SimpleNamespace(gain=9900.0, is_at_limit=True, effect=inside.effect)
    assert inside_limits([cast("Candidate", at_limit)], [inside, other]) == [inside, other]
    outside = fitted_family(90.0, at_limit=True)
    at_limit = SimpleNamespace(gain=9910.0, is_at_limit=True, effect=outside.effect)
    assert inside_limits([cast("Candidate", at_limit)], [outside, inside]) == [inside, outside]
