"""Options of the commands that compare the model with readings: compare, diagnose, refine, plan."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.options import Choice, replace_option, say_remarks, stacked
from lutgen.names import BASELINES, INSTRUMENTS, SELECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.criticism.fit.linear import Term
    from lutgen.display import DisplayModel
    from lutgen.effects import Effect
    from lutgen.readings import Measurements


@dataclass(frozen=True)
class Question:
    """Readings, model and effects that the options choose."""

    #: Arguments of :func:`lutgen.criticism.diagnose.diagnose`, like ``terms``.
    readings: Measurements
    baseline: str
    selection: str
    instrument: str | None
    #: All effects, built-in and own, by name.
    effects: dict[str, Effect]
    #: Names of the effects of ``--add-expr``, in the order given.
    own: tuple[str, ...]
    terms: tuple[Term, ...]
    #: The model of ``--model``.
    saved: DisplayModel | None
    #: DATA and options, quoted for a shell, for another command on the same readings and model.
    again: str

    @property
    def data(self) -> str:
        """DATA, quoted for a shell."""
        return shlex.quote(self.readings.file)

    @property
    def settings(self) -> dict[str, Any]:
        """Keyword arguments that compare, diagnose, refine and plan have in common."""
        return {"baseline": self.baseline, "selection": self.selection, "instrument": self.instrument}

    @property
    def search(self) -> dict[str, Any]:
        """Keyword arguments that diagnose and refine have in common."""
        return {**self.settings, "effects": self.effects, "terms": self.terms}


def data_options(*, expressions: bool = True) -> Callable[..., Any]:
    """Add DATA, --baseline, --selection, --model, --instrument, --effects, --add-expr, --json and --force."""
    options = stacked(*_MODEL, *([_EXPRESSION] if expressions else []), *_OUTPUT)
    return lambda command: click.argument("data", metavar="DATA")(options(command))


_MODEL = (
    click.option(
        "--baseline",
        type=Choice(BASELINES),
        help="What the model knows: `colour-points`, white and primaries measured again at each hour; `first-hour`, "
        "only hour 0; `native`, as colour-points, from the display's own model of the first session; "
        "`native-first-hour`, only that model [default: colour-points].",
    ),
    click.option(
        "--selection",
        type=Choice(SELECTIONS),
        help="Matrix of a colour: the paper's `nearest`, or `continuous` without jumps [default: nearest].",
    ),
    click.option("--model", metavar="FILE", help="Start from a saved model (.toml) instead of the paper's."),
    click.option(
        "--instrument",
        metavar="NOISE",
        help="Noise of a reading, 1 σ: share of the light and cd/m², such as 0.002,0.003; or an instrument "
        f"({', '.join(INSTRUMENTS)}, or your own file, .toml), corrected by replicates [default: from replicates].",
    ),
    click.option("--effects", "files", multiple=True, metavar="FILE", help="A Python file of your own effects."),
)
_EXPRESSION = click.option(
    "--add-expr",
    "expressions",
    multiple=True,
    metavar="TEXT",
    help="An effect of your own in one line, such as 'leak: xyz + k*tau*white'.",
)
_OUTPUT = (
    click.option("--json", "json_to", metavar="FILE", help="Write all numbers as JSON; - prints only the JSON."),
    replace_option,
)


def question_from(
    data: str,
    *,
    baseline: str | None,
    selection: str | None,
    model: str | None,
    instrument: str | None,
    files: tuple[str, ...],
    expressions: tuple[str, ...] = (),
) -> Question:
    """Read the files that the options of :func:`data_options` name."""
    from lutgen.criticism.display_model import terms_of
    from lutgen.display import load_model
    from lutgen.effects.contract import refuse_unsound
    from lutgen.effects.expression import parse
    from lutgen.effects.own import everything
    from lutgen.readings import read_measurements

    readings = read_measurements(data)
    say_remarks(readings)
    effects = everything(files, expressions)
    refuse_unsound(files, expressions)
    # A model file finds built-in effects itself; the file of an own effect may have moved.
    own = {name: each for name, each in effects.items() if each.origin != "built-in"}
    saved = load_model(model, own) if model else None
    # A model file names the files of its own effects, so --effects is not needed for these.
    effects |= {each.effect.name: each.effect for each in saved.effects} if saved else {}
    return Question(
        readings,
        _given_or_saved("baseline", baseline, saved.baseline if saved else None, "colour-points"),
        _given_or_saved("selection", selection, saved.selection if saved else None, "nearest"),
        instrument,
        effects,
        tuple(parse(text).name for text in expressions),
        terms_of(saved) if saved else (),
        saved,
        _again(data, files, expressions, baseline=baseline, selection=selection, model=model, instrument=instrument),
    )


def _given_or_saved(option: str, given: str | None, saved: str | None, usual: str) -> str:
    if given and saved and given != saved:
        raise click.UsageError(
            f"--{option} {given} contradicts --model, whose {option} is {saved}. Leave --{option} out."
        )
    return given or saved or usual


def _again(data: str, files: tuple[str, ...], expressions: tuple[str, ...], **named: str | None) -> str:
    pairs = [(name, value) for name, value in named.items() if value]
    pairs += [("effects", file) for file in files] + [("add-expr", text) for text in expressions]
    return " ".join([shlex.quote(data), *(f"--{name} {shlex.quote(value)}" for name, value in pairs)])


def split_all(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> tuple[str, ...]:
    """Split the values of a repeatable option at commas, in the order given."""
    return tuple(part.strip() for text in texts for part in text.split(",") if part.strip())
