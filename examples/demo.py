"""`make demo`: a real tissue image on an aged display, through the OpenColorIO configs that lutgen bakes.

    .venv/bin/python examples/demo.py [OUT]

Builds the LUTs and configs of the default display into OUT/aged (31 hours × 2 modes; default: out), renders an
immunohistochemistry field through four of the configs, compares every pixel with the model of the configs, and
arranges the images as in Figures 2 to 4 of the paper. The last line is the path of that picture.

An interrupted or older build is completed or replaced; files that lutgen did not write are kept.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from skimage.data import immunohistochemistry

from lutgen import DisplayModel, LutgenError, build, read_measurements
from lutgen.bake.build import BuildPlan
from lutgen.bake.config import AGED_VIEW, SOURCE, UNAGED_VIEW
from lutgen.bindings import ocio
from lutgen.cli.outputs import progress_bar
from lutgen.colorimetry import code_to_linear, delta_e_2000, linear_to_lab
from lutgen.display import default_display, hour_name
from lutgen.display.tips import parse_hours
from lutgen.numerals import spaced
from lutgen.report.sheets import contact_sheet

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.report.drawing import Pixels

#: Clockwise from the top, as in the paper.
AGES = (("chroma", 10_000.0), ("chroma", 18_000.0), ("chroma-luma", 10_000.0), ("chroma-luma", 18_000.0))


@dataclass(frozen=True)
class Rendering:
    """The image on one aged display, and the error of the config against the model."""

    mode: str
    hours: float
    pixels: Pixels
    off: Array
    clipped: float
    delta_e: float

    @property
    def caption(self) -> str:
        """Return the caption of the image."""
        what = f"{self.mode}, {spaced(self.hours)} h"
        return f"{what}\nmean ΔE2000 {self.delta_e:.1f} · {100 * self.clipped:.1f} % of pixels clipped to sRGB"


def main(out: Path) -> None:
    """Build, render, compare, draw."""
    model = DisplayModel(read_measurements(default_display()))
    print(model.measurements.provenance)
    build_all(model, out / "aged")
    source: Pixels = immunohistochemistry()
    folder = out / "aged" / AGES[0][0] / hour_name(AGES[0][1])
    unaged = to_8_bit(through_config(folder / "config.ocio", UNAGED_VIEW, source))
    renderings = [render(model, out / "aged", source, mode, hours) for mode, hours in AGES]
    report(renderings)
    images = {"un-aged\nthe source signal": unaged} | {shown.caption: shown.pixels for shown in renderings}
    path = contact_sheet(
        images,
        out / "demo" / "contact-sheet.png",
        title="Tissue on an aging display, seen on an un-aged sRGB viewer",
        footer=f"{model.measurements.provenance} Model: Avanaki et al. 2015, reference {model.reference}, selection "
        f"{model.selection}, luminance law {model.luminance.name}. Image: skimage.data.immunohistochemistry().",
        force=True,
    )
    print(path)


def build_all(model: DisplayModel, folder: Path) -> None:
    """Do what `lutgen build --hours 0..18000 --force -o out/aged` does."""
    plan = BuildPlan(tuple(parse_hours("0..18000", model.tips)))
    print(f"Building {len(plan.hours)} hours × {len(plan.modes)} modes into {folder} ...", flush=True)
    with progress_bar("building") as progress:
        built = build(model, plan, folder, force=True, progress=progress)
    luts = [record for record in built.manifest.files if record.kind == "lut"]
    print(f"{len(luts)} LUTs and {len(built.manifest.files) - len(luts)} configs, each LUT certified in manifest.json.")


def render(model: DisplayModel, folder: Path, source: Pixels, mode: str, hours: float) -> Rendering:
    """Apply a baked config, and the model itself, to the image."""
    aged = model.at(mode, hours)
    code = source / 255.0
    config = folder / mode / hour_name(hours) / "config.ocio"
    through = through_config(config, AGED_VIEW, source)
    off = 255.0 * np.abs(np.clip(through, 0.0, 1.0) - aged.code_to_code(code)).max(axis=-1)
    pixels = to_8_bit(through)
    before, after = (linear_to_lab(code_to_linear(image / 255.0)) for image in (source, pixels))
    return Rendering(mode, hours, pixels, off, aged.clipped_share(code), float(delta_e_2000(before, after).mean()))


def through_config(config: Path, view: str, source: Pixels) -> NDArray[np.float32]:
    """Return the output of OpenColorIO for 8-bit code values on the sRGB viewer of a config; not clipped."""
    lib = ocio()
    processor = lib.Config.CreateFromFile(str(config)).getProcessor(SOURCE, "sRGB", view, lib.TRANSFORM_DIR_FORWARD)
    pixels = np.ascontiguousarray(source / 255.0, dtype=np.float32)
    processor.getDefaultCPUProcessor().applyRGB(pixels)
    return pixels


def to_8_bit(code: NDArray[np.float32]) -> Pixels:
    """Clip code values 0..1 and round them to 8 bits."""
    pixels: Pixels = np.rint(255.0 * np.clip(code, 0.0, 1.0)).astype(np.uint8)
    return pixels


def report(renderings: list[Rendering]) -> None:
    """Print the error of each config against the model, and the change of the image."""
    print(f"\nThe image through the configs, by OpenColorIO {ocio().__version__}:")
    print("                       config against model, 8-bit codes    image against un-aged")
    print("mode            hours          99 %          largest    mean ΔE2000    clipped")
    for shown in renderings:
        p99, largest = np.quantile(shown.off, 0.99), shown.off.max()
        numbers = f"{p99:14.3f}{largest:17.3f}{shown.delta_e:15.2f}{100 * shown.clipped:9.1f} %"
        print(f"{shown.mode:14}{shown.hours:7.0f}{numbers}")
    print()


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
    except LutgenError as error:
        sys.exit(f"demo: {error}")
