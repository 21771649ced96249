from pathlib import Path
from typing import Any

import click

from lutgen.cli.command import Command, Section
from lutgen.cli.data_options import data_options, question_from
from lutgen.cli.outputs import Outputs
from lutgen.files import check_new_file, write_atomically


@click.command(cls=Command, section=Section.CRITICISM, place=4)
@data_options()
@click.option("--between", metavar="A,B", help="Two effects to separate.")
@click.option("--effect", metavar="NAME", help="One effect to make visible.")
@click.option("--ti1", metavar="PLAN.ti1", help="Write the code values for ArgyllCMS too.")
@click.option("-o", "--output", metavar="PLAN.csv", help="Write the list with the columns of DATA, for you to fill in.")
def command(
    *,
    between: str | None,
    effect: str | None,
    json_to: str | None,
    force: bool,
    ti1: str | None,
    output: str | None,
    **options: Any,
) -> None:
    """List what to measure next, to separate two effects or to see one.

    Without --between and --effect the list shows as many as possible of the effects that DATA cannot show. If DATA
    already tell the two effects of --between apart, the report says so, and no list is written.

    \b
    Example:
      lutgen plan examples/display-a.csv --between crosstalk,loading -o plan.csv --ti1 plan.ti1
      lutgen plan examples/display-a.csv --effect edge-falloff
      lutgen plan examples/display-a.csv --json -
    """
    pair = _pair(between)
    if pair and effect:
        raise click.UsageError("--between and --effect ask for two different plans. Leave one out.")
    from lutgen.criticism.plan import plan
    from lutgen.report.measurement_plan import plan_page

    outputs = Outputs(json_to, force=force)
    suffixes = {path: suffix for path, suffix in ((output, ".csv"), (ti1, ".ti1")) if path}
    for path, suffix in suffixes.items():
        check_new_file(path, force=force, suffixes=(suffix,))
    question = question_from(**options)
    planned = plan(question.readings, between=pair, effect=effect, **question.settings, effects=question.effects)
    # Without patches there is no list to write; the page says why.
    written = list(suffixes) if planned.patches else []
    for path in written:
        write_atomically(Path(path), (planned.as_csv() if suffixes[path] == ".csv" else planned.as_ti1()).encode())
    kind = "between" if pair else "effect" if effect else "coverage"
    outputs.write(plan_page(planned, kind, written), planned.as_json)


def _pair(between: str | None) -> tuple[str, str] | None:
    if between is None:
        return None
    names = [part.strip() for part in between.split(",") if part.strip()]
    if len(names) != 2:
        raise click.UsageError(f"--between takes two effects, A,B; {between!r} names {len(names)}.")
    return names[0], names[1]
