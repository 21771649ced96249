"""The session's server: access, one tab at a time, no disclosed conditions, faults; and the commands."""

from __future__ import annotations

import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from lutgen.server import HOST
from lutgen.study.answers import read_answers
from lutgen.study.reading import begin_reading
from lutgen.study.server import LEASE, Conversation, serving
from tests.command import Done, in_process
from tests.schemas import validator
from tests.studies import Clock, decision, make_study, read_on

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lutgen.study.reading import ReadingSession

pytestmark = pytest.mark.numbers

TAB, OTHER = "tab-number-one", "tab-number-two"


class Client:
    """Sends requests to a server as a browser does, without a page."""

    def __init__(self, address: str) -> None:
        _, _, host, word, _ = address.split("/")
        self.port, self.path = int(host.partition(":")[2]), f"/{word}/"
        self.body = b""
        self.replies: list[bytes] = []

    def request(self, method: str, path: str, body: bytes | None = None, **headers: str) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection(HOST, self.port, timeout=60)
        connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
        reply = connection.getresponse()
        self.body = reply.read()
        self.replies.append(self.body)
        connection.close()
        return reply

    def ask(self, what: str, tab: str = TAB, **body: Any) -> tuple[int, dict[str, Any]]:
        data = json.dumps({"tab": tab, **body}).encode()
        reply = self.request("POST", self.path + what, data, Origin=f"http://{HOST}:{self.port}")
        content: dict[str, Any] = json.loads(self.body)
        return reply.status, content

    def picture(self, identifier: str) -> int:
        return self.request("GET", f"{self.path}picture/{identifier}").status


class Desk(Client):
    """A client of a session in this process, with the server's clock and the messages to the operator."""

    def __init__(self, address: str, reading: ReadingSession, time: list[float], told: list[str]) -> None:
        super().__init__(address)
        self.address, self.reading, self.time, self.told = address, reading, time, told


@contextmanager
def desk(study: Path, reader: str = "Dr A") -> Iterator[Desk]:
    time, told = [0.0], list[str]()
    with begin_reading(study, reader=reader, session=1, clock=Clock()) as reading:
        conversation = Conversation(reading, told.append, lambda: time[0])
        with serving(conversation) as address:
            yield Desk(address, reading, time, told)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("planned") / "study"
    make_study(folder)
    return folder


@pytest.fixture
def study(planned: Path, tmp_path: Path) -> Path:
    """A copy of the study for a test to change."""
    return Path(shutil.copytree(planned, tmp_path / "study"))


@pytest.fixture
def served(study: Path) -> Iterator[Desk]:
    with desk(study) as served:
        yield served


