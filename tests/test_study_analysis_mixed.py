"""The mixed models: a published example, a closed form, and the message of a model without an answer."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.stats import binom

from lutgen.study import analysis, mixed
from lutgen.study.analysis import analyse_answers
from lutgen.study.mixed import MixedModel, fit_crossed, mixed_models
from lutgen.study.simulated import PAPER_DIFFERENCES, SimulatedReader, simulate
from lutgen.study.statistics import condition_order, pairs
from tests import study_level
from tests.studies import paper_trials

if TYPE_CHECKING:
    from lutgen.study.answers import Answer

pytestmark = pytest.mark.numbers

#: Yield of dyestuff, five preparations from each of six batches: Davies & Goldsmith 1972, Statistical Methods in
#: Research and Production, section 6.4.
DYESTUFF = (
    (1545, 1440, 1440, 1520, 1580), (1540, 1555, 1490, 1560, 1495), (1595, 1550, 1605, 1510, 1560),
    (1445, 1440, 1595, 1465, 1545), (1595, 1630, 1515, 1635, 1625), (1520, 1455, 1450, 1480, 1445),
)  # fmt: skip


def answers(seed: int, *, readers: int = 1, per_condition: int = 40) -> tuple[Answer, ...]:
    trials = paper_trials(seed, per_condition=per_condition, readers=readers)
    differences = {(trial.image, trial.condition): PAPER_DIFFERENCES[trial.condition] for trial in trials}
    return simulate(trials, differences, SimulatedReader(seed=seed))


def models(given: tuple[Answer, ...]) -> dict[str, MixedModel]:
    return {model.measure: model for model in mixed_models(condition_order(given), given, pairs(given))}


def test_the_dyestuff_example_gives_the_published_estimates() -> None:
    """The values in lme4's documentation: lmer(Yield ~ 1 + (1 | Batch)), REML."""
    values = np.array(DYESTUFF, np.float64).ravel()
    fit = fit_crossed(values, np.ones((30, 1)), {"batch": [f"b{place // 5}" for place in range(30)]})
    assert fit.coefficients[0] == pytest.approx(1527.5, abs=0.05)
    assert fit.errors[0] == pytest.approx(19.38, abs=0.005)
    assert fit.variances["batch"] == pytest.approx(1764.05, rel=1e-3)
    assert fit.variances["rest"] == pytest.approx(2451.25, rel=1e-3)


def test_balanced_crossed_groups_give_the_analysis_of_variance() -> None:
    """Every reader reads every image once: REML then has a closed form by mean squares."""
    random = np.random.default_rng(7)
    readers, images = 6, 25
    table = random.normal(0, 2, (readers, 1)) + random.normal(0, 1, (1, images)) + random.normal(0, 0.7, (6, 25))
    whole, rows, columns = table.mean(), table.mean(axis=1), table.mean(axis=0)
    of_rows = images * ((rows - whole) ** 2).sum() / (readers - 1)
    of_columns = readers * ((columns - whole) ** 2).sum() / (images - 1)
    residual = table - rows[:, np.newaxis] - columns[np.newaxis, :] + whole
    rest = (residual**2).sum() / ((readers - 1) * (images - 1))
    labels = {"readers": [f"r{place // images}" for place in range(150)],
              "images": [f"i{place % images}" for place in range(150)]}  # fmt: skip
    fit = fit_crossed(table.ravel(), np.ones((150, 1)), labels)
    assert fit.variances["rest"] == pytest.approx(rest, rel=1e-3)
    assert fit.variances["readers"] == pytest.approx((of_rows - rest) / images, rel=1e-3)
    assert fit.variances["images"] == pytest.approx((of_columns - rest) / readers, rel=1e-3)
    expected = ((of_rows + of_columns - rest) / (readers * images)) ** 0.5
    assert fit.errors[0] == pytest.approx(expected, rel=1e-3)


