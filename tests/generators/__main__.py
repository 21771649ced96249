"""``python -m tests.generators``: diagnose the campaigns of all generators with lutgen; compare the figures to gates.

The exit code is 1 when a figure misses its gate, or when a generator that the user named is not available here.
"""

from __future__ import annotations

import argparse
import math
import shlex
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING

import lutgen
from tests.generators.meters import METERS
from tests.generators.scoring.ask import ask
from tests.generators.scoring.figures import FIGURES, result
from tests.generators.scoring.questions import SORTS, Wanted, questions
from tests.generators.scoring.report import report
from tests.generators.scoring.sources import SOURCES

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tests.generators.scoring.ask import Answered
    from tests.generators.scoring.figures import Result
    from tests.generators.scoring.questions import Question

RESULTS = Path(__file__).with_name("RESULTS.md")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the scoring. Return the exit code."""
    options = _options(arguments)
    wanted = Wanted(
        seed=options.seed,
        per_kind=options.per_kind,
        rewritten=options.rewritten,
        only=options.only,
        meters=tuple(options.meter or METERS),
        baseline=options.baseline,
        order=options.order,
    )
    asked: list[Question] = []
    left_out = []
    for name in options.generator or SOURCES:
        if SOURCES[name].missing:
            left_out.append(f"{name} is left out: {SOURCES[name].missing}.")
        else:
            asked += questions(SOURCES[name], wanted)
    print(*left_out, sep="\n", file=sys.stderr)
    if not asked:
        print("Nothing to ask. Name a sort or an effect that a generator here has.", file=sys.stderr)
        return 1
    # The questions alternate between generators, so that a run that stops early has covered all generators.
    asked.sort(key=lambda question: (question.number, list(SORTS).index(question.sort)))
    answers = _answers(asked, options.workers, options.minutes)
    if len(answers) < len(asked):
        left_out.append(f"Of {len(asked)} campaigns {len(answers)} were asked about in {options.minutes:g} minutes.")
    text = "\n".join([*left_out, report(answers)])
    print(text)
    if options.write:
        command = "python -m tests.generators " + shlex.join(sys.argv[1:] if arguments is None else arguments)
        birth = f"lutgen {lutgen.__version__}, seed {options.seed}. Made by `{command}`; do not edit."
        RESULTS.write_text(f"# Hidden effects of all generators, found or not\n\n{birth}\n\n{text}\n", encoding="utf-8")
    missed = not all(each.met for name in SOURCES for each in _results(answers, name))
    return 1 if missed or (options.generator and left_out) else 0


def _results(answers: Sequence[Answered], generator: str) -> Iterable[Result]:
    those = [one for one in answers if one.question.generator == generator]
    return [figure_result for figure in FIGURES if (figure_result := result(figure, those)) is not None]


def _answers(asked: Sequence[Question], workers: int, minutes: float) -> list[Answered]:
    """Answer the questions, in this process if ``workers`` is 0; start no further question after ``minutes``."""
    if workers == 0:
        return [ask(question) for question in asked]
    with ProcessPoolExecutor(workers) as pool:
        waiting = [pool.submit(ask, question) for question in asked]
        try:
            for done, _ in enumerate(as_completed(waiting, None if minutes == math.inf else 60.0 * minutes), start=1):
                if sys.stderr.isatty() or done % 20 == 0:
                    print(f"\r{done} of {len(asked)} campaigns", end="", file=sys.stderr, flush=True)
        except TimeoutError:
            for future in waiting:
                future.cancel()
        return [future.result() for future in waiting if not future.cancelled()]


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.generators", description=__doc__)
    parser.add_argument("--seed", type=int, default=1, help="tune on other seeds than you score with")
    parser.add_argument(
        "--per-kind", type=int, default=4, metavar="N", help="campaigns of each sort; healthy ones: N for each meter"
    )
    parser.add_argument(
        "--rewritten", type=int, default=2, metavar="N", help="campaigns that are written down in all other ways"
    )
    parser.add_argument("--only", default="", metavar="KIND", help="one sort of question, or one effect")
    parser.add_argument("--generator", action="append", choices=SOURCES, help="only this one; again for another")
    parser.add_argument("--meter", action="append", choices=METERS, help="only this one; again for another")
    parser.add_argument("--baseline", default="", choices=["", "colour-points", "first-hour", "native"])
    parser.add_argument("--no-order", dest="order", action="store_false", help="no file tells the order of reading")
    parser.add_argument("--workers", type=int, default=2, help="processes; 0: this one")
    parser.add_argument("--minutes", type=float, default=math.inf, help="ask no further questions after so many")
    parser.add_argument("--write", action="store_true", help=f"write {RESULTS.name}")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
