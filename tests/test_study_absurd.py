"""Answers with an impossible time are named and left out of an analysis."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lutgen.errors import LutgenError
from lutgen.study.analysis import analyse_answers
from lutgen.study.answers import MAX_SECONDS, Answer, sensible

pytestmark = pytest.mark.numbers

ANSWERS = tuple(
    Answer(
        "Dr A",
        session,
        position,
        f"case-{position}",
        condition,
        5.0 + position**1.5 + session,
        3 + position % 5 + session,
        "0",
        positive=False,
    )
    for session in (1, 2)
    for position in range(1, 9)
    for condition in (("none" if session == 2 or position % 2 else "chroma@18000"),)
)


@pytest.mark.parametrize(
    "seconds", [1e308, 10**400, MAX_SECONDS + 1, -1.0, float("inf")], ids=lambda seconds: str(seconds)[:8]
)
def test_an_absurd_time_is_named_and_the_rest_analysed_as_without_it(seconds: float) -> None:
    absurd = (replace(ANSWERS[0], seconds=seconds), *ANSWERS[1:])
    analysis, without = analyse_answers(absurd), analyse_answers(ANSWERS[1:])
    assert analysis.table2 == without.table2
    assert analysis.samples == without.samples
    (named,) = set(analysis.remarks) - set(without.remarks)
    assert named.startswith("Left out: Dr A, session 1, image 1 (case-1): ")


def test_nothing_is_left_out_of_what_can_be() -> None:
    assert sensible(ANSWERS) == (ANSWERS, [])


def test_an_analysis_of_nothing_is_refused() -> None:
    with pytest.raises(LutgenError, match="no answer has a possible time to score"):
        analyse_answers([replace(each, seconds=1e308) for each in ANSWERS])
