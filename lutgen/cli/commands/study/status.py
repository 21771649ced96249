"""``lutgen study status``."""

from __future__ import annotations

from pathlib import Path

import click

from lutgen.cli.command import Command
from lutgen.cli.outputs import check_json, print_page, write_json
from lutgen.cli.picture_options import json_option


@click.command(cls=Command)
@click.argument("study", metavar="STUDY")
@json_option
@click.option("--force", is_flag=True, help="Replace a file that exists.")
def command(*, study: str, json_to: str | None, force: bool) -> None:
    """Show who has read what in a study, and when the next session may begin; answers stay hidden.

    lutgen verifies every file of answers; a file that was altered by hand is named, with the row. Times are UTC.

    \b
    Example:
      lutgen study status study/
      lutgen study status study/ --json -
    """
    from lutgen.report.study_plan import study_status_page
    from lutgen.study.answers import study_status

    alone = check_json(json_to, force=force)
    status = study_status(Path(study))
    if json_to:
        write_json(status.as_json(), json_to)
    if not alone:
        print_page(study_status_page(status))
