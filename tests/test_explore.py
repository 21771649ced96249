"""`lutgen explore` without a browser: its numbers equal the command line's, and no request of a page harms it."""

import asyncio
import json
import shlex
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from http.client import HTTPConnection
from pathlib import Path
from queue import Queue
from threading import Thread
from time import monotonic, sleep
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from lutgen import DisplayModel
from lutgen.errors import LutgenError
from lutgen.explore.commands import WindowState, commands, example_readings, tissue
from lutgen.explore.exchange import IMAGE, READINGS, gathered
from lutgen.explore.fitting import Fitting
from lutgen.explore.imaging import Imaging
from lutgen.explore.process import ENDED, Process
from lutgen.explore.showing import Showing
from lutgen.explore.windows import MOST_WINDOWS
from lutgen.names import FORETELLING_BASELINES
from lutgen.pictures.viewer import WHITE
from lutgen.readings import read_measurements
from lutgen.server import HOST, MOST_AT_ONCE, RefusedError, page_file
from tests.command import Done
from tests.test_own_effects import GOOD
from tests.test_study_server import Client
from tests.virtual_display.campaign import Campaign, csv_text

EXAMPLE = str(example_readings())
BOTH = ["eotf-drift", "black-level"]


class Told(list[tuple[str, Any]]):
    """Messages of an object to its window."""

    def __call__(self, what: str, content: Any) -> None:
        self.append((what, content))

    def last(self, what: str) -> Any:
        return [content for name, content in self if name == what][-1]


def fitting(data: str = EXAMPLE, **given: Any) -> tuple[Fitting, Told]:
    told = Told()
    held = Fitting(told)
    held.open(data=data, **{"baseline": None, "model": None, "files": [], "expressions": [], **given})
    return held, told


def settled(held: Fitting) -> None:
    """Wait for the fit and its error, not for the effects that are tried one by one."""
    assert held.idle()
    assert held.idle()


@pytest.mark.numbers
def test_the_error_is_what_compare_and_refine_print(lutgen: Callable[..., Done]) -> None:
    held, told = fitting()
    settled(held)
    compared = json.loads(lutgen("compare", EXAMPLE, "--json", "-").out)
    before = told.last("error")
    assert before["sentence"] in one_line(lutgen("compare", EXAMPLE).out)
    assert before["mean_de2000"] == compared["error"]["delta_e_mean"]
    assert before["noise_ratio"] == compared["error"]["rms_sigma"] / compared["floor"]["rms_sigma"]
    by_hour = [each["rms_sigma"] / each["floor_rms_sigma"] for each in compared["where"] if each["by"] == "hour"]
    assert [
        point["ratio"] for each in before["slices"] if each["name"] == "hour" for point in each["points"]
    ] == by_hour

    assert held.switch(["black-level"])["provisional"]
    settled(held)
    refined = json.loads(lutgen("refine", EXAMPLE, "--add", "black-level", "--json", "-").out)
    after = told.last("error")
    assert not after["provisional"]
    assert told.last("support") == {"keep": not refined["improves"], "sentence": refined["sentence"]}
    assert after["mean_de2000"] == refined["after"]["delta_e_mean"]
    assert after["noise_ratio"] == refined["after"]["rms_sigma"] / refined["floor"]["rms_sigma"]
    fitted = refined["parameters"]["black-level"]
    (effect,) = after["effects"]
    assert {each["name"]: each["value"] for each in effect["parameters"]} == {
        name: each["value"] for name, each in fitted.items() if each["free"]
    }
    printed = lutgen("refine", EXAMPLE, "--add", "black-level").out
    assert [each["fit"] for each in effect["parameters"] if each["fit"] not in printed] == []
    assert len(after["readings"]) == compared["data"]["readings"] - len(compared["left_out"])


@pytest.mark.slow
def test_two_effects_that_the_readings_tell_apart_leave_a_list_for_general_coverage() -> None:
    held, _ = fitting()
    assert held.patches(("eotf-drift", "channel-gamma")) == held.patches(())
    assert held.patches(("crosstalk", "loading")) != held.patches(())


def test_what_a_chosen_point_leaves_of_the_others_is_told_by_the_server() -> None:
    """The root mean square in σ of the readings that two points share, in units of the unchosen point's noise."""
    held, told = fitting()
    settled(held)
    error = told.last("error")
    sigma = np.array([each["sigma"] for each in error["readings"]])
    slices = {each["name"]: each["points"] for each in error["slices"]}
    chosen, readings_there = slices["level"][0], 0
    for point in slices["hour"]:
        both = np.intersect1d(point["rows"], chosen["rows"])
        shown = chosen["within"]["hour"][point["place"]]
        if not both.size:
            assert shown is None
            continue
        readings_there += 1
        share = (sigma[both] ** 2).mean() / (sigma[point["rows"]] ** 2).mean()
        assert shown == pytest.approx(point["ratio"] * share**0.5, rel=1e-3)
    assert readings_there


