"""``lutgen lifetime``."""

from __future__ import annotations

from typing import Any

import click

from lutgen.cli.data_options import check_json
from lutgen.cli.outputs import check_new_file, check_pictures, print_page, write_json
from lutgen.cli.picture_options import hours_option, json_option, source_option, tolerance_option
from lutgen.cli.shared import model_from, model_options, numbers, progress_bar


@click.command()
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@tolerance_option
@hours_option
@click.option("--tissue", is_flag=True, help="Leave bare glass out, by a threshold on L* that is shown.")
@source_option
@json_option
@click.option("--csv", "csv_to", metavar="FILE", help="Write the lifetimes, a line an image and mode.")
@click.option("--plots", metavar="DIR", help="Draw ΔE2000 against hours into this folder, a picture an image.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
@model_options
def command(
    *,
    images: tuple[str, ...],
    tolerance: str,
    hours: str | None,
    tissue: bool,
    source: str,
    json_to: str | None,
    csv_to: str | None,
    plots: str | None,
    force: bool,
    **options: Any,
) -> None:
    """Show how long a display may be used until pictures on it have changed too much.

    ΔE2000 between the un-aged and the aged display, over all pixels of each image and for every hour, with white's
    luminance held (chroma) and not (chroma-luma); and the hours at which its mean (Avg) and mean + 2 SD (Max, as in the
    paper's Table 1) reach each tolerance. JSON and CSV hold quantiles and the largest too. An image is read once, to
    count its distinct colours; hours and modes then cost the same for a thumbnail and for a slide (.svs, .ndpi, .mrxs,
    with lutgen[slides]). Ends with 0 whatever is found.

    \b
    Example:
      lutgen lifetime slide.png
      lutgen lifetime a.tif b.tif --tolerance 1,3 --tissue --json lifetimes.json --plots plots/lifetime
    """
    from pathlib import Path

    from lutgen.appearance.lifetime import check_tolerances, lifetime
    from lutgen.display.hours import parse_hours
    from lutgen.report.lifetime_page import lifetime_page

    tolerances = check_tolerances(numbers("--tolerance", tolerance))
    alone = check_json(json_to, force=force)
    if csv_to:
        check_new_file(csv_to, force=force)
    if plots:
        from lutgen.report.lifetime_plot import picture_names, plot_lifetimes

        check_pictures(plots, picture_names(images), force=force)
    model = model_from(**options)
    chosen = parse_hours(hours, model.tips) if hours else None
    with progress_bar("aging colours", quiet=alone) as progress:
        found = lifetime(
            images, model, tolerances=tolerances, hours=chosen, tissue=tissue, source=source, progress=progress
        )
    if not alone:
        print_page(lifetime_page(found))
    if csv_to:
        from lutgen.files import write_atomically

        write_atomically(Path(csv_to), found.as_csv().encode())
    if plots:
        pictures = plot_lifetimes(found, plots, force=force)
        if not alone:
            print_page([f"Pictures: {', '.join(map(str, pictures))}"])
    if json_to:
        write_json(found.as_json(), json_to)
