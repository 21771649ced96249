"""The pages and the picture of ``lutgen lifetime``, ``table`` and ``cohort``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.cells import csv_text
from lutgen.display import seen_on
from lutgen.numerals import in_percent, pixels_of_colours, spaced
from lutgen.pictures.cohort import Cohort, Lives, coverage
from lutgen.pictures.lifetime import TABLE_1, TABLE_1_COLUMNS, ImageLifetime, Lifetimes, csv_hours
from lutgen.report.drawing import BLACK, BLUE, GREY, RED, hour_axis, named_once, picture, tidy
from lutgen.report.parts import Headline, Part, Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from matplotlib.axes import Axes

    from lutgen.pictures.difference import DifferenceCurve

#: The columns of Table 1 for each tolerance: statistic and its name in the paper.
COLUMNS = {"max": "Max", "mean": "Avg"}

#: Days of a mean month.
MONTH = 365.25 / 12.0


def lifetime_page(lifetimes: Lifetimes, hours_per_day: float | None = None) -> Iterator[Part]:
    """Yield what ``lutgen lifetime`` prints; with ``hours_per_day`` of use also the months of use."""
    yield lifetimes.model.luminance.sentence()
    for image in lifetimes.images:
        yield Headline(counted(image))
        yield life_table(lifetimes, image, hours_per_day)
        yield ""
    columns, curves = _columns(lifetimes.tolerances), [image.curves.values() for image in lifetimes.images]
    some_never = any(None in _lives(curve, columns) for each in curves for curve in each)
    never = f" –: not within the {spaced(lifetimes.last)} h looked at." if some_never else ""
    known = lifetimes.images[0].intervals is not None
    within = " Below: 95 % intervals from the model's own uncertainty." if known else ""
    yield f"{_UNTIL}{never}{within}"
    if hours_per_day:
        yield f"Months: of {MONTH:.1f} days with {hours_per_day:g} h each."
    yield lifetimes.model.measurements.provenance
    yield from lifetimes.remarks()


#: Meaning of the figures in tables of hours.
_UNTIL = (
    "Hours until the ΔE2000 between the un-aged and the aged display reaches a tolerance. Avg: mean over all pixels; "
    "Max: mean + 2 SD, as in the paper."
)


def _columns(tolerances: Sequence[float]) -> list[tuple[float, str]]:
    return [(tolerance, statistic) for tolerance in tolerances for statistic in COLUMNS]


def _heads(columns: Iterable[tuple[float, str]]) -> list[str]:
    return [f"{COLUMNS[statistic]} ΔE2000 {tolerance:g}" for tolerance, statistic in columns]


def _lives(curve: DifferenceCurve, columns: Iterable[tuple[float, str]]) -> list[float | None]:
    return [curve.hours_until(statistic, tolerance) for tolerance, statistic in columns]


def counted(image: ImageLifetime) -> str:
    """Return a sentence with the number of pixels, of colours, and of pixels left out."""
    sentence = f"{Path(image.file).name}: {pixels_of_colours(image.pixels, image.colours)}"
    if image.binning_error:
        sentence += f" ({image.bits} bits per channel: ΔE2000 of a pixel to ± {image.binning_error:.1g})"
    if image.tissue is None:
        return f"{sentence}."
    if image.tissue.threshold is None:
        return f"{sentence}; no bare glass was found, nothing was left out."
    share, threshold = image.tissue.left_out_share, image.tissue.threshold
    return f"{sentence}; {in_percent(share, 1)} left out as bare glass, L* of {threshold:.1f} and more."


def life_table(lifetimes: Lifetimes, image: ImageLifetime, hours_per_day: float | None = None) -> Table:
    """Return Table 1: for each mode the hours, and months of use, until Max and Avg reach each tolerance."""
    columns, rows = _columns(lifetimes.tolerances), []
    for mode, curve in image.curves.items():
        cells = []
        for (tolerance, statistic), life in zip(columns, _lives(curve, columns), strict=True):
            cell = hours_or_never(life)
            if hours_per_day and life is not None:
                cell += f"\n{life / (hours_per_day * MONTH):.1f} months"
            if image.intervals:
                low, high = map(hours_or_never, image.intervals[mode][tolerance][statistic])
                cell += f"\n{low} to {high}" if (low, high) != ("–", "–") else ""
            cells.append(cell)
        rows.append((mode, *cells))
    return Table(("hours until", *_heads(columns)), rows, unbroken=True)


def hours_or_never(hours: float | None) -> str:
    """Return hours as text, rounded to an hour; a dash for never."""
    return "–" if hours is None else spaced(round(hours))


#: Colour of each statistic of Table 1: mean, and mean + 2 SD.
COLOURS = {"mean": BLUE, "max": RED}

#: Height in inches of a bar that shows the hours until a tolerance is reached.
_ROW = 0.27


def picture_names(images: Sequence[str]) -> list[str]:
    """Return the name of each image's picture. Raises LutgenError if two names are equal."""
    return named_once([f"lifetime-{Path(image).stem}.png" for image in images], "images")


