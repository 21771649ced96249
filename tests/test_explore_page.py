"""The page of `lutgen explore` in real browsers: the whole workflow, dropped files, and a server that has ended."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

from lutgen.colorimetry import D65, linear_to_code, xyz_to_linear
from lutgen.names import BASELINES
from lutgen.numerals import times
from lutgen.readings import read_measurements
from lutgen.readings.rest import is_tip
from tests import browser as chromium_browser
from tests import firefox as firefox_browser
from tests.browser import CHROMIUM, PATIENCE, browser
from tests.firefox import FIREFOX, firefox
from tests.session_files import ti3
from tests.test_explore import greys_alone
from tests.test_own_effects import GOOD

Page = chromium_browser.Page | firefox_browser.Page


pytestmark = [
    pytest.mark.numbers,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: chromium)"),
]

ROOT = Path(__file__).resolve().parents[1]
AXE = ROOT / "build/page/node_modules/axe-core/axe.min.js"

#: Seconds allowed for a fit or a diagnosis on a busy machine.
LONG = 150.0

READY = "document.body?.dataset.ready === 'yes' && document.getElementById('ratio-number').textContent.endsWith('×')"
FINAL = "!document.getElementById('error-state').textContent"
PATCHES = "[...document.querySelectorAll('#patches li span')].map((each) => each.textContent)"
LABELS = "[...document.querySelectorAll('#patches li')].map((each) => each.getAttribute('aria-label'))"
RATIO = "document.getElementById('ratio-number').textContent"


@contextmanager
def explored(folder: Path, *arguments: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Run `lutgen explore` in a folder: yield its address and its process."""
    command = [sys.executable, "-m", "lutgen", "explore", "--no-browser", *arguments]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    ) as process:
        try:
            assert process.stdout
            for line in process.stdout:
                if "http://" in line:
                    break
            else:
                raise AssertionError("no address was printed")
            yield "http://" + line.split("http://")[1].strip(), process
        finally:
            with ExitStack() as stack:
                stack.callback(process.wait)
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGINT)


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """The address of a server of examples/display-a.csv, which many windows use one after the other."""
    with explored(ROOT, "examples/display-a.csv") as (address, _):
        yield address


@pytest.fixture(params=["chromium", "fox"])
def either(request: pytest.FixtureRequest) -> tuple[Page, Path]:
    """Each browser in turn, and its folder of downloads."""
    page, folder = request.getfixturevalue(request.param)
    page.size(1280, 720)
    page.theme()
    return page, folder


@pytest.fixture
def page_of_either(either: tuple[Page, Path], server: str) -> Iterator[Page]:
    """Each browser in turn in a new window on examples/display-a.csv."""
    page, _ = either
    opened(page, server)
    yield page
    page.open_address("about:blank")


def opened(page: Page, address: str) -> None:
    page.open_address(address)
    page.wait(f"{READY} && document.querySelectorAll('#effects li').length > 10", LONG)


def shown(ratio: float) -> str:
    """An error in the page's notation."""
    return f"{ratio:.0f} ×" if ratio >= 100 else f"{ratio:.1f} ×"


def lutgen(*arguments: str, cwd: Path = ROOT) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "lutgen", *arguments], cwd=cwd, check=False, capture_output=True, text=True
    )
    return done.stdout + done.stderr


def click(page: Page, selector: str) -> None:
    page.ask(f"document.querySelector({json.dumps(selector)}).click()")


def text(page: Page, selector: str) -> str:
    return str(page.ask(f"document.querySelector({json.dumps(selector)}).textContent"))


def hand_over(page: Page, way: str, width: int) -> None:
    """Drop or paste a picture that the page itself paints."""
    # In Firefox the constructor of an event takes no clipboard with files.
    carrier = {"drop": "dataTransfer", "paste": "clipboardData"}[way]
    page.ask(
        f"""(() => {{
            const canvas = new window.OffscreenCanvas({width}, 40);
            canvas.getContext("2d").fillRect(0, 0, {width}, 40);
            return canvas.convertToBlob().then((blob) => {{
                const files = new window.DataTransfer();
                files.items.add(new window.File([blob], "b.png", {{ type: "image/png" }}));
                const event = new window.Event({json.dumps(way)}, {{ cancelable: true }});
                window.dispatchEvent(Object.assign(event, {{ {carrier}: files }}));
            }});
        }})()"""
    )


def taken(page: Page, downloads: Path, what: str, suffix: str) -> Path:
    """Download a file, and wait until the browser has saved it."""
    click(page, f"#take-{what}")
    page.wait("document.getElementById('take-state').textContent.endsWith('kB')", LONG)
    until(lambda: any(each.stat().st_size for each in downloads.glob(f"*{suffix}")), f"no {suffix} was saved")
    (file,) = downloads.glob(f"*{suffix}")
    return file


