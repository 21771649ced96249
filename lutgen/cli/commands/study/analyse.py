"""``lutgen study analyse``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lutgen.cli.command import Command
from lutgen.cli.outputs import check_json, check_new_file, check_pictures, print_page, write_json
from lutgen.cli.picture_options import json_option
from lutgen.cli.shared import progress_bar
from lutgen.names import INTERVALS

if TYPE_CHECKING:
    from lutgen.study.analysis import Analysis


@click.command(cls=Command)
@click.argument("study", required=False, metavar="[STUDY]")
@click.option("--answers", metavar="FILE", help="A table of answers instead (.csv), such as study simulate writes.")
@click.option("--counts", metavar="FILE", help="Figures instead: a .csv of condition,agreed,disagreed.")
@click.option("--summary", metavar="FILE", help="Figures instead: a .csv of condition,measure,n,mean,ci95.")
@click.option(
    "--ci",
    type=click.Choice(INTERVALS),
    default="normal",
    show_default=True,
    help="Intervals of means, read and written: ± 1.96 SD/√n as the paper's, or ± t SD/√n.",
)
@json_option
@click.option("--csv", "csv_to", metavar="DIR", help="Write every table into this folder, a .csv each.")
@click.option("--plots", metavar="DIR", help="Draw time, ease and agreement by condition into this folder.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
def command(
    *,
    study: str | None,
    answers: str | None,
    counts: str | None,
    summary: str | None,
    ci: str,
    json_to: str | None,
    csv_to: str | None,
    plots: str | None,
    force: bool,
) -> None:
    """Show the results of a reader study: the paper's Tables 2 to 4, and more.

    As in the paper: time to score and ease of reading with their t-tests; agreement with the reader's own un-aged
    reading, with Wilson's intervals and one-tailed t-tests. Beside these: Welch, rank, exact and paired tests, Cohen's
    κ, mixed models over readers and images (with lutgen[study]), effect sizes, Holm's correction, and what a study of
    this design can and cannot show. STUDY is a folder of lutgen study plan; --counts and --summary take the figures
    that a paper prints, alone or together. Ends with 0 whatever the result is.

    \b
    Example:
      lutgen study analyse --counts examples/paper-study-counts.csv --summary examples/paper-study-summary.csv
    """
    if sum(map(bool, (study, answers, counts or summary))) != 1:
        message = "give one of: the folder STUDY, --answers FILE, or --counts FILE and --summary FILE (one or both)."
        raise click.UsageError(message)
    alone = check_json(json_to, force=force)
    _check(csv_to, plots, force=force)
    with progress_bar("analysing", quiet=alone):
        analysis = _analysis(study, answers, counts, summary, ci)
    picture = None
    if csv_to:
        _write_tables(analysis, csv_to)
    if plots:
        from lutgen.report.study_analysis import plot_study

        picture = plot_study(analysis, plots, force=force)
    if json_to:
        write_json(analysis.as_json(), json_to)
    if not alone:
        from lutgen.report.study_analysis import study_page

        print_page([*study_page(analysis), *([f"Picture: {picture}"] if picture else [])])


def _check(csv_to: str | None, plots: str | None, *, force: bool) -> None:
    """Refuse places that cannot be written to, before any work is done for them."""
    from pathlib import Path

    if csv_to:
        from lutgen.study.tables import TABLE_FILES

        for name in TABLE_FILES:
            check_new_file(str(Path(csv_to) / name), force=force)
    if plots:
        from lutgen.report.study_analysis import PICTURE

        check_pictures(plots, [PICTURE], force=force)


def _write_tables(analysis: Analysis, folder: str) -> None:
    """Write the tables; those of an earlier analysis that this one does not have are taken away."""
    from pathlib import Path

    from lutgen.files import write_atomically
    from lutgen.study.tables import TABLE_FILES, tables_csv

    texts = tables_csv(analysis)
    for name, text in texts.items():
        write_atomically(Path(folder) / name, text.encode())
    for name in TABLE_FILES:
        if name not in texts:
            (Path(folder) / name).unlink(missing_ok=True)


def _analysis(study: str | None, answers: str | None, counts: str | None, summary: str | None, ci: str) -> Analysis:
    from lutgen.study.analysis import analyse_answers, analyse_figures

    if study:
        return _of_study(study, ci)
    if answers:
        from lutgen.study.tables import read_answer_table

        remark, given = read_answer_table(answers)
        return analyse_answers(given, sources=[_source(answers, remark)], ci=ci)
    from lutgen.study.tables import read_counts, read_summary

    remark, rows = read_counts(counts) if counts else ("", ())
    sources = [_source(counts, remark)] if counts else []
    remark, measured = read_summary(summary, ci=ci) if summary else ("", ())
    sources += [_source(summary, remark)] if summary else []
    return analyse_figures(rows, measured, sources=sources, ci=ci)


def _of_study(study: str, ci: str) -> Analysis:
    from pathlib import Path

    from lutgen.errors import LutgenError
    from lutgen.study.analysis import analyse_answers
    from lutgen.study.answers import read_answers
    from lutgen.study.protocol import read_protocol

    folder = Path(study)
    protocol = read_protocol(folder)
    given = read_answers(folder)
    if not given:
        raise LutgenError(f"{study}: nobody has answered yet. Run a session with lutgen study run.")
    names = [condition.name for condition in protocol.conditions]
    missing = len(protocol.trials) - len(given)
    left = f" {missing} of {len(protocol.trials)} are still to be given." if missing else ""
    source = f"Study: {protocol.title or study}, {len(given)} answers.{left}"
    return analyse_answers(given, conditions=names, sources=[source], ci=ci)


def _source(file: str, remark: str) -> str:
    """Say where figures come from; what a file says of itself in its first line comes first."""
    from pathlib import Path

    name = Path(file).name
    return f"{remark.rstrip('.')}. File: {name}." if remark else f"File: {name}, which does not say where it is from."
