"""``Command``, ``CommandFolder``, the group ``lutgen``, and the handling of errors, signals and exit codes.

A module of a group's folder holds one command, named ``command``; a package of the folder holds a group. The help of
the group lists the commands by section, and the help of a command lists rarely needed options under "Advanced".
"""

import os
import re
import signal
import sys
import threading
from collections.abc import Iterable
from enum import Enum
from importlib import import_module
from io import TextIOWrapper
from itertools import pairwise
from pathlib import Path
from pkgutil import iter_modules
from shutil import get_terminal_size
from typing import Any, NoReturn

import click
from click.core import ParameterSource

from lutgen.cli.outputs import STANDARD_OUTPUT, say, tolerate_closed_pipes, with_fixed_spaces, with_plain_spaces
from lutgen.errors import INTERRUPTED, LutgenError, reason_of
from lutgen.files import bytes_at_most, is_file
from lutgen.version import __version__

#: Largest length of a command's first sentence, in letters: click shortens longer sentences with "...".
LONGEST = 1000

#: Largest width of help, in letters.
WIDEST = 100

#: Largest .toml file in which names of files are searched, in bytes.
LARGEST_TOML = 1_000_000

#: Names of the parameters that name a file to write.
OUTPUTS = frozenset({"output", "outputs", "json_to", "csv_to", "plot", "labels", "stub", "ti1"})


class Section(Enum):
    """Headings of the groups of commands in ``lutgen --help``, in the order of the help."""

    SIMULATE = "Simulate"
    CRITICISM = "Find what the model misses"
    REAL_DISPLAYS = "Real displays"
    PICTURES = "Pictures"
    READER_STUDY = "Reader study"
    OTHERS_FILES = "Other people's files"
    COMMANDS = "Commands"


class Advanced(click.Option):
    """An option that few users need: the help lists it last, under "Advanced"."""


def _unbreakable(text: str) -> str:
    """Replace hyphens and the spaces in numbers, at which click breaks lines: --source-space, 18 000."""
    return with_fixed_spaces(text).replace("-", "\u2011")


def _readable(text: str) -> str:
    """Undo :func:`_unbreakable`."""
    return with_plain_spaces(text).replace("\u2011", "-")


