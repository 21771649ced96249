"""Compute a cohort's slides in processes of this machine, or on workers of a Dask cluster (an optional extra).

A pool of ``concurrent.futures`` breaks when one of its processes is killed (out of memory, a fault in a decoder). Then
each slide that was not finished by its process is computed once more, alone in a new pool. A slide whose second process
dies too has no result.

A worker of a cluster (https://distributed.dask.org) gets a slide's path, so it must see the file under the same path.
The worker sends its result back, a few kB. When a worker dies, Dask gives its slides to other workers, also finished
slides whose result was not fetched yet. When workers keep dying on one slide, Dask gives the slide up
(`allowed-failures`), and the slide has no result. Only the main process writes files.
"""

import multiprocessing
import os
import pickle
import re
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from logging import CRITICAL, getLogger
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for_connections
from pathlib import Path
from typing import Any
from uuid import uuid4

from lutgen.bindings import optional
from lutgen.errors import LutgenError, reason_of
from lutgen.pictures.blocks import few_threads, threads
from lutgen.pictures.cohort_slides import CohortSlide, CohortTask
from lutgen.pictures.lifetime import lifetime
from lutgen.version import __version__

Outcomes = Generator[tuple[CohortSlide, "Outcome"], None, None]


@dataclass(frozen=True)
class Outcome:
    """The outcome of a slide: the result as ``lifetime --json`` writes it, or the reason why there is no result."""

    image: dict[str, Any] | None
    reason: str = ""


def look_at(task: CohortTask, slide: CohortSlide, threads: int = 0) -> Outcome:
    """Compute one slide's lifetimes in ``threads`` threads (0: one per core); an error becomes the outcome's reason."""
    try:
        with few_threads(threads):
            lifetimes = lifetime([slide.path], task.model, **task.options)
    except LutgenError as error:
        return Outcome(None, str(error).removeprefix(f"{slide.path}: "))
    except MemoryError:
        return Outcome(None, "there was not enough memory. Run again with fewer --jobs.")
    except OSError as error:
        return Outcome(None, f"cannot be read: {reason_of(error)}. Run again when it can.")
    return Outcome(lifetimes.as_json()["images"][0])


def outcomes(
    done: Callable[[Sequence[CohortSlide]], Iterator[tuple[CohortSlide, Outcome | None]]],
    slides: Sequence[CohortSlide],
    deadly: str,
) -> Outcomes:
    """Yield each slide with its outcome.

    ``done`` gives None for a slide whose process died. Each such slide is computed once more, alone. ``deadly`` is the
    reason for a slide whose process dies again.
    """
    suspects = []
    for slide, outcome in done(slides):
        if outcome:
            yield slide, outcome
        else:
            suspects.append(slide)
    for each in suspects:
        for slide, outcome in done([each]):
            yield slide, outcome or Outcome(None, deadly)


#: Variable with the number of BLAS threads, which numpy reads at import. Many BLAS threads would wait for each other.
_BLAS = "OPENBLAS_NUM_THREADS"

#: Why a slide is given up.
_DEADLY = (
    "its worker process died twice: out of memory, or a fault in the decoder. Run again with --jobs 1, or get a whole "
    "copy."
)

#: Set in a worker process at its start: the task of every slide, and the number of threads of this process.
_work: tuple[CohortTask, int]


def on_this_machine(task: CohortTask, slides: Sequence[CohortSlide], jobs: int) -> Outcomes:
    """Yield each slide with its outcome from ``jobs`` processes. Raises LutgenError: a process cannot be started."""
    if jobs <= 1:
        for slide in slides:
            yield slide, look_at(task, slide)
        return
    yield from outcomes(partial(_done_here, task, jobs), slides, _DEADLY)


