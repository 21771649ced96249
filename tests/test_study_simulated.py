"""The simulated reader: calibration on the paper, repeatability, and test results without and with planted effects."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.stats import binom
from skimage.io import imsave

from lutgen import LutgenError
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab
from lutgen.study.analysis import analyse_answers
from lutgen.study.comparisons import samples, table_2
from lutgen.study.mixed import mixed_models
from lutgen.study.protocol import Category, StudyTrial
from lutgen.study.simulated import (
    PAPER_DIFFERENCES,
    SimulatedReader,
    measured_differences,
    nuclear_difference,
    simulate,
)
from lutgen.study.statistics import (
    SampleFigures,
    StudySample,
    equal_variances,
    mean_interval,
    pairs,
    pooled,
    welch,
    wilson,
)
from tests.studies import CONDITIONS as PLANNED
from tests.studies import paper_trials, small_protocol

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.colorimetry import Array
    from lutgen.study.answers import Answer

pytestmark = pytest.mark.numbers

#: Simulated studies. Without an effect, 16 to 35 of them (95 % of a binomial) should report a difference.
STUDIES = 500
LEAST, MOST = map(int, binom.interval(0.95, STUDIES, 0.05))

CONDITIONS = list(PAPER_DIFFERENCES)


def study(seed: int, *, per_condition: int = 40, readers: int = 1, planted: bool = True) -> tuple[Answer, ...]:
    trials = paper_trials(seed, per_condition=per_condition, readers=readers)
    differences = {
        (trial.image, trial.condition): PAPER_DIFFERENCES[trial.condition] if planted else 0.0 for trial in trials
    }
    return simulate(trials, differences, SimulatedReader(seed=seed))


# The reader -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("condition", "means", "spreads"),
    [
        ("none", (41.0, 9.7, 69.2), (17.2, 0.64)),
        ("chroma", (50.1, 8.7, 52.5), (23.6, 1.61)),
        ("chroma-luma", (51.2, 8.4, 50.0), (20.7, 1.29)),
    ],
)
def test_the_reader_is_calibrated_on_the_paper_s_tables_2_and_3(
    condition: str, means: tuple[float, float, float], spreads: tuple[float, float]
) -> None:
    random = np.random.default_rng(1)
    images = random.standard_normal(400_000)
    reader = SimulatedReader()
    first = reader.readings(PAPER_DIFFERENCES[condition], images, random)
    again = reader.readings(0.0, images, random)
    seconds, ease, agreement = means
    assert first.seconds.mean() == pytest.approx(seconds, abs=0.4)
    assert first.ease.mean() == pytest.approx(ease, abs=0.1)
    assert 100 * np.mean(first.kept == again.kept) == pytest.approx(agreement, abs=0.5)
    # The paper's standard deviations of single conditions vary by chance, by 11 % at n = 40.
    assert (first.seconds.std(), first.ease.std()) == pytest.approx(spreads, rel=0.3)


def test_vectors_and_single_answers_are_the_same_reader() -> None:
    """Compare the arrays with the literal twin, which gives one answer after the other, over many trials."""
    reader = SimulatedReader(seed=5)
    random = np.random.default_rng(6)
    arrays = reader.readings(5.1, random.standard_normal(100_000), random)
    trials = [StudyTrial(place, 1, 1, f"i{place}", "chroma") for place in range(4000)]
    alone = [reader.answer(trial, 5.1, reader.difficulty(trial.image)) for trial in trials]
    assert np.median([seconds for seconds, _, _ in alone]) == pytest.approx(np.median(arrays.seconds), rel=0.04)
    assert np.mean([ease for _, ease, _ in alone]) == pytest.approx(arrays.ease.mean(), abs=0.08)


def test_answers_do_not_depend_on_the_order_and_are_the_same_again() -> None:
    trials = paper_trials(1, per_condition=5)
    reader = SimulatedReader(seed=2)
    forward, backward = (simulate(each, {}, reader) for each in (trials, trials[::-1]))
    assert forward == backward[::-1]
    assert simulate(trials, {}, SimulatedReader(seed=3)) != forward


def test_answers_are_on_the_study_s_scale_and_in_its_categories() -> None:
    reader = SimulatedReader(ease=(0, 4), categories=(Category("benign", "b", positive=False),))
    answers = simulate(paper_trials(1), {}, reader)
    assert {answer.ease for answer in answers} <= set(range(5))
    assert max(answer.ease for answer in answers) == 4
    assert {(answer.category, answer.positive) for answer in answers} == {("benign", False)}


def test_the_paper_s_design_is_that_of_its_section_2_3() -> None:
    trials = paper_trials(9)
    first, second = ([trial for trial in trials if trial.session == session] for session in (1, 2))
    assert {name: sum(trial.condition == name for trial in first) for name in CONDITIONS} == dict.fromkeys(
        CONDITIONS, 40
    )
    assert [trial.condition for trial in second] == ["none"] * 120
    assert {trial.image for trial in first} == {trial.image for trial in second}
    assert [trial.position for trial in first] == list(range(1, 121))
    assert [trial.image for trial in first] != [trial.image for trial in second]


def test_a_reader_not_disturbed_reads_as_un_aged_and_one_who_sees_nothing_guesses() -> None:
    reader = SimulatedReader()
    assert reader.disturbance(0.0) == 0
    assert reader.disturbance(1e6) == 1
    answers = reader.readings(1e6, np.zeros(50_000), np.random.default_rng(1)).kept
    assert np.mean(answers) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("difference", [-0.1, float("nan"), float("inf")])
def test_differences_that_are_none_are_refused(difference: float) -> None:
    with pytest.raises(LutgenError, match="ΔE2000 at nuclei of image-001 under chroma"):
        simulate(paper_trials(1), {("image-001", "chroma"): difference}, SimulatedReader())


# Without an effect ----------------------------------------------------------------------------------------------------


def null_studies(seed: int, *, readers: int = 1, crossed: bool = False) -> dict[str, Array]:
    """Time, ease and agreement of 500 studies without any effect, each of shape (studies, conditions, readings).

    ``crossed``: every condition has the same 40 images, which are compared with one un-aged reading. Otherwise each
    condition has 40 other images, as in the paper.
    """
    random = np.random.default_rng(seed)
    reread = np.repeat(random.standard_normal((STUDIES, 1 if crossed else 3, 1, 40)), readers, axis=2)
    reader = SimulatedReader()
    first = reader.readings(0.0, np.broadcast_to(reread, (STUDIES, 3, readers, 40)), random)
    again = reader.readings(0.0, reread, random)
    measures = {"time": first.seconds, "ease": first.ease, "agreement": (first.kept == again.kept).astype(float)}
    return {what: values.reshape(STUDIES, 3, -1) for what, values in measures.items()}


def reports(values: Array, *, one_tailed: bool) -> list[int]:
    """Number of studies that report a difference from the first condition at 5 %, by the paper's test."""
    figures = [
        SampleFigures(each.shape[1], each.mean(axis=1), each.std(axis=1, ddof=1)) for each in values.swapaxes(0, 1)
    ]
    return [int((pooled(figures[0], other, one_tailed=one_tailed).p < 0.05).sum()) for other in figures[1:]]


