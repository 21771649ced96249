import click

from lutgen.cli.command import Command
from lutgen.cli.options import json_option, replace_option, say_remarks
from lutgen.cli.outputs import Outputs, progress_bar


@click.command(cls=Command)
@click.argument("files", nargs=-1, required=True, metavar="DATA...")
@click.option("--reference", metavar="FILE", help="The reference session [default: the first session without a fault].")
@json_option
@replace_option
def command(*, files: tuple[str, ...], reference: str | None, json_to: str | None, force: bool) -> None:
    """Explain why sessions of one display differ: display, settings, room, or instrument.

    DATA is a campaign file (.toml), which holds dates, instruments and settings, or sessions of any format, a folder of
    sessions, or a table of readings (.csv) with hours.

    lutgen compares each session with a reference session. The possible causes are brightness or preset, gamut mode,
    calibration, HDR or dynamic contrast, clipped levels, room light, the instrument or its correction, drift during the
    session, a misread patch, another display, and true aging. If several causes fit equally well, the report names all
    of them, and the measurement that would separate them. The exit code is 0 for any result.

    \b
    Example:
      lutgen sessions explain examples/campaign/campaign.toml
      lutgen sessions explain examples/campaign/2021-01.ti3 examples/campaign/2022-01.ti3
      lutgen sessions explain examples/campaign/campaign.toml --reference 2021-06.ti3 --json explain.json
    """
    from lutgen.history.explain import explain, explanations_as_json
    from lutgen.readings import read_campaign
    from lutgen.report.inspection import explanation_page

    outputs = Outputs(json_to, force=force)
    campaign = read_campaign(*files)
    say_remarks(*(entry.session for entry in campaign.entries))
    with progress_bar("explaining", quiet=outputs.alone) as progress:
        explanations = explain(campaign, reference=reference, progress=progress)
    outputs.write(explanation_page(explanations), lambda: explanations_as_json(explanations))
