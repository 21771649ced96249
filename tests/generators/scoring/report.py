"""The tables of a scoring run, as Markdown: figures of all generators side by side, and the wrong answers."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.scoring.figures import FIGURES, result, right

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tests.generators.scoring.ask import Answered
    from tests.generators.scoring.figures import Result, Share


def report(answers: Sequence[Answered]) -> str:
    """Return all tables."""
    return "\n".join(
        [
            "## Figures against gates\n",
            figures(answers),
            "\nShares with Wilson's 95 % interval. × is the smallest detectable size: a strength of 6.5 in the noise",
            "of a good meter, beside what white and primaries take up.",
            f"\n{times(answers)}",
            f"Not counted, since they cannot show as much as was asked for: {_small(answers)} campaigns.",
            "\n## Where the generators disagree\n",
            disagreements(answers),
            "\n## Truth and reply\n",
            confusion(answers),
            "\n## Rewritings that changed something\n",
            rewritings(answers),
            "\n## Refused, or with a traceback\n",
            faults(answers),
        ]
    )


def _small(answers: Iterable[Answered]) -> int:
    return sum(not one.large_enough for one in answers)


def _generators(answers: Iterable[Answered]) -> list[str]:
    return list(dict.fromkeys(one.question.generator for one in answers))


def _by_generator(figure: Share, answers: Sequence[Answered]) -> dict[str, Result | None]:
    return {
        name: result(figure, [one for one in answers if one.question.generator == name])
        for name in _generators(answers)
    }


def figures(answers: Sequence[Answered]) -> str:
    """Return a table with a row for each figure and a column for each generator."""
    names = _generators(answers)
    lines = [_row("figure", *names, "gate", "goal", "met?"), "|---" * (len(names) + 4) + "|"]
    for figure in FIGURES:
        results = _by_generator(figure, answers)
        if any(results.values()):
            sign = "≤" if figure.at_most else "≥"
            limits = ["" if limit is None else f"{sign} {limit:g}" for limit in (figure.gate, figure.goal)]
            met = all(one.met for one in results.values() if one)
            judged = "" if figure.gate is None else "yes" if met else "**no**"
            lines.append(_row(figure.title, *map(_cell, results.values()), *limits, judged))
    return "\n".join(lines)


def _cell(one: Result | None) -> str:
    if one is None:
        return "–"
    low, high = one.interval
    return f"{one.value:.3f} [{low:.3f}, {high:.3f}] n = {one.n}"


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def times(answers: Sequence[Answered]) -> str:
    """Return the duration of a diagnosis: median and maximum for each generator."""
    parts = []
    for name in _generators(answers):
        seconds = [one.reply.seconds for one in answers if one.question.generator == name and one.reply.seconds]
        if seconds:
            parts.append(f"{name} {np.median(seconds):.1f} s, longest {max(seconds):.1f} s")
    return f"Time of a diagnosis, median: {'; '.join(parts)}." if parts else "No diagnosis came to its end."


def disagreements(answers: Sequence[Answered]) -> str:
    """Return figures whose intervals do not overlap between generators.

    Also return hidden effects that one generator's campaigns show and another generator's campaigns do not show.
    """
    lines = []
    for figure in FIGURES:
        results = {name: one for name, one in _by_generator(figure, answers).items() if one}
        low = max((one.interval[0] for one in results.values()), default=0.0)
        high = min((one.interval[1] for one in results.values()), default=1.0)
        if low > high:
            shares = ", ".join(f"{name} {one.value:.2f} (n = {one.n})" for name, one in results.items())
            lines.append(f"- {figure.title}: {shares}")
    truths: dict[tuple[str, str], dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    for one in answers:
        if one.large_enough:
            truths[one.question.sort, one.question.truth][one.question.generator].append(right(one))
    for (sort, truth), replies in sorted(truths.items()):
        shares_of = {name: sum(each) / len(each) for name, each in replies.items()}
        if max(shares_of.values()) - min(shares_of.values()) > 0.5:
            counts = ", ".join(f"{name} {sum(each)} of {len(each)}" for name, each in replies.items())
            lines.append(f"- {sort}, {truth}, right: {counts}")
    return "\n".join(lines) or "Nowhere."


def confusion(answers: Sequence[Answered]) -> str:
    """Return the wrong answers: a row for each sort, truth and generator with a wrong reply."""
    rows: dict[tuple[str, str, str], list[Answered]] = defaultdict(list)
    for one in answers:
        asked = one.question
        truth = f"nothing ({asked.meter})" if asked.sort == "healthy" else asked.truth
        if asked.sort != "rewritten" and one.large_enough:
            rows[asked.sort, truth, asked.generator].append(one)
    lines = [_row("sort", "truth", "generator", "right", "wrong replies"), "|---" * 5 + "|"]
    for (sort, truth, generator), replies in sorted(rows.items()):
        wrong = Counter(_reply(one) for one in replies if not right(one))
        if wrong:
            listed = ", ".join(f"{reply}: {count}" for reply, count in sorted(wrong.items()))
            lines.append(_row(sort, truth, generator, f"{len(replies) - wrong.total()} of {len(replies)}", listed))
    return "\n".join(lines) if len(lines) > 2 else "All replies are right."


def _reply(one: Answered) -> str:
    sizes = " and ".join(f"{multiple:.1f}×" for multiple in one.multiples)
    return f"{one.reply.short} (at {sizes})" if sizes else one.reply.short


def rewritings(answers: Sequence[Answered]) -> str:
    """Return a row for each rewriting: the number of campaigns tried, the number that changed, and examples."""
    rows: dict[str, list[tuple[Answered, bool, str]]] = defaultdict(list)
    cannot: Counter[str] = Counter()
    for one in answers:
        for each in one.rewritten:
            if each.cannot:
                cannot[each.name] += 1
                continue
            kept = each.figures if each.lossless else each.verdict
            rows[each.name].append((one, kept, each.answer))
    lines = [_row("rewriting", "tried", "not allowed", "changed", "such as"), "|---" * 5 + "|"]
    for name in dict.fromkeys([*rows, *cannot]):
        changed = [(one, answer) for one, kept, answer in rows[name] if not kept]
        example = ""
        if changed:
            one, answer = changed[0]
            before = one.reply.short
            example = f"{one.question.truth}: {before} → {answer if answer != before else 'the same, other figures'}"
        lines.append(_row(name, str(len(rows[name])), str(cannot[name]), str(len(changed)), example[:160]))
    return "\n".join(lines) if len(lines) > 2 else "None was tried."


def faults(answers: Sequence[Answered]) -> str:
    """Return the refusals and crashes of lutgen, with one campaign for each message."""
    campaigns: dict[str, list[Answered]] = defaultdict(list)
    for one in answers:
        if one.reply.verdict in ("refused", "traceback"):
            campaigns[f"{one.reply.verdict}: {one.reply.sentence}"].append(one)
    lines = [_row("what", "campaigns", "first"), "|---" * 3 + "|"]
    for sentence, those in sorted(campaigns.items()):
        asked = those[0].question
        first = f"{asked.generator}, {asked.sort} {asked.number}, seed {asked.seed}, {asked.truth}"
        lines.append(_row(sentence[:200], str(len(those)), first))
    return "\n".join(lines) if len(lines) > 2 else "Nothing."