def plot_lifetimes(lifetimes: Lifetimes, folder: str | Path, *, force: bool = False) -> list[Path]:
    """Draw a picture for each image into a folder, the same bytes on every run. Errors as :func:`picture_names`."""
    paths = [Path(folder) / name for name in picture_names([image.file for image in lifetimes.images])]
    for image, path in zip(lifetimes.images, paths, strict=True):
        plot_lifetime(lifetimes, image, path, force=force)
    return paths


def plot_lifetime(lifetimes: Lifetimes, image: ImageLifetime, path: Path, *, force: bool = False) -> None:
    """Draw one image's picture, the same bytes on every run."""
    foot = (
        "Dots: mean over all pixels; bars: ± 2 standard deviations, not below 0 (the paper's Figure 5). Dashed: "
        "tolerances; rings: where mean (Avg) and mean + 2 SD (Max) reach them, and below the hours until then"
        f"{', with 95 % intervals from the uncertainty of the model' if image.intervals else ''}. "
    )
    height = 7.6 + _ROW * 2 * len(lifetimes.tolerances)
    title, full_foot = title_of(lifetimes, image), foot + lifetimes.model.measurements.provenance
    with picture(path, title, second=counted(image), foot=full_foot, height=height, force=force) as (figure, low, high):
        top = max(float(np.maximum(curve.max, curve.p99).max()) for curve in image.curves.values())
        # Space for labels above the highest curve.
        top = 1.12 * max(top, 1.2 * min(lifetimes.tolerances))
        width, strip = 0.92 / len(image.curves), _ROW * 2 * len(lifetimes.tolerances) / height
        bottom = low + 0.6 / height
        for number, (mode, curve) in enumerate(image.curves.items()):
            left, across = 0.05 + number * width, width - 0.04
            lives = figure.add_axes((left, bottom, across, strip))
            above = bottom + strip + 0.12 / height
            axes = figure.add_axes((left, above, across, high - above - 0.45 / height), sharex=lives)
            draw_curve(axes, curve, lifetimes.tolerances, top)
            draw_lives(lives, lifetimes, image, mode)
            axes.set_title(mode, fontsize=13, weight="bold", loc="left")
            if number == 0:
                axes.set_ylabel("ΔE2000, un-aged against aged", fontsize=11)


def title_of(lifetimes: Lifetimes, image: ImageLifetime) -> str:
    """Return the title: when the mean reaches the first tolerance in each mode."""
    tolerance, never = min(lifetimes.tolerances), f"not by {spaced(lifetimes.last)} h"
    lives = {mode: curve.hours_until("mean", tolerance) for mode, curve in image.curves.items()}
    parts = [f"{mode} {never if life is None else f'at {spaced(round(life))} h'}" for mode, life in lives.items()]
    return f"The mean ΔE2000 reaches {tolerance:g}: {', '.join(parts)}"


