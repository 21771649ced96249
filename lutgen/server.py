"""The local server of lutgen's pages, only on the loopback address 127.0.0.1.

Other machines cannot reach 127.0.0.1, but other pages in the same browser and other users of the computer can. So the
server checks three things: ``Host``, against foreign names that resolve to 127.0.0.1; ``Origin``, against pages of
other origins; and a random word in the address, which only the user who started the server gets.
"""

from __future__ import annotations

import secrets
import sys
from contextlib import contextmanager
from importlib.util import find_spec
from socket import AF_INET, IPPROTO_TCP, SO_REUSEADDR, SOCK_STREAM, SOL_SOCKET, socket
from threading import Thread
from typing import TYPE_CHECKING, Any

from lutgen.cells import whole
from lutgen.errors import LutgenError, reason_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
    from pathlib import Path

    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import BaseRoute
    from starlette.types import ASGIApp, Message, Receive, Scope, Send
    from uvicorn import Server

HOST = "127.0.0.1"

#: Most requests that are answered at the same time, and most bytes of a request in JSON. Others are refused.
MOST_AT_ONCE, MOST_JSON = 64, 16_384

#: Headers of every response: the browser caches nothing, runs no foreign code, and tells other origins nothing.
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "Server": "lutgen",
    "X-Content-Type-Options": "nosniff",
}

#: Suffix of a page's file → its media type.
KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".jpg": "image/jpeg",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
}


class RefusedError(LutgenError):
    """A refused request; ``why`` is a key word for the page, ``status`` is the HTTP status."""

    def __init__(self, status: int, why: str, message: str) -> None:
        """Take the HTTP status, the key word for the page, and a sentence for the user."""
        super().__init__(message)
        self.status, self.why = status, why


NOTHING = RefusedError(404, "bad", "There is nothing here.")
UNSUPPORTED = RefusedError(501, "bad", "This request is not supported.")


def new_address(listening: socket) -> tuple[str, str]:
    """Return the address of a page on a port, and the random word in the address."""
    word = secrets.token_urlsafe(24)
    return f"http://{HOST}:{listening.getsockname()[1]}/{word}/", word


class Guard:
    """Passes requests with the right Host, Origin and random word to an application, without the word in the path."""

    def __init__(self, app: ASGIApp, listening: socket, word: str) -> None:
        """Guard an application that is served on a port, by the random word of its address."""
        self._app, self._at_once, self._word = app, 0, word
        self._host = f"{HOST}:{listening.getsockname()[1]}".encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer an ASGI request."""

        async def send_marked(message: Message) -> None:
            if message["type"] == "http.response.start":
                present = {name.lower() for name, _ in message["headers"]}
                new = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
                message["headers"] = [*message["headers"], *(each for each in new if each[0] not in present)]
            await send(message)

        refusal = self._refusal(scope)
        if refusal:
            await refused(refusal)(scope, receive, send_marked)
            return
        self._at_once += 1
        try:
            path = scope["path"].removeprefix(f"/{self._word}")
            await self._app({**scope, "path": path, "raw_path": path.encode()}, receive, send_marked)
        finally:
            self._at_once -= 1

    def _refusal(self, scope: Scope) -> RefusedError | None:
        headers = dict(scope["headers"])
        own = b"" if scope["method"] != "GET" else b"http://" + self._host
        _, _, below = scope["path"].partition("/")
        word, slash, _ = below.partition("/")
        if scope["method"] not in ("GET", "POST"):
            return UNSUPPORTED
        if headers.get(b"host") != self._host:
            return RefusedError(421, "bad", "This address is not served.")
        if headers.get(b"origin", own) != b"http://" + self._host:
            return RefusedError(403, "bad", "Requests from other pages are refused.")
        if not secrets.compare_digest(word.encode(), self._word.encode()) or not slash:
            return NOTHING
        if self._at_once >= MOST_AT_ONCE:
            return RefusedError(503, "busy", f"{MOST_AT_ONCE} requests are being answered. Ask again in a moment.")
        return None


def application(routes: Sequence[BaseRoute]) -> ASGIApp:
    """Return an application that sends errors as sentences in JSON."""
    from starlette.applications import Starlette
    from starlette.exceptions import HTTPException

    async def refuse(_request: Request, error: Exception) -> Response:
        if isinstance(error, RefusedError):
            return refused(error)
        if isinstance(error, HTTPException):
            return refused(NOTHING if error.status_code == 404 else UNSUPPORTED)
        return refused(RefusedError(400, "bad", str(error)))

    handlers: dict[Any, Any] = {LutgenError: refuse, RefusedError: refuse, HTTPException: refuse}
    return Starlette(routes=list(routes), exception_handlers=handlers)


def refused(error: RefusedError) -> Response:
    """Return the response for a refused request. The connection is closed, since a body may be unread."""
    from starlette.responses import JSONResponse

    headers = {"Connection": "close"}
    return JSONResponse({"why": error.why, "error": str(error)}, status_code=error.status, headers=headers)


async def pieces(request: Request, most: int, what: str) -> AsyncIterator[bytes]:
    """Yield the body of a request in pieces. Refuse a body of more than ``most`` bytes.

    Raises
    ------
    RefusedError
        The stated or the real length is larger, the stated length is no number, or the page disconnected before the
        end.

    """
    from starlette.requests import ClientDisconnect

    length = request.headers.get("content-length")
    if length is not None and whole(length, least=0, most=most) is None:
        raise _too_large(most, what)
    size = 0
    try:
        async for piece in request.stream():
            size += len(piece)
            if size > most:
                raise _too_large(most, what)
            yield piece
    except ClientDisconnect:
        raise RefusedError(400, "bad", f"{what} is incomplete: the page closed the connection.") from None


def _too_large(most: int, what: str) -> RefusedError:
    size = f"{most // 1_000_000} MB" if most >= 1_000_000 else f"{most} bytes"
    return RefusedError(413, "bad", f"{what} larger than {size} is not taken here.")


async def json_body(request: Request) -> dict[str, Any]:
    """Return the JSON object in a request's body; errors as :func:`pieces`, and for a body that is no JSON object."""
    from lutgen.documents import from_json

    data = [piece async for piece in pieces(request, MOST_JSON, "A request")]
    try:
        content = from_json(b"".join(data))
    except ValueError:
        content = None
    if not isinstance(content, dict):
        raise RefusedError(400, "bad", "Send a JSON object.")
    return content


