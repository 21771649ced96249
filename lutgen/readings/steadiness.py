"""How steady a session was: patches that were read again, in the order of reading, and whether their light drifted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import Array, xyz_to_uv

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

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
    #: The same readings by their rows, (n,).
    rows: NDArray[np.intp]
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


def steadiness_of(xyz: Array, place: NDArray[np.intp], groups: Sequence[NDArray[np.intp]]) -> Steadiness | None:
    """Return what repeated patches say; None where no bright patch was repeated.

    ``xyz``: light of a session's readings, (n, 3). ``place``: of each in the order of reading, (n,). ``groups``: rows
    of each patch that was read again.
    """
    brightest = float(xyz[:, 1].max())
    is_bright = [float(xyz[rows, 1].min()) >= BRIGHT * brightest > 0 for rows in groups]
    bright = [rows for rows, each in zip(groups, is_bright, strict=True) if each]
    dark = [rows for rows, each in zip(groups, is_bright, strict=True) if not each]
    if not bright:
        return None
    bright = [rows[np.argsort(place[rows], kind="stable")] for rows in bright]
    every = np.concatenate(bright)
    ratio = np.concatenate([xyz[rows, 1] / xyz[rows[0], 1] for rows in bright])
    by_order = np.argsort(place[every], kind="stable")
    uv = [xyz_to_uv(xyz[rows]) for rows in bright]
    return Steadiness(
        patches=len(bright),
        readings=every.size,
        noise=_pooled([xyz[rows, 1] / xyz[rows, 1].mean() for rows in bright]),
        dark_noise=_pooled([xyz[rows, 1] for rows in dark]) if dark else None,
        order=place[every][by_order] / max(len(xyz) - 1, 1),
        ratio=ratio[by_order],
        rows=every[by_order],
        shift=max(float(np.hypot(*(each - each[0]).T).max()) for each in uv),
    )


def _pooled(groups: list[Array]) -> float:
    """Standard deviation within groups, each about its own mean."""
    squares = sum(float(((each - each.mean()) ** 2).sum()) for each in groups)
    return float(np.sqrt(squares / sum(each.size - 1 for each in groups)))


#: A change of luminance within a session is a drift from this share on, and from this many standard errors, or times
#: the scatter of repeated patches, on.
RAN_AWAY, CLEAR = 0.02, 5.0


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
    def size(self) -> float:
        """The change over the smallest one that is a drift, rather than noise."""
        return abs(self.change) / max(RAN_AWAY, CLEAR * self.scatter)

    @property
    def ran_away(self) -> bool:
        """Whether the change is a drift."""
        return self.size >= 1.0


def drift_by_repeats(steady: Steadiness | None, scatter: float | None = None) -> SessionDrift:
    """Return the drift of a session's repeated patches, 0 without any; ``scatter``: an upper limit of theirs."""
    if steady is None:
        return SessionDrift(0.0, "repeats")
    return SessionDrift(steady.drift, "repeats", steady.scatter if scatter is None else min(scatter, steady.scatter))
