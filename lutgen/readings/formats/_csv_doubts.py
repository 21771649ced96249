"""Numbers of a CSV of readings that seem mistyped: readings of white that are far apart, and a primary that jumps.

A primary that jumps in one session and comes back in the next is a mistyped number. A display may change between two
sessions, for example to another gamut. If the light of one primary changes, white changes with it, because white
contains this light. A typing error changes one primary alone, in one session: the sum of the primaries minus white then
changes by the same amount.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, xyY_to_xyz, xyz_to_uv, xyz_to_xyY
from lutgen.errors import LutgenError
from lutgen.readings.formats._source import whites
from lutgen.readings.rest import is_tip, rest_of
from lutgen.readings.table import TIP_NAMES, Measurements, is_capped, says_cap

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
    light, hours, ask = readings.xyz_cd_m2[:, 1], readings.hours, "is an hour or a number mistyped"
    return tuple(filter(None, (on_spread(light[each], hours[each[0]], unit=" cd/m²", ask=ask) for each in rows)))


def white_like_relative(readings: Measurements) -> float | None:
    """Return Y of white at the first hour if it is 100, as in tables of relative values; None if it is not."""
    white = float(readings.tips()[1][0, 0, 2])
    return white if abs(white - _RELATIVE) <= _NEAR * _RELATIVE else None


#: Smallest jump of a primary: distance in u'v', and factor of its luminance over white's. Between real sessions of one
#: display (tests/test_readings_typed.py) the largest are 0.07 and 1.6: that display was calibrated differently.
FAR_UV, FAR_FACTOR = 0.12, 2.5

#: Largest difference between the sessions before and after a jump, as a share of the jump.
AGREE = 0.25

#: Largest difference between a jump and the change of all primaries together over white, as a share of the jump.
UNLIKE = 0.25


def refuse_jumps(readings: Measurements) -> None:
    """Raise LutgenError if one primary jumps in one session, white does not, and the next session has the old value."""
    hours, colours = readings.tips()
    for place in range(1, hours.size - 1):
        before, here, after = colours[place - 1 : place + 2]
        tip = lone_jump(xyY_to_xyz(np.array([before, here, after])))
        if tip is None:
            continue
        chosen = readings.at_rest() & ~is_capped(readings) & is_tip(readings.drive)[:, tip]
        rows = np.flatnonzero(chosen & (readings.hours == hours[place]))
        away = np.linalg.norm(readings.xyz_cd_m2[rows] - xyY_to_xyz(before[tip]), axis=1)
        row = int(rows[np.argmax(away)])
        raise LutgenError(
            f"{readings.file}, {readings.places([row])}: at hour {hours[place]:g} {TIP_NAMES[tip]} has "
            f"{_colour(xyz_to_xyY(readings.xyz_cd_m2[row]))}. At hour {hours[place - 1]:g} it has "
            f"{_colour(before[tip])}, at hour {hours[place + 1]:g} {_colour(after[tip])}, and white shows no such "
            "change; is a number mistyped?"
        )


def lone_jump(xyz: Array) -> int | None:
    """Return the place of the only primary that jumps in the second of three sessions; None: there is none.

    ``xyz``: white, red, green and blue of the sessions, (3, 4, 3).
    """
    before, here, after = (each / each[0, 1] for each in xyz)
    jumping = 1 + np.flatnonzero(_is_far(here[1:], before[1:], after[1:]))
    if jumping.size != 1:
        return None
    (tip,) = jumping.tolist()
    usual = (before + after) / 2.0
    jump = here[tip] - usual[tip]
    # Light of the primaries together minus white, minus the usual value of this difference.
    above = (here[1:].sum(axis=0) - here[0]) - (usual[1:].sum(axis=0) - usual[0])
    return tip if np.linalg.norm(above - jump) <= UNLIKE * np.linalg.norm(jump) else None


def _is_far(here: Array, before: Array, after: Array) -> NDArray[np.bool_]:
    """Whether each colour is far from its value in the sessions before and after, which agree: (n,).

    ``here``, ``before``, ``after``: XYZ over white's Y, (n, 3).
    """
    colours = np.array([here, before, after])
    far = np.zeros(len(here), dtype=bool)
    for values, least in ((xyz_to_uv(colours), FAR_UV), (np.log(colours[..., 1:2]), np.log(FAR_FACTOR))):
        apart = np.linalg.norm(values[1] - values[2], axis=-1)
        away = np.linalg.norm(values[1:] - values[0], axis=-1).min(axis=0)
        far |= (away >= least) & (away * AGREE >= apart)
    return far


def _colour(xyY: Array) -> str:
    x, y, luminance = xyY.tolist()
    return f"x = {x:.4f}, y = {y:.4f}, Y = {luminance:.4g}"
