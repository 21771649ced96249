"""``lutgen sessions explain``."""

from __future__ import annotations

import click

from lutgen.cli.command import Command
from lutgen.cli.outputs import check_json, print_page, write_json
from lutgen.cli.picture_options import json_option
from lutgen.cli.shared import progress_bar


@click.command(cls=Command)
@click.argument("files", nargs=-1, required=True, metavar="CAMPAIGN|SESSION...")
@click.option("--reference", metavar="FILE", help="The session to hold the others against [default: the first sound].")
@json_option
@click.option("--force", is_flag=True, help="Replace files that exist.")
def command(*, files: tuple[str, ...], reference: str | None, json_to: str | None, force: bool) -> None:
    """Say why sessions of one display differ: display, settings, room, or instrument.

    Give a campaign file (.toml), which knows of dates, instruments and settings, or the sessions themselves.

    Each session is held against a reference: brightness or preset, calibration, HDR or dynamic contrast, room light,
    instrument or its correction, drift while reading, another display, true aging. Where several fit equally, all are
    named, and the measurement that would tell. Ends with 0 whatever is found.

    \b
    Example:
      lutgen sessions explain examples/campaign/campaign.toml
      lutgen sessions explain examples/campaign/2021-01.ti3 examples/campaign/2022-01.ti3
      lutgen sessions explain examples/campaign/campaign.toml --reference 2021-06.ti3 --json explain.json
    """
    from lutgen.measurements.campaign import campaign_of, read_campaign
    from lutgen.report.separate_page import separate_page
    from lutgen.sessions.separate import separate
    from lutgen.sessions.separate_json import separation_as_json

    alone = check_json(json_to, force=force)
    listed = len(files) == 1 and files[0].lower().endswith(".toml")
    campaign = read_campaign(files[0]) if listed else campaign_of(files)
    with progress_bar("explaining", quiet=alone) as progress:
        found = separate(campaign, reference=reference, progress=progress)
    if json_to:
        write_json(separation_as_json(found), json_to)
    if not alone:
        print_page(separate_page(found))
