"""The progress of long work: whoever asks for the work gives a function that is called with what is done and all."""

from __future__ import annotations

from collections.abc import Callable

#: Called with the number of pieces done, and of all pieces.
Progress = Callable[[int, int], None]


def unseen(_done: int, _all: int) -> None:
    """Show no progress."""


def part_of(progress: Progress, start: int, length: int, whole: int = 1000) -> Progress:
    """Return the progress of one part of a longer work, from ``start`` on, as ``progress`` counts: up to ``whole``."""
    return lambda done, total: progress(start + length * done // max(total, 1), whole)
