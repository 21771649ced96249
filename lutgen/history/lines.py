"""Spectra of two sessions laid over each other: a common shift in wavelength is the instrument's, no display has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.patches import CHANNELS

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: Shifts tried, and the smallest that is one, in nanometres: a spectrometer repeats within 0.1 to 0.2.
REACH, CLEAR = 5.0, 0.3


def line_shift(before: Session, after: Session) -> float | None:
    """Shift of the later spectra against the earlier ones that all primaries share, in nm.

    None: one has no spectra, a primary is missing, or the primaries do not agree within half of it.
    """
    if before.spectra is None or after.spectra is None or before.wavelengths is None or after.wavelengths is None:
        return None
    found = []
    for name, channel in CHANNELS.items():
        pair = [_tip(each, name, channel) for each in (before, after)]
        if pair[0] is None or pair[1] is None:
            return None
        found.append(_shift(before.wavelengths, pair[0], after.wavelengths, pair[1]))
    middle = float(np.median(found))
    return middle if np.ptp(found) <= max(0.2, 0.5 * abs(middle)) else None


def _tip(session: Session, name: str, channel: int) -> Array | None:
    rows = session.rows(name)
    full = rows[session.drive[rows, channel] >= 1.0 - 1e-4]
    return session.spectra[full].mean(axis=0) if full.size and session.spectra is not None else None


def _shift(at: Array, one: Array, at_other: Array, other: Array) -> float:
    """Shift in nm by which the first spectrum, scaled, fits the second best."""
    inner = (at_other >= at[0] + REACH) & (at_other <= at[-1] - REACH)
    shifts = np.arange(-REACH, REACH + 0.05, 0.1)
    misfits = []
    for shift in shifts:
        moved = np.interp(at_other[inner] - shift, at, one)
        scale = float(moved @ other[inner]) / max(float(moved @ moved), 1e-12)
        misfits.append(float(((other[inner] - scale * moved) ** 2).sum()))
    return float(shifts[int(np.argmin(misfits))])
