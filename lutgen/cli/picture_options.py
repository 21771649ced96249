"""Options of the commands that draw an image's aging: map, figure, table, sheet, animate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lutgen.cli.outputs import check_new_file
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Sequence

#: As in the library, repeated because help must not import numpy; a test holds them together.
AGING_MODES = ("chroma", "chroma-luma")
SOURCES = ("auto", "signal", "linear")

image_argument = click.argument("image", metavar="IMAGE")
source_option = click.option(
    "--source",
    type=click.Choice(SOURCES),
    default="auto",
    show_default=True,
    help="What the image stores: signal (code values) or linear light; auto: EXR linear, others signal.",
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
