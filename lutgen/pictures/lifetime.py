"""``lifetime``: ΔE2000 of pictures as a display ages, and the hours until ΔE2000 reaches a tolerance.

This is the paper's simulation (Avanaki et al., section 3, Figure 5 and Table 1) for any image: ΔE2000 between the
picture on the un-aged and on the aged display, over all pixels, against operating hours. Every number is computed from
the image's distinct colours. So a slide is read once, and hours and modes cost the same for a thumbnail and for a
slide.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from math import ceil, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.cells import csv_text
from lutgen.display import DisplayModel, seen_on, what_pictures_carry
from lutgen.display.tips import MAX_HOURS
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.names import AGING_MODES, SOURCES
from lutgen.pictures.difference import (
    IN_JSON,
    STATISTICS,
    DifferenceCurve,
    Intervals,
    curves_of,
    differences,
    intervals,
)
from lutgen.pictures.distinct import Colours, Tissue, count_colours, tissue_only
from lutgen.progress import Progress, part_of, unseen

if TYPE_CHECKING:
    from collections.abc import Sequence


#: The paper's tolerances of ΔE2000: just noticeable side by side, and clearly seen.
TOLERANCES = (3.0, 5.0)

#: Columns of the paper's Table 1: tolerated ΔE2000, and the statistic of ``STATISTICS`` that reaches it.
TABLE_1_COLUMNS = ((3.0, "max"), (3.0, "mean"), (5.0, "max"), (5.0, "mean"))

#: Table 1 (section 3.1): aging mode → hours until each of ``TABLE_1_COLUMNS``. Its images were never published.
TABLE_1 = {"chroma": (4500, 7800, 8100, 11_100), "chroma-luma": (2200, 3700, 4100, 5800)}

#: Most measured hours that are added to a curve. Gaps between hours are divided into parts of at most 1/``_PARTS`` of
#: the span. A lifetime then differs by only some hours from that of a curve with a point every 100 h.
_MEASURED, _PARTS = 64, 20

#: Number of bins whose corners are compared with their centres.
_PROBES = 1024


@dataclass(frozen=True)
class ImageLifetime:
    """The lifetimes of one image: ΔE2000 against hours in each mode."""

    file: str
    #: Number of counted pixels, and of their distinct colours.
    pixels: int
    colours: int
    #: Bits per channel in which colours are distinguished.
    bits: int
    #: Largest error of a pixel's ΔE2000 because colours were counted in bins, at any hour, estimated at the corners of
    #: many bins; 0 if colours were counted exactly.
    binning_error: float
    #: The bare glass that was left out; None if glass was not looked for.
    tissue: Tissue | None
    #: Mode → curve.
    curves: dict[str, DifferenceCurve]
    #: 95 % intervals of lifetimes; None if the model states no uncertainty.
    intervals: Intervals | None


@dataclass(frozen=True)
class Lifetimes:
    """The result of :func:`lifetime`."""

    images: tuple[ImageLifetime, ...]
    #: Tolerated ΔE2000, in the order given.
    tolerances: tuple[float, ...]
    #: The display.
    model: DisplayModel

    @property
    def modes(self) -> tuple[str, ...]:
        """The modes of every image."""
        return tuple(self.images[0].curves)

    @property
    def last(self) -> float:
        """The last hour of the curves."""
        return float(self.images[0].curves[self.modes[0]].hours[-1])

    def remarks(self) -> list[str]:
        """Return sentences on the viewing conditions of the display; none where the model depends on none."""
        return what_pictures_carry(self.model)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: see ``lutgen/pictures/schema/lifetime.json``."""
        return {"schema": 1, **seen_on(self.model), "images": [self._image(image) for image in self.images]}

    def as_csv(self) -> str:
        """Return what ``--csv`` writes: hours as in Table 1, a line for each image and mode; empty if never reached."""
        return csv_text(self.csv_rows())

    def csv_rows(self) -> list[list[str]]:
        """Return the rows of :meth:`as_csv`, the first of which names the columns."""
        columns = list(product(self.tolerances, STATISTICS))
        rows = [["file", "mode", *(f"{statistic}_{tolerance:g}" for tolerance, statistic in columns)]]
        for image in self.images:
            for mode, curve in image.curves.items():
                lives = [curve.hours_until(statistic, tolerance) for tolerance, statistic in columns]
                rows.append([image.file, mode, *map(csv_hours, lives)])
        return rows

    def _image(self, image: ImageLifetime) -> dict[str, Any]:
        tissue, modes = None, {}
        if image.tissue is not None:
            tissue = {"threshold_L": image.tissue.threshold, "left_out_share": image.tissue.left_out_share}
        for mode, curve in image.curves.items():
            lifetimes = {}
            for tolerance in self.tolerances:
                lives = {name: curve.hours_until(name, tolerance) for name in STATISTICS}
                interval = image.intervals and image.intervals[mode][tolerance]
                lifetimes[f"{tolerance:g}"] = {**lives, "interval": interval}
            modes[mode] = {"lifetimes": lifetimes, "curve": _points(curve)}
        counted = {name: getattr(image, name) for name in ("file", "pixels", "colours", "bits", "binning_error")}
        return {**counted, "tissue": tissue, "modes": modes}


