"""``Answer``: what one reader said of one image in one session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Sequence

#: Longest that reading an image may have taken: a day.
MAX_SECONDS = 86_400.0


@dataclass(frozen=True)
class Answer:
    """One image read.

    Attributes
    ----------
    reader
        As the reader was named when the session was run.
    session, position
        Which session, and the how manieth of its images, both from 1.
    image, condition
        Names of the protocol's image and condition.
    seconds
        Time to score: from the first paint of the image to the decision, pauses left out.
    ease
        Ease of reading, on the protocol's scale; larger is easier.
    category
        Name of the protocol's category: the diagnosis.
    positive
        Whether that category is a positive one.

    """

    reader: str
    session: int
    position: int
    image: str
    condition: str
    seconds: float
    ease: int
    category: str
    positive: bool


def sensible(answers: Sequence[Answer]) -> tuple[tuple[Answer, ...], list[str]]:
    """Return the answers whose time can be one, and a sentence for each that is left out.

    Raises
    ------
    LutgenError
        None is left.

    """
    kept = tuple(answer for answer in answers if 0 <= answer.seconds <= MAX_SECONDS)
    left_out = [
        f"Left out: {answer.reader}, session {answer.session}, image {answer.position} ({answer.image}): "
        f"{str(answer.seconds)[:12]} seconds is no time to score."
        for answer in answers
        if not 0 <= answer.seconds <= MAX_SECONDS
    ]
    if left_out and not kept:
        raise LutgenError(f"no answer has a time that can be one. {left_out[0]}")
    return kept, left_out
