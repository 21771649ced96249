"""The pages of ``lutgen build`` and ``lutgen check``: certificates of the files, colours out of reach, shaders."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.report.parts import Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from lutgen.bake.manifest import FileRecord
    from lutgen.bake.summary import SummaryRow
    from lutgen.report.parts import Part

_UNREACHABLE = {
    "clip": "Colours out of reach are clipped by channels of the drive; all others stay exact.",
    "scale": "Everything is dimmed until no colour needs more than full drive; the rest is too saturated.",
}


def certificates(rows: list[SummaryRow]) -> Iterator[Part]:
    """Tabulate the worst figures of each mode, format and group of colours."""
    headings = ("mode", "format", "files", "largest ΔE2000", "mean", "99 %", "max")
    cells = [
        (
            row.mode,
            row.format,
            str(row.files),
            row.group.replace("_", " "),
            *(f"{value:.4f}" for value in (row.mean, row.p99, row.max)),
        )
        for row in rows
    ]
    yield Table(headings, cells, words=range(len(headings)))


def simulation(luts: list[FileRecord]) -> Iterator[Part]:
    """Say which share of colours is clipped at most, and define the groups of colours."""
    worst = max(luts, key=lambda record: record.certificate["clipped_share"] if record.certificate else 0.0)
    share = worst.certificate["clipped_share"] if worst.certificate else 0.0
    yield f"Up to {share:.1%} of the test colours leave the viewer's sRGB gamut ({worst.mode}, {worst.hours:g} h)."
    yield "smooth: the model without its jumps and clipping; gamut, border: where it clips, where it jumps."


def compensation(luts: list[FileRecord], unreachable: str) -> Iterator[Part]:
    """Tabulate by mode and hour the colours out of reach and the aging that is left, from the first file of each."""
    yield "smooth, gamut, border: the files against the model's drives. The others: what the aged display shows through"
    yield "them against the un-aged display; border: where the table mixes across a jump or the end of the drive."
    headings = (
        "mode",
        "hours",
        "out of reach: all",
        "tissue",
        "light",
        "ΔE2000 reached",
        "99 %",
        "out of reach",
        "99 %",
    )
    rows: dict[tuple[str | None, float | None], tuple[str, ...]] = {}
    for record in sorted(luts, key=lambda record: bool(record.clipped)):
        certificate = record.certificate
        if certificate and (record.mode, record.hours) not in rows:
            shares = [
                certificate["unreachable_lattice_share"],
                certificate["unreachable_tissue_share"],
                certificate["scale"],
            ]
            groups = [certificate[group][figure] for group in ("reached", "unreachable") for figure in ("mean", "p99")]
            rows[record.mode, record.hours] = (
                str(record.mode),
                f"{record.hours:g}",
                *(f"{share:.1%}" for share in shares),
                *(f"{value:.3f}" for value in groups),
            )
    yield Table(headings, list(rows.values()), words=range(len(headings)))
    yield _UNREACHABLE[unreachable]


def shaders(files: Iterable[FileRecord]) -> Iterator[Part]:
    """Say how far the shaders differ from the CPU, if they were run."""
    runs = [record.gpu for record in files if record.gpu]
    if runs:
        largest = max(view["max"] for run in runs for view in run["views"].values())
        yield shader_sentence(str(runs[0]["renderer"]), len(runs), largest)


def shader_sentence(renderer: str, configs: int, largest: float) -> str:
    """Say by how many code values the shaders of some configs differ from the CPU at most."""
    count = f"{configs} config{'s' if configs != 1 else ''}"
    away = f"{largest:.1e} of code value from the CPU ({largest * 255:.4f} of 255)"
    return f"Shaders of {count} on {renderer}: at most {away}."
