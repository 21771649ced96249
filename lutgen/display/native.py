"""The native fresh display: transfer curves and black from a display's own first session.

A real new display does not have sRGB's curves, its black has light, and it is not additive. Above black, the paper's
model of four colour points holds for real displays too:

    XYZ(d) = K + Σ_i s_i(l(d)) · (T_i − K),    i over white, red, green and blue,

where l are the measured transfer curves, s the shares of :func:`lutgen.display.paper.tip_shares` and T the measured
tips. Black K is a constant share of white in X, Y and Z, because black follows the backlight. Curves and the share of
black are constant over time; effects (``black-level``, ``eotf-drift``, …) describe their change with age.

A point of a curve is the light of a ramp's reading minus black, projected on the light of the ramp's tip. If there are
no ramps of the channels, or no mixtures and the ramps do not predict the greys, X, Y and Z of every grey are solved for
the light of the three channels. If the first session has many mixtures, the curves may be fitted to all readings, or
may be sRGB's, if these curves predict the mixtures better (:mod:`lutgen.display.own_model.native_curves`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lutgen.colorimetry import Array, inverse
from lutgen.display.own_model import OwnModel, Sample, fit_own_model
from lutgen.display.own_model.ladder import LENGTHS, clearly_better, mixtures_error
from lutgen.display.own_model.native_curves import (
    FEW,
    LEAST_MIXTURES,
    Curves3,
    added_up,
    best_source,
    by_greys,
    curves_of,
    srgb_curves,
)
from lutgen.display.own_model.sample import first_session_rows, in_first_session, sample_of
from lutgen.display.own_model.stored import StoredModel
from lutgen.display.paper import tip_shares
from lutgen.display.transfer_curve import TransferCurve, fallen, misread_levels, rising_light
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.readings import TIP_NAMES, Measurements
from lutgen.readings.rest import TIP_DRIVES

CHANNELS = TIP_NAMES[1:]

#: Sources of the curves.
SOURCES = ("ramps", "greys", "readings", "srgb")

#: Smallest number of levels of a ramp between black and full drive. Fewer levels miss the bends of a calibrated
#: display.
LEAST_LEVELS = 5

#: Noise (1 σ) that decides whether a ramp falls: the noise of a poor colorimeter, as a share of the light, and in
#: cd/m².
RELATIVE, FLOOR_CD_M2 = 0.005, 0.01

#: Smallest light, as a share of white, in the denominator of an own model's gain.
LEAST_SHARE = 1e-6

#: Limits of the own model's light over that of its curves. Assumption: no real display exceeds them.
GAINS = (0.2, 5.0)

#: Distance in code values over which the error of an own model at black and the colour points is corrected: the
#: shortest correlation length of a residual.
REACH = min(LENGTHS)

#: Code values of black and the colour points.
ENDS = np.array([(0.0, 0.0, 0.0), *TIP_DRIVES])

#: Largest share of black in white.
DARKEST = 0.2

#: Number of cached results, and largest number of values of the code values of a cached result: a table, not an image.
KEPT, MOST = 8, 30_000


class _Remembered:
    """A cache of the last results by code values, in read-only arrays; a fit uses the same code values often."""

    def __init__(self) -> None:
        self._results: dict[tuple[tuple[int, ...], bytes], Array] = {}

    def of(self, code: Array, compute: Callable[[], Array]) -> Array:
        """Return the result for code values (..., 3), from the cache or from ``compute``."""
        if code.size > MOST:
            return compute()
        key = code.shape, code.tobytes()
        result = self._results.pop(key, None)
        if result is None:
            result = compute()
            result.flags.writeable = False
        self._results[key] = result
        # Another thread may have removed an old result already.
        for old in list(self._results)[:-KEPT]:
            self._results.pop(old, None)
        return result


@dataclass(frozen=True)
class NativeDisplay:
    """The transfer curves and black of a fresh display.

    Raises LutgenError: black is negative, or above ``DARKEST``.
    """

    #: Transfer curves of red, green and blue.
    curves: tuple[TransferCurve, TransferCurve, TransferCurve]
    #: X, Y and Z of code 0 as shares of white's X, Y and Z.
    black: tuple[float, float, float]
    #: Source of the curves, one of ``SOURCES``.
    source: str = "ramps"
    #: Remarks on corrections of the readings.
    remarks: tuple[str, ...] = ()
    #: The display's own model, richer than one curve for each channel; None: the first session does not justify one.
    own: StoredModel | None = None
    #: The ladder's fit that selected the own model, with predictions of held-out readings; None: loaded from a file.
    ladder: OwnModel | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        refuse_unknown("source of a native display's curves", self.source, SOURCES)
        if not all(0.0 <= share <= DARKEST for share in self.black):
            shares = ", ".join(f"{share:.4g}" for share in self.black)
            raise LutgenError(
                f"native display: black is {shares} of white's X, Y, Z; it must lie within 0..{DARKEST:g}."
            )

    @classmethod
    def of(
        cls, readings: Measurements, leave_out: Sequence[int] = (), *, strict: bool = True, source: str | None = None
    ) -> "NativeDisplay":
        """Return the native display from the readings at hour 0, at rest.

        ``readings``: must contain black, the four tips, and ramps of red, green and blue, or of grey, at hour 0.
        ``leave_out``: indices of readings to ignore. ``strict``: whether a ramp that falls by more than noise, even
        without misread levels, raises LutgenError; otherwise its neighbouring levels are averaged. ``source``: source
        of the curves, one of ``SOURCES``; None: the source that predicts mixtures best.

        Raises LutgenError: a reading is missing, or a ramp falls by more than noise at more levels than may be misread.
        The message names channel and codes.
        """
        sample = None if source in {"ramps", "greys"} else _sample(readings, leave_out)
        by_ramps = partial(cls._of_ramps, readings, strict=strict)
        if sample is not None and source is not None:
            return cls(curves_of(sample) if source == "readings" else srgb_curves(), _black_of(sample), source)
        if sample is None or sample.mixtures < FEW:
            return by_ramps(leave_out, source or _source_without_mixtures(sample, readings, leave_out, by_ramps))
        if sample.mixtures < LEAST_MIXTURES:
            return _or_srgb(by_ramps(leave_out, "ramps"), sample)
        try:
            ramps = by_ramps(leave_out, "ramps")
        except LutgenError:
            ramps = None
        ladder = fit_own_model(sample)
        error = mixtures_error(sample, added_up(sample, ramps.curves, sample.drive)) if ramps else np.inf
        if ladder.is_above_curves and ladder.error < error:
            own = StoredModel.of(ladder.model, sample.tips, sample.black)
            return cls(curves_of(sample), _black_of(sample), "readings", ladder.remarks(), own, ladder)
        chosen, remark = best_source(sample, ramps.curves if ramps else None, ramps.source if ramps else "ramps")
        if ramps is not None and chosen == ramps.source:
            return replace(ramps, ladder=ladder)
        curves = curves_of(sample) if chosen == "readings" else srgb_curves()
        return cls(curves, _black_of(sample), chosen, (remark,), ladder=ladder)

    @classmethod
    def _of_ramps(
        cls, readings: Measurements, leave_out: Sequence[int], source: str, *, strict: bool
    ) -> "NativeDisplay":
        """Return the display with curves of ``source`` (ramps or greys), or of the other if that has too few levels."""
        session = _SessionAtRest.of(readings, leave_out, source)
        remarks = []
        black = session.black / session.tips[0]
        if (black < 0).any():
            remarks.append("Black read below 0 in X, Y or Z: it is taken as 0 there.")
        curves = []
        if session.source == "greys":
            lack = f"there are no {LEAST_LEVELS} levels of each channel between black and full drive"
            why = "ramps of single channels do not predict them" if session.has_ramps else lack
            remarks.append(f"The curve of each channel is solved from XYZ of the greys: {why}.")
        for channel, name in enumerate(CHANNELS):
            codes, light, sigma = session.points(channel)
            ramp = f"the ramp of {name}" if session.source == "ramps" else f"{name}'s part of the greys"
            misread = misread_levels(codes, light, sigma)
            remarks += [
                f"{readings.file}: hour 0: {ramp} contradicts itself at code {codes[level]:.4g}: that level is left "
                f"out. Measure it again."
                for level in misread
            ]
            codes, light, sigma = (np.delete(values, misread) for values in (codes, light, sigma))
            falls = fallen(codes, light, sigma, f"{readings.file}: hour 0: {ramp}") if strict else ""
            if falls:
                remarks.append(f"{ramp.capitalize()} falls within noise, {falls}: neighbours are averaged.")
            curves.append(TransferCurve.through(name, codes, np.clip(rising_light(light), 0.0, 1.0)))
        red, green, blue = curves
        x, y, z = np.maximum(black, 0.0).tolist()
        return cls((red, green, blue), (x, y, z), session.source, tuple(remarks))

    def linear(self, code: Array) -> Array:
        """Convert code values (..., 3) to linear light of each channel (..., 3), relative to the light at code 1."""
        return self._cache[0].of(
            code, lambda: np.stack([curve(code[..., channel]) for channel, curve in enumerate(self.curves)], axis=-1)
        )

    def own_gain(self, code: Array, share: Array | None = None) -> Array | None:
        """Return the ratio of the own model to curves and colour points alone, (m, 3); None without an own model.

        The gain is 1 at black and at the colour points, which are measured again at every hour.

        ``code``: code values (m, 3). ``share``: the own model's shares of white's X, Y and Z, (m, 3), if known.
        """
        if self.own is None:
            return None
        own, code = self.own, np.clip(code, 0.0, 1.0)
        if share is not None:
            return self._gain(own, code, share)
        flat = code.reshape(-1, 3)
        return self._cache[1].of(code, lambda: self._gain(own, code, own.near(flat).reshape(code.shape)))

    def _gain(self, own: StoredModel, code: Array, share: Array) -> Array:
        lit = tip_shares(self.linear(code), code, "continuous")
        known = np.vstack([self.black, own.tips])
        plain = lit @ own.tips + (1.0 - lit.sum(axis=-1, keepdims=True)) * known[0]
        # The correction removes the own model's error at black and the colour points, and decays with the distance.
        off = ((code[..., np.newaxis, :] - ENDS) ** 2).sum(axis=-1)
        correction = np.exp(-0.5 * off / REACH**2) @ (self._ends - known)
        return np.asarray(np.clip(1.0 + (share - plain - correction) / np.maximum(plain, LEAST_SHARE), *GAINS))

    @cached_property
    def _cache(self) -> tuple[_Remembered, _Remembered]:
        """Caches of the light and of the gains, by code values."""
        return _Remembered(), _Remembered()

    @cached_property
    def _ends(self) -> Array:
        """Shares of white at black and the colour points in the own model, (5, 3)."""
        return self.own.near(ENDS) if self.own else np.zeros((5, 3))

    def as_record(self) -> dict[str, Any]:
        """Return the entries of a model file: texts, numbers and lists of these."""
        points = {
            each.channel: [list(point) for point in zip(each.codes, each.light, strict=True)] for each in self.curves
        }
        return {"source": self.source, "black": list(self.black), **points, "remarks": list(self.remarks)}

    @classmethod
    def from_record(cls, record: Mapping[str, Any], own: StoredModel | None = None) -> "NativeDisplay":
        """Return the display of the entries of :meth:`as_record`. Raises LutgenError: invalid entries."""
        try:
            x, y, z = (float(share) for share in record["black"])
            points = [[(float(code), float(light)) for code, light in record[name]] for name in CHANNELS]
            red, green, blue = (
                TransferCurve(name, *zip(*each, strict=True)) for name, each in zip(CHANNELS, points, strict=True)
            )
            remarks = tuple(str(remark) for remark in record.get("remarks", ()))
            return cls((red, green, blue), (x, y, z), record["source"], remarks, own)
        except LutgenError:
            raise
        except (KeyError, TypeError, ValueError):
            raise LutgenError(
                "native display: it holds source, black (X, Y and Z as shares of white's), and red, green and blue: "
                "rows of two numbers, [code, light], from [0, 0] to [1, 1]."
            ) from None

    def made_from(self, readings: Measurements) -> NDArray[np.bool_]:
        """Return whether the curves interpolate each reading, (n,): black and ramps of the first session.

        Curves that are fitted to all readings depend so little on a single mixture that mixtures can still validate the
        curves. For an own model, every reading of the first session except black and the colour points has a prediction
        from a fit without this reading.
        """
        codes = readings.drive
        if self.own:
            return np.asarray(in_first_session(readings) & ~codes.any(axis=1))
        ramps = [_is_grey(codes)] if self.source == "greys" else [_is_ramp(codes, channel) for channel in range(3)]
        return np.asarray(in_first_session(readings) & np.logical_or.reduce([~codes.any(axis=1), *ramps]))


def _sample(readings: Measurements, leave_out: Sequence[int]) -> Sample | None:
    """Return a sample of the first session at rest; None: black or a colour point is missing."""
    try:
        return sample_of(readings, first_session_rows(readings, leave_out))
    except LutgenError:
        return None


def _source_without_mixtures(
    sample: Sample | None,
    readings: Measurements,
    leave_out: Sequence[int],
    by_ramps: Callable[[Sequence[int], str], NativeDisplay],
) -> str:
    """Return the source of the curves of a first session with too few mixtures to judge them."""
    if sample is None:
        return "ramps"  # the error that names all that is missing follows
    here = first_session_rows(readings, leave_out)

    def curves_from(source: str, without: Sequence[int]) -> Curves3:
        return by_ramps([*leave_out, *here[np.array(without, dtype=np.intp)]], source).curves

    return by_greys(sample, _is_grey(sample.drive), curves_from)


def _or_srgb(native: NativeDisplay, sample: Sample) -> NativeDisplay:
    """Return the display with its own curves if they predict the few mixtures clearly better; otherwise sRGB's.

    This is the rule of the ladder, whose lowest rung is sRGB's curves.
    """
    own, srgb = (added_up(sample, each, sample.drive) for each in (native.curves, srgb_curves()))
    if clearly_better(sample, own, srgb):
        return native
    errors = f"{native.source} {mixtures_error(sample, own):.2f}, sRGB {mixtures_error(sample, srgb):.2f}"
    remark = f"Curves are those of sRGB: the display's own are not clearly better (mean ΔE2000 on mixtures: {errors})."
    return replace(native, curves=srgb_curves(), source="srgb", remarks=(*native.remarks, remark))


def _black_of(sample: Sample) -> tuple[float, float, float]:
    return tuple(np.maximum(sample.black, 0.0).tolist())


@dataclass(frozen=True)
class _SessionAtRest:
    """The first session at rest: black, tips, and the ramps for the curves.

    ``codes`` (m, 3) and ``xyz_cd_m2`` (m, 3) are the colours, with replicates averaged.
    """

    black: Array
    tips: Array
    codes: Array
    xyz_cd_m2: Array
    source: str
    has_ramps: bool

    @classmethod
    def of(cls, readings: Measurements, leave_out: Sequence[int], source: str) -> "_SessionAtRest":
        rows = first_session_rows(readings, leave_out)
        codes, place = np.unique(readings.drive[rows], axis=0, return_inverse=True)
        place = place.reshape(-1)
        count = np.bincount(place)[:, np.newaxis]
        xyz = np.stack([np.bincount(place, column) for column in readings.xyz_cd_m2[rows].T], axis=1) / count
        black = np.asarray(~codes.any(axis=1))
        tips = [(codes == tip).all(axis=1) for tip in TIP_DRIVES]
        ramps, greys = [int(_is_ramp(codes, channel).sum()) for channel in range(3)], int(_is_grey(codes).sum())
        _check_complete(readings, black, tips, ramps, greys)
        levels = {"ramps": min(ramps), "greys": greys}
        if levels[source] < LEAST_LEVELS:
            source = "greys" if source == "ramps" else "ramps"
        return cls(
            xyz[black][0], np.array([xyz[tip][0] for tip in tips]), codes, xyz, source, levels["ramps"] >= LEAST_LEVELS
        )

    def points(self, channel: int) -> tuple[Array, Array, Array]:
        """Return code, light relative to full drive, and its standard deviation, (m,) each, of a channel's ramp."""
        net = self.tips - self.black
        if self.source == "greys":
            chosen = _is_grey(self.codes)
            # White differs from the sum of its primaries; on greys each channel carries a third of the difference.
            columns = net[1:] + (net[0] - net[1:].sum(axis=0)) / 3.0
            weight = inverse(columns.T)[channel]
        else:
            chosen = _is_ramp(self.codes, channel)
            weight = net[1 + channel] / (net[1 + channel] ** 2).sum()
        xyz = self.xyz_cd_m2[chosen]
        sigma = np.hypot(RELATIVE * xyz, FLOOR_CD_M2)
        light, variance = ((xyz - self.black) * weight).sum(axis=1), ((sigma * weight) ** 2).sum(axis=1)
        return self.codes[chosen, channel], light, np.sqrt(variance)


