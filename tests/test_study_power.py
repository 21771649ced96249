"""Power against simulation, statsmodels, scipy's Fisher test and the paper's p-values; and the command."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image
from scipy import stats
from statsmodels.stats.power import TTestIndPower

from lutgen import LutgenError
from lutgen.study.power import (
    AGREED,
    ANSWERS,
    FISHER,
    MOST,
    ONE_TAILED,
    PAIRS,
    REJECTS,
    TARGET,
    TESTS,
    TWO_SIDED,
    agreement_power,
    answers_needed,
    paper_values,
    power_of,
    standard_deviation,
    study_power,
    t_power,
)
from tests.command import Done, in_process, words
from tests.quick import mostly_slow
from tests.schemas import validator

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.numbers

#: Simulated studies: the standard error of a power is at most 0.5/√20000 = 0.0035. The tolerance is four of these.
STUDIES, AWAY = 20_000, 0.015


# The paper's numbers --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("measure", "pair", "published"),
    [
        ("ease", ("none", "chroma"), 0.0005),
        ("ease", ("none", "chroma-luma"), 2e-7),
        ("time", ("none", "chroma"), 0.054),
        ("time", ("none", "chroma-luma"), 0.02),
    ],
)
def test_the_standard_deviations_give_the_papers_p_values(
    measure: str, pair: tuple[str, str], published: float
) -> None:
    values, sd = paper_values(measure, *pair)
    n, m = (ANSWERS[name] for name in pair)
    assert sd is not None
    p = stats.ttest_ind_from_stats(values[0], sd, n, values[1], sd, m).pvalue
    # Means and intervals are printed to one decimal: for ease, with its ± 0.2, this rounding is a quarter of p.
    assert p == pytest.approx(published, rel=0.3 if measure == "ease" else 0.02)


def test_the_test_on_agreement_rejects_what_table_4_rejects() -> None:
    # One-tailed p: 0.0656, 0.0418, 0.413.
    for (first, second), rejection in zip(PAIRS, (False, True, False), strict=True):
        counts = np.array([AGREED[first]]), np.array([AGREED[second]])
        assert bool(REJECTS[ONE_TAILED](*counts, (ANSWERS[first], ANSWERS[second]))[0]) is rejection


def test_power_at_what_the_paper_saw_is_told_honestly() -> None:
    power = {(each.measure, each.test, each.between): each for each in study_power(40).seen}
    agreement = power["agreement", ONE_TAILED, ("none", "chroma")]
    assert agreement.paper < 0.5
    assert agreement.needed is not None
    assert agreement.needed > 100
    assert power["ease", TWO_SIDED, ("none", "chroma-luma")].paper > 0.99
    assert power["time", TWO_SIDED, ("chroma", "chroma-luma")].needed is None
    # A result at p = 0.05 exactly has a power of about a half. Time none–chroma has p = 0.054.
    assert power["time", TWO_SIDED, ("none", "chroma")].paper == pytest.approx(0.49, abs=0.02)


# Against other implementations ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("tails", [1, 2])
@pytest.mark.parametrize("answers", [(2, 2), (5, 9), (39, 40), (400, 400)])
@pytest.mark.parametrize("effect", [0.0, 0.1, 0.5, 1.2])
def test_power_of_t_is_statsmodels(effect: float, answers: tuple[int, int], tails: int) -> None:
    side = "two-sided" if tails == 2 else "larger"
    expected = TTestIndPower().power(effect, answers[0], 0.05, ratio=answers[1] / answers[0], alternative=side)
    assert t_power(7.0 * effect, 7.0, answers, tails=tails) == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize(
    ("difference", "sd", "answers", "tails"),
    [(9.1, 20.0, (39, 40), 2), (-0.3, 1.4, (30, 60), 1), (1.0, 1.0, (4, 4), 2), (0.0, 3.0, (10, 12), 2)],
)
def test_power_of_t_is_what_simulated_studies_find(
    difference: float, sd: float, answers: tuple[int, int], tails: int
) -> None:
    rng = np.random.default_rng(2015)
    first = rng.normal(0.0, sd, (STUDIES, answers[0]))
    second = rng.normal(abs(difference), sd, (STUDIES, answers[1]))
    side = "two-sided" if tails == 2 else "greater"
    share = (stats.ttest_ind(second, first, axis=1, alternative=side).pvalue < 0.05).mean()
    assert t_power(difference, sd, answers, tails=tails) == pytest.approx(share, abs=AWAY)


@pytest.mark.parametrize(
    ("shares", "answers"), [((27 / 39, 0.525), (39, 40)), ((0.9, 0.6), (20, 25)), ((0.5, 0.5), (40, 40))]
)
def test_power_on_agreement_is_what_simulated_studies_find(
    shares: tuple[float, float], answers: tuple[int, int]
) -> None:
    rng = np.random.default_rng(18)
    agreed = [rng.random((STUDIES, of)) < share for share, of in zip(shares, answers, strict=True)]
    t_share = (t_p(*agreed) < 0.05).mean()
    assert agreement_power(shares, answers, test=ONE_TAILED) == pytest.approx(t_share, abs=AWAY)
    tables = np.stack([each.sum(axis=1) for each in agreed], axis=1)
    different, counts = np.unique(tables, axis=0, return_counts=True)
    p = [fisher_p(int(a), int(b), answers) for a, b in different]
    assert agreement_power(shares, answers, test=FISHER) == pytest.approx(
        counts[np.array(p) <= 0.05].sum() / STUDIES, abs=AWAY
    )


def t_p(first: Any, second: Any) -> Any:
    """One-tailed p of scipy's t on 0/1 values. If no value varies: 0 if the means differ, else NaN."""
    each = [(values.mean(axis=-1), values.std(axis=-1, ddof=1), values.shape[-1]) for values in (first, second)]
    with np.errstate(divide="ignore", invalid="ignore"):
        return stats.ttest_ind_from_stats(*each[0], *each[1], alternative="greater").pvalue


