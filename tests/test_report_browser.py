"""The page of `lutgen report` in a real browser: tests move slider and wiper, and read numbers and pixels."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.data import immunohistochemistry
from skimage.io import imread, imsave

from tests.browser import CHROMIUM, Page

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [
    pytest.mark.numbers,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: chromium)"),
]

#: Measured times, so that lifetime's own JSON contains them.
HOURS = ("0", "6000", "18000")

RIGHT, LEFT, HOME, DOWN = ("ArrowRight", 39), ("ArrowLeft", 37), ("Home", 36), ("PageDown", 34)

#: Side of the picture in pixels.
SIZE = 64


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page, and the results of lifetime and apply for the same picture."""
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
def page(folder: Path, chromium: tuple[Page, Path]) -> Page:
    page, _ = chromium
    page.size(1300, 1000)
    page.theme()
    page.requests.clear()
    page.complaints.clear()
    page.open(folder / "r.html")
    return page


@pytest.fixture
def fresh(page: Page, folder: Path) -> Page:
    """The page just after opening."""
    page.open(folder / "r.html")
    page.wait("Boolean(window.viewer?.picture)")
    page.ask("scrollTo(0, 0)")
    return page


def curve(folder: Path, mode: str, hours: float) -> dict[str, float]:
    """Lifetime's values at an hour, linear between the computed hours."""
    points: list[dict[str, float]] = json.loads((folder / "l.json").read_text())["images"][0]["modes"][mode]["curve"]
    known = [point for point in points if f"{point['hours']:g}" in HOURS]
    at = [point["hours"] for point in known]
    return {key: float(np.interp(hours, at, [point[key] for point in known])) for key in ("mean", "sd", "p95", "max")}


def shown(page: Page) -> dict[str, str]:
    content: dict[str, str] = page.ask(
        "Object.fromEntries([...document.querySelectorAll('dd[id^=number-]')]"
        ".map(each => [each.id.replace('number-', ''), each.textContent]))"
    )
    return content


def check_numbers(page: Page, folder: Path, mode: str, hours: float) -> None:
    numbers, point = shown(page), curve(folder, mode, hours)
    assert page.ask("document.getElementById('hours-now').textContent").replace("\xa0", "") == f"{hours:g}h"
    near = "" if f"{hours:g}" in HOURS else "≈\N{NARROW NO-BREAK SPACE}"
    for key in ("mean", "sd", "p95", "max"):
        assert numbers[key] == f"{near}{point[key]:.2f}"


def place(page: Page, selector: str) -> dict[str, float]:
    rectangle: dict[str, float] = page.ask(f"document.querySelector({selector!r}).getBoundingClientRect().toJSON()")
    return rectangle


def drawn(page: Page) -> Any:
    """The currently drawn picture, pixel for pixel from its upper left corner: (h, w, 3)."""
    values = page.ask(
        """(() => {
            viewer.zoomTo(1);
            viewer.draw();
            const { gl, canvas, origin } = viewer;
            const read = new Uint8Array(4 * 64 * 64);
            gl.readPixels(origin[0], canvas.height - origin[1] - 64, 64, 64, gl.RGBA, gl.UNSIGNED_BYTE, read);
            return [...read];
        })()"""
    )
    return np.array(values, np.uint8).reshape(SIZE, SIZE, 4)[::-1, :, :3].astype(int)


def test_the_slider_moves_numbers_picture_and_marker_continuously(fresh: Page, folder: Path) -> None:
    check_numbers(fresh, folder, "chroma", 18_000)
    fresh.ask("document.querySelector('input[value=chroma-luma]').click()")
    check_numbers(fresh, folder, "chroma-luma", 18_000)
    marker = place(fresh, "#marker")["x"]
    fresh.ask("document.getElementById('hours').focus()")
    fresh.press(*LEFT)
    check_numbers(fresh, folder, "chroma-luma", 17_900)
    for _ in range(12):
        fresh.press(*DOWN)
    check_numbers(fresh, folder, "chroma-luma", 5900)
    fresh.press(*RIGHT)
    check_numbers(fresh, folder, "chroma-luma", 6000)
    assert fresh.ask("document.getElementById('hours').getAttribute('aria-valuetext')") == "6\xa0000\xa0h"
    chart = place(fresh, ".chart")["width"] / 900
    assert marker - place(fresh, "#marker")["x"] == pytest.approx(chart * (900 - 62 - 160) * 2 / 3, abs=0.5)
    fresh.ask("viewer.wipe(0, 0)")
    # A table of 17 points an edge and 16 bits is near, but not equal. It is not near at the model's jump.
    away = np.abs(drawn(fresh) - imread(folder / "aged.png"))
    assert away.mean() < 0.1
    assert np.quantile(away, 0.99) <= 1
    fresh.press(*HOME)
    check_numbers(fresh, folder, "chroma-luma", 0)
    assert np.abs(drawn(fresh) - imread(folder / "a.png")).max() <= 1


