"""What ``lutgen build`` and ``lutgen check`` say of the files: certificates, colours out of reach, shaders."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rich.console import RenderableType

    from lutgen.bake.manifest import FileRecord
    from lutgen.bake.summary import SummaryRow

_UNREACHABLE = {
    "clip": "Colours out of reach are clipped by channels of the drive; all others stay exact.",
    "scale": "Everything is dimmed until no colour needs more than full drive; the rest is too saturated.",
}


def certificates(rows: list[SummaryRow]) -> Iterator[RenderableType]:
    """Give the worst figures of each mode, format and group of colours."""
    table = Table("mode", "format", "files", "largest ΔE2000", "mean", "99 %", "max", box=None, pad_edge=False)
    for row in rows:
        figures = [f"{value:.4f}" for value in (row.mean, row.p99, row.max)]
        table.add_row(row.mode, row.format, str(row.files), row.group.replace("_", " "), *figures)
    yield table


def simulation(luts: list[FileRecord]) -> Iterator[RenderableType]:
    """Say how many colours are clipped, and what the groups are."""
    worst = max(luts, key=lambda record: record.certificate["clipped_share"] if record.certificate else 0.0)
    share = worst.certificate["clipped_share"] if worst.certificate else 0.0
    yield f"Up to {share:.1%} of the test colours leave the viewer's sRGB gamut ({worst.mode}, {worst.hours:g} h)."
    yield "smooth: the model without its jumps and clipping; gamut, border: where it clips, where it jumps."


def compensation(luts: list[FileRecord], unreachable: str) -> Iterator[RenderableType]:
    """Give the colours out of reach and what is left of the aging, by mode and hour, from each display's first file."""
    yield "smooth, gamut, border: the files against the model's drives. The others: what the aged display shows through"
    yield "them against the un-aged display; border: where the table mixes across a jump or the end of the drive."
    columns = (
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
    table = Table(*columns, box=None, pad_edge=False)
    shown = set()
    for record in sorted(luts, key=lambda record: bool(record.clipped)):
        said = record.certificate
        if said and (record.mode, record.hours) not in shown:
            shown.add((record.mode, record.hours))
            shares = [said["unreachable_lattice_share"], said["unreachable_tissue_share"], said["scale"]]
            groups = [said[group][figure] for group in ("reached", "unreachable") for figure in ("mean", "p99")]
            table.add_row(
                str(record.mode),
                f"{record.hours:g}",
                *(f"{share:.1%}" for share in shares),
                *(f"{value:.3f}" for value in groups),
            )
    yield table
    yield _UNREACHABLE[unreachable]


def shaders(files: Iterable[FileRecord]) -> Iterator[RenderableType]:
    """Say how far the shaders were from the CPU, where they were run."""
    runs = [record.gpu for record in files if record.gpu]
    if runs:
        largest = max(view["max"] for run in runs for view in run["views"].values())
        yield shader_sentence(str(runs[0]["renderer"]), len(runs), largest)


def shader_sentence(renderer: str, configs: int, largest: float) -> str:
    """Say how far the shaders of some configs were from the CPU at most, in code values."""
    count = f"{configs} config{'s' if configs != 1 else ''}"
    away = f"{largest:.1e} of code value from the CPU ({largest * 255:.4f} of 255)"
    return f"Shaders of {count} on {renderer}: at most {away}."
