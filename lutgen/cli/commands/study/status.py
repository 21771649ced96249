from pathlib import Path

import click

from lutgen.cli.command import Command
from lutgen.cli.options import json_option
from lutgen.cli.outputs import Outputs


@click.command(cls=Command)
@click.argument("study", metavar="STUDY")
@json_option
@click.option("--force", is_flag=True, help="Replace a file that exists.")
def command(*, study: str, json_to: str | None, force: bool) -> None:
    """Show who has read what in a study, and when the next reading session may begin; answers stay hidden.

    lutgen verifies every file of answers; a file that was altered by hand is named, with the row. Times are UTC.

    \b
    Example:
      lutgen study status study/
      lutgen study status study/ --json -
    """
    from lutgen.report.study_plan import study_status_page
    from lutgen.study.answers import study_status

    outputs = Outputs(json_to, force=force)
    status = study_status(Path(study))
    outputs.write(study_status_page(status), status.as_json)
