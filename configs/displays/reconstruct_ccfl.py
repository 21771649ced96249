"""Write ``reconstructed-ccfl.csv``: readings of a simulated medical LCD that ages over 18 000 h.

    .venv/bin/python -m configs.displays.reconstruct_ccfl [--check]

The paper (Avanaki et al., "Aging display's effect on interpretation of digital pathology slides") measured white and
the primary tips of a Barco MDCC 6130 31 times over 18 000 h and never published the readings. This file replaces the
readings. It is a RECONSTRUCTION, NOT A MEASUREMENT.

The display: a CCFL of three phosphors and mercury lines, colour filters, a sensor that holds
white's luminance, a black-level leak and a little crosstalk. Readings are free of noise.

These have a source:

- Hg lines: NIST Atomic Spectra Database. Positions of the Tb3+ (5D4-7FJ) and Eu3+ (5D0-7FJ) lines,
  rounded: Blasse and Grabmaier, Luminescent Materials (1994).
- Observer: CIE 1931 2 degrees, from colour-science. White: D65, x = 0.3127, y = 0.3290.
- Phosphors wear out, optics absorb more with age and differently at each wavelength, luminance is held: the paper,
  sections 1 and 2.
- The three numbers of ``Drift``: least squares on the four chroma lifetimes of the paper's Table 1,
  by ``table1.py`` beside this file, on the H&E slide region that it names.

Everything else is an assumption: the CCFL lamp, its widths and strengths, the filters (chosen by hand so that the
tips are near sRGB and blue shifts less than half as far as white), leak, crosstalk, the sensor's error, the order of
wear (blue first), the losses of the other phosphors, and the course of the drift. The course is a fast start that
settles and, after an onset, a steady loss of the lamp and of optics whose stabilisers are used up. The Hg lines are
assumed not to wear.

The chroma-luma lifetimes are not fitted, but they influenced the choice of the course: without the fast start the
first of these lifetimes comes 20 % late. They limit the time constant of the fast start to about 900-2500 h. The
chroma lifetimes are all later and do not limit it. After 11 100 h, the last of the lifetimes, no data support the
drift: the drift continues at the rate of that hour.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import colour
import numpy as np
from numpy.typing import NDArray

from lutgen.pictures.lifetime import TABLE_1

FloatArray = NDArray[np.float64]

TABLE = Path(__file__).with_name("reconstructed-ccfl.csv")
# 31 readings, as in the paper, whose hours are unknown. 0, 5000, 10 000 and 18 000 h are among them.
HOURS: FloatArray = np.r_[0.0:10_001.0:500.0, 10_800.0:18_001.0:800.0]
LIFE_H = 18_000.0  # h, the paper's span; leak, crosstalk and sensor error are given at its end
DRIVES = ((1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1))  # W, R, G, B: the order of rows in an hour
WHITE_XY = (0.3127, 0.3290)  # D65, the white of sRGB
WHITE_CD_M2 = 250.0  # cd/m2, assumption: a common calibrated luminance of a colour medical display

NM: FloatArray = np.arange(380.0, 781.0)  # nm, 1 nm steps
# Lines are (nm, relative strength); strengths are assumptions.
HG_LINES = ((404.7, 0.35), (435.8, 1.0), (546.1, 0.8), (578.0, 0.25))  # 577.0 and 579.1 as one
TB_LINES = ((490.0, 0.22), (544.0, 1.0), (585.0, 0.20), (620.0, 0.07))
EU_LINES = ((594.0, 0.25), (611.0, 1.0), (630.0, 0.15), (650.0, 0.06), (707.0, 0.10))
HG_FWHM_NM = 2.0  # nm, assumption: wide enough for the 1 nm grid
TB_FWHM_NM = 9.0  # nm, assumption: each line is a group of unresolved lines
EU_FWHM_NM = 5.0  # nm, assumption
BAM_NM = 450.0  # nm, peak of the broad Eu2+ band of BaMgAl10O17
BAM_FWHM_NM = (40.0, 64.0)  # nm, twice the half widths below and above the peak: FWHM 52, with a tail to the red
HG_SHARE = 0.10  # strength of Hg 436 nm relative to a BAM band of unit area, assumption
# Pass bands (lower edge, upper edge, edge width, floor): nm, nm, nm, 1. Chosen by hand, for near-sRGB tips.
FILTERS = ((590.0, 900.0, 5.0, 0.008), (488.0, 592.0, 9.0, 0.018), (380.0, 486.0, 7.0, 0.003))

LEAK_NEW = 1.0 / 600.0  # black over white luminance at 0 h, assumption: contrast of a medical IPS LCD
LEAK_GROWTH = 1.5  # leak at LIFE_H over leak at 0 h, assumption
LEAK_TINT = 1.0  # leak's spectrum is white's times (550 nm/wavelength)^this: slightly bluish
CROSSTALK_NEW = 0.005  # relative loss of a channel's light when both other channels are on, assumption
CROSSTALK_OLD = 0.007  # the same at LIFE_H, assumption
SENSOR_ERROR_OLD = -0.003  # relative error of the held luminance at LIFE_H, assumption
YELLOWING_NM = 60.0  # nm, wavelength over which the yellowing falls to 1/e, assumption
EARLY_H = 1500.0  # h, time constant of the new lamp's loss, assumption
ONSET_WIDTH_H = 1000.0  # h, width of the late loss's onset, assumption
GREEN_SHARE = 0.5  # loss of the Tb phosphor in nepers per neper of the BAM phosphor's loss, assumption
RED_SHARE = 0.1  # the same for the Eu phosphor, which lasts longest, assumption
YELLOWING_SHARE = 0.5  # optical depth at 400 nm per neper of the BAM phosphor's late loss, assumption

# Hours until Max (mean + 2 SD) dE2000 3, mean 3, Max 5, mean 5, by mode, of this display; TABLE_1 is the paper's.
REACHED = {"chroma": (4438, 8014, 7881, 11084), "chroma-luma": (2239, 3481, 4368, 6005)}


def farthest(mode: str) -> float:
    """Return the largest difference of the reached lifetimes from the paper's, in per cent, rounded up to 0.1."""
    pairs = zip(REACHED[mode], TABLE_1[mode], strict=True)
    return float(np.ceil(max(1000.0 * abs(ours / paper - 1.0) for ours, paper in pairs)) / 10.0)


