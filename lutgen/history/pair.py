"""A pair of sessions of one display: differences of their readings, and the records of how they were taken."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.errors import LutgenError
from lutgen.history.colour_points import ColourPoints, colour_points
from lutgen.history.patches import CHANNELS, mean_xyz, tip_rows
from lutgen.history.steadiness import drift_by_order, steadiness
from lutgen.history.transfer import bend, full_light_ratio
from lutgen.readings.campaign import CampaignEntry
from lutgen.readings.conditions.ambient import LUX
from lutgen.readings.session import Session
from lutgen.readings.steadiness import SessionDrift, drift_by_repeats

#: Names that systems write for an unknown instrument or display.
UNKNOWN = ("", "unknown", "color lcd", "generic pnp monitor", "default monitor", "display")

#: Keywords for the settings of the instrument in files of ArgyllCMS' dispread: another value means another correction.
_SETTINGS = ("DISPLAY_TYPE_REFRESH", "DISPLAY_TYPE_BASE_ID", "CCMX_NAME", "CCSS_NAME")

#: Largest shift of a spectrum that is tried, and smallest shift that counts, in nanometres: the repeatability of a
#: spectrometer is 0.1 to 0.2.
REACH, CLEAR_SHIFT = 5.0, 0.3

#: Facts that a cause may move: colour of blue, colour of red or green, transfer curve, white over the sum of the
#: primaries, and white over black. Light and black are not listed, since the evidence weighs them.
FACTS = ("blue", "colour", "curve", "sum", "contrast")

#: Smallest changes that count as a moved fact: Δu'v', ΔL*, a share, and a factor.
COLOUR_MOVED, CURVE_MOVED, SUM_MOVED, CONTRAST_MOVED = 0.012, 3.0, 0.04, 1.8

#: Change of a curve at equal drive, in ΔL*, that is too large for noise and few levels.
BENT = 2.5

#: Change of all light, as a natural logarithm, that is too large for a wrong correction.
LEAP = 0.15

#: Change of a channel's light, as a share, that a repeated calibration may cause.
RECALIBRATED = 0.04


@dataclass(frozen=True)
class SessionPair:
    """A session and its reference."""

    #: The reference and the session, as entries of the campaign.
    before: CampaignEntry
    after: CampaignEntry
    #: Days from the reference to the session; None: a date is missing.
    days: float | None
    #: Sentences on misread readings of both sessions, which are left out.
    misread: tuple[str, ...] = ()

    @property
    def sessions(self) -> tuple[Session, Session]:
        """The readings of the reference and of the session."""
        return self.before.session, self.after.session

    @property
    def hours(self) -> float | None:
        """Operating hours from the reference to the session; None: not stated for both."""
        one, other = self.before.hours, self.after.hours
        return None if one is None or other is None else other - one

    @cached_property
    def seen(self) -> tuple[ColourPoints, ColourPoints] | None:
        """Colour points of both sessions, the reference's with the session's calibration; None: some were not read."""
        black_too = all(mean_xyz(each, "black") is not None for each in self.sessions)
        one, other = (colour_points(each, black_too=black_too) for each in self.sessions)
        if one is None or other is None or not all(each.absolute for each in self.sessions):
            return None
        return one.with_gains(self.calibration_gain), other

    @cached_property
    def calibration_gain(self) -> Array:
        """Factor of each channel's full light by the change of calibration curves, (3,): 1 if a file has no curves."""
        return full_light_ratio(*self.sessions)

    @property
    def curves_known(self) -> bool:
        """Whether both files hold the calibration that was loaded."""
        return all(each.calibration is not None for each in self.sessions)

    @cached_property
    def bend(self) -> float | None:
        """Change of the display's own transfer curves, in L*; None: too few levels."""
        return bend(*self.sessions, native=self.curves_known)

    @cached_property
    def bend_with_calibration(self) -> float | None:
        """Change of the transfer curves including the calibrations, in L*; None: too few levels."""
        return bend(*self.sessions, native=False)

    @cached_property
    def drifts(self) -> tuple[SessionDrift, SessionDrift]:
        """Drift within the reference, and within the session."""
        steady = [steadiness(each) for each in self.sessions]
        # One meter has the same noise in both sessions, so the noise of one session bounds the scatter of the other.
        known = [other.noise if other and not self.other_instrument else None for other in reversed(steady)]
        own = [drift_by_repeats(each, scatter) for each, scatter in zip(steady, known, strict=True)]
        if not any(each.drifted for each in own):
            own[1] = drift_by_order(*self.sessions[::-1]) or own[1]
        return own[0], own[1]

    @cached_property
    def noise(self) -> float:
        """Combined relative noise of the readings of both sessions, 1 σ, from repeated patches; 0 without repeats."""
        one, other = (min(steady.noise, 0.02) if steady else 0.0 for steady in map(steadiness, self.sessions))
        return float(np.hypot(one, other))

    @cached_property
    def shift(self) -> Array:
        """Δu'v' of red, green, blue and white, minus black, (4,). Raises LutgenError without ``seen``."""
        lights = [np.vstack([each.channels, each.channels.sum(axis=0) + each.extra]) for each in _both(self)]
        one, other = map(xyz_to_uv, lights)
        return np.asarray(np.linalg.norm(other - one, axis=1))

    @cached_property
    def additivity(self) -> tuple[float, float]:
        """Luminance of white over that of the sum of the primaries, both minus black: before and after."""
        one, other = (1.0 + each.excess for each in _both(self))
        return one, other

    @cached_property
    def contrast(self) -> tuple[float, float] | None:
        """Luminance of white over luminance of black, before and after; None: a black was not read, or has no light."""
        pair = _both(self)
        if not all(each.has_black and each.leak[1] > 0 for each in pair):
            return None
        one, other = (float(each.xyz()[3, 1] / each.leak[1]) for each in pair)
        return one, other

    @cached_property
    def moved(self) -> frozenset[str]:
        """The moved facts, of ``FACTS``; none if white and primaries were not read in both sessions."""
        if self.seen is None:
            return frozenset()
        red, green, blue, _ = self.shift
        before, after = self.additivity
        ratio = np.log(self.contrast[1] / self.contrast[0]) if self.contrast else 0.0
        moved = {
            "blue": blue >= COLOUR_MOVED,
            "colour": max(red, green) >= COLOUR_MOVED,
            "curve": self.bend is not None and abs(self.bend) >= CURVE_MOVED,
            "sum": min(abs(after - before), max(abs(after - 1.0), abs(before - 1.0))) >= SUM_MOVED,
            "contrast": abs(ratio) >= np.log(CONTRAST_MOVED),
        }
        return frozenset(fact for fact in FACTS if moved[fact])

    def describe(self, fact: str) -> str:
        """Return a clause on the change of a fact of ``moved``."""
        if fact == "sum":
            return "white over red + green + blue went from {:.3f} to {:.3f}".format(*self.additivity)
        if fact == "curve":
            return f"the transfer curve moved by ΔL* {self.bend:+.1f}"
        if fact == "contrast" and self.contrast:
            return "contrast went from {:.0f} to {:.0f}".format(*self.contrast)
        red, green, blue, _ = self.shift
        which, moved = ("blue", blue) if fact == "blue" else ("a primary", max(red, green))
        return f"{which} moved by Δu'v' {moved:.3f}"

    @cached_property
    def light_ratio(self) -> Array:
        """Each channel's light over the reference's light, (3,). Raises LutgenError without ``seen``."""
        one, other = _both(self)
        return np.asarray(other.channels[:, 1] / one.channels[:, 1])

    @property
    def light_change(self) -> Array | None:
        """Natural logarithm of ``light_ratio``, (3,); None without ``seen``."""
        return None if self.seen is None else np.log(self.light_ratio)

    @cached_property
    def largest_shift(self) -> float:
        """Largest Δu'v' of a primary. Raises LutgenError without ``seen``."""
        return float(self.shift[:3].max())

    @property
    def named_alike(self) -> bool:
        """Whether both files name the same display."""
        one, other = (each.display for each in self.sessions)
        return one == other and one.lower() not in UNKNOWN

    @property
    def bent(self) -> bool:
        """Whether the display's own curves moved; without known calibrations, whether the measured curves moved."""
        return self.bend is not None and abs(self.bend) >= BENT

    @property
    def curves_of_files(self) -> bool:
        """Whether the measured curves moved, but the display's own curves, without the files' calibrations, did not."""
        if not self.curves_known or self.bend is None or self.bend_with_calibration is None:
            return False
        return abs(self.bend_with_calibration) >= BENT > abs(self.bend)

    @property
    def recalibrated(self) -> bool:
        """Whether the files' calibrations differ by more than a repeated calibration, or explain the moved curves."""
        gains = self.curves_known and float(np.abs(self.calibration_gain - 1.0).max()) >= RECALIBRATED
        return gains or self.curves_of_files

    @property
    def other_instrument(self) -> str:
        """Clause on another instrument or another setting of the instrument, from the records; "" without a change."""
        one, other = self.before.instrument, self.after.instrument
        if _differ(one, other):
            return f"the instrument is {other!r}, it was {one!r}"
        for key in _SETTINGS:
            values = [each.metadata.get(key, "") for each in self.sessions]
            if values[0] != values[1]:
                return f"the instrument's {key} is {values[1] or 'not said'}, it was {values[0] or 'not said'}"
        return ""

    @property
    def holds_luminance(self) -> bool:
        """Whether the records of both sessions say that a sensor holds the luminance of white."""
        return all(each.metadata.get("luminance") == "held" for each in self.sessions)

    @property
    def same_instrument(self) -> bool:
        """Whether the records name one instrument for both sessions."""
        return bool(self.before.instrument) and self.before.instrument == self.after.instrument

    @property
    def other_display(self) -> str:
        """Clause on another display, from the records; "" without a change."""
        one, other = (each.display for each in self.sessions)
        return f"the file names {other!r}, the reference {one!r}" if _differ(one, other) else ""

    @property
    def other_settings(self) -> str:
        """Clause on other settings, from the campaign; "" without a change."""
        one, other = self.before.settings, self.after.settings
        return f"the campaign says {other!r}, it was {one!r}" if one and other and one != other else ""

    @property
    def room_light_change(self) -> float | None:
        """Change of the room's light in lux, from the campaign; None if the campaign lacks it for a session."""
        one, other = (each.conditions.get(LUX.name) for each in (self.before, self.after))
        return None if one is None or other is None else other - one


