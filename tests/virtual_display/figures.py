"""The table of figures and gates, with binomial intervals, and the confusion matrix."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

from tests.virtual_display.judge import Reply, honest, names_the_place

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

#: Kinds with one hidden effect of the catalogue, which the diagnosis should find beside the tips.
ONE_EFFECT = ("same-form", "other-form")


class Scored(NamedTuple):
    """One data set: its file, the answer, and the reply."""

    file: str
    answer: dict[str, Any]
    reply: Reply


@dataclass(frozen=True)
class Share:
    """A figure that counts data sets: the share of data sets that meet ``counts``, of those that meet ``among``.

    ``gate`` and ``goal`` are upper limits if ``at_most``, else lower limits; None means "for information only".
    """

    title: str
    among: Callable[[dict[str, Any]], bool]
    counts: Callable[[Scored], bool]
    gate: float | None = None
    goal: float | None = None
    at_most: bool = False


@dataclass(frozen=True)
class Median:
    """A figure that is the median of ``value`` over the data sets where lutgen named the right effect."""

    title: str
    among: Callable[[dict[str, Any]], bool]
    value: Callable[[Reply], float]
    gate: float
    goal: float
    at_most: bool


def _of(*kinds: str, band: str | None = None) -> Callable[[dict[str, Any]], bool]:
    return lambda answer: answer["kind"] in kinds and (band is None or answer["band"] == band)


def _right(scored: Scored) -> bool:
    return honest(scored.reply, scored.answer)


def _wrong(scored: Scored) -> bool:
    return not honest(scored.reply, scored.answer)


def _says(*verdicts: str) -> Callable[[Scored], bool]:
    return lambda scored: scored.reply.verdict in verdicts


def _placed(scored: Scored) -> bool:
    return scored.reply.verdict == "measurement-problem" and names_the_place(scored.reply, scored.answer)


def _has_place(answer: dict[str, Any]) -> bool:
    return answer["kind"] == "broken" and bool(answer["lines"] or answer["hours"])


def _in_floors(reply: Reply) -> float:
    return reply.after / reply.floor


def _removed(reply: Reply) -> float:
    return reply.removed


def _baked(reply: Reply) -> float:
    return reply.baked


#: The gates of criticism.md, for the full design and the good instrument; then figures for information.
FIGURES: tuple[Share | Median, ...] = (
    Share("false alarms on null and hard null", _of("null", "hard-null"), _wrong, 0.02, 0.01, at_most=True),
    Share("right family, effect at 3–10×", _of(*ONE_EFFECT, band="3-10"), _right, 0.95, 0.99),
    Share("right family, effect at 1–3×", _of(*ONE_EFFECT, band="1-3"), _right, 0.75, 0.90),
    Median("error after adding it, in floors", _of(*ONE_EFFECT), _in_floors, 1.10, 1.03, at_most=True),
    Median("excess error removed, other form", _of("other-form"), _removed, 0.90, 0.97, at_most=False),
    Median("baked LUT against the display, unseen, in floors", _of(*ONE_EFFECT), _baked, 1.20, 1.05, at_most=True),
    Share("confidently wrong, outside the catalogue", _of("outside"), _wrong, 0.10, 0.03, at_most=True),
    Share("two effects: exact pair", _of("pair"), _right, 0.80, 0.95),
    Share("blind designs answered honestly", _of("blind"), _right, 0.95, 1.0),
    Share("confidently wrong, truth removed", _of("removed"), _wrong, 0.10, 0.03, at_most=True),
    Share("broken tables: no effect named", _of("broken"), _right, 0.95, 1.0),
    Share("right family at the size of real displays", _of("typical"), _right, 0.95, 0.99),
    Share("two effects at the size of real displays: exact pair", _of("typical-pair"), _right),
    Share("right family from the hour-0 display", _of("first-hour"), _right),
    Share("outside the catalogue, said so", _of("outside"), _says("unexplained")),
    Share("truth removed, said so", _of("removed"), _says("unexplained")),
    Share("broken tables: row or session named", _has_place, _placed),
)


@dataclass(frozen=True)
class Result:
    """The result of a figure: value, interval (Wilson 95 % of a share, 10 % and 90 % of values), number of sets."""

    figure: Share | Median
    value: float
    low: float
    high: float
    n: int

    @property
    def met(self) -> bool:
        """Return whether the value meets the gate."""
        gate = self.figure.gate
        return gate is None or (self.value <= gate if self.figure.at_most else self.value >= gate)

    @property
    def clearly_missed(self) -> bool:
        """Return whether the whole interval lies on the wrong side of the gate."""
        gate = self.figure.gate
        return gate is not None and (self.low > gate if self.figure.at_most else self.high < gate)


def result(figure: Share | Median, scored: Iterable[Scored]) -> Result | None:
    """Compute one figure. Return None if no data set concerns it."""
    chosen = [one for one in scored if figure.among(one.answer)]
    if isinstance(figure, Median):
        named = [one.reply for one in chosen if one.reply.floor > 0.0 and honest(one.reply, one.answer)]
        values = [value for value in map(figure.value, named) if np.isfinite(value)]
        if not values:
            return None
        low, middle, high = np.percentile(values, [10.0, 50.0, 90.0])
        return Result(figure, float(middle), float(low), float(high), len(values))
    if not chosen:
        return None
    hits = sum(map(figure.counts, chosen))
    interval = binomtest(hits, len(chosen)).proportion_ci(method="wilson")
    return Result(figure, hits / len(chosen), float(interval.low), float(interval.high), len(chosen))


def results(scored: Sequence[Scored]) -> list[Result]:
    """Return all figures that these data sets concern."""
    return [one for figure in FIGURES if (one := result(figure, scored)) is not None]


def table(scored: Sequence[Scored]) -> str:
    """Return the figures and gates as a Markdown table, one column per noise level.

    The gates apply only to the good instrument.
    """
    levels = list(dict.fromkeys(one.answer["noise"] for one in scored))
    lines = [
        "| figure | " + " | ".join(levels) + " | gate | goal | met (good)? |",
        "|---" * (len(levels) + 4) + "|",
    ]
    for figure in FIGURES:
        by_level = {name: result(figure, [one for one in scored if one.answer["noise"] == name]) for name in levels}
        if not any(by_level.values()):
            continue
        cells = [_cell(one) for one in by_level.values()]
        good = by_level.get("good")
        met = "" if good is None or figure.gate is None else "yes" if good.met else "**no**"
        lines.append("| " + " | ".join([figure.title, *cells, *_limits(figure), met]) + " |")
    return "\n".join(lines)


def _cell(one: Result | None) -> str:
    if one is None:
        return "–"
    return f"{one.value:.3f} [{one.low:.3f}, {one.high:.3f}] n = {one.n}"


def _limits(figure: Share | Median) -> list[str]:
    sign = "≤" if figure.at_most else "≥"
    return ["" if limit is None else f"{sign} {limit:g}" for limit in (figure.gate, figure.goal)]


def confusion(scored: Sequence[Scored], *, noise: str) -> str:
    """Return truth × reply as a Markdown table.

    Each row is a truth, followed by its replies with their counts; right replies come first.
    """
    rows: dict[str, Counter[tuple[bool, str]]] = {}
    for one in scored:
        if one.answer["noise"] == noise:
            rows.setdefault(_truth(one.answer), Counter())[_wrong(one), one.reply.short] += 1
    lines = ["| truth | n | right | honest replies | other replies |", "|---" * 5 + "|"]
    for truth in sorted(rows):
        counts = rows[truth]
        total, good = sum(counts.values()), sum(n for (wrong, _), n in counts.items() if not wrong)
        lines.append(f"| {truth} | {total} | {good} | {_listed(counts, wrong=False)} | {_listed(counts, wrong=True)} |")
    return "\n".join(lines)


def _listed(counts: Counter[tuple[bool, str]], *, wrong: bool) -> str:
    return ", ".join(f"{reply}: {n}" for (bad, reply), n in sorted(counts.items()) if bad is wrong)


def _truth(answer: dict[str, Any]) -> str:
    kind, truth = answer["kind"], " + ".join(answer["truth"])
    return {
        "null": "nothing",
        "hard-null": "nothing (hard null)",
        "blind": f"{truth} (blind: {answer.get('why', '')})",
        "broken": f"broken: {answer.get('fault', '')}",
        "outside": f"{truth} (outside)",
        "removed": f"{truth} (removed)",
    }.get(kind, truth)


def failures(scored: Sequence[Scored]) -> str:
    """Return every data set without an honest reply, as Markdown."""
    lines = ["| noise | kind | truth | forms | × detectable | reply |", "|---" * 6 + "|"]
    for one in sorted(scored, key=lambda one: (one.answer["noise"], one.answer["kind"], one.answer["truth"])):
        if _wrong(one):
            answer = one.answer
            forms = ", ".join(form for _, _, form in answer["campaign"]["hidden"])
            cells = [answer["noise"], answer["kind"], _truth(answer), forms, str(answer.get("multiple", ""))]
            answer_text = f"error: {one.reply.sentence}" if one.reply.verdict == "error" else one.reply.short
            lines.append("| " + " | ".join([*cells, answer_text]) + " |")
    return "\n".join(lines)