def commands_of(page: Page) -> list[list[str]]:
    """The commands to copy, split as a shell splits them."""
    click(page, "#take-open")
    page.wait("document.querySelectorAll('#commands code').length > 2")
    listed = page.ask("[...document.querySelectorAll('#commands code')].map((each) => each.textContent)")
    return [shlex.split(each) for each in listed]


def drop(page: Page, *files: tuple[str, str]) -> None:
    """Drop files on the page. Each file is a name and its text."""
    page.ask(
        f"""(() => {{
            const dataTransfer = new window.DataTransfer();
            for (const [name, text] of {json.dumps(files)}) dataTransfer.items.add(new window.File([text], name));
            window.dispatchEvent(new window.DragEvent("drop", {{ dataTransfer, bubbles: true, cancelable: true }}));
        }})()"""
    )


def until(condition: Callable[[], object], otherwise: str) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, otherwise
        time.sleep(0.1)


def building(server: int) -> bool:
    """Whether `lutgen build` runs as a descendant of the server."""
    pids = [server]
    for parent in pids:
        for task in Path(f"/proc/{parent}/task").glob("*/children"):
            pids += map(int, task.read_text().split())
    lines = (Path(f"/proc/{each}/cmdline") for each in pids)
    return any(b"\0build\0" in line.read_bytes() for line in lines if line.exists())


def switched_on(page: Page) -> set[str]:
    names = page.ask("[...document.querySelectorAll('[role=switch]:checked')].map((each) => each.id)")
    return {each.removeprefix("effect-") for each in names}


def overlapping(page: Page) -> list[str]:
    """Words of the error's head that overlap one another."""
    labels: list[str] = page.ask(
        """(() => {
            const words = ["ratio", "error-mean", "error-state", "error-where", "noise-line", "stop"]
                .map((id) => document.querySelector(`#${id} span`) ?? document.getElementById(id))
                .filter((each) => each.getClientRects().length && each.textContent);
            const boxes = words.map((each) => {
                const range = document.createRange();
                range.selectNodeContents(each);
                return range.getBoundingClientRect();
            });
            const before = (a, b) => a.right <= b.left || a.bottom <= b.top + 3;
            const apart = (a, b) => before(a, b) || before(b, a);
            return words.flatMap((one, i) => words.slice(i + 1).map((other, j) =>
                apart(boxes[i], boxes[i + 1 + j]) ? "" : `${one.textContent} / ${other.textContent}`)).filter(Boolean);
        })()"""
    )
    return labels


def cut_words(page: Page) -> list[str]:
    """Words that are wider than the element that holds them."""
    words: list[str] = page.ask(
        """[..."h1 h2 button .button label dt dd figcaption .heads>span #error-mean".split(" ")]
            .flatMap((each) => [...document.querySelectorAll(each)])
            .filter((each) => each.scrollWidth > each.clientWidth + 1 && getComputedStyle(each).display !== "inline")
            .filter((each) => !["hidden", "clip"].includes(getComputedStyle(each.parentElement).overflow))
            .filter((each) => getComputedStyle(each).clipPath === "none")
            .map((each) => each.textContent)"""
    )
    return words


def shown_pixels(page: Page) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """The picture's canvas, one pixel of each 16."""
    values = page.ask(
        """(() => {
            const canvas = document.querySelector("#viewer canvas");
            const copy = new OffscreenCanvas(canvas.width / 4, canvas.height / 4);
            const context = copy.getContext("2d");
            context.drawImage(canvas, 0, 0, copy.width, copy.height);
            return [...context.getImageData(0, 0, copy.width, copy.height).data];
        })()"""
    )
    return np.array(values, np.uint8)


# The whole workflow -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_whole_road_from_the_error_to_a_lut(either: tuple[Page, Path], tmp_path: Path) -> None:
    page, downloads = either
    with explored(ROOT, "examples/display-a.csv") as (address, _):
        opened(page, address)
        lutgen("compare", "examples/display-a.csv", "--json", str(tmp_path / "c.json"))
        content = json.loads((tmp_path / "c.json").read_text())
        before = content["error"]["rms_sigma"] / content["floor"]["rms_sigma"]
        assert text(page, "#ratio-number") == shown(before)
        assert page.ask("document.querySelectorAll('.slice .point').length") > 30
        aged = shown_pixels(page)
        click(page, "#find")
        page.wait(f"document.querySelector('#verdict b') && document.getElementById('finding').hidden && {FINAL}", LONG)
        page.wait(f"{RATIO} === '1.0 ×' && {FINAL}", LONG)
        assert text(page, "#verdict b") == "several: "
        assert switched_on(page) == {"eotf-drift", "black-level"}
        page.wait("document.getElementById('error').classList.contains('good')")
        until(lambda: not np.array_equal(shown_pixels(page), aged), "the picture stays as it was")
        # The page's results and the output of its commands are the same.
        commands = commands_of(page)
        (refine,) = (each for each in commands if each[1] == "refine")
        (tmp_path / "examples").mkdir()
        (tmp_path / "examples/display-a.csv").write_bytes((ROOT / "examples/display-a.csv").read_bytes())
        printed = lutgen(*refine[1:], cwd=tmp_path)
        assert f"falls from {times(before)}" in printed, printed
        (build,) = (each for each in commands if "cube" in each)
        assert "1 LUT" in lutgen(*build[1:], cwd=tmp_path), build
        cube = taken(page, downloads, "cube", ".cube")
        (built,) = (tmp_path / build[-1]).rglob("*.cube")
        numbers = [[line for line in path.read_text().splitlines() if line[:1].isdigit()] for path in (cube, built)]
        assert numbers[0] == numbers[1]
        assert len(numbers[0]) >= 17**3
        assert "all true to the model" in lutgen("check", build[-1], cwd=tmp_path)
        cube.unlink()
        archive = taken(page, downloads, "build", ".zip")
        with ZipFile(archive) as packed:
            assert any(name.endswith("config.ocio") for name in packed.namelist())
            packed.extractall(tmp_path / "zip")
        archive.unlink()
        (whole,) = (tmp_path / "zip").iterdir()
        model = ("--model", str(tmp_path / refine[-1]))
        assert "all true to the model" in lutgen("check", str(whole), *model, cwd=tmp_path)
        page.open_address("about:blank")


