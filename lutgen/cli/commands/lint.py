import sys

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.outputs import Outputs, progress_bar


@click.command(cls=Command, section=Section.OTHERS_FILES, place=1)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@click.option("--try", "ask_readers", is_flag=True, help="Read the file with the installed readers, and compare.")
@click.option("--json", "json_to", metavar="FILE", help="Write the result as JSON; - is standard output.")
@click.option("--force", is_flag=True, help="Replace the JSON file if it exists.")
def command(*, files: tuple[str, ...], ask_readers: bool, json_to: str | None, force: bool) -> None:
    """Say what each program does with a LUT, profile or config, whoever made it; exit 1 when one gets it wrong.

    Reads .cube, .clf, .ctf, .3dl, .spi3d, .csp, .ocio, .ocioz, ICC profiles, device links and Hald PNG of any size, and
    says which programs read the file, refuse it, or silently show something else, why, and what to do: OpenColorIO (and
    therefore oiiotool, Blender and Nuke), ffmpeg, pillow_lut, colour, LittleCMS, Argyll and Chromium. --try runs the
    installed readers of .cube and configs, and compares their results.

    \b
    error    a program silently shows something else,
             or no program reads the file                exit 1
    warning  a program refuses the file                  exit 1
    note     every program shows what is meant           exit 0

    \b
    Example:
      lutgen lint theirs.cube theirs.clf --try
      lutgen lint aged/config.ocio --json -
    """
    from lutgen.lint import lint
    from lutgen.report.lut_files import lint_page

    outputs = Outputs(json_to, force=force)
    results = []
    with progress_bar("reading", quiet=outputs.alone) as progress:
        for place, file in enumerate(files):
            results.append(lint(file, ask_readers=ask_readers))
            progress(place + 1, len(files))
    page = (part for result in results for part in lint_page(result))
    outputs.write(page, lambda: {"schema": 1, "files": [result.as_json() for result in results]})
    if not all(result.clean for result in results):
        sys.exit(1)
