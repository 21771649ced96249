"""Let lutgen diagnose the sealed data sets, two at a time, and judge its replies. Only this module imports lutgen."""

from __future__ import annotations

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from tests.virtual_display.baked import error_of_lut
from tests.virtual_display.excess import excess_removed
from tests.virtual_display.figures import Scored
from tests.virtual_display.judge import CONFIDENT, Reply
from tests.virtual_display.sealed import ANSWERS, campaign_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lutgen.criticism.diagnose import Diagnosis

    #: Arguments: file, baseline, effects removed from the catalogue. Result: the reply.
    Ask = Callable[[Path, str, tuple[str, ...]], Reply]

#: Exceptions that a fault in lutgen raises. Such a data set counts as wrongly answered; the scoring continues.
FAULTS = (LutgenError, ValueError, TypeError, ArithmeticError, LookupError, AttributeError, RuntimeError)


def ask_lutgen(path: Path, baseline: str, without: tuple[str, ...]) -> Reply:
    """Diagnose one file as a user would; include the error after adding the found effects.

    An exception from lutgen becomes the verdict ``error``.
    """
    from lutgen.criticism.diagnose import diagnose
    from lutgen.readings import read_measurements

    start = time.perf_counter()
    try:
        diagnosis = diagnose(read_measurements(path), baseline=baseline, without=without)
        reply = Reply.of(diagnosis.as_json(), seconds=time.perf_counter() - start)
        return _with_errors(reply, diagnosis, path) if reply.verdict in CONFIDENT else reply
    except FAULTS as fault:
        return Reply("error", sentence=f"{type(fault).__name__}: {fault}", seconds=time.perf_counter() - start)


def _with_errors(reply: Reply, diagnosis: Diagnosis, path: Path) -> Reply:
    """Return the reply with further figures.

    They are: the error in σ before and after the found effects are added and all parameters are refitted, the error of
    noise alone, the removed share of the excess error, and, if the baseline is ``colour-points``, the error of the LUT
    of the refined model, in noise floors.
    """
    before, after = diagnosis.comparison, diagnosis.after
    reply = replace(reply, before=before.error.rms_sigma, after=after.error.rms_sigma, floor=after.floor.rms_sigma)
    answer = json.loads((path.parent / ANSWERS).read_text(encoding="utf-8"))[path.name]
    if answer["campaign"]["baseline"] != "colour-points":
        return reply
    campaign = campaign_of(answer)
    return replace(
        reply,
        removed=excess_removed(diagnosis, campaign),
        baked=error_of_lut(diagnosis, campaign) / after.floor.delta_e_mean,
    )


def score(folder: Path, ask: Ask = ask_lutgen, *, workers: int = 2) -> list[Scored]:
    """Diagnose every data set in ``folder``; if ``workers`` is 0, in this process."""
    answers: dict[str, dict[str, Any]] = json.loads((folder / ANSWERS).read_text(encoding="utf-8"))
    files = sorted(answers)
    questions = [
        (folder / name, answers[name]["campaign"]["baseline"], tuple(answers[name]["without"])) for name in files
    ]
    replies = [ask(*question) for question in questions] if workers == 0 else _in_parallel(ask, questions, workers)
    return [Scored(name, answers[name], reply) for name, reply in zip(files, replies, strict=True)]


def _in_parallel(ask: Ask, questions: list[tuple[Path, str, tuple[str, ...]]], workers: int) -> list[Reply]:
    replies = []
    with ProcessPoolExecutor(workers) as pool:
        for done, reply in enumerate(pool.map(ask, *zip(*questions, strict=True)), start=1):
            replies.append(reply)
            if sys.stderr.isatty() or done % 50 == 0:
                print(f"\r{done} of {len(questions)} data sets", end="", file=sys.stderr, flush=True)
    return replies
