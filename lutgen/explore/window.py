"""One window of the page: its readings, its image, its two processes, and its events."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lutgen.errors import LutgenError
from lutgen.explore.commands import WindowState, tissue
from lutgen.explore.process import DIED, Process

#: Most seconds for a table or a step. After that its process counts as hung: a user's own effect may never return.
PATIENCE = 30.0

#: Most seconds to read an image; the largest accepted image has 150 million pixels.
IMAGE_PATIENCE = 180.0

#: Events that are kept for a page that connects later.
LASTING = ("error", "support", "effects", "verdict", "image")

#: The objects in the processes.
FITTING, SHOWING, IMAGING = (
    f"lutgen.explore.{name}" for name in ("fitting:Fitting", "showing:Showing", "imaging:Imaging")
)


@dataclass
class Window:
    """A window with its own processes."""

    name: str
    folder: Path
    state: WindowState
    overview: dict[str, Any] = field(default_factory=dict)
    #: Size of the image, and the file that the page shows of it.
    image: dict[str, Any] = field(default_factory=dict)
    picture: Path | None = None
    #: Files that were dropped and are not opened yet.
    dropping: list[Path] = field(default_factory=list)
    #: Kind in ``LASTING`` → its last event.
    news: dict[str, bytes] = field(default_factory=dict)
    #: One queue of events for each connected page; None ends the events.
    listeners: set[asyncio.Queue[tuple[str, bytes] | None]] = field(default_factory=set)
    _ended: bool = False
    _fitting: Process | None = None
    _processes: set[Process] = field(default_factory=set)
    #: Number of folders that were created, and number of switches of effects.
    _folders: int = 0
    _switches: int = 0
    #: What a restarted showing process needs: pickled models by topic, and the file of counted colours.
    _models: dict[str, bytes] = field(default_factory=dict)
    _colours: str = ""
    #: An image that is read after the first error.
    _waiting_image: str = ""
    _verdict: dict[str, Any] = field(default_factory=dict)
    #: Whether effects were switched and their fit is not finished.
    _unfinished: bool = False
    #: The running diagnosis, the running restarts by process, background calls, and files in the making.
    _finding: asyncio.Task[None] | None = None
    _mending: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)
    _made: set[asyncio.Task[Any]] = field(default_factory=set)

    async def start(self) -> None:
        """Start the showing process, and open the command's files. Raises LutgenError if a file cannot be shown."""
        self._showing = await self._begun(SHOWING, self._hear_showing)
        works: list[Coroutine[Any, Any, Any]] = [self._show_first()]
        if self.state.image == str(tissue()):
            # Every browser can show this file without conversion. Its colours are counted after the first error.
            self.picture, self._waiting_image = tissue(), self.state.image
        else:
            works.append(self.take_image(self.state.image))
        for refused in await asyncio.gather(*works, return_exceptions=True):
            if isinstance(refused, BaseException):
                raise refused

    async def _show_first(self) -> None:
        state = self.state
        opening = self._showing.ask("open", data=state.data, baseline=state.baseline, model=state.model)
        self._opened(state, json.loads(await self._soon(self._showing, opening)))

    def end(self) -> None:
        """End all processes, and end the events of every listener."""
        self._ended = True
        for process in self._processes:
            process.end()
        for making in self._made:
            making.cancel()
        for listener in self.listeners:
            listener.put_nowait(None)

    async def gone(self) -> None:
        """Wait until all processes have ended."""
        while True:
            tasks = (*self._tasks, *self._made, self._finding, *self._mending.values())
            if not (running := [each for each in tasks if each and not each.done()]):
                break
            await asyncio.wait(running)
        await asyncio.gather(*(process.gone() for process in self._processes))

    async def _begun(self, home: str, hear: Callable[[str, bytes], None]) -> Process:
        process = Process(hear)
        self._processes.add(process)
        await process.start(home)
        if self._ended:
            process.end()
        return process

    def new_folder(self) -> Path:
        """Create a folder of the window for files that belong together."""
        self._folders += 1
        folder = self.folder / str(self._folders)
        folder.mkdir()
        return folder

    # Events.

    def _hear_fitting(self, topic: str, body: bytes) -> None:
        if topic == DIED:
            self._mend(FITTING, self._restart_fitting(()), body)
        elif topic in ("without", "model"):
            # The first model of a session is the model without effects.
            self._models = {**(self._models if topic == "model" else {}), topic: body}
            self._later(self._showing.ask("show", body, without=topic == "without"))
        else:
            if topic == "failed":
                self.state = replace(self.state, on=tuple(json.loads(body)["on"]))
            self.tell(topic, body)

    def _hear_showing(self, topic: str, body: bytes) -> None:
        if topic == DIED:
            self._mend(SHOWING, self._restart_showing(), body)

    def tell(self, topic: str, body: bytes) -> None:
        """Send an event to the page, and keep it if its kind is in ``LASTING``."""
        if topic in LASTING:
            self.news[topic] = body
        if topic in ("error", "failed"):
            self._unfinished = False
            if image := self._waiting_image:
                self._waiting_image = ""
                self._later(self.take_image(image))
        for listener in self.listeners:
            listener.put_nowait((topic, body))

    async def events(self) -> AsyncIterator[tuple[str, bytes]]:
        """Yield the page's events: first the kept events, then all new events, until the window ends."""
        listener: asyncio.Queue[tuple[str, bytes] | None] = asyncio.Queue()
        for news in self.news.items():
            listener.put_nowait(news)
        self.listeners.add(listener)
        self._later(self._fits())
        try:
            while (each := await listener.get()) is not None:
                yield each
        finally:
            self.listeners.discard(listener)

    def _later(self, work: Coroutine[Any, Any, Any]) -> None:
        async def quiet() -> None:
            with suppress(LutgenError):
                await work

        task = asyncio.create_task(quiet())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def making(self, work: Coroutine[Any, Any, tuple[str, bytes]]) -> asyncio.Task[tuple[str, bytes]]:
        """Start to make a file to download. The work is cancelled when the window ends."""
        task = asyncio.create_task(work)
        self._made.add(task)
        task.add_done_callback(self._made.discard)
        return task

    # Processes: a process that ends or hangs is started again.

    async def _fits(self) -> Process:
        """Return the fitting process. The first call or listener starts it: until then the picture has both cores."""
        while FITTING in self._mending or not self._fitting:
            await (self._mending.get(FITTING) or self._mend(FITTING, self._restart_fitting(self.state.on)))
        return self._fitting

    async def fits(self, method: str, **values: Any) -> bytes:
        """Call the fitting process (:class:`lutgen.explore.fitting.Fitting`)."""
        fitting = await self._fits()
        return await self._soon(fitting, fitting.ask(method, **values))

    async def shows(self, method: str, **values: Any) -> bytes:
        """Call the showing process (:class:`lutgen.explore.showing.Showing`)."""
        if SHOWING in self._mending:
            await self._mending[SHOWING]
        return await self._soon(self._showing, self._showing.ask(method, **values))

    async def _soon(self, process: Process, asking: Coroutine[Any, Any, bytes], patience: float = PATIENCE) -> bytes:
        try:
            async with asyncio.timeout(patience):
                return await asking
        except TimeoutError:
            process.kill()
            raise LutgenError(f"the request took longer than {patience:g} s and was ended.") from None

    def _mend(self, topic: str, work: Coroutine[Any, Any, None], why: bytes = b"") -> asyncio.Task[None]:
        async def mended() -> None:
            try:
                await work
            except LutgenError as error:
                self.tell("failed", _failure(str(error)))
            finally:
                self._mending.pop(topic, None)
            if why:
                self.tell("failed", _failure(why.decode()))

        self._mending[topic] = asyncio.create_task(mended())
        return self._mending[topic]

    async def _restart_fitting(self, on: tuple[str, ...]) -> None:
        """Start the fitting process, or start it again, with these effects switched on."""
        if self._fitting:
            self._fitting.end()
        self.state = replace(self.state, on=on)
        self._fitting = await self._begun(FITTING, self._hear_fitting)
        await self._fitting.ask("open", **_readings(self.state), switch=self._switches)

    async def _restart_showing(self) -> None:
        self._showing.end()
        self._showing = await self._begun(SHOWING, self._hear_showing)
        if not self._models:
            await self._show_first()
        for topic, body in self._models.items():
            await self._showing.ask("show", body, without=topic == "without")
        if self._colours:
            await self._showing.ask("colours", path=self._colours)

    # Requests of the page.

    async def open(self, state: WindowState) -> None:
        """Open readings. If they are refused, the previous readings stay open."""
        await self.cancel()
        self._opened(state, json.loads(await self.fits("open", **_readings(state), switch=self._switches)))

    def _opened(self, state: WindowState, overview: dict[str, Any]) -> None:
        self.state = replace(state, data=overview.pop("data"), image=self.state.image)
        self.overview, self._verdict = overview, {}
        for each in LASTING[:-1]:
            self.news.pop(each, None)

    async def drop(self, hours: Sequence[float] | None, *, same: bool) -> dict[str, Any]:
        """Open the dropped files, as :func:`lutgen.explore.exchange.gathered`; keep them to ask for missing hours."""
        await self.cancel()
        paths = [str(path) for path in self.dropping]
        if not paths:
            raise LutgenError("no file was dropped. Drop a table of readings (.csv), a campaign file or sessions.")
        try:
            gathered = json.loads(await self.fits("gather", paths=paths, hours=hours, same=same))
        except LutgenError:
            self.dropping.clear()
            raise
        if "needs_hours" in gathered:
            return dict(gathered)
        self.dropping.clear()
        data = gathered["data"]
        dropped = self.state.dropped | {data}
        await self.open(WindowState(data, self.state.image, dropped=dropped, written=data not in paths))
        return {}

    async def take_image(self, path: str) -> dict[str, Any]:
        """Show another image. If it is refused, the previous image stays. Its colours are counted in the background."""
        folder, reading = self.new_folder(), await self._begun(IMAGING, lambda _what, _body: None)
        picture = folder / "shown.png"
        try:
            asking = reading.ask("read", path=path, to=str(picture))
            image = json.loads(await self._soon(reading, asking, IMAGE_PATIENCE))
        except BaseException:
            reading.end()
            raise
        self.image, self.picture, self.state = image, picture, replace(self.state, image=path)
        self.tell("image", json.dumps(image).encode())
        self._later(self._count(reading, path, str(folder / "colours")))
        return self.image

    async def _count(self, reading: Process, path: str, to: str) -> None:
        try:
            await reading.ask("count", path=path, to=to)
        finally:
            reading.end()
        if self.state.image == path:
            self._colours = to
            await self.shows("colours", path=to)
            self.tell("measured", b"{}")

    async def switch(self, effects: Sequence[str]) -> bytes:
        """Switch these effects on, and all other effects off. The fit follows as an event."""
        await self.cancel()
        self._switches += 1
        error = await self.fits("switch", effects=list(effects), switch=self._switches)
        self.state, self._unfinished = replace(self.state, on=tuple(json.loads(error)["on"])), True
        self.news.pop("support", None)
        return error

    async def what_if(self, **values: Any) -> bytes:
        """Set a parameter; without values, return to the fit."""
        await self.cancel()
        return await self.fits("what_if", **values)

    async def own(self, state: WindowState) -> bytes:
        """Take the user's own effects. If one is refused, or does not return, the previous effects stay."""
        await self.cancel()
        effects = await self.fits("own", files=state.files, expressions=state.texts)
        on = {each["name"] for each in json.loads(effects) if each["on"]}
        self.state = replace(state, on=tuple(name for name in state.on if name in on))
        return effects

    async def find(self) -> None:
        """Begin a diagnosis. Progress, verdict and switched effects follow as events."""
        await self.cancel()
        self._finding = asyncio.create_task(self._find())

    async def _find(self) -> None:
        try:
            verdict = await (await self._fits()).ask("find")
        except LutgenError as error:
            self.tell("failed", _failure(str(error)))
        else:
            self._verdict, self._finding = json.loads(verdict), None
            self.tell("verdict", verdict)
            with suppress(LutgenError):
                await self.switch(self._verdict["effects"])
        finally:
            self.tell("ended", b"{}")

    async def cancel(self) -> None:
        """End a running diagnosis. Fitting goes on with the effects that were switched on."""
        finding, self._finding = self._finding, None
        if finding and not finding.done():
            finding.cancel()
            await self._restart_fitting(self.state.on)

    async def give_up(self) -> None:
        """End a running diagnosis, or else an unfinished fit; after an ended fit no effect is switched on."""
        if self._unfinished and not self._finding:
            await self._restart_fitting(())
        await self.cancel()

    @property
    def between(self) -> list[str]:
        """The two effects that the next readings should distinguish; empty if the diagnosis named no rivals."""
        rivals: list[list[str]] = self._verdict.get("rivals", [])
        return rivals[0][:2] if rivals else []


def _failure(sentence: str) -> bytes:
    return json.dumps({"error": sentence}).encode()


def _readings(state: WindowState) -> dict[str, Any]:
    return {
        "data": state.data,
        "baseline": state.baseline,
        "model": state.model,
        "files": state.files,
        "expressions": state.texts,
        "on": state.on,
    }