@pytest.mark.parametrize("what", ["time", "ease", "agreement"])
def test_in_the_paper_s_design_its_tests_find_nothing_where_nothing_is(what: str) -> None:
    studies = null_studies(1)[what]
    for number in reports(studies, one_tailed=what == "agreement"):
        assert LEAST <= number <= MOST


def test_welch_s_test_finds_nothing_where_nothing_is_either() -> None:
    first, second, _ = null_studies(1)["time"].swapaxes(0, 1)
    figures = [SampleFigures(40, each.mean(axis=1), each.std(axis=1, ddof=1)) for each in (first, second)]
    assert LEAST <= int((welch(*figures).p < 0.05).sum()) <= MOST


def test_the_f_test_beside_table_4_is_no_test_of_agreement() -> None:
    """The variance of values 0 and 1 follows from their mean: a test by normal theory then hardly ever rejects."""
    first, second, _ = null_studies(1)["agreement"].swapaxes(0, 1)
    figures = [SampleFigures(40, each.mean(axis=1), each.std(axis=1, ddof=1)) for each in (first, second)]
    assert int((equal_variances(*figures) < 0.05).sum()) < LEAST


def test_several_readers_of_the_same_images_make_the_paper_s_test_of_time_find_what_is_not_there() -> None:
    """Three readers share each image and its difficulty: about 14 % of studies report a difference in time."""
    studies = null_studies(1, readers=3)
    assert min(reports(studies["time"], one_tailed=False)) > 2 * 0.05 * STUDIES


