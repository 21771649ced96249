"""ΔE2000 against hours as a drawing in the page (SVG): both modes, the tolerances, and a marker that a script moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.numerals import spaced
from lutgen.report.drawing import BLUE, RED

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.pictures.difference import DifferenceCurve
    from lutgen.pictures.lifetime import Lifetimes

#: Size in the drawing's own units, and its margins around the axes.
WIDTH, HEIGHT = 900, 380
LEFT, RIGHT, TOP, BOTTOM = 62, 160, 18, 52

#: Colour of each mode's line, in turn; Okabe & Ito.
COLOURS = (BLUE, RED)

#: Ticks of an axis, at most.
_TICKS = 7

#: Least distance of two labels at the right, each of two lines, and of a label from the axis.
_APART, _ABOVE_AXIS = 34.0, 18.0


@dataclass(frozen=True)
class Line:
    """The curve of one mode; places in the drawing.

    Attributes
    ----------
    mode, colour
        Its name and what it is drawn in.
    mean, most
        Corners of the mean and of mean + 2 SD, as SVG writes them.
    dots
        The computed points of the mean.
    label
        Height of its name.

    """

    mode: str
    colour: str
    mean: str
    most: str
    dots: list[tuple[float, float]]
    label: float


@dataclass(frozen=True)
class Chart:
    """What ``chart.svg`` draws; places in the drawing, texts of the ticks.

    Attributes
    ----------
    last
        The last hour.
    levels, tolerances
        Height and text of each tick of ΔE2000, and of each tolerance that the axes hold.
    hours
        Place and text of each tick of the hours.
    lines
        One a mode.

    """

    last: float
    levels: list[tuple[float, str]]
    hours: list[tuple[float, str]]
    tolerances: list[tuple[float, str]]
    lines: list[Line]
    width: int = WIDTH
    height: int = HEIGHT
    left: int = LEFT
    right: int = WIDTH - RIGHT
    top: int = TOP
    bottom: int = HEIGHT - BOTTOM


def chart(lifetimes: Lifetimes) -> Chart:
    """Place mean and mean + 2 SD of the first image's curves."""
    curves = lifetimes.images[0].curves
    top = 1.06 * max(*(float(curve.max.max()) for curve in curves.values()), 1.2 * min(lifetimes.tolerances))
    axes = _Axes(lifetimes.last or 1.0, top)
    labels = _apart([axes.y(float(curve.mean[-1])) for curve in curves.values()])
    return Chart(
        last=axes.last,
        levels=[(axes.y(level), f"{level:g}") for level in ticks(top)],
        hours=[(axes.x(hour), spaced(hour)) for hour in ticks(axes.last)],
        tolerances=[(axes.y(each), f"{each:g}") for each in lifetimes.tolerances if each < top],
        lines=[
            _line(axes, mode, curve, colour, label)
            for (mode, curve), colour, label in zip(curves.items(), COLOURS, labels, strict=False)
        ],
    )


@dataclass(frozen=True)
class _Axes:
    """From hours and ΔE2000 to places in the drawing, to a tenth of its unit."""

    last: float
    top: float

    def x(self, hours: float) -> float:
        return round(LEFT + (WIDTH - LEFT - RIGHT) * float(hours) / self.last, 1)

    def y(self, value: float) -> float:
        return round(TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - float(value) / self.top), 1)

    def corners(self, hours: Array, values: Array) -> str:
        return " ".join(f"{self.x(hour)},{self.y(value)}" for hour, value in zip(hours, values, strict=True))


def _line(axes: _Axes, mode: str, curve: DifferenceCurve, colour: str, label: float) -> Line:
    return Line(
        mode,
        colour,
        mean=axes.corners(curve.hours, curve.mean),
        most=axes.corners(curve.hours, curve.max),
        dots=[(axes.x(hour), axes.y(value)) for hour, value in zip(curve.hours, curve.mean, strict=True)],
        label=round(label, 1),
    )


def _apart(places: list[float]) -> list[float]:
    """Move labels so that no two are nearer than ``_APART``, and none is below the axes; the order stays."""
    order = sorted(range(len(places)), key=places.__getitem__)
    moved = list(places)
    lowest = HEIGHT - BOTTOM - _ABOVE_AXIS
    for above, below in zip(reversed(order[:-1]), reversed(order[1:]), strict=True):
        moved[below] = min(moved[below], lowest)
        moved[above] = min(moved[above], moved[below] - _APART)
    return moved


def ticks(last: float) -> list[float]:
    """Return round numbers from 0 to ``last``, at most ``_TICKS`` + 1."""
    step = 10.0 ** np.floor(np.log10(last / _TICKS))
    step = next(step * times for times in (1, 2, 2.5, 3, 5, 10) if last / (step * times) <= _TICKS)
    return [float(step * number) for number in range(int(last / step + 1e-9) + 1)]
