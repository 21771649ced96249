"""Two sessions of one display side by side: their readings, and what the records say of how these were taken."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import Array, xyz_to_uv
from lutgen.errors import LutgenError
from lutgen.history.colour_points import ColourPoints, colour_points
from lutgen.history.patches import CHANNELS, black_xyz, mean_xyz, ramp, tip_rows
from lutgen.history.steadiness import FEWEST_SHARED, drift_by_order, shared, steadiness
from lutgen.history.transfer import NEAR, Transfer, bend, clipping, full_light_ratio, transfer
from lutgen.readings.steadiness import SessionDrift, drift_by_repeats

if TYPE_CHECKING:
    from lutgen.readings.campaign import CampaignEntry
    from lutgen.readings.session import Session

#: Names of instruments and displays that systems write when they do not know the name.
UNKNOWN = ("", "unknown", "color lcd", "generic pnp monitor", "default monitor", "display")

#: Keywords in which ArgyllCMS' dispread writes the settings of the instrument: another value is another correction.
_SETTINGS = ("DISPLAY_TYPE_REFRESH", "DISPLAY_TYPE_BASE_ID", "CCMX_NAME", "CCSS_NAME")

#: Shifts of a spectrum that are tried, and the smallest that counts as one, in nanometres: a spectrometer repeats
#: within 0.1 to 0.2.
REACH, CLEAR_SHIFT = 5.0, 0.3

#: Facts that a cause may move, beside light and black, which the evidence weighs: colour of blue, colour of red or
#: green, transfer curve, white over the sum of the primaries, and white over black.
FACTS = ("blue", "colour", "curve", "sum", "contrast")

#: A fact has moved from these changes on: Δu'v', ΔL*, a share, and a factor.
COLOUR_MOVED, CURVE_MOVED, SUM_MOVED, CONTRAST_MOVED = 0.012, 3.0, 0.04, 1.8

#: Change of a curve at equal drive, in ΔL*, that noise and few levels do not explain; and one as strong as that of HDR.
BENT, STRONGLY_BENT = 2.5, 6.0

#: Change of a channel's light, as a share, that repeating the same calibration may cause.
RECALIBRATED = 0.04


@dataclass(frozen=True)
class SessionPair:
    """A session beside its reference."""

    #: The reference and the session, with what the campaign says of them.
    before: CampaignEntry
    after: CampaignEntry
    #: From the reference to the session; None: a date is missing.
    days: float | None
    #: Sentences on readings that were left out of both, one each.
    misread: tuple[str, ...] = ()

    @cached_property
    def seen(self) -> tuple[ColourPoints, ColourPoints] | None:
        """The colour points of both, the reference's through the session's calibration; None: some are not read."""
        sessions = self.before.session, self.after.session
        black_too = all(mean_xyz(each, "black") is not None for each in sessions)
        one, other = (colour_points(each, black_too=black_too) for each in sessions)
        if one is None or other is None or not all(each.absolute for each in sessions):
            return None
        return one.with_gains(self.held_back), other

    @cached_property
    def held_back(self) -> Array:
        """Factor of each channel's full light by the calibration curves, (3,): 1 where a file has no curves."""
        return full_light_ratio(self.before.session, self.after.session)

    @property
    def curves_known(self) -> bool:
        """Whether both files hold the calibration that was loaded."""
        return self.before.session.calibration is not None and self.after.session.calibration is not None

    @cached_property
    def bend(self) -> float | None:
        """Change of the display's own transfer curves, in L*; None: too few levels."""
        return bend(self.before.session, self.after.session, native=self.curves_known)

    @cached_property
    def bend_as_seen(self) -> float | None:
        """Change of the transfer curves with what the calibrations do, in L*; None: too few levels."""
        return bend(self.before.session, self.after.session, native=False)

    @cached_property
    def drifts(self) -> tuple[SessionDrift, SessionDrift]:
        """Drift within the reference, and within the session."""
        steady = [steadiness(each.session) for each in (self.before, self.after)]
        # One meter scatters alike in both sessions, so that the noise of either bounds the scatter of the other.
        known = [other.noise if other and not self.other_instrument else None for other in reversed(steady)]
        own = [drift_by_repeats(each, scatter) for each, scatter in zip(steady, known, strict=True)]
        if not own[1].ran_away and not own[0].ran_away:
            beside = drift_by_order(self.after.session, self.before.session)
            own[1] = beside or own[1]
        return own[0], own[1]

    @cached_property
    def unwatched(self) -> bool:
        """Whether a drift would go unseen: one session repeats no bright patch, and both share few patches."""
        sessions = self.before.session, self.after.session
        few = shared(sessions[1], sessions[0])[0].size < FEWEST_SHARED
        return few and any(steadiness(each) is None for each in sessions)

    @cached_property
    def noise(self) -> float:
        """Noise of readings of both sessions, 1 σ, as a share, from repeated patches; 0 without such patches."""
        steady = [steadiness(each.session) for each in (self.before, self.after)]
        one, other = (min(each.noise, 0.02) if each else 0.0 for each in steady)
        return float(np.hypot(one, other))

    @cached_property
    def shift(self) -> Array:
        """Change of u', v' of red, green, blue and white, after black, (4, 2). Only where ``seen``."""
        one, other = _both(self)
        return np.asarray(_uv(other) - _uv(one))

    @cached_property
    def additivity(self) -> tuple[float, float]:
        """White over the sum of the primaries, both after black, in luminance: before and after."""
        one, other = (1.0 + float(each.extra[1] / each.channels[:, 1].sum()) for each in _both(self))
        return one, other

    @cached_property
    def contrast(self) -> tuple[float, float] | None:
        """Luminance of white over that of black, before and after; None: a black was not read, or has no light."""
        pair = _both(self)
        if not all(each.has_black and each.leak[1] > 0 for each in pair):
            return None
        one, other = (float(each.xyz()[3, 1] / each.leak[1]) for each in pair)
        return one, other

    @cached_property
    def moved(self) -> frozenset[str]:
        """Those of ``FACTS`` that moved; none where white and primaries were not read in both."""
        if self.seen is None:
            return frozenset()
        red, green, blue, _ = np.hypot(*self.shift.T)
        before, after = self.additivity
        ratio = np.log(self.contrast[1] / self.contrast[0]) if self.contrast else 0.0
        moved = {
            "blue": blue >= COLOUR_MOVED,
            "colour": max(red, green) >= COLOUR_MOVED,
            "curve": self.bend is not None and abs(self.bend) >= CURVE_MOVED,
            "sum": abs(after - before) >= SUM_MOVED <= max(abs(after - 1.0), abs(before - 1.0)),
            "contrast": abs(ratio) >= np.log(CONTRAST_MOVED),
        }
        return frozenset(fact for fact in FACTS if moved[fact])

    def told(self, fact: str) -> str:
        """Say by how much one of the facts in ``moved`` did."""
        if fact == "sum":
            return "white over red + green + blue went from {:.3f} to {:.3f}".format(*self.additivity)
        if fact == "curve":
            return f"the transfer curve moved by ΔL* {self.bend:+.1f}"
        if fact == "contrast" and self.contrast:
            return "contrast went from {:.0f} to {:.0f}".format(*self.contrast)
        red, green, blue, _ = np.hypot(*self.shift.T)
        return (
            f"blue moved by Δu'v' {blue:.3f}" if fact == "blue" else f"a primary moved by Δu'v' {max(red, green):.3f}"
        )

    @cached_property
    def largest_shift(self) -> float:
        """Largest Δu'v' of a primary. Only where ``seen``."""
        return float(np.hypot(*self.shift[:3].T).max())

    @property
    def named_alike(self) -> bool:
        """Whether both files name the same display."""
        one, other = self.before.session.display, self.after.session.display
        return one == other and one.lower() not in UNKNOWN

    @property
    def bent(self) -> bool:
        """Whether the display's own curves moved, as far as calibrations are known."""
        return self.bend is not None and abs(self.bend) >= BENT

    @property
    def strongly_bent(self) -> bool:
        """Whether they moved as HDR moves them."""
        return self.bend is not None and abs(self.bend) >= STRONGLY_BENT

    @cached_property
    def clipped_otherwise(self) -> str:
        """Sentence on levels that show one light in one session and several in the other; "" without any.

        "" also where the files' calibrations say why: they clip too.
        """
        if self.recalibrated:
            return ""
        curves = [_curves(each.session) for each in (self.before, self.after)]
        sentences = []
        for here, (mine, theirs) in enumerate((curves, curves[::-1])):
            places: dict[str, list[str]] = {}
            clips = clipping(mine)
            # A range darkens all channels; one that reads nothing alone is the meter's noise in the dark.
            dark = all(name in clips and clips[name].dark is not None for name in mine)
            for name, clip in clips.items():
                other = theirs.get(name)
                if clip.bright is not None and other is not None and _tells(other, clip.bright, 1.0 - NEAR):
                    places.setdefault(f"from code {clip.bright:.2f} up", []).append(name)
                if dark and clip.dark is not None and other is not None and _tells(other, NEAR, clip.dark):
                    places.setdefault(f"up to code {clip.dark:.2f}", []).append(name)
            whose = ("the reference", "the session")
            sentences += [
                f"{' and '.join(names)} {'show' if len(names) > 1 else 'shows'} one light {where} in {whose[here]}, "
                f"and not in {whose[1 - here]}"
                for where, names in places.items()
            ]
        return "; ".join(sentences)

    @property
    def curves_of_files(self) -> bool:
        """Whether curves moved as they are seen, and the display's own, behind the files' calibrations, did not."""
        if not self.curves_known or self.bend is None or self.bend_as_seen is None:
            return False
        return abs(self.bend_as_seen) >= BENT > abs(self.bend)

    @property
    def recalibrated(self) -> bool:
        """Whether the files' calibrations differ by more than repeating a calibration does, or explain the curves."""
        gains = self.curves_known and float(np.abs(self.held_back - 1.0).max()) >= RECALIBRATED
        return gains or self.curves_of_files

    @cached_property
    def lines(self) -> float | None:
        """Common shift of the primaries' spectra in nm; None: no spectra."""
        return line_shift(self.before.session, self.after.session)

    @property
    def other_instrument(self) -> str:
        """Sentence on another instrument, or another setting of it, from the records; "" without one."""
        one, other = self.before.instrument, self.after.instrument
        if one.lower() not in UNKNOWN and other.lower() not in UNKNOWN and one != other:
            return f"the instrument is {other!r}, it was {one!r}"
        for key in _SETTINGS:
            values = [each.session.metadata.get(key, "") for each in (self.before, self.after)]
            if values[0] != values[1]:
                return f"the instrument's {key} is {values[1] or 'not said'}, it was {values[0] or 'not said'}"
        return ""

    @property
    def other_display(self) -> str:
        """Sentence on another display, from the records; "" without one."""
        one, other = self.before.session.display, self.after.session.display
        if one.lower() not in UNKNOWN and other.lower() not in UNKNOWN and one != other:
            return f"the file names {other!r}, the reference {one!r}"
        return ""

    @property
    def other_settings(self) -> str:
        """Sentence on other settings, from the campaign; "" without one."""
        one, other = self.before.settings, self.after.settings
        return f"the campaign says {other!r}, it was {one!r}" if one and other and one != other else ""

    @property
    def more_room_light(self) -> float | None:
        """Change of the room's light in lux as the campaign says; None: not said of both."""
        one, other = (each.conditions.get("ambient_lx") for each in (self.before, self.after))
        return None if one is None or other is None else other - one


