"""Estimated spectra of a display: typical spectra of its class, corrected to the measured XYZ of the primaries.

Effects on wavelengths (yellowed optics, worn phosphors) need spectra, but most readings are three numbers. Each class
of displays has a typical spectrum S₀ for each primary. Of all spectra with the measured XYZ, lutgen takes the spectrum
with the smallest relative entropy to S₀: S(λ) = S₀(λ)·exp(θ·c(λ)), with c the colour-matching functions and θ the
solution of three equations. The factor is smooth and positive. Newton's method finds θ, because the dual problem is
convex (Boyd & Vandenberghe, Convex Optimization, 2004, §5.2.4 and §9.5).

Classes of displays: peak wavelengths and full widths at half maximum (nm) of their typical light, with sources:

- CCFL: Hg from the NIST Atomic Spectra Database; Tb³⁺, Eu³⁺ and BaMgAl₁₀O₁₇:Eu²⁺ (BAM) rounded from Blasse & Grabmaier,
  Luminescent Materials (1994). Mercury's lines do not wear.
- PFS LED: β-SiAlON:Eu²⁺ at 535, width 54, and K₂SiF₆:Mn⁴⁺ (PFS, KSF) at 631, with a blue chip at 450: Wang et al.,
  Opt. Express 23, 28707 (2015), doi:10.1364/OE.23.028707.
- Green and red phosphor LED: the same green, and CaAlSiN₃:Eu²⁺ at 649: Piao et al., Chem. Mater. 19, 4592 (2007).
- Quantum dots: blue 452, width 20, and green 530, width 24: Ko & Park, J. Korean Phys. Soc. 72, 45 (2018).

*Assumption:* all other peaks and widths, of these classes and of the other classes; the relative strengths; the part
that wears first. PFS emits several lines; the model has one line of 12 nm. Lines are wider in the model than in
reality, because the grid has 5 nm steps. The white subpixel of a WRGB OLED emits the white of its stack; the three
filters transmit parts of this white.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from lutgen.colorimetry import Array, inverse
from lutgen.errors import LutgenError, refuse_unknown

#: Wavelengths of all spectra in nm, (81,).
WAVELENGTHS = np.arange(380.0, 781.0, 5.0)

#: Result of :func:`class_of` for a text that names no class. The primaries then determine the class.
UNSTATED = ""

#: The class of a display whose readings name no class and whose primaries fit every class of ``BROAD``: the class of
#: most desktop displays.
DEFAULT_CLASS = "white-led"

#: Classes with almost equal primaries: XYZ does not distinguish them.
BROAD = ("white-led", "ccfl", "wrgb-oled")

#: Class → pattern of the words that name the class; the first match decides.
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
    """Typical spectra of a class: the wearing parts, fastest first, and the steady part, (81,) each.

    ``emitters`` names the parts that are the red, green and blue emitters of a class without filters. None: the
    primaries are the light behind the filters ``_FILTERS``.
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
        """Spectrum of the whole source, (81,)."""
        return np.asarray(sum(self.parts.values()) + self.steady)


def _bell(peak: float, below: float, above: float | None = None, area: float = 1.0) -> Array:
    """Return a spectrum with Gaussian flanks, half-maximum widths ``below`` and ``above`` (nm), and sum ``area``."""
    width = np.where(peak > WAVELENGTHS, below, above or below)
    bell = np.exp(-4.0 * np.log(2.0) * ((WAVELENGTHS - peak) / width) ** 2)
    return np.asarray(area * bell / bell.sum())


def _lines(width: float, *lines: tuple[float, float]) -> Array:
    return np.asarray(sum(_bell(at, width, area=area) for at, area in lines))


def _filters() -> Array:
    low, high, width, floor = np.array(_FILTERS).T[:, :, np.newaxis]
    band = 1.0 / ((1.0 + np.exp((low - WAVELENGTHS) / width)) * (1.0 + np.exp((WAVELENGTHS - high) / width)))
    return np.asarray(floor + (1.0 - floor) * band)


