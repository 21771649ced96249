"""ΔE2000 against hours as a drawing in the page (SVG): both modes, the tolerances, and a marker that a script moves."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from lutgen.numerals import spaced
from lutgen.report.drawing.figure import BLUE, RED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.appearance.curve import Curve
    from lutgen.appearance.lifetime import Lifetimes
    from lutgen.colorimetry import Array

#: Size in the drawing's own units, and the margins around the axes: left, right, top, bottom.
WIDTH, HEIGHT = 900, 380
LEFT, RIGHT, TOP, BOTTOM = 62, 160, 18, 52

#: Colour of each mode's line, in turn; Okabe & Ito.
COLOURS = (BLUE, RED)

#: Ticks of an axis, at most.
_TICKS = 7


def chart(found: Lifetimes) -> str:
    """Draw mean and mean + 2 SD of the first image's curves."""
    curves = found.images[0].curves
    top = 1.06 * max(*(float(curve.max.max()) for curve in curves.values()), 1.2 * min(found.tolerances))
    axes = _Axes(found.last or 1.0, top)
    ends = _apart([axes.y(float(curve.mean[-1])) for curve in curves.values()], 34.0)
    lines = [
        *axes.grid(),
        *(_tolerance(axes, tolerance) for tolerance in found.tolerances if tolerance < top),
        *(
            part
            for (mode, curve), colour, end in zip(curves.items(), COLOURS, ends, strict=False)
            for part in _curve(axes, mode, curve, colour, end)
        ),
        f'<g id="marker" data-left="{LEFT}" data-across="{WIDTH - LEFT - RIGHT}" data-last="{axes.last!r}">',
        f'<line y1="{TOP}" y2="{HEIGHT - BOTTOM}"/></g>',
    ]
    label = "Mean ΔE2000 between the un-aged and the aged display against operating hours, in each mode"
    body = "\n".join(lines)
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label)}" class="chart">\n{body}\n</svg>'


class _Axes:
    """From hours and ΔE2000 to places in the drawing."""

    def __init__(self, last: float, top: float) -> None:
        self.last, self.top = last, top

    def x(self, hours: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * hours / self.last

    def y(self, value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - value / self.top)

    def grid(self) -> Iterator[str]:
        right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
        for value in ticks(self.top):
            y = self.y(value)
            yield f'<line class="rule" x1="{LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}"/>'
            yield f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>'
        for hours in ticks(self.last):
            x = self.x(hours)
            yield f'<line class="rule" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{bottom}"/>'
            yield f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle">{spaced(hours)}</text>'
        yield f'<text x="{(LEFT + right) / 2:g}" y="{HEIGHT - 8}" text-anchor="middle">operating hours</text>'
        middle = (TOP + bottom) / 2
        yield (
            f'<text x="16" y="{middle:g}" text-anchor="middle" transform="rotate(-90 16 {middle:g})">'
            f"ΔE2000, un-aged against aged</text>"
        )


def _curve(axes: _Axes, mode: str, curve: Curve, colour: str, end: float) -> Iterator[str]:
    yield f'<polyline class="most" points="{_points(axes, curve.hours, curve.max)}" stroke="{colour}"/>'
    yield f'<polyline class="mean" points="{_points(axes, curve.hours, curve.mean)}" stroke="{colour}"/>'
    for hours, value in zip(curve.hours, curve.mean, strict=True):
        yield f'<circle cx="{axes.x(hours):.1f}" cy="{axes.y(value):.1f}" r="2.6" fill="{colour}"/>'
    place = WIDTH - RIGHT + 10
    yield f'<text class="mode" x="{place}" y="{end:.1f}" fill="{colour}">{escape(mode)}</text>'
    yield f'<text x="{place}" y="{end + 15:.1f}" fill="{colour}">mean; dashed + 2 SD</text>'


def _points(axes: _Axes, hours: Array, values: Array) -> str:
    return " ".join(f"{axes.x(hour):.1f},{axes.y(value):.1f}" for hour, value in zip(hours, values, strict=True))


def _tolerance(axes: _Axes, tolerance: float) -> str:
    y = axes.y(tolerance)
    return (
        f'<line class="tolerance" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>'
        f'<text class="tolerance" x="{LEFT + 6}" y="{y - 5:.1f}">tolerance {tolerance:g}</text>'
    )


def _apart(places: list[float], least: float) -> list[float]:
    """Move labels so that no two are nearer than ``least``, and none is below the axes; the order stays."""
    order = sorted(range(len(places)), key=places.__getitem__)
    moved = list(places)
    lowest = HEIGHT - BOTTOM - 18.0
    for above, below in zip(reversed(order[:-1]), reversed(order[1:]), strict=True):
        moved[below] = min(moved[below], lowest)
        moved[above] = min(moved[above], moved[below] - least)
    return moved


def ticks(last: float) -> list[float]:
    """Return round numbers from 0 to ``last``, at most ``_TICKS`` + 1."""
    step = 10.0 ** np.floor(np.log10(last / _TICKS))
    step = next(step * times for times in (1, 2, 2.5, 3, 5, 10) if last / (step * times) <= _TICKS)
    return [float(step * number) for number in range(int(last / step + 1e-9) + 1)]
