from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import NUMBER, Choice, PlaceOptions, model_from, model_options, screen_options, source_option
from lutgen.cli.outputs import print_json, progress_bar, say
from lutgen.errors import LutgenError, listed
from lutgen.names import LUT_SUFFIXES, MODES
from lutgen.numerals import in_percent, spaced

if TYPE_CHECKING:
    from lutgen.display import AgedDisplay
    from lutgen.display.on_screen import OnScreen
    from lutgen.pictures.apply import AppliedImage


@click.command(cls=Command, section=Section.SIMULATE, place=3)
@click.argument("images", nargs=-1, required=True, metavar="IMAGE...")
@click.option("--mode", type=Choice(MODES), help="Aging mode.")
@click.option("--hours", type=NUMBER, metavar="HOUR", help="Operating hours of the display.")
@click.option(
    "--lut",
    metavar="FILE",
    help=f"Apply this LUT instead of the model, tetrahedrally: {listed(LUT_SUFFIXES, 'or')}.",
)
@click.option("--build", metavar="DIR", help="Apply the LUT for --mode and --hours of a folder that lutgen build made.")
@click.option("--side-by-side", is_flag=True, help="Un-aged on the left, aged on the right.")
@source_option
@click.option("--force", is_flag=True, help="Replace an existing output, but never an input.")
@click.option("--json", "as_json", is_flag=True, help="Print a record of each image as JSON.")
@click.option("-o", "--output", required=True, metavar="PATH", help="File to write; for several images a folder.")
@screen_options
@model_options
def command(
    *,
    images: tuple[str, ...],
    mode: str | None,
    hours: float | None,
    lut: str | None,
    build: str | None,
    side_by_side: bool,
    source: str,
    force: bool,
    as_json: bool,
    output: str,
    where: PlaceOptions,
    **options: Any,
) -> None:
    """Write the appearance of images on an aged display.

    Reads PNG, JPEG, TIFF and EXR: RGB with or without alpha, 8 or 16 bits, half or float. The suffix of the output
    chooses the format: .png, .jpg (quality 95, colour at full resolution), .tif, .exr. lutgen keeps depth, alpha,
    metadata and ICC profile, and does not apply the profile: the numbers are those that are sent to the display. An EXR
    file holds linear light; values outside 0..1, which no display can show, are clipped. If a file holds several
    images, lutgen takes the first image. With --on-screen lutgen ages each pixel at its own place on the screen, which
    no LUT can do.

    \b
    Example:
      lutgen apply slide.png --mode chroma --hours 10000 -o aged.png
      lutgen apply a.tif b.tif --build aged/ --mode chroma-luma --hours 18000 --side-by-side -o compared/
    """
    from lutgen.pictures.apply import apply_to_images, outputs_for

    aging, screen, remarks = _aging(mode, hours, lut, build, options=options, where=where)
    paths = [Path(image) for image in images]
    pairs = list(zip(paths, outputs_for(paths, output), strict=True))
    with progress_bar("applying", quiet=as_json) as progress:
        done = apply_to_images(
            pairs, aging, side_by_side=side_by_side, on_screen=screen, source=source, force=force, progress=progress
        )
    if lut and (doubt := _doubt(Path(lut))):
        say(doubt, err=True)
    if as_json:
        from dataclasses import asdict

        notes: dict[str, Any] = {"remarks": remarks} if remarks else {}
        notes |= {"on_screen": screen.as_json()} if screen else {}
        print_json({"schema": 1, "images": [asdict(applied) for applied in done], **notes})
    else:
        age = "" if mode is None or hours is None else f"{mode} at {spaced(hours)} h, "
        for sentence in (*(_sentence(applied, age) for applied in done), *remarks):
            say(sentence)


