"""A Firefox that tests control through Marionette. It needs no driver program and no package.

Firefox runs on a virtual screen (Xvfb), because without a screen it draws no WebGL.

The protocol is https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html. Each message is JSON, preceded
by its length and a colon. The methods of :class:`Page` have the names and meanings of those of ``tests.browser.Page``.
"""

import json
import os
import shutil
import signal
import socket
import subprocess
import time
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.browser import PATIENCE

#: The program, by its names on Debian and on other systems; None if Firefox or Xvfb is missing.
FIREFOX = next(filter(None, map(shutil.which, ("firefox-esr", "firefox"))), None) if shutil.which("Xvfb") else None

#: Firefox fetches nothing that no test requested, saves downloads in a folder, and draws WebGL without a graphics card.
_PREFERENCES = {
    "app.normandy.enabled": False,
    "app.update.enabled": False,
    "browser.download.folderList": 2,
    "browser.newtabpage.enabled": False,
    "browser.safebrowsing.malware.enabled": False,
    "browser.safebrowsing.phishing.enabled": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "extensions.getAddons.cache.enabled": False,
    "marionette.port": 0,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "network.http.speculative-parallel-limit": 0,
    "toolkit.telemetry.enabled": False,
    "webgl.force-enabled": True,
}

#: Keys by their names in WebDriver (https://www.w3.org/TR/webdriver2/#keyboard-actions).
_KEYS = {"Enter": "\ue007", "Tab": "\ue004", " ": " ", "ArrowLeft": "\ue012", "ArrowRight": "\ue014", "Home": "\ue011"}


class Page:
    """One page in the browser."""

    def __init__(self, port: int) -> None:
        """Connect to a port of this computer and begin a session."""
        # Longer than the time limit of a script; the first answer comes when Firefox has started completely.
        self.connection = socket.create_connection(("127.0.0.1", port), 3 * PATIENCE)
        self._waiting, self._last = b"", 0
        self._next()
        self.call("WebDriver:NewSession")
        self.call("WebDriver:SetTimeouts", script=int(PATIENCE * 1000))

    def call(self, method: str, **parameters: Any) -> Any:
        """Send a command and wait for its result."""
        self._last += 1
        message = json.dumps([0, self._last, method, parameters]).encode()
        self.connection.sendall(b"%d:%s" % (len(message), message))
        _, number, error, result = self._next()
        assert number == self._last
        assert error is None, (method, error)
        return result

    def open_address(self, address: str) -> None:
        """Open an address and wait until it has loaded."""
        self.call("WebDriver:Navigate", url=address)

    def ask(self, expression: str) -> Any:
        """Evaluate a JavaScript expression and wait for promises."""
        script = f"""const done = arguments[arguments.length - 1];
            const failed = (error) => done({{ error: String(error) }});
            (async () => ({expression}))().then((value) => done({{ value }}), failed);"""
        reply = self.call("WebDriver:ExecuteAsyncScript", script=script, args=[], sandbox=None)["value"]
        assert "error" not in reply, (expression, reply)
        return reply.get("value")

    def wait(self, expression: str, patience: float = PATIENCE) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + patience
        while not self.ask(expression):
            assert time.monotonic() < end, expression
            time.sleep(0.05)

    def press(self, key: str, _code: int = 0, _text: str = "") -> None:
        """Press and release a key."""
        actions = [{"type": kind, "value": _KEYS.get(key, key)} for kind in ("keyDown", "keyUp")]
        self.call("WebDriver:PerformActions", actions=[{"type": "key", "id": "keys", "actions": actions}])

    def size(self, width: int, height: int, _ratio: float = 1) -> None:
        """Set the size of the page inside the window in CSS pixels."""
        chrome = self.ask("[outerWidth - innerWidth, outerHeight - innerHeight]")
        self.call("WebDriver:SetWindowRect", width=width + chrome[0], height=height + chrome[1])

    def theme(self, name: str = "") -> None:
        """Request a light or dark page; without a name, request the system's theme."""
        choice = {"dark": 0, "light": 1}.get(name, 2)
        preference = f'Services.prefs.setIntPref("layout.css.prefers-color-scheme.content-override", {choice});'
        self.call("Marionette:SetContext", value="chrome")
        self.call("WebDriver:ExecuteScript", script=preference, args=[])
        self.call("Marionette:SetContext", value="content")

    def run(self, script: str) -> None:
        """Run a script in the page, even if the page's policy forbids scripts."""
        self.call("WebDriver:ExecuteScript", script=script, args=[], sandbox=None)

    def picture(self) -> bytes:
        """Return a PNG of the window."""
        return b64decode(self.call("WebDriver:TakeScreenshot", full=False)["value"])

    def _next(self) -> Any:
        while b":" not in self._waiting:
            self._receive()
        length, _, self._waiting = self._waiting.partition(b":")
        while len(self._waiting) < int(length):
            self._receive()
        message, self._waiting = self._waiting[: int(length)], self._waiting[int(length) :]
        return json.loads(message)

    def _receive(self) -> None:
        part = self.connection.recv(1 << 20)
        assert part, "Firefox has ended"
        self._waiting += part


@contextmanager
def _screen() -> Iterator[str]:
    """Start a screen in memory and yield its name."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "2000x1300x24", "-nolisten", "tcp"]
    with subprocess.Popen(
        command, pass_fds=(writing,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        os.close(writing)
        try:
            with os.fdopen(reading) as answer:
                number = answer.readline().strip()
            assert number, "Xvfb does not start"
            yield f":{number}"
        finally:
            process.kill()


@contextmanager
def firefox(profile: Path, **more: bool) -> Iterator[Page]:
    """Start Firefox with a new profile, with ``downloads`` in the profile's folder for saved files; stop Firefox at the
    end.

    ``more``: preferences, with ``_`` for their dots.
    """
    assert FIREFOX
    downloads = profile / "downloads"
    downloads.mkdir(parents=True)
    own = {name.replace("_", "."): value for name, value in more.items()}
    preferences = {**_PREFERENCES, "browser.download.dir": str(downloads), **own}
    lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in preferences.items()]
    (profile / "user.js").write_text("\n".join(lines))
    # System access is needed to change preferences while Firefox runs.
    command = [
        FIREFOX,
        "--marionette",
        "--remote-allow-system-access",
        "--no-remote",
        "--profile",
        str(profile),
        "about:blank",
    ]
    with (
        _screen() as display,
        subprocess.Popen(
            command,
            env=os.environ | {"HOME": str(profile), "DISPLAY": display},
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process,
    ):
        try:
            port = profile / "MarionetteActivePort"
            end = time.monotonic() + 3 * PATIENCE
            while not (port.is_file() and port.read_text().strip()):
                assert time.monotonic() < end, "Firefox does not start"
                time.sleep(0.1)
            page = Page(int(port.read_text()))
            with page.connection:
                yield page
        finally:
            os.killpg(process.pid, signal.SIGKILL)
