"""Remarks on a session: sentences, each with its figure, most serious first."""

from collections.abc import Iterator

import numpy as np

from lutgen.colorimetry import SRGB_XY, Array, xy_to_uv, xyz_to_xyY
from lutgen.errors import listed
from lutgen.history.patches import CHANNELS, Primaries, mean_xyz, ramp, repeats, tips
from lutgen.history.transfer import Calibration, GreyTracking, Transfer
from lutgen.numerals import in_percent
from lutgen.readings.session import DRIVE_TOLERANCE, Session
from lutgen.readings.steadiness import Steadiness

#: Smallest change of luminance within a session that counts as drift, and smallest change that is too large for a
#: settled display at fixed settings: a warm-up from cold causes some percent, automatic brightness and local dimming
#: cause tens.
DRIFT, UNSTEADY = 0.005, 0.03

#: Smallest noise that gets a remark: a contact colorimeter on a bright patch has some 0.1 to 0.3 %.
NOISY = 0.005

#: Largest deviation of an additive display from 1; dynamic contrast, HDR tone mapping or a fourth sub-pixel causes
#: more.
ADDITIVE = 0.03

#: Smallest ΔL* from sRGB that counts as another curve: a plain γ of 2.2 differs by up to 3.4, at code 0.1.
LIGHTNESS = 4.0

#: Smallest ΔE2000 of a grey's cast that is visible beside white.
CAST = 3.0

#: Δu'v' of white or a primary that is larger than the disagreement of meters.
COLOUR = 0.01

#: Smallest share of white's luminance lost by a calibration that gets a remark.
COST = 0.1

#: Deviation of luminance from the middle of the screen up to which a good display is even.
UNEVEN = 0.1


def on_steadiness(steady: Steadiness | None) -> Iterator[str]:
    """Report drift and noise within the session."""
    if steady is None:
        return
    change = in_percent(steady.drift, 1, signed=True)
    if abs(steady.drift) >= UNSTEADY:
        yield (
            f"Unsteady: luminance of a repeated patch changed by {change} within the session: automatic brightness, "
            "local dimming or warm-up. All readings are uncertain by this amount."
        )
    elif abs(steady.drift) >= DRIFT:
        yield f"Drift: luminance changed by {change} within the session, as in warm-up."
    if steady.noise >= NOISY and abs(steady.drift) < UNSTEADY:
        scatter = in_percent(steady.noise, 2)
        yield f"Noisy: repeated patches scatter by {scatter} (1 σ); a colorimeter in contact has 0.1 to 0.3 %."


def is_black_readable(session: Session) -> bool:
    """Whether the mean luminance of black is above 0 and above three times the scatter of its readings, if repeated."""
    light = session.xyz[session.rows("black"), 1]
    return bool(light.size and light.mean() > (3.0 * light.std(ddof=1) if light.size > 1 else 0.0))


def on_black(session: Session, white: Array | None, black: Array | None) -> Iterator[str]:
    """Report a black that the meter cannot read, and a low contrast."""
    if black is None or white is None:
        return
    if not is_black_readable(session):
        yield f"Black reads {black[1]:.4f}: below the sensitivity of the meter; contrast is unknown."
    elif black[1] > white[1] / 200.0:
        unit = " cd/m²" if session.absolute else " of white"
        yield f"Contrast is only {white[1] / black[1]:.0f}: black of {black[1]:.3g}{unit}, or room light on the screen."


def on_additivity(additivity: float | None, black: Array | None) -> Iterator[str]:
    """Report a white that differs from the sum of the primaries."""
    if additivity is not None and abs(additivity - 1.0) >= ADDITIVE:
        after = "less black" if black is not None else "black not subtracted"
        yield (
            f"Not additive: white is {additivity:.3f} times the sum of red, green and blue ({after}). HDR tone "
            "mapping, dynamic contrast, power limits or a drift; the model's matrices do not hold."
        )