def _is_ramp(codes: Array, channel: int) -> NDArray[np.bool_]:
    """Return whether each colour has one channel alone, between black and full drive."""
    others = np.delete(codes, channel, axis=1)
    return np.asarray(~others.any(axis=1) & (codes[:, channel] > 0) & (codes[:, channel] < 1))


def _is_grey(codes: Array) -> NDArray[np.bool_]:
    """Return whether each colour is a grey between black and white."""
    level = codes[:, 0]
    return np.asarray((codes == codes[:, :1]).all(axis=1) & (level > 0) & (level < 1))


def _check_complete(
    readings: Measurements, black: NDArray[np.bool_], tips: list[NDArray[np.bool_]], ramps: list[int], greys: int
) -> None:
    """Raise LutgenError if the first session lacks readings for a native display; the message names them."""
    lacks = [] if black.any() else ["black (code 0, 0, 0)"]
    lacks += [f"{name} at full drive" for name, tip in zip(TIP_NAMES, tips, strict=True) if not tip.any()]
    if min(ramps) < LEAST_LEVELS and greys < LEAST_LEVELS:
        held = zip((*ramps, greys), (*CHANNELS, "grey"), strict=True)
        counts = ", ".join(f"{count} of {name}" for count, name in held)
        lacks.append(
            f"ramps: {LEAST_LEVELS} levels or more between black and full drive of red, green and blue each, or of "
            f"grey (it has {counts})"
        )
    if lacks:
        raise LutgenError(
            f"{readings.file}: a native display needs more of the first session. At hour 0 (centre, dark, full screen) "
            f"there is no {'; no '.join(lacks)}. Measure it, or take --baseline colour-points."
        )
