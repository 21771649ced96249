"""The contact sheet: the paper's layout, unscaled pixels, readable places of the texts."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lutgen import LutgenError
from lutgen.report.drawing import SURROUND, Pixels
from lutgen.report.sheets import PLACES, Layout, contact_sheet

pytestmark = pytest.mark.numbers

SIZES = ((256, 256), (61, 47), (111, 234), (234, 134))


def pictures(height: int, width: int) -> dict[str, Pixels]:
    """Five different images of noise, in which any resampling would be visible."""
    random = np.random.default_rng(2)
    return {f"picture {i}": random.integers(0, 256, (height, width, 3), dtype=np.uint8) for i in range(5)}


def written(path: Path) -> Pixels:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def piece(sheet: Pixels, layout: Layout, place: str) -> Pixels:
    top, left = layout.corner(place)
    return sheet[top : top + layout.height, left : left + layout.width]


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_every_pixel_is_copied_to_its_place(tmp_path: Path, height: int, width: int) -> None:
    images = pictures(height, width)
    sheet = written(contact_sheet(images, tmp_path / "sheet.png", title="A title", footer="A footer"))
    for place, pixels in zip(PLACES, images.values(), strict=True):
        np.testing.assert_array_equal(piece(sheet, Layout(height, width), place), pixels, err_msg=place)


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_aged_images_lie_clockwise_from_the_top_around_the_centre(height: int, width: int) -> None:
    layout = Layout(height, width)
    (row, column), *around = (layout.corner(place) for place in PLACES)
    ways = [(np.sign(other_row - row), np.sign(other_column - column)) for other_row, other_column in around]
    assert ways == [(-1, 0), (0, 1), (1, 0), (0, -1)]


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_nothing_but_texts_is_on_the_grey(tmp_path: Path, height: int, width: int) -> None:
    layout = Layout(height, width)
    images = pictures(height, width)
    sheet = written(contact_sheet(images, tmp_path / "sheet.png", title="T " * 30, footer="F " * 300)).copy()
    captions = []
    for place in PLACES:
        top, left = layout.corner(place)
        below = sheet[top + height : top + height + layout.caption, left : left + width]
        captions.append(below.max())
        piece(sheet, layout, place)[:] = SURROUND
    assert captions == [255] * 5, "a caption under each image"
    assert (sheet == sheet[..., :1]).all(), "greys only"
    edges = np.concatenate([sheet[:4].ravel(), sheet[-4:].ravel(), sheet[:, :4].ravel(), sheet[:, -4:].ravel()])
    assert (edges == SURROUND).all(), "no text is cut off"


def test_a_sheet_has_the_same_bytes_on_every_run_and_no_date(tmp_path: Path) -> None:
    images = pictures(40, 50)
    first, second = (
        contact_sheet(images, tmp_path / name, title="A title", footer="A footer") for name in ("1.png", "2.png")
    )
    assert first.read_bytes() == second.read_bytes()
    with Image.open(first) as image:
        assert set(image.info) <= {"dpi"}


def test_an_existing_file_is_replaced_only_by_force(tmp_path: Path) -> None:
    path = tmp_path / "sheet.png"
    path.write_text("mine")
    with pytest.raises(LutgenError, match="exists already"):
        contact_sheet(pictures(40, 50), path, title="", footer="")
    assert path.read_text() == "mine"
    contact_sheet(pictures(40, 50), path, title="", footer="", force=True)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert list(tmp_path.iterdir()) == [path]


def four(images: dict[str, Pixels]) -> dict[str, Pixels]:
    return dict(list(images.items())[:4])


def odd_one(images: dict[str, Pixels]) -> dict[str, Pixels]:
    return images | {"picture 3": images["picture 3"][1:]}


def floats(images: dict[str, Pixels]) -> dict[str, Any]:
    return {**images, "picture 2": images["picture 2"] / 255.0}


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [(four, "5 images"), (odd_one, "'picture 3'.*one size"), (floats, "'picture 2' is float64.*uint8")],
)
def test_wrong_images_are_refused_with_a_sentence(tmp_path: Path, spoil: object, sentence: str) -> None:
    assert callable(spoil)
    with pytest.raises(LutgenError, match=sentence):
        contact_sheet(spoil(pictures(40, 50)), tmp_path / "sheet.png", title="", footer="")
    assert not list(tmp_path.iterdir())
