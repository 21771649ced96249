"""The pages of ``lutgen lint`` and ``lutgen merge``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from lutgen.bake.lint.finding import LEVELS, READS
from lutgen.report.criticism.comparison import table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from lutgen.bake.lint.finding import Linted
    from lutgen.bake.merge import Merged


def lint_page(found: Linted) -> Iterator[RenderableType]:
    """Yield what ``lutgen lint`` prints of one file: a sentence, who does what, what was found, what was tried."""
    yield Text(headline(found), style="bold")
    yield ", ".join(found.facts)
    yield readers_table(found)
    for level in LEVELS:
        for finding in found.findings:
            if finding.level(found.readers) == level:
                line = f"line {finding.line}: " if finding.line else ""
                yield f"{level}: {line}{finding.what} [{finding.rule}]. {finding.remedy}"
    for trial in found.disagreements():
        yield f"the rules do not say what {trial.reader} {trial.version} does here: please report this file."
    yield ""


def headline(found: Linted) -> str:
    """Say in a sentence who reads the file as it is meant."""
    good = [reader for reader in found.readers if found.fate(reader)[0].outcome == READS]
    if len(good) == len(found.readers):
        failed = [trial.reader for trial in found.trials if trial.outcome not in {READS, ""}]
        if failed:
            return f"{found.path}: should be read by all, but {', '.join(failed)} did otherwise."
        return f"{found.path}: every reader does what is meant."
    if not good:
        return f"{found.path}: no reader does what is meant."
    return f"{found.path}: {len(good)} of {len(found.readers)} readers do what is meant: {', '.join(good)}."


def readers_table(found: Linted) -> RenderableType:
    """One row for a reader: what it will do, by which rule, and what it did when it was tried."""
    tried = {trial.reader: trial for trial in found.trials}
    heads = ("reader", "will", "how", "rule")
    made = table(*heads, *(["tried here"] if tried else []), left=5)
    for reader in dict.fromkeys([*found.readers, *tried]):
        told = reader in found.readers
        fate, finding = found.fate(reader)
        cells = [reader, fate.outcome if told else "", fate.how, finding.rule if finding else ""]
        trial = tried.get(reader)
        if tried:
            cells.append(f"{trial.version} {trial.outcome}: {trial.said}".strip(" :") if trial else "–")
        made.add_row(*map(Text, cells))
    return made


def merge_page(merged: Merged) -> Iterator[RenderableType]:
    """Yield what ``lutgen merge`` prints."""
    yield Text(
        f"{merged.config}: {len(merged.views)} aged view{'s' if len(merged.views) != 1 else ''} added.", style="bold"
    )
    for display, view in merged.views:
        yield f"display {display}, view {view}"
    yield (
        f"They take the code values of {merged.source_space}. All {merged.compared} parts that were there give the "
        f"same pixels as before; the aged views differ from the build's own by {merged.difference:.1g} at most."
    )
    for remark in merged.remarks:
        yield f"note: {remark}"