METADATA = (
    "# source: RECONSTRUCTED, not measured: CCFL model of configs/displays/reconstruct_ccfl.py, fitted to Table 1 of "
    f"Avanaki et al. on the H&E slide CMU-1-Small-Region: chroma lifetimes within {farthest('chroma'):.1f} %, "
    f"chroma-luma (not fitted) within {farthest('chroma-luma'):.1f} %\n"
    "# display: simulated CCFL-lit medical LCD; stands in for the unpublished readings of Avanaki et al.\n"
    "# instrument: none (simulated)\n"
    "# luminance: held\n"
    "# noise: none\n"
    "# lifetimes: hours until Max dE2000 3 / mean 3 / Max 5 / mean 5, Max being mean + 2 SD\n"
    + "".join(
        f"# lifetimes {mode}: {' / '.join(map(str, REACHED[mode]))} (paper {' / '.join(map(str, TABLE_1[mode]))})\n"
        for mode in TABLE_1
    )
    + "# extrapolated: past 11100 h"
)


@dataclass(frozen=True)
class Drift:
    """Size and rate of the display's drift: the numbers that ``table1.py`` fits, rounded."""

    early: float = 0.079  # nepers, early loss of the BAM phosphor, mostly within ``EARLY_H``
    rate: float = 0.276  # nepers per 10 000 h, loss rate of the BAM phosphor after the onset
    onset_h: float = 6530.0  # h, onset of the late loss: half of its rate


def losses(drift: Drift, hours: FloatArray = HOURS) -> tuple[FloatArray, FloatArray]:
    """Return the BAM phosphor's early and late loss in nepers, each of the shape of ``hours`` (h), 0 at 0 h."""

    def ramp(hour: FloatArray | float) -> FloatArray:
        return np.asarray(ONSET_WIDTH_H * np.logaddexp(0.0, (hour - drift.onset_h) / ONSET_WIDTH_H))

    early = drift.early * -np.expm1(-hours / EARLY_H)
    return early, drift.rate / 10_000.0 * (ramp(hours) - ramp(0.0))


def bells(peaks: tuple[tuple[float, float], ...], fwhm_nm: FloatArray | float) -> FloatArray:
    """Return the spectrum, (401,), of Gaussians given as (nm, area), with one width (nm) or one per wavelength."""
    at, area = np.array(peaks).T[:, :, np.newaxis]
    bell = np.exp(-4.0 * np.log(2.0) * ((NM - at) / fwhm_nm) ** 2)
    return np.asarray((area * bell / bell.sum(axis=1, keepdims=True)).sum(axis=0))