def csv_hours(hours: float | None) -> str:
    """Return hours as text for CSV; empty where a tolerance is never reached."""
    return "" if hours is None else f"{hours:.1f}"


def _points(curve: DifferenceCurve) -> list[dict[str, float]]:
    columns = {key: getattr(curve, name) for name, key in IN_JSON.items()}
    return [dict(zip(columns, map(float, values), strict=True)) for values in zip(*columns.values(), strict=True)]


def lifetime(
    images: Sequence[str | Path],
    model: DisplayModel,
    *,
    tolerances: Sequence[float] = TOLERANCES,
    modes: Sequence[str] = AGING_MODES,
    hours: Sequence[float] | None = None,
    tissue: bool = False,
    source: str = "auto",
    progress: Progress = unseen,
) -> Lifetimes:
    """Compute ΔE2000 against hours for images, and the hours until ΔE2000 reaches each tolerance.

    Parameters
    ----------
    images
        PNG, JPEG, TIFF or EXR, RGB or RGBA; slides (.svs, .ndpi, .mrxs) with the extra ``slides``.
    model
        The display.
    tolerances
        Tolerated ΔE2000, above 0.
    modes
        Aging modes.
    hours
        Operating hours; None: every measured time. Hour 0 is added, since lifetimes begin there. Measured hours up to
        the last hour are added too, and hours between measured ones that are far apart: the curve is linear between its
        hours, and lifetimes must not depend on which hours were given.
    tissue
        Leave bare glass out.
    source
        Encoding of an image's numbers: ``auto``, ``signal`` or ``linear``, as for ``apply``.
    progress
        Called with the work done and the whole work, in thousandths of an image.

    Raises
    ------
    LutgenError
        No image is given, an image cannot be read, an image has no tissue while ``tissue`` is set, the source is
        unknown, a tolerance is not above 0, or hours are outside the span of the measurements or of the luminance law.

    """
    if not images:
        raise LutgenError("no image was given. Give at least one.")
    checked, chosen = check_asked(model, tolerances=tolerances, modes=modes, hours=hours, source=source)
    lifetimes = []
    for done, image in enumerate(images):
        start, everything = 1000 * done, 1000 * len(images)
        path = Path(image)
        colours = count_colours(path, source, part_of(progress, start, 500, everything))
        colours, kept = tissue_only(colours, path) if tissue else (colours, None)
        curves = curves_of(colours, model, modes, chosen, part_of(progress, start + 500, 300, everything))
        lifetimes.append(
            ImageLifetime(
                file=str(image),
                pixels=colours.pixels,
                colours=len(colours),
                bits=colours.bits,
                binning_error=binning_error(colours, model, modes, chosen),
                tissue=kept,
                curves=curves,
                intervals=intervals(colours, model, curves, checked, part_of(progress, start + 800, 200, everything)),
            )
        )
        progress(start + 1000, everything)
    return Lifetimes(tuple(lifetimes), checked, model)


