from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import NUMBER, WHOLE, Choice, image_argument, model_from, picture_options
from lutgen.cli.outputs import progress_bar, say
from lutgen.files import check_new_file
from lutgen.names import AGING_MODES, ANIMATION_SUFFIXES

#: Defaults: seconds of the animation, and pixels of its longest side.
SECONDS, SIZE = 8.0, 640


@click.command(cls=Command, section=Section.PICTURES, place=6)
@image_argument
@click.option("--mode", type=Choice(AGING_MODES), required=True, help="Aging mode.")
@click.option(
    "--hours",
    metavar="HOURS",
    help="0..18000: every measured time in the span; 0..18000:500: a step; 0,5000,10000: a list. One frame for each "
    "hour [default: all measured times].",
)
@click.option("--seconds", type=NUMBER, default=SECONDS, show_default=True, help="Duration of the whole animation.")
@click.option(
    "--size", type=WHOLE, default=SIZE, show_default=True, help="Maximum pixels of the picture's longest side."
)
@click.option(
    "-o", "--output", required=True, metavar="FILE", help="An animated PNG (.png, .apng), or .mp4 through ffmpeg."
)
@picture_options
def command(
    *,
    image: str,
    mode: str,
    hours: str | None,
    seconds: float,
    size: int,
    output: str,
    source: str,
    force: bool,
    **options: Any,
) -> None:
    """Animate an image over the hours of a display's life; every frame shows its hour and its mean ΔE2000.

    \b
    Example:
      lutgen animate slide.png --mode chroma-luma -o slide-aging.png
      lutgen animate slide.png --mode chroma --hours 0..18000:3000 --seconds 3 -o slide-aging.apng
    """
    from lutgen.display.tips import parse_hours
    from lutgen.pictures.frame import aged_series
    from lutgen.report.animation import animate, check_animation

    path = check_new_file(output, force=force, suffixes=ANIMATION_SUFFIXES)
    model = model_from(**options)
    chosen = parse_hours(hours, model.tips)
    check_animation(path, chosen, seconds)
    with progress_bar("aging") as progress:
        series = aged_series(image, model, (mode,), chosen, longest=size, source=source, progress=progress)
        animate(series, mode, chosen, path, seconds=seconds, progress=progress)
    say(output)
