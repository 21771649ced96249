"""Tone curves: luminance against drive, γ and clipping, the colour of greys, DICOM's function, and calibration.

A contrast that is set too high, or a calibration that reaches full drive, clips the bright end. A display that
interprets a signal of limited range (16..235 of 255) as a signal of full range, or the other way round, crushes the
dark end or clips both ends.

DICOM PS3.14, 7.1 (Grayscale Standard Display Function) gives luminance by index of just-noticeable difference (JND);
colour-science implements the function. Contrast response is defined by TG18 (Samei et al. 2005, doi:10.1118/1.1861159,
4.3): the change of luminance between neighbouring greys over their mean luminance, per JND, compared with the standard.

The signal passes the calibration curves of the graphics card before it reaches the display. The readings of a channel
against the *output* of its curve are therefore the native curve of the display, and the output at full input is the
share of the channel's drive that the calibration uses for white. If the calibrations of two sessions are known, lutgen
compares the native curves.
"""

import re
from dataclasses import dataclass

import numpy as np

from lutgen.colorimetry import Array, code_to_linear, delta_e_2000, xyz_to_lab, xyz_to_uv
from lutgen.history.patches import CHANNELS, Ramp, black_xyz, mean_xyz, ramp, tips
from lutgen.readings.session import DRIVE_TOLERANCE, Session

#: γ is fitted between these code values: below, black and noise are too large a part; above, all curves meet.
FITTED = (0.1, 0.9)

#: Fewest levels between these code values for a γ.
FEWEST_LEVELS = 3

#: Invisible differences from full light and from no light, as shares of full light: ΔL* ⅓.
ALIKE, DARK = 0.005, 2e-4

#: Code values closer to 0 or 1 than this look alike on any display.
NEAR = 0.06


@dataclass(frozen=True)
class Transfer:
    """The transfer curve of a ramp."""

    #: Code values, (n,), and luminance relative to full drive, both minus black, (n,).
    drive: Array
    linear: Array
    #: Slope of log ``linear`` against log ``drive`` through full drive, from 10 to 90 %; None: fewer than three levels.
    gamma: float | None
    #: Root mean square of the relative difference between ``linear`` and the power law of ``gamma``; None: no γ.
    residual: float | None
    #: L* of the curve minus L* of sRGB at each drive, (n,): above 0 the display is lighter (CIE 15:2018, 8.2.1).
    lightness: Array

    @property
    def worst(self) -> int:
        """Index of the level that is farthest from sRGB."""
        return int(np.argmax(np.abs(self.lightness)))

    @property
    def clipped_from(self) -> float | None:
        """Code value from which light no longer rises; None: light rises up to full drive."""
        still = self.drive[np.abs(self.linear - 1.0) <= ALIKE]
        return float(still.min()) if still.size and still.min() <= 1.0 - NEAR else None

    @property
    def crushed_to(self) -> float | None:
        """Code value up to which there is no light; None: light rises from black on."""
        none = self.drive[self.linear <= DARK]
        return float(none.max()) if none.size and none.max() >= NEAR else None


def transfer(ramp: Ramp, black: Array | None) -> Transfer | None:
    """Return the curve of a ramp minus black, if given; None if full drive was not read, or has no light."""
    if not ramp.drive.size or ramp.drive[-1] < 1.0 - DRIVE_TOLERANCE:
        return None
    light = ramp.xyz[:, 1] - (0.0 if black is None else black[1])
    if light[-1] <= 0:
        return None
    linear = light / light[-1]
    fitted = (ramp.drive >= FITTED[0]) & (ramp.drive <= FITTED[1]) & (linear > 0)
    gamma = residual = None
    if np.count_nonzero(fitted) >= FEWEST_LEVELS:
        across, up = np.log(ramp.drive[fitted]), np.log(linear[fitted])
        gamma = float(across @ up / (across @ across))
        residual = float(np.sqrt(np.mean((linear[fitted] / ramp.drive[fitted] ** gamma - 1.0) ** 2)))
    return Transfer(ramp.drive, linear, gamma, residual, lightness(linear) - lightness(code_to_linear(ramp.drive)))


def lightness(ratio: Array) -> Array:
    """Return L* of Y over Y of white (CIE 15:2018, 8.2.1); the linear part also covers values below 0. Any shape."""
    return np.where(ratio > (6 / 29) ** 3, 116.0 * np.cbrt(ratio) - 16.0, ratio * (29 / 3) ** 3)


