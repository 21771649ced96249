import click

from lutgen.cli.command import Command
from lutgen.cli.options import WHOLE, json_option, replace_option
from lutgen.cli.outputs import Outputs


@click.command(cls=Command)
@click.option(
    "--per-condition", type=WHOLE, default=40, show_default=True, metavar="N", help="Images per condition and reader."
)
@click.option("--readers", type=WHOLE, default=1, show_default=True, metavar="R", help="How many readers.")
@json_option
@click.option("--plots", metavar="DIR", help="Draw power against answers per condition, into this folder.")
@replace_option
def command(*, per_condition: int, readers: int, json_to: str | None, plots: str | None, force: bool) -> None:
    """Say what a reader study of this size can find: the smallest differences, and the power for those in the paper.

    At 80 % power and a level of 5 %, by the paper's tests: two-sample t on time to score and ease of reading;
    one-tailed t on 0/1 values, and Fisher's exact test, on agreement between two reading sessions. The command needs no
    planned study.

    \b
    Example:
      lutgen study power --per-condition 40
      lutgen study power --per-condition 60 --readers 2 --plots plots/power
    """
    from lutgen.report.study_plan import PICTURE, plot_power, power_page
    from lutgen.study.power import study_power

    outputs = Outputs(json_to, plots=plots, pictures=lambda: [PICTURE], force=force)
    result = study_power(per_condition, readers)
    outputs.write(power_page(result), result.as_json, plot=lambda folder: [plot_power(result, folder, force=force)])
