"""Who agreed with himself: an answer under a condition against the same reader's un-aged answer to the same image.

The paper (section 2.3) reads every image twice, the second time un-aged, and asks whether both diagnoses are on the
same side, positive or negative. In general a reader may have read an image any number of times. The rule here:

- An image's *reference* is the reader's un-aged answer to it in a session that showed nothing aged, the last such one;
  where there is none, the reader's last un-aged answer to it. In the paper that is session 2.
- Each answer under an aged condition is paired with the reference; one image read twice under the same condition gives
  two pairs. An image that was never read un-aged gives none.
- Of the other un-aged answers the first is paired with the reference: each image gives ``none`` one pair at most.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.study.analysis.t_test import Figures

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lutgen.study.answer import Answer

#: The name of the un-aged condition: see :class:`lutgen.study.protocol.Condition`.
UNAGED = "none"


@dataclass(frozen=True)
class Pair:
    """One answer and its reference: same reader, same image."""

    answer: Answer
    reference: Answer

    @property
    def agreed(self) -> bool:
        """Whether both are positive, or both negative: what the paper counts."""
        return self.answer.positive == self.reference.positive


@dataclass(frozen=True)
class Counts:
    """A row of the paper's Table 3 as it was counted."""

    condition: str
    agreed: int
    disagreed: int

    @property
    def n(self) -> int:
        """How many pairs there are."""
        return self.agreed + self.disagreed

    @property
    def share(self) -> float:
        """Share that agreed, 0..1."""
        return self.agreed / self.n

    def figures(self) -> Figures:
        """Return n, mean and SD of a 1 a pair that agreed and a 0 a pair that did not."""
        variance = self.share * (1 - self.share) * self.n / (self.n - 1) if self.n > 1 else float("nan")
        return Figures(self.n, self.share, variance**0.5)


def mixed_sessions(answers: Iterable[Answer]) -> set[tuple[str, int]]:
    """Return the (reader, session) that showed anything aged: where the paper measures time and ease."""
    return {(answer.reader, answer.session) for answer in answers if answer.condition != UNAGED}


def pairs(answers: Sequence[Answer]) -> tuple[Pair, ...]:
    """Pair answers with their references, by the rule of this module, in the order of the answers."""
    mixed = mixed_sessions(answers)
    unaged: dict[tuple[str, str], list[Answer]] = defaultdict(list)
    for answer in answers:
        if answer.condition == UNAGED:
            unaged[answer.reader, answer.image].append(answer)
    reference, first = {}, {}
    for key, found in unaged.items():
        found.sort(key=lambda answer: ((answer.reader, answer.session) not in mixed, answer.session, answer.position))
        reference[key] = found[-1]
        if len(found) > 1:
            first[key] = min(found[:-1], key=lambda answer: (answer.session, answer.position))
    made = []
    for answer in answers:
        key = (answer.reader, answer.image)
        if key in reference and (answer.condition != UNAGED or answer is first.get(key)):
            made.append(Pair(answer, reference[key]))
    return tuple(made)


def counts(conditions: Sequence[str], found: Sequence[Pair]) -> tuple[Counts, ...]:
    """Count who agreed, a row a condition that has pairs."""
    made = []
    for condition in conditions:
        agreed = [pair.agreed for pair in found if pair.answer.condition == condition]
        if agreed:
            made.append(Counts(condition, sum(agreed), len(agreed) - sum(agreed)))
    return tuple(made)
