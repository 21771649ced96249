"""Options of the commands on pictures: lifetime, cohort, nuclei, report, map, figure, table, sheet, animate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lutgen.cli.outputs import check_new_file
from lutgen.errors import LutgenError
from lutgen.names import SOURCES

if TYPE_CHECKING:
    from collections.abc import Sequence

image_argument = click.argument("image", metavar="IMAGE")
source_option = click.option(
    "--source",
    type=click.Choice(SOURCES),
    default="auto",
    show_default=True,
    help="What the image stores: signal (code values) or linear light; auto: EXR linear, others signal.",
)
hours_option = click.option(
    "--hours",
    metavar="HOURS",
    help="0..18000: every measured time in the span; 0..18000:500: a step; 0,5000,10000: a list "
    "[default: all measured times].",
)
tolerance_option = click.option(
    "--tolerance", metavar="LIST", default="3,5", show_default=True, help="Tolerated ΔE2000."
)
json_option = click.option(
    "--json", "json_to", metavar="FILE|-", help="Write all numbers as JSON; - prints them alone."
)
force_option = click.option("--force", is_flag=True, help="Replace files that exist; never the image itself.")


def check_output(output: str, image: str, *, force: bool, suffixes: Sequence[str] = (".png",)) -> Path:
    """Return the path that a picture may be written to.

    Raises
    ------
    LutgenError
        As :func:`check_new_file`, or the image itself.

    """
    path = check_new_file(output, force=force, suffixes=suffixes)
    if path.exists() and Path(image).exists() and path.samefile(image):
        message = f"{output}: is the image itself, which is never written to. Choose another name with -o."
        raise LutgenError(message)
    return path
