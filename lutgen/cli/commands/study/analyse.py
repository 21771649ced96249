from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lutgen.cli.command import Command
from lutgen.cli.options import Choice, json_option, replace_option
from lutgen.cli.outputs import Outputs, progress_bar
from lutgen.errors import LutgenError
from lutgen.files import check_new_file, write_atomically
from lutgen.names import INTERVALS

if TYPE_CHECKING:
    from lutgen.study.analysis import Analysis


@click.command(cls=Command)
@click.argument("study", required=False, metavar="[STUDY]")
@click.option("--answers", metavar="FILE", help="Analyse a table of answers (.csv), such as study simulate writes.")
@click.option("--counts", metavar="FILE", help="Analyse printed figures: a .csv of condition,agreed,disagreed.")
@click.option("--summary", metavar="FILE", help="Analyse printed figures: a .csv of condition,measure,n,mean,ci95.")
@click.option(
    "--ci",
    type=Choice(INTERVALS),
    default="normal",
    show_default=True,
    help="Intervals of means, read and written: ± 1.96 SD/√n as the paper's, or ± t SD/√n.",
)
@json_option
@click.option("--csv", "csv_to", metavar="DIR", help="Write each table as a .csv into this folder.")
@click.option("--plots", metavar="DIR", help="Draw time, ease and agreement by condition into this folder.")
@replace_option
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
    reading, with Wilson's intervals and one-tailed t-tests. In addition: Welch, rank, exact and paired tests, Cohen's
    κ, mixed models over readers and images (with lutgen[study]), effect sizes, Holm's correction, and what a study of
    this design can and cannot show. STUDY is a folder of lutgen study plan; --counts and --summary take figures that a
    paper prints, alone or together. The exit code is 0 for any result.

    \b
    Example:
      lutgen study analyse --counts examples/paper-study-counts.csv --summary examples/paper-study-summary.csv
    """
    if sum(map(bool, (study, answers, counts or summary))) != 1:
        raise click.UsageError(
            "give one of: the folder STUDY, --answers FILE, or --counts FILE and --summary FILE (one or both)."
        )
    from lutgen.report.study_analysis import PICTURE, plot_study, study_page
    from lutgen.study.tables import TABLE_FILES

    outputs = Outputs(json_to, plots=plots, pictures=lambda: [PICTURE], force=force)
    for name in TABLE_FILES if csv_to else ():
        check_new_file(f"{csv_to}/{name}", force=force)
    with progress_bar("analysing", quiet=outputs.alone):
        analysis = _analysis(study, answers, counts, summary, ci)
    if csv_to:
        _write_tables(analysis, csv_to)
    outputs.write(
        study_page(analysis), analysis.as_json, plot=lambda folder: [plot_study(analysis, folder, force=force)]
    )


def _write_tables(analysis: Analysis, folder: str) -> None:
    """Write the tables; remove tables of an earlier analysis that the new analysis lacks."""
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
    from lutgen.study.analysis import analyse_answers
    from lutgen.study.answers import read_answers
    from lutgen.study.protocol import read_protocol

    folder = Path(study)
    protocol = read_protocol(folder)
    given = read_answers(folder)
    if not given:
        raise LutgenError(f"{study}: nobody has answered yet. Hold a reading session with `lutgen study run`.")
    names = [condition.name for condition in protocol.conditions]
    missing = len(protocol.trials) - len(given)
    left = f" {missing} of {len(protocol.trials)} are still to be given." if missing else ""
    source = f"Study: {protocol.title or study}, {len(given)} answers.{left}"
    return analyse_answers(given, conditions=names, sources=[source], ci=ci)


def _source(file: str, remark: str) -> str:
    """Return a sentence on the source of figures; ``remark`` is the file's own first line."""
    name = Path(file).name
    return f"{remark.rstrip('.')}. File: {name}." if remark else f"File: {name}, which does not say where it is from."