def on_calibration(calibration: Calibration | None) -> Iterator[str]:
    """Report limits, cost and faults of the loaded calibration."""
    if calibration is None:
        return
    ends = ", ".join(f"{name} {end:.3f}" for name, end in zip(CHANNELS, calibration.ends, strict=True))
    if calibration.at_stop and len(calibration.at_stop) < 3:
        yield (
            f"Calibration: {' and '.join(calibration.at_stop)} at the limit ({ends}): the calibration sets white by "
            "lowering the other channels, and cannot raise its luminance."
        )
    elif not calibration.at_stop:
        yield f"Calibration ends at {ends}: no channel is at its limit."
    if calibration.cost is not None and calibration.cost >= COST:
        yield f"The calibration costs {in_percent(calibration.cost)} of white's luminance."
    if not calibration.monotonic:
        yield "A calibration curve falls in a part of its range: brightness steps invert there."
    if calibration.starts.max() > 1e-3:
        yield f"The calibration raises black (to {calibration.starts.max():.3f} of drive)."


def on_clipping(curves: dict[str, Transfer]) -> Iterator[str]:
    """Report levels that give the same light."""
    clipped = {name: code for name, curve in curves.items() if (code := curve.clipped_from) is not None}
    crushed = {name: code for name, curve in curves.items() if (code := curve.crushed_to) is not None}
    bright = [f"{name} from code {code:.2f} up" for name, code in clipped.items()]
    dark = [f"{name} up to code {code:.2f}" for name, code in crushed.items()]
    if bright:
        yield (
            f"Clipped: the same light for {', '.join(bright)}: contrast set too high, a calibration at its limit, or a "
            "signal of limited range. Brighter levels look alike."
        )
    if dark:
        yield f"Crushed: no light for {', '.join(dark)}: a signal of limited range, or brightness set too low."


def on_white(session: Session, white: Array | None, calibration: Calibration | None) -> Iterator[str]:
    """Report white's colour and luminance that miss the calibration's target."""
    if white is None:
        return
    stated = {} if calibration is None else calibration.target
    aimed = "x" in stated
    target = np.array([stated["x"], stated["y"]]) if aimed else SRGB_XY[0]
    name = f"the calibration's target ({target[0]:.4f}, {target[1]:.4f})" if aimed else "D65"
    xy = xyz_to_xyY(white)[:2]
    shift = float(np.hypot(*(xy_to_uv(xy) - xy_to_uv(target))))
    if shift >= (COLOUR / 2 if aimed else COLOUR):
        yield f"White ({xy[0]:.4f}, {xy[1]:.4f}) is Δu'v' {shift:.4f} off {name}."
    luminance = stated.get("Y")
    if luminance and session.absolute and abs(white[1] / luminance - 1.0) >= 0.05:
        yield f"White has {white[1]:.0f} cd/m², the calibration asked for {luminance:.0f}."


def on_primaries(tips: Primaries | None) -> Iterator[str]:
    """Report the nearest gamut, and the primary that is furthest from it."""
    if tips is None:
        return
    shift = tips.shift[tips.nearest]
    worst = max(shift, key=lambda name: shift[name])
    covered = "" if tips.coverage is None else f"; covers {in_percent(tips.coverage)} of sRGB in u'v'"
    if shift[worst] >= COLOUR:
        yield f"Primaries: nearest to {tips.nearest}, {worst} Δu'v' {shift[worst]:.3f} off{covered}."
    else:
        yield f"Primaries: {tips.nearest} within Δu'v' {shift[worst]:.3f}{covered}."


