import sys
from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import WholeFrom, json_option, life_options, model_from, model_options, numbers, source_option
from lutgen.cli.outputs import Outputs, progress_bar, say


@click.command(cls=Command, section=Section.PICTURES, place=2)
@click.argument("slides", nargs=-1, required=True, metavar="SLIDE|FOLDER|LIST.txt...")
@click.option("-o", "--output", required=True, metavar="DIR", help="Folder for the result of every slide.")
@life_options
@click.option("--tissue", is_flag=True, help="Leave out bare glass, by a threshold on L*.")
@source_option
@click.option("--jobs", type=WholeFrom(min=1), help="Processes, up to 0.5 GB each [default: one per core].")
@click.option("--scheduler", metavar="ADDRESS", help="Share the slides on this Dask cluster, such as tcp://host:8786.")
@json_option
@click.option(
    "--csv", "csv_to", metavar="FILE", help="Write the lifetimes, a line for each slide and mode, and medians."
)
@click.option("--force", is_flag=True, help="Replace files that exist, and a run in DIR with other options.")
@model_options
def command(
    *,
    slides: tuple[str, ...],
    output: str,
    tolerance: str,
    hours: str | None,
    tissue: bool,
    source: str,
    jobs: int | None,
    scheduler: str | None,
    json_to: str | None,
    csv_to: str | None,
    force: bool,
    **options: Any,
) -> None:
    """Show how long a display may be used, over many slides: lifetime of each, median and 95 % interval over all.

    Give slides as files, folders (with their subfolders), or lists (.txt) with a path per line. lutgen writes each
    result into DIR as soon as the result is known. After an interruption the same command continues, and computes the
    slides that are new or have changed. lutgen names a slide that it cannot read, and finishes the other slides. A
    slide that never reaches a tolerance counts as the longest lifetime. lutgen distributes the slides to processes of
    this machine or, with --scheduler (and lutgen[cluster]), to the workers of a Dask cluster, which must see the slides
    under the same paths; results are written on this machine. Ends with 1 when a slide cannot be read.

    \b
    Example:
      lutgen cohort slides/ -o run/
      lutgen cohort slides/a.tif slides/b.tif --tissue --tolerance 1,3 -o run-tissue/ --csv cohort.csv
    """
    from lutgen.display.tips import parse_hours
    from lutgen.pictures.cohort import cohort
    from lutgen.report.lifetimes import cohort_page

    if jobs and scheduler:
        raise click.UsageError(
            "--jobs are processes of this machine, and --scheduler uses those of a cluster. Leave one of them out."
        )
    outputs = Outputs(json_to, csv_to, force=force)
    model = model_from(**options)
    try:
        with progress_bar("slides", quiet=outputs.alone) as progress:
            result = cohort(
                slides,
                model,
                output,
                tolerances=numbers("--tolerance", tolerance),
                hours=parse_hours(hours, model.tips) if hours else None,
                tissue=tissue,
                source=source,
                jobs=jobs,
                scheduler=scheduler,
                force=force,
                progress=progress,
            )
    except KeyboardInterrupt:
        say(f"Interrupted. {output} keeps the finished slides; the same command continues with the others.", err=True)
        raise
    outputs.write(cohort_page(result), result.as_json, as_csv=result.as_csv)
    if result.broken:
        sys.exit(1)
