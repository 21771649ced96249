"""The command line: one module per command in ``lutgen/cli/commands``, found by its name; a folder is a group.

A command only reads options, calls the library and writes the results: first files, then sentences. A command's module
is imported when the command runs, and functions import slow modules themselves, so that ``--help`` answers at once. A
further file in this folder contains code that several commands share.
"""

import sys

from lutgen.errors import INTERRUPTED


def main() -> None:
    """Run ``lutgen`` and exit with its code; an error becomes one sentence on standard error."""
    try:
        # Imported here, so that Ctrl-C while modules load ends the program without a traceback too.
        from lutgen.cli.command import run

        code = run()
    except KeyboardInterrupt:
        code = INTERRUPTED
    if code == INTERRUPTED:
        # When KeyboardInterrupt passes through exec(), which dataclasses call while modules load, Python records the
        # interrupt and later ends by the signal, whatever the exit code. Another exec() clears that record.
        exec("")  # noqa: S102
    sys.exit(code)
