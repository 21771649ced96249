import sys
from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.data_options import data_options, question_from
from lutgen.cli.options import NumberFrom
from lutgen.cli.outputs import Outputs


@click.command(cls=Command, section=Section.CRITICISM, place=1)
@data_options(expressions=False)
@click.option(
    "--fail-above",
    type=NumberFrom(min=0.0, min_open=True),
    metavar="RATIO",
    help="Exit with 1 if the error is more than RATIO times the noise, such as 1.5.",
)
@click.option("--plots", metavar="DIR", help="Draw the residuals into this folder.")
def command(*, json_to: str | None, fail_above: float | None, plots: str | None, force: bool, **options: Any) -> None:
    """Show where the model fails on measurements, by how much, and in which direction.

    DATA are readings of more than white, red, green and blue: greys, ramps, mixtures, positions, room light, … DATA is
    a table (.csv), a .ti3 or CGATS file, an ICC profile with readings, or a campaign file. The report gives the error
    by hour, level, colour and condition, beside the error that noise alone would cause; the noise comes from the
    replicates in DATA. Without --fail-above the exit code is 0 for any result.

    \b
    Example:
      lutgen compare examples/display-a.csv
      lutgen compare examples/display-a.csv --plots plots/compare --json compare.json
      lutgen compare examples/display-a.csv --model my-display.toml --fail-above 1.5
    """
    if options["files"] and not options["model"]:
        raise click.UsageError(
            "compare needs --effects only to load --model, since it adds no effect. Use lutgen diagnose."
        )
    from lutgen.criticism.compare.comparison import compare
    from lutgen.numerals import times
    from lutgen.report.comparison import compare_page
    from lutgen.report.criticism_plots import OF_COMPARE, plot_comparison

    outputs = Outputs(json_to, plots=plots, pictures=lambda: OF_COMPARE, force=force)
    question = question_from(**options)
    comparison = compare(question.readings, **question.settings, terms=question.terms)
    outputs.write(
        compare_page(comparison, question.again),
        comparison.as_json,
        plot=lambda folder: plot_comparison(comparison, folder, force=force),
    )
    if fail_above is not None and comparison.ratio > fail_above:
        click.echo(f"{times(comparison.ratio)} the noise is more than --fail-above {fail_above:g}.", err=True)
        sys.exit(1)
