"""Answers about code values that are kept: a fit asks for the same code values many times."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.colorimetry import Array

#: Sets of code values whose answers are kept, and the numbers of the largest that is: a table's, not an image's.
KEPT, MOST = 8, 30_000


class Remembered:
    """The last few answers, which nobody may alter."""

    def __init__(self) -> None:
        """Begin with none."""
        self._answers: dict[tuple[tuple[int, ...], bytes], Array] = {}

    def of(self, code: Array, answer: Callable[[], Array]) -> Array:
        """Return the answer for code values (..., 3), found anew where it was not kept."""
        if code.size > MOST:
            return answer()
        key = code.shape, code.tobytes()
        found = self._answers.pop(key, None)
        if found is None:
            found = answer()
            found.flags.writeable = False
        self._answers[key] = found
        # Threads may ask at once: whoever comes second finds nothing left to forget.
        for old in list(self._answers)[:-KEPT]:
            self._answers.pop(old, None)
        return found
