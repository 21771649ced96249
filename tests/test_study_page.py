"""The session's page in a real browser: a whole session of 120 images, pixels, keys, pauses, warnings, faults."""

from __future__ import annotations

import io
import os
import signal
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from lutgen.study.analysis import analyse_answers
from lutgen.study.answer_file import AnswerRow, NotSavedError, read_entries
from lutgen.study.answers import read_answers
from lutgen.study.protocol import Category, read_protocol
from lutgen.study.reading import Decision, begin_reading
from lutgen.study.server import Conversation, serving
from lutgen.study.simulated import PAPER_DIFFERENCES, SimulatedReader, simulate
from tests.browser import CHROMIUM, Page, browser
from tests.studies import CONDITIONS, Clock, make_study
from tests.test_study_server import running

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.study.answers import Answer
    from lutgen.study.protocol import StudyTrial
    from lutgen.study.reading import ReadingSession

pytestmark = [
    pytest.mark.numbers,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: chromium)"),
]

WINDOW = (1280, 900)

#: Key events of Chromium: the key's code, and the text that it types.
KEYS = {"Enter": (13, "\r"), "Backspace": (8, ""), " ": (32, " ")}

#: sRGB around the image, as the docstring of the page's module states.
GREY = (119, 119, 119)

#: Tolerance in seconds between the page's record of a first paint or a key and the driver's record: one frame of
#: 1/60 s, and the browser's rounding of the paint.
TOLERANCE = 0.025


@pytest.fixture(scope="module")
def page(chromium: tuple[Page, Path]) -> Iterator[Page]:
    yield chromium[0]
    chromium[0].open_address("about:blank")


@pytest.fixture(autouse=True)
def window(page: Page) -> None:
    page.size(*WINDOW)
    page.call("Emulation.setEmulatedMedia", features=[])
    page.complaints.clear()


@contextmanager
def served(folder: Path, **more: Any) -> Iterator[tuple[str, ReadingSession]]:
    """Serve the first session of a new study in this process."""
    make_study(folder / "study", **more)
    with begin_reading(folder / "study", reader="Dr A", session=1, clock=Clock()) as reading:
        conversation = Conversation(reading, lambda _: None)
        with serving(conversation) as address:
            yield address, reading


def screen(page: Page) -> str:
    return str(page.ask("document.body?.dataset.screen"))


def wait_for(page: Page, name: str) -> None:
    page.wait(f"document.body?.dataset.screen === '{name}' && document.body.ariaBusy === 'false'")


def press(page: Page, *keys: str) -> None:
    for key in keys:
        code, text = KEYS.get(key, (ord(key.upper()[0]), key))
        page.press(key, code, text)


def open_page(page: Page, address: str) -> None:
    page.call("Page.navigate", url=address)
    wait_for(page, "welcome")


def wait_for_image(page: Page, place: str = "") -> None:
    """Wait until the page accepts an answer on an image."""
    page.wait(
        "document.body?.dataset.screen === 'reading' && document.body.ariaBusy === 'false'"
        f" && document.getElementById('place').textContent.startsWith('{place}')"
    )


def begin(page: Page, address: str) -> None:
    """Open the page and go on to the first image."""
    open_page(page, address)
    press(page, "Enter")
    wait_for_image(page)


def rows(reading: ReadingSession, kind: str) -> list[AnswerRow]:
    path = reading.study / f"answers/reader-{reading.place}.sqlite"
    return [entry for entry in read_entries(path, reading.protocol.sha256) if entry.kind == kind]


def shot(page: Page) -> NDArray[np.uint8]:
    with Image.open(io.BytesIO(page.picture())) as picture:
        return np.asarray(picture.convert("RGB"))


def planned(reading: ReadingSession) -> NDArray[np.uint8]:
    """Pixels of the next image to read."""
    task = reading.task()
    assert task is not None
    with Image.open(reading.study / task.file) as picture:
        return np.asarray(picture.convert("RGB"))


# A whole session.

#: The image at which the server is killed.
KILLED_AT = 47

#: ΔE2000 at nuclei under each condition, from the paper, as in the calibration of the simulated reader.
DIFFERENCES = dict(zip((each.name for each in CONDITIONS), PAPER_DIFFERENCES.values(), strict=True))

