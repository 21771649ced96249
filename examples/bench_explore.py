"""Rows of ``bench``: the time until `lutgen explore` shows a picture and answers, and its memory.

The readings are those of the rows of criticism: 1094 readings at 10 hours, with two hidden effects. The goals: a table
of a new hour within 0.04 s, a provisional error within 0.3 s, the final error within 2 s, and at most 400 MB of memory.
A 95th percentile of time is compared with its limit. The 95th percentile of the processor time of the server's
processes stands beside it, because on a shared machine lutgen determines only this time.
"""

from __future__ import annotations

import json
import signal
import subprocess
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from http.client import HTTPConnection
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from examples.bench_criticism import HIDDEN, SESSIONS
from examples.racing import ENVIRONMENT, LUTGEN, Peer, against_limit, processor_time, race, watched
from tests.browser import CHROMIUM, browser
from tests.virtual_display.campaign import Campaign, csv_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from examples.racing import Row

#: Ratio of Chromium's time to a blank page to the time from the command to a picture: a factor of 2.5 is allowed.
PICTURE = 1 / 2.5

TABLE_LIMIT_S, PROVISIONAL_LIMIT_S, FINAL_LIMIT_S, MEMORY_LIMIT_MB = 0.040, 0.3, 2.0, 400.0

#: Effects that are switched on, two at a time, in either order.
SWITCHES = ("eotf-drift", "black-level", "recalibration", "crosstalk", "loading", "warm-up")

#: JavaScript that resolves when the page has drawn its picture. Polling would take the browser a tenth of the measured
#: processor time.
DRAWN = """new Promise((drawn) => {
    const look = () => document.body?.dataset.picture === "drawn" && drawn(true);
    new MutationObserver(look).observe(document, { subtree: true, childList: true, attributeFilter: ["data-picture"] });
    look();
})"""


@dataclass(frozen=True)
class Work:
    """The amount of work: the sessions' hours and design, tables, switches, starts of the page, width of the image."""

    sessions: tuple[float, ...] = SESSIONS
    design: str = "full"
    tables: int = 100
    switches: int = 6
    starts: int = 5
    width: int = 3464
    height: int = 2309

    @classmethod
    def quick(cls) -> Work:
        """Return little work for every row."""
        return cls((0.0, 1000.0, 2500.0), design="colours", tables=5, switches=2, starts=1, width=300, height=200)


def exploring(work: Work, folder: Path) -> Iterator[Row]:
    """Yield all rows."""
    readings = folder / "explored.csv"
    hidden = HIDDEN["two effects hidden"]
    readings.write_text(csv_text(Campaign(design=work.design, hours=work.sessions, hidden=hidden)), encoding="utf-8")
    yield from _picture(work)
    with served(str(readings)) as (address, pid):
        page = Asking(address, pid)
        size = f"{page.overview['readings']} readings at {len(page.overview['hours'])} hours"
        page.hears("error")
        yield from _switches(work, page, size)
        yield from _tables(work, page)
        image = image_of(work, folder)
        with watched(pid) as peak:
            page.post("image", image, "&name=large.png")
            page.hears("measured")
            page.get("difference", f"&mode=chroma&hours={page.overview['max_hours']}")
        title = f"peak memory of the server (PSS), image of {work.width * work.height / 1e6:.2g} Mpx, {size}"
        yield against_limit(title, peak, MEMORY_LIMIT_MB, "MB")


def _picture(work: Work) -> list[Row]:
    blank = Peer("Chromium alone, to a blank page", _blank if CHROMIUM else None, PICTURE)
    return race("from the command to a picture, in Chromium", _pictured, blank, times=work.starts) if CHROMIUM else []


def _blank() -> None:
    with tempfile.TemporaryDirectory() as profile, browser(Path(profile)) as page:
        page.wait("document.readyState === 'complete'")


def _pictured() -> None:
    with served() as (address, _), tempfile.TemporaryDirectory() as profile, browser(Path(profile)) as page:
        page.call("Page.navigate", url=address)
        page.wait(DRAWN)


def _switches(work: Work, page: Asking, size: str) -> Iterator[Row]:
    """Add a second effect to a first effect that is already fitted.

    Earlier fits are cached, so each pair occurs once.
    """
    page.hears("effects", lambda effects: all(each["tried"] for each in effects))
    provisional, final = Spent(page), Spent(page)
    for first, second in permutations(SWITCHES[: work.switches], 2):
        page.post("switch", {"effects": [first]})
        page.hears("support")
        with final:
            with provisional:
                page.post("switch", {"effects": [first, second]})
            page.hears("error", partial(_is_of, 2))
        page.hears("support")
    yield from provisional.rows(f"effect switched, provisional error, {size}", PROVISIONAL_LIMIT_S)
    yield from final.rows(f"effect switched, final error, {size}", FINAL_LIMIT_S)