def test_the_same_images_under_every_condition_make_the_paper_s_tests_miss_more() -> None:
    """Differences between images cancel, but an unpaired test ignores the pairs: about 1 % of studies report time."""
    studies = null_studies(1, crossed=True)
    assert max(reports(studies["time"], one_tailed=False)) < LEAST
    assert max(reports(studies["agreement"], one_tailed=True)) < LEAST


@pytest.mark.slow
@pytest.mark.rare(
    instead="test_study_analysis_mixed.py::test_conditions_that_readers_take_each_in_their_own_way_are_no_finding"
)
def test_the_mixed_model_holds_its_level_where_the_paper_s_test_does_not() -> None:
    """Three readers, the same images under the same conditions, no effect: time in 60 studies."""
    by_t_test = by_model = 0
    for seed in range(60):
        # Every reader gets the first reader's images: the t-test fails for this design.
        trials = [
            StudyTrial(reader, trial.session, trial.position, trial.image, trial.condition)
            for reader in (1, 2, 3)
            for trial in paper_trials(seed, per_condition=12)
        ]
        answers = simulate(trials, {}, SimulatedReader(seed=seed, pace=0.0))
        test = table_2(samples(CONDITIONS, answers)).tests[0]
        model = mixed_models(CONDITIONS, answers, pairs(answers))[0]
        assert (test.measure, test.second) == (model.measure, model.effects[0].condition) == ("time", "chroma")
        by_t_test += test.p < 0.05
        by_model += model.effects[0].p < 0.05
    low, high = binom.interval(0.95, 60, 0.05)
    assert low <= by_model <= high
    assert by_t_test > by_model


# With the paper's effect ----------------------------------------------------------------------------------------------


def test_planted_effects_of_the_paper_s_size_are_recovered_in_their_intervals() -> None:
    """Means under chroma + luma aging in 500 studies: at least nine of ten intervals contain the true mean."""
    random = np.random.default_rng(3)
    reader = SimulatedReader()
    images = random.standard_normal((STUDIES, 40))
    aged = reader.readings(PAPER_DIFFERENCES["chroma-luma"], images, random)
    again = reader.readings(0.0, images, random)
    truth = reader.readings(PAPER_DIFFERENCES["chroma-luma"], random.standard_normal(400_000), random)
    for values, whole in ((aged.seconds, truth.seconds), (aged.ease, truth.ease)):
        held = 0
        for row in values:
            low, high = mean_interval(StudySample("time", "", 40, float(row.mean()), float(row.std(ddof=1))))
            held += low <= whole.mean() <= high
        assert 0.90 * STUDIES <= held <= 0.98 * STUDIES
    intervals = [wilson(int(number), 40) for number in (aged.kept == again.kept).sum(axis=1)]
    assert 0.92 * STUDIES <= sum(low <= 0.50 <= high for low, high in intervals) <= 0.98 * STUDIES


