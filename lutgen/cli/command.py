"""``Command`` and ``CommandFolder``, the group ``lutgen``, and what becomes of errors, signals and exit codes.

A module of a group's folder holds one command, named ``command``; a package of the folder holds a group. The help of
the group lists the commands by section, and the help of a command lists rarely needed options under "Advanced".
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from enum import Enum
from importlib import import_module
from pkgutil import iter_modules
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any, NoReturn

import click

from lutgen import __version__
from lutgen.cli import INTERRUPTED
from lutgen.cli.outputs import say, tolerate_closed_pipes, with_fixed_spaces, with_plain_spaces
from lutgen.errors import LutgenError, reason_of

if TYPE_CHECKING:
    from collections.abc import Iterable

#: More letters than any first sentence has: click shortens a longer one with "...".
LONGEST = 1000

#: Help is not wider than this, on however wide a terminal.
WIDEST = 100


class Section(Enum):
    """Heading of a group of commands in ``lutgen --help``; the order here is the order there."""

    SIMULATE = "Simulate"
    CRITICISM = "Find what the model misses"
    REAL_DISPLAYS = "Real displays"
    PICTURES = "Pictures"
    READER_STUDY = "Reader study"
    OTHERS_FILES = "Other people's files"
    COMMANDS = "Commands"


class Advanced(click.Option):
    """An option that few users need: the help lists it last, under "Advanced"."""


def _hidden(text: str) -> str:
    """Hide hyphens and the spaces in numbers from click, which breaks lines there: --source-space, 18 000."""
    return with_fixed_spaces(text).replace("-", "\u2011")


def _shown(text: str) -> str:
    return with_plain_spaces(text).replace("\u2011", "-")


class Formatter(click.HelpFormatter):
    """Help as wide as the terminal, however narrow the terminal is, wrapped at spaces alone, unlike click's."""

    def __init__(self, **kwargs: Any) -> None:
        """Ignore click's width and take the terminal's."""
        # Help is not narrower than this: the name of an option and two short words.
        width = max(min(get_terminal_size().columns, WIDEST) - 2, 20)
        super().__init__(**{**kwargs, "width": width})

    def write(self, string: str) -> None:
        """Write a piece of finished help."""
        super().write(_shown(string))

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the line of usage."""
        super().write_usage(prog, _hidden(args), prefix)

    def write_text(self, text: str) -> None:
        """Write paragraphs."""
        super().write_text(_hidden(text))

    def write_dl(self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        """Write names and explanations; names take at most a third of the width."""
        hidden = [(_hidden(name), _hidden(text)) for name, text in rows]
        super().write_dl(hidden, min(col_max, self.width // 3), col_spacing)


click.Context.formatter_class = Formatter


class Command(click.Command):
    """A command that says where its group's help lists it: ``section``, and its ``place`` in that section, from 1."""

    def __init__(self, *args: Any, section: Section = Section.COMMANDS, place: int = 0, **kwargs: Any) -> None:
        """Keep the section and the place; the rest is click's."""
        super().__init__(*args, **kwargs)
        self.section = section
        self.place = place

    def get_help_option_names(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's interface
        """Return -h and --help, also for a command that no group has called: click takes the names from the group."""
        return ["-h", "--help"]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; click does not say which command an option without its value belongs to."""
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            error.ctx = error.ctx or ctx
            raise

    @property
    def examples(self) -> list[str]:
        """Lines of the examples at the end of the help."""
        _, _, after = (self.help or "").partition("Example:")
        return [line.strip() for line in after.splitlines() if line.strip().startswith("lutgen ")]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the options, and below them those that few users need."""
        records: dict[str, list[tuple[str, str]]] = {"Options": [], "Advanced": []}
        for option in self.get_params(ctx):
            record = option.get_help_record(ctx)
            if record:
                records["Advanced" if isinstance(option, Advanced) else "Options"].append(record)
        for heading, rows in records.items():
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)


