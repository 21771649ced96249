"""``cohort``: lifetimes of many slides, and statistics over all slides. Each slide's result is stored when it is done.

The ends of the median's interval are order statistics: lifetimes of two of the slides (Conover, Practical Nonparametric
Statistics, 3rd ed., section 3.2). The only assumption is that the slides were drawn independently. A lifetime that is
never reached ranks as longer than all others.
"""

from __future__ import annotations

from contextlib import closing, nullcontext
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from itertools import product
from math import comb, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.cells import csv_text
from lutgen.errors import LutgenError
from lutgen.names import AGING_MODES
from lutgen.pictures.blocks import threads
from lutgen.pictures.cohort_slides import CohortTask, claim, find_slides, image_from_json
from lutgen.pictures.cohort_workers import on_cluster, on_this_machine
from lutgen.pictures.difference import IN_JSON, STATISTICS, DifferenceCurve
from lutgen.pictures.lifetime import TOLERANCES, Lifetimes, check_asked, csv_hours
from lutgen.progress import Progress, unseen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.colorimetry import Array
    from lutgen.display import DisplayModel

#: Confidence of the interval of a median. Fewer than six slides cannot reach this confidence, and get no interval.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Lives:
    """Statistics of the lifetimes of several slides, in hours; None for a lifetime beyond the last hour."""

    #: The median; of an even number of slides the mean of the middle two, None if one of the two is never reached.
    median: float | None
    #: 95 % interval of the median; an end that is never reached is None. None for fewer than six slides.
    interval: tuple[float | None, float | None] | None
    #: The shortest and the longest.
    range: tuple[float | None, float | None]
    #: How many slides reach the tolerance.
    reached: int


def lives_of(lives: Sequence[float | None]) -> Lives:
    """Return median, interval and range of the lifetimes of at least one slide."""
    ordered = sorted(inf if life is None else life for life in lives)
    size, half = len(ordered), len(ordered) // 2
    median = ordered[half] if size % 2 else (ordered[half - 1] + ordered[half]) / 2.0
    outside = left_out(size)
    interval = None if outside is None else (_finite(ordered[outside]), _finite(ordered[-1 - outside]))
    reached = sum(life is not None for life in lives)
    return Lives(_finite(median), interval, (_finite(ordered[0]), _finite(ordered[-1])), reached)


def left_out(size: int) -> int | None:
    """Return how many of ``size`` values lie beyond each end of the median's 95 % interval; None: no interval."""
    from scipy.stats import binom

    outside = int(binom.ppf((1.0 - CONFIDENCE) / 2.0, size, 0.5)) - 1
    return outside if outside >= 0 else None


def coverage(size: int) -> float | None:
    """Return the chance, at least 95 %, that the interval of ``size`` slides holds the median; None: no interval."""
    outside = left_out(size)
    if outside is None:
        return None
    return float(1.0 - 2 * sum(comb(size, k) for k in range(outside + 1)) / 2**size)


def bands_of(curves: Sequence[DifferenceCurve]) -> dict[str, dict[str, Array]]:
    """Return statistic → median, low and high of the curves of at least one slide, at each hour, (h,)."""
    values = {name: np.array([getattr(curve, name) for curve in curves]) for name in STATISTICS}
    return {
        name: {"median": np.median(each, axis=0), "low": each.min(axis=0), "high": each.max(axis=0)}
        for name, each in values.items()
    }


def _finite(hours: float) -> float | None:
    return None if hours == inf else hours


@dataclass(frozen=True)
class BrokenSlide:
    """A slide without a result, and the reason in one or two sentences."""

    file: str
    reason: str


