"""The requests of the page, and the responses of its window. No mathematics, and no files except the windows' files."""

import asyncio
import json
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp

from lutgen.cells import number, number_list
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.explore.commands import KINDS, commands
from lutgen.explore.exchange import CODE, IMAGE, LIMITS, MOST_FILES, READINGS, kept, taken
from lutgen.explore.window import Window
from lutgen.explore.windows import Windows
from lutgen.server import HEADERS, RefusedError, application, json_body, page_file

PAGE = Path(__file__).parent / "page"

#: Files that this page shares with the report. Their package is not imported for its path, since it imports numpy.
VIEWER = Path(__file__).parents[1] / "pictures" / "viewer"
VIEWER_FILES = ("viewer.js", "viewer.css")

JSON = "application/json"

#: The place in index.html for a window's first data: after all elements in which the page draws.
BEGINS = b"<!-- begins -->"

#: Additional permission of this page: it shows pictures that its script creates, or that a user drops on the page.
PICTURES = {
    "Content-Security-Policy": HEADERS["Content-Security-Policy"].replace(
        "img-src 'self'", "img-src 'self' blob: data:"
    )
}


def explore_application(windows: Windows) -> ASGIApp:
    """Return the page's application."""

    def ask(path: str, answer: Callable[[Window, Request], Awaitable[Response]], *methods: str) -> Route:
        async def endpoint(request: Request) -> Response:
            window = windows.of(request)
            try:
                return await answer(window, request)
            except RefusedError:
                raise
            except LutgenError as error:
                # Dropped files lie in the window's folders; users know only their names.
                raise LutgenError(re.sub(rf"{re.escape(str(window.folder))}/\d+/", "", str(error))) from None

        return Route(f"/api/{path}", endpoint, methods=list(methods))

    async def opened(_request: Request) -> Response:
        return await _overview(await windows.open())

    async def begun(_request: Request) -> Response:
        return _page_with(windows)

    return application(
        [
            Route("/api/window", opened, methods=["POST"]),
            ask("overview", _overview, "GET"),
            ask("drop", _drop, "POST"),
            ask("image", _image, "GET", "POST"),
            ask("table", _table, "GET"),
            ask("difference", _difference, "GET"),
            ask("effects", _effects, "GET"),
            ask("switch", _switch, "POST"),
            ask("baseline", _baseline, "POST"),
            ask("what-if", _what_if, "POST"),
            ask("own", _own, "POST"),
            ask("find", _find, "POST"),
            ask("cancel", _cancel, "POST"),
            ask("events", _events, "GET"),
            ask("take", _take, "GET"),
            ask("commands", _commands, "GET"),
            Route("/", begun, methods=["GET"]),
            Route("/{path:path}", _page, methods=["GET"]),
        ]
    )


def _page_with(windows: Windows) -> Response:
    """Send the page at once, and the window's first data when the window is open, so that the page starts early."""
    data, kind = page_file(PAGE, "index.html")
    page, _, rest = data.partition(BEGINS)

    async def parts() -> AsyncIterator[bytes]:
        yield page
        try:
            window = await windows.open()
        except LutgenError as error:
            yield _begins({"refused": str(error)})
        else:
            # The data that the page draws first, in the form that picture.js requests.
            first = window.overview["first"]
            table = {"mode": first["mode"], "hours": f"{first['hours']:.15g}", "size": first["size"], "kind": "aged"}
            fetched = {"image": {"window": window.name}, "table": {"window": window.name, **table}}
            addresses = (f"api/{topic}?{urlencode(query)}" for topic, query in fetched.items())
            yield _begins(_overview_of(window), *addresses)
        yield rest

    return StreamingResponse(parts(), media_type=kind, headers=PICTURES)


