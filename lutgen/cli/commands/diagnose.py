from pathlib import Path
from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.data_options import data_options, question_from, split_all
from lutgen.cli.outputs import Outputs, progress_bar
from lutgen.files import check_new_file, write_atomically


@click.command(cls=Command, section=Section.CRITICISM, place=2)
@data_options()
@click.option(
    "--without", multiple=True, metavar="NAME", callback=split_all, help="Leave out these effects, separated by commas."
)
@click.option("--stub", metavar="FILE.py", help="Write a draft of your own effect, derived from the residual.")
@click.option("--verbose", is_flag=True, help="Also print the fit of each effect alone.")
@click.option("--plots", metavar="DIR", help="Draw residuals, steps, fit and visibility into this folder.")
def command(
    *,
    without: tuple[str, ...],
    stub: str | None,
    json_to: str | None,
    verbose: bool,
    plots: str | None,
    force: bool,
    **options: Any,
) -> None:
    """Find out which physical effect the model lacks on these measurements.

    The first line is the verdict (consistent, named, form, one-of, several, unexplained or measurement-problem) in one
    sentence. Then come the error before and after, the command to run next, the parameters, the rivals, the
    measurements that would separate the rivals or refute the verdict, and the smallest size of each effect that these
    readings can show. The exit code is 0 for any result.

    \b
    Example:
      lutgen diagnose examples/display-a.csv
      lutgen diagnose examples/display-a.csv --without black-level --plots plots/diagnose --json diagnosis.json
    """
    from lutgen.criticism.diagnose import diagnose
    from lutgen.report.criticism_plots import OF_DIAGNOSE, plot_diagnosis
    from lutgen.report.diagnosis import diagnose_page

    outputs = Outputs(json_to, plots=plots, pictures=lambda: OF_DIAGNOSE, force=force)
    if stub:
        check_new_file(stub, force=force, suffixes=(".py",))
    question = question_from(**options)
    with progress_bar("trying effects", quiet=outputs.alone) as progress:
        diagnosis = diagnose(question.readings, **question.search, without=without, progress=progress)
    if stub and diagnosis.verdict.name == "consistent":
        click.echo(f"{stub} is not written: no residual is left that an effect of your own could explain.", err=True)
        stub = None
    if stub:
        from lutgen.report.effect_sketch import sketch

        write_atomically(Path(stub), sketch(diagnosis).encode())
    outputs.write(
        diagnose_page(diagnosis, question.effects, question.again, stub, verbose=verbose),
        diagnosis.as_json,
        plot=lambda folder: plot_diagnosis(diagnosis, question.effects, folder, force=force),
    )
