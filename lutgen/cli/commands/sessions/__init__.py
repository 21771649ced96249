"""The group ``lutgen sessions``: commands on the sessions of one display.

Each module of this folder is one command of the group. It has the command's name and declares ``command``, as in
``lutgen/cli/commands``.
"""

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
