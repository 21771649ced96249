from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from lutgen.cells import number
from lutgen.cli.command import Command
from lutgen.cli.outputs import progress_bar, say
from lutgen.files import check_new_file, write_atomically

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lutgen.history.draft import Answers
    from lutgen.readings.session import Session


@click.command(cls=Command)
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@click.option("-o", "--output", metavar="FILE", required=True, help="The campaign file (.toml).")
@click.option(
    "--same-display", is_flag=True, help="Treat the sessions as those of one display although they look like several."
)
@click.option("--force", is_flag=True, help="Replace a file that exists.")
def command(*, files: tuple[str, ...], output: str, same_display: bool, force: bool) -> None:
    """Draft a campaign file from the sessions of one display, by date.

    Files are ArgyllCMS .ti3, other CGATS, or CSV. lutgen fills in dates, instruments and the effect of the calibration.
    On a terminal it asks for everything that only you know (hours a day, room light, settings); without a terminal it
    leaves these lines open as # TODO. lutgen refuses and names sessions of clearly different displays.

    \b
    Example:
      lutgen sessions init examples/session.ti3 -o campaign.toml
    """
    from lutgen.history.draft import check_one_display, displays_of, draft
    from lutgen.numerals import counted
    from lutgen.readings import read_session

    path = check_new_file(output, force=force, suffixes=(".toml",))
    sessions = []
    with progress_bar("reading") as progress:
        for done, file in enumerate(files):
            progress(done, len(files))
            sessions.append(read_session(file))
    if not same_display:
        check_one_display(sessions)
    answers = _ask(sessions) if sys.stdin.isatty() else None
    text = draft(sessions, path.parent, answers)
    write_atomically(path, text.encode())
    left = text.count("# TODO ")
    opened = f"; complete the {left} lines that begin with # TODO" if left else ""
    displays = len(displays_of(sessions)) if same_display else 1
    several = f" They look like {displays} displays." if displays > 1 else ""
    say(f"{path}: {counted(len(sessions), 'session')}{opened}.{several}")


def _ask(sessions: Sequence[Session]) -> Answers:
    """Ask questions on the terminal; an empty answer leaves the line open."""
    from lutgen.history.draft import OF_DISPLAY, OF_SESSION, Answers

    names = ", ".join(dict.fromkeys(each.display for each in sessions if each.display))
    say("Press Enter if you do not know an answer: the file then leaves it open.", err=True)
    name = click.prompt("Display", default=names, err=True)
    values = {
        key: click.prompt(question, default="", show_default=False, err=True).strip()
        for key, question in {**OF_DISPLAY, **OF_SESSION}.items()
    }
    return Answers(name, {key: _value(key, text) for key, text in values.items() if text})


def _value(key: str, text: str) -> float | str:
    if key == "settings":
        return text
    value = number(text)
    most = 24 if key == "hours_per_day" else 200_000
    if value is None or not 0 <= value <= most or (key == "hours_per_day" and value == 0):
        raise click.UsageError(f"{key}: {text!r} is no possible value. Start again, or leave it empty.")
    return value
