"""``lutgen lint --try``: the readers that are installed read the file, and are compared with our own reading of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.bake.lint.finding import READS, REFUSES, WRONG, Trial
from lutgen.bake.lint.programs import Absent, Program, Refusal, programs
from lutgen.bake.lint.reading import read_as_meant
from lutgen.bake.lint.statistics import MAX_KEPT
from lutgen.files import under_its_name

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from lutgen.bake.lint.cube import CubeScan
    from lutgen.colorimetry import Array

#: 8-bit colours that are sent through, so that every reader is given the same ones exactly.
COLOURS, SEED = 400, 20250611

#: Files beyond this are not given to readers that believe the header, and would take all memory or hours.
MAX_BYTES = 200 << 20


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


def probe_colours() -> NDArray[np.uint8]:
    """Return the colours, uint8 (n, 3): the cube's corners, greys and random ones."""
    corners = np.array(np.meshgrid([0, 255], [0, 255], [0, 255])).reshape(3, -1).T
    greys = np.repeat(np.arange(0, 256, 15)[:, np.newaxis], 3, axis=1)
    random = np.random.default_rng(SEED).integers(0, 256, (COLOURS - len(corners) - len(greys), 3))
    return np.concatenate([corners, greys, random]).astype(np.uint8)


def _outcome(program: Program, path: Path, code: NDArray[np.uint8], meant: Array | None) -> tuple[str, str]:
    with under_its_name(path, ".cube") as link:
        try:
            shown = program.apply(link, code)
        except Refusal as refusal:
            return REFUSES, " ".join(str(refusal).replace(str(link), path.name).split())[:300]
    if meant is None:
        return WRONG, "shows something, though the file means nothing"
    if program.clips:
        shown, meant = np.clip(shown, 0, 1), np.clip(meant, 0, 1)
    difference = float(np.abs(shown - meant).max())
    # NaN fails the comparison too.
    agrees = difference <= program.tolerance * max(1.0, float(np.abs(meant).max()))
    return READS if agrees else WRONG, f"differs from our reading by {difference:.2g} at most"
