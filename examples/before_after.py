"""Tissue on display A by the model before and after refinement, and the error of both against the display itself.

    python -m examples.before_after [OUT]

Reads the output of the walk-through in OUT (default: out): the builds OUT/before and OUT/after, and the refined
model OUT/display-a.toml. Writes OUT/before-after.jpg and prints colour differences. Nobody measured at the hour of
the comparison. The display's colours at this hour are known because the display is simulated.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from skimage.data import immunohistochemistry

from examples.make_displays import DISPLAYS, FOLDER
from lutgen import DisplayModel, LutgenError, apply_to_image, load_model, read_measurements
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab, xyz_to_lab
from lutgen.display.tips import luminance_law
from tests.virtual_display.campaign import truth

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.report.drawing import Pixels

DISPLAY = "display-a.csv"
MODE, HOURS, FOLDER_OF_HOUR = "chroma", 15_000.0, "chroma/15000h"

#: A field of the tissue image with white background, brown and blue stain: first row and column, and width in pixels.
TOP, LEFT, ACROSS = 60, 150, 256

#: Step between the pixels whose colours are compared with the display itself.
EVERY = 29

#: Pixels between and around the images, and for the text above and below them.
GAP, TITLE, CAPTION = 12, 40, 56

#: ΔE2000 at the bright end of the map.
BRIGHTEST = 6.0


def main(out: Path) -> None:
    """Age the tissue with both builds, compare, draw."""
    tissue: Pixels = immunohistochemistry()[TOP : TOP + ACROSS, LEFT : LEFT + ACROSS]
    before, after = (aged(tissue, out / name, out) for name in ("before", "after"))
    delta_e = difference(before, after)
    print(f"Tissue at {HOURS:.0f} h ({MODE}), between the LUTs before and after: {told(delta_e)}")
    models = {
        "the paper's model": DisplayModel(read_measurements(FOLDER / DISPLAY)),
        "the refined model": load_model(out / "display-a.toml"),
    }
    code = tissue.reshape(-1, 3)[::EVERY] / 255.0
    for name, model in models.items():
        print(f"{name} against the display itself, {len(code)} of these colours: {told(off_truth(model, code))}")
    path = out / "before-after.jpg"
    draw([tissue, before, after, mapped(delta_e)], delta_e, path)
    print(path)


def aged(tissue: Pixels, build: Path, out: Path) -> Pixels:
    """Apply the LUT of a build to the tissue, as ``lutgen apply --build`` does."""
    from matplotlib.image import imread, imsave

    source, target = out / "tissue.png", out / f"tissue-{build.name}.png"
    imsave(source, tissue)
    apply_to_image(source, target, build / FOLDER_OF_HOUR / "aged.clf", force=True)
    pixels: Pixels = np.rint(255.0 * imread(target)[..., :3]).astype(np.uint8)
    return pixels


def difference(one: Pixels, other: Pixels) -> Array:
    """Return ΔE2000 between two images as an sRGB viewer shows them, shape (h, w)."""
    return delta_e_2000(*(linear_to_lab(code_to_linear(image / 255.0)) for image in (one, other)))


def off_truth(model: DisplayModel, code: Array) -> Array:
    """Return ΔE2000 between a model and the simulated display, from XYZ in cd/m², for code values (n, 3)."""
    shown = truth(DISPLAYS[DISPLAY], code, HOURS)
    measured = replace(model, reference="absolute", luminance=luminance_law("measured"))
    predicted = measured.at("chroma-luma", HOURS).code_to_xyz(code) * measured.shown_tips(0.0)[0, 2]
    white = truth(DISPLAYS[DISPLAY], np.ones((1, 3)), HOURS)[0]
    return delta_e_2000(xyz_to_lab(predicted, white), xyz_to_lab(shown, white))


def told(delta_e: Array) -> str:
    """Return mean, 95th percentile and maximum as text."""
    return f"mean ΔE2000 {delta_e.mean():.2f}, 95 % below {np.quantile(delta_e, 0.95):.2f}, largest {delta_e.max():.2f}"


def mapped(delta_e: Array) -> Pixels:
    """Draw ΔE2000 as a map from black to yellow."""
    from matplotlib import colormaps

    pixels: Pixels = (255.0 * colormaps["inferno"](np.clip(delta_e / BRIGHTEST, 0.0, 1.0))[..., :3]).astype(np.uint8)
    return pixels


def draw(images: list[Pixels], delta_e: Array, path: Path) -> None:
    """Draw the images in a row, pixel by pixel, with captions; every run draws the same pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.image import imsave

    captions = [
        "un-aged",
        f"{HOURS:.0f} h: the paper's model",
        f"{HOURS:.0f} h: with black-level, eotf-drift",
        f"ΔE2000 between the two, 0 to {BRIGHTEST:g}\nmean {delta_e.mean():.1f}, largest {delta_e.max():.1f}",
    ]
    width, height = len(images) * (ACROSS + GAP) + GAP, TITLE + ACROSS + CAPTION
    # The extra tenth of a pixel prevents the loss of a row by rounding.
    figure = Figure(figsize=((width + 0.1) / 100, (height + 0.1) / 100), dpi=100, facecolor="#777777")
    canvas: Any = FigureCanvasAgg(figure)

    def write(text: str, left: int, top: int, size: float, weight: str) -> None:
        place = (left / width, 1.0 - top / height)
        figure.text(*place, text, color="white", fontsize=size, weight=weight, va="top", linespacing=1.4)

    write("Tissue on display A (simulated) before and after its model was refined", GAP, 10, 12, "bold")
    for index, caption in enumerate(captions):
        write(caption, GAP + index * (ACROSS + GAP), TITLE + ACROSS + 8, 9, "normal")
    canvas.draw()
    sheet: Pixels = np.array(canvas.buffer_rgba())[..., :3]
    for index, image in enumerate(images):
        left = GAP + index * (ACROSS + GAP)
        sheet[TITLE : TITLE + ACROSS, left : left + ACROSS] = image
    imsave(path, sheet, format="jpg", pil_kwargs={"quality": 85, "subsampling": 0})


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
    except LutgenError as error:
        sys.exit(f"before_after: {error}")
