"""The open windows: each page has one. The first window is opened before its page requests it."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from lutgen.errors import LutgenError
from lutgen.explore.window import Window
from lutgen.server import RefusedError

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.requests import Request

    from lutgen.explore.commands import WindowState

#: Most windows that are open at the same time: each has two processes.
MOST_WINDOWS = 6

#: Seconds for which a window without a listener is kept, so that a reloaded page finds it.
FORGOTTEN = 60.0


@dataclass
class Windows:
    """The open windows."""

    folder: Path
    first: WindowState
    _open: dict[str, Window] = field(default_factory=dict)
    _spare: asyncio.Task[Window] | None = None
    _count: int = 0
    _opening: int = 0

    def prepare(self) -> None:
        """Open the first window before its page requests it, so that its processes start while the browser starts."""
        self._spare = asyncio.create_task(self._new())

    async def ready(self) -> None:
        """Wait for the first window. Raises LutgenError for readings, a model or an image that cannot be shown."""
        if self._spare:
            await self._spare

    async def _new(self) -> Window:
        self._count += 1
        name = f"w{self._count}"
        folder = self.folder / name
        folder.mkdir()
        window = Window(name, folder, self.first)
        try:
            await window.start()
        except BaseException:
            window.end()
            await window.gone()
            raise
        return window

    async def open(self) -> Window:
        """Open a window. If there are too many, close a window without a listener.

        Raises RefusedError: there are too many windows, and each has a listener.
        """
        if self._opening + len(self._open) >= MOST_WINDOWS:
            silent = [window for window in self._open.values() if not window.listeners]
            for window in silent[:1]:
                self._forget(window)
        if self._opening + len(self._open) >= MOST_WINDOWS:
            raise RefusedError(503, "busy", f"{MOST_WINDOWS} windows are open. Close one, and wait a minute.")
        spare, self._spare = self._spare, None
        self._opening += 1
        try:
            window = await (spare or self._new())
        finally:
            self._opening -= 1
        self._open[window.name] = window
        self._forget_later(window)
        return window

    def _forget_later(self, window: Window) -> None:
        asyncio.get_running_loop().call_later(FORGOTTEN, self._forget, window)

    def _forget(self, window: Window) -> None:
        if window.listeners:
            self._forget_later(window)
        elif self._open.pop(window.name, None):
            window.end()

    def of(self, request: Request) -> Window:
        """Return the window that a request names. Raises RefusedError if there is no such window."""
        window = self._open.get(request.query_params.get("window", ""))
        if window is None:
            raise RefusedError(410, "gone", "This window is closed. Load the page again.")
        return window

    async def gone(self) -> None:
        """End all windows, with the prepared window, and wait until their processes have ended."""
        if self._spare:
            with suppress(LutgenError):
                await self.open()
        for window in self._open.values():
            window.end()
        await asyncio.gather(*(window.gone() for window in self._open.values()))