#: Changes of a curve are ignored below this L*: black and noise are too large a part of the light there.
DARKEST = 20.0

#: Below this code value the colour of black is too large a part of the colour of a grey.
LOWEST = 0.1


@dataclass(frozen=True)
class GreyTracking:
    """Colour of the greys, with black not subtracted."""

    #: Code values from 0.1 to below white, (n,).
    drive: Array
    #: u', v' of each grey minus u', v' of white, (n, 2).
    shift: Array
    #: ΔE2000 to a grey of the same luminance and the chromaticity of white, relative to white, (n,).
    delta_e: Array


def grey_tracking(ramp: Ramp, white: Array | None) -> GreyTracking | None:
    """Return the colour of a grey ramp relative to ``white``, (3,); None without greys or without white."""
    if white is None or white[1] <= 0:
        return None
    kept = (ramp.drive >= LOWEST) & (ramp.drive < 1.0 - DRIVE_TOLERANCE) & (ramp.xyz[:, 1] > 0)
    if not kept.any():
        return None
    xyz = ramp.xyz[kept]
    uv = xyz_to_uv(np.vstack([white, xyz]))
    neutral = xyz[:, 1:2] / white[1] * white
    delta_e = delta_e_2000(xyz_to_lab(xyz, white), xyz_to_lab(neutral, white))
    return GreyTracking(ramp.drive[kept], uv[1:] - uv[0], delta_e)


#: Largest index of just-noticeable difference.
_LAST = 1023.0

#: Luminances that the function covers, cd/m².
GSDF_RANGE = (0.05, 3993.404)

#: Fewest greys for a contrast response, with black and white; and TG18's even steps: greys nearest to them are used.
FEWEST_GREYS, LEVELS = 8, 18


def luminance_of(index: Array) -> Array:
    """Return luminance in cd/m² of indices of just-noticeable difference, 1 to 1023. Any shape."""
    from colour.models import eotf_DICOMGSDF

    return np.asarray(eotf_DICOMGSDF(index / _LAST))


def index_of(luminance: Array) -> Array:
    """Return the index of just-noticeable difference of luminances within ``GSDF_RANGE``, cd/m². Any shape."""
    from colour.models import eotf_inverse_DICOMGSDF

    return np.asarray(eotf_inverse_DICOMGSDF(luminance) * _LAST)


@dataclass(frozen=True)
class ContrastResponse:
    """Contrast between neighbouring greys."""

    #: Mean of two neighbouring code values, (n,).
    drive: Array
    #: ΔL over mean L per JND, as read, and by the standard between the same ends, (n,).
    contrast: Array
    standard: Array

    @property
    def deviation(self) -> Array:
        """Relative difference of the contrast from the standard, (n,)."""
        return np.asarray(self.contrast / self.standard - 1.0)

    @property
    def worst(self) -> float:
        """Largest absolute deviation."""
        return float(np.abs(self.deviation).max())


def contrast_response(session: Session, ambient_cd_m2: float = 0.0) -> ContrastResponse | None:
    """Return the contrast response of a session's greys with room light; None: too few, relative, or out of range."""
    greys, black = ramp(session, "grey"), mean_xyz(session, "black")
    if not session.absolute or black is None or greys.drive.size < FEWEST_GREYS - 1:
        return None
    if greys.drive[-1] < 1.0 - DRIVE_TOLERANCE:
        return None
    drive = np.concatenate([[0.0], greys.drive])
    light = np.concatenate([[black[1]], greys.xyz[:, 1]]) + ambient_cd_m2
    # Between closer greys, noise and steps of 8 bits are larger than the contrast.
    read = np.unique(np.abs(drive - np.linspace(0.0, 1.0, LEVELS)[:, np.newaxis]).argmin(axis=1))
    drive, light = drive[read], light[read]
    if not (GSDF_RANGE[0] <= light.min() and light.max() <= GSDF_RANGE[1]):
        return None
    ends = index_of(light[[0, -1]])
    index = ends[0] + drive * (ends[1] - ends[0])
    middle = 0.5 * (drive[1:] + drive[:-1])
    return ContrastResponse(middle, _by_jnd(light, index), _by_jnd(luminance_of(index), index))


def _by_jnd(light: Array, index: Array) -> Array:
    return np.asarray(2.0 * np.diff(light) / (light[1:] + light[:-1]) / np.diff(index))


#: A channel whose curve ends above this value is at its limit: its light can rise by less than half a percent.
STOP = 0.998

