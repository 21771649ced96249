"""One window of the page: its readings, its image, its two processes, and the news that it waits for."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from lutgen.errors import LutgenError
from lutgen.explore.commands import Asked
from lutgen.explore.process import Process

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
    from pathlib import Path

#: Seconds that a table or a step may take before its process is taken for hung: a user's own effect may loop for ever.
PATIENCE = 30.0

#: News that a page which comes later must hear too.
LASTING = ("error", "effects", "verdict")


@dataclass
class Window:
    """A window. Its page asks one thing at a time of each process; what is newer replaces what waits."""

    name: str
    folder: Path
    asked: Asked
    overview: dict[str, Any] = field(default_factory=dict)
    image: dict[str, Any] = field(default_factory=dict)
    picture: Path | None = None
    news: dict[str, bytes] = field(default_factory=dict)
    finding: asyncio.Task[None] | None = None
    listeners: set[asyncio.Queue[tuple[str, bytes] | None]] = field(default_factory=set)
    dropping: list[Path] = field(default_factory=list)
    _folders: int = 0
    _unfinished: bool = False
    _model: bytes = b""
    _colours: str = ""
    _verdict: dict[str, Any] = field(default_factory=dict)
    _tasks: set[asyncio.Task[Any]] = field(default_factory=set)

    async def start(self) -> None:
        """Start both processes, and open what the command was given."""
        self.fitting, self.showing = Process(self._hear), Process(self._hear)
        await asyncio.gather(
            self.fitting.start("lutgen.explore.fitting:Fitting"), self.showing.start("lutgen.explore.showing:Showing")
        )
        await asyncio.gather(self.open(self.asked), self.take_image(self.asked.image))

    def end(self) -> None:
        """End both processes; whoever listens is told."""
        self.fitting.end()
        self.showing.end()
        for listener in self.listeners:
            listener.put_nowait(None)

    def new_folder(self) -> Path:
        """Make a folder of the window's for files that belong together."""
        self._folders += 1
        folder = self.folder / str(self._folders)
        folder.mkdir()
        return folder

    async def drop(self, hours: Sequence[float] | None) -> dict[str, Any]:
        """Open the files that were dropped; where their hours must be told, say so and keep them."""
        await self.cancel()
        paths = [str(path) for path in self.dropping]
        if not paths:
            raise LutgenError("no file was dropped. Drop a table of readings (.csv), a campaign file or sessions.")
        try:
            gathered = json.loads(await self.fitting.ask("gather", paths=paths, hours=hours))
        except LutgenError:
            self.dropping.clear()
            raise
        if "needs_hours" in gathered:
            return dict(gathered)
        self.dropping.clear()
        data = gathered["data"]
        await self.open(Asked(data, self.asked.image, dropped=self.asked.dropped | {data}))
        return {}

    async def open(self, asked: Asked) -> None:
        """Open readings; where they are refused, those that are open stay."""
        await self.cancel()
        overview = await self._opened(asked)
        self.asked, self.overview, self.news, self._verdict = replace(asked, image=self.asked.image), overview, {}, {}

    async def _opened(self, asked: Asked) -> dict[str, Any]:
        overview = await self.fitting.ask(
            "open",
            data=asked.data,
            baseline=asked.baseline,
            model=asked.model,
            files=asked.files,
            expressions=asked.texts,
            on=asked.on,
        )
        return dict(json.loads(overview))

    def _hear(self, what: str, body: bytes) -> None:
        if what == "model":
            self._model = body
            self._later(self.showing.ask("show", body))
            return
        if what in ("error", "failed"):
            self._unfinished = False
        self.tell(what, body)

    def tell(self, what: str, body: bytes) -> None:
        """Tell the page news, and remember what lasts."""
        if what in LASTING:
            self.news[what] = body
        for listener in self.listeners:
            listener.put_nowait((what, body))

    def _later(self, work: Any) -> None:
        async def quiet() -> None:
            with suppress(LutgenError):
                await work

        task = asyncio.create_task(quiet())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def events(self) -> AsyncIterator[tuple[str, bytes]]:
        """Give the page's news: what it has missed, then all that comes, until the window ends."""
        listener: asyncio.Queue[tuple[str, bytes] | None] = asyncio.Queue()
        for news in self.news.items():
            listener.put_nowait(news)
        self.listeners.add(listener)
        try:
            while (each := await listener.get()) is not None:
                yield each
        finally:
            self.listeners.discard(listener)

    # What the page asks.

    async def table(self, **asked: Any) -> bytes:
        """Return a table of the model that is shown; errors as ``DisplayModel.at``."""
        return await self._soon(self.showing.ask("table", **asked), self._restart_showing)

    async def difference(self, **asked: Any) -> bytes:
        """Measure the image."""
        return await self.showing.ask("difference", **asked)

    async def take_image(self, path: str) -> dict[str, Any]:
        """Take another image; where it is refused, the one that is shown stays. Its colours are counted meanwhile."""
        reading, folder = Process(self._hear), self.new_folder()
        await reading.start("lutgen.explore.imaging:Imaging")
        try:
            picture = folder / "shown.png"
            image = json.loads(await self._soon(reading.ask("read", path=path, to=str(picture)), _nothing))
        except BaseException:
            reading.end()
            raise
        self.image, self.picture, self.asked = image, picture, replace(self.asked, image=path)
        self._later(self._count(reading, path, folder / "colours"))
        return self.image

    async def _count(self, reading: Process, path: str, to: Path) -> None:
        try:
            await reading.ask("count", path=path, to=str(to))
        finally:
            reading.end()
        if self.asked.image == path:
            self._colours = str(to)
            await self.showing.ask("colours", path=str(to))
            self.tell("measured", b"{}")

    async def switch(self, effects: Sequence[str], baseline: str | None = None) -> bytes:
        """Switch effects on, and all others off; the fit follows as news."""
        await self.cancel()
        if baseline and baseline != self.overview["baseline"]:
            await self.open(replace(self.asked, baseline=baseline))
        error = await self._soon(self.fitting.ask("switch", effects=list(effects)), self._restart_fitting)
        self.asked, self._unfinished = replace(self.asked, on=tuple(effects)), True
        return error

    async def what_if(self, **asked: Any) -> bytes:
        """Set a parameter; nothing: the fit again."""
        await self.cancel()
        return await self._soon(self.fitting.ask("what_if", **asked), self._restart_fitting)

    async def own(self, asked: Asked) -> bytes:
        """Take effects of the user's own; where one is refused, or loops for ever, those before stay."""
        await self.cancel()
        asking = self.fitting.ask("own", files=asked.files, expressions=asked.texts)
        effects = await self._soon(asking, self._restart_fitting)
        self.asked = replace(asked, on=())
        return effects

    async def find(self) -> None:
        """Begin a diagnosis; progress, verdict and the switches that it sets follow as news."""
        await self.cancel()
        self.finding = asyncio.create_task(self._find())

    async def _find(self) -> None:
        try:
            verdict = await self.fitting.ask("find")
        except LutgenError as error:
            self.tell("failed", json.dumps({"error": str(error)}).encode())
        else:
            self._verdict = json.loads(verdict)
            self.tell("verdict", verdict)
            self.finding = None
            with suppress(LutgenError):
                await self.switch(self._verdict["effects"])
        finally:
            self.finding = None
            self.tell("ended", b"{}")

    async def cancel(self) -> None:
        """End a diagnosis that runs; the fits begin again with what was switched on."""
        if self.finding and self.finding is not asyncio.current_task():
            self.finding.cancel()
            self.finding = None
            await self._restart_fitting(self.asked.on)

    async def give_up(self) -> None:
        """End a diagnosis, or else a fit that is not finished, which then is that of nothing switched on."""
        if self.finding:
            await self.cancel()
        elif self._unfinished:
            await self._restart_fitting()

    async def patches(self) -> bytes:
        """Return what to measure next: to tell rivals apart where there are any."""
        rivals = self._verdict.get("rivals", [])
        return await self.fitting.ask("patches", between=rivals[0][:2] if rivals else [])

    async def save_model(self, path: Path) -> None:
        """Write the model of what is switched on, as seen from its own place."""
        await self.fitting.ask("save", path=str(path))

    async def model_text(self) -> bytes:
        """Return the model file as it is where the readings lie beside it."""
        return await self.fitting.ask("model_text")

    async def _soon(self, asking: Awaitable[bytes], otherwise: Callable[[], Awaitable[None]]) -> bytes:
        try:
            async with asyncio.timeout(PATIENCE):
                return await asking
        except TimeoutError:
            await otherwise()
            raise LutgenError(f"this took longer than {PATIENCE:g} s and was ended.") from None

    async def _restart_fitting(self, on: tuple[str, ...] = ()) -> None:
        self.fitting.end()
        self.fitting = Process(self._hear)
        await self.fitting.start("lutgen.explore.fitting:Fitting")
        self.asked = replace(self.asked, on=on)
        await self._opened(self.asked)

    async def _restart_showing(self) -> None:
        self.showing.end()
        self.showing = Process(self._hear)
        await self.showing.start("lutgen.explore.showing:Showing")
        await self.showing.ask("show", self._model)
        if self._colours:
            await self.showing.ask("colours", path=self._colours)


async def _nothing() -> None:
    """What is done about a process that is ended anyway."""
