"""``lutgen`` as a group of commands, and what becomes of errors, signals and exit codes."""

from __future__ import annotations

import os
import signal
import sys
import threading
from typing import NoReturn

import click

from lutgen import __version__
from lutgen.cli import INTERRUPTED
from lutgen.cli.command import Command, CommandFolder
from lutgen.cli.terminal import say, tolerate_closed_pipes
from lutgen.errors import LutgenError, reason_of

#: Exit code of a program that SIGTERM has ended: 128 + the signal's number.
TERMINATED = 143


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
    _end_at_sigterm()
    return _exit_code()


def _end_at_sigterm() -> None:
    # Only if no other handler is set, and only in the main thread: Python allows it nowhere else.
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _terminate)


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
        return TERMINATED
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
