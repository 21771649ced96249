"""Slides on this machine's cores: a process each, that is handed one slide after the other.

Python's own pools give all up when one of their processes is killed (out of memory, a fault in a decoder). Here the
slide in its hands is known: it is tried once more, after the others, in a new process, and then named.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import TYPE_CHECKING

from lutgen.appearance.cohort.task import Outcome, look_at
from lutgen.appearance.difference import threads
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

    from lutgen.appearance.cohort.find import Slide
    from lutgen.appearance.cohort.task import Asked, Outcomes

#: How often a slide is tried under which its process dies.
TRIES = 2

#: Threads of BLAS would only wait for one another; read when numpy loads.
_BLAS = "OPENBLAS_NUM_THREADS"


def on_this_machine(asked: Asked, slides: Sequence[Slide], jobs: int | None) -> Outcomes:
    """Give each slide with what became of it, as they are done, from ``jobs`` processes (default: one a core).

    One process is this one. When the iterator is closed or interrupted, the processes are ended.

    Raises
    ------
    LutgenError
        Processes cannot be started.

    """
    jobs = min(jobs or threads(), len(slides))
    if jobs <= 1:
        for slide in slides:
            yield slide, look_at(asked, slide)
        return
    waiting = deque((slide, 1) for slide in slides)
    share = max(threads() // jobs, 1)
    crew: dict[object, _Worker] = {}
    try:
        while waiting or crew:
            while len(crew) < min(jobs, len(waiting) + sum(worker.slide is not None for worker in crew.values())):
                worker = _Worker.hired(asked, share)
                crew[worker.connection] = worker
            for connection in wait([worker.connection for worker in crew.values()]):
                worker = crew[connection]
                outcome = worker.heard()
                if worker.slide:
                    slide, tried = worker.slide
                    if outcome or tried >= TRIES:
                        yield slide, outcome or worker.blamed()
                    else:
                        waiting.append((slide, tried + 1))
                worker.slide = waiting.popleft() if outcome and waiting else None
                if worker.slide:
                    worker.hand(worker.slide[0])
                else:
                    crew.pop(connection).leave()
    finally:
        for worker in crew.values():
            worker.process.terminate()
            worker.leave()


@dataclass
class _Worker:
    """A process, and the slide in its hands with the number of this try; None until it has started."""

    process: BaseProcess
    connection: Connection
    slide: tuple[Slide, int] | None = None

    @classmethod
    def hired(cls, asked: Asked, share: int) -> _Worker:
        # Forking beside threads is unsafe, and other systems have no fork.
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_serve, args=(there, asked, share), daemon=True)
        with _one_thread_of_blas():
            process.start()
        # Only the process holds its end now, so that its death is heard.
        there.close()
        return cls(process, here)

    def hand(self, slide: Slide) -> None:
        # One that has died since it spoke is heard of next.
        with suppress(OSError):
            self.connection.send(slide)

    def heard(self) -> Outcome | None:
        """What it says: what became of its slide, or at first that it is there; None: it has died.

        Raises LutgenError when it has died before it was there.
        """
        try:
            said: Outcome = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            if self.slide is None:
                raise LutgenError(
                    f"a worker process cannot be started ({self._end()}). Where its complaint stands above, mend that "
                    "(a script of your own needs `if __name__ == '__main__':`), or run with --jobs 1."
                ) from None
            return None
        return said

    def blamed(self) -> Outcome:
        return Outcome(
            None,
            f"its worker process died {TRIES} times ({self._end()}): out of memory, or a fault in the decoder. Run "
            "again with --jobs 1, or get a whole copy.",
        )

    def leave(self) -> None:
        self.connection.close()
        self.process.join()

    def _end(self) -> str:
        code = self.process.exitcode or 0
        return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


@contextmanager
def _one_thread_of_blas() -> Iterator[None]:
    before = os.environ.get(_BLAS)
    os.environ[_BLAS] = before or "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_BLAS]


def _serve(connection: Connection, asked: Asked, share: int) -> None:
    # An interrupt is the parent's to handle.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    connection.send(Outcome(None))
    while True:
        try:
            slide = connection.recv()
        except EOFError:
            return
        connection.send(look_at(asked, slide, share))


def _end_with_parent() -> None:
    # A killed parent cannot call its workers off, and nobody would read what they find.
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
