"""The page of a reading session: its requests, the responses, and the local server.

One tab at a time holds the session. The tab gets the number and a random identifier of the current image. It gets no
name of an image or condition, no title (which may contain such a name), no answer, and no data on other readers.
"""

from __future__ import annotations

import json
import secrets
import time
from contextlib import contextmanager
from pathlib import Path
from threading import Event, RLock
from typing import TYPE_CHECKING, Any, get_type_hints

from lutgen.errors import LutgenError
from lutgen.server import NOTHING, RefusedError, application, json_body, page_file, port_taken, served
from lutgen.study.answer_file import NotSavedError
from lutgen.study.reading import Decision, PastError, ReadingSession, Task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from socket import socket

    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.types import ASGIApp


#: Seconds for which a tab keeps the session after its last request. A tab sends a request every two seconds.
LEASE = 7.0

#: Events that the page may record, apart from answers.
NOTES = ("paused", "continued", "warned", "accepted")

#: Type of a field of :class:`Decision` → types of its value in JSON, in which 2.0 may be written 2.
_KINDS: dict[type, tuple[type, ...]] = {str: (str,), int: (int,), float: (int, float)}

#: Sources of the time of the first paint.
PAINTS = ("element-timing", "animation-frame")


class Conversation:
    """Answers the requests of the browser tab that holds a reading session."""

    def __init__(
        self, reading: ReadingSession, say: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Take the session, the function that reports problems to the operator, and a monotonic clock in seconds."""
        self._reading, self._say, self._clock = reading, say, clock
        self._one_at_a_time = RLock()
        self._tab, self._heard, self._closed = "", 0.0, False
        self._shown: tuple[str, Task, bytes] | None = None
        self.finished = Event()
        self._asked: dict[str, Callable[[Mapping[str, Any]], dict[str, Any]]] = {
            "claim": self._claim,
            "look": self._look,
            "beat": lambda _body: {},
            "leave": self._leave,
            "next": self._next,
            "answer": self._answer,
            "note": self._note,
        }

    def ask(self, what: str, body: Mapping[str, Any]) -> dict[str, Any]:
        """Return the response to a request of the page. Raises RefusedError with a sentence for the reader."""
        tab = body.get("tab")
        if what not in self._asked:
            raise RefusedError(404, "bad", f"{what}: unknown request.")
        if not isinstance(tab, str) or not 8 <= len(tab) <= 64:
            raise RefusedError(400, "bad", "tab: give the page's own identifier.")
        with self._one_at_a_time:
            if self._closed:
                raise RefusedError(503, "gone", "lutgen has ended. What you saved with Enter is kept.")
            if what not in ("claim", "look"):
                if tab != self._tab:
                    raise _elsewhere()
                self._heard = self._clock()
            try:
                return self._asked[what](body)
            except NotSavedError as error:
                self._say(str(error))
                message = "The disk may be full. Your answer is kept in this page: make room, then try again."
                raise RefusedError(507, "full", message) from None
            except PastError as error:
                raise RefusedError(409, "past", str(error)) from None

    def picture(self, identifier: str) -> bytes | None:
        """Return the current image; None for every other identifier."""
        with self._one_at_a_time:
            shown = self._shown
            same = shown is not None and secrets.compare_digest(shown[0].encode(), identifier.encode())
            return shown[2] if shown and same else None

    def close(self) -> None:
        """Refuse all further requests, which a browser may send on an open connection."""
        with self._one_at_a_time:
            self._closed, self._shown = True, None

    def _look(self, body: Mapping[str, Any]) -> dict[str, Any]:
        return {"free": self._tab in ("", body["tab"]) or self._clock() - self._heard > LEASE}

    def _claim(self, body: Mapping[str, Any]) -> dict[str, Any]:
        if not self._look(body)["free"]:
            raise _elsewhere()
        self._tab, self._heard, self._shown = body["tab"], self._clock(), None
        reading, protocol = self._reading, self._reading.protocol
        return {
            "reader": reading.reader,
            "session": reading.session,
            "sessions": protocol.sessions,
            "categories": [vars(category) for category in protocol.categories],
            "ease": list(protocol.ease),
            "images": len(reading.images),
            "read": reading.read,
            "practice": len(reading.practice),
            "practised": reading.practised,
            "largest": [max(image.width for image in protocol.images), max(image.height for image in protocol.images)],
        }

    def _leave(self, _body: Mapping[str, Any]) -> dict[str, Any]:
        self._tab, self._shown = "", None
        if self._reading.task() is None:
            self.finished.set()
        return {}

    def _next(self, _body: Mapping[str, Any]) -> dict[str, Any]:
        task = self._reading.task()
        if task is None:
            return {"done": True, "read": self._reading.read, "following": self._reading.following()}
        try:
            data = self._reading.picture(task)
        except LutgenError as error:
            self._say(str(error))
            message = "The next image is not as the study was planned. Call the study's operator; nothing is lost."
            raise RefusedError(500, "fault", message) from None
        self._reading.show(task)
        self._shown = (secrets.token_urlsafe(18), task, data)
        place = {"practice": task.practice, "number": task.number, "of": task.of}
        return {"done": False, **place, "picture": self._shown[0]}

    def _answer(self, body: Mapping[str, Any]) -> dict[str, Any]:
        number, practice = body.get("number"), body.get("practice")
        if type(number) is not int or number < 1 or not isinstance(practice, bool):
            raise RefusedError(400, "bad", "number, practice: say which image is answered.")
        decision = _decision(body)
        try:
            self._reading.answer(number, decision, practice=practice)
        except (NotSavedError, PastError):
            raise
        except LutgenError as error:
            raise RefusedError(400, "bad", str(error)) from None
        return {"saved": True}

    def _note(self, body: Mapping[str, Any]) -> dict[str, Any]:
        kind, words = body.get("kind"), body.get("said")
        # At most 2000 letters in the page's remark on a note.
        if kind not in NOTES or not isinstance(words, dict) or len(json.dumps(words)) > 2000:
            raise RefusedError(400, "bad", f"kind: pick one of {', '.join(NOTES)}; said: a short object.")
        task = self._shown[1] if self._shown else None
        where = {"practice": task.practice, "position": task.number} if task else {}
        self._reading.note(str(kind), {"said": words, **where})
        return {"saved": True}


def _decision(body: Mapping[str, Any]) -> Decision:
    kinds = get_type_hints(Decision)
    values = {name: body.get(name) for name in kinds}
    for name, kind in kinds.items():
        if not isinstance(values[name], _KINDS[kind]) or isinstance(values[name], bool):
            raise RefusedError(400, "bad", f"{name}: missing, or not of its kind.")
    if values["paint"] not in PAINTS:
        raise RefusedError(400, "bad", f"paint: pick one of {', '.join(PAINTS)}.")
    return Decision(**values)  # type: ignore[arg-type]


PAGE = Path(__file__).parent / "page"


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
        # An answer is written to disk before the response. In a thread, other requests do not wait for the disk.
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
    """Serve a session's page in the background; yield its address. Raises LutgenError: no free port."""
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
    """Serve a session until it is complete and its last page was shown; ``say`` gets sentences on problems."""
    conversation = Conversation(reading, say)
    with serving(conversation, listening) as address:
        opened(address)
        complete: float | None = None
        while not conversation.finished.wait(0.2):
            if reading.task() is None:
                complete = complete or time.monotonic()
                # The last page has at most 20 s to be shown.
                if time.monotonic() - complete > 20.0:
                    return


def _elsewhere() -> RefusedError:
    return RefusedError(409, "tab", "The session is open in another tab.")
