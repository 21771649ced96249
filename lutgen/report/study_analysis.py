"""The page and the picture of ``lutgen study analyse``: the paper's tables, further tests, limits."""

from __future__ import annotations

from collections import defaultdict
from math import ceil, floor, isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lutgen.report.drawing import BLACK, BLUE, GREEN, GREY, RED, beside, picture, tidy
from lutgen.report.parts import Headline, Part, Table
from lutgen.study.statistics import MEASURES, Interval

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes

    from lutgen.colorimetry import Array
    from lutgen.study.analysis import Analysis


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
    means = "Table 2: mean ± 95 % interval; p of unpaired two-sided t-tests, equal variances."
    yield from _part(_table_2(analysis), means)
    tests = [
        (
            test.measure,
            f"{test.first} → {test.second}",
            signed(test.difference),
            signed(test.t, 2),
            f"{test.df:.0f}",
            p_value(test.p),
            _yes(test.p),
        )
        for test in analysis.table2.tests
    ]
    yield from _part(Table(("", "conditions", "difference", "t", "df", "p", "below 0.05"), tests, words=range(2)))
    agreed = [
        (row.condition, str(row.agreed), str(row.disagreed), f"{row.percent:.2f}", between(row.ci95))
        for row in analysis.table3
    ]
    yield from _part(
        Table(("condition", "agreed", "disagreed", "percent", "95 % interval"), agreed),
        "Table 3: agreement with the un-aged reading, positive or negative; 95 % by Wilson.",
    )
    falls = [
        (f"{test.greater} ≤ {test.less}", p_value(test.p), _yes(test.p), p_value(test.variances_p))
        for test in analysis.table4
    ]
    yield from _part(
        Table(("null hypothesis", "p", "below 0.05", "F-test p"), falls),
        "Table 4: does agreement fall? One-tailed t-tests, equal variances; F-tests of equal variances.",
    )


def _part(table: Table, *sentences: str) -> Iterator[Part]:
    if table.rows:
        yield from sentences
        yield table
        yield ""


def _table_2(analysis: Analysis) -> Table:
    means = {(mean.measure, mean.condition): mean for mean in analysis.table2.means}
    measures = _measured(analysis)
    rows = []
    for condition in dict.fromkeys(mean.condition for mean in analysis.table2.means):
        cells = []
        for measure in measures:
            mean = means.get((measure, condition))
            spread = mean and f"{mean.mean:.1f} ± {figure(mean.ci95[1] - mean.mean)}"
            cells += [str(mean.n), str(spread)] if mean else ["–", "–"]
        rows.append((condition, *cells))
    headings = (heading for measure in measures for heading in ("n", MEASURES[measure]))
    return Table(("condition", *headings), rows)


def _measured(analysis: Analysis) -> list[str]:
    return [measure for measure in MEASURES if any(mean.measure == measure for mean in analysis.table2.means)]


def _beyond(analysis: Analysis) -> Iterator[Part]:
    of_means = "Further tests on means: Welch's t-test and interval (unequal variances), ranks, effect size in SD."
    yield from _part(_means_table(analysis), of_means)
    shares = "Further tests on agreement: exact tests, and the change with its interval (Newcombe; exact for odds)."
    yield from _part(_agreement_table(analysis), shares)
    kappas = [
        (row.condition, row.of, str(row.n), f"{row.percent:.1f}", f"{figure(row.kappa, 2)} {between(row.ci95, 2)}")
        for row in analysis.kappas
    ]
    yield from _part(
        Table(("condition", "of", "pairs", "percent", "κ [95 %]"), kappas, words=range(2)),
        "Cohen's κ, agreement beyond chance, on sides and on categories:",
    )
    yield from _part(_mixed_table(analysis), "Mixed models over readers and images, all sessions:")
    corrected = [
        (test.measure, f"{test.first} → {test.second}", p_value(test.p), p_value(test.p_holm), _yes(test.p_holm))
        for test in analysis.holm
    ]
    yield from _part(
        Table(("", "conditions", "p", "corrected", "below 0.05"), corrected, words=range(2)),
        f"The paper's {len(analysis.holm)} tests, corrected for multiple testing (Holm):",
    )


