"""Whether the readings of one session can be trusted: misread patches, noise, and drift during the session.

A reading is misread where it contradicts its own ramp or its own repeats: a window popped up, or the instrument
slipped. Warm-up, automatic brightness and dimming show best in patches that were read again. Where hardly any patch was
read again, and the order of reading is known, the patches that two sessions share are compared: a ratio of their light
that changes with the order of reading, beside what changes with the colour of the patches, is a drift.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.history.patches import CHANNELS, black_xyz, ramp, repeats
from lutgen.history.transfer import lightness

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.readings.session import Session

#: A reading is misread where its L* differs by ``FAR`` from the value that its neighbours or repeats give, and by
#: ``CLEARLY`` times the largest such difference of the other readings.
FAR, CLEARLY = 10.0, 4.0

#: Fewest levels of a ramp, and readings of a patch, by which a wrong one can be told from the others.
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
    sentences = tuple(
        f"{session.file}, line {session.lines[row]}: code {', '.join(f'{code:.2f}' for code in session.drive[row])} "
        f"reads {session.xyz[row, 1]:.4g}, far from its neighbours or repeats: left out as misread"
        for row in rows
    )
    return session.without(rows), sentences


def _off_its_ramp(session: Session, kind: str) -> NDArray[np.int64]:
    """Rows of the one level that lies far from the line between its neighbours, in L*, where no other does."""
    levels = ramp(session, kind)
    none = np.empty(0, dtype=np.int64)
    if levels.drive.size < FEWEST_LEVELS:
        return none
    light = levels.xyz[:, 1] - black_xyz(session)[1]
    if light[-1] <= 0:
        return none
    level = lightness(light / light[-1])
    off = _from_neighbours(levels.drive, level)
    worst = int(np.argmax(np.abs(off))) + 1
    others = np.abs(_from_neighbours(np.delete(levels.drive, worst), np.delete(level, worst)))
    if abs(off[worst - 1]) < max(FAR, CLEARLY * float(others.max())):
        return none
    rows = session.rows("grey") if kind == "grey" else session.rows(kind)
    return np.asarray(rows[np.abs(session.drive[rows].max(axis=1) - levels.drive[worst]) <= 1e-4])


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


#: A patch of at least this share of the brightest luminance is bright: the noise of a meter is there a share of the
#: luminance.
BRIGHT = 0.05

#: Fewest readings from which scatter and drift can be told apart.
FEWEST = 6

#: Median of |x| for a normal x with standard deviation 1.
_MEDIAN_OF_NORMAL = 0.6745


@dataclass(frozen=True)
class Steadiness:
    """Repeatability of a session, from patches that were read more than once."""

    #: Number of bright patches that were read again, and of all their readings.
    patches: int
    readings: int
    #: Standard deviation of Y over the mean of its patch, pooled over bright patches; a drift makes it larger.
    noise: float
    #: Pooled standard deviation of Y of dark patches, in the unit of the session; None: no dark patch was read again.
    dark_noise: float | None
    #: Of bright patches: place in the order read as a share of the session, (n,), and Y over the patch's first reading,
    #: (n,).
    order: Array
    ratio: Array
    #: Largest Δu'v' of a bright patch against its first reading.
    shift: float

    @property
    def drift(self) -> float:
        """Largest change of Y against the first reading of a bright patch, with its sign, as a share."""
        return float(self.ratio[np.argmax(np.abs(self.ratio - 1.0))] - 1.0)

    @property
    def scatter(self) -> float:
        """Standard deviation of Y of a bright patch, as a share, free of one jump and of a steady drift."""
        if self.readings < FEWEST:
            return 0.0
        steps = np.diff(self.ratio)
        noise = [np.median(np.abs(steps)) / np.sqrt(2.0), np.median(np.abs(np.diff(steps))) / np.sqrt(6.0)]
        return float(min(noise) / _MEDIAN_OF_NORMAL)


def steadiness(session: Session) -> Steadiness | None:
    """Return what the session's repeated patches say; None where no bright patch was repeated."""
    groups = repeats(session)
    brightest = float(session.xyz[:, 1].max())
    is_bright = [float(session.xyz[rows, 1].min()) >= BRIGHT * brightest > 0 for rows in groups]
    bright = [rows for rows, each in zip(groups, is_bright, strict=True) if each]
    dark = [rows for rows, each in zip(groups, is_bright, strict=True) if not each]
    if not bright:
        return None
    last = max(len(session.drive) - 1, 1)
    place = np.arange(len(session.drive)) if session.order is None else np.argsort(np.argsort(session.order))
    bright = [rows[np.argsort(place[rows], kind="stable")] for rows in bright]
    order = place[np.concatenate(bright)]
    ratio = np.concatenate([session.xyz[rows, 1] / session.xyz[rows[0], 1] for rows in bright])
    by_order = np.argsort(order, kind="stable")
    uv = [xyz_to_uv(session.xyz[rows]) for rows in bright]
    return Steadiness(
        patches=len(bright),
        readings=order.size,
        noise=_pooled([session.xyz[rows, 1] / session.xyz[rows, 1].mean() for rows in bright]),
        dark_noise=_pooled([session.xyz[rows, 1] for rows in dark]) if dark else None,
        order=order[by_order] / last,
        ratio=ratio[by_order],
        shift=max(float(np.hypot(*(each - each[0]).T).max()) for each in uv),
    )


