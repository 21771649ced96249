"""The child's side of a process (:mod:`lutgen.explore.process`): it holds one object and answers calls.

Both ends exchange frames: a line of JSON (``id``, ``what``, ``size``), then so many bytes. A method's result, or its
LutgenError, is a frame with the call's id; news that the object sends by itself is a frame with id 0.
"""

from __future__ import annotations

import json
import os
import queue
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import import_module
from threading import Lock, Thread
from traceback import print_exception
from typing import Any, BinaryIO, Protocol

from lutgen.errors import LutgenError

#: Kinds of a frame: its body is a result, or the sentence of an error.
DONE, REFUSED = "done", "refused"


class Held(Protocol):
    """The object in a process."""

    #: Names of methods that run beside the others and one another, so that nothing waits for them.
    beside: frozenset[str]

    def idle(self) -> bool:
        """Do a little work that nobody waits for; return whether there is more."""


def frame(number: int, what: str, body: bytes, **more: Any) -> bytes:
    """Write a frame."""
    return json.dumps({"id": number, "what": what, "size": len(body), **more}).encode() + b"\n" + body


class _Child:
    """The child's side of the exchange."""

    def __init__(self, asking: BinaryIO, answering: BinaryIO) -> None:
        self._asking, self._answering, self._lock = asking, answering, Lock()
        self._calls: queue.Queue[tuple[dict[str, Any], bytes]] = queue.Queue()
        self._beside = ThreadPoolExecutor(2)

    def tell(self, what: str, body: bytes | dict[str, Any] | list[Any], number: int = 0) -> None:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        with self._lock:
            self._answering.write(frame(number, what, data))
            self._answering.flush()

    def serve(self, home: str) -> None:
        Thread(target=self._listen, daemon=True).start()
        module, _, name = home.partition(":")
        held: Held = getattr(import_module(module), name)(self.tell)
        while True:
            if self._calls.empty() and held.idle():
                continue
            head, body = self._calls.get()
            if head["what"] in held.beside:
                self._beside.submit(self._answer, held, head, body).add_done_callback(_end_with_fault)
            else:
                self._answer(held, head, body)

    def _listen(self) -> None:
        while line := self._asking.readline():
            head = json.loads(line)
            self._calls.put((head, self._asking.read(head["size"])))
        # The window has ended: nobody waits for a result.
        os._exit(0)

    def _answer(self, held: Held, head: dict[str, Any], body: bytes) -> None:
        given = {"body": body} if body else {}
        try:
            result = getattr(held, head["what"])(**given, **head["values"])
        except (LutgenError, OSError, MemoryError) as error:
            self.tell(REFUSED, str(error).encode(), head["id"])
        else:
            self.tell(DONE, result, head["id"])


def _end_with_fault(answered: Future[None]) -> None:
    """End the process after an unforeseen error of a thread, as such an error of the main thread does."""
    if error := answered.exception():
        print_exception(error)
        os._exit(1)


def _main(home: str) -> None:
    answering = os.fdopen(os.dup(1), "wb")
    # A user's own effect may print: its output goes to standard error.
    os.dup2(2, 1)
    _Child(sys.stdin.buffer, answering).serve(home)


if __name__ == "__main__":
    _main(sys.argv[1])
