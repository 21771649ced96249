"""Slides on a Dask cluster, an optional extra: https://distributed.dask.org.

A worker gets a slide's path, so it must see the file under the same path; the worker's result, a few kB, comes back.
Dask gives the slides of a worker that dies to others, also those that it had finished and nobody had fetched; a slide
under which workers keep dying is given up (Dask's `allowed-failures`) and named. This process alone writes files.
"""

from __future__ import annotations

import pickle
import re
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from logging import CRITICAL, getLogger
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from lutgen import __version__
from lutgen.errors import LutgenError
from lutgen.pictures.cohort.task import Outcome, look_at, outcomes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from lutgen.pictures.cohort.find import CohortSlide
    from lutgen.pictures.cohort.task import Asked, Outcomes

#: Seconds to wait for a scheduler that does not answer, and for one that has no worker.
PATIENCE_S = 5.0

#: Addresses that Dask connects to; it gives no clear error for others.
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://[^/\s]+:\d+")

#: Why a slide is given up.
_DEADLY = "the Dask workers that took it died, one after the other (out of memory?). See their logs."


@contextmanager
def on_cluster(address: str) -> Iterator[Callable[[Asked, Sequence[CohortSlide]], Outcomes]]:
    """Connect to a scheduler; give what does slides there: each with its outcome, as they are done.

    Raises
    ------
    LutgenError
        Dask is not installed, no scheduler is there, or it has no worker; later, that the scheduler is gone.

    """
    dask = _distributed()
    if not _ADDRESS.fullmatch(address):
        message = f"--scheduler {address}: is no address of a Dask scheduler. Write it as tcp://host:8786."
        raise LutgenError(message)
    try:
        client = dask.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        message = (
            f"--scheduler {address}: no Dask scheduler answers there ({str(error).rstrip('.').lower()}). Start one "
            "with `dask scheduler`, or leave --scheduler out to use this machine's cores."
        )
        raise LutgenError(message) from None
    with _quiet(), client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except TimeoutError:
            message = (
                f"--scheduler {address}: the scheduler has no worker. Start some where the slides can be read, with "
                f"`dask worker {address}`."
            )
            raise LutgenError(message) from None
        yield partial(_outcomes, dask, client)


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


def _outcomes(dask: Any, client: Any, asked: Asked, slides: Sequence[CohortSlide]) -> Outcomes:
    # Dask suspects every slide that waited at a worker when the worker died.
    return outcomes(partial(_done, dask, client, asked), slides, _DEADLY)


def _done(
    dask: Any, client: Any, asked: Asked, slides: Sequence[CohortSlide]
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
        message = (
            f"{client.scheduler.address}: the Dask scheduler is gone. The finished slides are kept; run again to go on."
        )
        raise LutgenError(message) from None
    if error and not isinstance(error, dask.KilledWorker):
        return Outcome(
            None,
            f"its Dask worker failed ({type(error).__name__}: {str(error).rstrip('.')}). Is lutgen there, "
            "and what the model names?",
        )
    return outcome


class _Call:
    """Computes a slide when it is unpickled.

    A worker that cannot unpickle a task, such as a worker without lutgen, drops its connection and reconnects without
    end. So the task is `pickle.loads`, which all workers have, and a failure is an error of that task.
    """

    def __init__(self, asked: Asked, slide: CohortSlide) -> None:
        self._given = asked, slide

    def __reduce__(self) -> tuple[Any, ...]:
        return _look_there, self._given


def _look_there(asked: Asked, slide: CohortSlide) -> Outcome:
    """Do a slide on a worker, in its one thread: the worker's other threads have slides of their own."""
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
    try:
        return import_module("distributed")
    except ImportError as error:
        message = (
            f"--scheduler needs Dask, which cannot be imported ({error}). Install it with `pip install "
            "lutgen[cluster]`, or leave --scheduler out to use this machine's cores."
        )
        raise LutgenError(message) from None
