"""How many threads the work on a picture may use."""

from __future__ import annotations

import os
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Threads that the current work may use; 0: one for each core.
_FEW = ContextVar("lutgen_threads", default=0)


def threads() -> int:
    """Return the threads to use: those of :func:`few_threads`, else the cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return _FEW.get() or cores


@contextmanager
def few_threads(count: int) -> Iterator[None]:
    """Use at most ``count`` threads inside, because other processes share the cores; 0: one for each core."""
    before = _FEW.set(count)
    try:
        yield
    finally:
        _FEW.reset(before)
