"""``CommandFolder``: a group whose commands are the modules of a folder."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import click

#: Letters that no first sentence has.
LONGEST = 1000


class CommandFolder(click.Group):
    """Commands are the modules and packages of a folder; each has ``command``."""

    def __init__(self, *args: Any, folder: str, **kwargs: Any) -> None:
        """Take the commands in ``folder``, a package's dotted name; the rest is click's."""
        super().__init__(*args, **kwargs)
        self._folder = folder

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's interface
        """Name the modules of the folder."""
        return sorted(module.name for module in iter_modules(import_module(self._folder).__path__))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command: click.Command = import_module(f"{self._folder}.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands, each with its whole first sentence: click would cut it off at the end of the line."""
        commands = ((name, self.get_command(ctx, name)) for name in self.list_commands(ctx))
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(LONGEST)) for name, command in commands if command])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Name the choices when a command is unknown."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError:
            names = ", ".join(self.list_commands(ctx))
            message = f"No such command {args[0]!r}. Pick one of: {names}."
            raise click.UsageError(message, ctx) from None