# Dropped files ------------------------------------------------------------------------------------------------------


def test_a_ti3_is_opened_and_several_are_asked_for_their_hours(page_of_either: Page) -> None:
    page = page_of_either
    drop(page, ("a.ti3", ti3()), ("b.ti3", ti3().replace("Tue May 26 13:21:48 2020", "Fri May 27 10:00:00 2022")))
    page.wait("document.querySelectorAll('#drop-hours input').length === 2")
    page.ask(
        "[...document.querySelectorAll('#drop-hours input')].forEach((each, place) => { each.value = 4000 * place; })"
    )
    click(page, "#drop-hours button")
    page.wait("document.getElementById('provenance').textContent.includes('at 2 hours')", LONG)
    page.wait(READY, LONG)
    assert page.ask("document.getElementById('hours').max") == "4000"


def test_sessions_that_look_like_two_displays_are_opened_when_one_says_that_they_are_one(page_of_either: Page) -> None:
    page = page_of_either
    later = ti3(name="other").replace("Tue May 26 13:21:48 2020", "Fri May 27 10:00:00 2022")
    drop(page, ("a.ti3", ti3()), ("b.ti3", later))
    page.wait("!document.getElementById('drop-same').hidden", LONG)
    assert "these sessions are of 2 displays" in text(page, "#drop-trouble")
    assert page.ask("document.getElementById('drop-hours').hidden")
    click(page, "#drop-same")
    page.wait("document.querySelectorAll('#drop-hours input').length === 2", LONG)
    assert page.ask("document.getElementById('drop-same').hidden")
    page.ask("[...document.querySelectorAll('#drop-hours input')].forEach((each, at) => { each.value = 4000 * at; })")
    click(page, "#drop-hours button")
    page.wait("document.getElementById('provenance').textContent.includes('at 2 hours')", LONG)


@pytest.mark.parametrize(
    ("name", "content"),
    [("broken.csv", "hour,R,G,B,X,Y,Z\n0,1,1,1,abc,100,100\n"), ("broken.ti3", "CTI3\n\nnothing\n")],
)
def test_a_broken_file_is_refused_in_the_commands_own_sentence_and_what_was_there_stays(
    page_of_either: Page, tmp_path: Path, name: str, content: str
) -> None:
    page = page_of_either
    before = text(page, "#name"), text(page, "#ratio-number"), text(page, "#provenance")
    drop(page, (name, content))
    page.wait("!document.getElementById('drop-trouble').hidden")
    trouble = text(page, "#drop-trouble")
    (tmp_path / name).write_text(content)
    if name.endswith("csv"):
        printed = " ".join(lutgen("compare", name, cwd=tmp_path).split()).removeprefix("lutgen: error: ")
        assert trouble == printed
    assert name in trouble
    assert str(tmp_path.parents[1]) not in trouble
    assert (text(page, "#name"), text(page, "#ratio-number"), text(page, "#provenance")) == before


def test_an_image_is_dropped_or_pasted_and_one_that_is_none_is_refused(page_of_either: Page) -> None:
    page = page_of_either
    picture = "[viewer.size, viewer.aged.first.size]".replace("viewer", "document.getElementById('viewer').viewer")
    before = page.ask(picture)
    drop(page, ("a.png", "no image"))
    page.wait("!document.getElementById('image-trouble').hidden")
    assert "a.png" in text(page, "#image-trouble")
    assert page.ask(picture) == before
    for way, width in (("drop", 60), ("paste", 70)):
        hand_over(page, way, width)
        page.wait(f"{picture}[0][0] === {width}")
        assert page.ask("document.getElementById('image-trouble').hidden")
        # The aged picture is measured, too.
        page.wait("/\\d/.test(document.getElementById('figure-mean').textContent)", LONG)


