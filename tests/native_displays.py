"""Displays that are not sRGB when new, computed with separate plain formulas, and their readings."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.readings import Measurements

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from lutgen.colorimetry import Array

TIPS = [(1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
BLACK = (0.0, 0.0, 0.0)
LEVELS = (0.06, 0.12, 0.22, 0.36, 0.5, 0.64, 0.78, 0.88, 0.94)
GREYS = [(level, level, level) for level in LEVELS]
RAMPS = [tuple(level * float(c == channel) for c in range(3)) for channel, level in product(range(3), LEVELS)]
MIXTURES = [tuple(code) for code in np.round(np.random.default_rng(5).uniform(0.05, 1.0, (24, 3)), 3).tolist()]

#: XYZ in cd/m² of red, green and blue, without black.
PRIMARIES = np.array([[90.0, 45.0, 3.0], [75.0, 150.0, 25.0], [40.0, 16.0, 210.0]])


@dataclass(frozen=True)
class Panel:
    """A panel with an exponent for each channel's curve, a leak, and a white that is not the sum of its primaries.

    ``fading`` is the share of the backlight's blue that is lost by 18 000 h, ``leaking`` the increase of black, cd/m².
    """

    gammas: tuple[float, float, float] = (2.4, 2.3, 2.1)
    black: tuple[float, float, float] = (0.3, 0.3, 0.5)
    extra: tuple[float, float, float] = (-6.0, -8.0, -5.0)
    fading: float = 0.3
    leaking: float = 0.0

    def xyz(self, code: Sequence[float], hours: float = 0.0) -> tuple[float, ...]:
        """Return XYZ in cd/m² as the sum of black, three channels, and a white term of the smallest channel."""
        lights = [value**gamma for value, gamma in zip(code, self.gammas, strict=True)]
        blue = 1.0 - self.fading * hours / 18_000.0
        lights[2] *= blue
        total = []
        for k in range(3):
            red_and_green = PRIMARIES[0][k] + PRIMARIES[1][k]
            backlight = (red_and_green + blue * PRIMARIES[2][k]) / (red_and_green + PRIMARIES[2][k])
            light = self.black[k] * backlight + self.leaking * hours / 18_000.0 + self.extra[k] * min(lights)
            total.append(light + sum(light_c * PRIMARIES[c][k] for c, light_c in enumerate(lights)))
        return tuple(total)


def session(panel: Panel, codes: Sequence[tuple[float, ...]], hours: Sequence[float] = (0.0, 18_000.0)) -> Measurements:
    """Return readings of some codes without noise, at each hour."""
    drive = np.tile(np.array(codes), (len(hours), 1))
    when = np.repeat(np.array(hours, dtype=np.float64), len(codes))
    xyz = np.array([panel.xyz(code.tolist(), float(hour)) for code, hour in zip(drive, when, strict=True)])
    return Measurements(hours=when, drive=drive, xyz_cd_m2=xyz, lines=np.arange(2.0, when.size + 2.0), file="panel.csv")


def write(readings: Measurements, path: Path) -> Path:
    """Write readings as lutgen's CSV."""
    rows = zip(readings.hours.tolist(), readings.drive.tolist(), readings.xyz_cd_m2.tolist(), strict=True)
    lines = [",".join(f"{value!r}" for value in (hour, *drive, *xyz)) for hour, drive, xyz in rows]
    path.write_text("\n".join(["hour,R,G,B,X,Y,Z", *lines]) + "\n", encoding="utf-8")
    return path


def from_8_bit(sessions: Sequence[Path], hours: Sequence[float]) -> Measurements:
    """Read sessions of 8-bit codes and XYZ in cd/m² (set,R,G,B,X_cdm2,Y_cdm2,Z_cdm2), one session per hour."""
    tables: list[Array] = [np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(1, 7)) for path in sessions]
    rows = np.concatenate(tables)
    when = np.repeat(np.array(hours, dtype=np.float64), [len(table) for table in tables])
    return Measurements(
        hours=when, drive=rows[:, :3] / 255, xyz_cd_m2=rows[:, 3:], lines=np.arange(2.0, when.size + 2.0), file="real"
    )
