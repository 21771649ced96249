"""The page of ``lutgen lint``: which program reads a file as it is meant, and by which rule one does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.lint.finding import LEVELS, READS
from lutgen.report.parts import Headline, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lutgen.lint.finding import Linted
    from lutgen.report.parts import Part


def lint_page(linted: Linted) -> Iterator[Part]:
    """Yield what ``lutgen lint`` prints of one file: a summary, a table of the readers, the findings, failed trials."""
    yield Headline(headline(linted))
    yield ", ".join(linted.facts)
    yield readers_table(linted)
    for level in LEVELS:
        for finding in linted.findings:
            if finding.level(linted.readers) == level:
                line = f"line {finding.line}: " if finding.line else ""
                yield f"{level}: {line}{finding.what} [{finding.rule}]. {finding.remedy}"
    for trial in linted.disagreements():
        yield f"the rules do not say what {trial.reader} {trial.version} does here: please report this file."
    yield ""


def headline(linted: Linted) -> str:
    """Say in a sentence which readers read the file as it is meant."""
    good = [reader for reader in linted.readers if linted.fate(reader)[0].outcome == READS]
    if len(good) == len(linted.readers):
        failed = [trial.reader for trial in linted.trials if trial.outcome not in {READS, ""}]
        if failed:
            return f"{linted.path}: should be read by all, but {', '.join(failed)} did otherwise."
        return f"{linted.path}: every reader does what is meant."
    if not good:
        return f"{linted.path}: no reader does what is meant."
    return f"{linted.path}: {len(good)} of {len(linted.readers)} readers do what is meant: {', '.join(good)}."


def readers_table(linted: Linted) -> Table:
    """Tabulate the readers: what each is expected to do, by which rule, and what it did in a trial here."""
    tried = {trial.reader: trial for trial in linted.trials}
    headings = ("reader", "will", "how", "rule")
    rows = []
    for reader in dict.fromkeys([*linted.readers, *tried]):
        foretold = reader in linted.readers
        fate, finding = linted.fate(reader)
        cells = [reader, fate.outcome if foretold else "", fate.how, finding.rule if finding else ""]
        trial = tried.get(reader)
        if tried:
            cells.append(f"{trial.version} {trial.outcome}: {trial.said}".strip(" :") if trial else "–")
        rows.append(cells)
    return Table((*headings, "tried here") if tried else headings, rows, words=range(5))
