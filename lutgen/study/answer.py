"""``Answer``: what one reader said of one image in one session."""

from __future__ import annotations

from dataclasses import dataclass


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
