from dataclasses import replace
from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.data_options import data_options, question_from, split_all
from lutgen.cli.outputs import Outputs, progress_bar
from lutgen.files import check_new_file


@click.command(cls=Command, section=Section.CRITICISM, place=3)
@data_options()
@click.option(
    "--add",
    multiple=True,
    metavar="NAME",
    callback=split_all,
    help="Effects to add, in this order, separated by commas.",
)
@click.option("--auto", is_flag=True, help="Add every effect that a diagnosis names.")
@click.option(
    "--luminance",
    metavar="LAW",
    help="Luminance of chroma-luma in the model: paper, measured, or a .csv of hour,factor [default: measured, or "
    "luminance_law of the file of readings].",
)
@click.option("--plots", metavar="DIR", help="Draw residuals, steps and fit into this folder.")
@click.option("-o", "--output", metavar="MODEL.toml", help="Write the refined model here.")
@click.option("--keep", is_flag=True, help="Write the model even if the error does not fall or nothing is added.")
def command(
    *,
    add: tuple[str, ...],
    auto: bool,
    json_to: str | None,
    plots: str | None,
    force: bool,
    output: str | None,
    keep: bool,
    luminance: str | None,
    **options: Any,
) -> None:
    """Add effects to the model, fit everything again, and print how the error falls toward the noise.

    Adds built-in effects, effects of a file (--effects FILE --add NAME) or a formula (--add-expr), each in the form
    that the readings support. The model file holds parameters, errors and provenance; use it with lutgen build --model.
    If the error, or the error of held-out readings, does not fall, or if --auto finds nothing to add, nothing is
    written and the exit code is 1. --keep writes the model in these cases too.

    \b
    Example:
      lutgen refine examples/display-a.csv --add black-level -o my-display.toml
      lutgen refine examples/display-a.csv --add-expr "leak: xyz + k*tau*white" --json -
      lutgen refine examples/display-a.csv --auto --plots plots/refine
    """
    if not (add or auto or options["expressions"]):
        raise click.UsageError("Say what to add: --add NAME, --add-expr TEXT or --auto.")
    from lutgen.criticism.refine import refine
    from lutgen.display import save_model
    from lutgen.display.tips import luminance_law
    from lutgen.report.criticism_plots import OF_REFINE, plot_refinement
    from lutgen.report.diagnosis import refine_page

    outputs = Outputs(json_to, plots=plots, pictures=lambda: OF_REFINE, force=force)
    if output:
        check_new_file(output, force=force, suffixes=(".toml",))
    question = question_from(**options)
    with progress_bar("trying effects", quiet=outputs.alone) as progress:
        added = (*add, *question.own)
        refinement = refine(question.readings, added, auto=auto, **question.search, progress=progress)
    refinement = refinement.of_saved(question.saved)
    if luminance:
        refinement = replace(refinement, model=replace(refinement.model, luminance=luminance_law(luminance)))
    kept = refinement.improves or keep
    if output and kept:
        save_model(refinement.to_save, output, force=force)
    output = output if kept else None
    outputs.write(
        refine_page(refinement, question.effects, question.data, output),
        lambda: refinement.as_json(output),
        plot=lambda folder: plot_refinement(refinement, question.effects, folder, force=force),
    )
    if not kept:
        click.echo(f"{refinement.no_gain()}, so no model is written. Add --keep to write it all the same.", err=True)
        raise click.exceptions.Exit(1)
