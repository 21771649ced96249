"""The command line: one module per command in ``lutgen/cli/commands``, found by its name; a folder is a group.

A command only reads options, calls the library and writes the results: files first, sentences after. Modules are
imported when they are needed, and import what is slow inside the function that uses it: ``lutgen --help`` takes 40 ms.
One more file here serves several commands.
"""

from __future__ import annotations

import sys

#: Exit code of a program that SIGINT (Ctrl-C) has ended: 128 + the signal's number.
INTERRUPTED = 130


def main() -> None:
    """Run ``lutgen`` and exit with its code; an error becomes one sentence on standard error."""
    try:
        # Imported here, so that Ctrl-C while modules load ends the program without a traceback too.
        from lutgen.cli.command import run

        code = run()
    except KeyboardInterrupt:
        code = INTERRUPTED
    if code == INTERRUPTED:
        # Where an interrupt passes through a text that Python runs, as dataclasses do while modules load, Python notes
        # it, and ends by the signal whatever the code. Another text makes it forget.
        exec("")  # noqa: S102
    sys.exit(code)