#: Number of standard errors that chance exceeds in 1 of 1000 cases.
SURE = 3.29

#: A simulated reader who looks at an image for some tenths of a second. The paper's reader took 41 s.
HASTE = 300.0
SIMULATED = SimulatedReader(seed=2015, median=SimulatedReader().median / HASTE)


@dataclass
class Reader:
    """Reads with real keys like the simulated reader, and records its keys and times."""

    page: Page
    trials: list[StudyTrial]
    pressed: list[tuple[str, int]] = field(default_factory=list)
    bounds: list[tuple[float, float]] = field(default_factory=list)
    left_last: float = 0.0

    def read(self, number: int, of: int) -> None:
        """Look for a while, decide and rate. Enter is not yet pressed."""
        seconds, ease, category = answer_of(self.trials[number - 1])
        wait_for_image(self.page, f"{number} of {of}")
        seen = time.monotonic()
        time.sleep(seconds)
        before = time.monotonic()
        press(self.page, category[0])
        after = time.monotonic()
        press(self.page, str(ease % 10))
        self.pressed.append((category, ease))
        # The image was painted after the last Enter, and before the driver saw it.
        self.bounds.append((before - seen, after - self.left_last))

    def save(self) -> None:
        self.left_last = time.monotonic()
        press(self.page, "Enter")


def answer_of(trial: StudyTrial) -> tuple[float, int, str]:
    return SIMULATED.answer(trial, DIFFERENCES[trial.condition], SIMULATED.difficulty(trial.image))


@pytest.fixture(scope="module")
def whole(page: Page, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Reader]:
    """A study whose first session of 120 images was read in the browser. The server was killed during the session."""
    study, killed_at = tmp_path_factory.mktemp("whole") / "study", KILLED_AT
    protocol = make_study(study, images=120, practice=2, readers=1)
    reader = Reader(page, protocol.session(1, 1))
    page.size(*WINDOW)
    with running(study) as (process, address):
        begin(page, address)
        for number in (1, 2):
            reader.read(number, 2)
            reader.save()
        wait_for(page, "practised")
        reader.pressed.clear()
        reader.bounds.clear()
        reader.save()
        for number in range(1, killed_at):
            reader.read(number, 120)
            reader.save()
        reader.read(killed_at, 120)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        press(page, "Enter")
        wait_for(page, "trouble")
        assert "lutgen does not answer" in page.ask("document.getElementById('trouble-text').textContent")
    assert len(read_answers(study)) == killed_at - 1
    # The reader gives the answer that could not be saved again, and no earlier answer.
    reader.pressed.pop()
    reader.bounds.pop()
    with running(study) as (process, address):
        open_page(page, address)
        assert f"{killed_at - 1} of 120 are saved" in page.ask("document.getElementById('task').textContent")
        reader.save()
        for number in range(killed_at, 121):
            reader.read(number, 120)
            reader.save()
        wait_for(page, "done")
        assert "all 120 images are saved" in page.ask("document.getElementById('done-text').textContent")
        out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert "120 of 120 images are read and saved. Reading session 2 may begin on" in out
    return study, reader


@pytest.mark.slow
def test_what_is_stored_of_a_whole_session_is_what_was_pressed(whole: tuple[Path, Reader]) -> None:
    """Each time lies between the bounds that the driver measured."""
    study, reader = whole
    answers = read_answers(study)
    assert [answer.position for answer in answers] == list(range(1, 121))
    assert [(answer.category, answer.ease) for answer in answers] == reader.pressed
    seconds = np.array([answer.seconds for answer in answers])
    lowest, highest = np.array(reader.bounds).T
    assert (seconds >= lowest - TOLERANCE).all()
    assert (seconds <= highest + TOLERANCE).all()
    # The bounds are narrow enough for a meaningful test.
    assert np.median(highest - lowest) < 1.0
    log = read_entries(study / "answers/reader-1.sqlite", read_protocol(study).sha256)
    contents = [entry.content for entry in log if entry.kind == "answered"]
    # Most records are element timings. A decision within milliseconds may precede the browser's record of the paint.
    assert sum(each["paint"] == "element-timing" for each in contents) > 60
    assert [each["position"] for each in contents if each["showings"] != 1] == [KILLED_AT]
    # An answer is on disk before the next image is shown.
    for before, after in pairwise(entry for entry in log if entry.kind in {"shown", "answered", "practised"}):
        assert (before.kind == "shown") != (after.kind == "shown") or before.content["position"] == KILLED_AT


