"""Quality of the readings of one session: misread patches, noise, and drift during the session.

A reading is misread if it contradicts its own ramp or its own repeats, for example because a window covered the patch
or the instrument slipped. Warm-up, automatic brightness and dimming show best in repeated patches. If hardly any patch
was repeated and the order of reading is known, lutgen compares the patches that two sessions share. A fit of the ratio
of their light has terms for the colour of the patches and for the order of reading; a slope over the order is a drift.
"""

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.history.patches import CHANNELS, black_xyz, ramp, repeats
from lutgen.history.transfer import lightness
from lutgen.readings.session import Session
from lutgen.readings.steadiness import CLEAR, SessionDrift, Steadiness, steadiness_of

#: A reading is misread if its L* differs by at least ``FAR`` from the value of its neighbours or repeats, and by at
#: least ``CLEARLY`` times the largest such difference of the other readings.
FAR, CLEARLY = 10.0, 4.0

#: Full drive or the level below it is misread if the Δu'v' between the two is at least this.
OTHER_COLOUR = 0.1

#: Black is misread if it is brighter than the two darkest greys by this factor.
BRIGHTER = 1.5

#: Fewest levels of a ramp, and fewest readings of a patch, with which a misread reading can be identified.
FEWEST_LEVELS, FEWEST_REPEATS = 6, 3

_NO_ROWS = np.empty(0, dtype=np.int64)


def misread(session: Session) -> NDArray[np.int64]:
    """Return rows of misread readings: at most one level of a ramp, black, and one reading of each repeated patch."""
    rows = [_off_the_end(session, kind) for kind in ("grey", *CHANNELS)]
    if not any(each.size for each in rows):
        rows = [_off_its_ramp(session, kind) for kind in ("grey", *CHANNELS)]
    rows += [_above_dark_greys(session)]
    rows += [_off_its_repeats(session, group) for group in repeats(session)]
    if not any(each.size for each in rows):
        rows.append(_off_its_twin(session))
    return np.unique(np.concatenate(rows))


def left_out(session: Session) -> tuple[Session, tuple[str, ...]]:
    """Return the session without its misread readings, and a sentence on each misread reading."""
    rows = misread(session)
    if not rows.size:
        return session, ()
    sentences = tuple(
        f"{session.file}, line {session.lines[row]}: code {', '.join(f'{code:.2f}' for code in session.drive[row])} "
        f"reads {session.xyz[row, 1]:.4g}, far from its neighbours or repeats: left out as misread"
        for row in rows
    )
    return session.without(rows), sentences


def _off_its_ramp(session: Session, kind: str) -> NDArray[np.int64]:
    """Return the rows of the only level that is far from the line between its neighbours, in L*; empty without one."""
    levels = ramp(session, kind)
    light = levels.xyz[:, 1] - black_xyz(session)[1]
    if light.size < FEWEST_LEVELS or light[-1] <= 0:
        return _NO_ROWS
    level = lightness(light / light[-1])
    off = _from_neighbours(levels.drive, level)
    worst = int(np.argmax(np.abs(off))) + 1
    others = np.abs(_from_neighbours(np.delete(levels.drive, worst), np.delete(level, worst)))
    return levels.rows[worst] if abs(off[worst - 1]) >= max(FAR, CLEARLY * float(others.max())) else _NO_ROWS


def _off_the_end(session: Session, kind: str) -> NDArray[np.int64]:
    """Return the rows of full drive if it is much darker than the level below it.

    If the two have quite another colour, return the rows of the one whose colour differs from the third level.
    """
    levels = ramp(session, kind)
    if levels.drive.size < FEWEST_LEVELS:
        return _NO_ROWS
    level = lightness(levels.xyz[:, 1] / max(float(levels.xyz[:-1, 1].max()), 1e-9))
    falls, uv = -np.diff(level), xyz_to_uv(levels.xyz[-3:])
    if float(np.hypot(*(uv[2] - uv[1]))) >= OTHER_COLOUR:
        full, below = np.hypot(*(uv[1:] - uv[0]).T)[::-1]
        return levels.rows[-1 if full >= below else -2]
    return levels.rows[-1] if falls[-1] >= max(FAR, CLEARLY * float(falls[:-1].max())) else _NO_ROWS


def _above_dark_greys(session: Session) -> NDArray[np.int64]:
    """Return the rows of black if it is much brighter than the two darkest greys."""
    levels, black = ramp(session, "grey"), black_xyz(session)[1]
    if levels.drive.size < FEWEST_LEVELS or black <= BRIGHTER * float(levels.xyz[:2, 1].max()):
        return _NO_ROWS
    return session.rows("black")


def _from_neighbours(drive: Array, level: Array) -> Array:
    """Return the inner levels minus the line between their neighbours, (n - 2,)."""
    share = (drive[1:-1] - drive[:-2]) / (drive[2:] - drive[:-2])
    return np.asarray(level[1:-1] - (level[:-2] + share * (level[2:] - level[:-2])))


