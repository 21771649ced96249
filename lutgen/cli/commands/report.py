from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import (
    PlaceOptions,
    image_argument,
    model_from,
    model_options,
    numbers,
    screen_options,
    source_option,
    tolerance_option,
)
from lutgen.cli.outputs import progress_bar, say
from lutgen.files import check_new_file
from lutgen.names import INSTRUMENTS

if TYPE_CHECKING:
    from lutgen.display import DisplayModel
    from lutgen.report.page import Evidence


@click.command(cls=Command, section=Section.PICTURES, place=9)
@image_argument
@click.option("--build", metavar="DIR", help="Add the certificates of a folder that lutgen build made.")
@click.option("--data", metavar="READINGS", help="Add compare, diagnose and refine of these readings (.csv).")
@tolerance_option
@click.option(
    "--hours",
    metavar="HOURS",
    help="Hours at which the slider has tables: 0..18000:2000, a step; 0,5000,10000, a list. The slider ends at the "
    "last hour [default: up to 13 measured times].",
)
@source_option
@click.option(
    "--instrument",
    metavar="NOISE",
    help=f"Noise of a reading of --data: 0.002,0.003, {', '.join(INSTRUMENTS)}, or a file (.toml) "
    "[default: from replicates].",
)
@click.option("--force", is_flag=True, help="Replace the page if it exists.")
@click.option("-o", "--output", required=True, metavar="PAGE.html", help="The page to write.")
@screen_options
@model_options
def command(
    *,
    image: str,
    build: str | None,
    data: str | None,
    tolerance: str,
    hours: str | None,
    source: str,
    instrument: str | None,
    force: bool,
    output: str,
    where: PlaceOptions,
    **options: Any,
) -> None:
    """Write one page for a browser: pictures, lifetimes, diagnosis, certificates.

    The page shows IMAGE as the display ages, with a slider over all hours and a wiper between un-aged and aged; the map
    of ΔE2000; curves; the paper's Table 1; and the source of every number. --data adds the results of compare, diagnose
    and refine; without --display or --model the pictures are then those of the measured display. --on-screen adds the
    picture at its place on the screen at the last hour: the slider's tables are LUTs, which cannot depend on the place.
    The page is one HTML file that loads nothing from a network, so you can mail and print it. The numbers are those of
    lutgen lifetime for all pixels, even if the page shows a smaller copy of a large image.

    \b
    Example:
      lutgen report slide.png -o slide.html
      lutgen report slide.png --data examples/display-a.csv --hours 0..18000:3000 -o diagnosed.html
    """
    from lutgen.pictures.frame import read_frame
    from lutgen.pictures.lifetime import check_tolerances, lifetime
    from lutgen.report.page import Run, read_build, write_report
    from lutgen.report.page_scenes import PIXELS, WIDTH, hours_of, placed_stills, scenes_of

    tolerances = check_tolerances(numbers("--tolerance", tolerance))
    check_new_file(output, force=force, suffixes=(".html", ".htm"))
    if instrument and not data:
        raise click.UsageError(
            "--instrument states the noise of --data: give --data READINGS too, or leave --instrument out."
        )
    own = any(options[name] for name in ("display", "model"))
    model = model_from(**({**options, "display": data} if data and not own else options))
    uneven, screen = where.on(model)
    built = read_build(build) if build else None
    frames, curve = hours_of(hours, model)
    with progress_bar("aging colours") as progress:
        lifetimes = lifetime([image], model, tolerances=tolerances, hours=curve, source=source, progress=progress)
    with progress_bar("reading the picture") as progress:
        frame = read_frame(Path(image), pixels=PIXELS, width=WIDTH, source=source, progress=progress)
    with progress_bar("aging the picture") as progress:
        scenes = scenes_of(frame, model, lifetimes, frames, progress)
    evidence = _evidence(data, model, options, instrument) if data else None
    placed = placed_stills(scenes, uneven, screen) if screen else None
    write_report(Run(lifetimes, scenes, built, evidence, placed), output)
    say(model.luminance.sentence())
    say(f"{output}: {Path(output).stat().st_size / 1e6:.1f} MB, {len(frames)} hours. Open it in a browser.")


def _evidence(data: str, model: DisplayModel, options: dict[str, Any], instrument: str | None) -> Evidence:
    from lutgen.cli.data_options import question_from
    from lutgen.criticism.refine import refine
    from lutgen.report.page import Evidence

    question = question_from(
        data, baseline=None, selection=options["selection"], model=options["model"], instrument=instrument, files=()
    )
    with progress_bar("trying effects") as progress:
        refinement = refine(question.readings, auto=True, **question.search, progress=progress)
    other = model.measurements.sha256 != question.readings.sha256
    return Evidence(refinement, question.effects, question.again, model.measurements.file if other else "")
