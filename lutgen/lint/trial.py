"""``lutgen lint --try``: installed readers read the file, and their colours are compared with our own reading."""

from __future__ import annotations

import shutil
import subprocess
from typing import TYPE_CHECKING

import numpy as np

from lutgen.files import under_its_name
from lutgen.lint.cube.meaning import read_as_meant
from lutgen.lint.cube.statistics import MAX_KEPT
from lutgen.lint.finding import OCIOCHECK, READS, REFUSES, WRONG, Trial
from lutgen.lint.programs import MAX_BYTES, TIMEOUT, Absent, Program, Refusal, probe_colours, programs

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.lint.cube.scan import CubeScan


def try_cube(scan: CubeScan) -> Iterator[Trial]:
    """Yield what each reader does with a file that was scanned with ``keep``."""
    code = probe_colours()
    meant = read_as_meant(scan, code / 255)
    for program in programs():
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
    found = shutil.which(OCIOCHECK)
    if found is None:
        yield Trial(OCIOCHECK, "", "", "ociocheck is not on the PATH (Debian: apt install opencolorio-tools)")
        return
    try:
        done = subprocess.run(  # noqa: S603 - no shell
            [found, "--iconfig", str(path)], capture_output=True, check=False, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        yield Trial(OCIOCHECK, "", REFUSES, f"gives no answer in {TIMEOUT} s")
        return
    said = [line for line in done.stdout.decode(errors="replace").splitlines() if line.strip()]
    version = next((line.split(":")[1].strip() for line in said if line.startswith("OpenColorIO Library Version")), "")
    failed = bool(done.returncode)
    yield Trial(
        OCIOCHECK, version, REFUSES if failed else READS, said[-1] if failed and said else "loads and validates"
    )