def _doubt(lut: Path) -> str:
    """Return a warning about a LUT that OpenColorIO applied without an error, but not as its author meant; else ""."""
    from lutgen.lint import lint
    from lutgen.lint.finding import WRONG
    from lutgen.lint.programs import opencolorio_reader

    try:
        fate, finding = lint(lut).fate(opencolorio_reader())
    except LutgenError:  # OpenColorIO has read the file; a file that lint cannot judge is no reason for an error.
        return ""
    if finding is None or fate.outcome != WRONG:
        return ""
    return (
        f"Warning: {lut} {finding.what}, so OpenColorIO {fate.how}. {finding.remedy} "
        f"`lutgen lint {shlex.quote(str(lut))}` says what other programs do with it."
    )


def _aging(
    mode: str | None,
    hours: float | None,
    lut: str | None,
    build: str | None,
    *,
    options: dict[str, Any],
    where: PlaceOptions,
) -> tuple[AgedDisplay | Path, OnScreen | None, list[str]]:
    """Return the display or LUT to apply, the place on the screen, and remarks on the model's conditions."""
    from lutgen.display import not_measured, what_pictures_carry

    model_given = any(options.values())
    if any(where) and (lut or build):
        raise LutgenError(
            "a LUT does not know where on the screen a pixel lies: with --on-screen, --place or --uniformity leave "
            "--lut and --build out, and give --mode and --hours."
        )
    if lut and (build or mode or hours is not None or model_given):
        raise LutgenError("--lut needs no model: leave --build, --mode, --hours and the options of the model out.")
    if lut:
        return Path(lut), None, []
    if mode is None or hours is None:
        raise LutgenError("which display? Give --mode and --hours, such as --mode chroma --hours 10000, or --lut FILE.")
    if not build:
        model, screen = where.on(model_from(**options))
        remarks = [*what_pictures_carry(model, screen), not_measured(model)]
        return model.at(mode, hours), screen, [remark for remark in remarks if remark]
    if model_given:
        raise LutgenError("--build holds the whole model: leave the options of the model out.")
    return _built_lut(Path(build), mode, hours), None, []


def _built_lut(folder: Path, mode: str, hours: float) -> Path:
    from lutgen.bake.formats import format_named, format_names
    from lutgen.display import hour_name
    from lutgen.files import is_file

    if not folder.is_dir():
        raise LutgenError(
            f"{folder}: there is no such folder. Give one that `lutgen build` made, or leave --build out."
        )
    # The most accurate format comes first. OpenColorIO must read the format, since it applies the LUT to the picture.
    for name in ("clf", "cube", *format_names()):
        form = format_named(name)
        path = folder / mode / hour_name(hours) / form.file
        if form.reader is None and is_file(path):
            return path
    hour = re.compile(r"[0-9]+(\.[0-9]+)?h")
    built: dict[str, set[str]] = {}
    for lut in folder.glob("*/*h/aged.*"):
        if hour.fullmatch(lut.parent.name):
            built.setdefault(lut.parts[-3], set()).add(lut.parent.name)
    content = "; ".join(
        f"{built_mode}: {', '.join(sorted(names, key=lambda name: float(name[:-1])))}"
        for built_mode, names in sorted(built.items(), key=lambda each: (each[0] != mode, each[0]))
        if mode not in built or built_mode == mode
    )
    raise LutgenError(
        f"{folder}: no LUT for {mode} at {hour_name(hours)[:-1]} h; it has {content or 'nothing'}. Build it, or leave "
        "--build out."
    )


def _sentence(applied: AppliedImage, age: str) -> str:
    parts = [f"{applied.output}: {age}{applied.width} × {applied.height}"]
    if applied.clipped_share is None:
        parts.append("clipped pixels not counted, since a LUT does not record clipping")
    else:
        parts.append(f"{in_percent(applied.clipped_share, 2)} of the pixels clipped to the viewer's gamut")
    if applied.source_clipped_share:
        parts.append(f"{in_percent(applied.source_clipped_share, 2)} of the source pixels beyond what a display shows")
    return ", ".join(parts)