def _begins(content: dict[str, Any], *addresses: str) -> bytes:
    """Return HTML with a window's first data, and with the addresses that the page fetches first.

    The page is no template: its file is sent unchanged, and these elements are sent in the place of ``BEGINS``.
    """
    # In a script element only "<" is special, since it may end the element.
    text = json.dumps(content).replace("<", "\\u003c")
    fetched = (f'<link rel="preload" as="fetch" crossorigin href="{escape(each)}">' for each in addresses)
    return "\n".join([*fetched, f'<script type="application/json" id="begins">{text}</script>']).encode()


async def _page(request: Request) -> Response:
    name = request.path_params["path"]
    data, kind = page_file(VIEWER if name in VIEWER_FILES else PAGE, name)
    return Response(data, media_type=kind, headers=PICTURES)


async def _overview(window: Window, _request: Request | None = None) -> Response:
    return JSONResponse(_overview_of(window))


def _overview_of(window: Window) -> dict[str, Any]:
    return {
        **window.overview,
        "window": window.name,
        "image": window.image or None,
        "error": json.loads(window.news.get("error", b"null")),
        "on": list(window.state.on),
        "written": window.state.written,
        "limits": LIMITS,
    }


async def _drop(window: Window, request: Request) -> Response:
    query = request.query_params
    if "name" in query:
        if len(window.dropping) >= MOST_FILES:
            window.dropping.clear()
            raise RefusedError(413, "bad", f"more than {MOST_FILES} files were dropped.")
        folder = window.dropping[0].parent if window.dropping else window.new_folder()
        window.dropping.append(await kept(request, folder, READINGS, "A file of readings"))
        if query.get("more"):
            return JSONResponse({})
    hours = number_list(query["hours"]) if query.get("hours") else None
    if query.get("hours") and hours is None:
        raise LutgenError(f"hours={query['hours']!r}: give operating hours in a list, such as 0,8000.")
    needed = await window.drop(hours, same=query.get("same") == "yes")
    return JSONResponse(needed) if needed else await _overview(window)


async def _image(window: Window, request: Request) -> Response:
    if request.method == "POST":
        path = await kept(request, window.new_folder(), IMAGE, "An image")
        window.state = replace(window.state, dropped=window.state.dropped | {str(path)})
        return JSONResponse(await window.take_image(str(path)))
    if window.picture is None:
        raise RefusedError(404, "none", "There is no image yet.")
    return FileResponse(window.picture)


def _seen(request: Request) -> dict[str, Any]:
    """Return mode and hours of a request."""
    hours = number(request.query_params.get("hours", "0"))
    if hours is None or not isfinite(hours):
        raise LutgenError(f"hours={request.query_params['hours']!r}: is no number.")
    return {"mode": request.query_params.get("mode", "chroma"), "hours": hours}


def _kind(request: Request) -> str:
    kind = request.query_params.get("kind", "aged")
    refuse_unknown("kind", kind, KINDS)
    return kind


async def _table(window: Window, request: Request) -> Response:
    size = request.query_params.get("size", "33")
    table = await window.shows(
        _kind(request),
        **_seen(request),
        without=request.query_params.get("without") == "yes",
        size=int(size) if size.isascii() and size.isdecimal() and len(size) < 4 else 0,
        differences=request.query_params.get("map") == "yes",
    )
    return Response(table, media_type="application/octet-stream", headers={"X-Lutgen-Size": size})


async def _difference(window: Window, request: Request) -> Response:
    without = request.query_params.get("without") == "yes"
    return Response(await window.shows("difference", **_seen(request), without=without), media_type=JSON)


async def _effects(window: Window, _request: Request) -> Response:
    return Response(window.news.get("effects", b"[]"), media_type=JSON)


async def _switch(window: Window, request: Request) -> Response:
    content = await json_body(request)
    names = content.get("effects")
    if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
        raise LutgenError('send {"effects": [names]}.')
    return Response(await window.switch(names), media_type=JSON)