def _differ(one: str, other: str) -> bool:
    """Whether two recorded names are known and differ."""
    return one != other and one.lower() not in UNKNOWN and other.lower() not in UNKNOWN


def _both(pair: SessionPair) -> tuple[ColourPoints, ColourPoints]:
    if pair.seen is None:
        raise LutgenError(f"{pair.after.session.file}: white and primaries in cd/m² were not read in both sessions.")
    return pair.seen


def line_shift(before: Session, after: Session) -> float | None:
    """Return the shift in nm that the spectra of all primaries share, an error of the instrument; None: no shift."""
    if before.spectra is None or after.spectra is None or before.wavelengths is None or after.wavelengths is None:
        return None
    shifts = []
    for name in CHANNELS:
        here, there = tip_rows(before, name), tip_rows(after, name)
        if not here.size or not there.size:
            return None
        one, other = before.spectra[here].mean(axis=0), after.spectra[there].mean(axis=0)
        shifts.append(_spectral_shift(before.wavelengths, one, after.wavelengths, other))
    middle = float(np.median(shifts))
    return middle if np.ptp(shifts) <= max(0.2, 0.5 * abs(middle)) else None


def _spectral_shift(at: Array, one: Array, at_other: Array, other: Array) -> float:
    """Return the shift in nm with which the first spectrum, scaled, fits the second spectrum best."""
    inner = (at_other >= at[0] + REACH) & (at_other <= at[-1] - REACH)
    shifts = np.arange(-REACH, REACH + 0.05, 0.1)
    moved = np.interp(at_other[inner] - shifts[:, np.newaxis], at, one)
    scale = moved @ other[inner] / np.maximum((moved**2).sum(axis=1), 1e-12)
    misfits = ((other[inner] - scale[:, np.newaxis] * moved) ** 2).sum(axis=1)
    return float(shifts[np.argmin(misfits)])
