"""Tissue on an aged display, without and with the correction: the restored colours, and those out of reach.

    python -m examples.compensation [OUT.jpg]

Writes the picture (default: out/compensation.jpg) and prints its figures. The display is the reconstructed default,
simulated, not measured. The image is real, from scikit-image (IHC, CC0).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from skimage.data import immunohistochemistry

from lutgen import DisplayModel, default_display, read_measurements
from lutgen.colorimetry import delta_e_2000, linear_to_lab, xyz_to_linear
from lutgen.display import UNREACHABLE, compensated, compensation_of
from lutgen.display.chain import viewer_code

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from lutgen.colorimetry import Array

#: A field with white background, brown and blue stain: first row and column, and width in pixels.
TOP, LEFT, ACROSS = 60, 150, 300

#: The displays of the two rows of pictures.
ROWS = (("chroma", 18_000.0), ("chroma-luma", 10_000.0))

#: Colours of the modes in the plot.
COLOURS = {"chroma": "#2f55c8", "chroma-luma": "#c8322d"}

SIMULATED = "Simulated: the default display is reconstructed, not measured."


class Panel(NamedTuple):
    """One picture: code values for an un-aged viewer, and its caption."""

    title: str
    code: Array
    text: str


def main(path: Path) -> None:
    """Compute, print, draw."""
    tissue = immunohistochemistry()[TOP : TOP + ACROSS, LEFT : LEFT + ACROSS] / 255.0
    model = DisplayModel(read_measurements(default_display()))
    print(SIMULATED)
    rows = [panels(model, mode, hours, tissue) for mode, hours in ROWS]
    for (mode, hours), row in zip(ROWS, rows, strict=True):
        for panel in row:
            print(f"{mode}, {hours:.0f} h, {panel.title}: {panel.text}")
    path.parent.mkdir(parents=True, exist_ok=True)
    draw(rows, shares(model, tissue), path)
    print(path)


def panels(model: DisplayModel, mode: str, hours: float, tissue: Array) -> list[Panel]:
    """Return the pictures of the un-aged display, the aged display, and the aged display with either correction."""
    aged, fresh = model.at(mode, hours), model.at("stable", hours)
    wanted = fresh.code_to_xyz(tissue)
    pictures = [
        Panel("un-aged", viewer_code(xyz_to_linear(wanted)), "what it is to look like"),
        Panel(f"{mode}, {hours:.0f} h", aged.code_to_code(tissue), away(aged.code_to_xyz(tissue), wanted)),
    ]
    for way in UNREACHABLE:
        sent = compensated(aged, fresh, unreachable=way)
        link = compensation_of(sent)
        light = link.scale if link else 1.0
        shown = aged.code_to_xyz(sent.code_to_code(tissue))
        text = f"{sent.clipped_share(tissue):.0%} of pixels out of reach, {away(shown, wanted)}"
        if light < 1.0:
            text = f"light × {light:.2f}; {away(shown, wanted * light, 'to the un-aged as dim')}"
        pictures.append(Panel(f"compensated, {way}", viewer_code(xyz_to_linear(shown)), text))
    return pictures


def away(shown: Array, wanted: Array, what: str = "to the un-aged") -> str:
    """Return the difference between pictures as text."""
    error = delta_e_2000(linear_to_lab(xyz_to_linear(shown)), linear_to_lab(xyz_to_linear(wanted)))
    return f"ΔE2000 {what}: mean {error.mean():.1f}"


def shares(model: DisplayModel, tissue: Array) -> dict[str, Array]:
    """Return hours, share of this image's pixels out of reach, and the factor of ``scale``: (n, 3) for each mode."""
    result = {}
    for mode in COLOURS:
        table = []
        for hours in model.tips.hours:
            ways = [
                compensated(model.at(mode, hours), model.at("stable", hours), unreachable=way) for way in UNREACHABLE
            ]
            link = compensation_of(ways[1])
            table.append((hours, ways[0].clipped_share(tissue), link.scale if link else 1.0))
        result[mode] = np.array(table)
    return result


def draw(rows: list[list[Panel]], table: dict[str, Array], path: Path) -> None:
    """Draw the pictures pixel by pixel, with the shares over the hours below them."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context("default"):
        figure = Figure(figsize=(13, 11.4), dpi=100)
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2, 4, left=0.06, right=0.98, top=0.91, bottom=0.31)
        grid.update(wspace=0.06, hspace=0.28)
        figure.text(0.06, 0.965, "What a correction gives back to an aged display", fontsize=16, weight="bold")
        figure.text(0.06, 0.945, SIMULATED, fontsize=10, color="#555555")
        for line, row in enumerate(rows):
            for column, panel in enumerate(row):
                axes = figure.add_subplot(grid[line, column])
                axes.imshow(panel.code, interpolation="nearest")
                axes.set_title(panel.title, fontsize=11, loc="left", weight="bold")
                axes.set_xlabel(panel.text.replace("; ", "\n").replace(", ", "\n"), fontsize=9, loc="left")
                axes.set_xticks([])
                axes.set_yticks([])
        curves(figure, table)
        figure.savefig(path, metadata=None, pil_kwargs={"quality": 85, "subsampling": 0})


def curves(figure: Figure, table: dict[str, Array]) -> None:
    """Draw the share out of reach, and the light that ``scale`` leaves, over the hours."""
    titles = ("clip: pixels of this image out of reach", "scale: light that is left when nothing saturates")
    for column, title in enumerate(titles):
        axes = figure.add_axes((0.06 + 0.49 * column, 0.06, 0.42, 0.17))
        for mode, values in table.items():
            axes.plot(values[:, 0], 100 * values[:, column + 1], color=COLOURS[mode], lw=2.5)
            end = (values[-1, 0], 100 * values[-1, column + 1])
            axes.annotate(
                mode,
                end,
                xytext=(-4, -22 if values[-1, 2] < 0.5 and column else 8),
                textcoords="offset points",
                ha="right",
                color=COLOURS[mode],
                weight="bold",
            )
        axes.set_title(title, fontsize=11, loc="left", weight="bold")
        axes.set_xlabel("hours")
        axes.set_ylim(0, 109)
        axes.set_xlim(0, 18_000)
        axes.yaxis.set_major_formatter("{x:.0f} %")
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(visible=True, alpha=0.3)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/compensation.jpg"))
