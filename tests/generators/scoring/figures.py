"""The figures of the issue, their counts and their gates, for each generator separately."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scipy.stats import binomtest

from tests.generators.meters import METERS
from tests.generators.scoring.questions import TIED
from tests.generators.scoring.sources import SOURCES
from tests.virtual_display.judge import CONFIDENT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from tests.generators.scoring.ask import Answered

#: A set of names counts as an answer when it has at most this many names.
AT_MOST = 2

#: Effects that add the same light to every reading. From greys alone the data may or may not distinguish them.
ADDITIVE = "meter-offset"


def right(one: Answered) -> bool:
    """Return whether the reply is an honest answer about the hidden effects."""
    return _RIGHT[one.question.sort](one)


def _consistent(one: Answered) -> bool:
    return one.reply.verdict == "consistent"


def _names(one: Answered) -> bool:
    return one.reply.verdict in (*CONFIDENT, "one-of")


def _family(one: Answered) -> bool:
    answered, truth = one.reply.answered, set(one.question.effects)
    if one.reply.verdict == "one-of":
        return truth <= answered and len(answered) <= AT_MOST
    return one.reply.verdict in ("named", "form") and answered == truth


def _exact(one: Answered) -> bool:
    return one.reply.verdict == "several" and one.reply.answered == set(one.question.effects)


def _reserved(one: Answered) -> bool:
    """Return whether the reply names nothing with confidence, except the family of the hidden effect."""
    kin = {SOURCES[one.question.generator].kin().get(name, "") for name in one.question.effects}
    if one.question.sort == "outside" and one.reply.verdict == "form" and one.reply.answered == kin:
        return True
    return one.reply.verdict in ("consistent", "one-of", "unexplained", "measurement-problem")


def _confidently_wrong(one: Answered) -> bool:
    return one.reply.verdict in CONFIDENT and not _reserved(one)


def _blind(one: Answered) -> bool:
    (name,) = one.question.effects
    if (one.question.design, name) not in TIED:
        return _consistent(one)
    if one.reply.verdict == "one-of":
        return name in one.reply.answered
    return one.reply.verdict in ("unexplained", "measurement-problem") or (name == ADDITIVE and _family(one))


def _unchanged(one: Answered) -> bool:
    return one.reply.verdict not in ("traceback", "refused") and all(
        each.figures if each.lossless else each.verdict for each in one.rewritten
    )


_RIGHT: dict[str, Callable[[Answered], bool]] = {
    "healthy": _consistent,
    "clear": _family,
    "faint": _family,
    "pair": _exact,
    "law": _family,
    "outside": _reserved,
    "removed": _reserved,
    "blind": _blind,
    "rewritten": _unchanged,
}


@dataclass(frozen=True)
class Share:
    """A figure: the share of true trials, where ``trials`` returns the trials of one answer.

    ``gate`` and ``goal`` are upper limits if ``at_most``, else lower limits; None means "for information only".
    """

    title: str
    trials: Callable[[Answered], Sequence[bool]]
    gate: float | None = None
    goal: float | None = None
    at_most: bool = False


def _of(
    sort: str, counts: Callable[[Answered], bool], meter: str = "", truth: str = ""
) -> Callable[[Answered], Sequence[bool]]:
    def trials(one: Answered) -> Sequence[bool]:
        asked = one.question
        among = asked.sort == sort and one.large_enough and meter in ("", asked.meter) and truth in ("", *asked.effects)
        return [counts(one)] if among else []

    return trials


def _not(counts: Callable[[Answered], bool]) -> Callable[[Answered], bool]:
    return lambda one: not counts(one)


def _verdict(*verdicts: str) -> Callable[[Answered], Sequence[bool]]:
    """Return a function that makes one trial of each diagnosis, including those of rewritings."""

    def trials(one: Answered) -> Sequence[bool]:
        tried = [each.answer for each in one.rewritten if not each.cannot]
        return [one.reply.verdict in verdicts, *(answer.partition(":")[0] in verdicts for answer in tried)]

    return trials


def _changes(*, lossless: bool, figures: bool) -> Callable[[Answered], Sequence[bool]]:
    def trials(one: Answered) -> Sequence[bool]:
        tried = [each for each in one.rewritten if each.lossless == lossless and not each.cannot]
        return [not (each.figures if figures else each.verdict) for each in tried]

    return trials


FIGURES: tuple[Share, ...] = (
    Share("tracebacks", _verdict("traceback"), 0.0, 0.0, at_most=True),
    Share("refused files", _verdict("refused"), 0.0, 0.0, at_most=True),
    Share("right family, clear (3–10×)", _of("clear", _family), 0.95, 0.99),
    Share("right family, faint (1–3×)", _of("faint", _family), 0.85, 0.95),
    Share("exact pair", _of("pair", _exact), 0.90, 0.97),
    Share("from hour 0 alone (law)", _of("law", _family), 0.85, 0.95),
    Share("healthy, all meters: not consistent", _of("healthy", _not(_consistent)), 0.05, 0.02, at_most=True),
    Share("healthy, all meters: an effect named", _of("healthy", _names), 0.01, 0.005, at_most=True),
    *(Share(f"healthy, {name}: not consistent", _of("healthy", _not(_consistent), name)) for name in METERS),
    *(Share(f"healthy, {name}: an effect named", _of("healthy", _names, name)) for name in METERS),
    Share("confidently wrong, outside the catalogue", _of("outside", _confidently_wrong), 0.05, 0.03, at_most=True),
    Share("confidently wrong, truth removed", _of("removed", _confidently_wrong), 0.10, 0.05, at_most=True),
    Share("blind designs honest", _of("blind", _blind), 0.95, 1.0),
    Share("nothing lost: verdict changes", _changes(lossless=True, figures=False), 0.0, 0.0, at_most=True),
    Share("nothing lost: verdict, share or error changes", _changes(lossless=True, figures=True), 0, 0, at_most=True),
    Share("something lost: verdict changes", _changes(lossless=False, figures=False), 0.0, 0.0, at_most=True),
)


@dataclass(frozen=True)
class Result:
    """The result of a figure, with Wilson's 95 % interval."""

    figure: Share
    hits: int
    n: int

    @property
    def value(self) -> float:
        """Return the share."""
        return self.hits / self.n

    @property
    def interval(self) -> tuple[float, float]:
        """Return Wilson's 95 % interval."""
        share = binomtest(self.hits, self.n).proportion_ci(method="wilson")
        return float(share.low), float(share.high)

    @property
    def met(self) -> bool:
        """Return whether the value meets the gate."""
        gate = self.figure.gate
        return gate is None or (self.value <= gate if self.figure.at_most else self.value >= gate)


def result(figure: Share, answers: Iterable[Answered]) -> Result | None:
    """Compute one figure. Return None if no answer concerns it."""
    trials = [trial for one in answers for trial in figure.trials(one)]
    return Result(figure, sum(trials), len(trials)) if trials else None
