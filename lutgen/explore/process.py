"""A process with one object. A window calls the object's methods, and can end the process at any time.

Both sides exchange frames: a line of JSON (``id``, ``what``, ``size``), then ``size`` bytes. A method's result, or its
LutgenError, is a frame with the call's id. An event that the object sends without a call is a frame with id 0.
"""

import asyncio
import json
import os
import queue
import signal
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from importlib import import_module
from itertools import count
from threading import Lock, Thread
from traceback import print_exception
from typing import Any, BinaryIO

from lutgen.errors import LutgenError
from lutgen.processes import python_environment

#: The event that a process has ended by itself.
DIED = "died"

#: The error of calls to a process that has ended, or was ended.
ENDED = "the request was cancelled, or its process ended."


class Process:
    """The window's side of a process."""

    def __init__(self, on_news: Callable[[str, bytes], None]) -> None:
        """Take the function that receives the object's events."""
        self._on_news, self._numbers = on_news, count(1)
        self._waiting: dict[int, asyncio.Future[bytes]] = {}
        self._child: asyncio.subprocess.Process | None = None
        self._reader: asyncio.Task[None] | None = None

    async def start(self, home: str) -> None:
        """Start the process; ``home`` is the module and class of the object, ``package.module:Class``."""
        self._child = await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-m", "lutgen.explore.process", home,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env=python_environment(OPENBLAS_NUM_THREADS="1"),
            # Ctrl-C must reach only the server, which then ends its processes.
            start_new_session=True,
        )  # fmt: skip
        self._reader = asyncio.create_task(self._read())

    async def ask(self, method: str, body: bytes = b"", **values: Any) -> bytes:
        """Call a method with JSON values. Raises LutgenError with the method's message."""
        if self._child is None or self._child.stdin is None or self._child.returncode is not None:
            raise LutgenError(ENDED)
        number = next(self._numbers)
        self._waiting[number] = asyncio.get_running_loop().create_future()
        self._child.stdin.write(frame(number, method, body, values=values))
        try:
            return await self._waiting[number]
        finally:
            del self._waiting[number]

    async def _read(self) -> None:
        stream = self._child.stdout if self._child else None
        try:
            while stream and (line := await stream.readline()):
                head = json.loads(line)
                body = await stream.readexactly(head["size"])
                waiting = self._waiting.get(head["id"])
                if not head["id"]:
                    self._on_news(head["what"], body)
                elif waiting and not waiting.done() and head["what"] == DONE:
                    waiting.set_result(body)
                elif waiting and not waiting.done():
                    waiting.set_exception(LutgenError(body.decode()))
        except asyncio.IncompleteReadError:
            pass
        self._on_news(DIED, ENDED.encode())
        for waiting in self._waiting.values():
            if not waiting.done():
                waiting.set_exception(LutgenError(ENDED))
        if self._child and self._child.stdin:
            self._child.stdin.close()
            with suppress(ConnectionError):
                await self._child.stdin.wait_closed()
            await self._child.wait()

    def end(self) -> None:
        """End the process, and ignore its events from now on."""
        self._on_news = lambda _what, _body: None
        self.kill()

    async def gone(self) -> None:
        """Wait until the process has ended."""
        if self._reader:
            await self._reader

    def kill(self) -> None:
        """End the process. The window gets the event ``DIED``."""
        if self._child and self._child.returncode is None:
            # Popen.kill would first poll the process, and so take its exit code away from asyncio.
            if sys.platform == "win32":
                self._child.kill()
                return
            with suppress(ProcessLookupError):
                os.kill(self._child.pid, signal.SIGKILL)


#: Kinds of a frame: its body is a result, or an error message.
DONE, REFUSED = "done", "refused"


class Hosted:
    """The object in a process, without background work. ``tell`` sends events to the window."""

    #: Names of methods that run in separate threads, so that no other method waits for them.
    concurrent = frozenset[str]()

    def __init__(self, tell: Callable[..., None]) -> None:
        self._tell = tell

    def idle(self) -> bool:
        """Do a small part of the background work; return whether there is more work."""
        return False


def frame(number: int, what: str, body: bytes, **more: Any) -> bytes:
    """Return the bytes of a frame."""
    return json.dumps({"id": number, "what": what, "size": len(body), **more}).encode() + b"\n" + body


class _Child:
    """The child's side of the exchange."""

    def __init__(self, asking: BinaryIO, answering: BinaryIO) -> None:
        self._asking, self._answering, self._lock = asking, answering, Lock()
        self._calls: queue.Queue[tuple[dict[str, Any], bytes]] = queue.Queue()
        self._concurrent = ThreadPoolExecutor(2)

    def tell(self, topic: str, body: bytes | dict[str, Any] | list[Any], number: int = 0) -> None:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        with self._lock:
            self._answering.write(frame(number, topic, data))
            self._answering.flush()

    def serve(self, home: str) -> None:
        Thread(target=self._listen, daemon=True).start()
        module, _, name = home.partition(":")
        hosted: Hosted = getattr(import_module(module), name)(self.tell)
        while True:
            if self._calls.empty() and hosted.idle():
                continue
            head, body = self._calls.get()
            if head["what"] in hosted.concurrent:
                self._concurrent.submit(self._answer, hosted, head, body).add_done_callback(_end_with_fault)
            else:
                self._answer(hosted, head, body)

    def _listen(self) -> None:
        while line := self._asking.readline():
            head = json.loads(line)
            self._calls.put((head, self._asking.read(head["size"])))
        # The window has ended: no result is needed.
        os._exit(0)

    def _answer(self, hosted: Hosted, head: dict[str, Any], body: bytes) -> None:
        arguments = {"body": body} if body else {}
        try:
            result = getattr(hosted, head["what"])(**arguments, **head["values"])
        except (LutgenError, OSError, MemoryError) as error:
            self.tell(REFUSED, str(error).encode(), head["id"])
        else:
            self.tell(DONE, result, head["id"])


def _end_with_fault(answered: Future[None]) -> None:
    """End the process after an unexpected error in a thread, as an error in the main thread would."""
    if error := answered.exception():
        print_exception(error)
        os._exit(1)


if __name__ == "__main__":
    answers = os.fdopen(os.dup(1), "wb")
    # A user's own effect may print to standard output, which is redirected to standard error.
    os.dup2(2, 1)
    _Child(sys.stdin.buffer, answers).serve(sys.argv[1])
