"""``lutgen lint --try``: installed readers read the file; their colours are compared with those that the author meant.

:func:`read_as_meant` is our own reading of a ``.cube``.
"""

from __future__ import annotations

import shutil
import subprocess
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.files import under_its_name
from lutgen.lint.finding import OCIOCHECK, READS, REFUSES, WRONG, Trial
from lutgen.lint.programs import MAX_BYTES, PROGRAMS, TIMEOUT, Absent, Program, Refusal, probe_colours
from lutgen.lint.table_statistics import MAX_KEPT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.lint.cube_scan import CubeScan

#: Irregularities with which a table has no defined colours.
MEANINGLESS = {"nan", "infinite", "overflow", "columns", "text", "NUL"}


def read_as_meant(scan: CubeScan, code: Array) -> Array | None:
    """Return the colours that a kept file means for code values, (n, 3) both, trilinearly; None: undefined."""
    if MEANINGLESS & set(scan.oddities) or len(scan.named("LUT_3D_SIZE")) > 1 or not (scan.size or scan.size_1d):
        return None
    shown: Array | None = code
    if scan.size_1d:
        shown = _through_curves(scan, code)
    if scan.size and shown is not None:
        shown = _through_table(scan, shown)
    return shown


def _through_curves(scan: CubeScan, code: Array) -> Array | None:
    place = _place(scan, code, "LUT_1D_INPUT_RANGE")
    surplus = scan.table.rows and not scan.size
    if place is None or surplus or len(scan.shaper) != scan.size_1d or scan.size_1d < 2:
        return None
    index = np.linspace(0, 1, scan.size_1d)
    return np.column_stack([np.interp(place[:, i], index, scan.shaper[:, i]) for i in range(3)])


def _through_table(scan: CubeScan, code: Array) -> Array | None:
    place = _place(scan, code, "LUT_3D_INPUT_RANGE")
    table = scan.table.table
    if place is None or table is None or len(table) != scan.size**3:
        return None
    return trilinear(table.reshape(scan.size, scan.size, scan.size, 3), place)


def _place(scan: CubeScan, code: Array, keyword: str) -> Array | None:
    """Return the position of code values in the input range of a part, 0..1; None where the range is empty."""
    low, high = _range(scan, keyword)
    return np.clip((code - low) / (high - low), 0, 1) if (high > low).all() else None


def trilinear(table: Array, place: Array) -> Array:
    """Interpolate a table, indexed [blue, green, red], at positions (n, 3) in 0..1, as a sum over eight corners."""
    size = len(table)
    scaled = place * (size - 1)
    cell = np.clip(np.floor(scaled).astype(int), 0, max(size - 2, 0))
    share = scaled - cell
    result = np.zeros_like(place)
    for corner in product((0, 1), repeat=3):
        red, green, blue = np.minimum(cell + corner, size - 1).T
        weight = np.where(corner, share, 1.0 - share).prod(axis=1)
        result += weight[:, np.newaxis] * table[blue, green, red]
    return result


def _range(scan: CubeScan, keyword: str) -> tuple[Array, Array]:
    """Return the input of the first and of the last row of a part, each (3,)."""
    low, high = np.zeros(3), np.ones(3)
    if keyword == "LUT_3D_INPUT_RANGE" or not scan.size:
        low, high = scan.domain
    for entry in scan.named(keyword):
        ends = entry.numbers(2)
        if ends is not None:
            low, high = np.full(3, ends[0]), np.full(3, ends[1])
    return low, high


def try_cube(scan: CubeScan) -> Iterator[Trial]:
    """Yield what each reader does with a file that was scanned with ``keep``."""
    code = probe_colours()
    meant = read_as_meant(scan, code / 255)
    for program in PROGRAMS:
        try:
            version = program.version()
        except Absent as absent:
            yield Trial(program.reader(), "", "", str(absent))
            continue
        if max(scan.size, scan.size_1d >> 8) > MAX_KEPT or scan.bytes > MAX_BYTES:
            yield Trial(program.reader(), version, "", f"not tried: more than {MAX_KEPT} points an axis, or 200 MiB")
            continue
        yield Trial(program.reader(), version, *_outcome(program, scan.path, code, meant))


def _outcome(program: Program, path: Path, code: NDArray[np.uint8], meant: Array | None) -> tuple[str, str]:
    with under_its_name(path, ".cube") as link:
        try:
            shown = program.apply(link, code)
        except Refusal as refusal:
            return REFUSES, " ".join(str(refusal).replace(str(link), path.name).split())[:300]
    if meant is None:
        return WRONG, "shows colours, though the file defines none"
    if program.clips:
        shown, meant = np.clip(shown, 0, 1), np.clip(meant, 0, 1)
    difference = float(np.abs(shown - meant).max())
    # NaN fails the comparison too.
    agrees = difference <= program.tolerance * max(1.0, float(np.abs(meant).max()))
    return READS if agrees else WRONG, f"differs from our reading by {difference:.2g} at most"


def try_config(path: Path) -> Iterator[Trial]:
    """Run ``ociocheck``, which loads and validates a config and opens no LUT file."""
    program = shutil.which(OCIOCHECK)
    if program is None:
        yield Trial(OCIOCHECK, "", "", "ociocheck is not on the PATH (Debian: apt install opencolorio-tools)")
        return
    try:
        done = subprocess.run(  # noqa: S603 - no shell
            [program, "--iconfig", str(path)], capture_output=True, check=False, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        yield Trial(OCIOCHECK, "", REFUSES, f"gives no answer in {TIMEOUT} s")
        return
    output = [line for line in done.stdout.decode(errors="replace").splitlines() if line.strip()]
    version = next(
        (line.split(":")[1].strip() for line in output if line.startswith("OpenColorIO Library Version")), ""
    )
    failed = bool(done.returncode)
    yield Trial(
        OCIOCHECK, version, REFUSES if failed else READS, output[-1] if failed and output else "loads and validates"
    )