async def _baseline(window: Window, request: Request) -> Response:
    """Compare with another model of the fresh display. Effects are switched off."""
    baseline = (await json_body(request)).get("baseline")
    if not isinstance(baseline, str):
        raise LutgenError('send {"baseline": name}.')
    await window.open(replace(window.state, baseline=baseline, on=()))
    return await _overview(window)


async def _what_if(window: Window, request: Request) -> Response:
    content = await json_body(request)
    if not content:
        return Response(await window.what_if(), media_type=JSON)
    effect, parameter, value = (content.get(name) for name in ("effect", "parameter", "value"))
    if not (isinstance(effect, str) and isinstance(parameter, str) and isinstance(value, int | float)):
        raise LutgenError('send {"effect": name, "parameter": name, "value": number}, or {} for the fit.')
    return Response(await window.what_if(effect=effect, parameter=parameter, value=float(value)), media_type=JSON)


async def _own(window: Window, request: Request) -> Response:
    state = window.state
    if "name" in request.query_params:
        if request.query_params.get("trusted") != "yes":
            raise RefusedError(
                403, "code", "A Python file is code that runs with your rights. Send trusted=yes for it."
            )
        path = await kept(request, window.new_folder(), CODE, "A file of effects")
        # A file of the same name is a new version, and replaces the old version.
        others = tuple(each for each in state.files if Path(each).name != path.name)
        state = replace(state, files=(*others, str(path)), dropped=state.dropped | {str(path)})
    else:
        content = await json_body(request)
        name, text = content.get("name"), content.get("expression")
        if not (isinstance(name, str) and isinstance(text, str)):
            raise LutgenError('send {"name": text, "expression": text}.')
        formulas = tuple(each for each in state.expressions if each[0] != name)
        state = replace(state, expressions=(*formulas, (name, text)))
    return Response(await window.own(state), media_type=JSON)


async def _find(window: Window, _request: Request) -> Response:
    await window.find()
    return JSONResponse({})


async def _cancel(window: Window, _request: Request) -> Response:
    await window.give_up()
    return JSONResponse({})


async def _events(window: Window, _request: Request) -> Response:
    async def stream() -> AsyncIterator[bytes]:
        # A comment is sent at once: it tells the page that the connection is open.
        yield b": listening\n\n"
        async for topic, body in window.events():
            yield b"event: %s\ndata: %s\n\n" % (topic.encode(), body)

    return StreamingResponse(stream(), media_type="text/event-stream")


async def _take(window: Window, request: Request) -> Response:
    topic = request.query_params.get("what", "")
    making = window.making(taken(window, topic, **_seen(request), kind=_kind(request)))
    name, data = await _while_wanted(request, making)
    ascii_name = re.sub(r'[^ -~]|["\\]', "_", name)
    headers = {"Content-Disposition": f'attachment; filename="{ascii_name}"'}
    return Response(data, media_type="application/octet-stream", headers=headers)


async def _while_wanted(request: Request, working: asyncio.Task[tuple[str, bytes]]) -> tuple[str, bytes]:
    """Wait for work that may take minutes. The work is cancelled when the page disconnects or the window ends."""

    async def disconnected() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass

    waiting = asyncio.create_task(disconnected())
    await asyncio.wait({working, waiting}, return_when=asyncio.FIRST_COMPLETED)
    waiting.cancel()
    if not working.done():
        working.cancel()
        raise RefusedError(499, "gone", "The page did not wait.")
    if working.cancelled():
        raise RefusedError(410, "gone", "This window is closed. Load the page again.")
    return working.result()


async def _commands(window: Window, request: Request) -> Response:
    support, error = (json.loads(window.news.get(name, b"{}")) for name in ("support", "error"))
    # One effect may be unsupported although other effects improve the model.
    keep = bool(support.get("keep")) or not all(each["supported"] for each in error.get("effects", ()))
    last = window.overview["max_hours"]
    shown = {**_seen(request), "kind": _kind(request), "between": window.between}
    return JSONResponse(commands(window.state, last=last, keep=keep, **shown))
