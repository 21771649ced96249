"""Child processes: a parallel map of one function over many items, and the environment of Python children."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, TypeVar

from lutgen.errors import LutgenError

_T = TypeVar("_T")
_R = TypeVar("_R")


def python_environment(**more: str) -> dict[str, str]:
    """Return the environment for a child that runs ``python -P``, so that the child imports from this ``sys.path``."""
    places = os.pathsep.join(folder or str(Path.cwd()) for folder in sys.path)
    return os.environ | {"PYTHONPATH": places, **more}


def in_parallel(function: Callable[[_T], _R], items: Sequence[_T], jobs: int | None) -> Iterator[_R]:
    """Apply ``function`` to ``items`` in ``jobs`` processes (default: one per core); yield the results in order.

    ``function`` must be a module-level function or a ``partial`` of a module-level function. Items and results must be
    picklable. Put data that all items share into the ``partial``: each process receives it once, and a forked process
    inherits it. With one job, this process does the work itself.
    """
    jobs = min(jobs or os.cpu_count() or 1, len(items))
    if jobs <= 1:
        yield from map(function, items)
        return
    with ProcessPoolExecutor(jobs, multiprocessing.get_context(_start_method()), _begin_worker, (function,)) as pool:
        try:
            yield from pool.map(_run_item, items)
        except BrokenProcessPool:
            raise LutgenError(
                "a worker process was killed (out of memory?). Run again, with --jobs 1 if it happens again."
            ) from None
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _start_method() -> str:
    """Return "fork", which inherits all prepared data, when this process has one thread, else "spawn"."""
    # Fork copies a lock that another thread holds (OpenGL drivers and servers have threads). That lock would stay
    # locked in the child for ever.
    with suppress(OSError):
        return "fork" if len(list(Path("/proc/self/task").iterdir())) == 1 else "spawn"
    return "spawn"


#: Its last element is the function that this worker process applies.
_FUNCTION: list[Callable[[Any], Any]] = []


def _run_item(item: Any) -> Any:
    return _FUNCTION[-1](item)


def _begin_worker(function: Callable[[Any], Any]) -> None:
    _FUNCTION.append(function)
    # Only the parent handles Ctrl-C. Workers ignore it, finish their current file and print nothing.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The pool ends its workers with SIGTERM. The handler that they inherit from the parent must not run in them.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    # Without this thread, the workers of a killed parent would still write into a folder that the next build uses.
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