#: Class → wearing part, fastest first → peak, widths below and above the peak (nm), and area. The areas give a white
#: near D65 behind the filters.
_PARTS: dict[str, dict[str, tuple[float, float, float, float]]] = {
    "white-led": {"yellow phosphor (YAG)": (545, 70, 130, 2.6), "blue chip": (450, 18, 24, 1)},
    "quantum-dot": {"green dots": (530, 24, 24, 1.44), "red dots": (635, 30, 30, 1.76), "blue chip": (452, 20, 20, 1)},
    "pfs-led": {
        "red phosphor (PFS)": (631, 12, 12, 1.15),
        "green phosphor (β-SiAlON)": (535, 46, 62, 1.62),
        "blue chip": (450, 18, 24, 1),
    },
    "green-red-phosphor-led": {
        "red phosphor (CaAlSiN₃)": (649, 75, 105, 2.12),
        "green phosphor (β-SiAlON)": (535, 46, 62, 1.53),
        "blue chip": (450, 18, 24, 1),
    },
    "rgb-led": {"blue chip": (458, 20, 26, 1), "green chip": (527, 32, 40, 1.4), "red chip": (632, 20, 16, 1.4)},
    "wrgb-oled": {"blue layer": (460, 22, 44, 1), "green layer": (545, 50, 80, 1.14), "red layer": (620, 50, 80, 0.6)},
    "oled": {"blue emitter": (461, 20, 36, 1), "green emitter": (528, 30, 46, 1), "red emitter": (620, 30, 50, 1.1)},
}

#: Class without filters → the parts that are its red, green and blue emitters.
_EMITTERS = {"oled": ("red emitter", "green emitter", "blue emitter")}


@cache
def lights() -> Mapping[str, ClassLight]:
    """Return the typical spectra of all classes."""
    floor = np.full(WAVELENGTHS.size, 1e-5)  # positive at every wavelength, so that every correction has light to scale
    ccfl = ClassLight(
        {
            "blue phosphor (BAM)": _bell(450.0, 40.0, 64.0, 1.0),
            "green phosphor (Tb)": _lines(10.0, (490.0, 0.18), (544.0, 0.80), (585.0, 0.16), (620.0, 0.06)),
            "red phosphor (Eu)": _lines(8.0, (594.0, 0.1), (611.0, 0.38), (630.0, 0.06), (650.0, 0.02), (707.0, 0.04)),
        },
        floor + _lines(8.0, (404.7, 0.02), (435.8, 0.06), (546.1, 0.05), (578.0, 0.015)),
    )
    others = {
        name: ClassLight({part: _bell(*shape) for part, shape in parts.items()}, floor, _EMITTERS.get(name))
        for name, parts in _PARTS.items()
    }
    return {"ccfl": ccfl, **others}


def class_of(text: str) -> str:
    """Return the display class that a text such as "simulated CCFL-lit medical LCD" names, or ``UNSTATED``."""
    return next((name for name, words in _WORDS.items() if re.search(words, text, re.IGNORECASE)), UNSTATED)


# x̄, ȳ, z̄ of the CIE 1931 2° observer (CIE 15:2018) at each wavelength, three wavelengths a line.
_TABLE = """
0.001368 0.000039 0.006450001   0.002236 0.000064 0.01054999   0.004243 0.00012 0.02005001
0.00765 0.000217 0.03621   0.01431 0.000396 0.06785001   0.02319 0.00064 0.1102
0.04351 0.00121 0.2074   0.07763 0.00218 0.3713   0.13438 0.004 0.6456
0.21477 0.0073 1.0390501   0.2839 0.0116 1.3856   0.3285 0.01684 1.62296
0.34828 0.023 1.74706   0.34806 0.0298 1.7826   0.3362 0.038 1.77211
0.3187 0.048 1.7441   0.2908 0.06 1.6692   0.2511 0.0739 1.5281
0.19536 0.09098 1.28764   0.1421 0.1126 1.0419   0.09564 0.13902 0.8129501
0.05795001 0.1693 0.6162   0.03201 0.20802 0.46518   0.0147 0.2586 0.3533
0.0049 0.323 0.272   0.0024 0.4073 0.2123   0.0093 0.503 0.1582
0.0291 0.6082 0.1117   0.06327 0.71 0.07824999   0.1096 0.7932 0.05725001
0.1655 0.862 0.04216   0.2257499 0.9148501 0.02984   0.2904 0.954 0.0203
0.3597 0.9803 0.0134   0.4334499 0.9949501 0.008749999   0.5120501 1.0 0.005749999
0.5945 0.995 0.0039   0.6784 0.9786 0.002749999   0.7621 0.952 0.0021
0.8425 0.9154 0.0018   0.9163 0.87 0.001650001   0.9786 0.8163 0.0014
1.0263 0.757 0.0011   1.0567 0.6949 0.001   1.0622 0.631 0.0008
1.0456 0.5668 0.0006   1.0026 0.503 0.00034   0.9384 0.4412 0.00024
0.8544499 0.381 0.00019   0.7514 0.321 0.0001   0.6424 0.265 0.00004999999
0.5419 0.217 0.00003   0.4479 0.175 0.00002   0.3608 0.1382 0.00001
0.2835 0.107 0   0.2187 0.0816 0   0.1649 0.061 0
0.1212 0.04458 0   0.0874 0.032 0   0.0636 0.0232 0
0.04677 0.017 0   0.0329 0.01192 0   0.0227 0.00821 0
0.01584 0.005723 0   0.01135916 0.004102 0   0.008110916 0.002929 0
0.005790346 0.002091 0   0.004109457 0.001484 0   0.002899327 0.001047 0
0.00204919 0.00074 0   0.001439971 0.00052 0   0.0009999493 0.0003611 0
0.0006900786 0.0002492 0   0.0004760213 0.0001719 0   0.0003323011 0.00012 0
0.0002348261 0.0000848 0   0.0001661505 0.00006 0   0.000117413 0.0000424 0
0.00008307527 0.00003 0   0.00005870652 0.0000212 0   0.00004150994 0.00001499 0
"""