class Formatter(click.HelpFormatter):
    """Help as wide as the terminal, up to ``WIDEST``, wrapped only at spaces."""

    def __init__(self, **kwargs: Any) -> None:
        """Use the terminal's width instead of click's."""
        # The smallest width is that of an option's name and two short words.
        width = max(min(get_terminal_size().columns, WIDEST) - 2, 20)
        super().__init__(**{**kwargs, "width": width})

    def write(self, string: str) -> None:
        """Write a piece of finished help."""
        super().write(_readable(string))

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the line of usage."""
        super().write_usage(prog, _unbreakable(args), prefix)

    def write_text(self, text: str) -> None:
        """Write paragraphs."""
        super().write_text(_unbreakable(text))

    def write_dl(self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        """Write names and explanations; names take at most a third of the width."""
        unbreakable = [(_unbreakable(name), _unbreakable(text)) for name, text in rows]
        super().write_dl(unbreakable, min(col_max, self.width // 3), col_spacing)


click.Context.formatter_class = Formatter


class Command(click.Command):
    """A command with its place in the help of its group: the ``section``, and the ``place`` in that section, from 1."""

    def __init__(self, *args: Any, section: Section = Section.COMMANDS, place: int = 0, **kwargs: Any) -> None:
        """Store the section and the place; click takes the other arguments."""
        super().__init__(*args, **kwargs)
        self.section = section
        self.place = place

    def get_help_option_names(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's interface
        """Return -h and --help. click takes these names from the calling group; a command may run without a group."""
        return ["-h", "--help"]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments. Errors name the command, which click omits for an option without its value.

        If a command without arguments gets one, the error names --display, if the command has this option.
        """
        self._check_values(ctx, args)
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            error.ctx = error.ctx or ctx
            takes_none = not any(isinstance(each, click.Argument) for each in self.params)
            takes_display = any(each.name == "display" for each in self.params)
            if "unexpected extra argument" in error.message and takes_none and takes_display:
                raise click.UsageError(f"{error.message}. Give readings with --display.", error.ctx) from None
            raise

    def _check_values(self, ctx: click.Context, args: list[str]) -> None:
        """Raise click.UsageError for an option that takes the name of the next option as its value, as click allows."""
        options = {name: option for option in self.get_params(ctx) for name in option.opts if name.startswith("-")}
        for name, value in pairwise(args):
            if name == "--":
                return
            option = options.get(name)
            if isinstance(option, click.Option) and not option.is_flag and not option.count and value in options:
                # ``make_metavar`` has another signature before click 8.2; the help has the same word in both.
                asked = (option.get_help_record(ctx) or (name, ""))[0].rpartition(" ")[2]
                raise click.UsageError(f"{name} needs a value: {asked}.", ctx)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command. Raises LutgenError: it would write a file that it reads, or two outputs into one file."""
        given = [(option, _paths(ctx.params.get(option.name or ""))) for option in self.get_params(ctx)]
        inputs = [path for option, paths in given if option.name not in OUTPUTS for path in paths if is_file(path)]
        read = [*inputs, *(named for path in inputs if path.suffix == ".toml" for named in _named_in(path))]
        written: dict[str, str] = {}
        for option, paths in given:
            name = option.opts[0]
            for path in paths if option.name in OUTPUTS else ():
                if is_file(path) and any(path.samefile(other) for other in read):
                    raise LutgenError(
                        f"{path}: is an input of this command, and is never written to. Choose another name for {name}."
                    )
                if other := written.get(os.path.realpath(path)):
                    both = f"twice with {name}" if other == name else f"with {other} and with {name}"
                    raise LutgenError(f"{path}: is given {both}. Give each output a name of its own.")
                written[os.path.realpath(path)] = name
        try:
            return super().invoke(ctx)
        except LutgenError as error:
            if example := self._example_for(ctx, str(error)):
                error.add_note(f"Example: {example}")
            raise

    def _example_for(self, ctx: click.Context, message: str) -> str:
        """Return an example of the option whose given value is the subject of a message; "" if there is none."""
        for option in self.get_params(ctx):
            name = option.opts[0]
            if ctx.get_parameter_source(option.name or "") is not ParameterSource.COMMANDLINE:
                continue
            texts = _texts(ctx.params.get(option.name or ""))
            values = {part.strip() for text in texts for part in text.split(",")} - {""}
            named = isinstance(option, click.Option) and re.match(rf"{name}(?![\w-])", message)
            of_option = named and any(value in message for value in values)
            if of_option or (message.startswith("unknown ") and any(repr(value) in message for value in values)):
                return next((each for each in self.examples if f"{name} " in each), next(iter(self.examples), ""))
        return ""

    @property
    def examples(self) -> list[str]:
        """Lines of the examples at the end of the help."""
        _, _, after = (self.help or "").partition("Example:")
        return [line.strip() for line in after.splitlines() if line.strip().startswith("lutgen ")]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the options, and then the options that few users need."""
        records: dict[str, list[tuple[str, str]]] = {"Options": [], "Advanced": []}
        for option in self.get_params(ctx):
            record = option.get_help_record(ctx)
            if record:
                records["Advanced" if isinstance(option, Advanced) else "Options"].append(record)
        for heading, rows in records.items():
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)


def _texts(value: object) -> list[str]:
    """Return the texts of a parameter with one value or several."""
    return [str(each) for each in (value if isinstance(value, tuple) else (value,)) if isinstance(each, str | int)]


