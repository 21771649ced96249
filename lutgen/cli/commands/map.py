from typing import Any

import click

from lutgen.cells import number_list
from lutgen.cli.command import Command, Section
from lutgen.cli.options import (
    NUMBER,
    Choice,
    PlaceOptions,
    image_argument,
    model_from,
    picture_options,
    screen_options,
)
from lutgen.cli.outputs import Outputs, progress_bar
from lutgen.errors import LutgenError
from lutgen.files import check_new_file
from lutgen.names import AGING_MODES, MAP_SUFFIXES


@click.command(cls=Command, section=Section.PICTURES, place=4)
@image_argument
@click.option("--mode", type=Choice(AGING_MODES), required=True, help="Aging mode.")
@click.option("--hours", type=NUMBER, required=True, metavar="HOUR", help="Operating hours of the display.")
@click.option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    required=True,
    metavar="FILE",
    help="A picture (.png), or ΔE2000 of every pixel in single floats (.exr, .tif); may be repeated.",
)
@click.option("--range", "ends", metavar="LOW,HIGH", default="0,12", show_default=True, help="Scale of the picture.")
@click.option("--json", "json_to", metavar="FILE|-", help="Write statistics and histogram; - prints only the JSON.")
@picture_options
@screen_options
def command(
    *,
    image: str,
    mode: str,
    hours: float,
    outputs: tuple[str, ...],
    ends: str,
    json_to: str | None,
    source: str,
    force: bool,
    where: PlaceOptions,
    **options: Any,
) -> None:
    """Map how much aging changes each pixel of an image: ΔE2000, as in the paper's Figure 6.

    ΔE2000 is between the un-aged and the aged display, both seen on an un-aged viewer. The picture has a scale and a
    histogram beside it. The scale is the same for all maps unless --range changes it, so that maps can be compared;
    pixels above the scale are magenta. The picture of a large image is reduced by means over squares; .exr and .tif
    hold every pixel, with NaN where alpha is 0.

    \b
    Example:
      lutgen map slide.png --mode chroma-luma --hours 10000 -o slide-map.png
      lutgen map slide.png --mode chroma --hours 18000 -o slide-map.exr -o slide-map.tif --json slide-map.json
    """
    from lutgen.pictures.difference_map import difference_map
    from lutgen.report.difference_map import check_range, counted, plot_map, title_of

    low, high = check_range(*_numbers(ends))
    statistics = Outputs(json_to, force=force)
    paths = [check_new_file(output, force=force, suffixes=(".png", *MAP_SUFFIXES)) for output in outputs]
    floats = [path for path in paths if path.suffix.lower() in MAP_SUFFIXES]
    model, screen = where.on(model_from(**options))
    with progress_bar("comparing pixels", quiet=statistics.alone) as progress:
        difference = difference_map(
            image, model, mode, hours, floats=floats, on_screen=screen, source=source, force=force, progress=progress
        )
    for path in paths:
        if path not in floats:
            plot_map(difference, path, ends=(low, high), force=force)
    quantiles = f"95 % of the pixels are within {difference.p95:.2f}, 99 % within {difference.p99:.2f}."
    statistics.write(
        [
            f"{title_of(difference)}. {quantiles}",
            counted(difference),
            difference.model.measurements.provenance,
            f"Written: {', '.join(outputs)}",
            *difference.remarks(),
        ],
        difference.as_json,
    )


def _numbers(text: str) -> tuple[float, float]:
    ends = number_list(text)
    if ends is None or len(ends) != 2:
        raise LutgenError(f"--range {text}: give the two ends of the scale, such as 0,12.")
    return ends[0], ends[1]