def fisher_p(first: int, second: int, answers: tuple[int, int]) -> float:
    rows = [[first, answers[0] - first], [second, answers[1] - second]]
    return float(stats.fisher_exact(rows, alternative="greater").pvalue)


@pytest.mark.parametrize("answers", [(2, 2), (7, 4), (12, 15)])
def test_both_tests_on_counts_reject_what_scipys_do_for_every_outcome(answers: tuple[int, int]) -> None:
    n, m = answers
    first, second = np.arange(n + 1)[:, np.newaxis], np.arange(m + 1)[np.newaxis, :]
    fisher, t = (REJECTS[test](first, second, answers) for test in (FISHER, ONE_TAILED))
    for a in range(n + 1):
        for b in range(m + 1):
            assert fisher[a, b] == (fisher_p(a, b, answers) <= 0.05)
            assert t[a, b] == (t_p(np.arange(n) < a, np.arange(m) < b) < 0.05)


def test_what_is_not_summed_does_not_matter() -> None:
    shares, answers = (0.7, 0.55), (300, 280)
    chances = [stats.binom.pmf(np.arange(of + 1), of, share) for share, of in zip(shares, answers, strict=True)]
    for test, rejects in REJECTS.items():
        rejections = rejects(np.arange(301)[:, np.newaxis], np.arange(281)[np.newaxis, :], answers)
        assert agreement_power(shares, answers, test=test) == pytest.approx(
            chances[0] @ rejections @ chances[1], abs=1e-12
        )


# Numbers derived from power -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("answers", [10, 40, 250])
def test_the_smallest_difference_has_just_the_power_that_was_asked_for(answers: int) -> None:
    differences = study_power(answers).detectable
    assert [(each.measure, each.test) for each in differences] == [
        (name, test) for name, both in TESTS.items() for test in both
    ]
    for each in differences:
        base = each.base or 0.0
        if each.smallest is None:
            assert power_of(each.test, (base, 0.0), each.sd, (answers, answers)) < TARGET
        else:
            values = (base, base - each.smallest)
            assert power_of(each.test, values, each.sd, (answers, answers)) == pytest.approx(TARGET, abs=1e-6)


@pytest.mark.parametrize("test", [TWO_SIDED, ONE_TAILED, FISHER])
@pytest.mark.parametrize("values", [(0.692, 0.525), (0.9, 0.7)])
def test_needed_answers_are_enough_and_one_less_is_not(test: str, values: tuple[float, float]) -> None:
    sd = 0.4 if test == TWO_SIDED else None
    needed = answers_needed(test, values, sd)
    assert needed is not None
    assert power_of(test, values, sd, (needed, needed)) >= TARGET
    assert power_of(test, values, sd, (needed - 1, needed - 1)) < TARGET


