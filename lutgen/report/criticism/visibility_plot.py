"""The picture of what readings can show: the smallest detectable size of each effect over its typical size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.criticism.effect_size import relative_size
from lutgen.numerals import percent, readable
from lutgen.report.drawing.figure import BLACK, BLUE, RED, picture, tidy

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from lutgen.criticism.visibility import Visibility
    from lutgen.effects import Effect

#: Height of an effect's row, in inches.
ROW = 0.34

#: Least and greatest share of the typical size that the axis shows at least.
LEAST, MOST = 1e-3, 10.0


def plot_visibility(
    seen: Sequence[Visibility], effects: Mapping[str, Effect], path: Path, *, foot: str, force: bool
) -> None:
    """Draw one bar for each effect: smallest detectable size over typical size. Errors as :func:`picture`."""
    sizes = {each.effect: relative_size(each, effects) for each in seen}
    order = sorted(seen, key=lambda each: (not each.visible, sizes[each.effect] or 0.0))
    explained = (
        "Bar: smallest size that nine of ten campaigns like this would show, over the effect's typical size: the "
        "shorter, the better it is seen. Column: share of the signature that white and primaries, read again, absorb. "
    )
    height = 2.0 + ROW * len(order)
    with picture(path, _title(order, sizes), foot=explained + foot, height=height, force=force) as (figure, low, high):
        axes = figure.add_axes((0.16, low + 0.62 / height, 0.62, high - low - 0.75 / height))
        _bars(axes, order, sizes)
        absorbed = figure.add_axes((0.86, low + 0.62 / height, 0.1, high - low - 0.75 / height), sharey=axes)
        _absorbed(absorbed, order)


def _title(order: Sequence[Visibility], sizes: Mapping[str, float | None]) -> str:
    blind = [each.effect for each in order if not each.visible]
    weak = [each.effect for each in order if each.visible and (sizes[each.effect] or 0.0) > 1.0]
    if not blind and not weak:
        return f"These data can see all {len(order)} effects at their typical size"
    visible = len(order) - len(blind) - len(weak)
    parts = [f"These data can see {visible} of {len(order)} effects at their typical size"]
    parts += [f"{', '.join(weak)} only when larger"] if weak else []
    parts += [f"they cannot see {', '.join(blind)}"] if blind else []
    return "; ".join(parts)


def _bars(axes: Axes, order: Sequence[Visibility], sizes: Mapping[str, float | None]) -> None:
    known = [size for size in sizes.values() if size]
    low, high = min([LEAST, *(0.5 * size for size in known)]), max([MOST, *(3.0 * size for size in known)])
    axes.set_xscale("log")
    axes.set(xlim=(low, high), ylim=(len(order) - 0.4, -0.6))
    for row, each in enumerate(order):
        size = sizes[each.effect]
        if not each.visible:
            axes.barh(row, high - low, 0.62, left=low, color="#fbe3d6", edgecolor=RED, hatch="///", linewidth=0.0)
            axes.text(low * 1.15, row, "cannot be seen at any size", va="center", fontsize=10, color=RED, weight="bold",
                      bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5})  # fmt: skip
        elif size is None:
            size_there = each.smallest_detectable
            label = f"seen up to {readable(size_there)} {each.unit}" if size_there else "seen when it is there"
            axes.text(low * 1.15, row, label, va="center", fontsize=10, color=BLUE)
        else:
            axes.barh(row, size - low, 0.62, left=low, color=BLUE if size <= 1 else RED)
            unit = "" if each.unit == "1" else f" {each.unit}"
            label = f"{each.parameter} from {readable(each.smallest_detectable or 0.0, 3)}{unit}"
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            axes.text(size * 1.06, row, label, va="center", fontsize=10, color=BLACK, bbox=box)
    axes.axvline(1.0, color=BLACK, linewidth=1.2, linestyle="--")
    axes.text(1.0, -0.75, "typical size", ha="center", va="bottom", fontsize=10)
    axes.set_yticks(range(len(order)), [each.effect for each in order], fontsize=11)
    axes.set_xlabel("smallest detectable size over typical size")
    tidy(axes)
    axes.grid(visible=False, axis="y")


def _absorbed(axes: Axes, order: Sequence[Visibility]) -> None:
    share = np.array([each.absorbed or 0.0 for each in order])
    rows = np.arange(len(order))
    axes.barh(rows, np.ones(len(order)), 0.62, color="#eeeeee")
    axes.barh(rows, share, 0.62, color="#999999")
    for row, each in enumerate(order):
        axes.text(1.06, row, percent(each.absorbed), va="center", fontsize=10)
    axes.set(xlim=(0.0, 1.0), xticks=[])
    axes.text(0.5, -0.75, "absorbed", ha="center", va="bottom", fontsize=10)
    axes.tick_params(left=False, labelleft=False)
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
