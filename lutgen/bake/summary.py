"""The certificates of a build in a few rows: for each mode, format and group of colours, the worst file's figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    from lutgen.bake.manifest import FileRecord


class SummaryRow(NamedTuple):
    """The largest mean, 99 % quantile and maximum of ΔE2000 over some files."""

    mode: str
    format: str
    group: str
    files: int
    mean: float
    p99: float
    max: float


def summarise(records: Iterable[FileRecord]) -> list[SummaryRow]:
    """Return one row for each mode, format and group (smooth, gamut, border) that has colours, in file order."""
    rows: dict[tuple[str, str, str], SummaryRow] = {}
    for record in records:
        for group, figures in (record.certificate or {}).items():
            if not isinstance(figures, dict) or not figures["colours"]:
                continue
            key = (str(record.mode), str(record.format), group)
            row = rows.get(key, SummaryRow(*key, 0, 0.0, 0.0, 0.0))
            rows[key] = row._replace(
                files=row.files + 1,
                mean=max(row.mean, figures["mean"]),
                p99=max(row.p99, figures["p99"]),
                max=max(row.max, figures["max"]),
            )
    return list(rows.values())
