from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import Choice, PlaceOptions, image_argument, model_from, picture_options, screen_options
from lutgen.cli.outputs import progress_bar, say
from lutgen.files import check_new_file
from lutgen.names import AGING_MODES

#: Number of columns without --hours.
_COLUMNS = 4


@click.command(cls=Command, section=Section.PICTURES, place=5)
@image_argument
@click.option(
    "--hours",
    metavar="HOURS",
    help="0,5000,10000: a list; 0..18000:3000: a step. One column for each hour "
    f"[default: {_COLUMNS} of the measured times].",
)
@click.option(
    "--mode",
    "modes",
    type=Choice(AGING_MODES),
    multiple=True,
    help="A mode to draw as a row; may be repeated [default: both].",
)
@click.option("-o", "--output", required=True, metavar="FILE.png", help="Picture to write.")
@picture_options
@screen_options
def command(
    *,
    image: str,
    hours: str | None,
    modes: tuple[str, ...],
    output: str,
    source: str,
    force: bool,
    where: PlaceOptions,
    **options: Any,
) -> None:
    """Lay out an image as it ages: a row for each mode, a column for each hour, on neutral grey.

    The mean ΔE2000 against the un-aged display, over all pixels, is under each picture. Pictures that fit are copied
    pixel by pixel. Larger pictures are first reduced and then aged, as in a viewer that shows a whole large image.

    \b
    Example:
      lutgen sheet slide.png -o slide-sheet.png
      lutgen sheet slide.png --mode chroma --hours 0..18000:6000 -o slide-chroma.png
    """
    from lutgen.display.tips import parse_hours
    from lutgen.pictures.frame import aged_series
    from lutgen.report.sheets import age_sheet, check_hours, longest

    path = check_new_file(output, force=force, suffixes=(".png",))
    model, screen = where.on(model_from(**options))
    chosen = check_hours(model.tips.spread(_COLUMNS) if hours is None else parse_hours(hours, model.tips))
    drawn, size = tuple(dict.fromkeys(modes)) or AGING_MODES, longest(len(chosen))
    with progress_bar("aging") as progress:
        series = aged_series(
            image, model, drawn, chosen, longest=size, on_screen=screen, source=source, progress=progress
        )
    age_sheet(series, chosen, path, force=force)
    say(model.luminance.sentence())
    for sentence in screen.sentences() if screen else ():
        say(sentence)
    say(output)
