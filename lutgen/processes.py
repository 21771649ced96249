"""Other processes of this machine: one function over many items, and Python programs of our own."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

_T = TypeVar("_T")
_R = TypeVar("_R")


def python_environment(**more: str) -> dict[str, str]:
    """Return the environment of a child that runs Python with ``-P``: it finds its modules where this process does."""
    places = os.pathsep.join(folder or str(Path.cwd()) for folder in sys.path)
    return os.environ | {"PYTHONPATH": places, **more}


def in_parallel(function: Callable[[_T], _R], items: Sequence[_T], jobs: int | None) -> Iterator[_R]:
    """Yield the results in the order of ``items``, from ``jobs`` processes (default: one per core).

    ``function`` must be a function of a module, or a ``partial`` of one; items and results must be picklable. What all
    items share belongs into the ``partial``: each process gets it once, and forks inherit it. With one process no other
    is started.
    """
    jobs = min(jobs or os.cpu_count() or 1, len(items))
    if jobs <= 1:
        yield from map(function, items)
        return
    with ProcessPoolExecutor(jobs, multiprocessing.get_context(_start_method()), _begin_worker, (function,)) as pool:
        try:
            yield from pool.map(_run_item, items)
        except BrokenProcessPool:
            message = "a worker process was killed (out of memory?). Run again, with --jobs 1 if it happens again."
            raise LutgenError(message) from None
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _start_method() -> str:
    """Fork where no other thread runs: a forked worker inherits numpy, OpenColorIO and all that was prepared."""
    # Beside other threads (OpenGL's drivers and servers have some) a lock that one of them holds would stay locked in
    # the fork for ever.
    with suppress(OSError):
        return "fork" if len(list(Path("/proc/self/task").iterdir())) == 1 else "spawn"
    return "spawn"


#: The function of this worker.
_FUNCTION: list[Callable[[Any], Any]] = []


def _run_item(item: Any) -> Any:
    return _FUNCTION[-1](item)


def _begin_worker(function: Callable[[Any], Any]) -> None:
    _FUNCTION.append(function)
    # The parent handles an interrupt: workers ignore it, finish their current file and print nothing.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The pool ends its workers with SIGTERM; the parent's handler must not run in them.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    # Workers of a killed parent would go on writing into a folder that the next build uses.
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
