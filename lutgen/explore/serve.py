"""Serve the page until Ctrl-C."""

from collections.abc import Callable
from pathlib import Path
from socket import socket

from lutgen.explore.commands import WindowState
from lutgen.files import scratch
from lutgen.server import Guard, new_address, server_of


def serve(state: WindowState, listening: socket, *, opened: Callable[[str], None], wait: bool = True) -> None:
    """Serve windows that start with the arguments of the command.

    ``state``: readings, image, model and baseline. ``listening``: the socket of :func:`lutgen.server.port_taken`.
    ``opened``: called with the page's address; the server answers an early request as soon as it runs. ``wait``: open
    the files before ``opened`` is called, since the files may be broken. Raises LutgenError: a file cannot be shown.
    """
    address, word = new_address(listening)
    if not wait:
        opened(address)
    # Slow modules are imported now, while the browser starts.
    import asyncio

    from lutgen.explore.windows import Windows

    async def run(folder: Path) -> None:
        windows = Windows(folder, state)
        windows.prepare()
        # Let the first window's process start while the next module is imported.
        await asyncio.sleep(0)
        from lutgen.explore.app import explore_application

        try:
            if wait:
                await windows.ready()
                opened(address)
            guarded = Guard(explore_application(windows), listening, word)
            await server_of(guarded, windows.gone).serve(sockets=[listening])
        finally:
            await windows.gone()

    with scratch() as folder:
        asyncio.run(run(folder))