def page_file(folder: Path, name: str) -> tuple[bytes, str]:
    """Return a file of a page and its media type. Raises RefusedError if the folder has no such file."""
    from pathlib import PurePosixPath

    kind = KINDS.get(PurePosixPath(name).suffix)
    parts = name.split("/")
    if kind is None or any(part in ("", ".", "..") or "\\" in part or "\0" in part for part in parts):
        raise NOTHING
    file = folder.joinpath(*parts)
    if not file.is_file() or file.is_symlink():
        raise NOTHING
    return file.read_bytes(), kind


def port_taken(port: int) -> socket:
    """Bind a port of this computer (0: any free port), before other work begins.

    Raises LutgenError: another program uses the port, there is no such port, or starlette or uvicorn is not installed.
    """
    if not (find_spec("starlette") and find_spec("uvicorn")):
        raise LutgenError(
            "pages need starlette and uvicorn, which are not installed. Run: pip install 'lutgen[explore]'"
        )
    if not 0 <= port <= 65535:
        raise LutgenError(f"--port {port}: give 1 to 65535, or 0 for any that is free.")
    # With the protocol TCP, asyncio sends each piece at once. Otherwise a body waits 40 ms until its head is received.
    listening = socket(AF_INET, SOCK_STREAM, IPPROTO_TCP)
    try:
        # Allow the port of a server that has just ended. Not on Windows, where a port in use would be shared.
        if sys.platform != "win32":
            listening.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        listening.bind((HOST, port))
        listening.listen(128)
    except OSError as error:
        listening.close()
        reason = reason_of(error)
        raise LutgenError(f"--port {port}: {reason}. Choose another, or leave --port out for any.") from None
    return listening


async def _nothing() -> None:
    """Do nothing: only the server ends."""


def server_of(guarded: Guard, ending: Callable[[], Awaitable[None]] = _nothing) -> Server:
    """Return the server of a guarded application. The caller runs it; it awaits ``ending`` before it shuts down."""
    from uvicorn import Config, Server

    class Ending(Server):
        async def shutdown(self, sockets: list[socket] | None = None) -> None:
            # Before super().shutdown: uvicorn then raises the signal again, which cancels all awaited work.
            await ending()
            await super().shutdown(sockets)

    return Ending(
        Config(
            guarded,
            http="h11",
            ws="none",
            lifespan="off",
            loop="asyncio",
            log_config=None,
            log_level="error",
            access_log=False,
            server_header=False,
            date_header=False,
            timeout_keep_alive=600,
            timeout_graceful_shutdown=1,
        )
    )


@contextmanager
def served(app: ASGIApp, listening: socket) -> Iterator[str]:
    """Serve an application in the background until the end of the ``with`` block; yield its address."""
    address, word = new_address(listening)
    server = server_of(Guard(app, listening, word))
    thread = Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    try:
        yield address
    finally:
        server.should_exit = True
        thread.join()
        listening.close()