#: Native γ of a channel whose ramp was not read.
USUAL_GAMMA = 2.2


@dataclass(frozen=True)
class Calibration:
    """Summary of calibration curves."""

    #: Output of the red, green and blue curve at full input, (3,).
    ends: Array
    #: Output at input 0, (3,): above 0 the calibration raises black.
    starts: Array
    #: Channels whose curve ends at 1.
    at_stop: tuple[str, ...]
    #: Share of white's luminance that lowered channels cost, by the primaries and native γs; None: one is missing.
    cost: float | None
    #: Whether all curves rise.
    monotonic: bool
    #: Largest distance of a curve from the straight line between the curve's ends.
    bend: float
    #: Target of the calibration, if the file states it: white's x, y and Y in cd/m².
    target: dict[str, float]


def calibration(session: Session) -> Calibration | None:
    """Return a summary of the session's calibration; None if the file holds no calibration."""
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


def _as_read(session: Session, kind: str) -> tuple[Array, Array]:
    """Return drive of a ramp, (n,), and luminance minus black, if read, (n,)."""
    levels = ramp(session, kind)
    return levels.drive, levels.xyz[:, 1] - black_xyz(session)[1]


def native_ramp(session: Session, channel: str) -> tuple[Array, Array]:
    """Return drive after the calibration, if known, (n,), and luminance minus black, (n,), of a channel's ramp."""
    drive, light = _as_read(session, channel)
    if session.calibration is not None:
        drive = np.interp(drive, session.calibration[:, 0], session.calibration[:, 1 + CHANNELS[channel]])
    return drive, light


def native_gamma(session: Session, channel: str) -> float | None:
    """Return the native γ of a channel, fitted in logarithms with a free gain, 10 to 90 %; None: too few levels."""
    drive, light = native_ramp(session, channel)
    kept = (drive >= FITTED[0]) & (drive <= FITTED[1]) & (light > 0)
    if np.count_nonzero(kept) < FEWEST_LEVELS:
        return None
    return float(np.polyfit(np.log(drive[kept]), np.log(light[kept]), 1)[0])


def full_light_ratio(before: Session, after: Session) -> Array:
    """Return the factor by which the later calibration changes each channel's full light, (3,); 1 without curves."""
    ends = [each.calibration[-1, 1:] for each in (before, after) if each.calibration is not None]
    if len(ends) < 2 or np.min(ends) <= 0:
        return np.ones(3)
    ratios = []
    for name, one, other in zip(CHANNELS, *ends, strict=True):
        kept = _light_kept(before if one >= other else after, name, float(min(one, other) / max(one, other)))
        ratios.append(kept if one >= other else 1.0 / kept)
    return np.array(ratios)


def _light_kept(session: Session, channel: str, share: float) -> float:
    """Return a channel's light at a share of its highest drive over full light: by a power between levels, or by γ."""
    drive, light = native_ramp(session, channel)
    lit = (drive > 0) & (light > 0)
    drive, light = drive[lit], light[lit]
    if drive.size and drive[0] <= share * drive[-1] and (np.diff(drive) > 0).all():
        return float(np.exp(np.interp(np.log(share * drive[-1]), np.log(drive), np.log(light))) / light[-1])
    return float(share ** (native_gamma(session, channel) or USUAL_GAMMA))


def _cost(session: Session, ends: Array) -> float | None:
    read = tips(session)
    if len(read) < 3 or ends.min() <= 0:
        return None
    light = np.array([each[1] for each in read.values()]) - black_xyz(session)[1]
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


#: Fewest levels of a ramp for a comparison with another ramp.
FEWEST = 4


def bend(before: Session, after: Session, *, native: bool) -> float | None:
    """Return the largest change of a normalised curve, in L*; above 0: the later session is lighter. None: no ramp."""
    if native:
        curves = [[native_ramp(each, name) for name in CHANNELS] for each in (before, after)]
    else:
        curves = [[_as_read(each, name) for name in ("grey", *CHANNELS)] for each in (before, after)]
    changes = [each for one, other in zip(*curves, strict=True) if (each := _between(one, other))]
    return max(changes, key=abs) if changes else None


def _between(one: tuple[Array, Array], other: tuple[Array, Array]) -> float | None:
    if min(one[0].size, other[0].size) < FEWEST:
        return None
    top = min(one[0][-1], other[0][-1])
    # The cube root of a curve is nearly straight, so linear interpolation between few levels is accurate.
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