def draw_curve(axes: Axes, curve: DifferenceCurve, tolerances: Sequence[float], top: float) -> None:
    """Draw the curve of one mode, as in the paper's Figure 5."""
    hours = curve.hours
    for values, line, share in ((curve.p99, ":", 99), (curve.p95, "-", 95)):
        axes.plot(hours, values, line, color=GREY, linewidth=1.0, label=f"{share} % of the pixels are below")
    below = np.minimum(2.0 * curve.sd, curve.mean)
    axes.errorbar(
        hours, curve.mean, yerr=(below, 2.0 * curve.sd), fmt="o-", color=BLUE, ecolor=RED, elinewidth=1.1, capsize=3,
        markersize=5, linewidth=1.8, label="mean ± 2 SD", zorder=3,
    )  # fmt: skip
    axes.set_ylim(0.0, top)
    axes.tick_params(labelbottom=False)
    tidy(axes)
    for tolerance in (each for each in tolerances if each < top):
        axes.axhline(tolerance, color=BLACK, linewidth=1.0, linestyle="--", zorder=1)
        axes.text(0.01, tolerance + 0.004 * top, f"ΔE2000 {tolerance:g}", ha="left", va="bottom", fontsize=10,
                  transform=axes.get_yaxis_transform())  # fmt: skip
        for statistic, colour in COLOURS.items():
            when = curve.hours_until(statistic, tolerance)
            if when is not None:
                axes.vlines(when, 0.0, tolerance, color=colour, linewidth=1.0, zorder=1)
                axes.plot(when, tolerance, "o", markersize=9, markerfacecolor="white", markeredgecolor=colour,
                          markeredgewidth=2.0, zorder=5)  # fmt: skip
    axes.legend(loc="upper left", frameon=False, fontsize=10)


def draw_lives(axes: Axes, lifetimes: Lifetimes, image: ImageLifetime, mode: str) -> None:
    """Draw one mode's row of Table 1: a bar from hour 0 until each tolerance is reached."""
    curve, last = image.curves[mode], lifetimes.last
    rows = _columns(lifetimes.tolerances)
    axes.set(xlim=(-0.02 * last, 1.02 * last), ylim=(len(rows) - 0.4, -0.6))
    for row, (tolerance, statistic) in enumerate(rows):
        when, colour = curve.hours_until(statistic, tolerance), COLOURS[statistic]
        axes.barh(row, last if when is None else when, 0.66, color=colour, alpha=0.25 if when is None else 0.85)
        text, end = f"not within {spaced(last)} h" if when is None else f"{spaced(round(when))} h", when or 0.0
        if image.intervals:
            low, high = (last if each is None else each for each in image.intervals[mode][tolerance][statistic])
            axes.hlines(row, low, high, color=BLACK, linewidth=2.5)
            end = max(end, high) if when is not None else end
        place, side, shade = 0.005 * last if when is None else end + 0.01 * last, "left", BLACK
        if end > 0.8 * last:
            place, side, shade = min(when or end, end) - 0.02 * last, "right", "white"
        axes.text(place, row, text, ha=side, va="center", fontsize=10, color=shade)
    axes.set_yticks(range(len(rows)), [f"{COLUMNS[name]} {tolerance:g}" for tolerance, name in rows], fontsize=10)
    axes.set_xlabel("operating hours", fontsize=11)
    hour_axis(axes)
    tidy(axes, grid="x")


def table_1_page(lifetimes: Lifetimes) -> Iterator[Part]:
    """Yield what ``lutgen table 1`` prints; ``lifetimes`` has the tolerances and modes of the paper."""
    never = any(row["hours"] is None for row in table_1_json(lifetimes)["rows"])
    for image in lifetimes.images:
        yield Headline(counted(image))
        yield _comparison_with_paper(image)
        yield ""
    yield (
        "Hours until the ΔE2000 between the un-aged and the aged display reaches 3 and 5; below: against the paper's. "
        "Avg: mean over all pixels; Max: mean + 2 SD. The paper's picture (its Figure 2) was never published: other "
        "pictures are expected to differ."
        f"{f' –: not within {spaced(lifetimes.last)} h.' if never else ''}"
    )
    yield lifetimes.model.measurements.provenance
    yield from lifetimes.remarks()


def table_1_json(lifetimes: Lifetimes) -> dict[str, Any]:
    """Return what ``--json`` writes: see ``lutgen/pictures/schema/table.json``."""
    return {
        "schema": 1,
        "table": 1,
        **seen_on(lifetimes.model),
        "rows": [
            {
                "file": image.file,
                "mode": mode,
                "tolerance": tolerance,
                "statistic": statistic,
                "hours": hours,
                "paper": paper,
                "difference": difference(hours, paper),
            }
            for image in lifetimes.images
            for mode in TABLE_1
            for (tolerance, statistic), hours, paper in _cells(image, mode)
        ],
    }