def _off_its_repeats(session: Session, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the row of the only reading that is far from the patch's other readings; empty without one.

    L* is relative to the session's brightest reading.
    """
    if rows.size < FEWEST_REPEATS or session.xyz[:, 1].max() <= 0:
        return _NO_ROWS
    level = lightness(session.xyz[rows, 1] / session.xyz[:, 1].max())
    off = np.abs(level - np.median(level))
    worst = int(np.argmax(off))
    return rows[[worst]] if off[worst] >= max(FAR, CLEARLY * float(np.delete(off, worst).max())) else _NO_ROWS


def _off_its_twin(session: Session) -> NDArray[np.int64]:
    """Return the row that is farther from its ramp, if the two readings of one patch alone disagree; or no rows.

    A drift would also change the other repeated patches.
    """
    groups = repeats(session)
    if len(groups) < 2 or (brightest := float(session.xyz[:, 1].max())) <= 0:
        return _NO_ROWS
    level = lightness(session.xyz[:, 1] / brightest)
    spread = np.array([np.ptp(level[rows]) for rows in groups])
    worst = int(np.argmax(spread))
    twins = groups[worst]
    if twins.size != 2 or spread[worst] < max(FAR, CLEARLY * np.delete(spread, worst).max()):
        return _NO_ROWS
    for kind in ("grey", *CHANNELS):
        levels = ramp(session, kind)
        place = next((at for at, rows in enumerate(levels.rows) if twins[0] in rows), None)
        if place is not None and levels.drive.size > FEWEST_LEVELS:
            near = np.argsort(np.abs(levels.drive - levels.drive[place]))[1:3]
            line = np.polyfit(levels.drive[near], lightness(levels.xyz[near, 1] / brightest), 1)
            return twins[[int(np.argmax(np.abs(level[twins] - np.polyval(line, levels.drive[place]))))]]
    return twins[[int(np.argmax(level[twins]))]] if not session.drive[twins[0]].any() else _NO_ROWS


def steadiness(session: Session) -> Steadiness | None:
    """Return noise and drift from the session's repeated patches; None if no bright patch was repeated."""
    place = np.arange(len(session.drive)) if session.order is None else np.argsort(np.argsort(session.order))
    return steadiness_of(session.xyz, place, repeats(session))


#: Fewest shared patches of two sessions for a drift from their ratio.
FEWEST_SHARED = 40

#: If the colours explain this share of the variance of the order, the patches were read sorted by code: a drift then
#: does not show.
SORTED = 0.5

#: Patches below this share of the brightest patch are left out: their ratio is mostly noise of the meter.
_DARK = 0.03


def drift_by_order(session: Session, other: Session) -> SessionDrift | None:
    """Return the drift of a session from patches that both sessions read; None: no clear drift."""
    mine, theirs = shared(session, other)
    if mine.size < FEWEST_SHARED or session.order is None:
        return None
    here, there = session.xyz[mine, 1], other.xyz[theirs, 1]
    kept = (here > _DARK * here.max()) & (there > _DARK * there.max())
    if np.count_nonzero(kept) < FEWEST_SHARED:
        return None
    drive = session.drive[mine[kept]]
    level = there[kept] / there.max()
    order = np.argsort(np.argsort(session.order))[mine[kept]] / max(len(session.drive) - 1, 1)
    colour = np.column_stack([np.ones(len(drive)), drive, drive**2, np.log(level), level])
    by_colour = colour @ np.linalg.lstsq(colour, order, rcond=None)[0]
    if np.var(order - by_colour) < (1.0 - SORTED) * np.var(order):
        return None
    ratio = np.log(here[kept] / there[kept])
    change, error = _slope(colour, order, ratio)
    return None if abs(change) < CLEAR * error else SessionDrift(float(np.expm1(change)), "order")


def shared(one: Session, other: Session) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of the patches that both sessions read, each patch once: rows in ``one``, rows in ``other``."""
    keys = {tuple(row): place for place, row in enumerate(np.round(other.drive, 3).tolist())}
    places: dict[tuple[float, ...], tuple[int, int]] = {}
    for place, row in enumerate(np.round(one.drive, 3).tolist()):
        if tuple(row) in keys:
            places.setdefault(tuple(row), (place, keys[tuple(row)]))
    pairs = np.array(list(places.values()), dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def _slope(colour: Array, order: Array, ratio: Array) -> tuple[float, float]:
    """Return the slope of a ratio over the order (0 to 1), fitted together with the colours, and its standard error."""
    design = np.column_stack([order, colour])
    coefficients, _, rank, _ = np.linalg.lstsq(design, ratio, rcond=None)
    residual = ratio - design @ coefficients
    variance = float(residual @ residual) / max(len(ratio) - int(rank), 1)
    spread = float(np.linalg.pinv(design.T @ design)[0, 0])
    return float(coefficients[0]), float(np.sqrt(variance * spread))
