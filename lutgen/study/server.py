"""The session page's HTTP server: on the loopback address alone, for one browser.

Other machines cannot reach 127.0.0.1. Other pages in the same browser could: a name that resolves to it is refused by
``Host``, a page of another origin by ``Origin``, and both lack the random word in the address, as other users of the
computer do.
"""

from __future__ import annotations

import json
import secrets
import sys
import time
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from socket import AF_INET, SO_REUSEADDR, SOCK_STREAM, SOL_SOCKET, socket
from threading import Thread
from typing import TYPE_CHECKING, Any

from lutgen.cells import whole
from lutgen.documents import from_json
from lutgen.errors import LutgenError, reason_of
from lutgen.study.conversation import Conversation, RefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lutgen.study.reading import ReadingSession

HOST = "127.0.0.1"

#: Files of the page, and what they are.
PARTS = {
    "": ("page.html", "text/html; charset=utf-8"),
    "page.css": ("page.css", "text/css; charset=utf-8"),
    "page.js": ("page.js", "text/javascript; charset=utf-8"),
    "image.js": ("image.js", "text/javascript; charset=utf-8"),
    "screen.js": ("screen.js", "text/javascript; charset=utf-8"),
    "colours.png": ("colours.png", "image/png"),
}

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}

#: Bytes of what the page may send.
_LARGEST = 16_384

#: Seconds for which the closing page is waited for.
_CLOSING = 20.0


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, conversation: Conversation, listening: socket) -> None:
        self.conversation = conversation
        self.word = secrets.token_urlsafe(24)
        address = listening.getsockname()
        super().__init__(address, _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket, self.server_address = listening, address
        # http.server's own binding asks the network for this computer's name, which may take seconds.
        self.server_name, self.server_port = HOST, address[1]
        self.server_activate()
        self.origin = f"http://{HOST}:{address[1]}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        # A browser that hangs up is no error.
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "lutgen", ""
    timeout = 60

    def do_GET(self) -> None:
        path = self._path()
        if path is None:
            return
        if path.startswith("picture/"):
            data = self.server.conversation.picture(path.removeprefix("picture/"))
            if data is not None:
                self._reply(200, data, "image/png")
                return
        elif path in PARTS:
            name, kind = PARTS[path]
            self._reply(200, files("lutgen.study").joinpath("page", name).read_bytes(), kind)
            return
        self._refuse(RefusedError(404, "bad", "There is nothing here."))

    def do_POST(self) -> None:
        path = self._path()
        if path is None:
            return
        try:
            answer = self.server.conversation.ask(path, self._body())
        except RefusedError as error:
            self._refuse(error)
        else:
            self._reply(200, json.dumps(answer).encode(), "application/json")

    def log_message(self, *_: Any) -> None:
        """Say nothing: the terminal is the operator's."""

    def _path(self) -> str | None:
        """Return what is asked below the random word; None, and an answer is sent, where it may not be asked."""
        _, word, path = (*self.path.split("/", 2), "", "")[:3]
        if self.headers.get("Host") != self.server.origin.removeprefix("http://"):
            self._refuse(RefusedError(421, "bad", "This address is not served."))
        elif self.headers.get("Origin", self.server.origin if self.command == "GET" else "") != self.server.origin:
            self._refuse(RefusedError(403, "bad", "Another page may not ask."))
        elif not secrets.compare_digest(word.encode(), self.server.word.encode()):
            self._refuse(RefusedError(404, "bad", "There is nothing here."))
        else:
            return path
        return None

    def _body(self) -> dict[str, Any]:
        length = whole(self.headers.get("Content-Length", ""), least=0, most=_LARGEST)
        if length is None:
            raise RefusedError(413, "bad", f"Send at most {_LARGEST} bytes, and say how many.")
        try:
            content = from_json(self.rfile.read(length))
        except ValueError:
            content = None
        if not isinstance(content, dict):
            raise RefusedError(400, "bad", "Send a JSON object.")
        return content

    def _refuse(self, error: RefusedError) -> None:
        # What was sent may not have been read to its end.
        self.close_connection = True
        self._reply(error.status, json.dumps({"why": error.why, "error": str(error)}).encode(), "application/json")

    def _reply(self, status: int, data: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(data))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)


def port_taken(port: int) -> socket:
    """Take a port of this computer, 0 for any that is free, before a session begins.

    Raises
    ------
    LutgenError
        The port is another program's, or none.

    """
    if not 0 <= port <= 65535:
        raise LutgenError(f"--port {port}: give 1 to 65535, or 0 for any that is free.")
    listening = socket(AF_INET, SOCK_STREAM)
    try:
        # As http.server: a port of a server that has ended may be taken at once. Windows would share one in use.
        if sys.platform != "win32":
            listening.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        listening.bind((HOST, port))
    except OSError as error:
        listening.close()
        reason = reason_of(error)
        raise LutgenError(f"--port {port}: {reason}. Choose another, or leave --port out for any.") from None
    return listening


@contextmanager
def serving(conversation: Conversation, listening: socket | None = None) -> Iterator[str]:
    """Serve a session's page in the background until the end of the block, on any port or on the one taken for it.

    Gives its address.

    Raises
    ------
    LutgenError
        No port is free.

    """
    server = _Server(conversation, listening or port_taken(0))
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield f"{server.origin}/{server.word}/"
    finally:
        server.shutdown()
        thread.join()
        conversation.close()
        server.server_close()


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
        As :func:`port_taken` gives it; None: any port that is free.

    Raises
    ------
    LutgenError
        No port is free.

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
