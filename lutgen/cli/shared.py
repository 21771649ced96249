"""Options that several commands share, and how the terminal is written to."""

from __future__ import annotations

import json
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Advanced
from lutgen.names import AGING_BASELINES, REFERENCES, SELECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lutgen.display import DisplayModel


def model_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that choose a model: --display, --model, --baseline, --selection, --reference, --at, …."""
    for option in reversed(
        (
            click.option("--display", metavar="FILE", help="Measurements of a display [default: the reconstruction]."),
            click.option("--model", metavar="FILE", help="A saved model (.toml); only --at goes with it."),
            click.option(
                "--baseline",
                cls=Advanced,
                type=click.Choice(AGING_BASELINES),
                help="Fresh display: the paper's sRGB with the measured `colour-points`, or `native`, the first "
                "session's own curves and black, which --reference absolute shows [default: colour-points].",
            ),
            click.option(
                "--selection",
                cls=Advanced,
                type=click.Choice(SELECTIONS),
                help="Matrix of a colour: the paper's `nearest`, or `continuous` without jumps [default: nearest].",
            ),
            click.option(
                "--reference",
                cls=Advanced,
                type=click.Choice(REFERENCES),
                help="Change since hour 0 put on sRGB, or the measured colours themselves [default: relative].",
            ),
            click.option(
                "--luminance",
                cls=Advanced,
                metavar="LAW",
                help="Luminance of chroma-luma: paper, measured, or a .csv of hour,factor from 0,1 on "
                "[default: paper].",
            ),
            click.option(
                "--at",
                cls=Advanced,
                metavar="NAME=VALUE",
                multiple=True,
                help="Condition under which the display is seen, where effects depend on it, such as ambient_lx=60 or "
                "u=0.1; several in a list [default: rest of the model's readings, else centre, dark room, warm, 25 °C, "
                "full screen].",
            ),
        )
    ):
        command = option(command)
    return command


def model_from(
    *,
    display: str | None,
    model: str | None,
    baseline: str | None = None,
    selection: str | None,
    reference: str | None,
    luminance: str | None,
    at: tuple[str, ...],
) -> DisplayModel:
    """Make the model that the options of :func:`model_options` ask for."""
    from dataclasses import replace

    from lutgen.display import DisplayModel, default_display, load_model, parse_at
    from lutgen.display.modes import luminance_law
    from lutgen.readings import read_measurements

    if model:
        if display or baseline or selection or reference or luminance:
            message = (
                "--model holds the whole model: leave --display, --baseline, --selection, --reference and --luminance "
                "out."
            )
            raise click.UsageError(message)
        saved = load_model(model)
        return replace(saved, conditions=parse_at(at, saved.conditions))
    return DisplayModel(
        read_measurements(display or default_display()),
        baseline=baseline or "colour-points",
        selection=selection or "nearest",
        reference=reference or "relative",
        luminance=luminance_law(luminance or "paper"),
        conditions=parse_at(at),
    )


def split_list(_context: click.Context, _option: click.Parameter, text: str) -> tuple[str, ...]:
    """Cut a comma-separated option into its parts, each once, in the order given."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def numbers(option: str, text: str) -> list[float]:
    """Read an option's list of numbers, such as 3,5. Raises LutgenError where one is none."""
    from lutgen.cells import number_list
    from lutgen.errors import LutgenError

    values = number_list(text)
    if values is None:
        message = f"{option} {text}: give numbers above 0 in a list, such as 3,5."
        raise LutgenError(message)
    return list(values)


def echo_json(content: Any) -> None:
    """Print JSON for a program to read."""
    click.echo(json.dumps(content, indent=1, ensure_ascii=False))


@contextmanager
def progress_bar(title: str, *, quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Show a bar on standard error while something runs; only when that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
