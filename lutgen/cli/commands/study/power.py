"""``lutgen study power``."""

from __future__ import annotations

import click

from lutgen.cli.command import Command
from lutgen.cli.number_types import WHOLE
from lutgen.cli.outputs import check_json, check_pictures, print_page, write_json
from lutgen.cli.picture_options import json_option


@click.command(cls=Command)
@click.option(
    "--per-condition", type=WHOLE, default=40, show_default=True, metavar="N", help="Images per condition and reader."
)
@click.option("--readers", type=WHOLE, default=1, show_default=True, metavar="R", help="How many readers.")
@json_option
@click.option("--plots", metavar="DIR", help="Draw power against answers per condition, into this folder.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
def command(*, per_condition: int, readers: int, json_to: str | None, plots: str | None, force: bool) -> None:
    """Say what a reader study of this size can find: the smallest differences, and power for those the paper saw.

    At 80 % power and a level of 5 %, by the paper's tests: two-sample t on time to score and ease of reading,
    one-tailed t on 0/1 values, and Fisher's exact test, on agreement between two sessions. No study is needed.

    \b
    Example:
      lutgen study power --per-condition 40
      lutgen study power --per-condition 60 --readers 2 --plots plots/power
    """
    from lutgen.report.study_plan import power_page
    from lutgen.study.power import study_power

    alone = check_json(json_to, force=force)
    if plots:
        from lutgen.report.study_plan import PICTURE, plot_power

        check_pictures(plots, [PICTURE], force=force)
    result = study_power(per_condition, readers)
    picture = plot_power(result, plots, force=force) if plots else None
    if json_to:
        write_json(result.as_json(), json_to)
    if not alone:
        print_page([*power_page(result), *([f"Picture: {picture}"] if picture else [])])