def _done_here(
    task: CohortTask, jobs: int, slides: Sequence[CohortSlide]
) -> Iterator[tuple[CohortSlide, Outcome | None]]:
    """Yield each slide with its outcome; None if its process died."""
    waiting = deque(slides)
    while waiting:
        running: dict[Future[Outcome], CohortSlide] = {}
        with _pool(task, min(jobs, len(waiting)), max(threads() // jobs, 1)) as pool:
            try:
                while waiting or running:
                    # At most one slide for each process, so that few slides are computed again when a process dies.
                    while waiting and len(running) < jobs:
                        running[pool.submit(_look, waiting[0])] = waiting[0]
                        waiting.popleft()
                    for future in wait(running, return_when=FIRST_COMPLETED).done:
                        yield running[future], future.result()
                        del running[future]
            except BrokenProcessPool:
                for future in wait(running).done:
                    yield running[future], None if future.exception() else future.result()


@contextmanager
def _pool(task: CohortTask, jobs: int, share: int) -> Iterator[ProcessPoolExecutor]:
    """Start a pool. End its processes at once when the body of the ``with`` statement fails or is interrupted."""
    # Forking a process with threads is unsafe, and some systems have no fork.
    context = multiprocessing.get_context("spawn")
    # Worker processes watch the other end of this pipe, and exit when this process closes its end or is killed.
    our_end, their_end = context.Pipe()
    pool = ProcessPoolExecutor(jobs, context, _begin, (their_end, task, share))
    try:
        _start(pool, jobs)
        yield pool
        pool.shutdown()
    finally:
        our_end.close()
        pool.shutdown(cancel_futures=True)
        their_end.close()


def _start(pool: ProcessPoolExecutor, jobs: int) -> None:
    """Start all processes at once. If one died while the pool starts another, the pool might wait for ever."""
    try:
        with _quiet_start():
            started = [pool.submit(int) for _ in range(jobs)]
        for each in started:
            each.result()
    except BrokenProcessPool:
        raise LutgenError(
            "a worker process cannot be started. If an error of the process is printed above, correct that error (a "
            "script of your own needs `if __name__ == '__main__':`), or run with --jobs 1."
        ) from None


@contextmanager
def _quiet_start() -> Iterator[None]:
    """Start each process with one BLAS thread and with SIGINT blocked, since the parent handles Ctrl-C."""
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


def _begin(end: Connection, task: CohortTask, share: int) -> None:
    global _work  # noqa: PLW0603 - a pool has no other place for what its processes share
    _work = task, share
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(end,), daemon=True).start()


def _end_with(end: Connection) -> None:
    wait_for_connections([end])
    os._exit(1)


def _look(slide: CohortSlide) -> Outcome:
    task, share = _work
    return look_at(task, slide, share)


#: Seconds to wait for an answer of a scheduler, and for its first worker.
PATIENCE_S = 5.0

#: Addresses that Dask connects to. Dask gives no clear error for other addresses.
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://[^/\s]+:\d+")

#: Why a slide is given up.
_DEADLY_WORKERS = "the Dask workers that took it died, one after the other (out of memory?). See their logs."


@contextmanager
def on_cluster(address: str) -> Iterator[Callable[[CohortTask, Sequence[CohortSlide]], Outcomes]]:
    """Connect to a scheduler; yield the function that computes slides on its workers.

    Raises LutgenError: no Dask, scheduler or worker.
    """
    otherwise = "leave --scheduler out to use this machine's cores"
    dask = optional("distributed", "--scheduler needs Dask", extra="cluster", otherwise=otherwise)
    if not _ADDRESS.fullmatch(address):
        raise LutgenError(f"--scheduler {address}: is no address of a Dask scheduler. Write it as tcp://host:8786.")
    try:
        client = dask.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise LutgenError(
            f"--scheduler {address}: no Dask scheduler answers there ({str(error).rstrip('.').lower()}). Start one "
            "with `dask scheduler`, or leave --scheduler out to use this machine's cores."
        ) from None
    with _quiet(), client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except TimeoutError:
            raise LutgenError(
                f"--scheduler {address}: the scheduler has no worker. Start some where the slides can be read, with "
                f"`dask worker {address}`."
            ) from None
        yield partial(_outcomes_on_cluster, dask, client)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the log of Dask's client: lutgen's own error reports a lost connection in one sentence."""
    logger = getLogger("distributed.client")
    before = logger.level
    logger.setLevel(CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _outcomes_on_cluster(dask: Any, client: Any, task: CohortTask, slides: Sequence[CohortSlide]) -> Outcomes:
    # When a worker dies, Dask counts a failure for every slide that waited at this worker.
    return outcomes(partial(_done_on_cluster, dask, client, task), slides, _DEADLY_WORKERS)


def _done_on_cluster(
    dask: Any, client: Any, task: CohortTask, slides: Sequence[CohortSlide]
) -> Iterator[tuple[CohortSlide, Outcome | None]]:
    # Each task has a unique key, since Dask returns the cached result of an earlier run for a known key.
    run = uuid4().hex
    futures = {
        client.submit(pickle.loads, pickle.dumps(_Call(task, slide)), key=f"lutgen-{run}-{place}"): slide
        for place, slide in enumerate(slides)
    }
    for future in dask.as_completed(list(futures), loop=client.loop):
        yield futures.pop(future), _outcome(dask, client, future)


def _outcome(dask: Any, client: Any, future: Any) -> Outcome | None:
    """Return the result of a task; None: Dask gave the task up because its workers died."""
    try:
        error = future.exception()
        # If the worker dies before its result is fetched, this call waits until another worker has computed the slide.
        outcome: Outcome | None = None if error else future.result()
    except dask.CancelledError:
        raise LutgenError(
            f"{client.scheduler.address}: the Dask scheduler is gone. The finished slides are kept; run again to go on."
        ) from None
    if error and not isinstance(error, dask.KilledWorker):
        return Outcome(
            None,
            f"its Dask worker failed ({type(error).__name__}: {str(error).rstrip('.')}). Install lutgen there, and "
            "the files of effects that the model names.",
        )
    return outcome


class _Call:
    """Computes a slide when unpickled. A worker without lutgen then fails the task, and does not reconnect for ever."""

    def __init__(self, task: CohortTask, slide: CohortSlide) -> None:
        self._work = task, slide

    def __reduce__(self) -> tuple[Any, ...]:
        return _look_there, self._work


def _look_there(task: CohortTask, slide: CohortSlide) -> Outcome:
    """Compute a slide's lifetimes on a Dask worker in one thread, since its other threads compute other slides."""
    if task.version != __version__:
        return Outcome(None, f"lutgen is {__version__} on its Dask worker and {task.version} here. Install the same.")
    file = Path(slide.path)
    if slide.bytes and not file.is_file():
        return Outcome(
            None,
            f"this machine sees it and its Dask worker does not, at {file}. Put slides where all machines see them "
            "under the same path.",
        )
    return look_at(task, slide, 1)
