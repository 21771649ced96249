"""Six classes of display: emitters, filters, and the luminance of white."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tests.generators.spectral.spectra import band, lines, long_pass, luminance, xyz

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray


@dataclass(frozen=True)
class Panel:
    """One display when new.

    Attributes
    ----------
    name
        Name of the display class.
    parts
        Spectra of the emitters, (parts, wavelengths); their sum lights the filters.
    worn
        Index in ``parts`` of the emitter that wears first.
    filters
        Transmittance of each channel at code value 1, including its gain, (3, wavelengths).
    leak
        Light of a closed pixel divided by that of an open pixel.
    power
        Electrical power of the channels at full light, (3,); the sum is 1.

    """

    name: str
    parts: NDArray[np.float64]
    worn: int
    filters: NDArray[np.float64]
    leak: float
    power: NDArray[np.float64]

    @property
    def lit(self) -> NDArray[np.float64]:
        """Return the sum of the emitters, (wavelengths,)."""
        return np.asarray(self.parts.sum(axis=0))

    @property
    def primaries(self) -> NDArray[np.float64]:
        """Return the spectra of the new display's primaries, (3, wavelengths), W/(sr m² nm)."""
        return self.filters * self.lit


@dataclass(frozen=True)
class Make:
    """A class of display: emitters, the emitter that wears, filters and sizes.

    An emitter is a name and a function that returns a spectrum for a jitter of 0 ± 1.
    """

    parts: Mapping[str, Callable[[float], NDArray[np.float64]]]
    worn: str
    red: tuple[float, float]  # edge and width of the long-pass filter, nm
    green: tuple[float, float]  # peak and FWHM, nm
    blue: tuple[float, float]
    floor: float  # transmittance of a filter outside its band
    white: tuple[float, float]  # cd/m²
    contrast: tuple[float, float]
    power: tuple[float, float, float]


def _blue_chip(j: float) -> NDArray[np.float64]:
    return band(449 + 2 * j, 21)


#: Terbium and europium lines of CCFL phosphors, and lines of mercury.
_MERCURY = {404.7: 0.12, 435.8: 0.75, 546.1: 0.5, 578.0: 0.12}
_TERBIUM = {488.0: 0.14, 493.0: 0.06, 543.5: 1.0, 549.0: 0.5, 584.0: 0.18, 588.0: 0.14, 621.0: 0.1}
_EUROPIUM = {
    588.0: 0.12,
    593.0: 0.2,
    599.0: 0.14,
    611.0: 1.0,
    616.0: 0.25,
    630.0: 0.16,
    650.0: 0.06,
    687.0: 0.1,
    708: 0.1,
}
#: Lines of Mn4+ in K2SiF6, the red phosphor PFS.
_MANGANESE = {609.0: 0.18, 613.5: 0.45, 622.0: 0.07, 630.5: 1.0, 634.5: 0.5, 648.0: 0.2}

MAKES: Mapping[str, Make] = {
    "CCFL LCD": Make(
        parts={
            "mercury": lambda _: 0.5 * lines(_MERCURY),
            "blue phosphor": lambda j: 0.36 * band(451 + j, 50, 1.3),
            "green phosphor": lambda j: (1.5 + 0.1 * j) * lines(_TERBIUM),
            "red phosphor": lambda j: (1.3 + 0.1 * j) * lines(_EUROPIUM),
        },
        worn="blue phosphor",
        red=(592, 6), green=(541, 78), blue=(457, 92), floor=0.004,
        white=(220, 420), contrast=(500, 1000), power=(1 / 3, 1 / 3, 1 / 3),
    ),
    "white LED LCD": Make(
        parts={"chip": _blue_chip, "YAG phosphor": lambda j: 0.42 * band(548 + 4 * j, 118, 1.25)},
        worn="YAG phosphor",
        red=(593, 6), green=(540, 80), blue=(454, 82), floor=0.004,
        white=(250, 500), contrast=(700, 1400), power=(1 / 3, 1 / 3, 1 / 3),
    ),
    "RGB LED LCD": Make(
        parts={
            "blue die": lambda j: 0.5 * band(455 + 2 * j, 22),
            "green die": lambda j: 0.62 * band(526 + 4 * j, 34),
            "red die": lambda j: 0.95 * band(632 + 2 * j, 18),
        },
        worn="red die",
        red=(590, 6), green=(540, 76), blue=(450, 76), floor=0.004,
        white=(200, 400), contrast=(700, 1200), power=(0.36, 0.38, 0.26),
    ),
    "quantum dot LCD": Make(
        parts={
            "chip": _blue_chip,
            "green dots": lambda j: 0.55 * band(532 + 3 * j, 34),
            "red dots": lambda j: 0.62 * band(631 + 3 * j, 31),
        },
        worn="red dots",
        red=(590, 6), green=(540, 78), blue=(454, 82), floor=0.003,
        white=(300, 650), contrast=(900, 1800), power=(1 / 3, 1 / 3, 1 / 3),
    ),
    "PFS LED LCD": Make(
        parts={
            "chip": _blue_chip,
            "sialon": lambda j: 0.5 * band(537 + 3 * j, 53, 1.15),
            "PFS": lambda j: (1.6 + 0.1 * j) * lines(_MANGANESE),
        },
        worn="PFS",
        red=(590, 6), green=(540, 80), blue=(454, 84), floor=0.003,
        white=(300, 800), contrast=(900, 1800), power=(1 / 3, 1 / 3, 1 / 3),
    ),
    "WRGB OLED": Make(
        parts={
            "blue stack": lambda j: band(459 + 2 * j, 30, 1.9),
            "yellow-green stack": lambda j: 0.62 * band(552 + 4 * j, 70, 1.1),
            "red stack": lambda j: 0.55 * band(617 + 3 * j, 52, 1.3),
        },
        worn="blue stack",
        red=(597, 5), green=(534, 62), blue=(452, 70), floor=0.001,
        white=(120, 300), contrast=(20000, 100000), power=(0.34, 0.28, 0.38),
    ),
}  # fmt: skip


def panel(rng: np.random.Generator) -> Panel:
    """Draw a display at random: its class, and the parameters that differ within the class."""
    name = str(rng.choice(list(MAKES)))
    return panel_of(name, rng)


def panel_of(name: str, rng: np.random.Generator) -> Panel:
    """Draw a display of the class ``name`` at random."""
    make = MAKES[name]
    jitter = rng.uniform(-1, 1, size=len(make.parts))
    parts = np.stack([spectrum(j) for spectrum, j in zip(make.parts.values(), jitter, strict=True)])
    shift = rng.normal(0, 1.5, size=3)
    filters = np.stack([
        long_pass(make.red[0] + shift[0], make.red[1]),
        0.85 * band(make.green[0] + shift[1], make.green[1]),
        0.8 * band(make.blue[0] + shift[2], make.blue[1]),
    ])  # fmt: skip
    filters = make.floor + (1 - make.floor) * filters
    filters *= _balance(filters * parts.sum(axis=0), rng)[:, None]
    filters *= rng.uniform(*make.white) / luminance((filters * parts.sum(axis=0)).sum(axis=0))
    return Panel(
        name=name,
        parts=parts,
        worn=list(make.parts).index(make.worn),
        filters=filters,
        leak=1 / rng.uniform(*make.contrast),
        power=np.array(make.power),
    )


def _balance(primaries: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return gains of the channels (3,) that put white near D65, as a factory calibration does."""
    x, y = np.array([0.3127, 0.3290]) + rng.normal(0, 0.004, size=2)
    white = np.array([x / y, 1.0, (1 - x - y) / y])
    return np.linalg.solve(xyz(primaries).T, white)
