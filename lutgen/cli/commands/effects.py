from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import NumberFrom
from lutgen.cli.outputs import print_json, print_page
from lutgen.errors import refuse_unknown
from lutgen.numerals import in_percent
from lutgen.report.parts import Headline, Page, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.effects import Effect
    from lutgen.effects.contract import Report

#: Version of the JSON.
SCHEMA = 1


@click.command(cls=Command, section=Section.CRITICISM, place=5)
@click.argument("name", required=False)
@click.option("--effects", "files", multiple=True, metavar="FILE.py", help="Add the effects of a Python file.")
@click.option("--add-expr", "expressions", multiple=True, metavar="EXPR", help="Add an effect in one line.")
@click.option("--plot", metavar="FILE.png", help="Draw the change that the effect NAME makes at its typical size.")
@click.option("--force", is_flag=True, help="Replace FILE.png if it exists.")
@click.option("--check", "checked", metavar="FILE.py", help="Test whether a file's effects keep the contract.")
@click.option("--data", metavar="DATA", help="With --check: say what these readings can show of the effects.")
@click.option(
    "--time-limit",
    type=NumberFrom(min=0.1),
    metavar="SECONDS",
    help="With --check: stop a file that takes longer [default: 10].",
)
@click.option("--json", "as_json", is_flag=True, help="Print the effects, or the check, as JSON.")
def command(
    *,
    name: str | None,
    files: tuple[str, ...],
    expressions: tuple[str, ...],
    plot: str | None,
    force: bool,
    checked: str | None,
    data: str | None,
    time_limit: float | None,
    as_json: bool,
) -> None:
    """List the physical effects that lutgen knows, explain one, or check your own.

    Effects are built in, come with installed packages, from Python files (--effects) or from one line (--add-expr):
    `[name:] formula [; parameter=start[low,high]]…`, where the formula changes one of the signals code, linear and xyz.
    A file is imported as any Python program is: without limits, and with your rights. --check tests a file in a process
    with limits of time and memory, against the contract on which fits and LUTs rely; exit 1 when a clause is broken.

    \b
    Example:
      lutgen effects
      lutgen effects black-level --plot black-level.png
      lutgen effects leak --add-expr "leak: xyz + k*tau*white; k=0.002[0,0.05]"
      lutgen effects --check my_effect.py
    """
    if checked:
        if name or plot or files or expressions:
            raise click.UsageError("--check goes only with FILE.py, --data and --json: leave the other options out.")
        _check(checked, data, time_limit, as_json=as_json)
        return
    if data:
        raise click.UsageError(
            "--data belongs to --check FILE.py: it says what these readings could show of that file's effects."
        )
    if time_limit:
        raise click.UsageError("--time-limit belongs to --check FILE.py: other commands import a file without limits.")
    if plot and not name:
        raise click.UsageError("--plot draws one effect: give its NAME too.")
    from lutgen.effects.own import everything

    effects = everything(files, expressions)
    if name:
        refuse_unknown("effect", name, effects)
        _explain(effects[name], plot, force=force, as_json=as_json)
    elif as_json:
        print_json({"schema": SCHEMA, "effects": [each.as_json() for each in effects.values()]})
    else:
        _list(effects)


def _list(effects: Mapping[str, Effect]) -> None:
    own = [effect for effect in effects.values() if effect.origin != "built-in"]
    also = f", {len(own)} of them not built in" if own else ""
    heads = ("effect", "stage", "what happens", "baseline", "needs")
    rows, stage = [], ""
    for effect in effects.values():
        shown = effect.stage if stage != effect.stage else ""
        rows.append((effect.name, shown, effect.summary, effect.baseline, ", ".join(effect.needs) or "–"))
        stage = effect.stage
    print_page(
        [
            f"{len(effects)} effects{also}, in the order in which they act on the signal:\n",
            Table(heads, rows, words=range(len(heads)), unbroken=True),
            *([""] if own else []),
            *(f"{effect.name} comes from {effect.origin}" for effect in own),
            (
                "\nbaseline: colour-points effects show even if white and primaries are measured again at every hour, "
                "first-hour effects only with a model that starts from hour 0.\n`lutgen effects NAME` explains one."
            ),
        ]
    )


def _explain(effect: Effect, plot: str | None, *, force: bool, as_json: bool) -> None:
    from lutgen.effects import STAGES
    from lutgen.report.drawing import check_new_png

    if plot:
        check_new_png(plot, force=force)
    text = "" if as_json and not plot else _size_in_words(effect, must_be_sound=bool(plot))
    if plot:
        from lutgen.report.effect_plot import plot_effect

        plot_effect(effect, plot, force=force)
    if as_json:
        print_json({"schema": SCHEMA, "effects": [effect.as_json()]})
        return
    separable = (effect.confused_with or {}).items()
    print_page(
        [
            Headline(f"{effect.name} · {effect.stage} · {effect.origin}"),
            f"\n{_unwrapped(effect.text)}\n\n{text}\n",
            f"signal    {STAGES[effect.stage]}",
            f"baseline  {_BASELINES[effect.baseline]}",
            f"needs     {', '.join(effect.needs) or 'no column of conditions'}",
            f"source    {effect.source or 'not given'}\n",
            *_parameters(effect),
            *(f"Looks like {other}; what separates them: {separates}." for other, separates in separable),
            *([plot] if plot else []),
        ]
    )


