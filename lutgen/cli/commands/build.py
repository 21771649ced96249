"""``lutgen build``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.shared import (
    DIRECTIONS,
    MODES,
    UNREACHABLE,
    echo_json,
    model_from,
    model_options,
    progress_bar,
    split_list,
)

if TYPE_CHECKING:
    from lutgen.bake.build import Built
    from lutgen.bake.plan import Plan


@click.command()
@click.option(
    "--hours",
    default="0..18000",
    show_default=True,
    metavar="HOURS",
    help="0..18000: every measured time in the span; 0..18000:500: a step; 0,5000,10000: a list.",
)
@click.option(
    "--mode", "modes", default=",".join(MODES), show_default=True, callback=split_list, help="Aging modes, a list."
)
@click.option(
    "--format", "formats", default="cube,clf", show_default=True, callback=split_list, help="LUT formats, a list."
)
@click.option(
    "--direction",
    type=click.Choice(DIRECTIONS),
    default="simulate",
    show_default=True,
    help="What the aged display shows; or the correction that makes it look un-aged again, for that display alone.",
)
@click.option(
    "--unreachable",
    type=click.Choice(UNREACHABLE),
    help="With compensate, colours that the display cannot show any more: clip each channel of the drive, or scale "
    "everything to be dimmer [default: clip].",
)
@click.option("--cubesize", type=int, default=33, show_default=True, help="Points along an edge: 17, 33 or 65.")
@click.option("--tolerance", type=float, metavar="ΔE", help="Take the smallest size whose smooth errors stay below.")
@click.option("--no-certificates", is_flag=True, help="Do not read the files back and compare them with the model.")
@click.option("--gpu", is_flag=True, help="Run the configs' shaders too, and record how far they are from the CPU.")
@click.option("--jobs", type=click.IntRange(min=1), help="Processes [default: one per core].")
@click.option("--force", is_flag=True, help="Replace another build of lutgen's in the folder.")
@click.option("--json", "as_json", is_flag=True, help="Print the manifest as JSON.")
@click.option("-o", "--output", default="aged", show_default=True, metavar="DIR", help="Folder to build into.")
@model_options
def command(
    *,
    hours: str,
    modes: tuple[str, ...],
    formats: tuple[str, ...],
    direction: str,
    unreachable: str | None,
    cubesize: int,
    tolerance: float | None,
    no_certificates: bool,
    gpu: bool,
    jobs: int | None,
    force: bool,
    as_json: bool,
    output: str,
    **options: Any,
) -> None:
    """Bake aged displays into LUTs and OpenColorIO configs, one per aging mode and hour.

    Writes DIR/manifest.json, DIR/config.ocio (every display, by context variables) and for each mode and hour a folder
    such as DIR/chroma/10000h with its own config.ocio and LUTs. Every different table is read back through
    OpenColorIO and compared with the model; the figures are in the manifest. With --direction compensate, what the aged
    display then shows is compared with the un-aged one, and the share of colours out of reach is told.

    \b
    Example:
      lutgen build --hours 0..18000 -o aged/
      lutgen build --direction compensate --unreachable scale --hours 10000,18000 -o dimmed/
      lutgen build --hours 10000 --mode chroma --format clf --selection continuous -o aged-10000/
      lutgen build --hours 10000 --format icc,hald,resolve -o aged-icc/
    """
    from lutgen.bake.build import build
    from lutgen.bake.plan import Plan
    from lutgen.display import what_luts_carry
    from lutgen.display.hours import parse_hours

    if unreachable and direction != "compensate":
        raise click.UsageError("--unreachable goes with --direction compensate.")
    model = model_from(**options)
    plan = Plan(
        tuple(parse_hours(hours, model.tips)),
        modes=modes,
        formats=formats,
        cubesize=cubesize,
        tolerance=tolerance,
        certify=not no_certificates,
        direction=direction,
        unreachable=unreachable or "clip",
        gpu=gpu,
    )
    with progress_bar("building", quiet=as_json) as progress:
        built = build(model, plan, output, jobs=jobs, force=force, progress=progress)
    if as_json:
        echo_json(built.manifest.as_json())
    else:
        _report(built, plan, output)
        for sentence in what_luts_carry(model):
            click.echo(sentence)


def _report(built: Built, plan: Plan, output: str) -> None:
    from lutgen.bake.summary import summarise

    if built.unfinished:
        missing, planned = built.unfinished
        click.echo(f"The last build into this folder was interrupted; {missing} of its {planned} files were missing.")
    luts = [record for record in built.manifest.files if record.kind == "lut"]
    configs = len(built.manifest.files) - len(luts)
    click.echo(f"{len(luts)} LUTs and {configs} configs in {output}")
    rows = summarise(luts)
    if not (rows or plan.gpu):
        return
    # Tables take their time to be imported.
    from lutgen.cli.outputs import print_page
    from lutgen.report.builds.certificates import certificates, compensation, shaders, simulation

    if rows:
        print_page(certificates(rows))
        print_page(compensation(luts, plan.unreachable) if plan.direction == "compensate" else simulation(luts))
    print_page(shaders(built.manifest.files))