def table_1_csv(lifetimes: Lifetimes) -> str:
    """Return what ``--csv`` writes: a line for each cell; hours and difference are empty if never reached."""
    rows = [["file", "mode", "tolerance", "statistic", "hours", "paper_hours", "difference_percent"]]
    for row in table_1_json(lifetimes)["rows"]:
        off = "" if row["difference"] is None else f"{100.0 * row['difference']:.2f}"
        cell = [row["file"], row["mode"], f"{row['tolerance']:g}", row["statistic"]]
        rows.append([*cell, csv_hours(row["hours"]), row["paper"], off])
    return csv_text(rows)


def difference(hours: float | None, paper: float) -> float | None:
    """Return the relative difference of hours from the paper's hours; None if the tolerance is never reached."""
    return None if hours is None else hours / paper - 1.0


def _comparison_with_paper(image: ImageLifetime) -> Table:
    rows = []
    for mode, published in TABLE_1.items():
        rows.append([f"{mode}, the paper", *map(spaced, published)])
        cells = []
        for _, hours, paper in _cells(image, mode):
            off = difference(hours, paper)
            cells.append(hours_or_never(hours) + ("" if off is None else f"\n{100.0 * off:+.1f} %"))
        rows.append([f"{mode}, {Path(image.file).name}", *cells])
    return Table(("hours until", *_heads(TABLE_1_COLUMNS)), rows, unbroken=True)


def _cells(image: ImageLifetime, mode: str) -> Iterator[tuple[tuple[float, str], float | None, int]]:
    """Yield for each column the hours until its tolerance is reached, and the paper's hours."""
    yield from zip(TABLE_1_COLUMNS, _lives(image.curves[mode], TABLE_1_COLUMNS), TABLE_1[mode], strict=True)


def cohort_page(cohort: Cohort) -> Iterator[Part]:
    """Yield what ``lutgen cohort`` prints."""
    yield slides_counted(cohort)
    yield ""
    if cohort.lives:
        for mode in cohort.modes:
            yield mode_table(cohort, mode)
            yield ""
        yield explained(cohort)
        yield cohort.slides.model.measurements.provenance
        yield from cohort.slides.remarks()
    for each in cohort.broken:
        yield Headline(f"Broken: {each.file}: {each.reason}")


def slides_counted(cohort: Cohort) -> str:
    """Return a sentence on the number of slides: read, kept from an earlier run, and broken."""
    done, broken = len(cohort.slides.images), len(cohort.broken)
    sentence = f"{_slides(done)} in {cohort.folder}"
    if cohort.kept:
        sentence += f", {cohort.kept} of them from an earlier run"
    if not broken:
        return f"{sentence}."
    return (
        f"{sentence}; {_slides(broken)} broken, named below and left out of all figures. The same command tries again."
    )


def mode_table(cohort: Cohort, mode: str) -> Table:
    """Return a table of the hours until Max and Avg reach each tolerance, by slide, with median and its interval."""
    columns, images = _columns(cohort.slides.tolerances), cohort.slides.images
    rows = [(image.file, *map(hours_or_never, _lives(image.curves[mode], columns))) for image in images]
    over_all = [cohort.lives[mode][tolerance][statistic] for tolerance, statistic in columns]
    rows.append((f"median of {_slides(len(images))}", *(hours_or_never(lives.median) for lives in over_all)))
    rows.append(("95 % interval" if over_all[0].interval else "range", *map(ends, over_all)))
    return Table((f"{mode}: hours until", *_heads(columns)), rows, strong=[len(rows) - 2])


def ends(lives: Lives) -> str:
    """Return the interval of the median as text, or the range of the slides if they are too few for an interval."""
    low, high = map(hours_or_never, lives.interval or lives.range)
    return f"{low} to {high}"


def explained(cohort: Cohort) -> str:
    """Return sentences on the meaning of the tables' figures, and on what the interval does not include."""
    size, sentence = len(cohort.slides.images), _UNTIL
    if any(lives.reached < size for of in cohort.lives.values() for by in of.values() for lives in by.values()):
        sentence += (
            f" –: not within the {spaced(cohort.slides.last)} h looked at; in medians such a slide is the longest."
        )
    chance = coverage(size)
    if chance is None:
        return f"{sentence} Fewer than six slides give no 95 % interval of a median."
    return (
        f"{sentence} The interval holds the median of all slides like these with {in_percent(chance, 1)}, if they were "
        f"drawn independently; it does not include the model's own uncertainty."
    )


def _slides(count: int) -> str:
    return f"{count} slide{'' if count == 1 else 's'}"
