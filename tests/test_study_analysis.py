"""The statistics of a reader study: the paper's printed figures, published examples, other libraries."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from math import comb, isnan, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.contingency_tables import mcnemar
from statsmodels.stats.inter_rater import cohens_kappa
from statsmodels.stats.meta_analysis import effectsize_smd
from statsmodels.stats.multitest import multipletests

from lutgen import LutgenError
from lutgen.study.analysis import analyse_answers, analyse_figures
from lutgen.study.answers import Answer
from lutgen.study.comparisons import further_agreement, further_means, holm, samples
from lutgen.study.statistics import (
    AgreementCounts,
    SampleFigures,
    StudySample,
    _gamma_ratio,
    cohen,
    condition_order,
    counts,
    equal_variances,
    hedges_g,
    kappas,
    mean_interval,
    newcombe,
    odds_ratio,
    pairs,
    pooled,
    sample_of,
    welch,
    wilson,
)
from lutgen.study.tables import answer_table, read_answer_table, read_counts, read_summary

pytestmark = pytest.mark.numbers

EXAMPLES = Path(__file__).parents[1] / "examples"
COUNTS, SUMMARY = EXAMPLES / "paper-study-counts.csv", EXAMPLES / "paper-study-summary.csv"


def paper() -> Any:
    return analyse_figures(read_counts(COUNTS)[1], read_summary(SUMMARY)[1])


def answer(
    image: str, condition: str, *, session: int = 1, positive: bool = True, reader: str = "A", **more: Any
) -> Answer:
    position = int("".join(filter(str.isdigit, image)) or 1)
    category = more.pop("category", "2+" if positive else "0")
    row = Answer(reader, session, position, image, condition, 40.0, 9, category, positive)
    return replace(row, **more)


# The paper ------------------------------------------------------------------------------------------------------------


def test_table_3_of_the_paper_comes_out_to_all_printed_digits() -> None:
    printed = [(f"{row.percent:.2f}", f"{row.ci95[0]:.1f}", f"{row.ci95[1]:.1f}") for row in paper().table3]
    assert printed == [("69.23", "53.6", "81.4"), ("52.50", "37.5", "67.1"), ("50.00", "35.2", "64.8")]


def test_table_4_of_the_paper_comes_out_to_all_printed_digits() -> None:
    p_values = {(test.greater, test.less): test.p for test in paper().table4}
    assert list(p_values) == [("none", "chroma"), ("none", "chroma-luma"), ("chroma", "chroma-luma")]
    assert [f"{p_values['none', 'chroma']:.4f}", f"{p_values['none', 'chroma-luma']:.4f}"] == ["0.0656", "0.0418"]
    assert f"{p_values['chroma', 'chroma-luma']:.3f}" == "0.413"


def test_table_4_s_equal_variances_pass_the_f_test_as_the_paper_says() -> None:
    assert min(test.variances_p for test in paper().table4) > 0.6


def test_table_2_of_the_paper_is_written_as_it_was_read() -> None:
    printed = [(mean.measure, mean.n, mean.mean, round(mean.ci95[1] - mean.mean, 9)) for mean in paper().table2.means]
    assert printed == [
        ("time", 39, 41.0, 5.4), ("time", 40, 50.1, 7.3), ("time", 40, 51.2, 6.4),
        ("ease", 39, 9.7, 0.2), ("ease", 40, 8.7, 0.5), ("ease", 40, 8.4, 0.4),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("measure", "second", "printed", "digits", "whole"),
    [
        ("time", "chroma", 0.054, 3, True),
        ("time", "chroma-luma", 0.02, 2, True),
        ("ease", "chroma", 0.0005, 4, False),
        ("ease", "chroma-luma", 2e-7, 7, False),
    ],
)
def test_table_2_s_p_values_are_those_printed_within_the_rounding_of_its_figures(
    measure: str, second: str, printed: float, digits: int, *, whole: bool
) -> None:
    p_values = {(test.measure, test.first, test.second): test.p for test in paper().table2.tests}
    p = p_values[measure, "none", second]
    assert p == pytest.approx(printed, rel=0.3)
    if whole:
        assert round(p, digits) == printed
    # The printed means and intervals are rounded to 0.1: p of all values that round to them includes the printed p.
    first, other = (one for one in read_summary(SUMMARY)[1] if (one.measure, one.condition) in
                    {(measure, "none"), (measure, second)})  # fmt: skip
    spanned = [
        float(pooled(_moved(first, a, b), _moved(other, c, d)).p) for a, b, c, d in product((-0.05, 0.05), repeat=4)
    ]
    assert min(spanned) < printed < max(spanned)


def _moved(one: StudySample, mean: float, half: float) -> StudySample:
    return replace(one, mean=one.mean + mean, sd=one.sd + half * sqrt(one.n) / 1.959964)


def test_only_two_sided_pooled_tests_of_normal_intervals_give_the_paper_s_p_values() -> None:
    normal = {one.condition: one for one in read_summary(SUMMARY)[1] if one.measure == "time"}
    student = {one.condition: one for one in read_summary(SUMMARY, ci="t")[1] if one.measure == "time"}
    assert round(float(pooled(normal["none"], normal["chroma"]).p), 3) == 0.054
    assert round(float(pooled(student["none"], student["chroma"]).p), 3) != 0.054
    assert round(float(welch(normal["none"], normal["chroma"]).p), 3) != 0.054
    assert round(float(pooled(normal["chroma"], normal["none"], one_tailed=True).p), 3) == 0.027


def test_the_paper_s_own_findings_beyond_it_hang_on_the_choice_of_test() -> None:
    analysis = paper()
    (limit,) = (sentence for sentence in analysis.limits if "depends on the choice of test" in sentence)
    assert "none against chroma-luma: p = 0.0418" in limit
    assert "0.065 by Fisher's exact test one-tailed and 0.11 two-tailed" in limit
    surviving = [(test.measure, test.second) for test in analysis.holm if test.p_holm < 0.05]
    assert surviving == [("ease", "chroma"), ("ease", "chroma-luma")]


# Against other libraries and published examples -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("first", "second"),
    [((39, 41.0, 17.2), (40, 50.1, 23.6)), ((5, 1.0, 0.1), (50, 0.5, 2.0)), ((2, 3.0, 1.0), (2, 3.0, 0.5))],
)
def test_t_tests_are_scipy_s(first: tuple[int, float, float], second: tuple[int, float, float]) -> None:
    figures = SampleFigures(*first), SampleFigures(*second)
    by_scipy = (*first[1:], first[0], *second[1:], second[0])
    t, p = stats.ttest_ind_from_stats(*by_scipy)
    assert pooled(*figures)[::2] == pytest.approx((t, p))
    assert pooled(*figures, one_tailed=True).p == pytest.approx(
        stats.ttest_ind_from_stats(*by_scipy, alternative="greater").pvalue
    )
    assert welch(*figures)[::2] == pytest.approx(stats.ttest_ind_from_stats(*by_scipy, equal_var=False))


def test_tests_of_many_studies_at_once_are_those_of_each() -> None:
    random = np.random.default_rng(1)
    first, second = random.normal(size=(7, 12)), random.normal(0.5, 2.0, size=(7, 15))
    figures = [SampleFigures(each.shape[1], each.mean(axis=1), each.std(axis=1, ddof=1)) for each in (first, second)]
    np.testing.assert_allclose(pooled(*figures).p, stats.ttest_ind(first, second, axis=1).pvalue)
    np.testing.assert_allclose(welch(*figures).p, stats.ttest_ind(first, second, axis=1, equal_var=False).pvalue)
    for row in range(7):
        ratio = first[row].var(ddof=1) / second[row].var(ddof=1)
        tail = stats.f(11, 14).cdf(ratio)
        assert equal_variances(*figures)[row] == pytest.approx(2 * min(tail, 1 - tail))


def test_p_of_equal_variances_is_never_above_1() -> None:
    n = np.arange(2, 200)
    assert equal_variances(SampleFigures(n, 0.5, 0.5), SampleFigures(n, 0.5, 0.5)).max() <= 1.0


def test_without_any_variance_there_is_no_test() -> None:
    assert isnan(float(pooled(SampleFigures(3, 1.0, 0.0), SampleFigures(3, 2.0, 0.0)).p))
    assert isnan(float(welch(SampleFigures(3, 1.0, 0.0), SampleFigures(3, 1.0, 0.0)).p))


@pytest.mark.parametrize(
    ("count", "n", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_s_intervals_are_those_published(count: int, n: int, low: float, high: float) -> None:
    """Newcombe 1998, Statistics in Medicine 17:857, Table I, method 3."""
    assert wilson(count, n) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(
    ("first", "second", "low", "high"),
    [
        ((56, 70), (48, 80), 0.0524, 0.3339),
        ((9, 10), (3, 10), 0.1705, 0.8090),
        ((6, 7), (2, 7), 0.0582, 0.8062),
        ((5, 56), (0, 29), -0.0381, 0.1926),
        ((0, 10), (0, 20), -0.1611, 0.2775),
        ((10, 10), (0, 20), 0.6791, 1.0),
    ],
)
def test_newcombe_s_intervals_are_those_published(
    first: tuple[int, int], second: tuple[int, int], low: float, high: float
) -> None:
    """Newcombe 1998, Statistics in Medicine 17:873, Table II, method 10."""
    assert newcombe(first, second) == pytest.approx((low, high), abs=5e-5)


def test_fisher_and_odds_are_those_of_r_s_tea_tasting_example() -> None:
    guessed, missed = AgreementCounts("milk", 3, 1), AgreementCounts("tea", 1, 3)
    (agreement,) = further_agreement((guessed, missed))
    assert (agreement.fisher_one_tailed, agreement.fisher) == pytest.approx((0.2429, 0.4857), abs=5e-5)
    odds, ends = odds_ratio(missed, guessed)
    assert odds == pytest.approx(6.408309, abs=1e-4)
    # R prints 0.2117329 and 621.9337505, within the tolerance of its root. At the ends exactly 2.5 % lie beyond 3 of 4.
    assert ends == pytest.approx((0.2117329, 621.9337505), rel=0.01)
    for end, tail in zip(ends, (range(3, 5), range(4)), strict=True):
        weight = [comb(4, k) ** 2 * end**k for k in range(5)]
        assert sum(weight[k] for k in tail) / sum(weight) == pytest.approx(0.025, rel=1e-6)
    assert agreement.odds_ratio == pytest.approx(1 / 6.408309, abs=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_kappa_and_its_error_are_statsmodels_s(seed: int) -> None:
    table = np.random.default_rng(seed).integers(0, 20, (4, 4)).astype(float)
    expected = cohens_kappa(table)
    assert cohen(table) == pytest.approx((expected.kappa, expected.std_kappa))


def test_one_pair_has_no_kappa() -> None:
    assert np.isnan(cohen(np.array([[0.0, 1.0], [0.0, 0.0]]))).all()


def test_kappa_is_none_where_all_gave_one_answer() -> None:
    tables = pairs([answer("i1", "none"), answer("i1", "none", session=2)])
    assert [isnan(row.kappa) for row in kappas(["none"], tables)] == [True, True]


def test_holm_is_statsmodels_s() -> None:
    p = list(np.random.default_rng(2).uniform(0, 0.2, 9))
    assert holm(p) == pytest.approx(list(multipletests(p, method="holm")[1]))
    assert holm([]) == []


def test_hedges_g_is_that_of_tables_and_of_statsmodels() -> None:
    # Hedges 1981: c(2) = 1/√π, and c grows to 1.
    assert _gamma_ratio(2) == pytest.approx(1 / sqrt(pi))
    assert _gamma_ratio(1000) == pytest.approx(1 - 3 / 3999, abs=1e-6)
    first, second = StudySample("ease", "a", 39, 9.7, 0.64), StudySample("ease", "b", 40, 8.4, 1.29)
    g, (low, high) = hedges_g(first, second)
    expected, variance = effectsize_smd(8.4, 1.29, 40, 9.7, 0.64, 39)
    assert g == pytest.approx(float(expected), rel=1e-4)
    assert (high - low) / 2 == pytest.approx(1.96 * float(variance) ** 0.5, rel=0.01)


def test_means_once_more_are_scipy_s() -> None:
    random = np.random.default_rng(3)
    values = [np.round(random.normal(mean, sd, 30)) for mean, sd in ((9, 1), (8, 2))]
    first, second = (sample_of("ease", name, list(each)) for name, each in zip("ab", values, strict=True))
    (means,) = further_means((first, second))
    assert means.welch_p == pytest.approx(stats.ttest_ind(*values, equal_var=False).pvalue)
    interval = stats.ttest_ind(values[1], values[0], equal_var=False).confidence_interval(0.95)
    assert means.difference_ci95 == pytest.approx(tuple(interval))
    assert means.rank_p == pytest.approx(stats.mannwhitneyu(*values).pvalue)
    few = [[3.1, 4.2, 5.9, 2.0], [7.0, 6.5, 9.4, 8.8]]
    (of_few,) = further_means([sample_of("time", name, each) for name, each in zip("ab", few, strict=True)])
    # By hand: of the 70 ways to share 8 ranks, 2 put one whole sample above the other.
    assert of_few.rank_p == pytest.approx(2 / 70)
    assert mean_interval(first, "t") == pytest.approx(stats.t.interval(0.95, 29, first.mean, first.sd / sqrt(30)))


# Agreement of a reader with earlier answers ---------------------------------------------------------------------------


def test_the_paper_s_design_pairs_session_1_with_session_2() -> None:
    answers = [
        answer("i1", "none"), answer("i2", "chroma"), answer("i3", "chroma", positive=False),
        answer("i1", "none", session=2, positive=False), answer("i2", "none", session=2),
        answer("i3", "none", session=2),
    ]  # fmt: skip
    tables = pairs(answers)
    assert [(pair.answer.image, pair.answer.session, pair.reference.session) for pair in tables] == [
        ("i1", 1, 2), ("i2", 1, 2), ("i3", 1, 2),
    ]  # fmt: skip
    assert counts(["none", "chroma"], tables) == (AgreementCounts("none", 0, 1), AgreementCounts("chroma", 1, 1))


@pytest.mark.parametrize(
    ("answers", "expected"),
    [
        # Without an un-aged reading there is no comparison. A single un-aged reading cannot be compared with itself.
        ([("i1", "chroma", 1)], []),
        ([("i1", "none", 1)], []),
        # An un-aged session before the aged one.
        ([("i1", "none", 1), ("i1", "chroma", 2)], [("chroma", 2, 1)]),
        # A session without aged images is the reference, even if another session follows.
        (
            [("i1", "chroma", 1), ("i1", "none", 2), ("i1", "none", 3), ("i2", "chroma", 3)],
            [("chroma", 1, 2), ("none", 3, 2)],
        ),
        # Without such a session the last un-aged reading is the reference.
        (
            [("i1", "none", 1), ("i9", "chroma", 1), ("i1", "chroma", 2), ("i1", "none", 3), ("i9", "chroma", 3)],
            [("none", 1, 3), ("chroma", 2, 3)],
        ),
        # Three un-aged readings give one pair, two aged readings give two.
        ([("i1", "none", 1), ("i1", "none", 2), ("i1", "none", 3)], [("none", 1, 3)]),
        ([("i1", "chroma", 1), ("i1", "chroma", 2), ("i1", "none", 3)], [("chroma", 1, 3), ("chroma", 2, 3)]),
    ],
)
def test_references_are_chosen_by_the_rule(
    answers: list[tuple[str, str, int]], expected: list[tuple[str, int, int]]
) -> None:
    tables = pairs([answer(image, condition, session=session) for image, condition, session in answers])
    assert [(pair.answer.condition, pair.answer.session, pair.reference.session) for pair in tables] == expected


def test_readers_are_only_held_against_themselves() -> None:
    answers = [answer("i1", "chroma"), answer("i1", "none", session=2, reader="B")]
    assert pairs(answers) == ()


def test_sides_are_counted_and_categories_beside_them() -> None:
    answers = [answer("i1", "chroma", category="2+"), answer("i1", "none", session=2, category="3+")]
    (pair,) = pairs(answers)
    assert pair.agreed
    assert {row.of: row.percent for row in kappas(["chroma"], [pair])} == {"side": 100.0, "category": 0.0}


def test_time_and_ease_are_those_of_sessions_with_anything_aged() -> None:
    answers = [
        answer("i1", "none", seconds=10.0), answer("i2", "chroma", seconds=30.0),
        answer("i1", "none", session=2, seconds=99.0), answer("i2", "none", session=2, seconds=99.0),
    ]  # fmt: skip
    means = {one.condition: one.mean for one in samples(["none", "chroma"], answers) if one.measure == "time"}
    assert means == {"none": 10.0, "chroma": 30.0}


def test_mcnemar_is_statsmodels_s_on_images_read_under_both_conditions() -> None:
    random = np.random.default_rng(4)
    answers = []
    for number in range(40):
        name = f"i{number}"
        answers += [
            answer(name, "chroma@5000", session=1, positive=bool(random.random() < 0.9)),
            answer(name, "chroma@18000", session=2, positive=bool(random.random() < 0.6)),
            answer(name, "none", session=3),
        ]
    order = condition_order(answers)
    assert order == ("none", "chroma@5000", "chroma@18000")
    tables = pairs(answers)
    (tested,) = further_agreement(counts(order, tables), tables)
    assert tested.mcnemar is not None
    assert tested.mcnemar.pairs == 40
    only = [[0, tested.mcnemar.first_only], [tested.mcnemar.second_only, 0]]
    assert tested.mcnemar.p == pytest.approx(float(mcnemar(only, exact=True).pvalue))
    sides = {pair.answer.image: {} for pair in tables}  # type: dict[str, dict[str, bool]]
    for pair in tables:
        sides[pair.answer.image][pair.answer.condition] = pair.agreed
    assert tested.mcnemar.first_only == sum(each["chroma@5000"] and not each["chroma@18000"] for each in sides.values())


# The whole analysis ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "answers",
    [
        [answer("i1", "none")],
        [answer("i1", "chroma"), answer("i2", "chroma")],
        [answer("i1", "none"), answer("i1", "none", session=2), answer("i2", "chroma")],
        [answer(f"i{n}", "none" if n % 2 else "chroma", session=s) for n in range(6) for s in (1, 2)],
        [answer(f"i{n}", "none" if n % 2 or s == 2 else "chroma", session=s) for n in range(6) for s in (1, 2)],
    ],
    ids=["one answer", "never un-aged", "three answers", "never the same", "all agree"],
)
def test_poor_data_give_dashes_and_sentences_not_errors(answers: list[Answer]) -> None:
    analysis = analyse_answers(answers)
    assert all("not fitted" in model.notes[0] for model in analysis.mixed if not model.effects)
    assert analysis.limits
    assert not re.search(r"\d{3} percentage points|\b1 pairs", " ".join(analysis.limits))
    assert all(isnan(test.t) == isnan(test.p) for test in analysis.table2.tests)


def test_an_analysis_of_answers_says_what_its_design_cannot_show() -> None:
    paper_like = [answer(f"i{n}", ("none", "chroma")[n % 2], positive=n % 3 > 0) for n in range(20)]
    paper_like += [answer(f"i{n}", "none", session=2, positive=n % 4 > 0) for n in range(20)]
    sentences = " ".join(analyse_answers(paper_like).limits)
    for part in ("One reader", "read under one condition", "always read after", "not with the truth"):
        assert part in sentences
    several = [replace(each, reader=name) for name in "AB" for each in paper_like]
    crossed = [answer(f"i{n}", name, session=s) for n in range(4) for s, name in ((1, "none"), (2, "chroma"))]
    crossed += [answer(f"i{n}", name, session=s) for n in range(4, 8) for s, name in ((2, "none"), (1, "chroma"))]
    sentences = " ".join(analyse_answers(several).limits)
    for part in ("2 readers", "each image was read under one condition"):
        assert part in sentences
    moved_on = {"none": "chroma", "chroma": "none"}
    square = [replace(each, reader="B", condition=moved_on[each.condition]) for each in paper_like[:20]]
    sentences = " ".join(analyse_answers([*paper_like, *square]).limits)
    assert "each reader read an image under one condition, and other readers read the image under other" in sentences
    assert "each image was read" not in sentences
    sentences = " ".join(analyse_answers(crossed).limits)
    assert "the same images under several conditions" in sentences
    assert "always read" not in sentences


@pytest.mark.parametrize(
    ("counts_", "message"),
    [
        ((20, 0), "With 20 pairs a condition, a fall of agreement from 100 % by less than about 20 percentage points"),
        ((27, 12), "With 39 pairs a condition, a fall of agreement from 69 % by less than about 28 percentage points"),
        ((2, 2), "With 4 pairs a condition, the one-tailed test misses even a fall of agreement to 0 % more often"),
        ((1, 0), ""),
        ((0, 9), ""),
    ],
)
def test_the_smallest_fall_that_is_found_is_that_of_simulated_studies(counts_: tuple[int, int], message: str) -> None:
    rows = [AgreementCounts("none", *counts_), AgreementCounts("chroma", *counts_)]
    sentences = [each for each in analyse_figures(rows, ()).limits if "pairs a condition" in each]
    assert [each.startswith(message) for each in sentences] == [True] * bool(message)
    if match := re.search(r"about (\d+) perc", message):
        n, share = sum(counts_), counts_[0] / sum(counts_)
        random = np.random.default_rng(1)
        first, second = (random.binomial(n, chance, 20_000) for chance in (share, share - int(match[1]) / 100))
        error = np.sqrt((first * (n - first) + second * (n - second)) / n / (2 * n - 2) * 2 / n)
        rejections = (first - second) / n > np.maximum(stats.t.isf(0.05, 2 * n - 2) * error, 0)
        assert np.mean(rejections) == pytest.approx(0.8, abs=0.03)


# Tables that users bring ----------------------------------------------------------------------------------------------


def test_answers_come_back_from_their_table(tmp_path: Path) -> None:
    answers = (answer("i1", "none", reader='Dr "A", B'), answer("i1", "none", session=2, positive=False))
    file = tmp_path / "a.csv"
    file.write_text(answer_table(answers, remark="SIMULATED"), encoding="utf-8")
    assert read_answer_table(file) == ("SIMULATED", answers)


HEAD = "reader,session,position,image,condition,seconds,ease,category,positive\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no rows"),
        (HEAD, "no rows"),
        ("reader,session\nA,1\n", "line 1: the header is reader,session; it must be reader,session,position"),
        (f"{HEAD}A,1,1,i1,none,40.0,9,0\n", "line 2: 8 cells for 9 columns"),
        (f"# made up\n\n{HEAD}A,one,1,i1,none,40.0,9,0,0\n", "line 4, column session: 'one' is no whole number in 1.."),
        (f"{HEAD}A,1,1,i1,none,0,9,0,0\n", "column seconds: '0' is no number above 0"),
        (f"{HEAD}A,1,1,i1,none,nan,9,0,0\n", "column seconds: 'nan' is no number"),
        (f"{HEAD}A,1,1,i1,none,1e400,9,0,0\n", "column seconds"),
        (f"{HEAD}A,1,1,i1,none,40,9.5,0,0\n", "column ease: '9.5' is no whole number"),
        (f"{HEAD}A,1,1,i1,none,40,9,0,maybe\n", "column positive: 'maybe' is neither yes nor no"),
        (f"{HEAD},1,1,i1,none,40,9,0,0\n", "column reader: '' is no name"),
        (
            f"{HEAD}A,1,1,i1,none,40,9,0,0\nA,1,2,i1,none,40,9,0,0\n",
            "line 3, column image: 'i1' was answered in line 2",
        ),
        (f"{HEAD}A,1,1,i1,none,40,9,0,0\nA,1,2,i2,none,40,9,0,1\n", "line 3, column positive: '1' contradicts line 2"),
        (f'{HEAD}A,1,1,"i1,none,40,9,0,0\n', "line 2: is no CSV"),
    ],
)
def test_bad_answers_are_refused_by_line_and_column(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(LutgenError) as refused:
        read_answer_table(file)
    assert message in str(refused.value)
    assert str(refused.value).startswith(str(file))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("condition,agreed,disagreed\nnone,27,-1\n", "line 2, column disagreed: '-1' is no whole number"),
        ("condition,agreed,disagreed\nnone,0,0\n", "nothing was compared"),
        ("condition,agreed,disagreed\nnone,1,2\nnone,1,2\n", "line 3, column condition: 'none' appears twice. Keep"),
        ("condition,agreed,disagreed\nnone,99999999999,2\n", "is no whole number"),
        ("condition,agreed,disagreed\nnone,10000,10001\n", "column disagreed: '10001' is no whole number in 0..10000"),
    ],
)
def test_bad_counts_are_refused(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "c.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(LutgenError) as refused:
        read_counts(file)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("none,speed,39,41.0,5.4", "line 2, column measure: unknown measure 'speed'. Pick one of: time, ease."),
        ("none,time,1,41.0,5.4", "column n: '1' is no whole number in 2.."),
        ("none,time,39,41.0,-5", "column ci95: '-5' is no number of at least 0"),
        ("none,time,39,41;0,5", "column mean: '41;0' is no number"),
        ("none,time,39,41,5\nnone,time,39,41,5", "line 3, column condition: 'none' appears twice for time."),
    ],
)
def test_bad_summaries_are_refused(rows: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "s.csv"
    file.write_text(f"condition,measure,n,mean,ci95\n{rows}\n", encoding="utf-8")
    with pytest.raises(LutgenError) as refused:
        read_summary(file)
    assert message in str(refused.value)


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    for path, message in (
        (tmp_path / "none.csv", "cannot read"),
        (tmp_path, "cannot read"),
        (tmp_path / "b.csv", "UTF-8"),
    ):
        with pytest.raises(LutgenError, match=message):
            read_counts(path)


def test_intervals_of_an_unknown_kind_and_remarks_of_two_lines_are_refused() -> None:
    with pytest.raises(LutgenError, match=r"unknown interval 'z'. Pick one of: normal, t\."):
        analyse_figures((), read_summary(SUMMARY)[1], ci="z")
    with pytest.raises(LutgenError, match="one line"):
        answer_table((), remark="two\nlines")