@pytest.mark.slow
def test_the_analysis_of_that_session_and_a_second_recovers_the_effect_that_the_reader_has(
    whole: tuple[Path, Reader],
) -> None:
    study, _ = whole
    with begin_reading(study, reader="Dr A", session=2, clock=Clock(datetime(2099, 1, 1, tzinfo=UTC))) as reading:
        trials = reading.protocol.session(1, 2)
        while (task := reading.task()) is not None:
            seconds, ease_given, category = answer_of(trials[task.number - 1])
            decision = Decision(category, ease_given, seconds, seconds, 0, 0.0, "animation-frame")
            reading.show(task)
            reading.answer(task.number, decision, practice=task.practice)
    analysis = analyse_answers(read_answers(study), conditions=list(DIFFERENCES)).as_json()
    every = reading.protocol.trials
    to_nuclei = {(trial.image, trial.condition): DIFFERENCES[trial.condition] for trial in every}
    expected = analyse_answers(simulate(every, to_nuclei, SIMULATED), conditions=list(DIFFERENCES))
    # All diagnoses and ratings of ease are those of the simulated reader. Table 3 follows from them.
    assert analysis["table3"] == expected.as_json()["table3"]
    # Ease and agreement as the docstring of the reader states; time by its ratio, since the test sets the pace.
    tests = {(row["measure"], row["second"]): row for row in analysis["table2"]["tests"] if row["first"] == "none"}
    for condition, ease in (("chroma@18000", -1.1), ("chroma-luma@18000", -1.3)):
        row = tests["ease", condition]
        assert abs(row["difference"] - ease) < SURE * abs(row["difference"] / row["t"])
    assert tests["ease", "chroma-luma@18000"]["p"] < 1e-4
    for row, share in zip(analysis["table3"], (0.692, 0.525, 0.5), strict=True):
        assert abs(row["percent"] / 100 - share) < SURE * (share * (1 - share) / 40) ** 0.5
    log_times = {name: np.log([each.seconds for each in answers_under(study, name)]) for name in DIFFERENCES}
    for condition, difference in DIFFERENCES.items():
        slower, planted = log_times[condition].mean() - log_times["none"].mean(), SIMULATED.slowdown
        error = np.hypot(log_times[condition].std(), log_times["none"].std()) / 40**0.5
        assert abs(slower - planted * SIMULATED.disturbance(difference)) <= SURE * error


def answers_under(study: Path, condition: str) -> list[Answer]:
    return [each for each in read_answers(study) if (each.session, each.condition) == (1, condition)]


# Pixels.


@pytest.mark.parametrize("ratio", [1, 1.25, 1.5, 2, 3])
def test_an_image_is_shown_pixel_for_pixel_on_neutral_grey(page: Page, tmp_path: Path, ratio: float) -> None:
    page.size(*WINDOW, ratio)
    with served(tmp_path, size=(201, 99)) as (address, reading):
        begin(page, address)
        window, image = shot(page), planned(reading)
    assert window.shape == (WINDOW[1] * ratio, WINDOW[0] * ratio, 3)
    height, width = image.shape[:2]
    rest = window[: int(700 * ratio)].copy()
    (top, left), *more = [
        (y, x)
        for y, x in zip(*np.nonzero((rest == image[0, 0]).all(-1)), strict=True)
        if np.array_equal(rest[y : y + height, x : x + width], image)
    ]
    assert more == []
    assert abs(left + width / 2 - WINDOW[0] * ratio / 2) <= 1
    rest[top : top + height, left : left + width] = GREY
    assert (rest == GREY).all()


def test_everything_around_an_image_is_neutral(page: Page, tmp_path: Path) -> None:
    """Screens, buttons and their states: red, green and blue are equal, except in the smoothing of letters."""
    with served(tmp_path, picture=np.full((40, 40, 3), 128, np.uint8)) as (address, _):
        open_page(page, address)
        pictures = [shot(page)]
        press(page, "Enter")
        wait_for_image(page)
        press(page, "2", "7")
        pictures.append(shot(page))
    for picture in pictures:
        spread = picture.max(-1).astype(int) - picture.min(-1)
        assert (spread > 0).mean() < 0.01


