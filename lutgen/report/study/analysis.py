"""The page of ``lutgen study analyse``: the paper's tables, further tests, and the limits of the design."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from lutgen.report.parts import Headline, Table
from lutgen.study.analysis.statistics import MEASURES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.report.parts import Part
    from lutgen.study.analysis import Analysis
    from lutgen.study.analysis.mixed import MixedModel
    from lutgen.study.analysis.statistics import Interval

#: Measure → decimals of its mean, as in the paper's Table 2.
_DIGITS = {"time": 1, "ease": 1}

#: Why there is no McNemar test.
_UNPAIRED = "No McNemar test: it needs readings of the same image by the same reader under both conditions."


def study_page(analysis: Analysis) -> Iterator[Part]:
    """Yield what ``lutgen study analyse`` prints."""
    yield from analysis.sources
    yield ""
    yield Headline("As in the paper")
    yield from _paper(analysis)
    yield Headline("Beyond the paper")
    yield from _beyond(analysis)
    yield Headline("What this design can and cannot show")
    for sentence in analysis.limits:
        yield f"- {sentence}"
    yield from analysis.remarks


def _paper(analysis: Analysis) -> Iterator[Part]:
    if analysis.table2.means:
        yield "Table 2: mean ± 95 % interval; p of unpaired two-sided t-tests, equal variances."
        yield _table_2(analysis)
        yield ""
    if analysis.table2.tests:
        yield _table_2_tests(analysis)
        yield ""
    if analysis.table3:
        yield "Table 3: agreement with the un-aged reading, positive or negative; 95 % by Wilson."
        yield Table(
            ("condition", "agreed", "disagreed", "percent", "95 % interval"),
            [
                (row.condition, str(row.agreed), str(row.disagreed), f"{row.percent:.2f}", between(row.ci95, 1))
                for row in analysis.table3
            ],
        )
        yield ""
    if analysis.table4:
        yield "Table 4: does agreement fall? One-tailed t-tests, equal variances; beside them the F-test of these."
        yield Table(
            ("null hypothesis", "p", "below 0.05", "F-test p"),
            [
                (f"{test.greater} ≤ {test.less}", p_value(test.p), _yes(test.p), p_value(test.variances_p))
                for test in analysis.table4
            ],
        )
        yield ""


def _table_2(analysis: Analysis) -> Table:
    measures = [measure for measure in MEASURES if any(mean.measure == measure for mean in analysis.table2.means)]
    rows = []
    for condition in dict.fromkeys(mean.condition for mean in analysis.table2.means):
        cells = []
        for measure in measures:
            here = [mean for mean in analysis.table2.means if (mean.measure, mean.condition) == (measure, condition)]
            digits = _DIGITS[measure]
            cells += [
                cell
                for mean in here
                for cell in (str(mean.n), f"{mean.mean:.{digits}f} ± {figure(mean.ci95[1] - mean.mean, digits)}")
            ] or ["–", "–"]
        rows.append((condition, *cells))
    headings = (heading for measure in measures for heading in ("n", MEASURES[measure]))
    return Table(("condition", *headings), rows)


def _table_2_tests(analysis: Analysis) -> Table:
    rows = [
        (
            test.measure,
            f"{test.first} → {test.second}",
            signed(test.difference, _DIGITS[test.measure]),
            signed(test.t, 2),
            f"{test.df:.0f}",
            p_value(test.p),
            _yes(test.p),
        )
        for test in analysis.table2.tests
    ]
    return Table(("", "conditions", "difference", "t", "df", "p", "below 0.05"), rows, words=range(2))


def _beyond(analysis: Analysis) -> Iterator[Part]:
    if analysis.means:
        yield "Means once more: Welch's t-test and interval (unequal variances), ranks, size in standard deviations."
        yield _means_table(analysis)
        yield ""
    yield from _agreement(analysis)
    if analysis.mixed:
        yield "Mixed models over readers and images, all sessions:"
        yield _mixed_table(analysis)
        yield ""
    if analysis.holm:
        yield f"The paper's tests, corrected for there being {len(analysis.holm)} (Holm):"
        rows = [
            (test.measure, f"{test.first} → {test.second}", p_value(test.p), p_value(test.p_holm), _yes(test.p_holm))
            for test in analysis.holm
        ]
        yield Table(("", "conditions", "p", "corrected", "below 0.05"), rows, words=range(2))
        yield ""


def _agreement(analysis: Analysis) -> Iterator[Part]:
    if analysis.agreement:
        yield "Agreement once more: exact tests, and the change with its interval (Newcombe; exact for odds)."
        yield _agreement_table(analysis)
        yield ""
    if analysis.kappas:
        yield "Cohen's κ, agreement beyond chance, on sides and on categories:"
        rows = [
            (
                row.condition,
                row.of,
                str(row.n),
                f"{row.percent:.1f}",
                f"{figure(row.kappa, 2)} {between(row.ci95, 2)}",
            )
            for row in analysis.kappas
        ]
        yield Table(("condition", "of", "pairs", "percent", "κ [95 %]"), rows, words=range(2))
        yield ""


def _means_table(analysis: Analysis) -> Table:
    ranked = any(isfinite(each.rank_p) for each in analysis.means)
    rows = []
    for each in analysis.means:
        digits = _DIGITS[each.measure]
        row = (
            each.measure,
            f"{each.first} → {each.second}",
            f"{signed(each.difference, digits)} {between(each.difference_ci95, digits)}",
            p_value(each.welch_p),
            *([p_value(each.rank_p)] if ranked else []),
            f"{signed(each.hedges_g, 2)} {between(each.hedges_g_ci95, 2)}",
        )
        rows.append(row)
    ranks = ["Mann–Whitney p"] if ranked else []
    headings = ("", "conditions", "difference [95 %]", "Welch p", *ranks, "Hedges' g [95 %]")
    return Table(headings, rows, words=range(2))


def _agreement_table(analysis: Analysis) -> Table:
    paired = any(each.mcnemar for each in analysis.agreement)
    rows = []
    for each in analysis.agreement:
        tested = each.mcnemar
        row = (
            f"{each.first} → {each.second}",
            f"{signed(each.difference, 1)} {between(each.difference_ci95, 1)}",
            f"{figure(each.odds_ratio, 2)} {between(each.odds_ratio_ci95, 2)}",
            p_value(each.fisher_one_tailed),
            p_value(each.fisher),
            *([f"{p_value(tested.p)} ({tested.pairs})" if tested else "–"] if paired else []),
        )
        rows.append(row)
    pairs = ["McNemar p (pairs)"] if paired else []
    return Table(
        ("conditions", "change, points [95 %]", "odds ratio [95 %]", "Fisher one-tailed", "two-tailed", *pairs),
        rows,
        notes=() if paired else (_UNPAIRED,),
    )


def _mixed_table(analysis: Analysis) -> Table:
    rows = []
    for model in analysis.mixed:
        for place, each in enumerate(model.effects):
            row = (
                "" if place else model.measure,
                f"{model.against} → {each.condition}",
                model.effect,
                f"{figure(each.estimate, 2)} {between(each.ci95, 2)}",
                p_value(each.p),
                "" if place else _spreads(model),
            )
            rows.append(row)
        if not model.effects:
            rows.append((model.measure, "–", model.effect, "not fitted", "–", ""))
    return Table(
        ("", "condition", "effect", "estimate [95 %]", "p", "SD: readers, images, rest"),
        rows,
        words=range(3),
        notes=[f"{model.measure}: {'; '.join(model.notes)}." for model in analysis.mixed if model.notes],
    )


def _spreads(model: MixedModel) -> str:
    if not model.sd:
        return ""
    return ", ".join(f"{model.sd[name]:.2f}" if name in model.sd else "–" for name in ("readers", "images", "rest"))


def p_value(p: float) -> str:
    """Write p with three figures; a dash where there is no test."""
    if not isfinite(p):
        return "–"
    if p < 1e-300:
        return "< 1e-300"
    return f"{p:.1e}" if p < 0.0001 else f"{p:#.3g}".rstrip(".")


def figure(value: float, digits: int) -> str:
    """Write a number with a minus sign (−), ∞ for an infinite one, and a dash for NaN."""
    if value != value:  # noqa: PLR0124 - NaN
        return "–"
    if not isfinite(value):
        return "∞" if value > 0 else "−∞"
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        return text.removeprefix("-")
    return f"−{text[1:]}" if text.startswith("-") else text


def signed(value: float, digits: int) -> str:
    """Write a number with its sign."""
    text = figure(value, digits)
    return f"+{text}" if value > 0 and text.strip("0.") else text


def between(ends: Interval, digits: int) -> str:
    """Write an interval: [35.2, 64.8]."""
    return f"[{figure(ends[0], digits)}, {figure(ends[1], digits)}]"


def _yes(p: float) -> str:
    return "yes" if p < 0.05 else "no" if isfinite(p) else "–"
