"""Ask lutgen one question as a user would: a file, a baseline, a diagnosis."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from lutgen.errors import LutgenError
from tests.generators.meters import METERS
from tests.generators.rewritings import NOTHING_LOST, OF_TRUTH, SOMETHING_LOST, CannotRewrite
from tests.generators.scoring.sources import SOURCES
from tests.generators.scoring.strength import shown, sized
from tests.generators.table import table
from tests.virtual_display.judge import Reply

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.generators.meters import Array
    from tests.generators.scoring.questions import Question
    from tests.generators.truth import Truth

#: Exceptions that a fault in lutgen raises. A campaign with one counts as wrongly answered; the run continues.
FAULTS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
)

#: A hidden effect below this share of its target strength is excluded from the bands of sizes.
ENOUGH = 0.7

#: Tolerance on the effects' shares and on the error after adding the effects: both are printed with two digits.
ROUNDING = 0.01


@dataclass(frozen=True)
class Outcome:
    """The answer of lutgen to one file, with the shares of the effects, and the RMS error in σ after adding them."""

    reply: Reply
    shares: dict[str, float] = field(default_factory=dict)
    after: float = 0.0

    @property
    def verdict(self) -> tuple[str, frozenset[str]]:
        """Return the verdict and all names that it gives."""
        return self.reply.verdict, self.reply.answered

    def agrees(self, other: Outcome) -> bool:
        """Return whether verdict, names, shares and error are equal within rounding."""
        return (
            self.verdict == other.verdict
            and self.shares.keys() == other.shares.keys()
            and all(abs(share - other.shares[name]) <= ROUNDING for name, share in self.shares.items())
            and abs(self.after - other.after) <= ROUNDING * max(self.after, other.after)
        )


@dataclass(frozen=True)
class Rewritten:
    """The result of one rewriting.

    ``lossless`` says whether the rewriting loses nothing. ``verdict`` and ``figures`` say whether lutgen's verdict and
    figures stayed the same. ``cannot`` gives the reason if the campaign cannot be written in this way.
    """

    name: str
    lossless: bool
    verdict: bool = True
    figures: bool = True
    answer: str = ""
    cannot: str = ""


@dataclass(frozen=True)
class Answered:
    """A question, the size of each hidden effect in smallest detectable sizes, and lutgen's reply."""

    question: Question
    multiples: tuple[float, ...]
    outcome: Outcome
    rewritten: tuple[Rewritten, ...] = ()

    @property
    def reply(self) -> Reply:
        """Return the answer of lutgen."""
        return self.outcome.reply

    @property
    def large_enough(self) -> bool:
        """Return whether the hidden effects are as large as the question says.

        Some designs and displays cannot show that much. An effect of typical size must at least be detectable.
        """
        if self.question.typical:
            return all(multiple > 1.0 for multiple in self.multiples)
        asked = self.question.sizes
        return all(
            multiple > ENOUGH * size for multiple, size in zip(self.multiples, asked, strict=bool(self.multiples))
        )


def ask(question: Question) -> Answered:
    """Make the campaign and let lutgen diagnose it; if the question says so, also diagnose each rewriting."""
    hidden, multiples = _hidden(question)
    truth = _campaign(question, hidden)
    original = put(question, _text(question, truth))
    if question.sort != "rewritten" or original.reply.verdict in ("traceback", "refused"):
        return Answered(question, multiples, original)
    return Answered(question, multiples, original, tuple(_rewritings(question, truth, original)))


def _campaign(question: Question, hidden: dict[str, float]) -> Truth:
    make = SOURCES[question.generator].load().campaign
    return make(question.seed, hidden, design=question.design, habits=question.habits)


