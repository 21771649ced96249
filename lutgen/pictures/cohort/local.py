"""Slides on this machine's cores, in processes of ``concurrent.futures``.

A pool breaks when one of its processes is killed (out of memory, a fault in a decoder). The slides in hand are then
tried once more, each alone in a new pool; a slide under which that process dies too is named.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import wait as wait_for_connections
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.pictures.cohort.task import Outcome, look_at, outcomes
from lutgen.pictures.threads import threads

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from concurrent.futures import Future
    from multiprocessing.connection import Connection

    from lutgen.pictures.cohort.find import CohortSlide
    from lutgen.pictures.cohort.task import Asked, Outcomes

#: Variable with the number of BLAS threads, which numpy reads when it is imported; they would wait for one another.
_BLAS = "OPENBLAS_NUM_THREADS"

#: Why a slide is given up.
_DEADLY = (
    "its worker process died twice: out of memory, or a fault in the decoder. Run again with --jobs 1, or get a whole "
    "copy."
)

#: Set in a worker process when it starts: what is asked of every slide, and the process's share of the threads.
_given: tuple[Asked, int]


def on_this_machine(asked: Asked, slides: Sequence[CohortSlide], jobs: int) -> Outcomes:
    """Give each slide with its outcome, as they are done, from ``jobs`` processes; one process is this one.

    When the iterator is closed or interrupted, the processes are ended.

    Raises
    ------
    LutgenError
        Processes cannot be started.

    """
    if jobs <= 1:
        for slide in slides:
            yield slide, look_at(asked, slide)
        return
    yield from outcomes(partial(_done, asked, jobs), slides, _DEADLY)


def _done(asked: Asked, jobs: int, slides: Sequence[CohortSlide]) -> Iterator[tuple[CohortSlide, Outcome | None]]:
    """Give each slide with its outcome, None where a process died while it was in hand."""
    waiting = deque(slides)
    while waiting:
        held: dict[Future[Outcome], CohortSlide] = {}
        with _pool(asked, min(jobs, len(waiting)), max(threads() // jobs, 1)) as pool:
            try:
                while waiting or held:
                    # At most one slide for each process, so that few slides are tried again when a process dies.
                    while waiting and len(held) < jobs:
                        with _quiet_start():
                            held[pool.submit(_look, waiting[0])] = waiting[0]
                        waiting.popleft()
                    for future in wait(held, return_when=FIRST_COMPLETED).done:
                        yield held[future], future.result()
                        del held[future]
            except BrokenProcessPool:
                for future in wait(held).done:
                    yield held[future], None if future.exception() else future.result()


@contextmanager
def _pool(asked: Asked, jobs: int, share: int) -> Iterator[ProcessPoolExecutor]:
    """Start a pool; end its processes at once when what is done with it fails or is interrupted."""
    # Forking beside threads is unsafe, and other systems have no fork.
    context = multiprocessing.get_context("spawn")
    # Worker processes watch the other end of this pipe, and exit when this process closes its end or is killed.
    here, there = context.Pipe()
    pool = ProcessPoolExecutor(jobs, context, _begin, (there, asked, share))
    try:
        _check_start(pool)
        yield pool
        pool.shutdown()
    finally:
        here.close()
        pool.shutdown(cancel_futures=True)
        there.close()


def _check_start(pool: ProcessPoolExecutor) -> None:
    with _quiet_start():
        first = pool.submit(int)
    try:
        first.result()
    except BrokenProcessPool:
        raise LutgenError(
            "a worker process cannot be started. Where its complaint stands above, mend that (a script of your own "
            "needs `if __name__ == '__main__':`), or run with --jobs 1."
        ) from None


@contextmanager
def _quiet_start() -> Iterator[None]:
    """Start processes with one thread of BLAS each and with SIGINT blocked: the parent handles Ctrl-C."""
    before = os.environ.get(_BLAS)
    os.environ[_BLAS] = before or "1"
    # A new process inherits the blocked signals, so that Ctrl-C cannot interrupt it before _begin runs.
    blocks = hasattr(signal, "pthread_sigmask")
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if blocks else set()
    try:
        yield
    finally:
        if blocks:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if before is None:
            del os.environ[_BLAS]


def _begin(end: Connection, asked: Asked, share: int) -> None:
    global _given  # noqa: PLW0603 - a pool has no other place for what its processes share
    _given = asked, share
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(end,), daemon=True).start()


def _end_with(end: Connection) -> None:
    wait_for_connections([end])
    os._exit(1)


def _look(slide: CohortSlide) -> Outcome:
    asked, share = _given
    return look_at(asked, slide, share)