def _is_of(count: int, error: dict[str, Any]) -> bool:
    return len(error["effects"]) == count


def _tables(work: Work, page: Asking) -> Iterator[Row]:
    page.post("switch", {"effects": SWITCHES[:2]})
    page.hears("error", partial(_is_of, 2))
    page.hears("support")
    tables = Spent(page)
    for hour in np.linspace(0.0, page.overview["max_hours"], work.tables):
        with tables:
            page.get("table", f"&mode=chroma-luma&hours={hour:.2f}&size=33")
    yield from tables.rows("slider moved, new 33³ table", TABLE_LIMIT_S)


class Spent:
    """Wall-clock seconds and the server's processor seconds of an action that is repeated inside the block."""

    def __init__(self, page: Asking) -> None:
        """Begin without measurements."""
        self._pid, self._spent = page.pid, np.zeros((0, 2))

    def _now(self) -> list[float]:
        return [time.perf_counter(), processor_time(self._pid)]

    def __enter__(self) -> None:
        self._from = self._now()

    def __exit__(self, *_: object) -> None:
        self._spent = np.vstack([self._spent, np.subtract(self._now(), self._from)])

    def rows(self, what: str, limit: float) -> Iterator[Row]:
        """Yield the 95th percentile of both times, compared with a limit."""
        clock, processor = np.quantile(self._spent, 0.95, axis=0).tolist()
        yield against_limit(f"{what} (95 % of {len(self._spent)})", [clock], limit, "s")
        yield against_limit(f"{what}, processor time", [processor], limit, "s")


def image_of(work: Work, folder: Path) -> bytes:
    """Return a large picture with as many colours as a photograph: enlarged tissue with a little noise, seeded."""
    from PIL import Image

    from lutgen.explore.commands import tissue

    with Image.open(tissue()) as small:
        pixels = np.asarray(small.resize((work.width, work.height), Image.Resampling.BICUBIC)).astype(np.int16)
    pixels += np.random.default_rng(14).integers(-6, 7, pixels.shape, dtype=np.int16)
    file = folder / "large.png"
    Image.fromarray(np.clip(pixels, 0, 255).astype(np.uint8)).save(file, compress_level=1)
    return file.read_bytes()


@contextmanager
def served(*arguments: str) -> Iterator[tuple[str, int]]:
    """Run `lutgen explore` and yield its address and process."""
    command = [*LUTGEN, "explore", "--no-browser", *arguments]
    with subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True) as process:
        try:
            lines = iter(process.stdout or ())
            yield next(line for line in lines if "http://" in line).split()[-1], process.pid
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(20)


class Asking:
    """One window without a browser: requests go over one connection, news come over another."""

    def __init__(self, address: str, pid: int) -> None:
        """Open a window of the server with process ``pid``."""
        self.pid = pid
        _, _, self._host, word, _ = address.split("/")
        self._path, self._asking = f"/{word}/api/", HTTPConnection(self._host, timeout=600)
        self._query = ""
        self.overview = json.loads(self.post("window"))
        self._query = f"window={self.overview['window']}"
        self._listening = HTTPConnection(self._host, timeout=600)
        self._listening.request("GET", f"{self._path}events?{self._query}")
        self._news = self._listening.getresponse()

    def post(self, what: str, content: Any = None, query: str = "") -> bytes:
        """Send JSON, or bytes."""
        body = content if isinstance(content, bytes) else json.dumps(content or {}).encode()
        self._asking.request(
            "POST", f"{self._path}{what}?{self._query}{query}", body, {"Origin": f"http://{self._host}"}
        )
        return self._answer()

    def get(self, what: str, query: str) -> bytes:
        """Request data."""
        self._asking.request("GET", f"{self._path}{what}?{self._query}{query}")
        return self._answer()

    def _answer(self) -> bytes:
        reply = self._asking.getresponse()
        data = reply.read()
        if reply.status != 200:
            raise SystemExit(f"bench: the page was refused: {data.decode()}")
        return data

    def hears(self, what: str, holds: Callable[[Any], bool] = lambda _content: True) -> Any:
        """Wait for news."""
        name = ""
        for line in self._news:
            key, _, value = line.decode().strip().partition(": ")
            if key == "event":
                name = value
            elif key == "data" and name == what and holds(content := json.loads(value)):
                return content
        raise SystemExit("bench: the server has ended")