def _hidden(question: Question) -> tuple[dict[str, float], tuple[float, ...]]:
    """Return the sizes of the hidden effects in typical sizes; each size is solved as if the effect were alone."""
    discrepancy = SOURCES[question.generator].discrepancy
    if question.typical:
        sizes = dict(zip(question.effects, question.sizes, strict=True))
        # An effect that the design cannot show may have any size.
        asked = sizes.items() if question.sort == "law" else ()
        return sizes, tuple(
            shown(partial(_alone, question, name), size, baseline=question.baseline, discrepancy=discrepancy)
            for name, size in asked
        )
    solved = [
        sized(partial(_alone, question, name), target, baseline=question.baseline, discrepancy=discrepancy)
        for name, target in zip(question.effects, question.sizes, strict=True)
    ]
    sizes = {name: each.size for name, each in zip(question.effects, solved, strict=True)}
    return sizes, tuple(each.multiple for each in solved)


def _alone(question: Question, name: str, size: float) -> Truth:
    return _campaign(question, {name: size})


def _text(question: Question, truth: Truth) -> str:
    return _written(question, truth, METERS[question.meter].read(truth, question.seed))


def _written(question: Question, truth: Truth, xyz: Array) -> str:
    return table(METERS[question.meter].stated(truth), xyz, order=question.order)


def put(question: Question, text: str) -> Outcome:
    """Diagnose one file. If lutgen refuses the file, the verdict is ``refused``; if lutgen crashes, ``traceback``."""
    from lutgen.criticism.diagnose import diagnose
    from lutgen.readings import read_measurements

    start = time.perf_counter()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "readings.csv"
        path.write_bytes(text.encode())
        try:
            readings = read_measurements(path)
            diagnosis = diagnose(readings, baseline=question.baseline, without=question.without)
            seconds = time.perf_counter() - start
            reply = Reply.of(diagnosis.as_json(), seconds=seconds)
            after = diagnosis.after.error.rms_sigma if question.sort == "rewritten" else 0.0
            return Outcome(reply, dict(diagnosis.verdict.shares), after)
        except LutgenError as refusal:
            return Outcome(Reply("refused", sentence=str(refusal).replace(folder, "")))
        except FAULTS as fault:
            return Outcome(Reply("traceback", sentence=f"{type(fault).__name__}: {fault}"))


def _rewritings(question: Question, truth: Truth, original: Outcome) -> Iterator[Rewritten]:
    text = _text(question, truth)
    for name, rewrite in NOTHING_LOST.items():
        yield _compared(question, original, name, partial(rewrite, text), lossless=True)
    if question.effects and not clear(question):
        return
    for name, rewrite in SOMETHING_LOST.items():
        yield _compared(question, original, name, partial(rewrite, text), lossless=False)
    for name, read_more in OF_TRUTH.items():
        yield _compared(question, original, name, partial(_read_more, question, truth, read_more), lossless=False)


def clear(question: Question) -> bool:
    """Return whether exactly one effect of the catalogue is hidden, at a clear size."""
    known = SOURCES[question.generator].load().KINDS
    return len(question.effects) == 1 and question.effects[0] in known and question.sizes[0] >= 3.0


def _read_more(question: Question, truth: Truth, read_more: Callable[[Truth, int], Truth]) -> str:
    """Return the text of the file with additional readings; the existing readings keep their values."""
    meter, longer = METERS[question.meter], read_more(truth, question.seed)
    old = np.isin(np.array(longer.session), truth.session)
    xyz = meter.read(longer, question.seed + 1)
    xyz[old] = meter.read(truth, question.seed)
    return _written(question, longer, xyz)


def _compared(
    question: Question, original: Outcome, name: str, write: Callable[[], str], *, lossless: bool
) -> Rewritten:
    try:
        text = write()
    except CannotRewrite as why:
        return Rewritten(name, lossless, cannot=str(why))
    again = put(question, text)
    words = again.reply.short if again.verdict[0] not in ("refused", "traceback") else f"{again.verdict[0]}: "
    words += again.reply.sentence if words.endswith(": ") else ""
    return Rewritten(name, lossless, again.verdict == original.verdict, again.agrees(original), words)
