"""Patches of a session by what they are for: tips, black, and ramps of grey and of each channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: The ramp of each channel and its place in drive.
CHANNELS = {"red": 0, "green": 1, "blue": 2}

#: Drives that differ by less are one patch: files round at the fifth digit.
_SAME = 1e-4


@dataclass(frozen=True)
class Ramp:
    """Readings of one ramp, replicates averaged as light.

    Attributes
    ----------
    drive
        Rising code values above 0, up to 1, (n,).
    xyz
        As in the session, (n, 3).

    """

    drive: Array
    xyz: Array


def mean_xyz(session: Session, kind: str) -> Array | None:
    """Mean XYZ of white or black, (3,); None where it was not read."""
    rows = session.rows(kind)
    return session.xyz[rows].mean(axis=0) if rows.size else None


def tip(session: Session, channel: str) -> Array | None:
    """Mean XYZ of one channel at full drive, the others at none, (3,); None where it was not read."""
    rows = session.rows(channel)
    full = rows[session.drive[rows, CHANNELS[channel]] >= 1.0 - _SAME]
    return session.xyz[full].mean(axis=0) if full.size else None


def ramp(session: Session, kind: str) -> Ramp:
    """Return the ramp of "grey", with white at its end, or of a channel; without black, and perhaps empty."""
    rows = session.rows("grey", "white") if kind == "grey" else session.rows(kind)
    drive = session.drive[rows].max(axis=1)
    order = np.argsort(drive, kind="stable")
    drive, xyz = drive[order], session.xyz[rows[order]]
    if not drive.size:
        return Ramp(drive, xyz)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(drive) > _SAME]))
    counts = np.diff(np.append(starts, drive.size))
    return Ramp(np.add.reduceat(drive, starts) / counts, np.add.reduceat(xyz, starts) / counts[:, np.newaxis])


def repeats(session: Session) -> list[NDArray[np.int64]]:
    """Rows of each patch that was read twice or more at one place, in the order read; the first patch first."""
    where = session.positions if session.positions is not None else np.zeros((len(session.drive), 2))
    keys = np.round(np.hstack([session.drive, where]) / _SAME).astype(np.int64)
    _, group, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    found = [np.flatnonzero(group.ravel() == each).astype(np.int64) for each in np.flatnonzero(counts > 1)]
    return sorted(found, key=lambda rows: int(rows[0]))