def test_agreement_of_one_reader_is_a_logistic_regression_whose_estimates_are_odds_ratios() -> None:
    from statsmodels.genmod.families import Binomial
    from statsmodels.genmod.generalized_linear_model import GLM

    readings = answers(3)
    model = models(readings)["agreement"]
    rows = {row.condition: row for row in analyse_answers(readings).table3}
    odds = {name: row.agreed / row.disagreed for name, row in rows.items()}
    for effect in model.effects:
        assert effect.estimate == pytest.approx(odds[effect.condition] / odds["none"], rel=1e-6)
    # With one pair per image there are no clusters: the model's own errors are near the errors of the clusters.
    shown = pairs(readings)
    under = [pair.answer.condition for pair in shown]
    fixed = np.column_stack([np.ones(len(shown)), *([each == name for each in under] for name in list(rows)[1:])])
    plain = GLM([float(pair.agreed) for pair in shown], fixed, family=Binomial()).fit()
    widths = [np.log(effect.ci95[1] / effect.ci95[0]) / 2 / 1.96 for effect in model.effects]
    assert widths == pytest.approx(list(plain.bse[1:]), rel=1e-3)


@pytest.mark.slow
def test_planted_effects_lie_in_the_intervals_and_spreads_near_what_was_planted() -> None:
    reader = SimulatedReader()
    model = models(answers(1, readers=5))["time"]
    assert (model.n, model.notes) == (1200, ())
    for effect in model.effects:
        planted = np.exp(reader.slowdown * reader.disturbance(PAPER_DIFFERENCES[effect.condition]))
        assert effect.ci95[0] < planted < effect.ci95[1]
    assert model.sd["images"] == pytest.approx(reader.spread_images, rel=0.25)
    assert model.sd["rest"] == pytest.approx(reader.spread, rel=0.1)
    assert 0.05 < model.sd["readers"] < 0.5


def test_a_variance_of_nothing_is_found_to_be_0_and_said() -> None:
    """Gradient methods fail here: readers are equal, and ease is cut at the end of its scale."""
    trials = paper_trials(1, per_condition=40, readers=3)
    differences = {(trial.image, trial.condition): PAPER_DIFFERENCES[trial.condition] for trial in trials}
    model = models(simulate(trials, differences, SimulatedReader(seed=1)))["ease"]
    assert model.sd["readers"] < 0.05
    assert any("boundary" in note for note in model.notes)
    assert not any("did not converge" in note for note in model.notes)
    assert model.effects[1].estimate == pytest.approx(-1.3, abs=0.3)


def test_one_reader_and_images_read_once_are_left_out_and_said() -> None:
    once = tuple(answer for answer in answers(2) if answer.session == 1)
    model = models(once)["time"]
    assert model.notes == (
        "one reader: no differences between readers in the model",
        "each image was read once: no differences between images in the model",
    )
    assert list(model.sd) == ["rest"]
    assert len(model.effects) == 2
    agreement = models(once)["agreement"]
    assert agreement.notes == ("not fitted: fewer than two conditions have pairs of readings",)


def test_ease_at_the_end_of_its_scale_is_said() -> None:
    assert "the errors are not normal" in models(answers(2))["ease"].notes[-1]


def test_conditions_that_are_sessions_cannot_be_told_apart() -> None:
    whole = tuple(answer for answer in answers(2) if (answer.session == 2) == (answer.condition == "none"))
    two = tuple(answer for answer in whole if answer.condition != "chroma")
    assert models(two)["time"].notes == ("not fitted: the effects of conditions and of sessions cannot be separated",)


def test_readers_who_read_one_condition_each_cannot_be_told_from_it() -> None:
    kept = {1: "none", 2: "chroma"}
    readings = tuple(
        answer
        for answer in answers(2, readers=2)
        if answer.session == 2 or answer.condition == kept[int(answer.reader.split()[-1])]
    )
    assert models(readings)["agreement"].notes == (
        "not fitted: the effects of conditions and of readers cannot be separated",
    )


def test_a_ratio_beyond_what_a_float_holds_is_infinite() -> None:
    assert mixed._ratio(701.0) == float("inf")
    assert mixed._ratio(0.0) == 1.0