def _unwrapped(text: str) -> str:
    """Join lines that were broken only because the next word did not fit, so that they can be wrapped again."""
    joined, *others = text.split("\n")
    last = joined
    for line in others:
        # Letters in a line of the built-in effects' docstrings.
        broken = line and last and len(last) + 1 + len(line.split()[0]) > 120
        joined += f" {line}" if broken else f"\n{line}"
        last = line
    return joined


def _size_in_words(effect: Effect, *, must_be_sound: bool) -> str:
    """Return a sentence on the size of an effect, or on the clause that a user's own effect breaks."""
    from lutgen.display.signature import Signature
    from lutgen.effects.contract import check, refuse_broken

    report = None if effect.origin == "built-in" else check(effect)
    if report and must_be_sound:
        refuse_broken(report, effect.origin)
    if report and report.failure:
        return f"It breaks the contract, clause {report.failure.clause!r}: {report.failure.sentence}"
    return Signature.of(effect).sentence()


_BASELINES = {
    "colour-points": "colour-points: shows even if white and primaries are measured again at every hour",
    "first-hour": "first-hour: shows only with a model that starts from hour 0 (--baseline first-hour)",
}


def _parameters(effect: Effect) -> Page:
    if not effect.parameters:
        return []
    rows = []
    for name, each in effect.parameters.items():
        bounds = f"{each.bounds[0]:g} to {each.bounds[1]:g}"
        neutral = f"{effect.neutral[name]:g}" if name in effect.neutral else "–"
        rows.append((name, f"{each.value:g}", bounds, each.unit, neutral, each.meaning))
    heads = ("parameter", "typical", "bounds", "unit", "neutral", "meaning")
    forms = (
        f"  {', '.join(form)}{'  (refined)' if index >= effect.refined else ''}"
        for index, form in enumerate(effect.forms)
    )
    table = Table(heads, rows, words=range(len(heads)), unbroken=True)
    return [table, "\nParameters that a fit frees, simplest form first:", *forms, ""]


def _check(file: str, data: str | None, time_limit: float | None, *, as_json: bool) -> None:
    from lutgen.effects.child import LIMIT_S, check_file

    reports = check_file(file, limit_s=time_limit or LIMIT_S)
    rehearsals = _rehearse(file, data, reports) if data else {}
    if as_json:
        checked = [report.as_json() | _rehearsal_json(rehearsals.get(report.effect)) for report in reports]
        print_json({"schema": 1, "file": file, "passed": all(each.passed for each in reports), "effects": checked})
    else:
        for report in reports:
            print_page([*_report(report), *_rehearsed(rehearsals.get(report.effect))])
    if not all(report.passed for report in reports):
        sys.exit(1)


def _report(report: Report) -> Page:
    broken, every = sum(not clause.passed for clause in report.clauses), len(report.clauses)
    state = f"breaks {broken} of {every} clauses" if broken else f"keeps all {every} clauses"
    rows = [(clause.clause, "yes" if clause.passed else "NO", clause.sentence) for clause in report.clauses]
    return [
        f"{report.effect} {state} of the contract.\n",
        Table(("clause", "kept", "sentence"), rows, words=range(3), unbroken=True),
    ]


def _rehearse(file: str, data: str, reports: tuple[Report, ...]) -> dict[str, Any]:
    """Return what readings could show of the effects that keep the contract: name → Rehearsal."""
    from lutgen.criticism.rehearse import rehearse
    from lutgen.effects.own import everything, load_file
    from lutgen.readings import read_measurements

    measurements = read_measurements(data)
    sound = {report.effect for report in reports if report.passed}
    others = tuple(everything().values())
    return {each.name: rehearse(each, measurements, others) for each in load_file(file) if each.name in sound}


def _rehearsal_json(rehearsal: Any) -> dict[str, Any]:
    keys = ("absorbed", "smallest_detectable", "unit", "likeness", "recovered", "sentence")
    return {"rehearsal": {key: getattr(rehearsal, key) for key in keys}} if rehearsal else {}


def _rehearsed(rehearsal: Any) -> Page:
    if rehearsal is None:
        return []
    absorbed = "it leaves no trace" if rehearsal.absorbed is None else in_percent(rehearsal.absorbed)
    unit = "" if rehearsal.unit == "1" else f" {rehearsal.unit}"
    size = rehearsal.smallest_detectable
    likeness = ", ".join(f"{name} {share:.2f}" for name, share in rehearsal.likeness)
    return [
        f"\n{rehearsal.sentence}",
        f"hidden by white and primaries            {absorbed}",
        f"smallest detectable size                 {'none' if size is None else f'{size:.3g}{unit}'}",
        f"likeness to others                       {likeness or 'none'}",
        f"hidden in these readings and found again {'yes' if rehearsal.recovered else 'NO'}",
    ]
