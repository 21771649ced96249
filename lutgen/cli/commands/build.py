from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lutgen.bake.formats import format_names
from lutgen.cli.command import Advanced, Command, Section
from lutgen.cli.options import NUMBER, WHOLE, Choice, WholeFrom, hours_option, model_from, model_options, split_list
from lutgen.cli.outputs import print_json, progress_bar, say
from lutgen.names import AGING_MODES, DIRECTIONS, MODES, UNREACHABLE

if TYPE_CHECKING:
    from lutgen.bake.build import Built
    from lutgen.bake.plan import BuildPlan


def _modes(context: click.Context, option: click.Parameter, text: str) -> tuple[str, ...]:
    modes = split_list(context, option, text)
    return tuple(MODES) if "all" in modes else modes


@click.command(cls=Command, section=Section.SIMULATE, place=1)
@hours_option
@click.option(
    "--mode",
    "modes",
    default=",".join(AGING_MODES),
    show_default=True,
    callback=_modes,
    metavar="LIST",
    help=f"Aging modes, separated by commas: {', '.join(AGING_MODES)}, stable (the un-aged display at every hour), or "
    "all.",
)
@click.option(
    "--format",
    "formats",
    default="cube,clf",
    show_default=True,
    callback=split_list,
    metavar="LIST",
    help=f"LUT formats, separated by commas: {', '.join(format_names())}.",
)
@click.option(
    "--source-profile",
    cls=Advanced,
    type=click.Path(),
    metavar="FILE",
    help="With --format icc: the scanner's ICC profile, which lutgen combines with the aged display in one profile.",
)
@click.option("-o", "--output", default="aged", show_default=True, metavar="DIR", help="Folder to build into.")
@click.option("--force", is_flag=True, help="Replace another build of lutgen in the folder.")
@click.option(
    "--direction",
    type=Choice(DIRECTIONS),
    default="simulate",
    show_default=True,
    help="simulate: what the aged display shows; compensate: the correction that makes this one display look un-aged.",
)
@click.option(
    "--unreachable",
    cls=Advanced,
    type=Choice(UNREACHABLE),
    help="With compensate, for colours that the display cannot show any more: clip each channel of the drive, or scale "
    "all colours down to a dimmer picture [default: clip].",
)
@click.option(
    "--cubesize", cls=Advanced, type=WHOLE, default=33, show_default=True, help="Points along an edge: 17, 33 or 65."
)
@click.option(
    "--tolerance",
    cls=Advanced,
    type=NUMBER,
    metavar="ΔE",
    help="Take the smallest size whose smooth errors stay below this ΔE2000.",
)
@click.option(
    "--no-certificates", cls=Advanced, is_flag=True, help="Do not read the files back and compare them with the model."
)
@click.option(
    "--gpu", cls=Advanced, is_flag=True, help="Run the configs' shaders too, and record the difference from the CPU."
)
@click.option("--verbose", is_flag=True, help="Print the errors of each mode, format and group of colours.")
@click.option("--jobs", cls=Advanced, type=WholeFrom(min=1), help="Processes [default: one per core].")
@click.option("--json", "as_json", cls=Advanced, is_flag=True, help="Print the manifest as JSON.")
@model_options
def command(
    *,
    hours: str | None,
    modes: tuple[str, ...],
    formats: tuple[str, ...],
    source_profile: str | None,
    direction: str,
    unreachable: str | None,
    cubesize: int,
    tolerance: float | None,
    no_certificates: bool,
    gpu: bool,
    verbose: bool,
    jobs: int | None,
    force: bool,
    as_json: bool,
    output: str,
    **options: Any,
) -> None:
    """Bake aged displays into LUTs and OpenColorIO configs, one per aging mode and hour.

    Writes DIR/manifest.json, DIR/config.ocio (every display, by context variables) and for each mode and hour a folder
    such as DIR/chroma/10000h with its own config.ocio and LUTs. lutgen reads every different table back through
    OpenColorIO and compares it with the model; the figures are in the manifest. With --direction compensate, lutgen
    compares what the aged display then shows with the un-aged display, and prints the share of colours out of reach.

    \b
    Example:
      lutgen build --hours 0..18000 -o aged/
      lutgen build --direction compensate --unreachable scale --hours 10000,18000 -o dimmed/
      lutgen build --hours 10000 --mode chroma --format clf --selection continuous -o aged-10000/
      lutgen build --hours 10000 --format icc,hald,resolve -o aged-icc/
      lutgen build --hours 10000 --format icc --source-profile scanner.icc -o aged-slides/
    """
    from lutgen.bake.build import build
    from lutgen.bake.folder import is_unfinished
    from lutgen.bake.littlecms import read_source_profile
    from lutgen.bake.plan import BuildPlan
    from lutgen.display import what_luts_carry
    from lutgen.display.tips import parse_hours

    if unreachable and direction != "compensate":
        raise click.UsageError("--unreachable goes with --direction compensate.")
    model = model_from(**options)
    plan = BuildPlan(
        tuple(parse_hours(hours, model.tips)),
        modes=modes,
        formats=formats,
        cubesize=cubesize,
        tolerance=tolerance,
        certify=not no_certificates,
        direction=direction,
        unreachable=unreachable or "clip",
        gpu=gpu,
        source=read_source_profile(source_profile) if source_profile else None,
    )
    try:
        with progress_bar("building", quiet=as_json) as progress:
            built = build(model, plan, output, jobs=jobs, force=force, progress=progress)
    except KeyboardInterrupt:
        if is_unfinished(Path(output)):
            kept = f"{output} keeps the finished files"
            say(f"Interrupted. {kept}; the same command continues with the others.", err=True)
        raise
    if as_json:
        print_json(built.manifest.as_json())
    else:
        if "chroma-luma" in modes:
            say(model.luminance.sentence())
        _report(built, plan, output, verbose=verbose)
        for sentence in what_luts_carry(model):
            say(sentence)


def _report(built: Built, plan: BuildPlan, output: str, *, verbose: bool) -> None:
    from lutgen.bake.figures import coarse, summarise, worst_error
    from lutgen.numerals import counted

    if built.unfinished:
        missing, planned = built.unfinished
        say(f"The last build into this folder was interrupted; {missing} of its {planned} files were missing.")
    luts = [record for record in built.manifest.files if record.kind == "lut"]
    configs = len(built.manifest.files) - len(luts)
    say(f"{counted(len(luts), 'LUT')} and {counted(configs, 'config')} in {output}")
    rows = summarise(luts)
    if rows:
        say(worst_error(luts, verbose=verbose))
        if sentence := coarse(luts):
            say(sentence)
    if not ((rows and verbose) or plan.gpu):
        return
    # rich, which prints the tables, takes long to import.
    from lutgen.cli.outputs import print_page
    from lutgen.report.lut_files import certificates, compensation, shaders, simulation

    if rows and verbose:
        print_page(certificates(rows))
        print_page(compensation(luts, plan.unreachable) if plan.direction == "compensate" else simulation(luts))
    print_page(shaders(built.manifest.files))
