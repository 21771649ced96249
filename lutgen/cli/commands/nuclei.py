from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import (
    NUMBER,
    WHOLE,
    Choice,
    hours_option,
    image_argument,
    json_option,
    model_from,
    model_options,
    replace_option,
    source_option,
)
from lutgen.cli.outputs import Outputs, progress_bar
from lutgen.files import check_new_file, write_atomically
from lutgen.names import STAINS


@click.command(cls=Command, section=Section.PICTURES, place=3)
@image_argument
@click.option(
    "--stain",
    type=Choice(("auto", *STAINS)),
    help="H&E, or haematoxylin and DAB (immunohistochemistry); auto: H-DAB if the image has brown [default: auto].",
)
@click.option(
    "--mask", metavar="FILE", help="Your own nuclei as PNG or TIFF: one label for each nucleus, or white on black."
)
@hours_option
@click.option(
    "--min-area", type=WHOLE, metavar="PIXELS", help="Area of the smallest nucleus [default: from a typical nucleus]."
)
@click.option(
    "--loss",
    type=NUMBER,
    default=10.0,
    show_default=True,
    metavar="PERCENT",
    help="Count the nuclei that lose more contrast than this.",
)
@source_option
@json_option
@click.option(
    "--csv", "csv_to", metavar="FILE", help="Write a line for each nucleus: place, size, ΔE2000 at each hour."
)
@click.option(
    "--labels", metavar="FILE", help="Write the nuclei as 16-bit PNG: 0 for the background, 1, 2, … as in the table."
)
@click.option("--plots", metavar="DIR", help="Draw ΔE2000 against hours, and the outlines, into this folder.")
@replace_option
@model_options
def command(
    *,
    image: str,
    stain: str | None,
    mask: str | None,
    hours: str | None,
    min_area: int | None,
    loss: float,
    source: str,
    json_to: str | None,
    csv_to: str | None,
    labels: str | None,
    plots: str | None,
    force: bool,
    **options: Any,
) -> None:
    """Show how clearly nuclei stand out, and how much of that contrast an aged display leaves.

    Finds the nuclei of an H&E or H-DAB field by their haematoxylin (with lutgen[nuclei]), or takes a mask. For each
    nucleus lutgen computes ΔE2000 between the mean Lab of the nucleus and the mean Lab of a ring around the nucleus, on
    the un-aged and on the aged display, for every hour, with the luminance of white held (chroma) and not held
    (chroma-luma). The ring begins a tenth of a typical nucleus's width away (at least 1 pixel) and is a third of that
    width wide (at least 2). Lab is relative to the white of the un-aged display, also for the aged one. This is a
    contrast of mean colours, without texture and without a reader: look at the outlines (--plots) before you trust it.
    At most 4096 × 4096 pixels. The exit code is 0 for any result.

    \b
    Example:
      lutgen nuclei slide.png
      lutgen nuclei slide.png --stain hdab --hours 0,10000,18000 --csv each.csv --plots plots/nuclei
      lutgen nuclei slide.png --labels nuclei.png
    """
    from lutgen.display.tips import parse_hours
    from lutgen.pictures.conspicuity import nuclei
    from lutgen.pictures.nuclei import labels_png
    from lutgen.report.nuclei import nuclei_page, picture_names, plot_nuclei

    outputs = Outputs(json_to, csv_to, plots, lambda: picture_names(image), force=force)
    labels_to = check_new_file(labels, force=force, suffixes=(".png",)) if labels else None
    model = model_from(**options)
    chosen = parse_hours(hours, model.tips) if hours else None
    with progress_bar("aging nuclei", quiet=outputs.alone) as progress:
        conspicuity = nuclei(
            image,
            model,
            stain=stain,
            mask=mask,
            hours=chosen,
            min_area=min_area,
            loss=loss,
            source=source,
            progress=progress,
        )
    if labels_to:
        write_atomically(labels_to, labels_png(conspicuity.nuclei.labels))
    outputs.write(
        nuclei_page(conspicuity),
        conspicuity.as_json,
        as_csv=conspicuity.as_csv,
        plot=lambda folder: plot_nuclei(conspicuity, folder, force=force),
    )