# Effects ------------------------------------------------------------------------------------------------------------


def test_an_effect_of_ones_own_is_added_and_switched_on(page_of_either: Page) -> None:
    page = page_of_either
    click(page, "#effect-eotf-drift")
    page.wait(f"document.querySelector('.parameter') && {FINAL}", LONG)
    before, both = text(page, "#ratio-number"), {"eotf-drift", "own-1"}
    page.ask("void (document.getElementById('own-line').value = 'xyz + k*tau*white')")
    click(page, "#own button")
    page.wait("!!document.getElementById('effect-own-1')?.checked", LONG)
    # Effects that were switched on stay on, from the first moment.
    assert switched_on(page) == both
    page.wait(f"{RATIO} !== {json.dumps(before)} && !!document.querySelector('#effect-own-1-parameters *')", LONG)
    assert text(page, "#error-state") == ""
    assert switched_on(page) == both
    page.ask("void (document.getElementById('own-line').value = 'xyz + nonsense(')")
    click(page, "#own button")
    page.wait("!document.getElementById('physics-trouble').hidden")
    assert switched_on(page) == both


def test_a_program_is_run_only_after_a_warning(page_of_either: Page, tmp_path: Path) -> None:
    page, mark = page_of_either, tmp_path / "ran"
    source = f"open({str(mark)!r}, 'w').close()\n{GOOD}"
    drop(page, ("e.py", source))
    page.wait("document.getElementById('trust').open")
    assert "e.py" in text(page, "#trust-name")
    click(page, "#trust button[value=no]")
    page.wait("!document.getElementById('trust').open")
    assert not mark.exists()
    before = text(page, "#ratio-number")
    drop(page, ("e.py", source))
    page.wait("document.getElementById('trust').open")
    click(page, "#trust button[value=yes]")
    page.wait(
        f"document.getElementById('effect-glue-glow')?.checked && {RATIO} !== {json.dumps(before)} && {FINAL}", LONG
    )
    assert mark.exists()
    (refine,) = (each for each in commands_of(page) if each[1] == "refine")
    assert refine[refine.index("--effects") + 1] == "e.py"
    assert refine[refine.index("--add") + 1] == "glue-glow"


def test_a_switch_gives_an_error_at_once_and_what_if_moves_it(page_of_either: Page) -> None:
    page = page_of_either
    before = text(page, "#ratio-number")
    click(page, "#effect-black-level")
    # Effects that the server tries meanwhile do not switch the effect off again.
    for _ in range(5):
        assert switched_on(page) == {"black-level"}, text(page, "#physics-trouble")
    page.wait(f"{RATIO} !== {json.dumps(before)} && document.querySelector('.parameter input') && {FINAL}", LONG)
    fitted = text(page, "#ratio-number")
    page.ask(
        """(() => {
            const slider = document.querySelector(".parameter input");
            slider.value = 900;
            slider.dispatchEvent(new window.Event("input"));
        })()"""
    )
    page.wait("document.getElementById('error-state').textContent.startsWith('what if')", LONG)
    page.wait(f"{RATIO} !== {json.dumps(fitted)}")
    assert overlapping(page) == []
    assert page.ask("getComputedStyle(document.querySelector('.parameter')).filter") == "grayscale(1)"
    assert [each for each in commands_of(page) if each[1] == "refine"]
    assert "are of the fit" in text(page, "#take-warning")
    page.ask("document.getElementById('take').hidePopover()")
    page.ask("[...document.querySelectorAll('.parameters button')].at(-1).click()")
    page.wait(f"{RATIO} === {json.dumps(fitted)} && {FINAL}", LONG)
    assert page.ask("getComputedStyle(document.querySelector('.parameter')).filter") == "none"


def test_a_first_step_that_comes_after_its_fit_is_not_shown(page_of_either: Page) -> None:
    page = page_of_either
    before = text(page, "#ratio-number")
    page.ask(
        """(() => {
            const fetched = window.fetch;
            window.late = false;
            window.fetch = async (to, ...more) => {
                const answer = await fetched(to, ...more);
                if (!String(to).includes("switch")) return answer;
                const body = await answer.text();
                while (!window.release) await new Promise((resolve) => setTimeout(resolve, 50));
                setTimeout(() => { window.late = true; }, 500);
                return new Response(body, { status: answer.status, headers: answer.headers });
            };
        })()"""
    )
    click(page, "#effect-black-level")
    page.wait(f"{RATIO} !== {json.dumps(before)} && {FINAL}", LONG)
    fitted = text(page, "#ratio-number")
    page.ask("window.release = true")
    page.wait("window.late", LONG)
    assert text(page, "#ratio-number") == fitted
    assert not text(page, "#error-state")


