"""The certificates of a build in one line, or in a row for each mode, format and group of colours: the worst file's."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from lutgen.bake.figures import MAX_DELTA_E, P99
from lutgen.bake.formats import format_named

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lutgen.bake.manifest import FileRecord


#: Groups of colours in which a certificate compares a file with the model; the others compare displays.
_OF_FILES = ("smooth", "gamut", "border")

#: Share of the lattice's colours that a corrected display cannot show, in a certificate.
_OUT_OF_REACH = "unreachable_lattice_share"


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


def worst_error(records: Sequence[FileRecord], *, verbose: bool) -> str:
    """Return the largest error of each group of colours over all files, and the share out of reach of a correction.

    One line; without ``verbose`` it says how to get more.
    """
    worst: dict[str, float] = {}
    for row in summarise(records):
        if row.group in _OF_FILES:
            worst[row.group] = max(worst.get(row.group, 0.0), row.max)
    groups = ", ".join(f"{group} {error:.4f}" for group, error in worst.items())
    certificates = [each.certificate for each in records if each.certificate]
    shares = [float(each[_OUT_OF_REACH]) for each in certificates if _OUT_OF_REACH in each]
    reach = f"; up to {max(shares):.1%} of the colours out of reach" if shares else ""
    more = "" if verbose else " (more with --verbose)"
    return f"Largest ΔE2000 of the files against the model: {groups}{reach}{more}."


def coarse(luts: Sequence[FileRecord]) -> str:
    """Say which file errs most of those that a finer table would follow; "" where all are within the usual figures."""
    errors = [
        (figures["max"], figures["p99"], lut)
        for lut in luts
        if lut.size and format_named(str(lut.format)).follows
        for figures in ((lut.certificate or {}).get("smooth"),)
        if figures
    ]
    over = [each for each in errors if each[0] > MAX_DELTA_E or each[1] > P99]
    if not over:
        return ""
    error, _, lut = max(over, key=lambda each: each[0])
    return (
        f"{lut.size}³ is coarse for {len(over)} of {len(errors)} files: {lut.path} errs by up to {error:.2f} "
        f"where colours are smooth (usual: at most {MAX_DELTA_E:g}, 99 % at most {P99:g}). "
        "Take a larger --cubesize, or --tolerance."
    )
