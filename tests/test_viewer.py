"""The picture viewer of `lutgen explore` and `lutgen report` in a browser: its pixels against `lutgen apply --lut`."""

from __future__ import annotations

import json
import subprocess
import sys
from base64 import b64encode
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from skimage.io import imread, imsave

from lutgen import DisplayModel, read_measurements
from lutgen.bake.fidelity import Counts, certificate_colours
from lutgen.bake.lut import Sampler
from lutgen.display import default_display
from lutgen.pictures.viewer import FOLDER
from tests.browser import CHROMIUM

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from tests import browser as chromium_browser
    from tests import firefox as firefox_browser

    Page = chromium_browser.Page | firefox_browser.Page

pytestmark = [
    pytest.mark.numbers,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: chromium)"),
]

VIEWER = FOLDER / "viewer.js"

#: Number of pixels in a row.
ROW = 344

#: Number of points along an edge of the tables.
SIZE = 33

PAGE = """<!doctype html><meta charset="utf-8"><style>{style}</style><div id="host"></div>
<script type="module">{viewer}
const values = (text, kind) => new kind(Uint8Array.from(atob(text), (each) => each.charCodeAt(0)).buffer);
window.viewer = new Viewer(document.getElementById("host"), ["un-aged", "aged"]);
window.values = values;
window.pixels = () => {{
  viewer.draw();
  const {{ gl, canvas }} = viewer;
  const read = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, read);
  let text = "";
  for (let from = 0; from < read.length; from += 4096) text += String.fromCharCode(...read.subarray(from, from + 4096));
  return btoa(text);
}};
</script>"""


@pytest.fixture(scope="module")
def colours() -> NDArray[np.uint8]:
    """An 8-bit picture with four times as many colours as a certificate."""
    code = np.rint(certificate_colours(Counts(50_000, 4_096, 32_000, 16_384)) * 255).astype(np.uint8)
    assert len(code) == 118_864
    rest = -len(code) % ROW
    return np.vstack([code, code[:rest]]).reshape(-1, ROW, 3)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory, colours: NDArray[np.uint8]) -> Path:
    """A page with the viewer, with one pixel for each colour."""
    height, width = colours.shape[:2]
    style = f"body {{ margin: 0; }} #host {{ width: {width}px; height: {height}px; }} canvas {{ position: absolute; }}"
    file = tmp_path_factory.mktemp("viewer") / "v.html"
    file.write_text(PAGE.format(viewer=VIEWER.read_text(), style=style))
    return file


@pytest.fixture(scope="module", params=["chromium", "fox"])
def page(request: pytest.FixtureRequest, file: Path) -> Page:
    page: Page
    page, _ = request.getfixturevalue(request.param)
    page.size(600, 500)
    page.open_address(file.as_uri())
    return page


def table(hours: float) -> NDArray[np.float64]:
    aged = DisplayModel(read_measurements(default_display())).at("chroma-luma", hours)
    return np.asarray(Sampler().lut(aged, SIZE, "code", clip=True).table)


def sixteen_bits(values: NDArray[np.float64], difference: float = 0.0) -> NDArray[np.uint16]:
    """The table in the page's format. Each colour has the same ΔE2000."""
    alpha = np.full((*values.shape[:3], 1), difference / 100)
    return np.asarray(np.rint(np.concatenate([values * (65280 / 65535), alpha], axis=-1) * 65535), "<u2")


def handed_over(name: str, array: NDArray[Any]) -> str:
    kind = "Uint16Array" if array.dtype == np.uint16 else "Uint8ClampedArray"
    return f"const {name} = values({json.dumps(b64encode(array.tobytes()).decode())}, {kind});"


def drawn(page: Page, picture: NDArray[np.uint8], script: str, *tables: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """The canvas's pixels after a script that may use table0, table1, … and `viewer`: (h, w, 3)."""
    from base64 import b64decode

    opaque = np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)])
    scripts = "".join(handed_over(f"table{number}", each) for number, each in enumerate(tables))
    text = page.ask(
        f"""(() => {{ {handed_over("picture", opaque)} {scripts}
            viewer.show(new ImageData(picture, {picture.shape[1]}));
            viewer.cuts = [0, 1];
            {script}
            return pixels(); }})()"""
    )
    read = np.frombuffer(b64decode(text), np.uint8).reshape(*picture.shape[:2], 4)
    return read[::-1, :, :3]


def test_the_shader_gives_what_apply_makes_of_the_same_table(
    page: Page, colours: NDArray[np.uint8], tmp_path: Path
) -> None:
    values = table(18_000)
    rows = "\n".join(" ".join(f"{each:.9f}" for each in row) for row in values.reshape(-1, 3))
    (tmp_path / "a.cube").write_text(f"LUT_3D_SIZE {SIZE}\n{rows}\n")
    imsave(tmp_path / "a.tif", colours.astype(np.uint16) * 257, check_contrast=False)
    command = [sys.executable, "-m", "lutgen", "apply", "a.tif", "--lut", "a.cube", "-o", "b.tif"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    wanted = imread(tmp_path / "b.tif") / 257
    size = f"{{ size: {SIZE}, values: table0 }}"
    shown = drawn(page, colours, f"viewer.age({size});", sixteen_bits(values))
    assert np.abs(shown - wanted).max() <= 0.51
    unaged = drawn(page, colours, f"viewer.age({size}); viewer.cuts = [1, 1];", sixteen_bits(values))
    assert (unaged == colours).all()


def test_two_tables_are_blended_and_the_map_has_the_colours_of_viridis(page: Page, colours: NDArray[np.uint8]) -> None:
    from matplotlib import colormaps

    first, second = (sixteen_bits(table(hours), 10) for hours in (0, 18_000))
    both = f"{{ size: {SIZE}, values: table0 }}, {{ size: {SIZE}, values: table1 }}"
    ends = [drawn(page, colours, f"viewer.age({both}, {share});", first, second) for share in (0, 1)]
    shown = drawn(page, colours, f"viewer.age({both}, 0.25);", first, second)
    # Each of the three pictures is rounded once.
    assert np.abs(shown - (0.75 * ends[0] + 0.25 * ends[1])).max() <= 1.01
    colour = drawn(page, colours, f"viewer.age({both}, 0.25); viewer.map(40);", first, second)[50, 50]
    # A table without differences gives no map: the viewer shows the picture until a table with differences arrives.
    unknown = f"{{ size: {SIZE}, values: table0, differences: false }}"
    assert (drawn(page, colours, f"viewer.age({unknown}); viewer.map(40);", first) == ends[0]).all()
    page.ask("viewer.map(0)")
    assert np.abs(colour - 255 * np.array(colormaps["viridis"](0.25))[:3]).max() <= 2


def test_keys_move_bars_and_zoom(page: Page, colours: NDArray[np.uint8]) -> None:
    drawn(page, colours, "")
    page.ask("(() => { viewer.cuts = [0.5, 1]; viewer.bars[0].focus(); })()")
    page.press("ArrowRight", 39)
    assert page.ask("viewer.cuts[0]") == pytest.approx(0.51)
    page.press("Home", 36)
    assert page.ask("viewer.bars[0].getAttribute('aria-valuenow')") == "0"
    page.ask("viewer.canvas.focus()")
    page.press("+", 187)
    page.press("+", 187)
    assert page.ask("viewer.scale") == pytest.approx(1.25**2)
    # A larger scale draws the same pixels, larger.
    page.press("1", 49)
    assert page.ask("viewer.scale") == 1
