"""``lutgen sessions``: a group, one module per command in this folder."""

import click

from lutgen.cli.command import CommandFolder, Section


@click.group(cls=CommandFolder, folder=__name__, section=Section.REAL_DISPLAYS, place=2)
def command() -> None:
    """Collect the sessions of one display in a campaign file, and explain why the sessions differ.

    \b
    Example:
      lutgen sessions init examples/session.ti3 -o campaign.toml
      lutgen sessions explain examples/campaign/campaign.toml
    """
