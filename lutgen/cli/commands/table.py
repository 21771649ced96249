from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import Choice, json_option, model_from, model_options, replace_option, source_option
from lutgen.cli.outputs import Outputs, progress_bar


@click.command(cls=Command, section=Section.PICTURES, place=8)
@click.argument("number", type=Choice(("1",)), metavar="1")
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@json_option
@click.option("--csv", "csv_to", metavar="FILE", help="Write the table, a line for each cell.")
@source_option
@replace_option
@model_options
def command(
    *,
    number: str,  # noqa: ARG001 - there is one so far
    images: tuple[str, ...],
    json_to: str | None,
    csv_to: str | None,
    source: str,
    force: bool,
    **options: Any,
) -> None:
    """Make a table of the paper from your own images, beside the values that the paper published.

    Table 1: the hours until ΔE2000 reaches 3 and 5, for the mean (Avg) and for mean + 2 SD (Max), and the difference
    from the paper's hours. `lutgen lifetime` has other tolerances, quantiles, intervals and plots.

    \b
    Example:
      lutgen table 1 slide.png
      lutgen table 1 a.tif b.tif --csv table-1.csv
    """
    from lutgen.pictures.lifetime import lifetime
    from lutgen.report.lifetimes import table_1_csv, table_1_json, table_1_page

    outputs = Outputs(json_to, csv_to, force=force)
    model = model_from(**options)
    with progress_bar("aging colours", quiet=outputs.alone) as progress:
        lifetimes = lifetime(images, model, source=source, progress=progress)
    outputs.write(table_1_page(lifetimes), lambda: table_1_json(lifetimes), as_csv=lambda: table_1_csv(lifetimes))