def test_an_image_larger_than_the_window_is_dragged_and_moved_by_keys_as_far_as_its_edge(
    page: Page, tmp_path: Path
) -> None:
    def left() -> float:
        return float(page.ask("document.querySelector('#stage img').getBoundingClientRect().x"))

    with served(tmp_path, size=(2000, 600)) as (address, _):
        begin(page, address)
        assert left() == (1280 - 2000) / 2
        page.drag((600, 300), (650, 310), (700, 320))
        assert left() == -260
        page.press("ArrowRight", 39)
        assert left() == -388
        for _ in range(9):
            page.press("ArrowRight", 39)
        assert left() == 1280 - 2000
        assert page.ask("document.querySelector('#stage img').getBoundingClientRect().y") >= 0


# Keys and time.


def test_the_clock_stops_at_the_choice_that_is_confirmed_and_the_first_is_kept(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=0) as (address, reading):
        begin(page, address)
        time.sleep(0.1)
        press(page, "2", "7", "Backspace", "Backspace")
        time.sleep(0.3)
        press(page, "0")
        time.sleep(0.3)
        press(page, "4", "5", "Enter")
        wait_for_image(page, "2 of 4")
        (row,) = rows(reading, "answered")
    content = row.content
    assert (content["category"], content["ease"]) == ("0", 5)
    assert content["seconds"] - content["first_choice_seconds"] >= 0.3
    assert content["first_choice_seconds"] >= 0.1
    assert content["seconds"] < 0.1 + 0.3 + 0.3  # the last wait is after the decision


def test_paused_time_does_not_count_and_the_image_is_hidden(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=0, picture=np.full((300, 300, 3), 7, np.uint8)) as (address, reading):
        begin(page, address)
        started = time.monotonic()
        paused = 0.0
        for key in ("p", " "):
            press(page, key)
            assert screen(page) == "paused"
            assert not (shot(page)[:700] == 7).all(-1).any()
            before = time.monotonic()
            time.sleep(0.4)
            paused += time.monotonic() - before
            press(page, "1")  # no decision counts while the image is hidden
            press(page, "Enter" if key == "p" else " ")
            wait_for_image(page)
        # A hidden tab pauses by itself.
        hide = "Object.defineProperty(document, 'hidden', {configurable: true, get: () => %s});"
        page.ask(f"{hide % 'true'} document.dispatchEvent(new Event('visibilitychange'))")
        assert screen(page) == "paused"
        page.ask(f"{hide % 'false'} document.dispatchEvent(new Event('visibilitychange'))")
        press(page, "Enter")
        wait_for_image(page)
        press(page, "3")
        whole = time.monotonic() - started
        press(page, "0", "Enter")
        wait_for_image(page, "2 of 4")
        (row,) = rows(reading, "answered")
        assert [entry.content["said"]["why"] for entry in rows(reading, "paused")] == ["asked", "asked", "hidden"]
        assert len(rows(reading, "continued")) == 3
    content = row.content
    assert (content["pauses"], content["category"], content["ease"]) == (3, "3+", 10)
    assert content["paused_seconds"] >= paused
    assert content["seconds"] + content["paused_seconds"] <= whole + 0.3  # driver and page start at different moments
    assert content["seconds"] <= whole - paused + 0.3


def test_keys_that_are_held_down_or_come_too_early_do_nothing(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=1) as (address, reading):
        begin(page, address)
        press(page, "Enter", "x", "Backspace", "Enter")
        assert (screen(page), reading.practised) == ("reading", 0)
        press(page, "1", "Enter")
        assert reading.practised == 0  # no rating of ease yet
        press(page, "9")
        for repeated in (False, True, True, True):
            page.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r",
                      windowsVirtualKeyCode=13, autoRepeat=repeated)  # fmt: skip
        wait_for(page, "practised")
        time.sleep(0.1)
        assert screen(page) == "practised"


