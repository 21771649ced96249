"""Colour differences of files as figures: mean, 99 % quantile and maximum; their summary, and their limits."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lutgen.bake.formats import format_named
from lutgen.bake.manifest import FileRecord
from lutgen.colorimetry import Array
from lutgen.numerals import in_percent

#: Limits that a .cube of 33³ meets for smooth colours on any plausible display: largest ΔE2000, and 99 % quantile.
MAX_DELTA_E, P99 = 1.0, 0.2

#: Tolerance between a file and its certificate: OpenColorIO 2.1 and 2.6 differ by up to 0.003 on the same file.
SLACK = 0.005


@dataclass(frozen=True)
class Figures:
    """ΔE2000 over ``colours`` colours: mean, 99 % quantile and maximum. Without colours all are 0."""

    colours: int
    mean: float
    p99: float
    max: float


def figures(error: Array, usual: NDArray[np.bool_] | None = None) -> Figures:
    """Summarise ΔE2000 values, shape (n,).

    ``usual``, (n,): which values count for the mean and the quantile. Values of colours that were added only to find
    the largest error do not count. If no value is usual, all values count.
    """
    if not error.size:
        return Figures(0, 0.0, 0.0, 0.0)
    spread = error if usual is None or not usual.any() else error[usual]
    return Figures(error.size, float(spread.mean()), float(np.quantile(spread, 0.99)), float(error.max()))


def rounded(value: Any) -> Any:
    """Round all numbers in a tree of dictionaries to the precision of float32 LUTs."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return round(value, 6) if isinstance(value, float) else value


#: Groups of a certificate that compare a file with the model. The other groups compare displays.
_OF_FILES = {"smooth": "is smooth", "gamut": "clips", "border": "jumps"}

#: Key of a certificate: the share of the lattice's colours that a corrected display cannot show.
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
    """Return one row for each mode, format and group (smooth, gamut, border) with colours, in file order."""
    rows: dict[tuple[str, str, str], SummaryRow] = {}
    for record in records:
        for group, errors in (record.certificate or {}).items():
            if not isinstance(errors, dict) or not errors["colours"]:
                continue
            key = (str(record.mode), str(record.format), group)
            row = rows.get(key, SummaryRow(*key, 0, 0.0, 0.0, 0.0))
            rows[key] = row._replace(
                files=row.files + 1,
                mean=max(row.mean, errors["mean"]),
                p99=max(row.p99, errors["p99"]),
                max=max(row.max, errors["max"]),
            )
    return list(rows.values())


def worst_error(records: Sequence[FileRecord], *, verbose: bool) -> str:
    """Return a line with the largest error of each group of colours over all files.

    For corrections the line also has the largest share of unreachable colours. Without ``verbose`` the line says how to
    get more.
    """
    worst: dict[str, float] = {}
    for row in summarise(records):
        if row.group in _OF_FILES:
            worst[row.group] = max(worst.get(row.group, 0.0), row.max)
    groups = ", ".join(f"{error:.2f} where the model {_OF_FILES[group]}" for group, error in worst.items())
    certificates = [each.certificate for each in records if each.certificate]
    shares = [float(each[_OUT_OF_REACH]) for each in certificates if _OUT_OF_REACH in each]
    reach = f"; up to {in_percent(max(shares), 1)} of the colours out of reach" if shares else ""
    more = "" if verbose else " (more with --verbose)"
    return f"Largest ΔE2000 of the files against the model: {groups}{reach}{more}."


def coarse(luts: Sequence[FileRecord]) -> str:
    """Return advice on the file with the largest smooth error, if a finer table would help; "" without large errors.

    Only formats whose finer table follows any display are considered.
    """
    errors = [
        (smooth["max"], smooth["p99"], lut)
        for lut in luts
        if lut.size and format_named(str(lut.format)).follows
        if (smooth := (lut.certificate or {}).get("smooth"))
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