def one_line(printed: str) -> str:
    """The printed text in one line."""
    return " ".join(printed.split())


@pytest.mark.numbers
def test_a_switch_is_answered_by_one_linear_step_and_taken_back_by_another() -> None:
    held, told = fitting()
    settled(held)
    alone = told.last("error")["noise_ratio"]
    first = held.switch(["black-level"])
    settled(held)
    final = told.last("error")["noise_ratio"]
    # Near the fit, but not equal to the fit.
    assert first["noise_ratio"] == pytest.approx(final, rel=0.02)
    assert first["noise_ratio"] != final
    assert held.switch([])["noise_ratio"] == pytest.approx(alone, rel=1e-9)
    settled(held)
    assert not held.switch(["black-level"])["provisional"]  # it was fitted before


@pytest.mark.numbers
def test_an_effect_that_the_readings_do_not_support_is_told_and_a_refused_one_changes_nothing() -> None:
    held, told = fitting()
    held.switch(["edge-falloff"])
    settled(held)
    error = told.last("error")
    assert told.last("support")["keep"]
    assert error["effects"][0]["supported"] is False
    assert "do not support edge-falloff" in error["effects"][0]["said"]
    for names, sentence in [
        (["nothing"], "unknown effect 'nothing'"),
        (["yellowing"], "hidden by white"),
        (BOTH[:1] * 2, "already"),
    ]:
        with pytest.raises(LutgenError, match=sentence):
            held.switch(names)
    assert [each["name"] for each in held.effects() if each["on"]] == ["edge-falloff"]


@pytest.mark.numbers
def test_where_a_fit_is_refused_what_was_on_is_on_again(tmp_path: Path) -> None:
    head, *rows = Path(EXAMPLE).read_text().split("\nhour,")
    lines = rows[0].splitlines()
    # White, red, green and blue at rest, and one other colour.
    few = [line for line in lines[1:] if is_plain(line)]
    (tmp_path / "few.csv").write_text("\n".join([head, f"hour,{lines[0]}", *few, ""]))
    held, told = fitting(str(tmp_path / "few.csv"))
    settled(held)
    assert held.switch(["eotf-drift"])["on"] == ("eotf-drift",)
    settled(held)
    assert told.last("failed")["on"] == ()
    assert "different readings, which determine at most" in told.last("failed")["error"]
    assert told.last("error")["effects"] == []
    assert not any(each["on"] for each in told.last("effects"))


def is_plain(line: str) -> bool:
    hour, *code, u, v, room, minutes, _, window, _, _, _, _, note = line.split(",")
    rest = (u, v, room, minutes, window, note) == ("0.5", "0.5", "0", "", "1", "")
    tips = (["1", "1", "1"], ["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"])
    return rest and (code in tips or (hour, *code) == ("0", "0.6", "0.6", "0.6"))


@pytest.mark.numbers
def test_what_if_changes_the_error_and_the_model_and_nothing_brings_both_back() -> None:
    held, told = fitting()
    held.switch(["black-level"])
    settled(held)
    fit, model = told.last("error"), told.last("model")
    changed = held.what_if("black-level", "grown", 0.01)
    assert changed["what_if"]
    assert changed["noise_ratio"] > fit["noise_ratio"]
    assert told.last("model") != model
    assert held.what_if()["noise_ratio"] == fit["noise_ratio"]
    settled(held)
    assert told.last("model") == model
    with pytest.raises(LutgenError, match="outside its bounds"):
        held.what_if("black-level", "grown", 7.0)


@pytest.mark.numbers
def test_an_effect_of_ones_own_leaves_what_is_on_and_what_is_fitted() -> None:
    held, told = fitting()
    held.switch(["black-level"])
    settled(held)
    fit = told.last("error")["noise_ratio"]
    listed = held.own([], ["leak: xyz + k*tau*white"])
    assert [each["name"] for each in listed if each["on"]] == ["black-level"]
    both = held.switch(["black-level", "leak"])
    assert both["provisional"]
    settled(held)
    assert held.switch(["black-level"])["noise_ratio"] == fit
    assert not held.switch(["black-level"])["provisional"]
    # A formula that has changed under its name needs a new fit.
    held.own([], ["leak: xyz + k*tau**2*white"])
    assert not held.switch(["black-level"])["provisional"]
    assert held.switch(["black-level", "leak"])["provisional"]
    with pytest.raises(LutgenError, match="is no formula"):
        held.own([], ["leak: xyz + nonsense("])
    assert [each["name"] for each in held.effects() if each["on"]] == ["black-level", "leak"]


