"""Make examples/session.ti3, one session as ArgyllCMS writes it, of an aged display. Simulated, not measured.

    python -m examples.make_session            write it
    python -m examples.make_session --check    compare it with the output; exit 1 if it differs

The display is one of ``tests/virtual_display``, an independent spectral simulator that shares nothing with lutgen:
an LCD lit by white LEDs after 12 000 hours. A calibration restores D65 for white by lower red and blue; green is at
its maximum. The display's light rises by half a percent while it warms up during the session.
"""

from __future__ import annotations

import argparse
import sys
from itertools import product
from pathlib import Path

import numpy as np

from examples.make_displays import same
from tests.virtual_display.campaign import Campaign, truth
from tests.virtual_display.physics.effect import code_to_linear
from tests.virtual_display.spectra import D65_XY, Array

FILE = Path(__file__).parent / "session.ti3"

DISPLAY = Campaign(display="white LED LCD", seed=4)
HOURS, SEED = 12_000.0, 7

#: Noise of a reading, 1 sigma, relative and in cd/m²; warm-up over the session; black as a share of white.
NOISE, FLOOR, WARMING, LEAK = 0.001, 0.002, 0.005, 0.0009


def session_text() -> str:
    """Return the text of the file, the same on every run."""
    tips = truth(DISPLAY, np.eye(3), HOURS)
    x, y = D65_XY
    gains = np.linalg.solve(tips.T, [x / y, 1.0, (1.0 - x - y) / y])
    ends = _code(gains / gains.max())
    drive = _patches()
    xyz = truth(DISPLAY, drive * ends, HOURS) + LEAK * tips.sum(axis=0)
    rng = np.random.default_rng(SEED)
    xyz *= 1.0 + WARMING * (1.0 - np.exp(-3.0 * np.linspace(0.0, 1.0, len(xyz))))[:, np.newaxis]
    xyz *= 1.0 + NOISE * rng.standard_normal((len(xyz), 1))
    xyz += FLOOR * rng.standard_normal(xyz.shape)
    rows = [
        f"{number} " + " ".join(f"{value:.4f}" for value in (*(100.0 * code), *(100.0 * light / xyz[0, 1])))
        for number, (code, light) in enumerate(zip(drive, xyz, strict=True), start=1)
    ]
    curve = [f"{step:.6f} " + " ".join(f"{value:.6f}" for value in step * ends) for step in np.linspace(0.0, 1.0, 33)]
    white = " ".join(f"{value:.4f}" for value in xyz[0])
    return _HEAD.format(white=white, rows=len(rows)) + "\n".join(rows) + _MIDDLE + "\n".join(curve) + "\nEND_DATA\n"


def _patches() -> Array:
    """Return the patches in reading order: white four times over the session, black, greys, ramps, and mixtures."""
    greys = [np.full(3, level) for level in np.linspace(0.0, 1.0, 17)[:-1]]
    ramps = [level * channel for channel in np.eye(3) for level in np.linspace(0.125, 1.0, 8)]
    mixtures = [np.array(each) for each in product((0.25, 0.6, 1.0), repeat=3) if np.ptp(each)]
    white = [np.ones(3)]
    return np.array([*white, *greys, *white, *ramps, np.zeros(3), *white, *mixtures, *white])


def _code(
    linear: Array,
) -> Array:
    """Invert the simulator's transfer function with a fine table."""
    code = np.linspace(0.0, 1.0, 100_001)
    return np.interp(linear, code_to_linear(code), code)


_HEAD = """CTI3
# SIMULATED, not measured: tests/virtual_display of lutgen, a white-LED LCD after 12 000 h

DESCRIPTOR "Argyll Calibration Target chart information 3"
ORIGINATOR "examples/make_session.py"
CREATED "Tue Mar 04 10:12:00 2025"
KEYWORD "SIMULATED"
SIMULATED "tests/virtual_display of lutgen, a white-LED LCD after 12 000 h"
DEVICE_CLASS "DISPLAY"
COLOR_REP "RGB_XYZ"
TARGET_INSTRUMENT "simulated colorimeter"
DISPLAY "simulated white LED LCD"
DISPLAY_TYPE_REFRESH "NO"
LUMINANCE_XYZ_CDM2 "{white}"
NORMALIZED_TO_Y_100 "YES"

NUMBER_OF_FIELDS 7
BEGIN_DATA_FORMAT
SAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z
END_DATA_FORMAT

NUMBER_OF_SETS {rows}
BEGIN_DATA
"""

_MIDDLE = """
END_DATA

CAL

DESCRIPTOR "Argyll Device Calibration State"
DEVICE_CLASS "DISPLAY"
COLOR_REP "RGB"

BEGIN_ARGYLL_DISPCAL_ARGS
-w0.3127,0.329 -gs
END_ARGYLL_DISPCAL_ARGS

NUMBER_OF_FIELDS 4
BEGIN_DATA_FORMAT
RGB_I RGB_R RGB_G RGB_B
END_DATA_FORMAT

NUMBER_OF_SETS 33
BEGIN_DATA
"""


def main() -> int:
    """Write, or compare. Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m examples.make_session", description="Make a simulated session.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where the file differs")
    text = session_text()
    if not parser.parse_args().check:
        FILE.write_text(text, encoding="utf-8")
        print(f"{FILE}: {len(text.splitlines())} lines")
    elif not FILE.is_file() or not alike(FILE.read_text(encoding="utf-8"), text):
        print(f"{FILE}: differs from what python -m examples.make_session writes")
        return 1
    return 0


def alike(one: str, other: str) -> bool:
    """Return whether two sessions are equal except for rounding."""
    return same(one.replace(" ", ","), other.replace(" ", ","))


if __name__ == "__main__":
    sys.exit(main())
