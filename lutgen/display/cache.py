"""A cache of results for the same code values, which the steps of a fit ask for again and again."""

from collections.abc import Callable

from lutgen.colorimetry import Array

#: Number of cached results, and largest number of values of a cached set of code values: a table is cached, an image is
#: not.
KEPT, MOST = 8, 30_000


class Remembered:
    """A cache of the last results by code values, in read-only arrays; a fit uses the same code values often."""

    def __init__(self) -> None:
        self._results: dict[tuple[tuple[int, ...], bytes], Array] = {}

    def of(self, code: Array, compute: Callable[[], Array]) -> Array:
        """Return the result for code values (..., 3), from the cache or from ``compute``."""
        if code.size > MOST:
            return compute()
        key = code.shape, code.tobytes()
        result = self._results.pop(key, None)
        if result is None:
            result = compute()
            result.flags.writeable = False
        self._results[key] = result
        # Another thread may have removed an old result already.
        for old in list(self._results)[:-KEPT]:
            self._results.pop(old, None)
        return result
