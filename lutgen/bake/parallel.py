"""One function over many items, on this machine's cores."""

from __future__ import annotations

import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

_T = TypeVar("_T")
_R = TypeVar("_R")


def in_parallel(function: Callable[[_T], _R], items: Sequence[_T], jobs: int | None) -> Iterator[_R]:
    """Give the results in the order of ``items``, from ``jobs`` processes (default: one per core).

    ``function`` lives in a module, and items and results can be pickled. With one process nothing is forked.
    """
    jobs = min(jobs or os.cpu_count() or 1, len(items))
    if jobs <= 1:
        yield from map(function, items)
        return
    # A forked worker has numpy and OpenColorIO loaded; later Pythons warn of forking beside other threads.
    method = "fork" if sys.platform == "linux" and sys.version_info < (3, 12) else "spawn"
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context(method)) as pool:
        yield from pool.map(function, items)
