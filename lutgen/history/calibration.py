"""What the calibration did: the curves that the graphics card held while the session was read.

The signal goes through these curves before it reaches the display. The readings of a channel against the *output* of
its curve are therefore the native curve of the display, and the output at full input says how much of the channel the
calibration uses for white. Where the calibrations of two sessions are known, the native curves are compared.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lutgen.history.patches import CHANNELS, black_xyz, ramp, tip
from lutgen.history.transfer import DARKEST, lightness

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.readings.session import Session

#: A channel whose curve ends above this is at its stop: its light can be raised by less than half a percent.
STOP = 0.998

#: Native γ of a channel whose ramp was not read.
USUAL_GAMMA = 2.2


@dataclass(frozen=True)
class Calibration:
    """Calibration curves in a few numbers."""

    #: Output of the red, green and blue curve at full input, (3,).
    ends: Array
    #: Output at input 0, (3,): above 0 the calibration raises black.
    starts: Array
    #: Channels whose curve ends at 1.
    at_stop: tuple[str, ...]
    #: Share of the luminance of white that is lost because channels are lowered, from the primaries and the native γ of
    #: each channel; None where a primary is missing.
    cost: float | None
    #: Whether all curves rise.
    monotonic: bool
    #: Largest distance of a curve from the straight line between the curve's ends.
    bend: float
    #: Target of the calibration, where the file says it: white's x, y and Y in cd/m².
    target: dict[str, float]


def calibration(session: Session) -> Calibration | None:
    """Return what the session's calibration does; None where the file holds none."""
    curves = session.calibration
    if curves is None:
        return None
    ends, starts = curves[-1, 1:], curves[0, 1:]
    straight = starts + curves[:, :1] * (ends - starts)
    return Calibration(
        ends=ends,
        starts=starts,
        at_stop=tuple(name for name, end in zip(CHANNELS, ends, strict=True) if end >= STOP),
        cost=_cost(session, ends),
        monotonic=bool((np.diff(curves[:, 1:], axis=0) >= -1e-6).all()),
        bend=float(np.abs(curves[:, 1:] - straight).max()),
        target=_target(session.metadata.get("CAL_ARGYLL_DISPCAL_ARGS", "")),
    )


def native_ramp(session: Session, channel: str) -> tuple[Array, Array]:
    """Return a channel's drive after the calibration, if any, (n,), and XYZ less black, if read, (n, 3)."""
    levels = ramp(session, channel)
    drive = levels.drive
    if session.calibration is not None:
        drive = np.interp(drive, session.calibration[:, 0], session.calibration[:, 1 + CHANNELS[channel]])
    return drive, levels.xyz - black_xyz(session)


def native_gamma(session: Session, channel: str) -> float | None:
    """Return the native γ of a channel, fitted in logarithms with a free gain, 10 to 90 %; None: too few levels."""
    drive, xyz = native_ramp(session, channel)
    kept = (drive >= 0.1) & (drive <= 0.9) & (xyz[:, 1] > 0)
    if np.count_nonzero(kept) < 3:
        return None
    return float(np.polyfit(np.log(drive[kept]), np.log(xyz[kept, 1]), 1)[0])


def full_light_ratio(before: Session, after: Session) -> Array:
    """Factor by which the later calibration changes the full light of each channel, (3,); 1 without curves in both."""
    loops = calibration(before), calibration(after)
    if loops[0] is None or loops[1] is None or min(loops[0].ends.min(), loops[1].ends.min()) <= 0:
        return np.ones(3)
    ratios = []
    for name, one, other in zip(CHANNELS, loops[0].ends, loops[1].ends, strict=True):
        kept = _light_kept(before if one >= other else after, name, float(min(one, other) / max(one, other)))
        ratios.append(kept if one >= other else 1.0 / kept)
    return np.array(ratios)


def _light_kept(session: Session, channel: str, share: float) -> float:
    """Share of its light that a channel has at a share of its highest drive, by powers between levels, or its γ."""
    drive, xyz = native_ramp(session, channel)
    lit = (drive > 0) & (xyz[:, 1] > 0)
    drive, light = drive[lit], xyz[lit, 1]
    if drive.size and drive[0] <= share * drive[-1] and (np.diff(drive) > 0).all():
        return float(np.exp(np.interp(np.log(share * drive[-1]), np.log(drive), np.log(light))) / light[-1])
    return float(share ** (native_gamma(session, channel) or USUAL_GAMMA))


def _cost(session: Session, ends: Array) -> float | None:
    tips = [each for name in CHANNELS if (each := tip(session, name)) is not None]
    if len(tips) < 3 or ends.min() <= 0:
        return None
    light = np.array([each[1] for each in tips]) - black_xyz(session)[1]
    gammas = np.array([native_gamma(session, name) or USUAL_GAMMA for name in CHANNELS])
    native = float((light / ends**gammas).sum())
    return float(1.0 - light.sum() / native) if native > 0 else None


def _target(arguments: str) -> dict[str, float]:
    """Read Argyll dispcal's -w (white's x, y) and -b (luminance), https://www.argyllcms.com/doc/dispcal.html."""
    target: dict[str, float] = {}
    if match := re.search(r"(?:^|\s)-w(0?\.[0-9]+),(0?\.[0-9]+)", arguments):
        target |= {"x": float(match[1]), "y": float(match[2])}
    if match := re.search(r"(?:^|\s)-b([0-9]+(?:\.[0-9]+)?)", arguments):
        target["Y"] = float(match[1])
    return target


#: Fewest levels of a ramp that is compared with another.
FEWEST = 4


def bend(before: Session, after: Session, *, native: bool) -> float | None:
    """Largest change of a normalised curve, in L*; above 0: later is lighter. None: no ramp in both sessions."""
    names = list(CHANNELS) if native else ["grey", *CHANNELS]
    changes = [each for name in names if (each := _between(_curve(before, name, native), _curve(after, name, native)))]
    return max(changes, key=abs) if changes else None


def _curve(session: Session, name: str, native: bool) -> tuple[Array, Array]:
    """Drive, and luminance less black."""
    if native:
        drive, xyz = native_ramp(session, name)
        return drive, xyz[:, 1]
    levels = ramp(session, name)
    return levels.drive, levels.xyz[:, 1] - black_xyz(session)[1]


def _between(one: tuple[Array, Array], other: tuple[Array, Array]) -> float | None:
    if min(one[0].size, other[0].size) < FEWEST:
        return None
    top = min(one[0][-1], other[0][-1])
    # The cube root of a curve is nearly straight, so that straight lines may join its few levels.
    roots = [np.cbrt(np.maximum(light / np.interp(top, drive, light), 0.0)) for drive, light in (one, other)]
    at = other[0][(other[0] <= top) & (other[0] >= one[0][0])]
    first, second = (
        lightness(np.interp(at, drive, root) ** 3) for (drive, _), root in zip((one, other), roots, strict=True)
    )
    kept = (first >= DARKEST) & (at < top)
    if not kept.any():
        return None
    off = (second - first)[kept]
    return float(off[np.argmax(np.abs(off))])
