"""Whether a display's light ran away while one session was read: warm-up, automatic brightness, dimming.

Patches that were read again tell it best. Where hardly any was, all readings that two sessions share do: their ratio
must not follow the order in which one of them was read, once what follows the patch's own colour is taken off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.steadiness import steadiness

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: Change of luminance within a session that is called a drift, and how many of its standard errors it must be, or how
#: many times what repeated patches scatter by.
RAN_AWAY, CLEAR = 0.02, 5.0

#: Fewest patches that two sessions must share for their ratio to be asked.
FEWEST = 40

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


def course(session: Session) -> Course:
    """Return the drift that the session's own repeated patches show; 0 where none was repeated."""
    found = steadiness(session)
    return Course(found.drift, "repeats", found.scatter) if found else Course(0.0, "repeats")


def course_beside(session: Session, other: Session) -> Course | None:
    """Return the drift of a session from patches that both sessions read; None: too few, or it does not stand out."""
    mine, theirs = shared(session, other)
    if mine.size < FEWEST:
        return None
    here, there = session.xyz[mine, 1], other.xyz[theirs, 1]
    kept = (here > _DARK * here.max()) & (there > _DARK * there.max())
    if np.count_nonzero(kept) < FEWEST:
        return None
    drive = session.drive[mine[kept]]
    level = there[kept] / there.max()
    order = mine[kept] / max(len(session.drive) - 1, 1)
    colour = np.column_stack([np.ones(len(drive)), drive, drive**2, np.log(level), level])
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


def _trend(colour: Array, order: Array, ratio: Array) -> tuple[float, float]:
    """Slope of a ratio over the order from 0 to 1, beside what goes with colour, and its standard error."""
    design = np.column_stack([order, colour])
    found, _, rank, _ = np.linalg.lstsq(design, ratio, rcond=None)
    left = ratio - design @ found
    variance = float(left @ left) / max(len(ratio) - int(rank), 1)
    spread = float(np.linalg.pinv(design.T @ design)[0, 0])
    return float(found[0]), float(np.sqrt(variance * spread))