def transmissions(hours: FloatArray) -> FloatArray:
    """Return the panel's transmittance at each hour, tip and wavelength, (N, 4, 401): filters, crosstalk, leak."""
    low, high, width, floor = np.array(FILTERS).T[:, :, np.newaxis]
    band = 1.0 / ((1.0 + np.exp((low - NM) / width)) * (1.0 + np.exp((NM - high) / width)))
    filters = floor + (1.0 - floor) * band
    life = hours[:, np.newaxis, np.newaxis] / LIFE_H
    drive = np.array(DRIVES, dtype=float)
    others_on = drive.sum(axis=1, keepdims=True) - drive
    crosstalk = CROSSTALK_NEW + (CROSSTALK_OLD - CROSSTALK_NEW) * life
    leak = LEAK_NEW * (1.0 + (LEAK_GROWTH - 1.0) * life) * (550.0 / NM) ** LEAK_TINT
    return np.asarray(drive * (1.0 - crosstalk * others_on / 2.0) @ filters + leak * filters.sum(axis=0))


def backlight(drift: Drift, hours: FloatArray, white: FloatArray, to_xyz: FloatArray) -> FloatArray:
    """Return the lamp behind the yellowed optics, (N, 401).

    The result is relative to the lamp that makes ``white`` (401,) D65 at 0 h.
    """
    early, late = (loss[:, np.newaxis] for loss in losses(drift, hours))
    worn = early + late
    mercury = HG_SHARE * bells(HG_LINES, HG_FWHM_NM)
    bam = bells(((BAM_NM, 1.0),), np.where(NM < BAM_NM, *BAM_FWHM_NM))
    terbium = bells(TB_LINES, TB_FWHM_NM)
    europium = bells(EU_LINES, EU_FWHM_NM)
    x, y = WHITE_XY
    d65 = np.array([x / y, 1.0, (1.0 - x - y) / y])
    mixed = np.array([bam + mercury, terbium, europium]) * white @ to_xyz
    blue, green, red = np.linalg.solve(mixed.T, d65)
    lamp = (
        blue * (bam * np.exp(-worn) + mercury)
        + green * terbium * np.exp(-GREEN_SHARE * worn)
        + red * europium * np.exp(-RED_SHARE * worn)
    )
    return np.asarray(lamp * np.exp(-YELLOWING_SHARE * late * np.exp((400.0 - NM) / YELLOWING_NM)))


def readings(drift: Drift, hours: FloatArray = HOURS) -> FloatArray:
    """Return x, y and Y (cd/m2) of white, red, green and blue at ``hours`` (N,) in h: shape (N, 4, 3)."""
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    to_xyz: FloatArray = observer.values[np.isin(observer.wavelengths, NM)]
    new_white = transmissions(np.zeros(1))[0, 0]
    lamp = backlight(drift, hours, new_white, to_xyz)
    xyz = (transmissions(hours) * lamp[:, np.newaxis]) @ to_xyz
    held = WHITE_CD_M2 * (1.0 + SENSOR_ERROR_OLD * hours / LIFE_H)
    xyz *= (held / xyz[:, 0, 1])[:, np.newaxis, np.newaxis]
    return np.concatenate([xyz[..., :2] / xyz.sum(axis=-1, keepdims=True), xyz[..., 1:2]], axis=-1)


def table(drift: Drift, further: int = 0) -> str:
    """Return the text of the CSV file, one row per tip and hour of ``HOURS``, with ``further`` additional decimals."""
    rows = [
        f"{hour:.0f},{r},{g},{b},{x:.{5 + further}f},{y:.{5 + further}f},{luminance:.{3 + further}f}"
        for hour, tips in zip(HOURS, readings(drift), strict=True)
        for (r, g, b), (x, y, luminance) in zip(DRIVES, tips, strict=True)
    ]
    return "\n".join([METADATA, "hour,R,G,B,x,y,Y", *rows, ""])


def main(arguments: list[str] | None = None) -> int:
    """Write the table beside this script; with ``--check`` only compare, and return 1 if it differs."""
    parser = argparse.ArgumentParser(description="Write the reconstructed CCFL display, reconstructed-ccfl.csv.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if the file differs")
    wanted = table(Drift()).encode()
    if parser.parse_args(arguments).check:
        same = TABLE.exists() and TABLE.read_bytes() == wanted
        print(f"{TABLE.name}: {'up to date' if same else 'differs; run make display'}")
        return 0 if same else 1
    part = TABLE.with_name(TABLE.name + ".part")
    part.write_bytes(wanted)
    part.replace(TABLE)
    print(f"{TABLE.name}: {HOURS.size} hours x {len(DRIVES)} tips written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