def test_the_slider_is_dragged(fresh: Page) -> None:
    at = place(fresh, "#hours")
    middle = at["y"] + at["height"] / 2
    fresh.drag((at["right"] - 8, middle), (at["x"] + at["width"] * 0.7, middle), (at["x"] + at["width"] / 2, middle))
    assert fresh.ask("document.getElementById('hours').valueAsNumber") == pytest.approx(9000, abs=100)


def test_the_wiper_is_dragged_and_moved_by_keys(fresh: Page) -> None:
    at = place(fresh, "#picture")
    middle = at["y"] + at["height"] / 2

    def cut() -> float:
        fresh.ask("new Promise(requestAnimationFrame)")
        bar = place(fresh, ".viewer-bar")
        return (bar["x"] + bar["width"] / 2 - at["x"]) / at["width"]

    assert cut() == pytest.approx(0.5, abs=0.01)
    fresh.drag(*((at["x"] + share * at["width"], middle) for share in (0.5, 0.4, 0.25)))
    assert cut() == pytest.approx(0.25, abs=0.01)
    assert fresh.ask("document.querySelector('.viewer-bar').ariaValueNow") == "25"
    # Beyond the picture the wiper stops at the picture's edge.
    fresh.drag((at["x"] + 0.25 * at["width"], middle), (at["x"] - 15, middle))
    assert cut() == pytest.approx(0.0, abs=0.01)
    fresh.press(*RIGHT)
    assert cut() == pytest.approx(0.01, abs=0.005)


def test_left_of_the_wiper_is_the_unaged_picture_and_right_of_it_the_aged_one(fresh: Page, folder: Path) -> None:
    fresh.ask("document.querySelector('input[value=chroma-luma]').click()")
    fresh.ask(
        "(() => { const hours = document.getElementById('hours'); hours.value = 6000;"
        " hours.dispatchEvent(new Event('input')); })()"
    )
    fresh.ask("viewer.wipe(0, 0.5)")
    both, half = drawn(fresh), SIZE // 2
    assert (both[:, : half - 1] == imread(folder / "a.png")[:, : half - 1]).all()
    assert np.abs(both[:, half + 1 :] - imread(folder / "aged.png")[:, half + 1 :]).mean() < 0.1


def test_the_map_has_its_scale_beside_it(fresh: Page) -> None:
    assert fresh.ask("document.getElementById('bar').hidden")
    fresh.ask("viewer.wipe(0, 0), document.getElementById('map').click()")
    assert not fresh.ask("document.getElementById('bar').hidden")
    colours = drawn(fresh).reshape(-1, 3)
    assert len(np.unique(colours, axis=0)) > 20
    # No colour of viridis is red.
    assert ((colours[:, 0] <= colours[:, 1]) | (colours[:, 0] < 100)).all()


def test_the_page_asks_the_network_for_nothing_and_has_no_complaint(fresh: Page) -> None:
    assert {address.partition(":")[0] for address in fresh.requests} <= {"file", "data", "blob"}
    assert [each for each in fresh.complaints if "ReadPixels" not in each] == []


def test_what_is_printed_has_the_last_hours_and_no_controls(fresh: Page) -> None:
    fresh.call("Emulation.setEmulatedMedia", media="print")
    try:
        script = "[...document.querySelectorAll('#frames figure img')].filter(each => each.offsetHeight).length"
        assert fresh.ask(script) == 1 + 2 * 2
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