def test_the_mouse_does_what_keys_do(page: Page, tmp_path: Path) -> None:
    def click(selector: str) -> None:
        at = page.ask(f"document.querySelector({selector!r}).getBoundingClientRect().toJSON()")
        page.drag((at["x"] + at["width"] / 2, at["y"] + at["height"] / 2))

    with served(tmp_path, practice=0) as (address, reading):
        open_page(page, address)
        click("#begin")
        wait_for_image(page)
        click("#diagnosis [data-value='2+']")
        click("#ease [data-value='10']")
        click("#back")
        assert page.ask("document.getElementById('confirm').disabled")
        click("#ease [data-value='3']")
        click("#pause")
        assert screen(page) == "paused"
        click("#continue")
        wait_for_image(page)
        click("#confirm")
        wait_for_image(page, "2 of 4")
        press(page, "1", "2", "Enter")  # keys reach the page again
        wait_for_image(page, "3 of 4")
    assert [(answer.category, answer.ease) for answer in read_answers(reading.study)] == [("2+", 3), ("1+", 2)]


def test_categories_and_keys_come_from_the_protocol(page: Page, tmp_path: Path) -> None:
    categories = (Category("benign", "b", positive=False), Category("in situ", "p", positive=True))
    with served(tmp_path, practice=0, categories=categories) as (address, reading):
        open_page(page, address)
        assert "P" not in page.ask("document.getElementById('pause-keys').textContent").replace("Space", "")
        press(page, "Enter")
        wait_for_image(page)
        press(page, "p", "8", "Enter")
        wait_for_image(page, "2 of 4")
    (answer,) = read_answers(reading.study)
    assert (answer.category, answer.ease, answer.positive) == ("in situ", 8, True)


# No going back, one tab, faults.


def test_reloading_and_going_back_show_the_same_image_again(page: Page, tmp_path: Path) -> None:
    page.call("Page.navigate", url="about:blank")
    with served(tmp_path, practice=0) as (address, reading):
        begin(page, address)
        press(page, "1", "2", "Enter")
        wait_for_image(page, "2 of 4")
        page.call("Page.reload")
        wait_for(page, "welcome")
        press(page, "Enter")
        wait_for_image(page, "2 of 4")
        page.ask("setTimeout(() => history.back()) > 0")
        page.wait("location.protocol !== 'http:'")
        page.ask("setTimeout(() => history.forward()) > 0")
        wait_for(page, "welcome")
        press(page, "Enter")
        wait_for_image(page, "2 of 4")
        press(page, "3", "4", "Enter")
        wait_for_image(page, "3 of 4")
        assert [row.content["showings"] for row in rows(reading, "answered")] == [1, 3]


def test_a_second_tab_is_refused_until_the_first_is_closed(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=0) as (address, reading):
        begin(page, address)
        press(page, "1", "2", "Enter")
        wait_for_image(page, "2 of 4")
        with browser(tmp_path / "profile") as second:  # a separate browser, so that no tab hides another
            second.call("Page.navigate", url=address)
            wait_for(second, "elsewhere")
            assert second.ask("document.getElementById('take').disabled")
            assert not second.ask("document.querySelector('#stage img')")
            press(page, "2", "3", "Enter")
            wait_for_image(page, "3 of 4")
            page.call("Page.navigate", url="about:blank")
            second.wait("!document.getElementById('take').disabled")
            press(second, "Enter")
            wait_for(second, "welcome")
            press(second, "Enter")
            wait_for_image(second, "3 of 4")
    assert [answer.position for answer in read_answers(reading.study)] == [1, 2]


def test_an_answer_that_finds_no_room_is_kept_in_the_page_and_saved_once(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=0) as (address, reading):
        begin(page, address)
        connection = reading._file._connection
        (pages,) = connection.execute("PRAGMA page_count").fetchone()
        connection.execute(f"PRAGMA max_page_count = {pages}")
        with suppress(NotSavedError):
            for _ in range(1000):  # fills the last page
                reading.note("warned", {})
        press(page, "2", "7", "Enter")
        wait_for(page, "trouble")
        assert page.ask("document.getElementById('trouble-title').textContent") == "Not saved yet"
        press(page, "Enter")
        wait_for(page, "trouble")
        assert reading.read == 0
        connection.execute("PRAGMA max_page_count = 1000000")
        press(page, "Enter")
        wait_for_image(page, "2 of 4")
    (answer,) = read_answers(reading.study)
    assert (answer.category, answer.ease) == ("2+", 7)


