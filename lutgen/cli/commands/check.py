from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import NUMBER, Choice, WholeFrom, model_from, model_options
from lutgen.cli.outputs import print_json, progress_bar, say
from lutgen.errors import LutgenError
from lutgen.names import MODES

if TYPE_CHECKING:
    from lutgen.bake.check import Checked


@click.command(cls=Command, section=Section.SIMULATE, place=2)
@click.argument("paths", nargs=-1, required=True, metavar="DIR|LUT…")
@click.option("--mode", type=Choice(MODES), help="For LUT files: the aging mode that they should show.")
@click.option("--hours", type=NUMBER, metavar="HOUR", help="For LUT files: the hour that they should show.")
@click.option(
    "--max-delta-e", type=NUMBER, help="Largest smooth ΔE2000 allowed [default: 1, or the file's own certificate]."
)
@click.option(
    "--p99",
    type=NUMBER,
    help="Largest 99 % quantile of smooth ΔE2000 allowed [default: 0.2, or the file's own certificate].",
)
@click.option("--gpu", is_flag=True, help="Run the shaders of the folder's configs too, and compare with the CPU.")
@click.option("--jobs", type=WholeFrom(min=1), help="Processes [default: one per core].")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@model_options
def command(
    *,
    paths: tuple[str, ...],
    mode: str | None,
    hours: float | None,
    max_delta_e: float | None,
    p99: float | None,
    gpu: bool,
    jobs: int | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Check that built files still agree with the model; exit 1 when one does not.

    lutgen compares a folder with the model of its manifest, or with the model that the options choose. It reads every
    LUT again through OpenColorIO, instantiates every part of every config, and sends pixels through these parts. For
    LUT files of other programs, say which display they should show: --mode and --hours. With --gpu lutgen also runs the
    shaders with which viewers draw, through EGL: on a graphics card or, without one, on Mesa.

    \b
    Example:
      lutgen check aged/
      lutgen check theirs.cube --mode chroma --hours 10000 --display my-display.csv
    """
    from lutgen.bake.fidelity import Budget

    budget = Budget(max_delta_e, p99)
    if gone := next((path for path in paths if not Path(path).exists()), None):
        raise LutgenError(f"{gone}: there is no such file or folder. Give a folder of `lutgen build`, or a LUT file.")
    results = {}
    for path in paths:
        with progress_bar("checking", quiet=as_json) as progress:
            results[path] = _check(path, mode, hours, options, budget=budget, gpu=gpu, jobs=jobs, progress=progress)
    if as_json:
        contents = [{"path": path, **result.as_json()} for path, result in results.items()]
        print_json(contents[0] if len(contents) == 1 else {"schema": 1, "checks": contents})
    else:
        for path, result in results.items():
            _report(path, result)
    if not all(result.passed for result in results.values()):
        sys.exit(1)


def _check(path: str, mode: str | None, hours: float | None, options: dict[str, Any], **settings: Any) -> Checked:
    """Check a folder or a LUT file; ``settings`` are those of a folder."""
    from lutgen.bake.check import check, check_lut

    if Path(path).is_dir():
        if mode or hours is not None:
            raise click.UsageError("--mode and --hours are for LUT files; a folder's manifest holds its own.")
        if options["at"]:
            raise click.UsageError("--at is for LUT files; a folder's manifest holds its own conditions.")
        model = model_from(**options) if any(options.values()) else None
        return check(path, model=model, **settings)
    if settings["gpu"]:
        raise click.UsageError("--gpu is for folders: lutgen draws the views of their configs.")
    if mode is None or hours is None:
        raise click.UsageError(
            f"{path}: which display should this LUT show? Give --mode and --hours, and --display or --model."
        )
    return check_lut(path, model_from(**options).at(mode, hours), budget=settings["budget"])


def _report(path: str, result: Checked) -> None:
    for remark in result.remarks:
        say(f"note: {remark}")
    for finding in result.findings:
        say(f"{finding.path}: {finding.problem}")
    if result.gpu:
        from lutgen.report.lut_files import shader_sentence

        renderer = next(iter(result.gpu.values())).renderer
        say(shader_sentence(renderer, len(result.gpu), max(run.worst for run in result.gpu.values())))
    of_files = result.certificates.values()
    worst = max((each.smooth.max for each in of_files), default=0.0)
    # No grid follows a jump of the model, or the edge of the gamut at which colours are clipped.
    edges = max((max(each.gamut.max, each.border.max) for each in of_files), default=0.0)
    count = f"{result.files} file{'s' if result.files != 1 else ''}"
    if result.passed:
        beside = f", and {edges:.4f} at its jumps and at the edge of the gamut" if edges > worst else ""
        is_smooth = not of_files or any(each.smooth.colours for each in of_files)
        smooth = f"{worst:.4f} where it is smooth" if is_smooth else "nowhere smooth"
        say(f"{path}: {count} checked, all true to the model (largest ΔE2000 {smooth}{beside})")
    else:
        wrong = len({finding.path for finding in result.findings})
        say(f"{path}: {count} checked, {wrong} with faults")
