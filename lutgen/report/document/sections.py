"""The sections of a report about the picture: the finding, the viewer, the curves with Table 1, and all frames."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.numerals import spaced
from lutgen.report.document.chart import chart
from lutgen.report.document.markup import printed
from lutgen.report.document.png import data_uri, png
from lutgen.report.document.scenes import REACH, map_colours
from lutgen.report.parts import Table
from lutgen.report.pictures.lifetime import lifetime_page

if TYPE_CHECKING:
    from lutgen.appearance.lifetime import Lifetimes
    from lutgen.report.document.scenes import Numbers, Scene, Scenes

#: Mode → how the finding puts it.
SAID = {
    "chroma": "while a sensor holds the luminance (chroma)",
    "chroma-luma": "when the luminance falls as well (chroma-luma)",
}

#: Numbers that are shown beside the picture: key → name.
TILES = {
    "mean": "mean ΔE2000",
    "sd": "SD",
    "p95": "95 % are below",
    "max": "largest ΔE2000",
    "white": "white x, y",
    "luminance": "white's luminance",
}

#: ΔE2000 at which the bar of the map has a number.
_BAR = (0, 3, 5, 10, 15, 20)


def finding(found: Lifetimes) -> str:
    """Say in one sentence for how long the display is good for pictures."""
    tolerance = min(found.tolerances)
    parts = []
    for mode, curve in found.images[0].curves.items():
        hours = curve.hours_until("mean", tolerance)
        when = f"after {spaced(round(hours))} h" if hours is not None else f"not within {spaced(found.last)} h"
        parts.append(f"{when} {SAID.get(mode, f'in mode {mode}')}")
    return f"This picture has changed by a mean ΔE2000 of {tolerance:g} {', and '.join(parts)}."


def numbers_of(numbers: Numbers) -> dict[str, str]:
    """Write the numbers as people read them."""
    return {
        "mean": f"{numbers.mean:.2f}",
        "sd": f"{numbers.sd:.2f}",
        "p95": f"{numbers.p95:.2f}",
        "max": f"{numbers.max:.2f}",
        "white": f"{numbers.white_x:.4f}, {numbers.white_y:.4f}",
        "luminance": f"{100 * numbers.luminance:.1f} %",
    }


def viewer(scenes: Scenes) -> str:
    """Write the slider, the wiper and the map; a script fills them from the frames below."""
    frame, last = scenes.frame, len(scenes.hours) - 1
    radios = "".join(
        f'<label><input type="radio" name="mode" value="{escape(mode)}"{" checked" if place == 0 else ""}> '
        f"{escape(mode)}</label>"
        for place, mode in enumerate(scenes.modes)
    )
    ticks = "".join(f"<span>{spaced(hours)}</span>" for hours in scenes.hours)
    tiles = "".join(f'<div><dt>{escape(name)}</dt><dd id="number-{key}">–</dd></div>' for key, name in TILES.items())
    size = f'width="{frame.width}" height="{frame.height}"'
    return f"""<section id="viewer" class="live" aria-label="The picture on the aged display">
<h2>The picture as the display ages</h2>
<div class="controls">
<fieldset><legend>Mode</legend>{radios}</fieldset>
<div class="hours"><label for="hours">Operating hours: <output id="hours-now" for="hours">–</output></label>
<input type="range" id="hours" min="0" max="{last}" step="1" value="{last}" autocomplete="off">
<div class="ticks" aria-hidden="true">{ticks}</div></div>
</div>
<dl class="tiles" id="numbers" aria-live="polite">{tiles}</dl>
<div class="stage" style="--ratio: {frame.width / frame.height:.4f}">
<figure><div id="wipe" style="--cut: 50%">
<img id="aged" {size} alt="The picture on the aged display">
<img id="before" {size} alt="The picture on the un-aged display">
<div id="bar" aria-hidden="true"></div>
<input type="range" id="wiper" min="0" max="100" step="1" value="50" autocomplete="off"
 aria-label="How much of the picture is shown un-aged, from the left, in percent">
