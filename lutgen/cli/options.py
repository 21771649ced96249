"""Options that several commands share, and functions that read the values of these options.

:mod:`lutgen.cells` reads numbers with digits 0 to 9 only: click's own types also accept ``1_000``, full-width digits
and ``nan``, as Python's ``float`` and ``int`` do.
"""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from lutgen.cells import number, number_list, whole
from lutgen.cli.command import Advanced
from lutgen.cli.outputs import say
from lutgen.errors import LutgenError, guess
from lutgen.names import AGING_BASELINES, REFERENCES, SELECTIONS, SOURCES

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.display import DisplayModel
    from lutgen.display.on_screen import OnScreen
    from lutgen.readings import Measurements
    from lutgen.readings.session import Session

#: Largest whole number that an option accepts; every sensible value is far smaller.
_MOST_WHOLE = 10**15


if TYPE_CHECKING:
    _ParamType = click.ParamType[Any]
    _Choice = click.Choice[str]
else:
    _ParamType, _Choice = click.ParamType, click.Choice


class Choice(_Choice):
    """One of several names. The error for another value names the most similar name."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read the value of an option."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            self.fail(f"{error.message}{guess(value, map(str, self.choices))}", param, ctx)


class _InDigits(_ParamType):
    """Reads a number with digits 0 to 9 only; click's own type, the next base class, then checks the number."""

    whole = False

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read the value of an option."""
        if isinstance(value, str):  # a default is a number already
            read = whole(value, least=-_MOST_WHOLE, most=_MOST_WHOLE) if self.whole else number(value)
            if read is None:
                expected = "a whole number, such as 8" if self.whole else "a finite number, such as 8 or 0.5"
                self.fail(f"{value[:40]!r} is not {expected}, in digits 0 to 9.", param, ctx)
            value = read
        return super().convert(value, param, ctx)


class _Number(_InDigits, click.types.FloatParamType):
    """A finite number."""


class _Whole(_InDigits, click.types.IntParamType):
    """A whole number."""

    whole = True


class WholeFrom(_InDigits, click.IntRange):
    """A whole number of at least ``min``."""

    whole = True


class NumberFrom(_InDigits, click.FloatRange):
    """A finite number of at least ``min``."""


def stacked(*options: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds ``options`` to a command, in this order."""

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return add


NUMBER, WHOLE = _Number(), _Whole()

image_argument = click.argument("image", metavar="IMAGE")
source_option = click.option(
    "--source",
    type=Choice(SOURCES),
    default="auto",
    show_default=True,
    help="What the image stores: signal (code values) or linear light; auto: EXR linear, others signal.",
)
hours_option = click.option(
    "--hours",
    metavar="HOURS",
    help="0..18000: every measured time in the span; 0..18000:500: a step; 0,5000,10000: a list "
    "[default: all measured times].",
)
tolerance_option = click.option(
    "--tolerance", metavar="LIST", default="3,5", show_default=True, help="Tolerated ΔE2000."
)
json_option = click.option(
    "--json", "json_to", metavar="FILE|-", help="Write all numbers as JSON; - prints only the JSON."
)
replace_option = click.option("--force", is_flag=True, help="Replace files that exist, but never an input.")


#: Options that choose a model: --display, --model, --baseline, --selection, --reference, --luminance, --at.
model_options = stacked(
    click.option("--display", metavar="FILE", help="Measurements of a display [default: the reconstruction]."),
    click.option("--model", metavar="FILE", help="A saved model (.toml); only --at goes with it."),
    click.option(
        "--baseline",
        cls=Advanced,
        type=Choice(AGING_BASELINES),
        help="Fresh display: the paper's sRGB with the measured `colour-points`, or `native`, the first "
        "session's own curves and black, which --reference absolute shows [default: colour-points].",
    ),
    click.option(
        "--selection",
        cls=Advanced,
        type=Choice(SELECTIONS),
        help="Matrix of a colour: the paper's `nearest`, or `continuous` without jumps [default: nearest].",
    ),
    click.option(
        "--reference",
        cls=Advanced,
        type=Choice(REFERENCES),
        help="relative: the measured change since hour 0, applied to sRGB; absolute: the measured colours "
        "themselves [default: relative; absolute for one session].",
    ),
    click.option(
        "--luminance",
        cls=Advanced,
        metavar="LAW",
        help="Luminance of chroma-luma: paper, measured, or a .csv of hour,factor that begins with 0,1 "
        "[default: measured, or luminance_law of the file of readings].",
    ),
    click.option(
        "--at",
        cls=Advanced,
        metavar="NAME=VALUE",
        multiple=True,
        help="Value of a condition on which effects depend, such as ambient_lx=60 or u=0.1; several in a list "
        "[default: rest of the model's readings, else centre, dark room, warm, 25 °C, full screen].",
    ),
)

