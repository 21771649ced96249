"""Progress of long work. The caller passes a function, which is called with the number of pieces done and in total."""

from collections.abc import Callable

#: A function of the number of pieces done and the number of all pieces.
Progress = Callable[[int, int], None]


def unseen(_done: int, _all: int) -> None:
    """Show no progress."""


def part_of(progress: Progress, start: int, length: int, whole: int = 1000) -> Progress:
    """Return a progress function for one part of a longer work.

    The part goes from ``start`` to ``start + length`` on the scale of ``progress``, which ends at ``whole``.
    """
    return lambda done, total: progress(start + length * done // max(total, 1), whole)
