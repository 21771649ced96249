from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import (
    NumberFrom,
    json_option,
    life_options,
    model_from,
    model_options,
    numbers,
    replace_option,
    source_option,
)
from lutgen.cli.outputs import Outputs, progress_bar


@click.command(cls=Command, section=Section.PICTURES, place=1)
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@life_options
@click.option("--tissue", is_flag=True, help="Leave out bare glass, by a threshold on L* that the report gives.")
@click.option(
    "--hours-per-day",
    type=NumberFrom(0, 24, min_open=True),
    metavar="H",
    help="Hours a day that the display is on: lifetimes are then printed in months of use too.",
)
@source_option
@json_option
@click.option("--csv", "csv_to", metavar="FILE", help="Write the lifetimes, a line for each image and mode.")
@click.option("--plots", metavar="DIR", help="Draw ΔE2000 against hours into this folder, a picture for each image.")
@replace_option
@model_options
def command(
    *,
    images: tuple[str, ...],
    tolerance: str,
    hours: str | None,
    tissue: bool,
    hours_per_day: float | None,
    source: str,
    json_to: str | None,
    csv_to: str | None,
    plots: str | None,
    force: bool,
    **options: Any,
) -> None:
    """Show how long a display may be used until pictures on it have changed too much.

    Gives ΔE2000 between the un-aged and the aged display, over all pixels of each image and for every hour, with the
    luminance of white held (chroma) and not held (chroma-luma); and the hours at which the mean (Avg) and mean + 2 SD
    (Max, as in the paper's Table 1) reach each tolerance. JSON and CSV hold quantiles and the maximum too. lutgen reads
    an image once and counts its distinct colours; each hour and mode then takes the same time for a thumbnail and a
    slide (.svs, .ndpi, .mrxs, with lutgen[slides]). The exit code is 0 for any result.

    \b
    Example:
      lutgen lifetime slide.png
      lutgen lifetime a.tif b.tif --tolerance 1,3 --tissue --json lifetimes.json --plots plots/lifetime
    """
    from lutgen.display.tips import parse_hours
    from lutgen.pictures.lifetime import check_tolerances, lifetime
    from lutgen.report.lifetimes import lifetime_page, picture_names, plot_lifetimes

    tolerances = check_tolerances(numbers("--tolerance", tolerance))
    outputs = Outputs(json_to, csv_to, plots, lambda: picture_names(images), force=force)
    model = model_from(**options)
    chosen = parse_hours(hours, model.tips) if hours else None
    with progress_bar("aging colours", quiet=outputs.alone) as progress:
        lifetimes = lifetime(
            images, model, tolerances=tolerances, hours=chosen, tissue=tissue, source=source, progress=progress
        )
    outputs.write(
        lifetime_page(lifetimes, hours_per_day),
        lifetimes.as_json,
        as_csv=lifetimes.as_csv,
        plot=lambda folder: plot_lifetimes(lifetimes, folder, force=force),
    )
