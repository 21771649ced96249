"""The analysis of a reader study: the paper's tables, further tests, and the limits of the design."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict, dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

from lutgen.errors import refuse_unknown
from lutgen.names import INTERVALS
from lutgen.numerals import counted, in_percent
from lutgen.study import comparisons
from lutgen.study.answers import sensible
from lutgen.study.comparisons import corrected, samples, table_4
from lutgen.study.mixed import MISSING, MixedModel, available, mixed_models
from lutgen.study.power import ALPHA, LEAST, MOST, ONE_TAILED, smallest_difference
from lutgen.study.statistics import UNAGED, Kappa, condition_order, counts, kappas, mixed_sessions, pairs

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lutgen.study.answers import Answer
    from lutgen.study.statistics import AgreementCounts, ReadingPair, StudySample


def design_limits(
    conditions: Sequence[str], answers: Sequence[Answer], reading_pairs: Sequence[ReadingPair]
) -> Iterator[str]:
    """Yield sentences on the limits of the design, from which reader read which image in which session."""
    if not answers:
        yield (
            "These figures do not state the number of readers and images. If one reader or one image gave several of "
            "the values, these values are not independent, and the intervals are too narrow."
        )
        return
    readers = sorted({answer.reader for answer in answers})
    if len(readers) == 1:
        yield (
            "One reader: all intervals hold for other images read by the same reader. Nothing here shows how other "
            "readers would read."
        )
    else:
        yield (
            f"{len(readers)} readers: the tables as in the paper assume independent answers. Answers of several "
            "readers to the same image under the same condition are not independent, and then the t-tests give too "
            "many false findings. Use the mixed models."
        )
    yield from _images(conditions, answers)
    yield from _order(reading_pairs)


def _images(conditions: Sequence[str], answers: Sequence[Answer]) -> Iterator[str]:
    mixed = mixed_sessions(answers)
    seen: dict[str, set[tuple[str, str]]] = defaultdict(set)
    for answer in answers:
        if (answer.reader, answer.session) in mixed:
            seen[answer.condition].add((answer.reader, answer.image))
    by_condition = [seen[condition] for condition in conditions if seen[condition]]
    if len(by_condition) < 2:
        return
    images = [{image for _, image in readings} for readings in by_condition]
    once = len(set.union(*by_condition)) == sum(map(len, by_condition))
    if once and len(set.union(*images)) < sum(map(len, images)):
        yield (
            "In the sessions with aged images each reader read an image under one condition, and other readers read "
            "the image under other conditions: no paired test of agreement is possible. In the tables as in the paper, "
            "differences between images are noise; if not every image was read under every condition, they also change "
            "the differences between conditions."
        )
    elif once:
        yield (
            "In the sessions with aged images each image was read under one condition: differences between images are "
            "part of every difference between conditions, and no paired test of agreement is possible."
        )
    else:
        yield (
            "Readers saw the same images under several conditions. The tables as in the paper do not use this, and "
            "miss more differences; the paired test and the mixed models use it. Memory of an earlier reading changes "
            "all of these figures."
        )


def _order(reading_pairs: Sequence[ReadingPair]) -> Iterator[str]:
    aged = [pair for pair in reading_pairs if pair.answer.condition != UNAGED]
    later = sum(pair.reference.session > pair.answer.session for pair in aged)
    if aged and later in (0, len(aged)):
        yield (
            f"The un-aged reference was always read {'after' if later else 'before'} the aged image: practice, memory "
            "and fatigue between sessions change every agreement. The comparison is fair only if they are equal for "
            "all conditions."
        )
    if aged:
        yield "Agreement is with the reader's own answer, not with the truth: a reader may repeat a mistake."


def figure_limits(
    rows: Sequence[AgreementCounts],
    table_4: Sequence[comparisons.AgreementTest],
    further: Sequence[comparisons.FurtherAgreement],
    corrected: Sequence[comparisons.Corrected],
) -> Iterator[str]:
    """Yield sentences on the limits of the figures: wide intervals, many tests, findings that depend on one test."""
    least = min((row.n for row in rows), default=0)
    if len(rows) > 1 and LEAST <= least <= MOST and rows[0].agreed:
        yield _width(rows[0].share, least)
    if len(corrected) > 1:
        alone = sum(test.p < ALPHA for test in corrected)
        after = sum(test.p_holm < ALPHA for test in corrected)
        chance = 1 - (1 - ALPHA) ** len(corrected)
        yield (
            f"{len(corrected)} tests at 5 %: if no difference existed and the tests were independent, "
            f"{in_percent(chance)} of such studies would report a difference. {alone} of the p are below 0.05, {after} "
            "after Holm's correction."
        )
    yield from _depending_on_the_test(table_4, further)


def _width(share: float, pairs: int) -> str:
    fall = smallest_difference(ONE_TAILED, None, share, pairs)
    with_pairs = f"With {counted(pairs, 'pair')} a condition"
    if fall is None:
        return f"{with_pairs}, the one-tailed test misses even a fall of agreement to 0 % more often than once in five."
    return (
        f"{with_pairs}, a fall of agreement from {in_percent(share)} by less than about {100 * fall:.0f} percentage "
        "points is missed more often than once in five, by the one-tailed test."
    )


def _depending_on_the_test(
    table_4: Sequence[comparisons.AgreementTest], further: Sequence[comparisons.FurtherAgreement]
) -> Iterator[str]:
    both = {(each.first, each.second): each for each in further}
    for test in table_4:
        other = both.get((test.greater, test.less))
        if other is None or not isfinite(test.p):
            continue
        if (test.p < ALPHA) != (other.fisher_one_tailed < ALPHA) or (test.p < ALPHA) != (other.fisher < ALPHA):
            yield (
                f"Agreement, {test.greater} against {test.less}: p = {test.p:.3g} by the one-tailed t-test, "
                f"{other.fisher_one_tailed:.3g} by Fisher's exact test one-tailed and {other.fisher:.3g} two-tailed: "
                "the finding depends on the choice of test."
            )


SCHEMA = 1


@dataclass(frozen=True)
class Analysis:
    """The result of an analysis."""

    #: Sentences on the source of the figures; the first states whether the figures are simulated.
    sources: tuple[str, ...]
    #: Kind of the intervals of means, a key of ``INTERVALS``.
    ci: str
    #: The samples of Table 2.
    samples: tuple[StudySample, ...]
    #: Tables as in the paper; empty where the figures are not known.
    table2: comparisons.Table2
    table3: tuple[comparisons.Agreement, ...]
    table4: tuple[comparisons.AgreementTest, ...]
    #: Analyses beyond the paper.
    means: tuple[comparisons.FurtherMeans, ...]
    agreement: tuple[comparisons.FurtherAgreement, ...]
    kappas: tuple[Kappa, ...]
    mixed: tuple[MixedModel, ...]
    holm: tuple[comparisons.Corrected, ...]
    #: Sentences on the limits of design and figures.
    limits: tuple[str, ...]
    #: Sentences on data and analyses that were left out.
    remarks: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: see ``lutgen/study/schema/analyse.json``."""
        content = asdict(self)
        del content["samples"]
        beyond = {name: content.pop(name) for name in ("means", "agreement", "kappas", "mixed", "holm")}
        return {"schema": SCHEMA, **content, "beyond": beyond}