def test_a_changed_image_is_not_shown_and_comes_when_it_is_restored(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=0) as (address, reading):
        path = reading.study / reading.images[1].file
        data = path.read_bytes()
        begin(page, address)
        path.write_bytes(data[:-1])
        press(page, "2", "7", "Enter")
        wait_for(page, "trouble")
        assert reading.read == 1
        path.write_bytes(data)
        press(page, "Enter")
        wait_for_image(page, "2 of 4")
        assert reading.read == 1


# Warnings.

#: A browser that alters the pixels read from a canvas, as some browsers do against tracking.
NOISE = """{
    const read = CanvasRenderingContext2D.prototype.getImageData;
    CanvasRenderingContext2D.prototype.getImageData = function (...where) {
        const data = read.apply(this, where);
        data.data[7] ^= 1;
        return data;
    };
}"""

#: A screen in HDR, which Chromium cannot emulate.
HDR = """{
    const media = window.matchMedia;
    const high = { matches: true, addEventListener() {} };
    window.matchMedia = (query) => (query === "(dynamic-range: high)" ? high : media.call(window, query));
}"""


@pytest.mark.parametrize(
    ("size", "ratio", "features", "patch", "sentence"),
    [
        (WINDOW, 1, {}, "", ""),
        (WINDOW, 1.25, {}, "", "zooms, or the system scales, by 1.25"),
        (WINDOW, 2, {}, "", "2 × 2 screen pixels make one"),
        ((500, 120), 1, {}, "", "64 × 48 pixels do not fit"),
        (WINDOW, 1, {"color-gamut": "p3"}, "", "more colours than sRGB"),
        (WINDOW, 1, {}, HDR, "high dynamic range"),
        (WINDOW, 1, {"forced-colors": "active"}, "", "forces colours"),
        (WINDOW, 1, {}, NOISE, "changes the pixels of images"),
    ],
)
def test_what_would_change_pixels_is_warned_of(
    page: Page,
    tmp_path: Path,
    *,
    size: tuple[int, int],
    ratio: float,
    features: dict[str, str],
    patch: str,
    sentence: str,
) -> None:
    page.size(*size, ratio)
    page.call("Emulation.setEmulatedMedia", features=[{"name": name, "value": on} for name, on in features.items()])
    script = page.call("Page.addScriptToEvaluateOnNewDocument", source=patch)["identifier"]
    with served(tmp_path, practice=0) as (address, reading):
        open_page(page, address)
        warned = page.ask("[...document.querySelectorAll('#welcome .warnings li')].map(each => each.textContent)")
        press(page, "Enter")
        page.wait("document.body.dataset.screen === 'reading'")
        accepted = [name for row in rows(reading, "accepted") for name in row.content["said"]["warnings"]]
    page.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    assert len(warned) == len(accepted) == bool(sentence)
    assert sentence in "".join(warned)


def test_a_window_that_changes_in_the_session_pauses_it_and_going_on_is_recorded(page: Page, tmp_path: Path) -> None:
    with served(tmp_path, practice=0) as (address, reading):
        begin(page, address)
        page.size(853, 600, 1.5)  # the same window, zoomed
        wait_for(page, "warned")
        assert "by 1.50" in page.ask("document.querySelector('#warned .warnings').textContent")
        press(page, "Enter")
        wait_for_image(page)
        page.size(800, 600, 1.5)
        time.sleep(0.1)
        assert screen(page) == "reading"  # the reader has accepted the zoom
        kinds = [rows(reading, kind) for kind in ("warned", "accepted")]
        assert [row.content["said"]["warnings"] for (row,) in kinds] == [["zoom"], ["zoom"]]
        assert kinds[0][0].content["said"]["ratio"] == 1.5


def test_a_session_asks_nothing_of_the_network_and_complains_of_nothing(page: Page, tmp_path: Path) -> None:
    page.requests.clear()
    with served(tmp_path, images=2, practice=0) as (address, _):
        begin(page, address)
        press(page, "1", "2", "Enter")
        wait_for_image(page, "2 of 2")
        press(page, "1", "2", "Enter")
        wait_for(page, "done")
    assert {url.startswith(address) for url in page.requests} == {True}
    assert page.complaints == []