class CommandFolder(Command, click.Group):
    """A group whose commands are the modules and packages of a folder; each of them has ``command``."""

    def __init__(self, *args: Any, folder: str, **kwargs: Any) -> None:
        """Take the commands in ``folder``, a package's dotted name; the rest is click's."""
        super().__init__(*args, **kwargs)
        self._folder = folder

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's interface
        """Name the modules of the folder."""
        return sorted(module.name for module in iter_modules(import_module(self._folder).__path__))

    def get_command(self, ctx: click.Context, cmd_name: str) -> Command | None:
        """Import one command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command: Command = import_module(f"{self._folder}.{cmd_name}").command
        return command

    def sections(self, ctx: click.Context) -> dict[Section, list[str]]:
        """Name the commands of each section, in the order of the help."""
        commands = [(name, command) for name in self.list_commands(ctx) if (command := self.get_command(ctx, name))]
        ordered = sorted(commands, key=lambda pair: (pair[1].place, pair[0]))
        names = {section: [name for name, command in ordered if command.section is section] for section in Section}
        return {section: of for section, of in names.items() if of}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the options and, by section, the commands."""
        super().format_options(ctx, formatter)
        self.format_commands(ctx, formatter)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands of each section, each with its whole first sentence: click would shorten it."""
        for section, names in self.sections(ctx).items():
            commands = [(name, self.get_command(ctx, name)) for name in names]
            with formatter.section(section.value):
                formatter.write_dl([(name, each.get_short_help_str(LONGEST)) for name, each in commands if each])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """For an unknown command, name the most similar one, or all."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError:
            from difflib import get_close_matches

            names = [name for of in self.sections(ctx).values() for name in of]
            near = get_close_matches(args[0].lower(), names, 1)
            advice = f"Did you mean {near[0]}?" if near else f"Pick one of: {', '.join(names)}."
            raise click.UsageError(f"No such command {args[0]!r}. {advice}", ctx) from None


class _TerminatedError(BaseException):
    """SIGTERM came: half-written files are removed before the process ends, as after Ctrl-C."""


@click.group(cls=CommandFolder, folder="lutgen.cli.commands", context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, "-V", "--version", prog_name="lutgen")
def group() -> None:
    """See through an aged display: LUTs and OpenColorIO configs from measurements of display aging.

    \b
    Example:
      lutgen build --hours 0..18000 -o aged/
      lutgen apply slide.png --mode chroma --hours 10000 -o aged.png

    Exit codes: 0 done, 1 a check failed, 2 bad input, 130 interrupted, 143 terminated.

    \b
    Shell completion (bash; zsh and fish alike):
      eval "$(_LUTGEN_COMPLETE=bash_source lutgen)"
    """


def run() -> int:
    """Run ``lutgen`` and return its exit code; an error becomes one sentence on standard error."""
    # Fits factorise thousands of small matrices: threads of BLAS would only wait for each other. Before numpy loads.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    tolerate_closed_pipes()
    # Only if no other handler is set, and only in the main thread: Python allows it nowhere else.
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _terminate)
    return _exit_code()


def _terminate(_signal: int, _frame: object) -> NoReturn:
    raise _TerminatedError


def _exit_code() -> int:
    try:
        code = group.main(prog_name="lutgen", standalone_mode=False)
        sys.stdout.flush()
    except click.UsageError as error:
        _explain(error)
    except click.ClickException as error:
        say(f"Error: {error.format_message()}", err=True)
    except LutgenError as error:
        say(f"lutgen: error: {error}", err=True)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        say(f"lutgen: error: {where}{reason_of(error)}.", err=True)
    except _TerminatedError:
        # Exit code of a program that SIGTERM has ended: 128 + the signal's number.
        return 143
    except (click.Abort, KeyboardInterrupt):
        return INTERRUPTED
    else:
        return code if isinstance(code, int) else 0
    return 2


def _explain(error: click.UsageError) -> None:
    """Say how the command is used, with its first example, and what was wrong."""
    if isinstance(error, getattr(click.exceptions, "NoArgsIsHelpError", ())):  # click has it from 8.2 on
        error.show()
        return
    if error.ctx:
        click.echo(error.ctx.get_usage(), err=True)
        command = error.ctx.command
        for example in command.examples[:1] if isinstance(command, Command) else ():
            click.echo(f"Example: {example}", err=True)
        say(f"Try '{error.ctx.command_path} --help' for help.\n", err=True)
    say(f"Error: {error.format_message()}", err=True)