def test_the_picture_answers_a_switch_and_shows_what_it_was_without_it(page_of_either: Page) -> None:
    page = page_of_either
    # The picture is measured before the change, so that the page can state the earlier numbers.
    page.wait("/\\d/.test(document.getElementById('figure-mean').textContent)", LONG)
    before, mean = shown_pixels(page), text(page, "#figure-mean")
    assert page.ask("document.getElementById('with-label').hidden")
    click(page, "#effect-black-level")
    page.wait(f"!document.getElementById('with-label').hidden && {FINAL}", LONG)
    assert text(page, "#with-names") == "with black-level"
    page.wait(f"document.querySelector('#figure-mean small')?.textContent === {json.dumps(f' was {mean}')}", LONG)
    until(lambda: not np.array_equal(shown_pixels(page), before), "the picture does not answer")
    click(page, "#with")
    until(lambda: np.array_equal(shown_pixels(page), before), "the picture does not show what it was")
    page.wait(f"document.getElementById('figure-mean').firstChild.textContent === {json.dumps(mean)}", LONG)


def test_sizes_and_hours_are_in_words_and_with_spaces(page_of_either: Page) -> None:
    page = page_of_either
    script = "[...document.querySelectorAll('#effects li:not(.unseen-by-data) .seen')].map((each) => each.innerText)"
    for words in page.ask(script):
        # A size, its unit, and what has the size. The jump of the matrices has no size.
        assert re.fullmatch(r"any size|[\d.]+( ×10[⁻\d⁰-⁹]+)?( \S+)?\n.{10,}", words.strip()), words
    ends = page.ask("document.querySelector('[data-slice=hour] .point:last-child').getAttribute('aria-label')")
    assert "18\u00a0000 h" in ends
    click(page, "#effect-eotf-drift")
    page.wait(f"!!document.querySelector('.parameter') && {FINAL}", LONG)
    assert "growth by 18\u00a0000 h" in text(page, "#effect-eotf-drift-parameters")
    assert page.ask("document.querySelector('.parameters button').hidden")


def test_readings_of_one_hour_say_that_nothing_ages(page_of_either: Page) -> None:
    page = page_of_either
    assert page.ask("document.getElementById('one-hour').hidden")
    drop(page, ("a.ti3", ti3()))
    page.wait(f"document.getElementById('provenance').textContent.includes('at 1 hour') && {READY}", LONG)
    assert not page.ask("document.getElementById('one-hour').hidden")
    assert page.ask("document.getElementById('hours').disabled")
    page.wait("document.getElementById('figure-mean').textContent === '0.00'", LONG)
    assert text(page, "#figure-hours_to_3") == "–"


def test_an_error_that_came_before_its_readings_did_is_shown(page_of_either: Page) -> None:
    """On a busy machine the server's news of readings may arrive before its answer to their drop."""
    page = page_of_either
    page.ask(
        """void (window.fetch = ((fetch) => async (...asked) => {
            const answer = await fetch(...asked);
            if (!String(asked[0]).includes("baseline")) return answer;
            await new Promise((heard) => setTimeout(heard, 5000));
            setTimeout(() => { document.body.dataset.answered = "yes"; }, 1000);
            return answer;
        })(window.fetch))"""
    )
    page.ask(
        """(() => {
            const choice = document.getElementById("baseline");
            choice.value = "native";
            choice.dispatchEvent(new window.Event("change"));
        })()"""
    )
    page.wait("document.body.dataset.answered === 'yes'", LONG)
    page.wait(f"{RATIO}.endsWith('×')")


def test_what_takes_the_error_down_furthest_stands_first(page_of_either: Page) -> None:
    page = page_of_either
    bars = "[...document.querySelectorAll('#effects li:not(.unseen-by-data) .alone')]"
    page.wait(f"{bars}.every((each) => each.firstChild)", LONG)
    falls = f"{bars}.map((each) => Number.parseFloat(each.textContent))"
    page.wait(f"{falls}.every((each, place, all) => !place || each >= all[place - 1])", LONG)
    assert len(set(page.ask(falls))) > 3


def test_rows_stay_where_they_are_when_they_are_switched(page_of_either: Page) -> None:
    page = page_of_either
    order = "[...document.querySelectorAll('#effects li')].map((each) => each.id)"
    page.wait("!!document.querySelector('#effects li:last-child .alone')", LONG)
    click(page, "#effect-black-level")
    before = page.ask(order)
    alone = "document.querySelectorAll('#effects li:not(.unseen-by-data) .alone:empty').length"
    page.wait(f"document.querySelector('.parameter') && {FINAL} && {alone} === 0", LONG)
    click(page, "#effect-black-level")
    page.wait(f"!document.querySelector('.parameter') && {FINAL}", LONG)
    assert page.ask(order) == before


