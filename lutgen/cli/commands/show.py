from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import model_from, model_options
from lutgen.cli.outputs import print_json, print_page

#: Number of rows without --hours.
_ROWS = 8


@click.command(cls=Command, section=Section.SIMULATE, place=4)
@click.option(
    "--hours",
    metavar="HOURS",
    help="0..18000: every measured time in the span; 0..18000:500: a step; 0,5000,10000: a list "
    f"[default: {_ROWS} of the measured times; --json: all of them].",
)
@click.option("--plot", metavar="FILE.png", help="Draw chromaticity, luminance and non-additivity against hours.")
@click.option("--force", is_flag=True, help="Replace FILE.png if it exists.")
@click.option("--json", "as_json", is_flag=True, help="Print all numbers as JSON.")
@model_options
def command(*, hours: str | None, plot: str | None, force: bool, as_json: bool, **options: Any) -> None:
    """Show how a display has aged: white point, primaries, luminance.

    Prints a summary of the readings in one sentence, then a table: x, y, Y and correlated colour temperature of white;
    Δu'v' of white and primaries since hour 0; the luminance of white relative to hour 0; and by how much R + G + B
    exceeds white.

    \b
    Example:
      lutgen show --plot display.png
      lutgen show --display my-display.csv --hours 0,5000,10000
    """
    from lutgen.display.aging import show
    from lutgen.display.tips import parse_hours
    from lutgen.report.drawing import check_new_png
    from lutgen.report.parts import Table

    if plot:
        check_new_png(plot, force=force)
    model = model_from(**options)
    chosen = parse_hours(hours, model.tips) if hours else None if as_json else model.tips.spread(_ROWS)
    shown = show(model, chosen)
    if plot:
        from lutgen.report.aging_plot import plot_display

        plot_display(model, plot, force=force)
    if as_json:
        print_json(shown.as_json())
        return
    heads = ("hours", "x", "y", "cd/m²", "CCT", "Δu'v'\nwhite", "\nred", "\ngreen", "\nblue", "Y/Y₀", "add.%")
    rows = []
    for row, hour in enumerate(shown.hours):
        x, y, luminance = shown.xyY[row, 0]
        white = (f"{hour:g}", f"{x:.4f}", f"{y:.4f}", f"{luminance:.1f}", f"{shown.cct[row]:.0f}")
        shifts = (f"{shift:.4f}" for shift in shown.shift[row])
        relative, excess = f"{shown.luminance[row, 0]:.3f}", f"{100 * shown.non_additivity[row]:+.2f}"
        rows.append((*white, *shifts, relative, excess))
    verdict = f" ({shown.verdict})" if shown.verdict else ""
    print_page(
        [
            shown.sentence(),
            f"{shown.provenance}\n",
            Table(heads, rows, words=()),
            "\nadd.: non-additivity of luminance, (R + G + B − W) / W.",
            *([f"\nThe model's effects{verdict}:"] if shown.effects else []),
            *shown.effects_in_words(),
            *shown.remarks,
            *([plot] if plot else []),
        ]
    )
