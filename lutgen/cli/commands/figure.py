from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import Choice, PlaceOptions, image_argument, model_from, picture_options, screen_options
from lutgen.cli.outputs import progress_bar, say
from lutgen.files import check_new_file
from lutgen.names import FIGURES


@click.command(cls=Command, section=Section.PICTURES, place=7)
@click.argument("number", type=Choice(FIGURES), metavar="2|3|4|5|6")
@image_argument
@click.option("-o", "--output", required=True, metavar="FILE.png", help="Picture to write.")
@picture_options
@screen_options
def command(
    *, number: str, image: str, output: str, source: str, force: bool, where: PlaceOptions, **options: Any
) -> None:
    """Redraw a figure of the paper from your own image; the images of the paper were never published.

    \b
    2, 3, 4  un-aged in the middle; clockwise from the top chroma 10 000 h, chroma 18 000 h,
             chroma-luma 10 000 h, chroma-luma 18 000 h: one layout, for three images
    5        ΔE2000 against hours, mean ± 2 SD over all pixels
    6        ΔE2000 maps, chroma at 8100 h above chroma-luma at 4100 h, scale 1 to 8

    \b
    Example:
      lutgen figure 2 slide.png -o slide-2.png
      lutgen figure 6 slide.png -o slide-6.png
    """
    from lutgen.report.sheets import draw_figure

    path = check_new_file(output, force=force, suffixes=(".png",))
    model, screen = where.on(model_from(**options))
    with progress_bar("drawing") as progress:
        draw_figure(number, image, model, path, on_screen=screen, source=source, force=force, progress=progress)
    for sentence in screen.sentences() if screen else ():
        say(sentence)
    say(output)