def test_the_power_of_the_paper_s_design_is_high_for_ease_and_low_for_agreement() -> None:
    """Effects of the paper's size, chroma + luma: tests always find ease, mostly time, and agreement half the time."""
    random = np.random.default_rng(4)
    reader = SimulatedReader()
    read = {}
    for name in ("none", "chroma-luma"):
        images = random.standard_normal((STUDIES, 40))
        first = reader.readings(PAPER_DIFFERENCES[name], images, random)
        again = reader.readings(0.0, images, random)
        read[name] = {"time": first.seconds, "ease": first.ease, "agreement": (first.kept == again.kept).astype(float)}
    counts = {
        what: reports(np.stack([each[what] for each in read.values()], axis=1), one_tailed=what == "agreement")[0]
        for what in read["none"]
    }
    power = {what: number / STUDIES for what, number in counts.items()}
    assert power["ease"] > 0.99
    assert 0.5 < power["time"] < 0.8
    assert 0.4 < power["agreement"] < 0.7


def test_a_whole_study_with_planted_effects_is_analysed_as_planted() -> None:
    analysis = analyse_answers(study(11))
    means = {(mean.measure, mean.condition): mean.mean for mean in analysis.table2.means}
    assert means["ease", "none"] > means["ease", "chroma"]
    assert means["time", "none"] < means["time", "chroma-luma"]
    assert [row.agreed + row.disagreed for row in analysis.table3] == [40, 40, 40]
    assert next(test for test in analysis.holm if (test.measure, test.second) == ("ease", "chroma-luma")).p_holm < 1e-4


# ΔE at nuclei ---------------------------------------------------------------------------------------------------------


def test_the_difference_is_that_of_the_pixels_of_nuclei(tmp_path: Path) -> None:
    before, after, ground = (70, 40, 110), (90, 60, 80), (240, 220, 235)
    row, column = np.mgrid[:96, :96]
    nuclei = np.hypot(row % 24 - 12, column % 24 - 12) <= 6
    for name, ink, paper in (("unaged", before, ground), ("aged", after, (200, 200, 100))):
        imsave(
            tmp_path / f"{name}.png",
            np.where(nuclei[..., np.newaxis], ink, paper).astype(np.uint8),
            check_contrast=False,
        )
    expected = float(delta_e_2000(*(linear_to_lab(code_to_linear(np.array(ink) / 255)) for ink in (before, after))))
    difference = nuclear_difference(tmp_path / "unaged.png", {"chroma": tmp_path / "aged.png"})
    assert difference["chroma"] == pytest.approx(expected, rel=1e-6)
    imsave(tmp_path / "small.png", np.zeros((8, 8, 3), np.uint8) + np.arange(8, dtype=np.uint8)[:, None, None],
           check_contrast=False)  # fmt: skip
    with pytest.raises(LutgenError, match="another size"):
        nuclear_difference(tmp_path / "unaged.png", {"chroma": tmp_path / "small.png"})


def test_a_study_is_measured_image_by_image(tmp_path: Path) -> None:
    protocol = small_protocol(images=4, practice=0, readers=1, conditions=PLANNED[:2])
    row, column = np.mgrid[:96, :96]
    nuclei = (np.hypot(row % 24 - 12, column % 24 - 12) <= 6)[..., np.newaxis]
    with pytest.raises(LutgenError, match="images"):
        measured_differences(tmp_path, protocol)
    (tmp_path / "images").mkdir()
    for render in protocol.renders:
        aged = 20 if render.condition != "none" else 0
        picture = np.where(nuclei, (70 + aged, 40, 110 - aged), (240, 220, 235)).astype(np.uint8)
        imsave(tmp_path / render.file, picture, check_contrast=False)
    never = replace(protocol, renders=tuple(each for each in protocol.renders if each.condition != "none"))
    with pytest.raises(LutgenError, match="case-002: is not shown un-aged"):
        measured_differences(tmp_path, never)
    calls: list[tuple[int, int]] = []
    differences = measured_differences(tmp_path, protocol, lambda done, total: calls.append((done, total)))
    assert set(differences) == {("case-002", "chroma@18000"), ("case-004", "chroma@18000")}
    assert min(differences.values()) > 3
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]