def greys_alone() -> str:
    """Readings that cannot distinguish leaked light from reflected light or from the meter's own offset."""
    hidden = (("black-level", 32e-6, "constant"),)
    hours = (0.0, 6000.0, 18_000.0)
    return csv_text(Campaign(design="greys", held=True, ageing=0.3, hours=hours, seed=3, hidden=hidden))


def test_of_effects_that_the_readings_do_not_tell_apart_the_likeliest_is_added(tmp_path: Path) -> None:
    (tmp_path / "greys.csv").write_text(greys_alone())
    held, _ = fitting(str(tmp_path / "greys.csv"))
    verdict = held.find()
    assert verdict["name"] == "one-of"
    (alike,) = verdict["rivals"]
    assert len(alike) > 1
    assert verdict["effects"] == alike[:1]


@pytest.mark.parametrize("kind", ["aged", "compensated"])
def test_a_table_is_the_one_that_build_writes(kind: str, lutgen: Callable[..., Done], tmp_path: Path) -> None:
    held, told = fitting()
    showing = Showing(told)
    del held
    showing.show(told.last("without"))
    size = 17
    texels = np.frombuffer(getattr(showing, kind)("chroma", 9000.5, size), "<u2").reshape(-1, 4)
    options = ["--direction", "compensate"] if kind == "compensated" else []
    where = ("--hours", "9000.5", "--mode", "chroma", "--format", "cube", "--cubesize", str(size))
    lutgen("build", "--display", EXAMPLE, *where, "--no-certificates", *options, "-o", str(tmp_path / "lut"))
    (cube,) = (tmp_path / "lut").rglob("*.cube")
    written = np.array([line.split() for line in cube.read_text().splitlines() if line[:1].isdigit()], float)
    assert written.shape == (size**3, 3)
    if kind == "compensated":
        # The correction's numbers, as the aged display shows them.
        written = DisplayModel(read_measurements(EXAMPLE)).at("chroma", 9000.5).code_to_code(written)
    # Half a step of 16 bits; and the seventh decimal, which a display makes a few times larger.
    assert np.abs(texels[:, :3] / WHITE - written).max() <= 0.5 / 65535 + 1e-6
    assert (texels[:, 3] == 65535).all()
    for mode, hours, points in [("chroma", 0, 34), ("sepia", 0, 33), ("chroma", 18_001, 33), ("chroma", -1, 33)]:
        with pytest.raises(LutgenError):
            getattr(showing, kind)(mode, hours, points)


def test_the_first_picture_is_through_the_table_that_build_writes(lutgen: Callable[..., Done], tmp_path: Path) -> None:
    """The table is baked from the readings alone, before any fit."""
    showing = Showing(Told())
    overview = showing.open(data=EXAMPLE, baseline=None, model=None)
    first = overview["first"]
    assert not showing.idle()
    texels = np.frombuffer(showing.aged(**first), "<u2").reshape(-1, 4)[:, :3]
    where = ("--hours", f"{first['hours']:g}", "--mode", first["mode"], "--cubesize", str(first["size"]))
    lutgen("build", "--display", EXAMPLE, *where, "--format", "cube", "--no-certificates", "-o", str(tmp_path / "lut"))
    (cube,) = (tmp_path / "lut").rglob("*.cube")
    written = np.array([line.split() for line in cube.read_text().splitlines() if line[:1].isdigit()], float)
    assert written.shape == texels.shape
    assert np.abs(texels / WHITE - written).max() <= 0.5 / 65535 + 1e-6


def test_what_is_switched_on_can_be_left_out_of_the_picture() -> None:
    held, told = fitting()
    held.switch(["black-level"])
    settled(held)
    showing = Showing(told)
    showing.show(told.last("without"), without=True)
    showing.show(told.last("model"))
    pictures = {without: showing.aged("chroma", 9000.0, 17, without=without) for without in (False, True)}
    assert pictures[False] != pictures[True]
    plain = Showing(told)
    plain.show(told.last("without"), without=True)
    assert plain.aged("chroma", 9000.0, 17) == pictures[True]


def test_the_difference_is_what_lifetime_prints(lutgen: Callable[..., Done], tmp_path: Path) -> None:
    _, told = fitting()
    showing = Showing(told)
    showing.show(told.last("without"))
    assert showing.difference("chroma", 18_000.0)["mean"] is None
    imaging = Imaging(told)
    shown = imaging.read(str(tissue()), str(tmp_path / "shown.png"))
    assert (shown["width"], shown["shown_height"]) == (512, 512)
    imaging.count(str(tissue()), str(tmp_path / "colours"))
    showing.colours(str(tmp_path / "colours"))
    difference = showing.difference("chroma", 18_000.0)
    printed = json.loads(lutgen("lifetime", str(tissue()), "--display", EXAMPLE, "--json", "-").out)
    mode = printed["images"][0]["modes"]["chroma"]
    assert difference["mean"] == pytest.approx(mode["curve"][-1]["mean"], rel=1e-12)
    assert difference["mean_2sd"] == pytest.approx(mode["curve"][-1]["mean_plus_2_sd"], rel=1e-12)
    assert [difference["hours_to_3"], difference["hours_to_5"]] == [
        mode["lifetimes"][each]["mean"] for each in ("3", "5")
    ]


