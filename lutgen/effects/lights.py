"""Kinds of display light: the typical spectrum of each, the parts of it that wear, and the words that name it.

Positions and full widths at half maximum (nm), with their sources:

- CCFL: Hg from the NIST Atomic Spectra Database; Tb³⁺, Eu³⁺ and BaMgAl₁₀O₁₇:Eu²⁺ (BAM) rounded from Blasse & Grabmaier,
  Luminescent Materials (1994). Mercury's lines do not wear.
- PFS LED: β-SiAlON:Eu²⁺ at 535, width 54, and K₂SiF₆:Mn⁴⁺ (PFS, KSF) at 631, under a blue chip of 450: Wang et al.,
  Opt. Express 23, 28707 (2015), doi:10.1364/OE.23.028707.
- Green and red phosphor LED: the same green, and CaAlSiN₃:Eu²⁺ at 649: Piao et al., Chem. Mater. 19, 4592 (2007).
- Quantum dots: blue 452, width 20, and green 530, width 24: Ko & Park, J. Korean Phys. Soc. 72, 45 (2018).

*Assumption:* all other positions and widths, of these and of the other kinds; the strengths; which part wears first.
PFS has lines beside the strongest, and its light is drawn as one line of 12 nm. Lines are drawn wider than they are,
for the 5 nm grid. The white subpixel of a WRGB OLED is the white of its stack, as its three filters see it.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lutgen.errors import pick_one

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.colorimetry import Array

#: nm, (81,).
WAVELENGTHS = np.arange(380.0, 781.0, 5.0)

#: What :func:`class_of` gives where a text names no class: the primaries are asked then.
UNSTATED = ""

#: The class of a display whose readings state none and whose primaries are those of any broad light: most desktop
#: displays belong to it.
DEFAULT_CLASS = "white-led"

#: Classes whose primaries hardly differ: three numbers do not tell them apart.
BROAD = ("white-led", "ccfl", "wrgb-oled")

#: Class → pattern of the words that name it, the first that fits.
_WORDS = {
    "ccfl": r"ccfl|cold.?cathode|fluorescent",
    "wrgb-oled": r"woled|w.?rgb.{0,3}oled|rgbw.{0,3}oled|white.{0,3}oled",
    "oled": r"oled",
    "quantum-dot": r"quantum.?dot|qled|qd.?(led|lcd|ef|film)",
    "pfs-led": r"pfs|ksf",
    "green-red-phosphor-led": r"(rg|gr|green.{0,9}red|red.{0,9}green).{0,3}phosphor",
    "rgb-led": r"rgb.{0,3}led|tri.?colou?r.{0,3}led",
    "white-led": r"w.?led|white.{0,3}led|led|edge.?lit",
}

#: Pass bands of the colour filters: lower edge, upper edge, width of the edges (nm), floor.
_FILTERS = ((590.0, 900.0, 6.0, 0.008), (488.0, 592.0, 9.0, 0.018), (300.0, 486.0, 7.0, 0.003))


class ClassLight(NamedTuple):
    """Typical spectra of a class: the wearing parts, fastest first; the stable part; and the filters (3, 81).

    Without filters each part is a primary's emitter, in the order of ``emitters``.
    """

    parts: Mapping[str, Array]
    steady: Array
    emitters: tuple[str, str, str] | None = None

    @property
    def primaries(self) -> Array:
        """Spectra of red, green and blue at full drive, (3, 81)."""
        if self.emitters:
            return np.array([self.parts[name] for name in self.emitters]) + self.steady
        return _filters() * self.total

    @property
    def total(self) -> Array:
        """The spectrum of the whole source, (81,)."""
        return np.asarray(sum(self.parts.values()) + self.steady)


def _bell(peak: float, below: float, above: float | None = None, area: float = 1.0) -> Array:
    """Spectrum with Gaussian flanks of full widths ``below`` and ``above`` (nm, half maximum); ``area`` is its sum."""
    width = np.where(peak > WAVELENGTHS, below, above or below)
    bell = np.exp(-4.0 * np.log(2.0) * ((WAVELENGTHS - peak) / width) ** 2)
    return np.asarray(area * bell / bell.sum())


def _lines(width: float, *lines: tuple[float, float]) -> Array:
    return np.asarray(sum(_bell(at, width, area=area) for at, area in lines))


def _filters() -> Array:
    low, high, width, floor = np.array(_FILTERS).T[:, :, np.newaxis]
    band = 1.0 / ((1.0 + np.exp((low - WAVELENGTHS) / width)) * (1.0 + np.exp((WAVELENGTHS - high) / width)))
    return np.asarray(floor + (1.0 - floor) * band)


def lights() -> dict[str, ClassLight]:
    """Typical spectra; the areas give white near D65 behind the filters."""
    floor = np.full(WAVELENGTHS.size, 1e-5)  # light at every wavelength, so that any correction finds some
    return {
        "ccfl": ClassLight(
            {
                "blue phosphor (BAM)": _bell(450.0, 40.0, 64.0, 1.0),
                "green phosphor (Tb)": _lines(10.0, (490.0, 0.18), (544.0, 0.80), (585.0, 0.16), (620.0, 0.06)),
                "red phosphor (Eu)": _lines(
                    8.0, (594.0, 0.1), (611.0, 0.38), (630.0, 0.06), (650.0, 0.02), (707.0, 0.04)
                ),
            },
            floor + _lines(8.0, (404.7, 0.02), (435.8, 0.06), (546.1, 0.05), (578.0, 0.015)),
        ),
        "white-led": ClassLight(
            {
                "yellow phosphor (YAG)": _bell(545.0, 70.0, 130.0, 2.6),
                "blue chip": _bell(450.0, 18.0, 24.0, 1.0),
            },
            floor,
        ),
        "quantum-dot": ClassLight(
            {
                "green dots": _bell(530.0, 24.0, 24.0, 1.44),
                "red dots": _bell(635.0, 30.0, 30.0, 1.76),
                "blue chip": _bell(452.0, 20.0, 20.0, 1.0),
            },
            floor,
        ),
        "pfs-led": ClassLight(
            {
                "red phosphor (PFS)": _bell(631.0, 12.0, 12.0, 1.15),
                "green phosphor (β-SiAlON)": _bell(535.0, 46.0, 62.0, 1.62),
                "blue chip": _bell(450.0, 18.0, 24.0, 1.0),
            },
            floor,
        ),
        "green-red-phosphor-led": ClassLight(
            {
                "red phosphor (CaAlSiN₃)": _bell(649.0, 75.0, 105.0, 2.12),
                "green phosphor (β-SiAlON)": _bell(535.0, 46.0, 62.0, 1.53),
                "blue chip": _bell(450.0, 18.0, 24.0, 1.0),
            },
            floor,
        ),
        "rgb-led": ClassLight(
            {
                "blue chip": _bell(458.0, 20.0, 26.0, 1.0),
                "green chip": _bell(527.0, 32.0, 40.0, 1.4),
                "red chip": _bell(632.0, 20.0, 16.0, 1.4),
            },
            floor,
        ),
        "wrgb-oled": ClassLight(
            {
                "blue layer": _bell(460.0, 22.0, 44.0, 1.0),
                "green layer": _bell(545.0, 50.0, 80.0, 1.14),
                "red layer": _bell(620.0, 50.0, 80.0, 0.6),
            },
            floor,
        ),
        "oled": ClassLight(
            {
                "blue emitter": _bell(461.0, 20.0, 36.0, 1.0),
                "green emitter": _bell(528.0, 30.0, 46.0, 1.0),
                "red emitter": _bell(620.0, 30.0, 50.0, 1.1),
            },
            floor,
            ("red emitter", "green emitter", "blue emitter"),
        ),
    }


@cache
def light_of(display_class: str) -> ClassLight:
    """Return the light of a class. Raises LutgenError for an unknown one."""
    known = lights()
    if display_class not in known:
        raise pick_one("display class", display_class, known)
    return known[display_class]


def stated_class(text: str) -> str | None:
    """Display class that a text such as "simulated CCFL-lit medical LCD" names, or None."""
    return next((name for name, words in _WORDS.items() if re.search(words, text, re.IGNORECASE)), None)


def class_of(text: str) -> str:
    """Display class that a text names; ``UNSTATED`` where :func:`stated_class` finds none."""
    return stated_class(text) or UNSTATED
