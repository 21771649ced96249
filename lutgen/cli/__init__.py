"""The command line: one module per command in ``lutgen/cli/commands``, found by its name; a folder is a group.

A command only reads options, calls the library and writes what it says. Modules are imported when they are needed,
and import what is slow inside the function that uses it: ``lutgen --help`` starts in under 0.3 s.
"""

from __future__ import annotations

import os
import sys

import click

from lutgen import __version__
from lutgen.cli.command_folder import CommandFolder
from lutgen.errors import LutgenError


@click.group(
    cls=CommandFolder,
    folder="lutgen.cli.commands",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, "-V", "--version", prog_name="lutgen")
def group() -> None:
    """See through an aged display: LUTs and OpenColorIO configs from measurements of display aging.

    \b
    Example:
      lutgen build --hours 0..18000 -o aged/
      lutgen apply slide.png --mode chroma --hours 10000 -o aged.png

    Exit codes: 0 done, 1 a check failed, 2 bad input.

    \b
    Shell completion (bash; zsh and fish alike):
      eval "$(_LUTGEN_COMPLETE=bash_source lutgen)"
    """


def main() -> None:
    """Run ``lutgen``: a LutgenError becomes one sentence and exit code 2."""
    # Fits factorise thousands of small matrices: threads of BLAS would only wait for each other. Before numpy loads.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        group(prog_name="lutgen")
    except LutgenError as error:
        click.echo(f"lutgen: error: {error}", err=True)
        sys.exit(2)
    except BrokenPipeError:
        # The reader of a pipe has seen enough; Python's own complaint at exit would be noise.
        sys.stderr.close()
        sys.exit(0)