def test_sessions_dropped_together_need_hours_and_then_are_a_campaign(tmp_path: Path) -> None:
    files = []
    for name in ("2021-01.ti3", "2024-12.ti3"):
        files.append(str(tmp_path / name))
        Path(files[-1]).write_bytes((Path(EXAMPLE).parent / "campaign" / name).read_bytes())
    needed = gathered(files, None)["needs_hours"]
    assert [each["name"] for each in needed] == ["2021-01.ti3", "2024-12.ti3"]
    assert all(each["dated"].startswith(each["name"][:7]) for each in needed)
    readings = read_measurements(gathered(files[::-1], [9000.0, 0.0])["data"])
    assert sorted(set(readings.hours)) == [0.0, 9000.0]
    with pytest.raises(LutgenError, match="1 hours were given for 2 sessions"):
        gathered(files, [0.0])
    assert gathered([EXAMPLE], None) == {"data": EXAMPLE}


@pytest.mark.numbers
def test_commands_are_lines_to_copy() -> None:
    state = WindowState(
        "my data.csv", "w1/slide.png", on=("leak", "eotf-drift"), expressions=(("leak", "xyz + k*tau*white"),),
        dropped=frozenset({"w1/slide.png"}),
    )  # fmt: skip
    lines = [each["command"] for each in commands(state, last=18_000.0, keep=True, mode="chroma", hours=9000.5)]
    assert shlex.split(lines[0]) == [
        "lutgen", "refine", "my data.csv", "--add", "eotf-drift", "--add-expr", "leak: xyz + k*tau*white", "--keep",
        "-o", "my-display.toml",
    ]  # fmt: skip
    # The commands that may choose effects also receive the user's own effects.
    own = ["--add-expr", "leak: xyz + k*tau*white"]
    assert shlex.split(lines[1]) == ["lutgen", "diagnose", "my data.csv", *own]
    assert shlex.split(lines[2]) == ["lutgen", "plan", "my data.csv", *own, "-o", "next.csv"]
    assert lines[4] == ("lutgen build --model my-display.toml --hours 9000.5 --mode chroma --format cube -o this-hour")
    assert "lutgen report slide.png " in lines[5]
    shown = {"last": 100.0, "keep": False, "mode": "chroma", "hours": 1.0}
    plain = commands(WindowState("a.csv", "b.png"), **shown, between=["crosstalk", "loading"])  # type: ignore[arg-type]
    assert plain[2]["command"] == "lutgen plan a.csv --between crosstalk,loading -o next.csv"
    assert plain[3]["command"] == "lutgen build --display a.csv --hours 0..100 -o aged"
    shown["last"] = 10_234.75
    exact = commands(WindowState("a.csv", "b.png"), **shown)  # type: ignore[arg-type]
    assert exact[3]["command"] == "lutgen build --display a.csv --hours 0..10234.75 -o aged"
    for baseline in FORETELLING_BASELINES:
        # Without effects such a display does not age, and build refuses it.
        few = commands(WindowState("a.csv", "b.png", baseline=baseline), **shown)  # type: ignore[arg-type]
        assert [shlex.split(each["command"])[1] for each in few] == ["compare", "diagnose", "plan"]


class Looping:
    """An object whose method never ends."""

    concurrent = frozenset[str]()

    def __init__(self, tell: Any) -> None:
        tell("begun", {"printed": print("to standard output, where the frames are")})

    def idle(self) -> bool:
        return False

    def loop(self) -> None:
        while True:
            pass

    def refuse(self) -> None:
        raise LutgenError("no.")

    def give(self, body: bytes) -> bytes:
        return body * 2


@pytest.mark.numbers
def test_a_process_answers_refuses_and_can_be_ended_whatever_it_does() -> None:
    async def run() -> list[Any]:
        told = Told()
        process = Process(told)
        await process.start("tests.test_explore:Looping")
        answers: list[Any] = [await process.ask("give", b"\n{}\0")]
        for method in ("refuse", "loop"):
            asking = asyncio.create_task(process.ask(method))
            if method == "loop":
                await asyncio.sleep(0.05)
                process.end()
            try:
                await asking
            except LutgenError as error:
                answers.append(str(error))
        await process.gone()
        return [*answers, *told]

    assert asyncio.run(run()) == [b"\n{}\0\n{}\0", "no.", ENDED, ("begun", b'{"printed": null}')]