#: x̄, ȳ, z̄, (81, 3).
CMFS = np.array([float(number) for number in _TABLE.split()]).reshape(WAVELENGTHS.size, 3)

#: Smallest share of X, Y and Z in a primary's X + Y + Z: no real light has less. Smaller values are raised to this
#: share.
_LEAST = 1e-5


@dataclass(frozen=True, eq=False)
class SpectralDisplay:
    """Estimated spectra of a display's primaries."""

    #: One of :func:`lights`.
    display_class: str
    #: Spectra of red, green, blue at full drive at ``WAVELENGTHS``, (3, 81); Σ spectrum·CMF is XYZ in cd/m².
    spectra: Array
    #: Wearing part of the light, fastest first → share of the part in the light at each wavelength, (81,).
    parts: Mapping[str, Array]
    #: Largest error of a primary's XYZ relative to its X + Y + Z; above 1e-9 only for XYZ that no light has.
    misfit: float

    @staticmethod
    def of(display_class: str, xyz_tips: Array) -> "SpectralDisplay":
        """Estimate the spectra of a display.

        ``UNSTATED`` selects the class whose typical spectra need the least correction, in relative entropy. If this
        class is in ``BROAD``, the result has ``DEFAULT_CLASS``, because XYZ does not distinguish the broad classes.

        ``display_class``: one of :func:`lights`, or ``UNSTATED``. ``xyz_tips``: XYZ of white, red, green, blue in
        cd/m², (4, 3); white is not used.

        Raises LutgenError: unknown class, or a primary without luminance.
        """
        primaries = np.asarray(xyz_tips, dtype=np.float64)[1:]
        if not (np.isfinite(primaries).all() and (primaries[:, 1] > 0).all()):
            raise LutgenError(
                f"the primaries' luminances are {', '.join(f'{value:g}' for value in primaries[:, 1])} cd/m². "
                f"Spectra are estimated from primaries that give light: give positive, finite X, Y and Z."
            )
        return _estimated(display_class, tuple(primaries.ravel().tolist()))

    @cached_property
    def _by_wavelength(self) -> Array:
        """Contribution of each wavelength to the matrix of :meth:`maps`, (81, 3, 3); the sum is the identity."""
        back = inverse(_xyz_of(self.spectra).T)
        colours = self.spectra.T[:, :, np.newaxis] * back  # (81, primary, from)
        return np.asarray((CMFS[:, :, np.newaxis, np.newaxis] * colours[:, np.newaxis]).sum(axis=2))

    def maps(self, factor: Array) -> Array:
        """Return the matrices (..., 3, 3) from XYZ to the XYZ of the display's light times a factor (..., 81).

        The matrix is M'·M⁻¹. The columns of M are the primaries' XYZ; the columns of M' are their XYZ times the factor.
        """
        return np.asarray((factor[..., np.newaxis, np.newaxis] * self._by_wavelength).sum(axis=-3))

    def through(self, xyz: Array, factor: Array) -> Array:
        """Return the XYZ (..., 3) of the display's light times a factor (..., 81); leading axes broadcast."""
        return mapped(xyz, self.maps(factor))