def test_another_baseline_gives_the_error_and_the_commands_of_that_baseline(
    page_of_either: Page, tmp_path: Path
) -> None:
    page = page_of_either
    hours = page.ask("document.getElementById('hours').value = 9000")
    assert page.ask("[...document.getElementById('baseline').options].map((each) => each.value)") == list(BASELINES)
    for baseline in ("native", "first-hour"):
        before = text(page, "#ratio-number")
        page.ask(
            f"""(() => {{
                const choice = document.getElementById("baseline");
                choice.value = {json.dumps(baseline)};
                choice.dispatchEvent(new window.Event("change"));
            }})()"""
        )
        page.wait(f"{READY} && {RATIO} !== {json.dumps(before)} && {FINAL}", LONG)
        file = tmp_path / f"{baseline}.json"
        lutgen("compare", "examples/display-a.csv", "--baseline", baseline, "--json", str(file))
        content = json.loads(file.read_text())
        assert text(page, "#ratio-number") == shown(content["error"]["rms_sigma"] / content["floor"]["rms_sigma"])
    assert page.ask("document.getElementById('hours').valueAsNumber") == hours
    click(page, "#effect-black-level")
    page.wait(f"document.querySelector('.parameter') && {FINAL}", LONG)
    commands = commands_of(page)
    # Of refine, diagnose and plan. The other commands read the baseline from the model file.
    assert [each[each.index("--baseline") + 1] for each in commands[:3]] == ["first-hour"] * 3
    assert not any("--baseline" in each for each in commands[3:])


def test_the_diagnosis_is_cancelled(page_of_either: Page) -> None:
    page = page_of_either
    click(page, "#find")
    page.wait("!document.getElementById('finding').hidden")
    click(page, "#cancel")
    page.wait("document.getElementById('finding').hidden", LONG)
    assert not page.ask("document.getElementById('find').disabled")
    assert text(page, "#verdict") == ""
    page.wait(READY, LONG)


def test_a_fit_that_takes_long_is_stopped(page_of_either: Page, tmp_path: Path) -> None:
    """An effect that is slow while a file exists: its fit would take minutes."""
    page, slow = page_of_either, tmp_path / "slow"
    dawdle = f"    import os, time\n    time.sleep(0.3 * os.path.exists({str(slow)!r}))\n    return"
    before = text(page, "#ratio-number")
    drop(page, ("e.py", GOOD.replace("    return", dawdle)))
    page.wait("document.getElementById('trust').open")
    click(page, "#trust button[value=yes]")
    page.wait(f"document.getElementById('effect-glue-glow')?.checked && {RATIO} !== {json.dumps(before)}", LONG)
    page.wait(FINAL, LONG)
    assert page.ask("document.getElementById('stop').hidden")
    slow.touch()
    click(page, "#effect-black-level")
    page.wait("!document.getElementById('stop').hidden", LONG)
    assert text(page, "#error-state").startswith("provisional")
    click(page, "#stop")
    slow.unlink()
    page.wait(f"{FINAL} && {RATIO} === {json.dumps(before)}", LONG)
    page.wait("document.getElementById('stop').hidden && !document.querySelector('[role=switch]:checked')", LONG)
    # A new process answers, not the process that was ended.
    click(page, "#effect-black-level")
    page.wait(f"document.querySelector('.parameter input') && {RATIO} !== {json.dumps(before)} && {FINAL}", LONG)
    assert switched_on(page) == {"black-level"}


def test_rivals_are_marked_and_what_to_measure_next_is_a_list_of_patches(
    either: tuple[Page, Path], tmp_path: Path
) -> None:
    page, downloads = either
    (tmp_path / "greys.csv").write_text(greys_alone())
    with explored(tmp_path, "greys.csv") as (address, _):
        opened(page, address)
        click(page, "#find")
        page.wait(f"document.querySelector('#verdict b') && document.getElementById('finding').hidden && {FINAL}", LONG)
        page.wait("!!document.querySelector('.parameter')", LONG)
        (likeliest,) = switched_on(page)
        marked = "[...document.querySelectorAll('.rival:not([hidden])')].map((each) => each.closest('li').id)"
        rivals = {each.removeprefix("row-") for each in page.ask(marked)}
        assert rivals
        assert likeliest not in rivals
        assert all(each in text(page, "#verdict") for each in rivals)
        (plan,) = (each for each in commands_of(page) if each[1] == "plan")
        lutgen(*plan[1:], cwd=tmp_path)
        page.ask("document.getElementById('take').hidePopover()")
        click(page, "#patch-list")
        until(lambda: any(each.stat().st_size for each in downloads.glob("patches*.csv")), "no list was saved")
        (patches,) = downloads.glob("patches*.csv")
        assert patches.read_bytes() == (tmp_path / plan[-1]).read_bytes()
        patches.unlink()
        page.open_address("about:blank")


