"""Serving the page until Ctrl-C."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from lutgen.explore.app import Windows, explore_application
from lutgen.files import scratch
from lutgen.server import Guard, server_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from socket import socket

    from lutgen.explore.commands import Asked


def serve(asked: Asked, listening: socket, *, opened: Callable[[str], None], wait: bool = True) -> None:
    """Serve windows that begin with what the command was given.

    Parameters
    ----------
    asked
        Readings, image, model and baseline.
    listening
        As :func:`lutgen.server.port_taken` gives it.
    opened
        Told the page's address once it is served.
    wait
        Whether the files are tried first, for they may be anything.

    Raises
    ------
    LutgenError
        A file cannot be shown.

    """
    with scratch() as folder:
        windows = Windows(folder, asked)
        guarded = Guard(explore_application(windows), listening)

        async def run() -> None:
            windows.prepare()
            try:
                if wait:
                    await windows.ready()
                opened(guarded.address)
                await server_of(guarded, windows.gone).serve(sockets=[listening])
            finally:
                await windows.gone()

        asyncio.run(run())
