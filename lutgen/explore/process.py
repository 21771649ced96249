"""A process with one object, whose methods a window calls; the window can end it at any time.

The child's side is :mod:`lutgen.explore.held`.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from contextlib import suppress
from itertools import count
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.explore.held import DONE, frame
from lutgen.processes import python_environment

if TYPE_CHECKING:
    from collections.abc import Callable

#: The kind of news that a process has ended by itself.
DIED = "died"

#: The error of calls to a process that ended by itself, or was ended.
ENDED = "this was cancelled, or its process ended."


class Process:
    """The window's side of a process."""

    def __init__(self, told: Callable[[str, bytes], None]) -> None:
        """Take the function that gets the object's news."""
        self._told, self._numbers = told, count(1)
        self._waiting: dict[int, asyncio.Future[bytes]] = {}
        self._child: asyncio.subprocess.Process | None = None
        self._reader: asyncio.Task[None] | None = None

    async def start(self, home: str) -> None:
        """Start the process; ``home`` is the module and class of the object, ``package.module:Class``."""
        self._child = await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-m", "lutgen.explore.held", home,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env=python_environment(OPENBLAS_NUM_THREADS="1"),
            # Ctrl-C is for the server, which ends its processes.
            start_new_session=True,
        )  # fmt: skip
        self._reader = asyncio.create_task(self._read())

    async def ask(self, method: str, body: bytes = b"", **values: Any) -> bytes:
        """Call a method; its values are JSON. Raises LutgenError with the method's sentence."""
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
                self._hear(head, await stream.readexactly(head["size"]))
        except asyncio.IncompleteReadError:
            pass
        self._told(DIED, ENDED.encode())
        for waiting in self._waiting.values():
            if not waiting.done():
                waiting.set_exception(LutgenError(ENDED))
        if self._child and self._child.stdin:
            self._child.stdin.close()
            with suppress(ConnectionError):
                await self._child.stdin.wait_closed()
            await self._child.wait()

    def _hear(self, head: dict[str, Any], body: bytes) -> None:
        if not head["id"]:
            self._told(head["what"], body)
            return
        waiting = self._waiting.get(head["id"])
        if waiting is None or waiting.done():
            return
        if head["what"] == DONE:
            waiting.set_result(body)
        else:
            waiting.set_exception(LutgenError(body.decode()))

    def end(self) -> None:
        """End the process; its news is ignored from now on."""
        self._told = lambda _what, _body: None
        self.kill()

    async def gone(self) -> None:
        """Wait until the process has ended."""
        if self._reader:
            await self._reader

    def kill(self) -> None:
        """End the process; the window gets the news that it has ended."""
        if self._child and self._child.returncode is None:
            # Popen's own kill first asks whether the process has ended, and takes its exit code from asyncio.
            if sys.platform == "win32":
                self._child.kill()
                return
            with suppress(ProcessLookupError):
                os.kill(self._child.pid, signal.SIGKILL)
