"""``lutgen sessions``: a group, one module per command in this folder."""

from __future__ import annotations

import click

from lutgen.cli.command_folder import CommandFolder


@click.group(cls=CommandFolder, folder=__name__)
def command() -> None:
    """Put the sessions of one display together: a campaign file, which build, compare and diagnose read.

    \b
    Example:
      lutgen sessions init examples/session.ti3 -o campaign.toml
    """