@dataclass(frozen=True)
class Cohort:
    """The result of :func:`cohort`."""

    #: The slides with a result, in the order given; may be empty.
    slides: Lifetimes
    #: The slides without a result.
    broken: tuple[BrokenSlide, ...]
    #: The modes of every slide.
    modes: tuple[str, ...]
    #: How many results come from an earlier run.
    kept: int
    #: Folder that holds the results of all slides.
    folder: Path

    @cached_property
    def lives(self) -> dict[str, dict[float, dict[str, Lives]]]:
        """Statistics of lifetimes over all slides, by mode, tolerance and statistic; empty if no slide has a result."""
        images = self.slides.images
        return {
            mode: {
                tolerance: {
                    name: lives_of([image.curves[mode].hours_until(name, tolerance) for image in images])
                    for name in STATISTICS
                }
                for tolerance in self.slides.tolerances
            }
            for mode in (self.modes if images else ())
        }

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` writes: see ``lutgen/pictures/schema/cohort.json``."""
        content = self.slides.as_json()
        return {
            **{key: value for key, value in content.items() if key != "images"},
            "over_all": {
                "slides": len(self.slides.images),
                "coverage": coverage(len(self.slides.images)),
                "modes": {mode: self._over_all(mode) for mode in self.lives},
            },
            "broken": list(map(asdict, self.broken)),
            "slides": content["images"],
        }

    def _over_all(self, mode: str) -> dict[str, Any]:
        curves = [image.curves[mode] for image in self.slides.images]
        bands = bands_of(curves)
        points = []
        for place, hours in enumerate(curves[0].hours):
            at = {
                IN_JSON[name]: {key: float(values[place]) for key, values in band.items()}
                for name, band in bands.items()
            }
            points.append({"hours": float(hours), **at})
        lifetimes = {
            f"{tolerance:g}": {name: asdict(lives) for name, lives in of.items()}
            for tolerance, of in self.lives[mode].items()
        }
        return {"lifetimes": lifetimes, "curve": points}

    def as_csv(self) -> str:
        """Return what ``--csv`` writes: a line for each slide and mode, then each mode's median and interval ends."""
        head, *lines = self.slides.csv_rows()
        rows = [["row", *head], *(["slide", *line] for line in lines)]
        columns = list(product(self.slides.tolerances, STATISTICS))
        rows += [["broken", each.file, *[""] * (1 + len(columns))] for each in self.broken]
        for mode, of in self.lives.items():
            all_lives = [of[tolerance][name] for tolerance, name in columns]
            ends = [each.interval or (None, None) for each in all_lives]
            for row, values in (
                ("median", [each.median for each in all_lives]),
                ("low", [low for low, _ in ends]),
                ("high", [high for _, high in ends]),
            ):
                if row == "median" or all_lives[0].interval:
                    rows.append([row, "", mode, *map(csv_hours, values)])
        return csv_text(rows)


def cohort(
    slides: Sequence[str | Path],
    model: DisplayModel,
    output: str | Path,
    *,
    tolerances: Sequence[float] = TOLERANCES,
    modes: Sequence[str] = AGING_MODES,
    hours: Sequence[float] | None = None,
    tissue: bool = False,
    source: str = "auto",
    jobs: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress = unseen,
) -> Cohort:
    """Compute the lifetimes of many slides, and statistics over all slides.

    Each slide's result is written into the folder ``output`` as soon as it is computed. A second run with the same
    model and options computes only slides that are new, have changed (by size or time), or had no result.

    Parameters
    ----------
    slides
        Slides and images, folders of slides and images, or lists (.txt) with one path per line.
    model, tolerances, modes, hours, tissue, source
        As :func:`lutgen.lifetime` takes them.
    output
        The run's folder.
    jobs
        Number of processes on this machine, each with up to 0.5 GB of memory; default: one for each core.
    scheduler
        Address of a Dask scheduler, ``tcp://host:8786``, to compute on a cluster instead. Its workers must see the
        slides under the same paths.
    force
        Replace a run in ``output`` that has another model or other options. Files that lutgen did not write stay.
    progress
        Called with the slides done and all slides.

    Raises
    ------
    LutgenError
        No slide is given, a given path does not exist, options are wrong as for ``lifetime``, the folder cannot be
        used, or no scheduler answers. A slide that cannot be read is no error: the result names it.

    """
    if jobs is not None and scheduler is not None:
        raise LutgenError("jobs are processes of this machine, and a scheduler has its own. Leave one of them out.")
    checked, chosen = check_asked(model, tolerances=tolerances, modes=modes, hours=hours, source=source)
    modes = tuple(dict.fromkeys(modes))
    options = {"tolerances": list(checked), "modes": list(modes), "hours": chosen, "tissue": tissue, "source": source}
    task = CohortTask(model, options)
    all_slides = find_slides(slides)
    folder = claim(Path(output), task, force=force)
    images = {slide: earlier for slide in all_slides if (earlier := folder.kept(slide, checked))}
    kept = len(images)
    progress(kept, len(all_slides))
    broken = {}
    missing = [slide for slide in all_slides if slide not in images]
    here = nullcontext(partial(on_this_machine, jobs=min(jobs or threads(), len(missing))))
    with on_cluster(scheduler) if scheduler and missing else here as compute:
        folder.begin()
        with closing(compute(task.anywhere(), missing)) as outcomes:
            for slide, outcome in outcomes:
                if outcome.image is None:
                    broken[slide] = BrokenSlide(slide.name, outcome.reason)
                else:
                    image = outcome.image | {"file": slide.name}
                    folder.keep(slide, image)
                    images[slide] = image_from_json(image, slide.name, checked)
                progress(len(images) + len(broken), len(all_slides))
    in_order = tuple(images[slide] for slide in all_slides if slide in images)
    named = tuple(broken[slide] for slide in all_slides if slide in broken)
    return Cohort(Lifetimes(in_order, checked, model), named, modes, kept, Path(output))
