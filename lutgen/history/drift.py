"""How well readings of one session repeat, and whether the display's light drifted while they were read.

Warm-up, automatic brightness and dimming show best in patches that were read again. Where hardly any was, and the order
of reading is known, all readings that two sessions share do: their ratio must not follow that order, once what follows
the patch's own colour is taken off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import xy_to_uv, xyz_to_xyY
from lutgen.history.patches import repeats

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: A patch counts as bright from this share of the brightest on: there a meter's noise is a share of the light.
BRIGHT = 0.05

#: Fewest readings whose steps tell scatter from a course.
FEWEST = 6

#: Median of |x| where x is normal with standard deviation 1.
_MEDIAN_OF_NORMAL = 0.6745


@dataclass(frozen=True)
class Steadiness:
    """What repeated patches say.

    Attributes
    ----------
    patches, readings
        How many bright patches were repeated, and all their readings.
    noise
        Standard deviation of Y over its patch's mean, pooled over bright patches. A drift is in it.
    dark_noise
        Pooled standard deviation of Y of dark patches, in the session's unit; None: none was repeated.
    order, ratio
        Of bright patches: place in the order read as a share of the session, (n,), and Y over the patch's first
        reading, (n,).
    shift
        Largest Δu'v' of a bright patch against its first reading.

    """

    patches: int
    readings: int
    noise: float
    dark_noise: float | None
    order: Array
    ratio: Array
    shift: float

    @property
    def drift(self) -> float:
        """Largest change of Y against the first reading of a bright patch, with its sign, as a share."""
        return float(self.ratio[np.argmax(np.abs(self.ratio - 1.0))] - 1.0)

    @property
    def scatter(self) -> float:
        """Standard deviation of Y of a bright patch, as a share, with next to no drift in it; 0 of few readings.

        By the median step from one reading to the next, which a jump does not move, or by that of the steps' own steps,
        which a steady course does not move: the smaller.
        """
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
    uv = [xy_to_uv(xyz_to_xyY(session.xyz[rows])[:, :2]) for rows in bright]
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


#: Change of luminance within a session that is called a drift, and how many of its standard errors it must be, or how
#: many times what repeated patches scatter by.
RAN_AWAY, CLEAR = 0.02, 5.0

#: Fewest patches that two sessions must share for their ratio to be asked.
FEWEST_SHARED = 40

#: Share of the order's variance that goes with the colours, from which a session was read sorted by code.
SORTED = 0.5

#: Darker than this share of white, a ratio is the meter's noise.
_DARK = 0.03


@dataclass(frozen=True)
class Course:
    """A session's drift.

    Attributes
    ----------
    change
        Largest change of luminance within the session, as a share, with its sign.
    by
        "repeats", or "order" where patches shared with another session say it.
    scatter
        What readings scatter by without any drift, 1 σ, as a share.

    """

    change: float
    by: str
    scatter: float = 0.0

    @property
    def ran_away(self) -> bool:
        """Whether it is a drift, and neither the noise of a good session nor a noisy one's scatter."""
        return abs(self.change) >= max(RAN_AWAY, CLEAR * self.scatter)


def course(steady: Steadiness | None, scatter: float | None = None) -> Course:
    """Return the drift that a session's own repeated patches show; 0 where none was repeated.

    ``scatter`` is what readings of the same meter scatter by at most, where another session tells.
    """
    if steady is None:
        return Course(0.0, "repeats")
    return Course(steady.drift, "repeats", steady.scatter if scatter is None else min(scatter, steady.scatter))


def course_beside(session: Session, other: Session) -> Course | None:
    """Return the drift of a session from patches that both sessions read.

    None: too few, or it does not stand out; or nobody wrote down the order of reading, or that follows the colours.
    """
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
    return Course(float(np.expm1(change)), "order")


def shared(one: Session, other: Session) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of patches that both sessions read, each patch once: of the one and of the other."""
    keys = {tuple(row): place for place, row in enumerate(np.round(other.drive, 3).tolist())}
    found: dict[tuple[float, ...], tuple[int, int]] = {}
    for place, row in enumerate(np.round(one.drive, 3).tolist()):
        if tuple(row) in keys:
            found.setdefault(tuple(row), (place, keys[tuple(row)]))
    pairs = np.array(list(found.values()), dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def _goes_with(colour: Array, order: Array) -> bool:
    """Whether the order of reading follows the colours, as in a list sorted by code: then a drift cannot be told."""
    found = np.linalg.lstsq(colour, order, rcond=None)[0]
    return bool(np.var(order - colour @ found) < (1.0 - SORTED) * np.var(order))


def _trend(colour: Array, order: Array, ratio: Array) -> tuple[float, float]:
    """Slope of a ratio over the order from 0 to 1, beside what goes with colour, and its standard error."""
    design = np.column_stack([order, colour])
    found, _, rank, _ = np.linalg.lstsq(design, ratio, rcond=None)
    left = ratio - design @ found
    variance = float(left @ left) / max(len(ratio) - int(rank), 1)
    spread = float(np.linalg.pinv(design.T @ design)[0, 0])
    return float(found[0]), float(np.sqrt(variance * spread))
