"""The session page's server: what the page of a session may ask for, on the local server of lutgen's pages."""

from __future__ import annotations

import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.server import NOTHING, application, json_body, page_file, port_taken, served
from lutgen.study.conversation import Conversation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from socket import socket

    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.types import ASGIApp

    from lutgen.study.reading import ReadingSession

PAGE = Path(__file__).parent / "page"

#: Seconds for which the closing page is waited for.
_CLOSING = 20.0


def session_application(conversation: Conversation) -> ASGIApp:
    """Return the application of a session's page."""
    from starlette.concurrency import run_in_threadpool
    from starlette.responses import JSONResponse, Response
    from starlette.routing import Route

    async def picture(request: Request) -> Response:
        data = await run_in_threadpool(conversation.picture, request.path_params["identifier"])
        if data is None:
            raise NOTHING
        return Response(data, media_type="image/png")

    async def part(request: Request) -> Response:
        data, kind = page_file(PAGE, request.path_params["name"] or "page.html")
        return Response(data, media_type=kind)

    async def ask(request: Request) -> Response:
        # An answer is written to disk before it is confirmed: the other requests do not wait for that.
        body = await json_body(request)
        return JSONResponse(await run_in_threadpool(conversation.ask, request.path_params["name"], body))

    return application(
        [
            Route("/picture/{identifier:path}", picture, methods=["GET"]),
            Route("/{name:path}", part, methods=["GET"]),
            Route("/{name:path}", ask, methods=["POST"]),
        ]
    )


@contextmanager
def serving(conversation: Conversation, listening: socket | None = None) -> Iterator[str]:
    """Serve a session's page in the background until the end of the block, on any port or on the one taken for it.

    Gives its address.

    Raises
    ------
    LutgenError
        No port is free, or what serves pages is not installed.

    """
    try:
        with served(session_application(conversation), listening or port_taken(0)) as address:
            yield address
    finally:
        conversation.close()


def serve(
    reading: ReadingSession,
    *,
    opened: Callable[[str], None],
    say: Callable[[str], None],
    listening: socket | None = None,
) -> None:
    """Serve a session until it is complete and its closing page was shown.

    Parameters
    ----------
    reading
        The session.
    opened
        Told the page's address once it is served.
    say
        Told of troubles, in sentences for whoever runs the study.
    listening
        As :func:`lutgen.server.port_taken` gives it; None: any port that is free.

    Raises
    ------
    LutgenError
        No port is free, or what serves pages is not installed.

    """
    conversation = Conversation(reading, say)
    with serving(conversation, listening) as address:
        opened(address)
        complete: float | None = None
        while not conversation.finished.wait(0.2):
            if reading.task() is None:
                complete = complete or time.monotonic()
                if time.monotonic() - complete > _CLOSING:
                    return
