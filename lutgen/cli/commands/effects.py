"""``lutgen effects``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.number_types import NumberFrom
from lutgen.cli.shared import echo_json

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import Console
    from rich.table import Table

    from lutgen.effects import Effect
    from lutgen.effects.contract import Report

#: Width of the tables where standard output is no terminal.
_WIDTH = 140


@click.command(cls=Command, section=Section.CRITICISM, place=5)
@click.argument("name", required=False)
@click.option("--effects", "files", multiple=True, metavar="FILE.py", help="Add the effects of a Python file.")
@click.option("--add-expr", "expressions", multiple=True, metavar="EXPR", help="Add an effect in one line.")
@click.option("--plot", metavar="FILE.png", help="Draw the change that the effect NAME makes at its typical size.")
@click.option("--force", is_flag=True, help="Replace FILE.png where it exists.")
@click.option("--check", "checked", metavar="FILE.py", help="Try whether a file's effects keep the contract.")
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
    A file is imported as any Python program is: without limits, and with your rights. --check tries a file first: in a
    process with limits of time and memory, against the contract that fits and LUTs rely on; exit 1 when a clause is
    broken.

    \b
    Example:
      lutgen effects
      lutgen effects black-level --plot black-level.png
      lutgen effects leak --add-expr "leak: xyz + k*tau*white; k=0.002[0,0.05]"
      lutgen effects --check my_effect.py
    """
    if checked:
        if name or plot or files or expressions:
            message = "--check stands alone with its FILE.py, --data and --json: leave the others out."
            raise click.UsageError(message)
        _check(checked, data, time_limit, as_json=as_json)
        return
    if data:
        message = "--data belongs to --check FILE.py: it says what these readings could show of that file's effects."
        raise click.UsageError(message)
    if time_limit:
        raise click.UsageError("--time-limit belongs to --check FILE.py: other commands import a file without limits.")
    if plot and not name:
        message = "--plot draws one effect: give its NAME too."
        raise click.UsageError(message)
    from lutgen.effects.own import everything

    effects = everything(files, expressions)
    if name:
        _explain(_chosen(effects, name), plot, force=force, as_json=as_json)
    elif as_json:
        from lutgen.effects.registry_json import registry_json

        echo_json(registry_json(effects.values()))
    else:
        _list(effects)


def _chosen(effects: Mapping[str, Effect], name: str) -> Effect:
    from lutgen.errors import pick_one

    if name not in effects:
        raise pick_one("effect", name, effects)
    return effects[name]


def _list(effects: Mapping[str, Effect]) -> None:
    console = _console()
    own = sum(effect.origin != "built-in" for effect in effects.values())
    also = f", {own} of them not built in" if own else ""
    console.print(f"{len(effects)} effects{also}, in the order of the light's way:\n", markup=False)
    heads = ("effect", "stage", "what happens", "baseline", "needs", *(["origin"] if own else []))
    table = _table(*heads)
    stage = ""
    for effect in effects.values():
        if stage and stage != effect.stage:
            table.add_section()
        row = (effect.summary, effect.baseline, ", ".join(effect.needs) or "–", effect.origin)
        table.add_row(*_plain(effect.name, effect.stage if stage != effect.stage else "", *row)[: len(heads)])
        stage = effect.stage
    _print_table(console, table)
    console.print(
        "\nbaseline: colour-points effects are seen beside white and primaries measured again at every hour, "
        "first-hour effects only by a model that starts from hour 0.\n"
        "`lutgen effects NAME` explains one.",
        markup=False,
        soft_wrap=True,
    )


def _explain(effect: Effect, plot: str | None, *, force: bool, as_json: bool) -> None:
    from lutgen.effects.registry_json import registry_json
    from lutgen.report.drawing import check_new_png

    if plot:
        check_new_png(plot, force=force)
    text = "" if as_json and not plot else _said(effect, must_be_sound=bool(plot))
    if plot:
        from lutgen.report.effect_plot import plot_effect

        plot_effect(effect, plot, force=force)
    if as_json:
        echo_json(registry_json([effect]))
        return
    from lutgen.effects import STAGES

    console = _console()
    console.print(f"{effect.name} · {effect.stage} · {effect.origin}\n", style="bold", markup=False)
    console.print(effect.text, markup=False)
    console.print(f"\n{text}\n", markup=False)
    lines = _table(None, None)
    lines.add_row(*_plain("signal", STAGES[effect.stage]))
    lines.add_row(*_plain("baseline", _BASELINES[effect.baseline]))
    lines.add_row(*_plain("needs", ", ".join(effect.needs) or "no column of conditions"))
    lines.add_row(*_plain("source", effect.source or "not given"))
    _print_table(console, lines)
    console.print()
    _print_parameters(console, effect)
    for other, separates in (effect.confused_with or {}).items():
        console.print(f"Looks like {other}; what separates them: {separates}.", markup=False)
    if plot:
        console.print(plot, soft_wrap=True, markup=False)