def analyse_answers(
    answers: Sequence[Answer],
    *,
    conditions: Sequence[str] | None = None,
    sources: Sequence[str] = (),
    ci: str = "normal",
) -> Analysis:
    """Analyse the answers of a study.

    Parameters
    ----------
    answers
        At least one answer. Answers with an impossible time are left out, and named in the remarks.
    conditions
        Conditions in their order; None: ``none`` first, then by mode and hour.
    sources
        Sentences on the source of the answers.
    ci
        Kind of the intervals of means, a key of ``INTERVALS``.

    Raises
    ------
    LutgenError
        ``ci`` is unknown, or no answer has a possible time.

    """
    answers, left_out = sensible(answers)
    order = tuple(conditions or condition_order(answers))
    reading_pairs = pairs(answers)
    rows = counts(order, reading_pairs)
    remarks = [] if rows else ["No reader read an image un-aged and a second time: there is no agreement to report."]
    remarks += [*([] if available() else [MISSING]), *left_out]
    return _analysis(
        samples(order, answers),
        rows,
        ci=ci,
        sources=sources,
        remarks=remarks,
        order=order,
        answers=answers,
        reading_pairs=reading_pairs,
    )


def analyse_figures(
    rows: Sequence[AgreementCounts], measured: Sequence[StudySample], *, sources: Sequence[str] = (), ci: str = "normal"
) -> Analysis:
    """Analyse counts of agreement, and samples without values; one may be empty. Raises LutgenError for ``ci``."""
    remarks = ["Rank tests, paired tests, κ and mixed models need the answers themselves, not means and counts."]
    return _analysis(measured, rows, ci=ci, sources=sources, remarks=remarks)


def _analysis(
    measured: Sequence[StudySample],
    rows: Sequence[AgreementCounts],
    *,
    ci: str,
    sources: Sequence[str],
    remarks: Sequence[str],
    order: Sequence[str] = (),
    answers: Sequence[Answer] = (),
    reading_pairs: Sequence[ReadingPair] = (),
) -> Analysis:
    """Analyse samples and counts, and the answers behind them if they are known."""
    refuse_unknown("interval", ci, INTERVALS)
    table2, table4 = comparisons.table_2(measured, ci=ci), table_4(rows)
    agreement, holm = comparisons.further_agreement(rows, reading_pairs), corrected(table2.tests, table4)
    limits = design_limits(order, answers, reading_pairs)
    return Analysis(
        sources=tuple(sources),
        ci=ci,
        samples=tuple(measured),
        table2=table2,
        table3=comparisons.table_3(rows),
        table4=table4,
        means=comparisons.further_means(measured),
        agreement=agreement,
        kappas=kappas(order, reading_pairs),
        mixed=mixed_models(order, answers, reading_pairs) if answers and available() else (),
        holm=holm,
        limits=(*limits, *figure_limits(rows, table4, agreement, holm)),
        remarks=tuple(remarks),
    )
