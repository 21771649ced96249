from pathlib import Path

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import json_option, replace_option
from lutgen.cli.outputs import Outputs, progress_bar


@click.command(name="inspect", cls=Command, section=Section.REAL_DISPLAYS, place=1)
@click.argument("files", metavar="DATA...", nargs=-1, required=True)
@json_option
@click.option("--plots", metavar="DIR", help="Draw one page for each session into this folder.")
@replace_option
def command(*, files: tuple[str, ...], json_to: str | None, plots: str | None, force: bool) -> None:
    """Show what sessions of real displays contain: white, black, curves, drift, calibration, and what is missing.

    DATA is the output of a measuring program: ArgyllCMS or DisplayCAL .ti3, an ICC profile that carries a .ti3, other
    CGATS, a CSV of patches, DisplayCAL's uniformity table. DATA may also hold several sessions: a campaign file
    (.toml), a table of readings (.csv) with hours, a folder. No model is needed. γ is the least-squares slope of log
    luminance, with black subtracted, between 10 and 90 % of code. The exit code is 0 for any result.

    \b
    Example:
      lutgen inspect examples/session.ti3
      lutgen inspect examples/session.ti3 --plots plots/inspect --json inspect.json
    """
    from lutgen.history import Inspection, inspect_session
    from lutgen.readings import read_campaign
    from lutgen.report.inspection import inspect_page, picture_names, plot_inspection

    outputs = Outputs(json_to, force=force)
    inspections: list[Inspection] = []
    with progress_bar("inspecting", quiet=outputs.alone) as progress:
        for number, file in enumerate(files):
            entries = read_campaign(file).entries
            total = len(inspections) + len(entries) + len(files) - number - 1
            for entry in entries:
                progress(len(inspections), total)
                inspections.append(inspect_session(entry.session))
    # Checked only now, since the pictures have the names of the sessions.
    names = picture_names([each.session.file for each in inspections]) if plots else []
    outputs = Outputs(json_to, plots=plots, pictures=lambda: names, force=force)

    def plot(folder: str) -> list[Path]:
        paths = [Path(folder) / name for name in names]
        with progress_bar("drawing", quiet=outputs.alone) as progress:
            for number, (each, path) in enumerate(zip(inspections, paths, strict=True)):
                progress(number, len(inspections))
                plot_inspection(each, path, force=force)
        return paths

    outputs.write(
        inspect_page(inspections),
        lambda: {"schema": 1, "sessions": [each.as_json() for each in inspections]},
        plot=plot,
    )
