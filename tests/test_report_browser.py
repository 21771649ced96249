"""The page of `lutgen report` in a real browser: slider and wiper are moved, numbers and pixels are read."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.data import immunohistochemistry
from skimage.io import imread, imsave

from tests.browser import CHROMIUM, Page, browser

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = [
    pytest.mark.numbers,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: chromium)"),
]

#: Measured times, so that lifetime's own JSON has them.
HOURS = ("0", "6000", "18000")

RIGHT, LEFT, HOME = ("ArrowRight", 39), ("ArrowLeft", 37), ("Home", 36)

#: Pixels of the picture.
SIZE = 64


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page, and what lifetime and apply say of the same picture."""
    folder = tmp_path_factory.mktemp("page")
    imsave(folder / "a.png", np.asarray(immunohistochemistry())[200 : 200 + SIZE, 200 : 200 + SIZE])
    hours = ",".join(HOURS)
    for arguments in (
        ["report", "a.png", "--hours", hours, "-o", "r.html"],
        ["lifetime", "a.png", "--json", "l.json"],
        ["apply", "a.png", "--mode", "chroma-luma", "--hours", "6000", "-o", "aged.png"],
    ):
        subprocess.run([sys.executable, "-m", "lutgen", *arguments], cwd=folder, check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def page(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with browser(tmp_path_factory.mktemp("profile")) as page:
        page.size(1300, 1000)
        page.open(folder / "r.html")
        yield page


@pytest.fixture
def fresh(page: Page, folder: Path) -> Page:
    """The page as it is when it is opened."""
    page.open(folder / "r.html")
    page.ask("scrollTo(0, 0)")
    return page


def curve(folder: Path, mode: str, hours: str) -> dict[str, float]:
    points: list[dict[str, float]] = json.loads((folder / "l.json").read_text())["images"][0]["modes"][mode]["curve"]
    (point,) = (point for point in points if point["hours"] == float(hours))
    return point


def shown(page: Page) -> dict[str, str]:
    content: dict[str, str] = page.ask(
        "Object.fromEntries([...document.querySelectorAll('dd[id^=number-]')]"
        ".map(each => [each.id.replace('number-', ''), each.textContent]))"
    )
    return content


def check_numbers(page: Page, folder: Path, mode: str, hours: str) -> None:
    numbers, point = shown(page), curve(folder, mode, hours)
    assert page.ask("document.getElementById('hours-now').textContent").replace("\xa0", "") == f"{hours} h"
    for key in ("mean", "sd", "p95", "max"):
        assert numbers[key] == f"{point[key]:.2f}"


def place(page: Page, selector: str) -> dict[str, float]:
    found: dict[str, float] = page.ask(f"document.querySelector({selector!r}).getBoundingClientRect().toJSON()")
    return found


def pixels_of(page: Page, identifier: str) -> Any:
    """The picture that is shown now, as the browser decodes it: (h, w, 3)."""
    values = page.ask(
        f"""(async () => {{
            const image = document.getElementById({identifier!r});
            await image.decode();
            const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
            const context = canvas.getContext("2d");
            context.drawImage(image, 0, 0);
            return [...context.getImageData(0, 0, canvas.width, canvas.height).data];
        }})()"""
    )
    return np.array(values, np.uint8).reshape(SIZE, SIZE, 4)[..., :3]


def test_the_slider_switches_numbers_picture_map_and_marker(fresh: Page, folder: Path) -> None:
    check_numbers(fresh, folder, "chroma", "18000")
    fresh.ask("document.querySelector('input[value=chroma-luma]').click()")
    check_numbers(fresh, folder, "chroma-luma", "18000")
    old, marker = pixels_of(fresh, "map"), place(fresh, "#marker")["x"]
    fresh.ask("document.getElementById('hours').focus()")
    fresh.press(*LEFT)
    check_numbers(fresh, folder, "chroma-luma", "6000")
    assert fresh.ask("document.getElementById('hours').getAttribute('aria-valuetext')").endswith("000 h")
    assert (pixels_of(fresh, "aged") == imread(folder / "aged.png")).all()
    assert (pixels_of(fresh, "map") != old).any()
    chart = place(fresh, ".chart")["width"] / 900
    assert marker - place(fresh, "#marker")["x"] == pytest.approx(chart * (900 - 62 - 160) * 2 / 3, abs=0.5)
    fresh.press(*HOME)
    check_numbers(fresh, folder, "chroma-luma", "0")
    assert (pixels_of(fresh, "aged") == imread(folder / "a.png")).all()


def test_the_slider_is_dragged(fresh: Page, folder: Path) -> None:
    at = place(fresh, "#hours")
    middle = at["y"] + at["height"] / 2
    fresh.drag((at["right"] - 8, middle), (at["x"] + at["width"] * 0.7, middle), (at["x"] + at["width"] / 2, middle))
    check_numbers(fresh, folder, "chroma", "6000")


def test_the_wiper_is_dragged_and_moved_by_keys(fresh: Page) -> None:
    at = place(fresh, "#wipe")
    middle = at["y"] + at["height"] / 2

    def cut() -> float:
        return (place(fresh, "#bar")["x"] + 1 - at["x"]) / at["width"]

    assert cut() == pytest.approx(0.5, abs=0.01)
    fresh.drag(
        *((at["x"] + share * at["width"], middle) for share in (0.5, 0.4, 0.25)),
    )
    assert cut() == pytest.approx(0.25, abs=0.01)
    assert fresh.ask("document.getElementById('wiper').value") == "25"
    # Beyond the picture it stops at its edge.
    fresh.drag((at["x"] + 0.25 * at["width"], middle), (at["x"] - 15, middle))
    assert cut() == pytest.approx(0.0, abs=0.01)
    fresh.press(*RIGHT)
    assert cut() == pytest.approx(0.01, abs=0.005)


def test_left_of_the_wiper_is_the_unaged_picture_and_right_of_it_the_aged_one(fresh: Page) -> None:
    from io import BytesIO

    from PIL import Image

    unaged, aged = pixels_of(fresh, "before"), pixels_of(fresh, "aged")
    at = place(fresh, "#wipe")
    with Image.open(BytesIO(fresh.picture())) as screen:
        window = np.asarray(screen.convert("RGB")).astype(float)
    scale = at["width"] / SIZE
    # Away from the bar and the labels, in means: the browser smooths what it enlarges.
    for share, picture in ((0.2, unaged), (0.8, aged)):
        first = int((share - 0.1) * SIZE), int((share + 0.1) * SIZE)
        rows = slice(int(at["y"] + 8 * scale), int(at["y"] + 24 * scale))
        columns = slice(int(at["x"] + first[0] * scale), int(at["x"] + first[1] * scale))
        mean = picture[8:24, first[0] : first[1]].mean(axis=(0, 1))
        assert window[rows, columns].mean(axis=(0, 1)) == pytest.approx(mean, abs=3)


def test_the_page_asks_the_network_for_nothing_and_has_no_complaint(fresh: Page) -> None:
    assert {address.partition(":")[0] for address in fresh.requests} <= {"file", "data"}
    assert fresh.complaints == []


def test_what_is_printed_has_every_frame_and_no_controls(fresh: Page) -> None:
    fresh.call("Emulation.setEmulatedMedia", media="print")
    try:
        seen = "[...document.querySelectorAll('#frames figure')].filter(each => each.offsetHeight).length"
        assert fresh.ask(seen) == 1 + 2 * (len(HOURS) - 1)
        assert fresh.ask("document.getElementById('viewer').offsetHeight") == 0
    finally:
        fresh.call("Emulation.setEmulatedMedia", media="")
    assert fresh.printed().startswith(b"%PDF")


def test_without_scripts_the_pictures_are_there(fresh: Page, folder: Path) -> None:
    fresh.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        fresh.call("Page.reload")
        fresh.open(folder / "r.html")
        assert place(fresh, "#frames")["height"] > 500
        assert place(fresh, "#viewer")["height"] == 0
    finally:
        fresh.call("Emulation.setScriptExecutionDisabled", value=False)