def _pooled(groups: list[Array]) -> float:
    """Standard deviation within groups, each about its own mean."""
    squares = sum(float(((each - each.mean()) ** 2).sum()) for each in groups)
    return float(np.sqrt(squares / sum(each.size - 1 for each in groups)))


#: A change of luminance within a session is a drift from this share on, and from this many standard errors, or times
#: the scatter of repeated patches, on.
RAN_AWAY, CLEAR = 0.02, 5.0

#: Fewest patches that two sessions must share before their ratio is used.
FEWEST_SHARED = 40

#: If the colours explain this share of the variance of the order, the patches were read sorted by code.
SORTED = 0.5

#: Patches below this share of white are left out: their ratio is mostly noise of the meter.
_DARK = 0.03


@dataclass(frozen=True)
class SessionDrift:
    """The drift of a session."""

    #: Largest change of luminance within the session, as a share, with its sign.
    change: float
    #: "repeats" (patches that were read again) or "order" (patches that another session shares).
    by: str
    #: Scatter of readings without drift, 1 σ, as a share.
    scatter: float = 0.0

    @property
    def ran_away(self) -> bool:
        """Whether the change is a drift, rather than noise."""
        return abs(self.change) >= max(RAN_AWAY, CLEAR * self.scatter)


def drift_by_repeats(steady: Steadiness | None, scatter: float | None = None) -> SessionDrift:
    """Return the drift of a session's repeated patches, 0 without any; ``scatter``: an upper limit of theirs."""
    if steady is None:
        return SessionDrift(0.0, "repeats")
    return SessionDrift(steady.drift, "repeats", steady.scatter if scatter is None else min(scatter, steady.scatter))


def drift_by_order(session: Session, other: Session) -> SessionDrift | None:
    """Return the drift of a session from patches that both sessions read; None: none is clear."""
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
    if _goes_with(colour, order):
        return None
    ratio = np.log(here[kept] / there[kept])
    change, error = _trend(colour, order, ratio)
    if abs(change) < CLEAR * error:
        return None
    return SessionDrift(float(np.expm1(change)), "order")


def shared(one: Session, other: Session) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of the patches that both sessions read, each patch once: rows in ``one`` and rows in ``other``."""
    keys = {tuple(row): place for place, row in enumerate(np.round(other.drive, 3).tolist())}
    places: dict[tuple[float, ...], tuple[int, int]] = {}
    for place, row in enumerate(np.round(one.drive, 3).tolist()):
        if tuple(row) in keys:
            places.setdefault(tuple(row), (place, keys[tuple(row)]))
    pairs = np.array(list(places.values()), dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def _goes_with(colour: Array, order: Array) -> bool:
    """Whether the order of reading follows the colours, as in a list sorted by code; a drift cannot be seen then."""
    coefficients = np.linalg.lstsq(colour, order, rcond=None)[0]
    return bool(np.var(order - colour @ coefficients) < (1.0 - SORTED) * np.var(order))


def _trend(colour: Array, order: Array, ratio: Array) -> tuple[float, float]:
    """Slope of a ratio over the order (0 to 1), fitted together with the colours, and its standard error."""
    design = np.column_stack([order, colour])
    coefficients, _, rank, _ = np.linalg.lstsq(design, ratio, rcond=None)
    left = ratio - design @ coefficients
    variance = float(left @ left) / max(len(ratio) - int(rank), 1)
    spread = float(np.linalg.pinv(design.T @ design)[0, 0])
    return float(coefficients[0]), float(np.sqrt(variance * spread))
