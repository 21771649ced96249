"""Remarks on white in a CSV of readings: sessions that seem merged, and luminance that may be relative."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array
from lutgen.readings.formats._source import whites
from lutgen.readings.rest import rest_of
from lutgen.readings.table import Measurements, is_capped, says_cap

#: Smallest difference between readings of white in one session, as a share of the largest, that suggests several
#: sessions. Of 24 real sessions with repeated white, two sessions of one laptop have more; all others have 1.4 % or
#: less.
FAR_APART = 0.1

#: White of a table of relative values, and the tolerance for white at the first hour.
_RELATIVE, _NEAR = 100.0, 0.01


def white_at_rest(drive: Array, columns: Mapping[str, Array], notes: Sequence[str]) -> NDArray[np.intp]:
    """Return the rows of white at rest in a table of one session, from the columns of its conditions and its notes."""
    capped = np.array([says_cap(note) for note in notes])
    count = len(drive)
    rest = rest_of(np.zeros(count, dtype=np.intp), np.zeros(count), drive, capped, columns).reached(count)
    return np.intersect1d(whites(drive), np.flatnonzero(rest & ~capped))


def on_spread(luminance: Array, hour: float, *, unit: str, ask: str) -> str:
    """Return a remark on readings of white in one session, (n,), that are far apart; "" if they are not."""
    if luminance.size < 2 or np.ptp(luminance) <= FAR_APART * luminance.max():
        return ""
    return (
        f"White was read {luminance.size} times at hour {hour:g}, from {luminance.min():.4g} to "
        f"{luminance.max():.4g}{unit}: {ask}?"
    )


def on_spreads(readings: Measurements) -> tuple[str, ...]:
    """Return a remark on each session of a table of several hours whose readings of white are far apart."""
    white = np.zeros(readings.hours.size, dtype=bool)
    white[whites(readings.drive)] = True
    white &= readings.at_rest() & ~is_capped(readings)
    rows = [np.flatnonzero(white & (readings.sessions == each)) for each in np.unique(readings.sessions[white])]
    remarks = (
        on_spread(
            readings.xyz_cd_m2[each, 1],
            float(readings.hours[each[0]]),
            unit=" cd/m²",
            ask="is an hour or a number mistyped",
        )
        for each in rows
    )
    return tuple(filter(None, remarks))


def white_like_relative(readings: Measurements) -> float | None:
    """Return Y of white at the first hour if it is 100, as in tables of relative values; None if it is not."""
    white = float(readings.tips()[1][0, 0, 2])
    return white if abs(white - _RELATIVE) <= _NEAR * _RELATIVE else None