def on_curve(curves: dict[str, Transfer]) -> Iterator[str]:
    """Report a transfer curve that is not sRGB's, and channels whose curves differ."""
    grey = curves.get("grey")
    if grey is None or grey.gamma is None:
        return
    at, off = grey.drive[grey.worst], grey.lightness[grey.worst]
    if abs(off) >= LIGHTNESS:
        yield f"Transfer: γ {grey.gamma:.2f}, not sRGB: ΔL* {off:+.1f} at code {at:.2f}."
    gammas = {name: curve.gamma for name, curve in curves.items() if name != "grey" and curve.gamma is not None}
    if len(gammas) == 3 and max(gammas.values()) - min(gammas.values()) >= 0.15:
        yield f"Channels differ: γ {', '.join(f'{name} {gamma:.2f}' for name, gamma in gammas.items())}."


def on_greys(greys: GreyTracking | None) -> Iterator[str]:
    """Report greys whose colour is not white's."""
    if greys is None:
        return
    worst = int(np.argmax(greys.delta_e))
    if greys.delta_e[worst] >= CAST:
        u, v = greys.shift[worst]
        yield (
            f"Greys do not track white: ΔE2000 {greys.delta_e[worst]:.1f} at code {greys.drive[worst]:.2f} "
            f"(Δu' {u:+.4f}, Δv' {v:+.4f})."
        )


def on_uniformity(extremes: tuple[float, float] | None) -> Iterator[str]:
    """Report how luminance varies over the screen."""
    if extremes is not None:
        low, high = extremes
        word = "Uneven" if max(1.0 - low, high - 1.0) >= UNEVEN else "Even"
        share = " to ".join(dict.fromkeys((in_percent(low), in_percent(high))))
        yield f"{word}: over the screen white has {share} of the middle's luminance."


#: Smallest number of levels between black and full drive for a curve.
FEWEST_LEVELS = 5

#: Smallest number of mixtures for crosstalk and loading.
FEWEST_MIXTURES = 8


def missing_patches(session: Session) -> Iterator[str]:
    """Report each kind of missing patch, and the diagnoses that need it, most serious first."""
    read = tips(session)
    full = [name for name in CHANNELS if name not in read]
    if mean_xyz(session, "white") is None:
        full.insert(0, "white")
    levels = {name: int((ramp(session, name).drive < 1.0 - DRIVE_TOLERANCE).sum()) for name in (*CHANNELS, "grey")}
    none = [name for name in CHANNELS if not levels[name]]
    few = [name for name in CHANNELS if 0 < levels[name] < FEWEST_LEVELS]
    if full:
        yield f"No {listed(full, 'or')} at full drive: no model of the display, no gamut, no additivity."
    if mean_xyz(session, "black") is None:
        yield "No black: no contrast, no black-level or ambient light, and γ is fitted without subtracting black."
    if not any(rows.size > 1 for rows in repeats(session)):
        yield "No patch was read twice: no noise, no drift within the session (warm-up, automatic brightness)."
    if levels["grey"] < FEWEST_LEVELS:
        yield f"Fewer than {FEWEST_LEVELS} greys below white: a coarse transfer curve, no drift of γ."
    if none:
        yield f"No ramp of {', '.join(none)}: no γ of these channels alone."
    if few:
        yield f"Fewer than {FEWEST_LEVELS} levels of {', '.join(few)} below full drive: a coarse γ of these channels."
    if session.kinds.count("mixture") < FEWEST_MIXTURES:
        yield "Hardly any mixtures: no crosstalk, no loading, and no check of the model on the colours of pictures."


def missing_records(session: Session) -> Iterator[str]:
    """Report everything else that was not read or recorded, and the diagnoses that need it, most serious first."""
    if not session.absolute:
        yield "No cd/m²: no fading of the backlight, no black level, no luminance to compare with other dates."
    if session.calibration is None:
        yield "No calibration curves: changes of the panel and of the calibration cannot be separated."
    if session.positions is None or not np.ptp(session.positions, axis=0).any():
        yield "One place on the screen: no edge fall-off, no uniformity."
    if session.spectra is None:
        yield "No spectra: yellowing, phosphor wear and backlight decay show by colour only."
    if session.created is None:
        yield "No date: give it in the campaign file."
    if not session.instrument:
        yield "No instrument named: a change of the meter could look like aging."