def _means_table(analysis: Analysis) -> Table:
    ranked = any(isfinite(each.rank_p) for each in analysis.means)
    rows = []
    for each in analysis.means:
        difference = f"{signed(each.difference)} {between(each.difference_ci95)}"
        size = f"{signed(each.hedges_g, 2)} {between(each.hedges_g_ci95, 2)}"
        ranks_p = [p_value(each.rank_p)] if ranked else []
        compared = f"{each.first} → {each.second}"
        rows.append((each.measure, compared, difference, p_value(each.welch_p), *ranks_p, size))
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
            f"{signed(each.difference)} {between(each.difference_ci95)}",
            f"{figure(each.odds_ratio, 2)} {between(each.odds_ratio_ci95, 2)}",
            p_value(each.fisher_one_tailed),
            p_value(each.fisher),
            *([f"{p_value(tested.p)} ({tested.pairs})" if tested else "–"] if paired else []),
        )
        rows.append(row)
    headings = ("conditions", "change, points [95 %]", "odds ratio [95 %]", "Fisher one-tailed", "two-tailed")
    unpaired = "No McNemar test: it needs readings of the same image by the same reader under both conditions."
    return Table((*headings, "McNemar p (pairs)"), rows) if paired else Table(headings, rows, notes=(unpaired,))


def _mixed_table(analysis: Analysis) -> Table:
    rows = []
    for model in analysis.mixed:
        names = ("readers", "readers_by_condition", "images", "rest")
        spreads = ", ".join(f"{model.sd[name]:.2f}" if name in model.sd else "–" for name in names) if model.sd else ""
        for place, each in enumerate(model.effects):
            row = (
                "" if place else model.measure,
                f"{model.against} → {each.condition}",
                model.effect,
                f"{figure(each.estimate, 2)} {between(each.ci95, 2)}",
                p_value(each.p),
                "" if place else spreads,
            )
            rows.append(row)
        if not model.effects:
            rows.append((model.measure, "–", model.effect, "not fitted", "–", ""))
    return Table(
        ("", "condition", "effect", "estimate [95 %]", "p", "SD: readers, under a condition, images, rest"),
        rows,
        words=range(3),
        notes=[f"{model.measure}: {'; '.join(model.notes)}." for model in analysis.mixed if model.notes],
    )


def p_value(p: float) -> str:
    """Return p as text with three digits; a dash if there is no test."""
    if not isfinite(p):
        return "–"
    if p < 1e-300:
        return "< 1e-300"
    return f"{p:.1e}" if p < 0.0001 else f"{p:#.3g}".rstrip(".")


def figure(value: float, digits: int = 1) -> str:
    """Return a number as text, with a minus sign (−), ∞ for infinity, and a dash for NaN."""
    return "–" if isnan(value) else f"{value:z.{digits}f}".replace("-", "−").replace("inf", "∞")


def signed(value: float, digits: int = 1) -> str:
    """Return a number as text with its sign."""
    text = figure(value, digits)
    return f"+{text}" if value > 0 and text.strip("0.") else text


def between(ends: Interval, digits: int = 1) -> str:
    """Return an interval as text: [35.2, 64.8]."""
    return f"[{figure(ends[0], digits)}, {figure(ends[1], digits)}]"


def _yes(p: float) -> str:
    return "yes" if p < 0.05 else "no" if isfinite(p) else "–"


#: Name of the picture.
PICTURE = "study.png"

#: Measure → unit of its change.
_UNITS = {"time": " s", "ease": "", "agreement": " points"}

#: Number of bins over the range of answers; answers in one bin are drawn side by side.
_BINS = 45

#: Colours of conditions, the un-aged condition first.
_COLOURS = (BLUE, RED, GREEN, BLACK)


def plot_study(analysis: Analysis, folder: str | Path, *, force: bool = False) -> Path:
    """Draw ``study.png`` into a folder; the same bytes on every run. Raises LutgenError when it cannot be written."""
    path = Path(folder) / PICTURE
    panels = [*_measured(analysis), *(["agreement"] if analysis.table3 else [])]
    several = f"; not corrected for {len(analysis.holm)} tests" if len(analysis.holm) > 1 else ""
    foot = (
        f"{'Small dots: single answers. ' if any(each.values for each in analysis.samples) else ''}"
        "Large: mean or share, with 95 % intervals (agreement: Wilson). Below: change against the first condition and "
        f"p as in the paper: two-sided t-tests, one-tailed for agreement{several}."
    )
    second = " ".join(analysis.sources)
    with picture(path, title(analysis), second=second, foot=foot, height=7.5, force=force) as (page, low, high):
        width = 0.94 / len(panels)
        for number, panel in enumerate(panels):
            axes = page.add_axes((0.055 + number * width, low + 0.15, width - 0.055, high - low - 0.22))
            if panel == "agreement":
                _draw_agreement(axes, analysis)
            else:
                _draw_means(axes, analysis, panel)
            tidy(axes, grid="y")
    return path


def title(analysis: Analysis) -> str:
    """Return the title: each measure's change from the first to the last condition, with p."""
    conditions = [row.condition for row in (analysis.table2.means or analysis.table3)]
    first, last = conditions[0], conditions[-1]
    parts = []
    for measure, unit in _UNITS.items():
        change, p = changes(analysis, measure).get(last, (float("nan"), float("nan")))
        if isfinite(change):
            chance = "p < 0.001" if p < 0.001 else f"p = {p:.2g}" if isfinite(p) else "p unknown"
            parts.append(f"{measure} {signed(change)}{unit} ({chance})")
    return f"{last} against {first}: {', '.join(parts)}" if parts else f"{first} alone: nothing to compare with"


