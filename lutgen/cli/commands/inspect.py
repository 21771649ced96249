"""``lutgen inspect``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.outputs import check_json, check_pictures, print_page, write_json
from lutgen.cli.picture_options import json_option
from lutgen.cli.shared import progress_bar

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.readings.session import Session


@click.command(name="inspect", cls=Command, section=Section.REAL_DISPLAYS, place=1)
@click.argument("files", metavar="DATA...", nargs=-1, required=True)
@json_option
@click.option("--plots", metavar="DIR", help="Draw one page for each session into this folder.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
def command(*, files: tuple[str, ...], json_to: str | None, plots: str | None, force: bool) -> None:
    """Show what sessions of real displays contain: white, black, curves, drift, calibration, and what is missing.

    DATA is the output of a measuring program: ArgyllCMS or DisplayCAL .ti3, an ICC profile that carries a .ti3, other
    CGATS, a CSV of patches, DisplayCAL's uniformity table; or what holds several sessions: a campaign file (.toml), a
    table of readings (.csv) with hours, a folder. No model is needed. γ is the least-squares slope of log luminance,
    with black subtracted, between 10 and 90 % of code. Ends with 0 whatever the result is.

    \b
    Example:
      lutgen inspect examples/session.ti3
      lutgen inspect examples/session.ti3 --plots plots/inspect --json inspect.json
    """
    from lutgen.history import inspect_session
    from lutgen.report.inspection import inspect_page

    alone = check_json(json_to, force=force)
    if plots:
        from lutgen.report.inspection import picture_names, plot_inspection
    inspections = []
    with progress_bar("inspecting", quiet=alone) as progress:
        for number, session in enumerate(_sessions(files)):
            progress(number, len(files))
            inspections.append(inspect_session(session))
    if plots:
        names = picture_names([each.session.file for each in inspections])
        folder = check_pictures(plots, names, force=force)
        with progress_bar("drawing", quiet=alone) as progress:
            for number, (each, name) in enumerate(zip(inspections, names, strict=True)):
                progress(number, len(inspections))
                plot_inspection(each, folder / name, force=force)
    if json_to:
        write_json({"schema": 1, "sessions": [each.as_json() for each in inspections]}, json_to)
    if not alone:
        print_page(inspect_page(inspections))
        if plots:
            print_page([f"Pictures: {', '.join(str(folder / name) for name in names)}"])


def _sessions(files: tuple[str, ...]) -> Iterator[Session]:
    """Read the files, one after the other; a campaign, a folder and a table with hours give all their sessions."""
    from lutgen.readings import read_campaign

    for file in files:
        yield from (entry.session for entry in read_campaign(file).entries)