def check_asked(
    model: DisplayModel,
    *,
    tolerances: Sequence[float],
    modes: Sequence[str],
    hours: Sequence[float] | None,
    source: str,
) -> tuple[tuple[float, ...], list[float]]:
    """Return the tolerances, and the curve's hours in order from 0 on; errors as in :func:`lifetime`."""
    refuse_unknown("source", source, SOURCES)
    checked = check_tolerances(tolerances)
    return checked, curve_hours(model, hours_from_0(model, modes, hours))


def curve_hours(model: DisplayModel, chosen: Sequence[float]) -> list[float]:
    """Return the hours of a curve: the chosen ones, in order, and those between which the curve is nearly linear."""
    return sorted({*chosen, *(hour for hour in _bends(model) if hour < chosen[-1])})


def _bends(model: DisplayModel) -> list[float]:
    """Return hours between which ΔE2000 is nearly linear in time: those of the readings and of the luminance law."""
    measured = model.tips.hours if model.tips.hours.size <= _MEASURED else model.tips.spread(_MEASURED)
    first, last = float(model.tips.hours[0]), float(model.tips.hours[-1])
    law = (hour for hour, _ in model.luminance.table if first < hour < last)
    knots = sorted({*map(float, measured), *law})
    parts = (max(ceil((after - before) * _PARTS / (last - first)), 1) for before, after in pairwise(knots))
    between = (np.linspace(*ends, count, endpoint=False) for ends, count in zip(pairwise(knots), parts, strict=True))
    return [*(float(hour) for hours in between for hour in hours), last]


def hours_from_0(model: DisplayModel, modes: Sequence[str], hours: Sequence[float] | None) -> list[float]:
    """Return hour 0 and ``hours`` (None: all measured times) in order; errors as in :func:`lifetime`."""
    chosen = sorted({0.0, *map(float, model.tips.hours if hours is None else hours)})
    if len(chosen) > MAX_HOURS:
        raise LutgenError(f"{len(chosen)} hours are more than {MAX_HOURS}. Give fewer.")
    for mode, hour in product(modes, chosen):
        model.at(mode, hour)
    return chosen


def check_tolerances(tolerances: Sequence[float]) -> tuple[float, ...]:
    """Return the distinct tolerances in the order given. Raises LutgenError for none, or a tolerance not above 0."""
    if not tolerances:
        raise LutgenError("no tolerance was given. Give colour differences above 0, such as 3,5.")
    for tolerance in tolerances:
        if not (isfinite(tolerance) and tolerance > 0):
            raise LutgenError(
                f"tolerance {tolerance:g}: a tolerated ΔE2000 is a finite number above 0, such as 3 or 5."
            )
    return tuple(dict.fromkeys(map(float, tolerances)))


def binning_error(colours: Colours, model: DisplayModel, modes: Sequence[str], hours: Sequence[float]) -> float:
    """Return the largest change of ΔE2000 from the centre of a bin to its corners, over many bins, modes and hours."""
    if not colours.half_bin:
        return 0.0
    which = np.unique(np.linspace(0, len(colours) - 1, _PROBES).astype(np.intp))
    middle = np.concatenate([colours.code(slice(place, place + 1)) for place in which])
    corners = np.array(list(product((-1.0, 0.0, 1.0), repeat=3))) * colours.half_bin
    code = np.clip(middle[:, np.newaxis] + corners, 0.0, 1.0).reshape(-1, 3)
    displays = [model.at(mode, hour) for mode in modes for hour in hours]
    change = differences(code.__getitem__, len(code), model.at("stable", 0.0), displays)
    change = change.reshape(len(displays), len(which), len(corners))
    return float(np.abs(change - change[..., len(corners) // 2, np.newaxis]).max())