def _said(effect: Effect, *, must_be_sound: bool) -> str:
    """Say how large an effect is, or, of anybody's own, that it breaks the contract."""
    from lutgen.display.signature import Signature
    from lutgen.effects.contract import check, refuse_broken

    report = None if effect.origin == "built-in" else check(effect)
    if report and must_be_sound:
        refuse_broken(report, effect.origin)
    if report and report.failure:
        return f"It breaks the contract, clause {report.failure.clause!r}: {report.failure.sentence}"
    return Signature.of(effect).sentence()


_BASELINES = {
    "colour-points": "colour-points: seen beside white and primaries measured again at every hour",
    "first-hour": "first-hour: seen only by a model that starts from hour 0 (--baseline first-hour)",
}


def _print_parameters(console: Console, effect: Effect) -> None:
    if not effect.parameters:
        return
    table = _table("parameter", "typical", "bounds", "unit", "neutral", "meaning")
    for name, each in effect.parameters.items():
        bounds = f"{each.bounds[0]:g} to {each.bounds[1]:g}"
        neutral = f"{effect.neutral[name]:g}" if name in effect.neutral else "–"
        table.add_row(*_plain(name, f"{each.value:g}", bounds, each.unit, neutral, each.meaning))
    _print_table(console, table)
    console.print("\nFits free these, the simplest first:", markup=False)
    for index, form in enumerate(effect.forms):
        console.print(f"  {', '.join(form)}{'  (refined)' if index >= effect.refined else ''}", markup=False)
    console.print()


def _check(file: str, data: str | None, time_limit: float | None, *, as_json: bool) -> None:
    from lutgen.effects.child import LIMIT_S, check_file

    reports = check_file(file, limit_s=time_limit or LIMIT_S)
    rehearsals = _rehearse(file, data, reports) if data else {}
    if as_json:
        checked = [report.as_json() | _rehearsal_json(rehearsals.get(report.effect)) for report in reports]
        echo_json({"schema": 1, "file": file, "passed": all(each.passed for each in reports), "effects": checked})
    else:
        for report in reports:
            _report(report)
            _print_rehearsal(rehearsals.get(report.effect))
    if not all(report.passed for report in reports):
        sys.exit(1)


def _report(report: Report) -> None:
    console = _console()
    broken = sum(not clause.passed for clause in report.clauses)
    state = (
        f"breaks {broken} of {len(report.clauses)} clauses" if broken else f"keeps all {len(report.clauses)} clauses"
    )
    console.print(f"{report.effect} {state} of the contract.\n", markup=False)
    table = _table("clause", "kept", "")
    for clause in report.clauses:
        table.add_row(*_plain(clause.clause, "yes" if clause.passed else "NO", clause.sentence))
    _print_table(console, table)


def _rehearse(file: str, data: str, reports: tuple[Report, ...]) -> dict[str, Any]:
    """What readings could show of the effects that keep the contract: name → Rehearsal."""
    from lutgen.criticism.rehearse import rehearse
    from lutgen.effects.own import everything, load_file
    from lutgen.readings import read_measurements

    measurements = read_measurements(data)
    sound = {report.effect for report in reports if report.passed}
    others = tuple(everything().values())
    return {each.name: rehearse(each, measurements, others) for each in load_file(file) if each.name in sound}


def _rehearsal_json(rehearsal: Any) -> dict[str, Any]:
    if rehearsal is None:
        return {}
    return {
        "rehearsal": {
            "absorbed": rehearsal.absorbed,
            "smallest_detectable": rehearsal.smallest_detectable,
            "unit": rehearsal.unit,
            "likeness": [list(pair) for pair in rehearsal.likeness],
            "recovered": rehearsal.recovered,
            "sentence": rehearsal.sentence,
        }
    }


def _print_rehearsal(rehearsal: Any) -> None:
    if rehearsal is None:
        return
    console = _console()
    console.print(f"\n{rehearsal.sentence}", markup=False)
    table = _table(None, None)
    absorbed = "it leaves no trace" if rehearsal.absorbed is None else f"{rehearsal.absorbed:.0%}"
    table.add_row(*_plain("hidden by white and primaries", absorbed))
    unit = "" if rehearsal.unit == "1" else f" {rehearsal.unit}"
    size = rehearsal.smallest_detectable
    table.add_row(*_plain("smallest detectable size", "none" if size is None else f"{size:.3g}{unit}"))
    likeness = ", ".join(f"{name} {share:.2f}" for name, share in rehearsal.likeness)
    table.add_row(*_plain("likeness to others", likeness or "none"))
    table.add_row(*_plain("hidden in these readings and found again", "yes" if rehearsal.recovered else "NO"))
    _print_table(console, table)


def _console() -> Console:
    from rich.console import Console

    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=_WIDTH)


def _table(*heads: str | None) -> Table:
    """Make a table without frame; heads of None leave the head line out."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), show_header=heads[0] is not None)
    for head in heads:
        table.add_column(head or "", vertical="top")
    return table


def _print_table(console: Console, table: Table) -> None:
    from lutgen.cli.narrow import fitted

    fitted(table, console).print(table)


def _plain(*cells: str) -> list[Any]:
    """Cells as they are: brackets in them are no markup."""
    from rich.text import Text

    return [Text(cell) for cell in cells]
