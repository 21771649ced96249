"""Steadiness of a session: noise and drift of patches that were read more than once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, xyz_to_uv

#: Smallest luminance of a bright patch, as a share of the largest luminance. The noise of a bright patch is
#: proportional to its luminance.
BRIGHT = 0.05

#: Smallest number of readings that distinguishes scatter from drift.
FEWEST = 6

#: Median of |x| for a normal x with standard deviation 1.
_MEDIAN_OF_NORMAL = 0.6745


@dataclass(frozen=True)
class Steadiness:
    """Repeatability of a session, from patches that were read more than once."""

    #: Number of repeated bright patches, and number of their readings.
    patches: int
    readings: int
    #: Standard deviation of Y over the mean Y of the patch, pooled over bright patches; includes a drift.
    noise: float
    #: Pooled standard deviation of Y of dark patches, in the unit of the session; None: no repeated dark patch.
    dark_noise: float | None
    #: Readings of bright patches: position in the order of reading as a share of the session, (n,), and Y over Y of the
    #: patch's first reading, (n,).
    order: Array
    ratio: Array
    #: Rows of these readings, (n,).
    rows: NDArray[np.intp]
    #: Largest Δu'v' of a bright patch from its first reading.
    shift: float

    @property
    def drift(self) -> float:
        """Largest relative change of Y from the first reading of a bright patch, with its sign."""
        return float(self.ratio[np.argmax(np.abs(self.ratio - 1.0))] - 1.0)

    @property
    def scatter(self) -> float:
        """Relative standard deviation of Y of a bright patch, robust against one jump and a steady drift."""
        if self.readings < FEWEST:
            return 0.0
        steps = np.diff(self.ratio)
        noise = [np.median(np.abs(steps)) / np.sqrt(2.0), np.median(np.abs(np.diff(steps))) / np.sqrt(6.0)]
        return float(min(noise) / _MEDIAN_OF_NORMAL)


def steadiness_of(xyz: Array, place: NDArray[np.intp], groups: Sequence[NDArray[np.intp]]) -> Steadiness | None:
    """Return the steadiness of a session; None if no bright patch was repeated.

    ``xyz``: light of the readings, (n, 3). ``place``: position of each reading in the order of reading, (n,).
    ``groups``: the rows of each repeated patch.
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
    """Return the pooled standard deviation of groups, each about its own mean."""
    squares = sum(float(((each - each.mean()) ** 2).sum()) for each in groups)
    return float(np.sqrt(squares / sum(each.size - 1 for each in groups)))


#: Smallest change of luminance within a session that counts as drift: as a share, and in standard errors or in units of
#: the scatter of repeated patches.
RAN_AWAY, CLEAR = 0.02, 5.0


@dataclass(frozen=True)
class SessionDrift:
    """The drift of a session."""

    #: Largest relative change of luminance within the session, with its sign.
    change: float
    #: Source: "repeats" (repeated patches) or "order" (patches in common with another session).
    by: str
    #: Relative scatter of readings without drift (1 σ).
    scatter: float = 0.0

    @property
    def size(self) -> float:
        """The change over the smallest change that counts as drift."""
        return abs(self.change) / max(RAN_AWAY, CLEAR * self.scatter)

    @property
    def drifted(self) -> bool:
        """Whether the change counts as drift."""
        return self.size >= 1.0


def drift_by_repeats(steady: Steadiness | None, scatter: float | None = None) -> SessionDrift:
    """Return the drift of repeated patches, 0 if there are none; ``scatter``: an upper limit of their scatter."""
    if steady is None:
        return SessionDrift(0.0, "repeats")
    return SessionDrift(steady.drift, "repeats", steady.scatter if scatter is None else min(scatter, steady.scatter))
