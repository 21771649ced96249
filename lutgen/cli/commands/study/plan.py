from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Command
from lutgen.cli.options import NUMBER, WHOLE, json_option, model_from, model_options
from lutgen.cli.outputs import Outputs, progress_bar

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lutgen.study.design import Design


@click.command(cls=Command)
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option(
    "--conditions",
    metavar="LIST",
    help="Conditions of reading session 1: none (un-aged) and modes at an hour "
    "[default: none,chroma@18000,chroma-luma@18000].",
)
@click.option(
    "--per-condition", type=WHOLE, metavar="N", help="Images that a reader reads under each condition [default: 40]."
)
@click.option("--readers", type=WHOLE, metavar="R", help="How many readers [default: 1].")
@click.option(
    "--sessions", type=WHOLE, metavar="S", help="Reading sessions of each reader; un-aged from 2 on [default: 2]."
)
@click.option(
    "--design",
    metavar="FILE",
    help="Any other design: a .csv of session,image,condition and, if needed, reader and position.",
)
@click.option(
    "--washout-days",
    type=NUMBER,
    default=24.0,
    show_default=True,
    metavar="DAYS",
    help="Minimum days between a reader's sessions.",
)
@click.option(
    "--practice",
    multiple=True,
    metavar="IMAGE",
    help="Practice image, shown first, un-aged and not analysed; may be repeated.",
)
@click.option("--negative", default="0,1+", show_default=True, metavar="LIST", help="Diagnoses that count as negative.")
@click.option(
    "--positive", default="2+,3+", show_default=True, metavar="LIST", help="Diagnoses that count as positive."
)
@click.option("--ease", default="1..10", show_default=True, metavar="RANGE", help="Ease of reading, hard to easy.")
@click.option("--seed", type=WHOLE, default=1, show_default=True, metavar="S", help="Seed of all random draws.")
@click.option("--title", default="Reader study", show_default=True, metavar="TEXT", help="Title of the study.")
@json_option
@click.option("--force", is_flag=True, help="Replace a study that has no answers yet, and files that exist.")
@click.option("-o", "--output", required=True, metavar="STUDY", help="The folder to make.")
@model_options
def command(
    *,
    images: tuple[str, ...],
    conditions: str | None,
    per_condition: int | None,
    readers: int | None,
    sessions: int | None,
    design: str | None,
    washout_days: float,
    practice: tuple[str, ...],
    negative: str,
    positive: str,
    ease: str,
    seed: int,
    title: str,
    json_to: str | None,
    force: bool,
    output: str,
    **options: Any,
) -> None:
    """Plan a reader study: draw the design, freeze it with hashes, render the images that readers will see.

    IMAGE: PNG, TIFF or JPEG of 8 or 16 bits, or a folder of them. Each reader reads the same number of images under
    each condition, in a random order that spreads the conditions evenly over the reading session, and later the same
    images un-aged. With several readers the conditions rotate, so that every image is read under every condition.
    Images go through certified LUTs and are named by a keyed hash: only STUDY/protocol.json, which belongs to the
    coordinator, tells which image is which.

    The table of --design names images by their file names without suffix. A row without reader is for all readers;
    without position the order is drawn at random.

    \b
    Example:
      lutgen study plan slides/a.tif slides/b.tif --conditions none,chroma@18000 --per-condition 1 -o study/
    """
    from lutgen.report.study_plan import plan_page
    from lutgen.study.plan import plan_study
    from lutgen.study.protocol import categories_of, ease_of

    outputs = Outputs(json_to, force=force)
    sizes = {"per_condition": per_condition, "readers": readers, "sessions": sessions}
    design_of = _design(design, conditions, seed, sizes)
    model = model_from(**options)
    with progress_bar("rendering", quiet=outputs.alone) as progress:
        planned = plan_study(
            images,
            output,
            model,
            design_of,
            seed=seed,
            practice=practice,
            washout_days=washout_days,
            title=title,
            categories=categories_of(negative, positive),
            ease=ease_of(ease),
            force=force,
            progress=progress,
        )
    outputs.write(plan_page(planned), planned.as_json)


def _design(
    table: str | None, conditions: str | None, seed: int, sizes: dict[str, int | None]
) -> Callable[[Sequence[str]], Design]:
    from lutgen.study.design import PAPER_CONDITIONS, balanced_design, conditions_of, read_design

    if table is None:
        compared = conditions_of((PAPER_CONDITIONS if conditions is None else conditions).split(","))
        given = {name: size for name, size in sizes.items() if size is not None}
        return lambda names: balanced_design(names, compared, seed=seed, **given)
    if not (conditions is None and sizes["per_condition"] is None and sizes["sessions"] is None):
        raise click.UsageError(
            "--design holds the whole design: leave --conditions, --per-condition and --sessions out."
        )
    return lambda names: read_design(Path(table), names, readers=sizes["readers"], seed=seed)