@lru_cache(maxsize=64)
def _estimated(display_class: str, numbers: tuple[float, ...]) -> SpectralDisplay:
    """Estimate the spectra from the nine numbers of the primaries' XYZ; a search asks for one display many times."""
    primaries = np.array(numbers).reshape(3, 3)
    display_class = display_class or _guessed(primaries)
    refuse_unknown("display class", display_class, lights())
    light = lights()[display_class]
    spectra = _corrected(light.primaries, primaries)
    parts = {name: part / light.total for name, part in light.parts.items()}
    misfit = np.abs(_xyz_of(spectra) - primaries).max(axis=1) / primaries.sum(axis=1)
    return SpectralDisplay(display_class, spectra, parts, float(misfit.max()))


def mapped(xyz: Array, maps: Array) -> Array:
    """Multiply XYZ (..., 3) by matrices (..., 3, 3); sum in a fixed order, without BLAS."""
    return np.asarray(
        xyz[..., 0:1] * maps[..., :, 0] + xyz[..., 1:2] * maps[..., :, 1] + xyz[..., 2:3] * maps[..., :, 2]
    )


def of_scene(light: SpectralDisplay | None, who: str) -> SpectralDisplay:
    """Return ``light``. Raises LutgenError for None: an effect ``who`` on wavelengths needs a display's spectra."""
    if light is None:
        raise LutgenError(
            f"{who} acts on the display's spectra, and the scene has none. Give it light=SpectralDisplay.of(…)."
        )
    return light


def _xyz_of(spectra: Array) -> Array:
    """Return the XYZ (..., 3) of spectra (..., 81)."""
    return np.asarray((spectra[..., np.newaxis] * CMFS).sum(axis=-2))


def _guessed(primaries: Array) -> str:
    """Return the class whose typical spectra need the least correction to the primaries' XYZ (3, 3)."""
    nearest = min(lights(), key=lambda name: _cost(lights()[name].primaries, primaries))
    return DEFAULT_CLASS if nearest in BROAD else nearest


def _cost(bases: Array, primaries: Array) -> float:
    """Return the relative entropy of corrected to typical spectra, each with sum 1, summed over the primaries."""
    typical, corrected = (each / each.sum(axis=1, keepdims=True) for each in (bases, _corrected(bases, primaries)))
    # 0·log 0 is 0. scipy.special computes this too, but its import takes a tenth of a second at every start.
    lit = corrected > 0
    return float((corrected[lit] * np.log(corrected[lit] / typical[lit])).sum())


def _corrected(bases: Array, primaries: Array) -> Array:
    """Return the spectra (3, 81) nearest to typical spectra (3, 81) that have the primaries' XYZ (3, 3)."""
    return np.array([_nearest(base, xyz) for base, xyz in zip(bases, primaries, strict=True)])


def _nearest(base: Array, xyz: Array) -> Array:
    """Return the spectrum base·exp(θ·CMFs) with XYZ ``xyz``; find θ by Newton's method with step halving."""
    target = np.maximum(xyz, _LEAST * xyz.sum()) / xyz[1]
    base = base / _xyz_of(base)[1]
    theta, spectrum = np.zeros(3), base
    for _ in range(200):
        missing = target - _xyz_of(spectrum)
        if np.abs(missing).max() < 1e-14 * target.max():
            break
        curvature = (spectrum[:, np.newaxis, np.newaxis] * CMFS[:, :, np.newaxis] * CMFS[:, np.newaxis]).sum(axis=0)
        step = (inverse(curvature) * missing).sum(axis=1)
        step *= min(1.0, 20.0 / float(np.abs(step).max()))
        dual = spectrum.sum() - theta @ target
        for _ in range(40):
            moved = base * np.exp((CMFS * (theta + step)).sum(axis=1))
            if moved.sum() - (theta + step) @ target <= dual + 1e-15 * abs(dual):
                break
            step = step / 2.0
        theta, spectrum = theta + step, moved
    return np.asarray(spectrum * xyz[1])
