"""``lutgen trend``."""

from __future__ import annotations

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.outputs import check_json, check_new_file, print_page, write_json
from lutgen.cli.picture_options import json_option
from lutgen.cli.shared import progress_bar
from lutgen.names import DRIFT, LIMIT_SETS, TG18_SECONDARY


@click.command(cls=Command, section=Section.REAL_DISPLAYS, place=3)
@click.argument("campaign", metavar="CAMPAIGN")
@click.option(
    "--limits",
    "sets",
    type=click.Choice(LIMIT_SETS),
    multiple=True,
    help="A published set; may be repeated [default: tg18-secondary and drift].",
)
@click.option(
    "--limit", "own", metavar="TEXT", multiple=True, help="Your own, such as white>=200, white>=80%, contrast>=300."
)
@click.option("--all-sessions", is_flag=True, help="Use all sessions, also those in which a setting changed.")
@click.option("--plot", metavar="FILE", help="Draw figures, laws and limits (.png).")
@json_option
@click.option("--force", is_flag=True, help="Replace files that exist.")
def command(
    *,
    campaign: str,
    sets: tuple[str, ...],
    own: tuple[str, ...],
    all_sessions: bool,
    plot: str | None,
    json_to: str | None,
    force: bool,
) -> None:
    """Follow a display over its sessions, and say when it will pass each limit.

    CAMPAIGN is a campaign file (lutgen sessions init). The report follows white, black, contrast, primaries and γ, and
    chooses the law of decay by evidence (AICc). A time after the last session is an extrapolation and marked as one;
    intervals are 90 %. Sessions in which a setting or the instrument changed are left out. Ends with 0 whatever the
    result is.

    \b
    Example:
      lutgen trend examples/campaign/campaign.toml
      lutgen trend examples/campaign/campaign.toml --limit 'white>=80%' --plot trend.png --json trend.json
    """
    from lutgen.history.limits import limits_of, parse_limit
    from lutgen.history.trend import trend
    from lutgen.history.trend_json import trend_as_json
    from lutgen.readings.campaign import read_campaign
    from lutgen.report.history.campaign import trend_page

    alone = check_json(json_to, force=force)
    path = check_new_file(plot, force=force, suffixes=(".png",)) if plot else None
    chosen = sets or (() if own else (TG18_SECONDARY, DRIFT))
    limits = [*(limit for name in chosen for limit in limits_of(name)), *(parse_limit(text) for text in own)]
    with progress_bar("following", quiet=alone) as progress:
        result = trend(read_campaign(campaign), limits, all_sessions=all_sessions, progress=progress)
    if path:
        from lutgen.report.history.campaign import plot_trend

        plot_trend(result, path, force=force)
    if json_to:
        write_json(trend_as_json(result), json_to)
    if not alone:
        print_page([*trend_page(result), *([f"Picture: {path}"] if path else [])])
