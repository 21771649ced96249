"""The templates of the page of ``lutgen report``, its sections, and its drawing of ΔE2000 against hours (SVG).

Templates escape every given value, so that a file name cannot become markup.
"""

from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from lutgen.colorimetry import Array
from lutgen.numerals import spaced
from lutgen.pictures.lifetime import Lifetimes
from lutgen.pictures.viewer import FOLDER
from lutgen.report.drawing import BLUE, RED
from lutgen.report.parts import Code, Headline, Table


@dataclass(frozen=True)
class PageSection:
    """One section of the page."""

    #: Anchor of the section in the page.
    identifier: str
    #: Heading of the section.
    title: str
    #: File in ``report/templates`` that uses ``values`` by their names.
    template: str
    #: Values for the template.
    values: Mapping[str, Any]
    #: ``live``: shown if scripts run, not printed; ``still``: printed, and shown if scripts do not run; "": always.
    kind: str = ""
    #: Name of the section for screen readers; "": its heading.
    label: str = ""


@cache
def environment() -> Environment:
    """Return the environment of ``report/templates``: autoescape, and an error for a missing value."""
    loader = PackageLoader("lutgen.report")
    templates = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    templates.filters["spaced"] = spaced
    templates.tests |= {
        "table": lambda part: isinstance(part, Table),
        "headline": lambda part: isinstance(part, Headline),
        "code": lambda part: isinstance(part, Code),
    }
    templates.policies["json.dumps_kwargs"] = {"ensure_ascii": False}
    return templates


def style_and_script() -> dict[str, Any]:
    """Return the page's style and scripts, imported ones first, and their hashes: the page permits only these."""
    templates = files("lutgen.report").joinpath("templates")
    own = templates.joinpath("page.js").read_text("utf-8").splitlines(keepends=True)
    script = (FOLDER / "viewer.js").read_text("utf-8") + "".join(each for each in own if not each.startswith("import "))
    style = (FOLDER / "viewer.css").read_text("utf-8") + templates.joinpath("page.css").read_text("utf-8")
    # Marks the page, before it is drawn, as a page whose scripts run.
    first = 'document.documentElement.className = "script";'
    parts = {"style": style, "script": script, "class_script": first}
    hashes = {"script_hash": _hash(script), "class_hash": _hash(first)}
    return {name: Markup(text) for name, text in parts.items()} | hashes  # noqa: S704 - files of this package


def _hash(script: str) -> str:
    return f"sha256-{b64encode(sha256(script.encode()).digest()).decode()}"


def render(template: str, **values: Any) -> str:
    """Fill a template of ``report/templates``."""
    return environment().get_template(template).render(**values)


#: Size of the drawing in its own units, and margins around the axes.
WIDTH, HEIGHT = 900, 380
LEFT, RIGHT, TOP, BOTTOM = 62, 160, 18, 52

#: Colour of each mode's line, in turn; Okabe & Ito.
COLOURS = (BLUE, RED)

#: Most ticks of an axis.
_TICKS = 7

#: Least distance between two labels of two lines at the right, and between a label and the axis.
_APART, _ABOVE_AXIS = 34.0, 18.0


def chart(lifetimes: Lifetimes) -> dict[str, Any]:
    """Return the data of ``chart.svg``: mean and mean + 2 SD of the first image's curves, to a tenth of its unit."""
    curves, last = lifetimes.images[0].curves, lifetimes.last or 1.0
    top = 1.06 * max(*(float(curve.max.max()) for curve in curves.values()), 1.2 * min(lifetimes.tolerances))

    def x(hours: float) -> float:
        return round(LEFT + (WIDTH - LEFT - RIGHT) * float(hours) / last, 1)

    def y(value: float) -> float:
        return round(TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - float(value) / top), 1)

    def corners(hours: Array, values: Array) -> list[tuple[float, float]]:
        return [(x(hour), y(value)) for hour, value in zip(hours, values, strict=True)]

    labels = _apart([y(float(curve.mean[-1])) for curve in curves.values()])
    lines = []
    for (mode, curve), colour, label in zip(curves.items(), COLOURS, labels, strict=False):
        dots, most = corners(curve.hours, curve.mean), corners(curve.hours, curve.max)
        points = {name: " ".join(f"{x},{y}" for x, y in each) for name, each in (("mean", dots), ("most", most))}
        lines.append({"mode": mode, "colour": colour, **points, "dots": dots, "label": round(label, 1)})
    return {
        "last": last,
        "levels": [(y(level), f"{level:g}") for level in ticks(top)],
        "hours": [(x(hour), spaced(hour)) for hour in ticks(last)],
        "tolerances": [(y(each), f"{each:g}") for each in lifetimes.tolerances if each < top],
        "lines": lines,
        "width": WIDTH,
        "height": HEIGHT,
        "left": LEFT,
        "right": WIDTH - RIGHT,
        "top": TOP,
        "bottom": HEIGHT - BOTTOM,
    }


def _apart(places: list[float]) -> list[float]:
    """Move labels so that they are at least ``_APART`` apart and not below the axes; their order stays."""
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
