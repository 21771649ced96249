"""Spectra on one grid of wavelengths: bands, lines, filters, room lamps, and the CIE 1931 2° observer.

Emitters have the peaks and the full widths at half maximum (FWHM) that textbooks and data sheets give. The observer and
the spectra of the lamps come from colour-science.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import colour
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEP = 2.0  # nm; the narrowest line here is 5 nm wide
WAVELENGTHS = np.arange(380.0, 780.0 + STEP, STEP)


def _on_grid(wavelengths: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.interp(WAVELENGTHS, wavelengths, values, left=0.0, right=0.0))


@cache
def observer() -> NDArray[np.float64]:
    """Return the observer (wavelengths, 3), which converts radiance per nm to XYZ in cd/m²."""
    functions = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    columns = [_on_grid(functions.wavelengths, functions.values[:, i]) for i in range(3)]
    return 683.0 * STEP * np.stack(columns, axis=-1)


@cache
def lamp(name: str) -> NDArray[np.float64]:
    """Return the spectrum of a room lamp by its CIE name (FL2, FL11, LED-B3 ...), scaled to Y = 1."""
    table = colour.SDS_ILLUMINANTS[name]
    spectrum = _on_grid(table.wavelengths, table.values)
    return unit(spectrum)


def xyz(spectra: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return XYZ (..., 3) of spectra (..., wavelengths)."""
    return np.asarray(spectra @ observer())


def luminance(spectra: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Y (...) of spectra (..., wavelengths)."""
    return np.asarray(spectra @ observer()[:, 1])


def uv(spectra: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return CIE 1976 u'v' (..., 2) of spectra (..., wavelengths)."""
    X, Y, Z = np.moveaxis(xyz(spectra), -1, 0)
    return np.asarray(np.stack([4 * X, 9 * Y], axis=-1) / (X + 15 * Y + 3 * Z)[..., None])


def band(peak: float, fwhm: float, skew: float = 1.0) -> NDArray[np.float64]:
    """An emission band of height 1; ``skew`` above 1 widens the side of long wavelengths."""
    width = np.where(peak > WAVELENGTHS, fwhm, fwhm * skew) * 2 / (1 + skew)
    return np.asarray(np.exp(-4 * np.log(2) * ((WAVELENGTHS - peak) / width) ** 2))


def lines(heights: dict[float, float], fwhm: float = 6.0) -> NDArray[np.float64]:
    """Narrow lines; ``heights`` maps wavelength to height."""
    return np.asarray(np.sum([height * band(peak, fwhm) for peak, height in heights.items()], axis=0))


def long_pass(edge: float, width: float) -> NDArray[np.float64]:
    """Transmittance that rises from 0 to 1 around the wavelength ``edge``."""
    return np.asarray(1 / (1 + np.exp(-(WAVELENGTHS - edge) / width)))


def tilt(exponent: float, around: float = 550.0) -> NDArray[np.float64]:
    """(around/λ)^exponent: bluish for a positive exponent."""
    return np.asarray((around / WAVELENGTHS) ** exponent)


def unit(spectrum: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the spectrum scaled to Y = 1."""
    return np.asarray(spectrum / luminance(spectrum))
