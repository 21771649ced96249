"""A headless Chromium that tests control through its debugging pipe, without port, driver program or package.

The protocol is https://chromedevtools.github.io/devtools-protocol. Messages are JSON, each followed by a zero byte, on
descriptors 3 and 4.
"""

import json
import os
import select
import shutil
import signal
import subprocess
import sys
import time
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: The program, by its names on Debian and on other systems.
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

#: Timeout in seconds for every answer.
PATIENCE = 60.0

#: Chromium's error messages for a question whose page was left before the answer. The question is then repeated to the
#: next page.
_LEFT = ("Inspected target navigated or closed", "Execution context was destroyed", "Cannot find context")


class PageLeftError(AssertionError):
    """The page was left for another page before it answered."""


_OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",  # WebGL without a graphics card
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--force-color-profile=srgb",
    "--remote-debugging-pipe",
)

#: Code that Python runs before it becomes Chromium: it gives the pipe's ends the numbers that Chromium expects.
_BECOME = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for end, number in zip(ends, (3, 4)):
    os.dup2(end, number)
os.execv(sys.argv[3], sys.argv[3:])
"""


class Page:
    """One page in the browser."""

    def __init__(self, reading: int, writing: int) -> None:
        """Take the ends of the pipe, and open an empty page."""
        self._reading, self._writing, self._waiting, self._last = reading, writing, b"", 0
        self._session: str | None = None
        self.requests: list[str] = []
        self.complaints: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and wait for its result."""
        self._last += 1
        message: dict[str, Any] = {"id": self._last, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        data = memoryview(json.dumps(message).encode() + b"\0")
        while data:
            assert select.select([], [self._writing], [], PATIENCE)[1], "Chromium does not listen"
            # PIPE_BUF bytes can be written without blocking when the pipe accepts any bytes.
            data = data[os.write(self._writing, data[: select.PIPE_BUF]) :]
        # A browser may send events without end and never answer; the time limit stops the wait.
        end = time.monotonic() + 3 * PATIENCE
        while True:
            assert time.monotonic() < end, f"Chromium does not answer {method}"
            answer = self._next()
            if answer.get("id") == self._last:
                if answer.get("error", {}).get("message", "").startswith(_LEFT):
                    raise PageLeftError(method, answer)
                assert "error" not in answer, (method, answer)
                result: dict[str, Any] = answer["result"]
                return result

    def open(self, file: Path) -> None:
        """Open a file and wait until it has loaded."""
        self.open_address(file.as_uri())

    def open_address(self, address: str) -> None:
        """Open an address and wait until it has loaded."""
        self.call("Page.navigate", url=address)
        self.wait(f"document.readyState === 'complete' && location.href === {json.dumps(address)}")

    def ask(self, expression: str) -> Any:
        """Evaluate JavaScript and wait for promises."""
        reply = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in reply, reply
        return reply["result"].get("value")

    def wait(self, expression: str, patience: float = PATIENCE) -> None:
        """Wait until a JavaScript expression is true, on this page or on the next page."""
        end = time.monotonic() + patience
        while not self._says(expression):
            assert time.monotonic() < end, expression
            time.sleep(0.02)

    def _says(self, expression: str) -> bool:
        try:
            return bool(self.ask(expression))
        except PageLeftError:
            return False

    def press(self, key: str, code: int, text: str = "") -> None:
        """Press and release a key. With the text of the key, the key also presses the focused button."""
        for kind, typed in (("keyDown" if text else "rawKeyDown", text), ("keyUp", "")):
            more = {"text": typed} if typed else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, **more)

    def drag(self, *way: tuple[float, float]) -> None:
        """Press the mouse button at the first place, move over the other places, and release it at the last place."""
        kinds = ["mousePressed", *["mouseMoved"] * (len(way) - 1), "mouseReleased"]
        for kind, (x, y) in zip(kinds, [*way, way[-1]], strict=True):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def size(self, width: int, height: int, ratio: float = 1) -> None:
        """Set the window's size in CSS pixels, and the number of screen pixels per CSS pixel."""
        scale = {"deviceScaleFactor": ratio, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, **scale)

    def theme(self, name: str = "") -> None:
        """Request a light or dark page; without a name, request the system's theme."""
        features = [{"name": "prefers-color-scheme", "value": name}] if name else []
        self.call("Emulation.setEmulatedMedia", features=features)

    def run(self, script: str) -> None:
        """Run a script in the page, even if the page's policy forbids scripts."""
        reply = self.call("Runtime.evaluate", expression=script)
        assert "exceptionDetails" not in reply, reply

    def picture(self, *, whole: bool = False) -> bytes:
        """Return a PNG of the window, or of the whole page."""
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        return b64decode(shot["data"])

    def printed(self) -> bytes:
        """Return the page as PDF."""
        return b64decode(self.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)["data"])

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._waiting:
            assert select.select([self._reading], [], [], PATIENCE)[0], "Chromium does not answer"
            part = os.read(self._reading, 1 << 20)
            assert part, "Chromium has ended"
            self._waiting += part
        text, _, self._waiting = self._waiting.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        if message.get("method") == "Network.requestWillBeSent":
            self.requests.append(message["params"]["request"]["url"])
        elif message.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
            self.complaints.append(json.dumps(message["params"]))
        return message


@contextmanager
def browser(profile: Path) -> Iterator[Page]:
    """Start Chromium with a new profile in an empty folder; at the end stop all processes that it started."""
    assert CHROMIUM
    theirs, writing = os.pipe()
    reading, ours = os.pipe()
    become = [sys.executable, "-c", _BECOME, str(theirs), str(ours)]
    command = [*become, CHROMIUM, *_OPTIONS, f"--user-data-dir={profile}", "about:blank"]
    with subprocess.Popen(
        command, pass_fds=(theirs, ours), start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            os.close(theirs)
            os.close(ours)
            yield Page(reading, writing)
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            os.close(reading)
            os.close(writing)