def _curves(session: Session) -> dict[str, Transfer]:
    """Curves of the channels' ramps by name."""
    curves = {name: transfer(ramp(session, name), black_xyz(session)) for name in CHANNELS}
    return {name: curve for name, curve in curves.items() if curve is not None}


def _tells(curve: Transfer, low: float, high: float) -> bool:
    """Whether a curve has levels in a range of code values, and is clipped at none of them."""
    inside = (curve.drive >= low - 1e-6) & (curve.drive <= high + 1e-6)
    end = clipping({"": curve}).get("")
    clipped = [] if end is None else [code for code in end if code is not None]
    return bool(inside.any()) and not any(low - NEAR <= code <= high + NEAR for code in clipped)


def _both(pair: SessionPair) -> tuple[ColourPoints, ColourPoints]:
    if pair.seen is None:
        raise LutgenError(f"{pair.after.session.file}: white and primaries in cd/m² were not read in both sessions.")
    return pair.seen


def _uv(colours: ColourPoints) -> Array:
    light = np.vstack([colours.channels, colours.channels.sum(axis=0) + colours.extra])
    return xyz_to_uv(light)


def line_shift(before: Session, after: Session) -> float | None:
    """Shift in nm that the spectra of all primaries have in common: the instrument's. None: there is none."""
    if before.spectra is None or after.spectra is None or before.wavelengths is None or after.wavelengths is None:
        return None
    shifts = []
    for name in CHANNELS:
        pair = [_tip_spectrum(each, name) for each in (before, after)]
        if pair[0] is None or pair[1] is None:
            return None
        shifts.append(_spectral_shift(before.wavelengths, pair[0], after.wavelengths, pair[1]))
    middle = float(np.median(shifts))
    return middle if np.ptp(shifts) <= max(0.2, 0.5 * abs(middle)) else None


def _tip_spectrum(session: Session, channel: str) -> Array | None:
    full = tip_rows(session, channel)
    return session.spectra[full].mean(axis=0) if full.size and session.spectra is not None else None


def _spectral_shift(at: Array, one: Array, at_other: Array, other: Array) -> float:
    """Shift in nm by which the first spectrum, scaled, fits the second best."""
    inner = (at_other >= at[0] + REACH) & (at_other <= at[-1] - REACH)
    shifts = np.arange(-REACH, REACH + 0.05, 0.1)
    misfits = []
    for shift in shifts:
        moved = np.interp(at_other[inner] - shift, at, one)
        scale = float(moved @ other[inner]) / max(float(moved @ moved), 1e-12)
        misfits.append(float(((other[inner] - scale * moved) ** 2).sum()))
    return float(shifts[int(np.argmin(misfits))])
