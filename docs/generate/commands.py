"""reference/commands.md: the help of every command, as click prints it."""

from __future__ import annotations

from click import Command, Context, Group

from docs.generate.markup import anchor, page, table
from lutgen.cli.command import group

#: Columns of the help texts.
WIDTH = 100


def pages() -> dict[str, str]:
    """Return path below docs/reference → text."""
    named = commands()
    names = table(
        ("command", "what it does"),
        [
            (f"[`{name}`](#{anchor(f'lutgen {name}')})", command.get_short_help_str(limit=1000))
            for name, command in named.items()
        ],
    )
    sections = [
        f"## lutgen {name}\n\n```text\n{help_text(command, f'lutgen {name}')}\n```" for name, command in named.items()
    ]
    intro = (
        "Each command as its `--help` tells it. Exit codes of all commands: 0 done, 1 a check failed, 2 bad input, "
        "130 interrupted, 143 terminated. "
        'Shell completion for bash (zsh and fish alike): `eval "$(_LUTGEN_COMPLETE=bash_source lutgen)"`.'
    )
    return {"commands.md": page("Commands", intro, names, *sections)}


def commands(here: Group = group, before: str = "") -> dict[str, Command]:
    """Return every command by its words, such as "study plan"; a group is followed by its commands."""
    named: dict[str, Command] = {}
    for name in here.list_commands(Context(here)):
        command = here.get_command(Context(here), name)
        if isinstance(command, Group):
            named |= commands(command, f"{before}{name} ")
        elif command is not None:
            named[f"{before}{name}"] = command
    return named


def help_text(command: Command, words: str) -> str:
    """Return the help of a command in a fixed width."""
    context = Context(command, info_name=words, terminal_width=WIDTH, max_content_width=WIDTH)
    return "\n".join(line.rstrip() for line in command.get_help(context).splitlines())
