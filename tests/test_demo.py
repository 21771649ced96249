"""`make demo`: the script from nothing to a picture, and again over an older and damaged build."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from skimage.data import immunohistochemistry

from lutgen import DisplayModel, read_measurements
from lutgen.display import default_display
from lutgen.report.sheets import PLACES, Layout

ROOT = Path(__file__).parents[1]
SOURCE = immunohistochemistry()
AGES = {
    "top": ("chroma", 10000),
    "right": ("chroma", 18000),
    "bottom": ("chroma-luma", 10000),
    "left": ("chroma-luma", 18000),
}

pytestmark = pytest.mark.slow


def run_demo(out: Path) -> list[str]:
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / "demo.py"), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("demo") / "out"


@pytest.fixture(scope="module")
def lines(out: Path) -> list[str]:
    return run_demo(out)


@pytest.fixture(scope="module")
def pieces(lines: list[str]) -> dict[str, np.ndarray]:
    """The five images of the sheet."""
    with Image.open(lines[-1]) as image:
        sheet = np.asarray(image.convert("RGB"))
    layout = Layout(*SOURCE.shape[:2])
    corners = {place: layout.corner(place) for place in PLACES}
    return {
        place: sheet[top : top + layout.height, left : left + layout.width] for place, (top, left) in corners.items()
    }


def test_the_last_line_is_the_path_of_the_picture(out: Path, lines: list[str]) -> None:
    assert Path(lines[-1]) == out / "demo" / "contact-sheet.png"
    with Image.open(lines[-1]) as image:
        width, height = image.size
    assert width == Layout(*SOURCE.shape[:2]).sheet_width
    assert height > 3 * SOURCE.shape[0]


def test_the_display_is_said_to_be_reconstructed(lines: list[str]) -> None:
    assert "RECONSTRUCTED, not measured" in lines[0]


def test_the_centre_is_the_source_to_the_last_bit(pieces: dict[str, np.ndarray]) -> None:
    np.testing.assert_array_equal(pieces["centre"], SOURCE)


@pytest.mark.parametrize("place", AGES)
def test_each_aged_image_is_the_models_at_its_place(pieces: dict[str, np.ndarray], place: str) -> None:
    mode, hours = AGES[place]
    model = DisplayModel(read_measurements(default_display()))
    expected = np.rint(255 * model.at(mode, hours).code_to_code(SOURCE / 255))
    off = np.abs(pieces[place] - expected)
    assert off.max() <= 1
    assert (off > 0).mean() < 0.05


def test_every_config_is_within_one_code_of_the_model(lines: list[str]) -> None:
    rows = {tuple(line.split()[:2]): line.split()[2:] for line in lines if line.startswith("chroma")}
    assert set(rows) == {(mode, str(hours)) for mode, hours in AGES.values()}
    for p99, largest, delta_e, *_ in rows.values():
        assert float(p99) <= 0.5
        assert float(largest) <= 1.0
        assert float(delta_e) > 1.0


@pytest.mark.rare(instead="test_build.py::test_an_older_and_damaged_build_is_replaced")
def test_a_second_run_replaces_an_older_and_damaged_build_and_gives_the_same_picture(
    out: Path, lines: list[str]
) -> None:
    picture = Path(lines[-1]).read_bytes()
    manifest = out / "aged" / "manifest.json"
    content = json.loads(manifest.read_text(encoding="utf-8"))
    manifest.write_text(json.dumps(content | {"generator": "lutgen 0.0.1"}), encoding="utf-8")
    (out / "aged" / "chroma" / "10000h" / "aged.clf").unlink()
    again = run_demo(out)
    assert again == lines
    assert Path(again[-1]).read_bytes() == picture