def test_what_the_readings_do_not_support_is_told_and_the_command_keeps_it(page_of_either: Page) -> None:
    page = page_of_either
    click(page, "#effect-edge-falloff")
    page.wait(f"document.querySelector('.parameter') && {FINAL}", LONG)
    caution = "The readings do not support edge-falloff"
    assert caution in text(page, "#effect-edge-falloff-parameters .caution")
    (refine,) = (each for each in commands_of(page) if each[1] == "refine")
    assert "--keep" in refine
    assert caution in text(page, "#take-warning")


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in Linux's /proc")
def test_what_is_being_made_is_cancelled(either: tuple[Page, Path]) -> None:
    page, downloads = either
    with explored(ROOT, "examples/display-a.csv") as (address, process):
        opened(page, address)
        click(page, "#take-open")
        assert page.ask("document.getElementById('take-cancel').hidden")
        click(page, "#take-build")
        page.wait("!document.getElementById('take-cancel').hidden")
        until(lambda: building(process.pid), "nothing is built")
        click(page, "#take-cancel")
        page.wait("document.getElementById('take-cancel').hidden")
        assert text(page, "#take-trouble") == "Cancelled."
        assert text(page, "#take-state") == ""
        assert not page.ask("document.getElementById('take-build').disabled")
        until(lambda: not building(process.pid), "it is built for nobody")
        assert not list(downloads.glob("*.zip"))
        page.open_address("about:blank")


# The patches with the largest error ---------------------------------------------------------------------------------


def test_a_slice_that_is_chosen_filters_the_patches_and_the_other_charts(page_of_either: Page) -> None:
    page = page_of_either
    read = read_measurements("examples/display-a.csv")
    chart = "(() => document.querySelector('[data-slice={}] canvas').toDataURL())()"
    everything = {name: page.ask(chart.format(name)) for name in ("hour", "level")}
    worst = [float(each) for each in page.ask(PATCHES)]
    assert worst == sorted(worst, reverse=True)
    assert len(worst) == 200
    point = "document.querySelector('[data-slice=hour] .points').firstElementChild"
    # The model is anchored to white and primaries at rest: no slice has them.
    anchors = read.at_rest() & is_tip(read.drive).any(axis=1)
    of_hour_0 = int(((read.hours == 0) & ~anchors).sum())
    assert page.ask(f"{point}.getAttribute('aria-label')").endswith(f"times the noise, {of_hour_0} readings")
    page.ask(f"{point}.click()")
    assert text(page, "#readings-title").startswith(f"{of_hour_0} readings at hour 0 h")
    assert page.ask("document.querySelectorAll('#patches li').length") == of_hour_0
    assert all(" at 0 h, " in each for each in page.ask(LABELS))
    page.wait(f"{chart.format('level')} !== {json.dumps(everything['level'])}")
    click(page, "#readings-title button")
    page.wait(f"{chart.format('level')} === {json.dumps(everything['level'])}")
    assert [float(each) for each in page.ask(PATCHES)] == worst


def test_swatches_are_the_measured_and_the_predicted_colour(page_of_either: Page) -> None:
    """The worst patch is dark and red. Its halves show the measured and the predicted colour."""
    page = page_of_either
    label = page.ask(LABELS)[0]
    image = page.ask("getComputedStyle(document.querySelector('#patches .swatch')).backgroundImage")
    measured, predicted = (
        [int(each) for each in numbers.split(",")[:3]] for numbers in re.findall(r"rgba?\(([^)]*)\) 50%", image)
    )
    read = read_measurements("examples/display-a.csv")
    row = list(read.lines).index(int(label.split(":")[0].removeprefix("line ")))
    white = read.xyz_cd_m2[(read.drive == 1).all(axis=1) & (read.hours == 0) & read.at_rest()].mean(axis=0)
    wanted = 255 * linear_to_code(np.clip(xyz_to_linear(read.xyz_cd_m2[row] / white * D65), 0, 1))
    assert np.abs(measured - wanted).max() < 1
    assert measured != predicted
    page.ask("document.querySelector('#patches li').dispatchEvent(new window.PointerEvent('pointerenter'))")
    assert text(page, "#tip") == label


# Windows and the server ---------------------------------------------------------------------------------------------


@pytest.mark.rare(
    instead="test_explore.py::test_two_windows_do_not_disturb_one_another_and_a_diagnosis_can_be_cancelled"
)
def test_two_windows_do_not_disturb_one_another(either: tuple[Page, Path], tmp_path: Path) -> None:
    first = either[0]
    with explored(ROOT, "examples/display-a.csv") as (address, _), browser(tmp_path / "second") as second:
        opened(first, address)
        opened(second, address)
        before = text(second, "#ratio-number")
        click(first, "#effect-black-level")
        first.wait(f"{RATIO} !== {json.dumps(before)} && {FINAL}", LONG)
        assert text(second, "#ratio-number") == before
        assert switched_on(second) == set()
        first.open_address("about:blank")


def test_the_page_says_when_the_server_has_gone(either: tuple[Page, Path]) -> None:
    page = either[0]
    with explored(ROOT, "examples/display-a.csv") as (address, process):
        opened(page, address)
        os.killpg(process.pid, signal.SIGKILL)
        page.wait("!document.getElementById('dead').hidden")
        assert "Start lutgen explore again" in text(page, "#dead")


