"""The pages about LUT files: certificates of a build, readers of a file, changes by a merge."""

from collections.abc import Iterable, Iterator

from lutgen.bake.figures import SummaryRow
from lutgen.bake.manifest import FileRecord
from lutgen.lint.finding import LEVELS, READS, Linted
from lutgen.merge import Merged
from lutgen.numerals import in_percent
from lutgen.report.parts import Headline, Part, Table

_UNREACHABLE = {
    "clip": "Colours out of reach are clipped by channels of the drive; all others stay exact.",
    "scale": "All colours are dimmed until none needs more than full drive; colours out of reach are too saturated.",
}


def certificates(rows: list[SummaryRow]) -> Iterator[Part]:
    """Yield a table of the worst figures of each mode, format and group of colours."""
    headings = ("mode", "format", "files", "largest ΔE2000", "mean", "99 %", "max")
    cells = []
    for row in rows:
        figures = (f"{value:.4f}" for value in (row.mean, row.p99, row.max))
        cells.append((row.mode, row.format, str(row.files), row.group.replace("_", " "), *figures))
    yield Table(headings, cells, words=range(len(headings)))


def simulation(luts: list[FileRecord]) -> Iterator[Part]:
    """Yield the largest share of clipped colours, and definitions of the groups of colours."""
    worst = max(luts, key=lambda record: record.certificate["clipped_share"] if record.certificate else 0.0)
    share = worst.certificate["clipped_share"] if worst.certificate else 0.0
    where = f"({worst.mode}, {worst.hours:g} h)"
    yield f"Up to {in_percent(share, 1)} of the test colours leave the viewer's sRGB gamut {where}."
    yield (
        "smooth: colours where the model neither jumps nor clips; gamut: colours where it clips; border: colours where "
        "it jumps."
    )


def compensation(luts: list[FileRecord], unreachable: str) -> Iterator[Part]:
    """Yield a table of colours out of reach and residual aging by mode and hour, from the first file of each."""
    yield (
        "smooth, gamut, border: the files against the model's drives. The other groups: the aged display with the "
        "corrected drive against the un-aged display; reached border: where the table interpolates across a jump or "
        "the end of the drive."
    )
    heads = ("mode", "hours", "out of reach: all", "tissue", "light", "ΔE2000 reached", "99 %", "out of reach", "99 %")
    rows: dict[tuple[str | None, float | None], tuple[str, ...]] = {}
    for record in sorted(luts, key=lambda record: bool(record.clipped)):
        certificate = record.certificate
        if certificate and (record.mode, record.hours) not in rows:
            shares = [certificate[key] for key in ("unreachable_lattice_share", "unreachable_tissue_share", "scale")]
            groups = [certificate[group][figure] for group in ("reached", "unreachable") for figure in ("mean", "p99")]
            cells = [in_percent(share, 1) for share in shares] + [f"{value:.3f}" for value in groups]
            rows[record.mode, record.hours] = (str(record.mode), f"{record.hours:g}", *cells)
    yield Table(heads, list(rows.values()), words=range(len(heads)))
    yield _UNREACHABLE[unreachable]


def shaders(files: Iterable[FileRecord]) -> Iterator[Part]:
    """Yield the difference of the shaders from the CPU, if the shaders were run."""
    runs = [record.gpu for record in files if record.gpu]
    if runs:
        largest = max(view["max"] for run in runs for view in run["views"].values())
        yield shader_sentence(str(runs[0]["renderer"]), len(runs), largest)


def shader_sentence(renderer: str, configs: int, largest: float) -> str:
    """Return a sentence on the largest difference in code value between the shaders of some configs and the CPU."""
    count = f"{configs} config{'s' if configs != 1 else ''}"
    away = f"{largest:.1e} of code value from the CPU ({largest * 255:.4f} of 255)"
    return f"Shaders of {count} on {renderer}: at most {away}."


def lint_page(linted: Linted) -> Iterator[Part]:
    """Yield what ``lutgen lint`` prints for a file: a summary, a table of readers, the findings, failed trials."""
    yield Headline(lint_headline(linted))
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


def lint_headline(linted: Linted) -> str:
    """Return a sentence on which readers show the file as its author intends."""
    good = [reader for reader in linted.readers if linted.fate(reader)[0].outcome == READS]
    failed = [trial.reader for trial in linted.trials if trial.outcome not in {READS, ""}]
    if len(good) < len(linted.readers):
        some = f"{len(good)} of {len(linted.readers)} readers do what is meant: {', '.join(good)}"
        what = some if good else "no reader does what is meant"
    elif failed:
        what = f"should be read by all, but {', '.join(failed)} did otherwise"
    else:
        what = "every reader does what is meant"
    return f"{linted.path}: {what}."


def readers_table(linted: Linted) -> Table:
    """Return a table of the readers: the expected behaviour, the rule, and the result of a trial here."""
    tried = {trial.reader: trial for trial in linted.trials}
    headings = ("reader", "will", "how", "rule")
    rows = []
    for reader in dict.fromkeys([*linted.readers, *tried]):
        predicted = reader in linted.readers
        fate, finding = linted.fate(reader)
        cells = [reader, fate.outcome if predicted else "", fate.how, finding.rule if finding else ""]
        trial = tried.get(reader)
        if tried:
            cells.append(f"{trial.version} {trial.outcome}: {trial.message}".strip(" :") if trial else "–")
        rows.append(cells)
    return Table((*headings, "tried here") if tried else headings, rows, words=range(5))


def merge_page(merged: Merged) -> Iterator[Part]:
    """Yield what ``lutgen merge`` prints."""
    yield Headline(f"{merged.config}: {len(merged.views)} aged view{'s' if len(merged.views) != 1 else ''} added.")
    for display, view in merged.views:
        yield f"display {display}, view {view}"
    yield (
        f"They take the code values of {merged.source_space}. All {merged.compared} parts that were there give the "
        f"same pixels as before; the aged views differ from the build's own by {merged.difference:.1g} at most."
    )
    for remark in merged.remarks:
        yield f"note: {remark}"