def test_a_fit_that_does_not_converge_or_warns_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    from statsmodels.tools.sm_exceptions import ConvergenceWarning

    class Stuck:
        converged = False
        bse = (1.0,)

    def stuck() -> Any:
        for _ in range(2):
            warnings.warn("Gradient optimization failed.\nTry again", ConvergenceWarning, stacklevel=1)
        return Stuck()

    _, errors, warning = mixed._fitted(stuck)
    assert errors.tolist() == [1.0]
    assert warning == ("statsmodels: Gradient optimization failed", "the fit did not converge: do not rely on it")

    def impossible(*_: object) -> None:
        raise np.linalg.LinAlgError("singular matrix")

    monkeypatch.setattr(mixed, "fit_crossed", impossible)
    assert models(answers(2))["time"].notes == ("not fitted: the fit failed (singular matrix)",)


def test_without_statsmodels_the_rest_is_found_and_what_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    readings = answers(2)
    whole = analyse_answers(readings)
    monkeypatch.setattr(analysis, "available", lambda: False)
    result = analyse_answers(readings)
    assert result.mixed == ()
    assert result.remarks == ("Mixed models are left out: statsmodels is not installed. Install lutgen[study].",)
    assert (result.table2, result.kappas, result.holm) == (whole.table2, whole.kappas, whole.holm)


# Degrees of freedom ---------------------------------------------------------------------------------------------------


def test_batches_leave_as_many_degrees_of_freedom_as_there_are_batches_less_one() -> None:
    """The groups are balanced: the mean's variance is one mean square, and Satterthwaite's method is exact."""
    values = np.array(DYESTUFF, np.float64).ravel()
    fit = fit_crossed(values, np.ones((30, 1)), {"batch": [f"b{place // 5}" for place in range(30)]})
    assert fit.freedom == pytest.approx([5.0], rel=1e-3)


def test_readers_under_conditions_leave_those_of_their_interaction() -> None:
    """R readers, C conditions, n images each: the t-test on the readers' own differences has (R − 1)(C − 1)."""
    random = np.random.default_rng(11)
    readers, conditions, images = 4, 3, 10
    ways = random.normal(0.0, 1.0, (readers, conditions, 1))
    table = random.normal(0.0, 2.0, (readers, 1, 1)) + ways + random.normal(0.0, 0.5, (readers, conditions, images))
    reader, condition, _ = (each.ravel() for each in np.indices(table.shape))
    fixed = np.column_stack([np.ones(table.size), condition == 1, condition == 2]).astype(np.float64)
    groups = {"readers": [f"r{each}" for each in reader],
              "own": [f"{one} {other}" for one, other in zip(reader, condition, strict=True)]}  # fmt: skip
    fit = fit_crossed(table.ravel(), fixed, groups)
    assert fit.freedom[1:] == pytest.approx([6.0, 6.0], rel=1e-3)
    means = table.mean(axis=2)
    residual = means - means.mean(axis=1, keepdims=True) - means.mean(axis=0) + means.mean()
    error = (2.0 * (residual**2).sum() / 6.0 / readers) ** 0.5
    assert fit.errors[1:] == pytest.approx([error, error], rel=1e-3)


def test_readers_who_react_in_ways_of_their_own_make_intervals_wide() -> None:
    readings = study_level.study(3, 4, 0.3, 10)
    model = models(readings)["time"]
    assert model.sd["readers_by_condition"] == pytest.approx(0.3, rel=0.6)
    alike = models(study_level.study(3, 4, 0.0, 10))["time"]
    assert alike.sd["readers_by_condition"] < 0.1
    widths = [np.log(each.effects[0].ci95[1] / each.effects[0].ci95[0]) for each in (model, alike)]
    assert widths[0] > 2.0 * widths[1]


@pytest.mark.slow
def test_conditions_that_readers_take_each_in_their_own_way_are_no_finding() -> None:
    """A model without readers under conditions reports an effect of a condition in many such studies."""
    significant = np.array([study_level.ways_apart(study_level.study(seed, 5, 0.3, 8)) for seed in range(30)]) < 0.05
    by_model, by_plain = significant.sum(axis=0)
    assert by_model <= binom.ppf(0.99, 30, 0.05)
    assert by_plain > binom.ppf(0.9999, 30, 0.05)