def _paths(value: object) -> list[Path]:
    """Return the paths that a parameter with one text or several may name."""
    texts = value if isinstance(value, tuple) else (value,)
    return [Path(text) for text in texts if isinstance(text, str) and text != STANDARD_OUTPUT]


def _named_in(path: Path) -> list[Path]:
    """Return the files that a .toml file names, as a campaign file names its sessions."""
    from lutgen.documents import from_toml, values_in

    try:
        content = from_toml(bytes_at_most(path, LARGEST_TOML, none="").decode("utf-8"))
    except (OSError, ValueError):
        return []  # the command itself says why the file cannot be read
    return [named for text in values_in(content) if isinstance(text, str) and is_file(named := path.parent / text)]


class CommandFolder(Command, click.Group):
    """A group whose commands are the modules and packages of a folder; each module or package defines ``command``."""

    def __init__(self, *args: Any, folder: str, **kwargs: Any) -> None:
        """Store ``folder``, the dotted name of the package with the commands; click takes the other arguments."""
        super().__init__(*args, **kwargs)
        self._folder = folder

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's interface
        """Return the names of the folder's modules."""
        return sorted(module.name for module in iter_modules(import_module(self._folder).__path__))

    def get_command(self, ctx: click.Context, cmd_name: str) -> Command | None:
        """Import and return one command; None if the folder has no such command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command: Command = import_module(f"{self._folder}.{cmd_name}").command
        return command

    def sections(self, ctx: click.Context) -> dict[Section, list[str]]:
        """Return the names of the commands of each section, in the order of the help."""
        commands = [(name, command) for name in self.list_commands(ctx) if (command := self.get_command(ctx, name))]
        ordered = sorted(commands, key=lambda pair: (pair[1].place, pair[0]))
        by_section = {section: [name for name, command in ordered if command.section is section] for section in Section}
        return {section: names for section, names in by_section.items() if names}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the options and, by section, the commands."""
        super().format_options(ctx, formatter)
        self.format_commands(ctx, formatter)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands of each section, each with its complete first sentence, which click would shorten."""
        for section, names in self.sections(ctx).items():
            commands = [(name, self.get_command(ctx, name)) for name in names]
            with formatter.section(section.value):
                formatter.write_dl([(name, each.get_short_help_str(LONGEST)) for name, each in commands if each])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Resolve a command; the error for an unknown command names the most similar command, or all commands."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError:
            from difflib import get_close_matches

            names = [name for section in self.sections(ctx).values() for name in section]
            near = get_close_matches(args[0].lower(), names, 1)
            advice = f"Did you mean {near[0]}?" if near else f"Pick one of: {', '.join(names)}."
            raise click.UsageError(f"No such command {args[0]!r}. {advice}", ctx) from None


class _TerminatedError(BaseException):
    """Raised on SIGTERM, so that half-written files are removed before the process ends, as after Ctrl-C."""


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
    # Fits factorise thousands of small matrices, for which several threads of BLAS are slower. Set before numpy loads.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    tolerate_closed_pipes()
    # Print "?" for a letter that the terminal's encoding lacks, instead of an error.
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
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
        say("\n".join((f"lutgen: error: {error}", *getattr(error, "__notes__", ()))), err=True)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        say(f"lutgen: error: {where}{reason_of(error)}.", err=True)
    except UnicodeEncodeError as error:
        # Only file names, which may be any bytes, can contain what no encoding has.
        near = error.object[max(error.start - 40, 0) : error.end + 40].split("\n")[0]
        say(f"lutgen: error: {near!r}: holds a name that is no UTF-8, which cannot be written. Rename it.", err=True)
    except _TerminatedError:
        # Exit code of a program that SIGTERM has ended: 128 + the signal's number.
        return 143
    except (click.Abort, KeyboardInterrupt):
        return INTERRUPTED
    else:
        return code if isinstance(code, int) else 0
    return 2


def _explain(error: click.UsageError) -> None:
    """Print the usage of the command, its first example, and the error."""
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
