import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import NUMBER, Choice, json_option, replace_option, say_remarks
from lutgen.cli.outputs import Outputs, progress_bar
from lutgen.errors import LutgenError
from lutgen.files import check_new_file
from lutgen.names import DRIFT, LIMIT_SETS, TG18_SECONDARY

#: Largest luminance of room light on the screen, cd/m²: with more light no image is visible.
MOST_AMBIENT = 1000.0


@click.command(cls=Command, section=Section.REAL_DISPLAYS, place=3)
@click.argument("files", nargs=-1, required=True, metavar="DATA...")
@click.option(
    "--limits",
    "sets",
    type=Choice(LIMIT_SETS),
    multiple=True,
    help="A published set; may be repeated [default: tg18-secondary and drift].",
)
@click.option(
    "--limit", "own", metavar="TEXT", multiple=True, help="Your own limit: white>=200, white>=80%, contrast>=300, …"
)
@click.option(
    "--ambient",
    type=NUMBER,
    default=0.0,
    metavar="CD_M2",
    help="Luminance that the room adds to the screen, for sessions that were read without room light: for contrast, "
    "the DICOM curve, and the ratio of room light to black [default: 0].",
)
@click.option("--all-sessions", is_flag=True, help="Use all sessions, even if a setting or the instrument changed.")
@click.option(
    "--reference",
    metavar="FILE",
    help="The session with which the others are compared [default: the one from which the most sessions differ by "
    "nothing but age].",
)
@click.option("--plot", metavar="FILE", help="Draw figures, laws and limits (.png).")
@json_option
@replace_option
def command(
    *,
    files: tuple[str, ...],
    sets: tuple[str, ...],
    own: tuple[str, ...],
    ambient: float,
    all_sessions: bool,
    reference: str | None,
    plot: str | None,
    json_to: str | None,
    force: bool,
) -> None:
    """Follow a display over its sessions, and say when it will pass each limit.

    DATA is a campaign file (lutgen sessions init), sessions of any format with their dates, a folder of sessions, or a
    table of readings (.csv) with hours. The report follows white, black, contrast, primaries and γ, and weighs all laws
    of decay by their evidence. A time after the last session is marked as an extrapolation; intervals are 90 %.
    Sessions in which a setting or the instrument changed against a reference session are left out. The exit code is 0
    for any result.

    \b
    Example:
      lutgen trend examples/campaign/campaign.toml
      lutgen trend examples/campaign/campaign.toml --limit 'white>=80%' --plot trend.png --json trend.json
    """
    from lutgen.history.history import limits_of, parse_limit
    from lutgen.history.trend import trend, trend_as_json
    from lutgen.readings import read_campaign
    from lutgen.report.trend import plot_trend, trend_page

    if not 0 <= ambient <= MOST_AMBIENT:
        raise LutgenError(
            f"--ambient {ambient:g}: give the luminance of a dark screen in the lit room, 0 to {MOST_AMBIENT:g} cd/m²."
        )
    if all_sessions and reference:
        raise LutgenError("--all-sessions compares no sessions: leave out --reference, or --all-sessions.")
    outputs = Outputs(json_to, force=force)
    path = check_new_file(plot, force=force, suffixes=(".png",)) if plot else None
    chosen = sets or (() if own else (TG18_SECONDARY, DRIFT))
    limits = [*(limit for name in chosen for limit in limits_of(name)), *(parse_limit(text) for text in own)]
    campaign = read_campaign(*files)
    say_remarks(*(entry.session for entry in campaign.entries))
    with progress_bar("following", quiet=outputs.alone) as progress:
        result = trend(
            campaign,
            limits,
            all_sessions=all_sessions,
            ambient_cd_m2=ambient,
            reference=reference,
            progress=progress,
        )
    if path:
        plot_trend(result, path, force=force)
    outputs.write([*trend_page(result), *([f"Picture: {path}"] if path else [])], lambda: trend_as_json(result))