def changes(analysis: Analysis, measure: str) -> dict[str, tuple[float, float]]:
    """Return condition → change of a measure (agreement: in points) against the first condition, and p."""
    if measure == "agreement":
        share = {row.condition: row.percent for row in analysis.table3}
        start = analysis.table3[0].condition if analysis.table3 else ""
        return {
            test.less: (share[test.less] - share[start], test.p) for test in analysis.table4 if test.greater == start
        }
    tests = [test for test in analysis.table2.tests if test.measure == measure]
    return {test.second: (test.difference, test.p) for test in tests if test.first == tests[0].first}


def _draw_means(axes: Axes, analysis: Analysis, measure: str) -> None:
    from matplotlib.ticker import MaxNLocator

    means = [mean for mean in analysis.table2.means if mean.measure == measure]
    samples = {each.condition: each.values for each in analysis.samples if each.measure == measure}
    span = np.ptp([value for values in samples.values() for value in values] or [0.0])
    for place, mean in enumerate(means):
        values = np.array(samples[mean.condition])
        axes.plot(place + abreast(values, span), values, "o", color=GREY, alpha=0.45, markersize=4, zorder=1)
        _point(axes, place, mean.mean, mean.ci95, figure(mean.mean), letters=_points(12.0, len(means)))
    if measure == "time":
        axes.set_ylim(bottom=0.0)
    else:
        seen = [end for mean in means for end in (*mean.ci95, *samples[mean.condition]) if isfinite(end)]
        axes.set_ylim(floor(min(seen)) - 0.2, ceil(max(seen)) + 0.2)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_title(MEASURES[measure], fontsize=13, weight="bold", loc="left")
    _name(axes, [mean.condition for mean in means], analysis, measure)


def _draw_agreement(axes: Axes, analysis: Analysis) -> None:
    for place, row in enumerate(analysis.table3):
        text = f"{row.percent:.1f} %\n{row.agreed} of {row.agreed + row.disagreed}"
        _point(axes, place, row.percent, row.ci95, text, letters=_points(12.0, len(analysis.table3)))
    # Space above 100 % for the mark and the figures of a condition where all answers agree.
    axes.set(ylim=(0, 107), yticks=range(0, 101, 20))
    axes.set_title("agreement with the un-aged reading, %", fontsize=13, weight="bold", loc="left")
    _name(axes, [row.condition for row in analysis.table3], analysis, "agreement")


def _point(axes: Axes, place: int, value: float, ends: tuple[float, float], text: str, *, letters: float) -> None:
    colour = _COLOURS[place % len(_COLOURS)]
    axes.vlines(place, *ends, color=colour, linewidth=4, zorder=3)
    axes.plot(place, value, "o", color=colour, markeredgecolor="white", markersize=13, zorder=4)
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    look = {"fontsize": letters, "weight": "bold", "color": BLACK, "bbox": box, "zorder": 5}
    beside(axes, text, (place, value), (12, 0), va="center", **look)


def _name(axes: Axes, conditions: Sequence[str], analysis: Analysis, measure: str) -> None:
    against, names = changes(analysis, measure), []
    # A condition's name of more than 12 characters does not fit below its column, and is broken before its hour.
    long = any(len(condition) > 12 for condition in conditions)
    for condition in conditions:
        change, p = against.get(condition, (float("nan"), float("nan")))
        below = f"{signed(change)}{_UNITS[measure]}\np = {p_value(p)}" if isfinite(change) else ""
        name = condition.replace("@", "\n@") if long else condition
        names.append(f"{name}\n{below}")
    axes.set_xticks(range(len(conditions)), names, fontsize=_points(11.0, len(conditions)))
    axes.set_xlim(-0.5, len(conditions) - 0.3)


def _points(most: float, conditions: int) -> float:
    """Return the font size at which neighbouring labels (12 characters, or a mark and 8) do not overlap."""
    return min(most, 35.0 / conditions)


def abreast(values: Array, span: float) -> Array:
    """Return horizontal offsets, (n,), that place answers of similar value side by side, in their order."""
    offsets = np.zeros(len(values))
    bins: dict[int, list[int]] = defaultdict(list)
    for place, value in enumerate(values):
        bins[round(_BINS * float(value) / span) if span else 0].append(place)
    for places in bins.values():
        step = min(0.045, 0.7 / len(places))
        offsets[places] = step * (np.arange(len(places)) - (len(places) - 1) / 2)
    return offsets
