"""Readings that contradict their own ramp or their own repeats: a window popped up, or the instrument slipped."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.patches import CHANNELS, mean_xyz, ramp, repeats
from lutgen.history.transfer import lightness

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: ΔL* from what its neighbours or repeats foretell that no display has between two levels, and how many times more than
#: the other levels' it must be.
FAR, CLEARLY = 10.0, 4.0

#: Levels of a ramp, and readings of a patch, that tell which of them is wrong.
FEWEST_LEVELS, FEWEST_REPEATS = 6, 3


def misread(session: Session) -> NDArray[np.int64]:
    """Places of readings that contradict their ramp or their repeats: at most one level a ramp, one reading a patch."""
    rows = [_off_its_ramp(session, kind) for kind in ("grey", *CHANNELS)]
    rows += [_off_its_repeats(session, group) for group in repeats(session)]
    return np.unique(np.concatenate(rows))


def left_out(session: Session) -> tuple[Session, tuple[str, ...]]:
    """Return the session without its misread readings, and a sentence on each of these."""
    rows = misread(session)
    if not rows.size:
        return session, ()
    said = tuple(
        f"{session.file}, line {session.lines[row]}: code {', '.join(f'{code:.2f}' for code in session.drive[row])} "
        f"reads {session.xyz[row, 1]:.4g}, far from its neighbours or repeats: left out as misread"
        for row in rows
    )
    return session.without(rows), said


def _off_its_ramp(session: Session, kind: str) -> NDArray[np.int64]:
    """Rows of the one level that lies far from the line between its neighbours, in L*, where no other does."""
    found, black = ramp(session, kind), mean_xyz(session, "black")
    none = np.empty(0, dtype=np.int64)
    if found.drive.size < FEWEST_LEVELS:
        return none
    light = found.xyz[:, 1] - (0.0 if black is None else black[1])
    if light[-1] <= 0:
        return none
    level = lightness(light / light[-1])
    off = _from_neighbours(found.drive, level)
    worst = int(np.argmax(np.abs(off))) + 1
    others = np.abs(_from_neighbours(np.delete(found.drive, worst), np.delete(level, worst)))
    if abs(off[worst - 1]) < max(FAR, CLEARLY * float(others.max())):
        return none
    rows = session.rows("grey") if kind == "grey" else session.rows(kind)
    return np.asarray(rows[np.abs(session.drive[rows].max(axis=1) - found.drive[worst]) <= 1e-4])


def _from_neighbours(drive: Array, level: Array) -> Array:
    """Inner levels less the line between their neighbours, (n - 2,)."""
    share = (drive[1:-1] - drive[:-2]) / (drive[2:] - drive[:-2])
    return np.asarray(level[1:-1] - (level[:-2] + share * (level[2:] - level[:-2])))


def _off_its_repeats(session: Session, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The one reading of a patch that lies far from all others of the patch, in L* of the session's brightest."""
    none = np.empty(0, dtype=np.int64)
    if rows.size < FEWEST_REPEATS or session.xyz[:, 1].max() <= 0:
        return none
    level = lightness(session.xyz[rows, 1] / session.xyz[:, 1].max())
    off = np.abs(level - np.median(level))
    worst = int(np.argmax(off))
    return rows[[worst]] if off[worst] >= max(FAR, CLEARLY * float(np.delete(off, worst).max())) else none