@pytest.mark.numbers
@pytest.mark.parametrize(
    "name", ["../app.py", "..", "", "/etc/passwd", "a\0.js", "..\\app.js", "vendor", "app.py", "."]
)
def test_a_page_has_its_own_files_alone(name: str) -> None:
    page = Path(sys.modules["lutgen.explore"].__path__[0]) / "page"
    assert page_file(page, "index.html")[1].startswith("text/html")
    with pytest.raises(RefusedError):
        page_file(page, name)


@pytest.mark.texts
def test_without_its_server_the_command_says_what_to_install(
    lutgen: Callable[..., Done], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lutgen.server.find_spec", lambda name: None if name == "uvicorn" else True)
    done = lutgen("explore", "--no-browser")
    assert (done.code, done.out) == (2, "")
    assert "pip install 'lutgen[explore]'" in done.err


@pytest.mark.slow
def test_files_that_cannot_be_shown_end_the_command_with_2_and_a_sentence(lutgen: Callable[..., Done]) -> None:
    for arguments, sentence in [
        (("nothing.csv",), "nothing.csv: cannot read the readings: no such file"),
        (("README.md",), "no format of readings that is known"),
        ((EXAMPLE, "--image", "README.md"), "README.md: not an image"),
        (("--model", "README.md"), "README.md: not a model file"),
        ((EXAMPLE, "--port", "70000"), "--port 70000: give 1 to 65535"),
    ]:
        done = lutgen("explore", "--no-browser", *arguments)
        assert (done.code, done.out) == (2, ""), arguments
        assert sentence in done.err


# The command in a separate process.


class Visitor(Client):
    """A client in place of a page: one window and its news."""

    def __init__(self, address: str) -> None:
        super().__init__(address)
        self.overview = self.post("window")
        self.window = self.overview["window"]
        self.news: Queue[tuple[str, Any]] = Queue()
        Thread(target=self._listen, daemon=True).start()

    def post(self, what: str, content: Any = None, status: int = 200, **more: str) -> Any:
        body = content if isinstance(content, bytes) else json.dumps(content or {}).encode()
        reply = self.request("POST", f"{self.path}api/{what}", body, Origin=f"http://{HOST}:{self.port}", **more)
        assert reply.status == status, self.body
        return json.loads(self.body)

    def ask(self, what: str, content: Any = None, query: str = "", status: int = 200) -> Any:  # type: ignore[override]
        return self.post(f"{what}?window={self.window}{query}", content, status)

    def see(self, what: str, query: str = "", status: int = 200) -> bytes:
        with closing(HTTPConnection(HOST, self.port, timeout=300)) as connection:
            connection.request("GET", f"{self.path}api/{what}?window={self.window}{query}")
            reply = connection.getresponse()
            body = reply.read()
        assert reply.status == status, body
        return body

    def _listen(self) -> None:
        with closing(HTTPConnection(HOST, self.port, timeout=600)) as connection:
            connection.request("GET", f"{self.path}api/events?window={self.window}")
            what = ""
            for line in connection.getresponse():
                name, _, value = line.decode().strip().partition(": ")
                if name == "event":
                    what = value
                elif name == "data":
                    self.news.put((what, json.loads(value)))

    def hears(self, what: str, holds: Callable[[Any], bool] = lambda _: True) -> Any:
        """Wait for a message of this name whose content satisfies the condition."""
        end = monotonic() + 60
        while monotonic() < end:
            name, content = self.news.get(timeout=60)
            if name == what and holds(content):
                return content
        raise AssertionError(what)


@contextmanager
def exploring(*arguments: str) -> Iterator[str]:
    command = [sys.executable, "-m", "lutgen", "explore", "--no-browser", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        first = process.stdout.readline()
        assert arguments or "simulated" in first, first
        line = process.stdout.readline() if "http" not in first else first
        assert "http://127.0.0.1:" in line, process.stderr and process.stderr.read()
        try:
            yield line.split()[-1]
            process.send_signal(2)
            out, err = process.communicate(timeout=60)
            assert (process.returncode, out, err) == (130, "", "\n")
        finally:
            process.kill()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with exploring() as address:
        yield address


@pytest.fixture
def own_address() -> Iterator[str]:
    """The address of a server that no other test's windows fill."""
    with exploring() as address:
        yield address


@pytest.mark.slow
def test_a_small_reply_comes_at_once_on_a_connection_that_is_kept(address: str) -> None:
    """A body that waits for the acknowledgement of its head would arrive 40 ms later, each time."""
    path = urlsplit(address)
    with closing(HTTPConnection(HOST, path.port or 0, timeout=60)) as connection:
        waited = []
        for _ in range(20):
            start = monotonic()
            connection.request("GET", f"{path.path}words.js")
            assert connection.getresponse().read()
            waited.append(monotonic() - start)
    assert min(waited[5:]) < 0.03


@pytest.mark.slow
def test_from_the_simulated_campaign_to_its_lut(address: str, lutgen: Callable[..., Done], tmp_path: Path) -> None:
    page = Visitor(address)
    assert page.overview["simulated"]
    assert page.hears("error")["noise_ratio"] > 30
    assert page.hears("image")["shown_width"] == 512
    assert page.see("image").startswith(b"\x89PNG")
    page.ask("find")
    assert page.hears("progress")["of"] > 0
    assert page.hears("verdict")["effects"] == BOTH
    event = page.hears("error", lambda error: not error["provisional"] and len(error["effects"]) == 2)
    assert event["noise_ratio"] < 1.1
    line = shlex.split(json.loads(page.see("commands"))[0]["command"])
    assert line[:2] == ["lutgen", "refine"]
    model = tmp_path / "model.toml"
    refined = json.loads(lutgen(*line[1:-1], str(model), "--json", "-").out)
    assert event["mean_de2000"] == refined["after"]["delta_e_mean"]
    (tmp_path / "display-a.csv").write_bytes(page.see("take", "&what=readings"))
    (tmp_path / "taken.toml").write_bytes(page.see("take", "&what=model"))
    # The same model, except the path to its readings.
    assert [text for text in (tmp_path / "taken.toml").read_text().splitlines() if not text.startswith("file")] == [
        text for text in model.read_text().splitlines() if not text.startswith("file")
    ]
    # The same list of patches to measure next.
    (planned,) = (
        shlex.split(each["command"]) for each in json.loads(page.see("commands")) if " plan " in each["command"]
    )
    lutgen(*planned[1:-1], str(tmp_path / planned[-1]))
    assert (tmp_path / planned[-1]).read_bytes() == page.see("take", "&what=patches")
    cube = page.see("take", "&what=cube&mode=chroma&hours=9000.5")
    where = ("--hours", "9000.5", "--mode", "chroma", "--format", "cube")
    lutgen("build", "--model", str(model), *where, "-o", str(tmp_path / "lut"))
    (built,) = (tmp_path / "lut").rglob("*.cube")
    assert built.read_bytes() == cube
    assert lutgen("check", str(tmp_path / "lut"), "--model", str(tmp_path / "taken.toml")).code == 0


@pytest.mark.slow
def test_two_windows_do_not_disturb_one_another_and_a_diagnosis_can_be_cancelled(address: str) -> None:
    one, other = Visitor(address), Visitor(address)
    for page in (one, other):
        page.hears("error")
    one.ask("find")
    one.hears("progress")
    other.ask("switch", {"effects": ["black-level"]})
    assert other.hears("error", lambda error: error["effects"] and not error["provisional"])["noise_ratio"] < 35
    one.ask("cancel")
    one.hears("ended")
    assert json.loads(one.see("overview"))["error"]["effects"] == []
    one.ask("switch", {"effects": ["eotf-drift"]})
    error = one.hears("error", lambda error: error["effects"] and not error["provisional"])
    assert [each["name"] for each in error["effects"]] == ["eotf-drift"]
    assert [each["name"] for each in json.loads(other.see("overview"))["error"]["effects"]] == ["black-level"]


@pytest.mark.slow
def test_files_are_dropped_and_what_was_there_stays_where_they_are_refused(
    address: str, lutgen: Callable[..., Done], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = Visitor(address)
    folder = Path(EXAMPLE).parent / "campaign"
    refused = page.ask("drop", b"hour,R,G,B,X,Y,Z\n0,1,1,1,nothing,0,0\n", "&name=bad.csv", status=400)
    assert "bad.csv" in refused["error"]
    assert "line 2" in refused["error"]
    assert json.loads(page.see("overview"))["name"] == "display-a.csv"
    assert page.ask("drop", (folder / "2021-01.ti3").read_bytes(), "&name=2021-01.ti3&more=1") == {}
    needed = page.ask("drop", (folder / "2024-12.ti3").read_bytes(), "&name=2024-12.ti3")
    assert len(needed["needs_hours"]) == 2
    composed = page.ask("drop", b"", "&hours=0,9000")
    assert composed["hours"] == [0.0, 9000.0]
    # The commands read a file that only the page has: the page offers the file for the folder of the sessions.
    assert composed["written"]
    for name in ("2021-01.ti3", "2024-12.ti3"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / composed["name"]).write_bytes(page.see("take", "&what=readings"))
    command = shlex.split(json.loads(page.see("commands"))[0]["command"])
    assert command == ["lutgen", "compare", "campaign.toml"]
    monkeypatch.chdir(tmp_path)
    assert "at 2 hours up to 9 000 h" in one_line(lutgen(*command[1:]).out)
    assert page.hears("error", lambda error: len(error["readings"]) < 600)["noise_ratio"] >= 0
    opened = page.ask("drop", Path(EXAMPLE).read_bytes(), "&name=../../again.csv")
    assert opened["name"] == "again.csv"
    assert not opened["written"]
    assert "lutgen compare again.csv" in page.see("commands").decode()


@pytest.mark.slow
def test_a_campaign_file_is_dropped_with_its_sessions(own_address: str, lutgen: Callable[..., Done]) -> None:
    page, campaign = Visitor(own_address), Path(EXAMPLE).parent / "campaign" / "campaign.toml"
    for file in campaign.parent.glob("*.ti3"):
        assert page.ask("drop", file.read_bytes(), f"&name={file.name}&more=1") == {}
    opened = page.ask("drop", campaign.read_bytes(), "&name=campaign.toml")
    compared = json.loads(lutgen("compare", str(campaign), "--json", "-").out)
    assert opened["hours"] == compared["data"]["hours"]
    assert not opened["written"]
    error = page.hears("error", lambda error: len(error["readings"]) != 620)
    assert error["mean_de2000"] == compared["error"]["delta_e_mean"]
    # Without its sessions the campaign is refused. The sentence names the file only by the file's own name.
    refused = page.ask("drop", campaign.read_bytes(), "&name=campaign.toml", status=400)["error"]
    assert "2021-01.ti3" in refused
    assert "/w" not in refused


@pytest.mark.slow
def test_a_server_that_is_stopped_while_a_file_is_made_ends_without_a_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    replies: list[int] = []
    with exploring() as address:
        page = Visitor(address)
        page.hears("error")

        def take() -> None:
            with closing(HTTPConnection(HOST, page.port, timeout=120)) as connection:
                connection.request("GET", f"{page.path}api/take?window={page.window}&what=report")
                replies.append(connection.getresponse().status)

        taking = Thread(target=take)
        taking.start()
        end = monotonic() + 60
        while not list(tmp_path.rglob("my-display.toml")):
            assert monotonic() < end
            sleep(0.02)
    taking.join()
    assert replies == [410]


@pytest.mark.slow
@pytest.mark.rare(instead="test_from_the_simulated_campaign_to_its_lut")
def test_what_is_taken_is_what_the_commands_write(
    own_address: str, lutgen: Callable[..., Done], tmp_path: Path
) -> None:
    page = Visitor(own_address)
    page.ask("switch", {"effects": ["black-level"]})
    page.hears("support")
    refine = shlex.split(json.loads(page.see("commands"))[0]["command"])
    model = tmp_path / refine[-1]
    lutgen(*refine[1:-1], str(model))
    for kind, form in (("aged", "clf"), ("compensated", "clf"), ("aged", "icc")):
        query = f"&mode=chroma-luma&hours=11500&kind={kind}"
        line = next(
            each["command"] for each in json.loads(page.see("commands", query)) if "--format cube" in each["command"]
        )
        words = shlex.split(line.replace("--format cube", f"--format {form}"))
        words[words.index("--model") + 1] = str(model)
        lutgen(*words[1:-1], str(tmp_path / f"{kind}-{form}"))
        (built,) = (tmp_path / f"{kind}-{form}").rglob(f"*.{form}")
        assert page.see("take", f"&what={form}{query}") == built.read_bytes(), (kind, form)
    report = page.see("take", "&what=report").decode()
    assert report.startswith("<!DOCTYPE html>")
    assert "Does the model hold?" in report


@pytest.mark.slow
def test_an_own_effect_of_one_line_is_added_and_code_only_when_it_is_trusted(address: str) -> None:
    page = Visitor(address)
    own = page.ask("own", {"name": "leak", "expression": "xyz + k*tau*white"})
    assert [each["name"] for each in own if each["own"]] == ["leak"]
    page.ask("switch", {"effects": ["leak", "eotf-drift"]})
    error = page.hears("error", lambda error: len(error["effects"]) == 2 and not error["provisional"])
    assert error["noise_ratio"] < 12
    assert "--add eotf-drift --add-expr 'leak: xyz + k*tau*white'" in page.see("commands").decode()
    code = b"import os\nos._exit(3)\n"
    assert "code" in page.ask("own", code, "&name=mine.py", status=403)["error"]
    assert page.ask("own", code, "&name=mine.py&trusted=yes", status=400)["error"] == ENDED
    page.ask("switch", {"effects": ["eotf-drift"]})
    assert page.hears("error", lambda error: len(error["effects"]) == 1)["effects"][0]["name"] == "eotf-drift"
    # The author changes the file and drops it again.
    for text in (GOOD, f"{GOOD}\n# changed\n"):
        own = page.ask("own", text.encode(), "&name=glow.py&trusted=yes")
        assert [each["name"] for each in own if each["own"]].count("glue-glow") == 1


def png_of(width: int, height: int) -> bytes:
    """A small compressed PNG file that states this size, all of one colour."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = zlib.compress(bytes(1 + 3 * width) * min(height, 500), 9)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def begin(connection: HTTPConnection, page: Visitor, what: str, **headers: str) -> None:
    """Announce a request body."""
    connection.putrequest("POST", f"{page.path}api/{what}")
    connection.putheader("Origin", f"http://{HOST}:{page.port}")
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()


def at_once(count: int, ask: Callable[[], Any]) -> list[Any]:
    """Ask from this number of threads. Return all answers."""
    answers: Queue[Any] = Queue()
    threads = [Thread(target=lambda: answers.put(ask())) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [answers.get_nowait() for _ in threads]


@pytest.mark.slow
def test_of_many_pages_at_once_few_are_opened() -> None:
    """Each page has a window, and so its own processes."""
    with exploring() as address:
        page = Visitor(address)

        def open_page() -> bool:
            with closing(HTTPConnection(HOST, page.port, timeout=60)) as connection:
                connection.request("GET", page.path)
                return b"windows are open. Close one" in connection.getresponse().read()

        refused = at_once(20, open_page)
        assert refused.count(False) <= MOST_WINDOWS
        assert any(refused)
        assert json.loads(page.see("overview"))["name"] == "display-a.csv"


@pytest.mark.slow
def test_hostile_input_is_refused_and_the_window_goes_on(address: str) -> None:
    page = Visitor(address)
    page.hears("error")
    # The requests announce 2 GB, or 10⁷ bytes. The server refuses the request before the bytes arrive.
    for what, name, most, size in (
        ("drop", "a.csv", READINGS, 2 * 10**9),
        ("image", "a.png", IMAGE, 2 * 10**9),
        ("drop", "a.csv", READINGS, 10**7),
    ):
        with closing(HTTPConnection(HOST, page.port, timeout=60)) as connection:
            begin(connection, page, f"{what}?window={page.window}&name={name}", Content_Length=str(size))
            assert f"larger than {most // 1_000_000} MB" in json.loads(connection.getresponse().read())["error"]
    # A body without an announced size is counted on arrival.
    with closing(HTTPConnection(HOST, page.port, timeout=60)) as connection:
        begin(connection, page, f"drop?window={page.window}&name=a.csv", Transfer_Encoding="chunked")
        for size in (READINGS, 1):
            connection.send(b"%x\r\n%s\r\n" % (size, b"\n" * size))
        assert connection.getresponse().status == 413
    assert "million pixels" in page.ask("image", png_of(60_000, 60_000), "&name=bomb.png", 400)["error"]
    assert "csv" in page.ask("drop", b"0,1,1,1,1,1,1\n" * 500_000, "&name=many.csv", 400)["error"]
    assert page.ask("drop", b"x", "&name=a.exe", 400)["error"]
    assert page.ask("drop", b"x", "&name=", 400)["error"]
    assert page.ask("switch", [1, 2], status=400)["error"]
    assert page.ask("switch", b"[" * 15_000, status=400)["error"]
    page.see("table", "&mode=../../x&hours=1", 400)
    page.see("table", "&mode=chroma&hours=nan", 400)
    page.see("table", "&mode=chroma&hours=1&kind=new", 400)
    page.see("take", "&what=../../x", 400)
    assert page.request("GET", f"{page.path}api/overview?window=w999").status == 410
    overview = f"api/overview?window={page.window}"
    assert page.request("GET", page.path + overview, Host="evil.example:80").status == 421
    assert page.request("GET", page.path + overview, Origin="http://evil.example").status == 403
    assert page.request("POST", f"{page.path}api/window", b"{}").status == 403
    for path in (f"/{overview}", f"/wrong/{overview}", f"{page.path}../{overview}", f"{page.path}vendor/../../app.py"):
        assert page.request("GET", path).status == 404, path

    def ask_table() -> int:
        with closing(HTTPConnection(HOST, page.port, timeout=60)) as connection:
            connection.request("GET", f"{page.path}api/table?window={page.window}&mode=chroma&hours=100")
            reply = connection.getresponse()
            reply.read()
            return reply.status

    answers = at_once(200, ask_table)
    assert set(answers) <= {200, 503}
    assert answers.count(200) >= MOST_AT_ONCE // 2
    assert json.loads(page.see("overview"))["name"] == "display-a.csv"
    assert page.ask("switch", {"effects": ["black-level"]})["noise_ratio"] < 35
