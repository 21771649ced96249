"""The page of ``lutgen study analyse``: the paper's tables first, then what lies beyond them, then what it can show."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from rich.text import Text

from lutgen.report.criticism.comparison import table
from lutgen.study.analysis.sample import MEASURES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType
    from rich.table import Table

    from lutgen.study.analysis import Analysis
    from lutgen.study.analysis.intervals import Interval
    from lutgen.study.analysis.mixed import MixedModel

#: Digits behind the point of a mean, by measure, as the paper's Table 2 has them.
_DIGITS = {"time": 1, "ease": 1}


def study_page(found: Analysis) -> Iterator[RenderableType]:
    """Yield what ``lutgen study analyse`` prints."""
    yield from found.sources
    yield ""
    yield Text("As in the paper", style="bold")
    yield from _paper(found)
    yield Text("Beyond the paper", style="bold")
    yield from _beyond(found)
    yield Text("What this design can and cannot show", style="bold")
    for sentence in found.limits:
        yield f"- {sentence}"
    yield from found.remarks


def _paper(found: Analysis) -> Iterator[RenderableType]:
    if found.table2.means:
        yield "Table 2: mean ± 95 % interval; p of unpaired two-sided t-tests, equal variances."
        yield _table_2(found)
        yield ""
    if found.table2.tests:
        yield _table_2_tests(found)
        yield ""
    if found.table3:
        yield "Table 3: agreement with the un-aged reading, positive or negative; 95 % by Wilson."
        made = table("condition", "agreed", "disagreed", "percent", "95 % interval")
        for row in found.table3:
            agreed, disagreed = str(row.agreed), str(row.disagreed)
            made.add_row(row.condition, agreed, disagreed, f"{row.percent:.2f}", between(row.ci95, 1))
        yield made
        yield ""
    if found.table4:
        yield "Table 4: does agreement fall? One-tailed t-tests, equal variances; beside them the F-test of these."
        made = table("null hypothesis", "p", "below 0.05", "F-test p")
        for test in found.table4:
            null = f"{test.greater} ≤ {test.less}"
            made.add_row(null, p_value(test.p), _yes(test.p), p_value(test.variances_p))
        yield made
        yield ""


def _table_2(found: Analysis) -> Table:
    measures = [measure for measure in MEASURES if any(mean.measure == measure for mean in found.table2.means)]
    made = table("condition", *(head for measure in measures for head in ("n", MEASURES[measure])))
    for condition in dict.fromkeys(mean.condition for mean in found.table2.means):
        cells = []
        for measure in measures:
            here = [mean for mean in found.table2.means if (mean.measure, mean.condition) == (measure, condition)]
            digits = _DIGITS[measure]
            cells += [
                cell
                for mean in here
                for cell in (str(mean.n), f"{mean.mean:.{digits}f} ± {figure(mean.ci95[1] - mean.mean, digits)}")
            ] or ["–", "–"]
        made.add_row(condition, *cells)
    return made


def _table_2_tests(found: Analysis) -> Table:
    made = table("", "conditions", "difference", "t", "df", "p", "below 0.05", left=2)
    for test in found.table2.tests:
        made.add_row(
            test.measure,
            f"{test.first} → {test.second}",
            signed(test.difference, _DIGITS[test.measure]),
            signed(test.t, 2),
            f"{test.df:.0f}",
            p_value(test.p),
            _yes(test.p),
        )
    return made


def _beyond(found: Analysis) -> Iterator[RenderableType]:
    if found.means:
        ranked = any(isfinite(each.rank_p) for each in found.means)
        yield "Means once more: Welch's t-test and interval (unequal variances), ranks, size in standard deviations."
        heads = ("difference [95 %]", "Welch p", *(["Mann–Whitney p"] if ranked else []), "Hedges' g [95 %]")
        made = table("", "conditions", *heads, left=2)
        for each in found.means:
            digits = _DIGITS[each.measure]
            made.add_row(
                each.measure,
                f"{each.first} → {each.second}",
                f"{signed(each.difference, digits)} {between(each.difference_ci95, digits)}",
                p_value(each.welch_p),
                *([p_value(each.rank_p)] if ranked else []),
                f"{signed(each.hedges_g, 2)} {between(each.hedges_g_ci95, 2)}",
            )
        yield made
        yield ""
    yield from _agreement(found)
    if found.mixed:
        yield "Mixed models over readers and images, all sessions:"
        yield _mixed_table(found)
        yield from (f"{model.measure}: {'; '.join(model.notes)}." for model in found.mixed if model.notes)
        yield ""
    if found.holm:
        yield f"The paper's tests, corrected for there being {len(found.holm)} (Holm):"
        made = table("", "conditions", "p", "corrected", "below 0.05", left=2)
        for test in found.holm:
            pair = f"{test.first} → {test.second}"
            made.add_row(test.measure, pair, p_value(test.p), p_value(test.p_holm), _yes(test.p_holm))
        yield made
        yield ""


def _agreement(found: Analysis) -> Iterator[RenderableType]:
    if found.agreement:
        paired = any(each.mcnemar for each in found.agreement)
        yield "Agreement once more: exact tests, and the change with its interval (Newcombe; exact for odds)."
        last = ["McNemar p (pairs)"] if paired else []
        made = table(
            "conditions", "change, points [95 %]", "odds ratio [95 %]", "Fisher one-tailed", "two-tailed", *last
        )
        for each in found.agreement:
            tested = each.mcnemar
            made.add_row(
                f"{each.first} → {each.second}",
                f"{signed(each.difference, 1)} {between(each.difference_ci95, 1)}",
                f"{figure(each.odds_ratio, 2)} {between(each.odds_ratio_ci95, 2)}",
                p_value(each.fisher_one_tailed),
                p_value(each.fisher),
                *([f"{p_value(tested.p)} ({tested.pairs})" if tested else "–"] if paired else []),
            )
        yield made
        if not paired:
            yield "No McNemar test: it needs readings of the same image by the same reader under both conditions."
        yield ""
    if found.kappas:
        yield "Cohen's κ, agreement beyond chance, on sides and on categories:"
        made = table("condition", "of", "pairs", "percent", "κ [95 %]", left=2)
        for row in found.kappas:
            value = f"{figure(row.kappa, 2)} {between(row.ci95, 2)}"
            made.add_row(row.condition, row.of, str(row.n), f"{row.percent:.1f}", value)
        yield made
        yield ""


def _mixed_table(found: Analysis) -> Table:
    made = table("", "condition", "effect", "estimate [95 %]", "p", "SD: readers, images, rest", left=3)
    for model in found.mixed:
        for place, each in enumerate(model.effects):
            made.add_row(
                "" if place else model.measure,
                f"{model.against} → {each.condition}",
                model.effect,
                f"{figure(each.estimate, 2)} {between(each.ci95, 2)}",
                p_value(each.p),
                "" if place else _spreads(model),
            )
        if not model.effects:
            made.add_row(model.measure, "–", model.effect, "not fitted", "–", "")
    return made


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
    """Write a number with a true minus; ∞ and a dash for what is none."""
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
