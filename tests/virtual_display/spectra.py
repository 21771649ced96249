"""Spectra of lamps, colour filters and emitters, and the observer, at 380..780 nm in steps of 5 nm.

Observer: CIE 1931 2° in the analytic fit of Wyman, Sloan and Shirley (JCGT 2(2), 2013, equation 4), so that no
colour library is shared with lutgen. Hg lines: NIST Atomic Spectra Database; Tb³⁺ and Eu³⁺ lines: Blasse and
Grabmaier, Luminescent Materials (1994). Widths, strengths and filters are assumptions. They are chosen by hand so
that white can be set to D65 and the primaries are near those of sRGB (OLED: near those of DCI-P3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP_NM = 5.0
NM: Array = np.arange(380.0, 780.1, STEP_NM)

#: The luminous efficacy that defines the candela, lm/W.
KM = 683.0

D65_XY = (0.3127, 0.3290)


def bell(peak_nm: float, below_nm: float, above_nm: float | None = None) -> Array:
    """A Gaussian of peak 1 with standard deviations below and above its peak, (81,)."""
    width = np.where(peak_nm > NM, below_nm, below_nm if above_nm is None else above_nm)
    return np.exp(-0.5 * ((NM - peak_nm) / width) ** 2)


def _lines(*lines: tuple[float, float], width_nm: float) -> Array:
    """Spectral lines (nm, strength) as a spectrometer of the given resolution (1 σ) records them."""
    return np.asarray(np.sum([strength * bell(nm, width_nm) for nm, strength in lines], axis=0))


def _band(low_nm: float, high_nm: float, edge_nm: float, floor: float) -> Array:
    """Transmittance of a colour filter: a band with two soft edges, and a floor at all wavelengths."""
    rise, fall = 1.0 + np.exp((low_nm - NM) / edge_nm), 1.0 + np.exp((NM - high_nm) / edge_nm)
    return floor + (0.92 - floor) / (rise * fall)


#: x̄, ȳ, z̄ of the CIE 1931 observer, (3, 81).
CMF: Array = np.array(
    [
        1.056 * bell(599.8, 37.9, 31.0) + 0.362 * bell(442.0, 16.0, 26.7) - 0.065 * bell(501.1, 20.4, 26.2),
        0.821 * bell(568.8, 46.9, 40.5) + 0.286 * bell(530.9, 16.3, 31.1),
        1.217 * bell(437.0, 11.8, 36.0) + 0.681 * bell(459.0, 26.0, 13.8),
    ]
)

#: Red, green and blue filters of an LCD, (3, 81).
FILTERS: Array = np.array([_band(590, 900, 6, 0.006), _band(492, 588, 9, 0.012), _band(360, 494, 8, 0.004)])


def spectrum_to_xyz(spectrum: Array) -> Array:
    """Convert spectral radiance in W/(m² sr nm), (..., 81), to XYZ in cd/m², (..., 3)."""
    return np.asarray(KM * STEP_NM * spectrum @ CMF.T)


def planck(kelvin: float) -> Array:
    """Spectrum of a thermal lamp of 1 cd/m², (81,)."""
    light = NM**-5.0 / np.expm1(1.4388e7 / (NM * kelvin))
    return np.asarray(light / spectrum_to_xyz(light)[1])


@dataclass(frozen=True)
class Emission:
    """The emission of the three primaries of a class of displays.

    Attributes
    ----------
    steady, wearing
        Spectra of red, green and blue, (3, 81), whose sum is the emission: the ``wearing`` part comes from the
        phosphor or emitter that ages first.
    lcd
        Whether a lamp shines through a liquid-crystal panel (else each sub-pixel makes its own light).

    """

    steady: Array
    wearing: Array
    lcd: bool


def _ccfl() -> Emission:
    """Cold-cathode lamp: the Hg lines, Tb³⁺ and Eu³⁺ are stable, the blue BAM phosphor wears."""
    mercury = _lines((404.7, 0.2), (435.8, 0.6), (546.1, 0.5), (578.0, 0.15), width_nm=4.0)
    terbium = _lines((490.0, 0.22), (544.0, 1.0), (585.0, 0.2), (620.0, 0.07), width_nm=5.0)
    europium = _lines((594.0, 0.25), (611.0, 1.0), (630.0, 0.15), (650.0, 0.06), (707.0, 0.1), width_nm=4.0)
    return Emission(FILTERS * (mercury + 1.6 * terbium + 2.0 * europium), FILTERS * bell(450.0, 18.0, 26.0), lcd=True)


def _white_led() -> Emission:
    """Blue InGaN chip that is stable, and a YAG:Ce phosphor that wears (thermal quenching, browned silicone)."""
    return Emission(FILTERS * bell(450.0, 9.0, 11.0), FILTERS * 0.55 * bell(555.0, 38.0, 62.0), lcd=True)


def _rgb_led() -> Emission:
    """Three chips behind a panel; the red AlInGaP chip wears."""
    steady = 0.9 * bell(530.0, 14.0, 18.0) + bell(455.0, 10.0, 12.0)
    return Emission(FILTERS * steady, FILTERS * bell(627.0, 11.0, 7.0), lcd=True)


def _oled() -> Emission:
    """Three emitters side by side; the blue one wears."""
    emitters = np.array([bell(618.0, 14.0, 24.0), bell(530.0, 15.0, 26.0), bell(460.0, 9.0, 16.0)])
    blue = np.array([[0.0], [0.0], [1.0]])
    return Emission(emitters * (1.0 - blue), emitters * blue, lcd=False)


#: Display classes by their name in a data file.
CLASSES = {"CCFL LCD": _ccfl(), "white LED LCD": _white_led(), "RGB LED LCD": _rgb_led(), "OLED": _oled()}
