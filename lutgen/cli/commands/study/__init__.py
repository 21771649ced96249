"""The group ``lutgen study``: commands on a reader study.

Each module of this folder is one command of the group. It has the command's name and declares ``command``, as in
``lutgen/cli/commands``.
"""

import click

from lutgen.cli.command import CommandFolder, Section


@click.group(cls=CommandFolder, folder=__name__, section=Section.READER_STUDY, place=1)
def command() -> None:
    """Ask readers whether display aging changes how they read: plan a study, run the study, analyse it.

    \b
    Example:
      lutgen study plan slides/*.png --conditions none,chroma@18000 --per-condition 40 --seed 1 -o study/
      lutgen study run study/ --reader "Dr A" --session 1
      lutgen study analyse study/
    """
