"""The processes that compute a cohort's slides: those of this machine, or workers of a Dask cluster, an optional extra.

A pool of ``concurrent.futures`` breaks when one of its processes is killed (out of memory, a fault in a decoder). The
slides in hand are then tried once more, each alone in a new pool; a slide under which that process dies too is named.

A worker of a cluster (https://distributed.dask.org) gets a slide's path, so it must see the file under the same path;
the worker's result, a few kB, comes back. Dask gives the slides of a worker that dies to others, also those that it had
finished and nobody had fetched; a slide under which workers keep dying is given up (Dask's `allowed-failures`) and
named. This process alone writes files.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import re
import signal
import threading
from collections import deque
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from logging import CRITICAL, getLogger
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for_connections
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from lutgen import __version__
from lutgen.bindings import optional
from lutgen.errors import LutgenError, reason_of
from lutgen.pictures.blocks import few_threads, threads
from lutgen.pictures.lifetime import lifetime

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence

    from lutgen.display import DisplayModel
    from lutgen.pictures.cohort_slides import CohortSlide

    Outcomes = Generator[tuple[CohortSlide, "Outcome"], None, None]


@dataclass(frozen=True)
class CohortTask:
    """The task of every slide; arguments as :func:`lutgen.pictures.lifetime.lifetime` takes them."""

    model: DisplayModel
    tolerances: tuple[float, ...]
    modes: tuple[str, ...]
    hours: tuple[float, ...]
    tissue: bool
    source: str
    version: str = __version__

    def anywhere(self) -> CohortTask:
        """Return the same task, with absolute paths to own effects, for processes in other folders."""
        effects = tuple(
            replace(each, effect=replace(each.effect, origin=str(Path(each.effect.origin).resolve())))
            if each.effect.origin.endswith(".py")
            else each
            for each in self.model.effects
        )
        return replace(self, model=replace(self.model, effects=effects))


@dataclass(frozen=True)
class Outcome:
    """The outcome of a slide: an image as ``lifetime --json`` writes it, or the reason why there is none."""

    image: dict[str, Any] | None
    reason: str = ""


def look_at(asked: CohortTask, slide: CohortSlide, threads: int = 0) -> Outcome:
    """Find one slide's lifetimes, with so many ``threads`` (0: one a core); an error becomes the outcome's reason."""
    try:
        with few_threads(threads):
            lifetimes = lifetime(
                [slide.path],
                asked.model,
                tolerances=asked.tolerances,
                modes=asked.modes,
                hours=asked.hours,
                tissue=asked.tissue,
                source=asked.source,
            )
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
    """Yield each slide with its outcome; retry slides of dead processes (None of ``done``), each alone."""
    suspects = []
    for slide, outcome in done(slides):
        if outcome:
            yield slide, outcome
        else:
            suspects.append(slide)
    for each in suspects:
        for slide, outcome in done([each]):
            yield slide, outcome or Outcome(None, deadly)


#: Variable with the number of BLAS threads, which numpy reads when it is imported; they would wait for one another.
_BLAS = "OPENBLAS_NUM_THREADS"

#: Why a slide is given up.
_DEADLY = (
    "its worker process died twice: out of memory, or a fault in the decoder. Run again with --jobs 1, or get a whole "
    "copy."
)

#: Set in a worker process when it starts: the task of every slide, and the number of threads of this process.
_given: tuple[CohortTask, int]


def on_this_machine(asked: CohortTask, slides: Sequence[CohortSlide], jobs: int) -> Outcomes:
    """Yield each slide with its outcome from ``jobs`` processes. Raises LutgenError: they cannot be started."""
    if jobs <= 1:
        for slide in slides:
            yield slide, look_at(asked, slide)
        return
    yield from outcomes(partial(_done_here, asked, jobs), slides, _DEADLY)


def _done_here(
    asked: CohortTask, jobs: int, slides: Sequence[CohortSlide]
) -> Iterator[tuple[CohortSlide, Outcome | None]]:
    """Yield each slide with its outcome, None where its process died."""
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
def _pool(asked: CohortTask, jobs: int, share: int) -> Iterator[ProcessPoolExecutor]:
    """Start a pool; end its processes at once when the body of the ``with`` statement fails or is interrupted."""
    # Forking beside threads is unsafe, and other systems have no fork.
    context = multiprocessing.get_context("spawn")
    # Worker processes watch the other end of this pipe, and exit when this process closes its end or is killed.
    our_end, their_end = context.Pipe()
    pool = ProcessPoolExecutor(jobs, context, _begin, (their_end, asked, share))
    try:
        _check_start(pool)
        yield pool
        pool.shutdown()
    finally:
        our_end.close()
        pool.shutdown(cancel_futures=True)
        their_end.close()


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


def _begin(end: Connection, asked: CohortTask, share: int) -> None:
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


#: Seconds to wait for a scheduler that does not answer, and for one that has no worker.
PATIENCE_S = 5.0

#: Addresses that Dask connects to; it gives no clear error for others.
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://[^/\s]+:\d+")

#: Why a slide is given up.
_DEADLY_WORKERS = "the Dask workers that took it died, one after the other (out of memory?). See their logs."


@contextmanager
def on_cluster(address: str) -> Iterator[Callable[[CohortTask, Sequence[CohortSlide]], Outcomes]]:
    """Connect to a scheduler; give the function that computes slides there.

    Raises LutgenError: no Dask, scheduler or worker.
    """
    dask = _distributed()
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
    """Silence the log of Dask's client when a connection is lost: lutgen's own error says it in one sentence."""
    logger = getLogger("distributed.client")
    before = logger.level
    logger.setLevel(CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _outcomes_on_cluster(dask: Any, client: Any, asked: CohortTask, slides: Sequence[CohortSlide]) -> Outcomes:
    # Dask suspects every slide that waited at a worker when the worker died.
    return outcomes(partial(_done_on_cluster, dask, client, asked), slides, _DEADLY_WORKERS)


def _done_on_cluster(
    dask: Any, client: Any, asked: CohortTask, slides: Sequence[CohortSlide]
) -> Iterator[tuple[CohortSlide, Outcome | None]]:
    # Each task has a unique key: otherwise Dask returns the remembered result of an earlier run.
    run = uuid4().hex
    futures = {
        client.submit(pickle.loads, pickle.dumps(_Call(asked, slide)), key=f"lutgen-{run}-{place}"): slide
        for place, slide in enumerate(slides)
    }
    for future in dask.as_completed(list(futures), loop=client.loop):
        yield futures.pop(future), _outcome(dask, client, future)


def _outcome(dask: Any, client: Any, future: Any) -> Outcome | None:
    """Return the result of a task; None: Dask gave the task up, since the workers that had it died."""
    try:
        error = future.exception()
        # If the worker dies before its result is fetched, this waits until another worker has computed it again.
        outcome: Outcome | None = None if error else future.result()
    except dask.CancelledError:
        raise LutgenError(
            f"{client.scheduler.address}: the Dask scheduler is gone. The finished slides are kept; run again to go on."
        ) from None
    if error and not isinstance(error, dask.KilledWorker):
        return Outcome(
            None,
            f"its Dask worker failed ({type(error).__name__}: {str(error).rstrip('.')}). Is lutgen there, "
            "and what the model names?",
        )
    return outcome


class _Call:
    """Computes a slide when unpickled: a worker without lutgen fails the task, and does not reconnect without end."""

    def __init__(self, asked: CohortTask, slide: CohortSlide) -> None:
        self._given = asked, slide

    def __reduce__(self) -> tuple[Any, ...]:
        return _look_there, self._given


def _look_there(asked: CohortTask, slide: CohortSlide) -> Outcome:
    """Find a slide's lifetimes on a Dask worker, with one thread: the worker's other threads have other slides."""
    if asked.version != __version__:
        return Outcome(None, f"lutgen is {__version__} on its Dask worker and {asked.version} here. Install the same.")
    file = Path(slide.path)
    if slide.bytes and not file.is_file():
        return Outcome(
            None,
            f"this machine sees it and its Dask worker does not, at {file}. Put slides where all machines see them "
            "under the same path.",
        )
    return look_at(asked, slide, 1)


def _distributed() -> Any:
    otherwise = "leave --scheduler out to use this machine's cores"
    return optional("distributed", "--scheduler needs Dask", extra="cluster", otherwise=otherwise)