@pytest.fixture(params=["chromium", "firefox"])
def without_webgl(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Page]:
    """Each browser in turn, with a graphics driver without WebGL2."""
    if request.param == "firefox":
        if FIREFOX is None:
            pytest.skip("Firefox and a screen for it are not installed (Debian: firefox-esr, xvfb)")
        with firefox(tmp_path / "profile", webgl_disabled=True) as page:
            yield page
        return
    with browser(tmp_path / "profile") as blind:
        none = "HTMLCanvasElement.prototype.getContext = ((get) => function (kind, ...more) "
        none += "{ return kind === 'webgl2' ? null : get.call(this, kind, ...more); })"
        none += "(HTMLCanvasElement.prototype.getContext);"
        blind.call("Page.addScriptToEvaluateOnNewDocument", source=none)
        yield blind


def test_without_webgl_the_rest_of_the_page_serves(without_webgl: Page) -> None:
    page = without_webgl
    with explored(ROOT, "examples/display-a.csv") as (address, _):
        opened(page, address)
        assert "no WebGL2" in text(page, "#image-trouble")
        click(page, "#effect-black-level")
        page.wait(f"document.querySelector('.parameter input') && {FINAL}", LONG)


# Access -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (1024, 768)])
def test_everything_is_inside_the_window(page_of_either: Page, size: tuple[int, int]) -> None:
    page = page_of_either
    page.size(*size)
    time.sleep(0.3)
    assert page.ask("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]") == list(size)
    for name in ("#viewer", "#hours", "#figures", "#ratio", "#slices", "#find", "#take-open", "#drop-open"):
        at = page.ask(f"document.querySelector({name!r}).getBoundingClientRect().toJSON()")
        assert at["left"] >= 0, name
        assert at["top"] >= 0, name
        assert at["right"] <= size[0], name
        assert at["bottom"] <= size[1], name
    assert cut_words(page) == []
    assert overlapping(page) == []


def test_the_keyboard_reaches_everything(page_of_either: Page) -> None:
    """From the top of the page the Tab key reaches each control, and keys operate the controls."""
    page = page_of_either
    page.ask("document.body.tabIndex = -1, document.body.focus(), document.body.removeAttribute('tabindex')")
    focused: list[str] = []
    for _ in range(120):
        page.press("Tab", 9)
        focused.append(
            page.ask("document.activeElement.id || document.activeElement.className || document.activeElement.tagName")
        )
        if focused[-1] == "own-file":
            break
    wanted = ["drop-open", "take-open", "map", "image", "viewer-bar", "hours", "patches", "find", "effect-black-level"]
    assert [name for name in (*wanted, "own-line") if name not in focused] == []
    assert sum("point" in each for each in focused) == page.ask("document.querySelectorAll('.points').length")
    page.ask("document.getElementById('hours').focus()")
    hours = page.ask("document.getElementById('hours').valueAsNumber")
    page.press("ArrowLeft", 37)
    assert page.ask("document.getElementById('hours').valueAsNumber") == hours - 100
    page.ask("document.getElementById('effect-black-level').focus()")
    page.press(" ", 32, " ")
    page.wait("document.getElementById('effect-black-level').checked")
    page.ask("document.querySelector('[data-slice=hour] .point').focus()")
    assert not page.ask("document.getElementById('tip').hidden")
    page.press("Enter", 13, "\r")
    page.wait("document.querySelector('[data-slice=hour] .point').ariaPressed === 'true'")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not there (make programs)")
def test_axe_finds_no_violation(page_of_either: Page, theme: str) -> None:
    page = page_of_either
    page.theme(theme)
    assert page.ask("matchMedia('(prefers-color-scheme: dark)').matches") == (theme == "dark")
    page.run(AXE.read_text())
    for panel in ("", "take", "drop"):
        if panel:
            page.ask(f"document.getElementById({panel!r}).showPopover()")
            time.sleep(0.3)
        # The first call covers the page behind an open panel.
        violations = page.ask(
            f"window.axe.run({f'#{panel}' if panel else 'html'!r}).then(({{ violations }}) => "
            "violations.map(({ id, nodes }) => [id, nodes.map((each) => each.html)]))"
        )
        assert violations == [], panel
        if panel:
            page.ask(f"document.getElementById({panel!r}).hidePopover()")


def test_the_page_asks_nobody_but_its_server_and_has_no_complaint(chromium: tuple[Page, Path]) -> None:
    page: Any = chromium[0]
    page.requests.clear()
    page.complaints.clear()
    with explored(ROOT, "examples/display-a.csv") as (address, _):
        opened(page, address)
        click(page, "#map")
        page.wait("!document.getElementById('scale').hidden")
        page.open_address("about:blank")
    assert {each for each in page.requests if not each.startswith((address, "data:", "blob:", "about:"))} == set()
    # The page requests one image, and no preload is unused (the browser would complain).
    assert sum("/api/image" in each for each in page.requests) == 1
    assert [each for each in page.complaints if "ReadPixels" not in each] == []