def test_more_answers_find_smaller_differences() -> None:
    for few, many in pairwise((20, 40, 80, 160)):
        pairs = zip(study_power(few).detectable, study_power(many).detectable, strict=True)
        assert all(more.smallest < less.smallest for less, more in pairs if less.smallest and more.smallest)


def test_one_answer_finds_nothing_and_no_power_exceeds_one() -> None:
    assert all(each.smallest is None for each in study_power(1).detectable)
    assert all(0 <= power <= 1 for each in study_power(1).seen for power in (each.yours, each.paper))
    # Where scipy's other tail is NaN, and far beyond this point.
    assert t_power(3.0, 1.0, (39, 40), tails=2) == pytest.approx(1.0, abs=1e-12)
    assert t_power(1e6, 1.0, (50, 50), tails=2) == 1.0
    assert agreement_power((1.0, 0.0), (50, 50), test=FISHER) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("per_condition", "readers", "message"),
    [
        (0, 1, "--per-condition 0: give 1 or more"),
        (5, 0, "--readers 0: give 1 or more"),
        (MOST, 2, f"are {2 * MOST} answers per condition; power is worked out for at most {MOST}"),
    ],
)
def test_numbers_without_sense_are_refused(per_condition: int, readers: int, message: str) -> None:
    with pytest.raises(LutgenError, match=message):
        study_power(per_condition, readers)


def test_the_pooled_standard_deviation_lies_between_those_it_pools() -> None:
    each = [standard_deviation("time", [name]) for name in ANSWERS]
    assert min(each) < standard_deviation("time", tuple(ANSWERS)) < max(each)
    # 5.4 s are 1.96 standard errors of 39 answers.
    assert each[0] == pytest.approx(17.206, abs=1e-3)


# The command ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    monkeypatch.chdir(tmp_path)
    return in_process(monkeypatch, capsys, "study", "power")


def test_the_page_says_what_json_says(run: Callable[..., Done]) -> None:
    content: dict[str, Any] = json.loads(run("--per-condition", "60", "--readers", "2", "--json", "-").out)
    validator("study-power").validate(content)
    assert content["answers"] == 120
    page = words(run("--per-condition", "60", "--readers", "2").out)
    assert page.startswith("With 120 answers per condition a fall of agreement from 69.2 % to 52.5 %")
    time, agreement = content["detectable"][0], content["detectable"][4]
    assert f"time t, two-sided {time['smallest']:.1f} s" in page
    falls = 100 * (agreement["base"] - agreement["smallest"])
    assert f"agreement t, one-tailed 69.2 % falls to {falls:.1f} %" in page
    for each in content["paper"]:
        needed = "> 2000" if each["needed"] is None else str(each["needed"])
        assert f"{each['between'][0]} – {each['between'][1]}" in page
        assert f"% {needed}" in page
    assert "With several readers answers are not independent" in page
    assert "not independent" not in run("--per-condition", "60").out


def test_one_answer_is_told_so(run: Callable[..., Done]) -> None:
    assert "One answer per condition has no variance" in run("--per-condition", "1").out
    few = words(run("--per-condition", "3").out)
    assert "agreement Fisher, one-tailed none" in few


def test_bad_numbers_and_files_that_exist_are_refused(run: Callable[..., Done], tmp_path: Path) -> None:
    (tmp_path / "plots").mkdir()
    (tmp_path / "plots/study-power.png").write_text("mine")
    for arguments, message in (
        (("--per-condition", "0"), "--per-condition 0: give 1 or more"),
        (("--plots", "plots"), "study-power.png: exists already"),
        (("--json", "plots"), "plots: is a folder"),
    ):
        done = run(*arguments)
        assert (done.code, done.out) == (2, "")
        assert message in done.err
    assert (tmp_path / "plots/study-power.png").read_text() == "mine"


@pytest.mark.parametrize("per_condition", mostly_slow(["1", "40", "2000"], "1"))
def test_the_picture_is_drawn_alike_every_time(run: Callable[..., Done], tmp_path: Path, per_condition: str) -> None:
    for folder in ("one", "two"):
        assert run("--per-condition", per_condition, "--plots", folder).code == 0
    one, two = (tmp_path / folder / "study-power.png" for folder in ("one", "two"))
    assert one.read_bytes() == two.read_bytes()
    with Image.open(one) as picture:
        assert picture.size == (1500, 800)