#: Last options of the commands that draw one image; options that choose the lifetimes to compute.
picture_options = stacked(source_option, replace_option, model_options)
life_options = stacked(tolerance_option, hours_option)


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
    """Return the model that the options of :func:`model_options` choose."""
    from dataclasses import replace

    from lutgen.display import DisplayModel, default_display, load_model, parse_at
    from lutgen.display.tips import UNSTATED, luminance_law
    from lutgen.readings import read_measurements

    if model:
        if display or baseline or selection or reference or luminance:
            raise click.UsageError(
                "--model holds the whole model: leave --display, --baseline, --selection, --reference and --luminance "
                "out."
            )
        saved = load_model(model)
        return replace(saved, conditions=parse_at(at, saved.conditions))
    readings = read_measurements(display or default_display())
    say_remarks(readings)
    chosen = DisplayModel(
        readings,
        baseline=baseline or "colour-points",
        selection=selection or "nearest",
        reference=reference or "",
        luminance=luminance_law(luminance) if luminance else UNSTATED,
        conditions=parse_at(at),
    )
    if brightened := chosen.tips.brightened():
        say(brightened, err=True)
    return chosen


def say_remarks(*files: Measurements | Session) -> None:
    """Print the remarks of the files' readers to standard error: their decisions, and the parts that they ignored."""
    for each in files:
        for remark in each.remarks:
            say(f"{each.file}: {remark}", err=True)


def split_list(_context: click.Context, _option: click.Parameter, text: str) -> tuple[str, ...]:
    """Split an option at commas into its different parts, in the order given."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def numbers(option: str, text: str) -> list[float]:
    """Read an option's list of numbers, such as 3,5. Raises LutgenError if a part is no number."""
    values = number_list(text)
    if values is None:
        raise LutgenError(f"{option} {text}: give numbers in a list, such as 3,5.")
    return list(values)


class PlaceOptions(NamedTuple):
    """Values of --on-screen, --place and --uniformity."""

    on_screen: bool
    place: str | None
    uniformity: str | None

    def on(self, model: DisplayModel) -> tuple[DisplayModel, OnScreen | None]:
        """Return the model with the screen's uniformity, and the picture's place on the screen. Raises LutgenError."""
        if not any(self):
            return model, None
        from lutgen.display.on_screen import MeasuredUniformity, OnScreen
        from lutgen.readings import read_session

        table = MeasuredUniformity.of(read_session(self.uniformity)) if self.uniformity else None
        screen = OnScreen.parse(self.place, table) if self.place else OnScreen(uniformity=table)
        return screen.aged(model), screen


_SCREEN = stacked(
    click.option(
        "--on-screen",
        is_flag=True,
        help="Age each pixel at its own place on the screen: by effects of the model that depend on the place, such "
        "as edge-falloff, or by --uniformity.",
    ),
    click.option(
        "--place",
        metavar="LEFT,TOP,WIDTH,HEIGHT",
        help="Place of the picture on the screen, in shares of the screen; implies --on-screen "
        "[default: 0,0,1,1, the whole screen].",
    ),
    click.option(
        "--uniformity",
        metavar="FILE",
        help="Measured uniformity of the screen: white or a grey at 5 places or more; implies --on-screen.",
    ),
)


def screen_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --on-screen, --place and --uniformity; the command gets the three values as ``where``."""

    @wraps(command)
    def with_place(*, on_screen: bool, place: str | None, uniformity: str | None, **options: Any) -> Any:
        return command(where=PlaceOptions(on_screen, place, uniformity), **options)

    return _SCREEN(with_place)
