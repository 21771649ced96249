"""Patches of a session by kind: white, black, primaries, and ramps of grey and of each channel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import SRGB_XY, Array, xy_to_uv, xyz_to_uv, xyz_to_xyY
from lutgen.readings.session import DRIVE_TOLERANCE, Session

#: Channel → its index in drive; ramps have the same names.
CHANNELS = {"red": 0, "green": 1, "blue": 2}


@dataclass(frozen=True)
class Ramp:
    """Readings of one ramp; XYZ of replicates is averaged."""

    #: Rising code values above 0, up to 1, (n,).
    drive: Array
    #: XYZ in the session's unit, (n, 3).
    xyz: Array
    #: Rows of each level in the session, n arrays.
    rows: tuple[NDArray[np.int64], ...]


def mean_xyz(session: Session, kind: str) -> Array | None:
    """Return mean XYZ of white or black, (3,); None if it was not read."""
    rows = session.rows(kind)
    return session.xyz[rows].mean(axis=0) if rows.size else None


def black_xyz(session: Session) -> Array:
    """Return mean XYZ of black, (3,); zeros if black was not read."""
    black = mean_xyz(session, "black")
    return np.zeros(3) if black is None else black


def tip_rows(session: Session, channel: str) -> NDArray[np.int64]:
    """Return the rows of one channel at full drive, the other channels at 0."""
    rows = session.rows(channel)
    return np.asarray(rows[session.drive[rows, CHANNELS[channel]] >= 1.0 - DRIVE_TOLERANCE])


def tips(session: Session) -> dict[str, Array]:
    """Return mean XYZ, (3,), of each channel that was read at full drive, the other channels at 0."""
    rows = {name: tip_rows(session, name) for name in CHANNELS}
    return {name: session.xyz[each].mean(axis=0) for name, each in rows.items() if each.size}


def ramp(session: Session, kind: str) -> Ramp:
    """Return the ramp of "grey", with white at its end, or of a channel; without black. The ramp may be empty."""
    rows = session.rows("grey", "white") if kind == "grey" else session.rows(kind)
    drive = session.drive[rows].max(axis=1)
    order = np.argsort(drive, kind="stable")
    drive, xyz = drive[order], session.xyz[rows[order]]
    if not drive.size:
        return Ramp(drive, xyz, ())
    starts = np.flatnonzero(np.concatenate([[True], np.diff(drive) > DRIVE_TOLERANCE]))
    levels = tuple(np.split(rows[order], starts[1:]))
    counts = np.array([level.size for level in levels])
    return Ramp(np.add.reduceat(drive, starts) / counts, np.add.reduceat(xyz, starts) / counts[:, np.newaxis], levels)


def repeats(session: Session) -> list[NDArray[np.int64]]:
    """Return the rows of each patch that was read twice or more at one place; rows and patches in the order read."""
    where = session.positions if session.positions is not None else np.zeros((len(session.drive), 2))
    keys = np.round(np.hstack([session.drive, where]) / DRIVE_TOLERANCE).astype(np.int64)
    _, group, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    groups = [np.flatnonzero(group.ravel() == each).astype(np.int64) for each in np.flatnonzero(counts > 1)]
    return sorted(groups, key=lambda rows: int(rows[0]))


#: x, y of red, green and blue: IEC 61966-2-1 (Rec. ITU-R BT.709 has the same), SMPTE EG 432-1, Rec. ITU-R BT.2020.
GAMUTS = {
    "sRGB/Rec.709": SRGB_XY[1:],
    "P3": np.array([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]]),
    "Rec.2020": np.array([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]]),
}


@dataclass(frozen=True)
class Primaries:
    """Red, green and blue at full drive, black included."""

    #: Channel → XYZ at full drive, (3,), in the session's unit.
    xyz: dict[str, Array]
    #: Name of a gamut → channel → Δu'v' to its primary.
    shift: dict[str, dict[str, float]]
    #: The gamut whose primaries are nearest, by the mean Δu'v' of the primaries that were read.
    nearest: str
    #: Share of sRGB's triangle that this display's triangle covers, in u'v'; None unless all three primaries were read.
    coverage: float | None

    @property
    def xy(self) -> dict[str, Array]:
        """Channel → x, y."""
        return {name: xyz_to_xyY(xyz)[:2] for name, xyz in self.xyz.items()}


def primaries(session: Session) -> Primaries | None:
    """Return the primaries that were read at full drive; None if none was read, or none has light."""
    lit = {name: xyz for name, xyz in tips(session).items() if xyz[1] > 0}
    if not lit:
        return None
    uv = {name: xyz_to_uv(xyz) for name, xyz in lit.items()}
    shift = {
        gamut: {name: float(np.hypot(*(uv[name] - xy_to_uv(xy[CHANNELS[name]])))) for name in uv}
        for gamut, xy in GAMUTS.items()
    }
    nearest = min(shift, key=lambda gamut: sum(shift[gamut].values()))
    triangle = np.array(list(uv.values()))
    covered = _covered(triangle, xy_to_uv(SRGB_XY[1:])) if len(lit) == 3 else None
    return Primaries(lit, shift, nearest, covered)


def additivity(session: Session) -> float | None:
    """Return Y of white over the sum of Y of red, green and blue, all minus black if it was read.

    None if white or a primary is missing.
    """
    white, dark = mean_xyz(session, "white"), float(black_xyz(session)[1])
    read = tips(session)
    if white is None or len(read) < 3:
        return None
    total = float(sum(each[1] - dark for each in read.values()))
    return float((white[1] - dark) / total) if total > 0 else None


def _covered(triangle: Array, reference: Array) -> float:
    """Return the share of the triangle ``reference`` that ``triangle`` covers (clipping: Sutherland & Hodgman 1974)."""
    kept = [tuple(corner) for corner in reference]
    if _area(triangle) < 0:
        triangle = triangle[::-1]
    for start, end in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        sides = [float((end[0] - start[0]) * (p[1] - start[1]) - (end[1] - start[1]) * (p[0] - start[0])) for p in kept]
        cut = []
        for n, (here, side) in enumerate(zip(kept, sides, strict=True)):
            before, other = kept[n - 1], sides[n - 1]
            if (side >= 0) != (other >= 0):
                share = other / (other - side)
                cut.append(tuple(b + share * (h - b) for b, h in zip(before, here, strict=True)))
            if side >= 0:
                cut.append(here)
        kept = cut
    return abs(_area(np.array(kept))) / abs(_area(reference)) if len(kept) > 2 else 0.0


def _area(corners: Array) -> float:
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