@pytest.fixture(scope="module")
def shared(planned: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    """A session for requests that are refused or change nothing: one server for all of them."""
    with desk(Path(shutil.copytree(planned, tmp_path_factory.mktemp("shared") / "study"))) as served:
        yield served


def answer(number: int, *, practice: bool = False, **change: Any) -> dict[str, Any]:
    return {"number": number, "practice": practice, **vars(decision(number)), **change}


def test_only_the_loopback_address_is_served(served: Desk) -> None:
    assert served.address.startswith("http://127.0.0.1:")
    # The server does not answer at another address of this computer, which other machines would use.
    with socket.socket() as elsewhere:
        elsewhere.settimeout(2)
        assert elsewhere.connect_ex(("127.0.0.2", served.port)) != 0


@pytest.mark.parametrize(
    ("method", "path", "headers", "status"),
    [
        ("GET", "", {}, 200),
        ("GET", "page.js", {}, 200),
        ("GET", "page.css", {}, 200),
        ("GET", "", {"Host": "evil.example"}, 421),
        ("GET", "", {"Host": "127.0.0.1"}, 421),
        ("GET", "", {"Origin": "http://evil.example"}, 403),
        ("GET", "nothing", {}, 404),
        ("GET", "page.py", {}, 404),
        ("GET", "../protocol.json", {}, 404),
        ("GET", "%2e%2e/protocol.json", {}, 404),
        ("GET", "picture/", {}, 404),
        ("GET", "picture/%00", {}, 404),
        ("GET", "claim", {}, 404),
        ("POST", "claim", {}, 403),
        ("POST", "claim", {"Origin": "null"}, 403),
        ("POST", "claim", {"Origin": "http://evil.example"}, 403),
        ("POST", "claim", {"Host": "evil.example", "Origin": "http://evil.example"}, 421),
        ("PUT", "claim", {}, 501),
    ],
)
def test_who_may_ask_what(shared: Desk, method: str, path: str, headers: dict[str, str], status: int) -> None:
    body = json.dumps({"tab": TAB}).encode() if method == "POST" else None
    assert shared.request(method, shared.path + path, body, **headers).status == status


@pytest.mark.parametrize(
    ("path", "status"),
    [
        *((path, b"404") for path in ("/", "/page.js", "//", "/wrong/", "/wrong/page.js", "/protocol.json", "x")),
        ("/é/", b"400"),
    ],
)
def test_nothing_is_served_without_the_random_word(shared: Desk, path: str, status: bytes) -> None:
    with socket.create_connection((HOST, shared.port), timeout=60) as raw:
        raw.sendall(f"GET {path} HTTP/1.1\r\nHost: {HOST}:{shared.port}\r\nConnection: close\r\n\r\n".encode())
        assert raw.recv(4096).split()[1] == status


def test_every_reply_is_stored_nowhere_and_runs_nothing_foreign(shared: Desk) -> None:
    for path in ("", "page.js", "colours.png", "nothing"):
        reply = shared.request("GET", shared.path + path)
        assert reply.headers["Cache-Control"] == "no-store"
        assert "default-src 'none'; script-src 'self'" in reply.headers["Content-Security-Policy"]
        assert reply.headers["X-Content-Type-Options"] == "nosniff"
        assert "Python" not in reply.headers["Server"]


@pytest.mark.parametrize(
    ("what", "body", "status"),
    [
        ("claim", b"", 400),
        ("claim", b"[]", 400),
        ("claim", b"{", 400),
        ("claim", b"[" * 15_000, 400),
        ("claim", b"{}", 400),
        ("claim", b'{"tab": 7}', 400),
        ("claim", b'{"tab": "short"}', 400),
        ("claim", b" " * 20_000, 413),
        ("next", b'{"tab": "tab-number-two"}', 409),
        ("sing", b'{"tab": "tab-number-one"}', 404),
    ],
)
def test_what_makes_no_sense_is_refused(shared: Desk, what: str, body: bytes, status: int) -> None:
    origin = f"http://{HOST}:{shared.port}"
    assert shared.request("POST", shared.path + what, body, Origin=origin).status == status
    assert shared.ask("claim")[0] == 200


def test_a_page_that_goes_away_in_the_middle_of_a_request_is_no_trouble(served: Desk, caplog: Any) -> None:
    with socket.create_connection((HOST, served.port), timeout=60) as connection:
        head = (
            f"POST {served.path}claim HTTP/1.1\r\nHost: {HOST}:{served.port}\r\nOrigin: http://{HOST}:{served.port}\r\n"
        )
        connection.sendall(f"{head}Content-Length: 5\r\n\r\n{{}}".encode())
    assert served.ask("claim")[0] == 200
    assert not caplog.records


@pytest.mark.parametrize(
    "change",
    [
        {"number": 0}, {"number": True}, {"number": "1"}, {"practice": 1}, {"ease": 5.5}, {"ease": True},
        {"ease": 11}, {"category": "4+"}, {"category": None}, {"seconds": "2"}, {"seconds": -1},
        {"paint": "guessed"}, {"pauses": 0.5}, {"seconds": 1e308}, {"seconds": 10**18}, {"seconds": 86_401},
        {"first_choice_seconds": 1e308}, {"paused_seconds": 1e308}, {"pauses": 10**18},
    ],
)  # fmt: skip
def test_an_answer_that_makes_no_sense_is_refused(shared: Desk, change: dict[str, Any]) -> None:
    shared.ask("claim")
    shared.ask("next")
    status, content = shared.ask("answer", **answer(1, practice=True) | change)
    assert (status, content["why"]) == (400, "bad")
    assert shared.reading.practised == 0


def test_an_answer_is_saved_after_one_that_was_refused(served: Desk) -> None:
    served.ask("claim")
    served.ask("next")
    assert served.ask("answer", **answer(0, practice=True))[0] == 400
    assert served.ask("answer", **answer(1, practice=True)) == (200, {"saved": True})


@pytest.mark.parametrize("seconds", ["1" + "0" * 400, "1e400", "NaN"])
def test_a_number_that_no_computer_holds_is_refused_at_the_door(shared: Desk, seconds: str) -> None:
    shared.ask("claim")
    shared.ask("next")
    body = json.dumps({"tab": TAB, **answer(1, practice=True, seconds="HERE")}).replace('"HERE"', seconds)
    reply = shared.request("POST", f"{shared.path}answer", body.encode(), Origin=f"http://{HOST}:{shared.port}")
    assert reply.status == 400
    assert shared.reading.practised == 0


@pytest.mark.parametrize("length", ["9" * 5000, "１", "1_0", "-1", "+", ""])
def test_a_length_that_is_none_is_refused(shared: Desk, length: str) -> None:
    with socket.create_connection((HOST, shared.port), timeout=60) as connection:
        head = (
            f"POST {shared.path}claim HTTP/1.1\r\nHost: {HOST}:{shared.port}\r\nOrigin: http://{HOST}:{shared.port}\r\n"
        )
        connection.sendall(f"{head}Content-Length: {length}\r\n\r\n".encode())
        assert connection.recv(100).startswith(b"HTTP/1.1 400 ")
    assert shared.ask("claim")[0] == 200


@pytest.mark.parametrize(
    "note", [{}, {"kind": "answered", "said": {}}, {"kind": "paused"}, {"kind": "paused", "said": {"why": "x" * 3000}}]
)
def test_a_note_is_one_of_few_and_short(shared: Desk, note: dict[str, Any]) -> None:
    shared.ask("claim")
    assert shared.ask("note", **note)[0] == 400


def test_only_the_image_to_be_read_now_is_served(served: Desk) -> None:
    served.ask("claim")
    first = served.ask("next")[1]["picture"]
    assert served.picture(first) == 200
    assert served.body == (served.reading.study / served.reading.practice[0].file).read_bytes()
    served.ask("answer", **answer(1, practice=True))
    second = served.ask("next")[1]["picture"]
    assert (served.picture(first), served.picture(second)) == (404, 200)
    assert served.body == (served.reading.study / served.reading.images[0].file).read_bytes()
    for guess in ("", second[:-1], second + "x", *(task.file for task in served.reading.images)):
        assert served.picture(guess) == 404


def test_nothing_that_tells_leaves_the_server(study: Path) -> None:
    """No reply, not even a picture, contains names of images, conditions, files, the title, the model, or readers."""
    with begin_reading(study, reader="Professor Other", session=1, clock=Clock()) as other:
        read_on(other)
    with desk(study) as served:
        for path in ("", "page.js", "page.css", "image.js", "screen.js", "colours.png"):
            served.request("GET", served.path + path)
        served.ask("claim")
        while not (task := served.ask("next")[1])["done"]:
            served.picture(task["picture"])
            served.ask("answer", **answer(task["number"], practice=task["practice"]))
        served.ask("leave")
        replies = b"\n".join(served.replies)
    protocol = served.reading.protocol
    names = [protocol.title, "Professor", *(image.name for image in protocol.images + protocol.practice)]
    names += [condition.name for condition in protocol.conditions if condition.name != "none"]
    names += [render.file.split("/")[1] for render in protocol.renders] + [image.sha256 for image in protocol.images]
    assert [name for name in names if name.encode() in replies] == []
    assert len(replies) > 10_000
    assert len(read_answers(study)) == 8


def test_one_tab_holds_the_session_until_it_leaves_or_falls_silent(served: Desk) -> None:
    assert served.ask("claim")[0] == 200
    assert served.ask("claim", OTHER) == (409, {"why": "tab", "error": "The session is open in another tab."})
    assert served.ask("look", OTHER)[1] == {"free": False}
    served.time[0] += LEASE - 1
    assert served.ask("beat")[0] == 200
    served.time[0] += LEASE - 1
    assert served.ask("claim", OTHER)[0] == 409
    served.time[0] += 2
    assert served.ask("look", OTHER)[1] == {"free": True}
    assert served.ask("beat")[0] == 200  # the tab had only been slow
    served.time[0] += LEASE + 1
    assert served.ask("claim", OTHER)[0] == 200
    for what in ("beat", "next", "leave"):
        assert served.ask(what)[0] == 409
    assert served.ask("answer", **answer(1, practice=True))[0] == 409
    served.ask("leave", OTHER)
    assert served.ask("claim")[0] == 200


def test_a_picture_handed_to_a_tab_is_not_served_to_the_next(served: Desk) -> None:
    served.ask("claim")
    mine = served.ask("next")[1]["picture"]
    served.ask("leave")
    served.ask("claim", OTHER)
    assert served.picture(mine) == 404


def test_an_answer_whose_reply_was_lost_is_not_doubled_and_another_is_refused(served: Desk) -> None:
    served.ask("claim")
    served.ask("next")
    for _ in range(2):
        assert served.ask("answer", **answer(1, practice=True)) == (200, {"saved": True})
    served.ask("next")
    assert served.ask("answer", **answer(1))[0] == 200
    assert served.ask("answer", **answer(1))[0] == 200
    status, content = served.ask("answer", **answer(1, ease=9))
    assert (status, content["why"]) == (409, "past")
    (row,) = read_answers(served.reading.study)
    assert row.ease == decision(1).ease


def test_on_a_full_disk_an_answer_is_refused_until_there_is_room(served: Desk) -> None:
    served.ask("claim")
    served.ask("next")
    connection = served.reading._file._connection
    (pages,) = connection.execute("PRAGMA page_count").fetchone()
    connection.execute(f"PRAGMA max_page_count = {pages}")
    for length in (1500, 1):  # the shorter requests fill the space that the longer requests leave
        while served.ask("note", kind="warned", said={"text": "x" * length})[0] == 200:
            pass
    status, content = served.ask("answer", **answer(1, practice=True))
    assert (status, content["why"]) == (507, "full")
    assert served.reading.practised == 0
    assert any("disk is full" in sentence for sentence in served.told)
    connection.execute("PRAGMA max_page_count = 1000000")
    assert served.ask("answer", **answer(1, practice=True)) == (200, {"saved": True})
    assert served.ask("next")[1]["number"] == 1


def test_an_image_that_changed_is_not_shown_and_the_operator_is_told_which(served: Desk) -> None:
    path = served.reading.study / served.reading.practice[0].file
    data = path.read_bytes()
    path.write_bytes(data[:-1])
    served.ask("claim")
    status, content = served.ask("next")
    assert (status, content["why"]) == (500, "fault")
    assert path.name not in content["error"]
    assert path.name in served.told[0]
    path.write_bytes(data)
    assert served.ask("next")[0] == 200


# The commands.


@pytest.fixture
def lutgen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    return in_process(monkeypatch, capsys, "study")


@contextmanager
def running(study: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run ``lutgen study run`` in a separate process. Yield the process and the printed address."""
    command = [sys.executable, "-m", "lutgen", "study", "run", str(study), "--reader", "Dr A", "--session", "1"]
    with subprocess.Popen(
        [*command, "--no-browser", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout
        line = ""
        while "http://" not in line:
            line = process.stdout.readline()
            assert line, process.stderr and process.stderr.read()
        try:
            yield process, line.split()[-1]
        finally:
            process.kill()


#: Signal → exit code, and standard error: click ends the line that a terminal begins with ^C.
STOPS = ((signal.SIGINT, 130, "\n"), (signal.SIGTERM, 143, ""))


@pytest.mark.parametrize(("stop", "code", "err"), STOPS)
def test_a_stopped_server_ends_cleanly_and_says_how_many_are_left(
    study: Path, stop: signal.Signals, code: int, err: str
) -> None:
    with running(study) as (process, _):
        process.send_signal(stop)
        out, printed = process.communicate(timeout=60)
    assert (process.returncode, printed) == (code, err)
    assert "Reading session 1 of Dr A: 0 of 4 images are read and saved, 4 left." in out


def test_a_server_that_is_killed_between_answers_loses_none(study: Path) -> None:
    for read in (0, 1):
        with running(study) as (process, address):
            client = Client(address)
            assert client.ask("claim")[1]["read"] == read
            for _ in range(2):
                task = client.ask("next")[1]
                assert client.ask("answer", **answer(task["number"], practice=task["practice"]))[0] == 200
            client.ask("next")
            os.kill(process.pid, signal.SIGKILL)
    assert [each.position for each in read_answers(study)] == [1, 2, 3]
    with begin_reading(study, reader="Dr A", session=1) as reading:
        assert (reading.practised, reading.read) == (1, 3)


def test_bad_input_ends_with_2_and_a_sentence(study: Path, lutgen: Callable[..., Done], tmp_path: Path) -> None:
    run = ("run", str(study), "--no-browser", "--reader")
    (tmp_path / "file").touch()
    for arguments, sentence in [
        (("run", str(tmp_path / "no"), "--reader", "A", "--session", "1"), "no such file or directory"),
        (("run", str(tmp_path / "file"), "--reader", "A", "--session", "1"), "not a directory"),
        ((*run, "a\u202eb", "--session", "1"), "--reader 'a\\u202eb': give a name"),
        ((*run, "A", "--session", "3"), "the study has sessions 1 to 2"),
        ((*run, "A", "--session", "x"), "'x' is not a whole number"),
        ((*run, "A", "--session", "2"), "no reader 'A' has read session 1"),
        ((*run, "A", "--session", "1", "--override", ""), "give a reason"),
        ((*run, "A", "--session", "1", "--port", "70000"), "--port 70000: give 1 to 65535"),
        (("status", str(tmp_path)), "protocol.json: cannot read the protocol: no such file"),
        (("status", str(study), "--json", str(tmp_path / "file")), "exists already"),
    ]:
        done = lutgen(*arguments)
        assert (done.code, done.out) == (2, ""), arguments
        assert sentence in done.err
        assert "Traceback" not in done.err


def test_a_port_that_is_taken_is_refused(study: Path, lutgen: Callable[..., Done]) -> None:
    with socket.create_server((HOST, 0)) as taken:
        port = str(taken.getsockname()[1])
        done = lutgen("run", str(study), "--reader", "A", "--session", "1", "--port", port)
    assert done.code == 2
    assert f"--port {port}: address already in use" in done.err
    assert not (study / "answers").exists()


def test_a_second_run_of_one_reader_is_refused(study: Path, lutgen: Callable[..., Done]) -> None:
    with running(study):
        done = lutgen("run", str(study), "--reader", "dr a", "--session", "1")
        assert (done.code, "running already" in done.err) == (2, True)
        assert lutgen("status", str(study)).code == 0


def test_status_is_as_its_schema_says_and_its_page_names_what_comes_next(
    study: Path, lutgen: Callable[..., Done]
) -> None:
    with begin_reading(study, reader="Dr A", session=1, clock=Clock()) as reading:
        read_on(reading)
    content = json.loads(lutgen("status", str(study), "--json", "-").out)
    validator("study-status").validate(content)
    assert [each["state"] for each in content["readers"][0]["sessions"]] == ["complete", "not begun"]
    content["readers"][0]["sessions"][0]["answers"] = []
    assert list(validator("study-status").iter_errors(content))
    page = lutgen("status", str(study)).out
    assert "1 of 4 reading sessions are complete" in page
    assert "may begin 2026-03-26 09:00 UTC" in page
    assert "place 2, free" in page