<span class="tag left">un-aged</span><span class="tag right">aged</span></div>
<figcaption>Left of the bar un-aged, right of it aged: drag it, or move it with the arrow keys.</figcaption></figure>
<figure><img id="map" {size} alt="Map of ΔE2000 between the un-aged and the aged picture">
{colour_bar()}
<figcaption>ΔE2000 of each pixel, un-aged against aged; the same colours at every hour and on every page.</figcaption>
</figure>
</div>
</section>"""


def colour_bar() -> str:
    """Write the bar that says what the colours of a map mean."""
    strip = data_uri(png(map_colours()[None]))
    marks = "".join(f'<span style="left: {100 * value / REACH:g}%">{value:g}</span>' for value in _BAR[:-1])
    marks += f'<span style="left: 100%">≥&#8239;{_BAR[-1]:g}</span>'
    return (
        f'<div class="bar"><img src="{strip}" width="{len(map_colours())}" height="1" '
        f'alt="Colour bar: ΔE2000 from 0, dark, to {REACH:g} and more, yellow"><div class="marks">{marks}</div></div>'
    )


def frames(scenes: Scenes) -> str:
    """Write every frame and map, and the numbers: what is printed, and seen where no script runs."""
    parts = ['<section id="frames" class="still"><h2>The picture at each hour</h2>']
    parts.append(
        f'<figure class="unaged"><img id="unaged" src="{scenes.unaged}" alt="The picture on the un-aged display">'
        f"<figcaption>Un-aged</figcaption></figure>"
    )
    parts.append(f"<p>ΔE2000 in the maps:</p>{colour_bar()}")
    for mode, each in scenes.modes.items():
        parts.append(f"<h3>{escape(mode)}: {escape(SAID.get(mode, mode).partition(' (')[0])}</h3>")
        parts.append(f'<div class="grid">{"".join(_frame(scene, scenes.unaged) for scene in each)}</div>')
    return "\n".join([*parts, "</section>"])


def _frame(scene: Scene, unaged: str) -> str:
    said, where = scene.numbers, f"{spaced(scene.numbers.hours)} h, {scene.numbers.mode}"
    key = f'data-mode="{escape(said.mode)}" data-hours="{said.hours!r}"'
    # What is as un-aged is in the page already; its map is for the script alone.
    fresh = scene.picture == unaged
    picture = f'<img {key} data-kind="picture" src="{scene.picture}" alt="The picture at {where}">'
    return (
        f"<figure{' class=live' if fresh else ''}>{'' if fresh else picture}"
        f'<img {key} data-kind="map" src="{scene.map}" alt="Map of ΔE2000 at {where}">'
        f"<figcaption>{spaced(said.hours)} h: mean {said.mean:.1f}, 95 % below {said.p95:.1f}</figcaption></figure>"
    )


def number_tables(scenes: Scenes) -> str:
    """Write the numbers of every scene as tables, a mode each."""
    tables = (
        Table(
            ("hours", *TILES.values()),
            [(spaced(each.numbers.hours), *numbers_of(each.numbers).values()) for each in made],
            words=(),
            caption=f"{mode}, at the hours shown",
        )
        for mode, made in scenes.modes.items()
    )
    return printed(tables)


def lifetimes(found: Lifetimes, scenes: Scenes) -> str:
    """Write the curves, Table 1 and the numbers of every frame."""
    # Where the readings come from is said at the end of the page.
    page = (part for part in lifetime_page(found) if part != found.model.measurements.provenance)
    return (
        '<section id="lifetimes"><h2>How long pictures stay true</h2>\n'
        f'<figure class="plot">{chart(found)}</figure>\n{printed(page)}\n'
        f'<div class="numbers">{number_tables(scenes)}</div>\n</section>'
    )


def picture_caption(found: Lifetimes, scenes: Scenes) -> str:
    """Say which image it is, and how much of it the frames show."""
    frame, name = scenes.frame, Path(found.images[0].file).name
    size = f"{spaced(frame.source_width)} × {spaced(frame.source_height)} pixels"
    if frame.whole:
        return f"{name}, {size}, shown whole."
    return f"{name}, {size}, shown at {frame.width} × {frame.height}; numbers are those of all pixels."


def data_of(scenes: Scenes) -> str:
    """Write what the script needs, and other programs may read, as JSON that is safe inside a page."""
    content = {
        "schema": 1,
        "hours": list(scenes.hours),
        "modes": {mode: [scene.as_json() for scene in made] for mode, made in scenes.modes.items()},
        "shown": {mode: [numbers_of(scene.numbers) for scene in made] for mode, made in scenes.modes.items()},
        "hour_names": [f"{spaced(hours)} h" for hours in scenes.hours],
    }
    return json.dumps(content, ensure_ascii=False).replace("<", "\\u003c")
