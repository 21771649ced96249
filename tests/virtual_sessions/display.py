"""A simulated display and its instrument. Every cause of a difference between sessions has its own parameter.

The code shares nothing with lutgen. The light is a sum of channels, as on an LCD. The readings are written as a CSV of
patches, or in ArgyllCMS's format.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Panel:
    """Properties of a panel: XYZ of full channels for 1 cd/m² of white, γ of the channels, leak as a share of white."""

    channels: Array
    gamma: Array
    leak: Array
    white_cd_m2: float


@dataclass(frozen=True)
class State:
    """State of panel, settings, room and instrument in one session."""

    brightness: float = 1.0
    gains: Array = field(default_factory=lambda: np.ones(3))
    curve: float = 1.0
    aged: Array = field(default_factory=lambda: np.ones(3))
    yellowed: Array = field(default_factory=lambda: np.ones(3))
    ambient: Array = field(default_factory=lambda: np.zeros(3))
    matrix: Array = field(default_factory=lambda: np.eye(3))
    drift: float = 0.0
    hdr: float = 0.0
    dynamic: float = 0.0
    clip: float = 1.0


def panel(rng: np.random.Generator) -> Panel:
    """Draw a panel: primaries near those of sRGB or P3, γ about 2.2, contrast 600 to 2000, white 80 to 400 cd/m²."""
    sets = ([(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)], [(0.68, 0.32), (0.265, 0.69), (0.15, 0.055)])
    xy = np.array(sets[int(rng.integers(2))]) + rng.normal(0.0, 0.006, (3, 2))
    xy *= np.minimum(1.0, 0.995 / xy.sum(axis=1, keepdims=True))  # no primary beyond the purple line
    xyz = np.column_stack([xy[:, 0] / xy[:, 1], np.ones(3), (1 - xy.sum(axis=1)) / xy[:, 1]])
    white_xy = np.array([0.3127, 0.3290]) + rng.normal(0.0, 0.005, 2)
    white = np.array([white_xy[0] / white_xy[1], 1.0, (1 - white_xy.sum()) / white_xy[1]])
    amount = np.linalg.solve(xyz.T, white)
    leak = white * rng.uniform([0.95, 1.0, 1.05], [1.15, 1.0, 1.5]) / rng.uniform(600.0, 2000.0)
    return Panel(xyz * amount[:, np.newaxis], 2.2 + rng.normal(0.0, 0.08, 3), leak, rng.uniform(80.0, 400.0))


def chart(steps: int = 9, mixed: int = 4) -> Array:
    """Return code values of a typical profiling chart.

    White appears four times, spread over the chart, and black twice; the rest is greys, ramps and a cube.
    """
    levels = np.linspace(0.0, 1.0, steps)[1:]
    ramps = [level * channel for channel in np.eye(3) for level in levels]
    greys = [np.full(3, level) for level in levels[:-1]]
    cube = [np.array(each) for each in product(np.linspace(0.0, 1.0, mixed), repeat=3) if np.ptp(each) > 0]
    white, black = [np.ones(3)], [np.zeros(3)]
    quarter = len(cube) // 2
    rows = [*white, *black, *greys, *white, *ramps, *cube[:quarter], *white, *black, *cube[quarter:], *white]
    return np.array(rows)


def light(display: Panel, state: State, code: Array) -> Array:
    """Return XYZ in cd/m² of the screen's light, (n, 3)."""
    signal = (np.minimum(code / state.clip, 1.0) * state.gains) ** state.curve
    linear = signal**display.gamma
    if state.hdr:
        # A tone curve that raises mid-tones and rolls off, a mapping into a wider gamut, and a limit of power.
        linear = (1.0 - state.hdr) * linear + state.hdr * linear**0.7
        mix = np.full((3, 3), 0.06 * state.hdr) + np.eye(3) * (1.0 - 0.18 * state.hdr)
        linear = linear @ mix
        linear = linear * (1.0 - 0.25 * state.hdr * linear.mean(axis=1, keepdims=True))
    emitted = linear @ (display.channels * state.aged[:, np.newaxis] * state.yellowed)
    luminance = float((display.channels[:, 1] * state.aged).sum() / display.channels[:, 1].sum())
    xyz = emitted + display.leak * luminance
    if state.dynamic:
        content = linear.mean(axis=1, keepdims=True)
        xyz = xyz * (1.0 - state.dynamic + state.dynamic * content**0.3)
    return np.asarray(display.white_cd_m2 * state.brightness * xyz)


def read(display: Panel, state: State, code: Array, rng: np.random.Generator, *, noise: float, floor: float) -> Array:
    """Return XYZ as an instrument reports it, in the order of the chart, (n, 3)."""
    order = np.linspace(0.0, 1.0, len(code))
    xyz = (
        light(display, state, code) * (1.0 + state.drift * (1.0 - np.exp(-3.0 * order)))[:, np.newaxis] + state.ambient
    )
    xyz = xyz @ state.matrix.T
    xyz = xyz * (1.0 + rng.normal(0.0, noise, (len(code), 1))) * (1.0 + rng.normal(0.0, 0.3 * noise, xyz.shape))
    return np.maximum(xyz + rng.normal(0.0, floor, xyz.shape), 0.0)


def csv_text(code: Array, xyz: Array) -> str:
    """Return a table of patches: 8-bit codes and XYZ in cd/m²."""
    rows = [
        ",".join([*(f"{value:.4f}" for value in 255.0 * c), *(f"{value:.6f}" for value in x)])
        for c, x in zip(code, xyz, strict=True)
    ]
    return "\n".join(["R,G,B,X_cdm2,Y_cdm2,Z_cdm2", *rows]) + "\n"


def ti3_text(code: Array, xyz: Array, created: str, ends: Array | None = None) -> str:
    """Return a session in ArgyllCMS's format; ``ends`` are the ends of straight calibration curves."""
    white = xyz[(code == 1.0).all(axis=1)].mean(axis=0)
    rows = [
        f"{number} " + " ".join(f"{value:.6f}" for value in (*(100.0 * c), *(100.0 * x / white[1])))
        for number, (c, x) in enumerate(zip(code, xyz, strict=True), start=1)
    ]
    head = [
        "CTI3",
        "# SIMULATED, not measured: tests/virtual_sessions of lutgen",
        'DESCRIPTOR "simulated"',
        'KEYWORD "SIMULATED"',
        'SIMULATED "tests/virtual_sessions of lutgen"',
        f'CREATED "{created}"',
        'DEVICE_CLASS "DISPLAY"',
        'COLOR_REP "RGB_XYZ"',
        'LUMINANCE_XYZ_CDM2 "' + " ".join(f"{value:.6f}" for value in white) + '"',
        'NORMALIZED_TO_Y_100 "YES"',
    ]
    text = [*head, *_table("SAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z", rows)]
    if ends is not None:
        steps = np.linspace(0.0, 1.0, 17)
        curve = [" ".join(f"{value:.6f}" for value in (step, *(step * ends))) for step in steps]
        text += ["CAL", 'DESCRIPTOR "curves"', 'COLOR_REP "RGB"', *_table("RGB_I RGB_R RGB_G RGB_B", curve)]
    return "\n".join(text) + "\n"


def _table(fields: str, rows: list[str]) -> list[str]:
    head = [f"NUMBER_OF_FIELDS {len(fields.split())}", "BEGIN_DATA_FORMAT", fields, "END_DATA_FORMAT"]
    return [*head, f"NUMBER_OF_SETS {len(rows)}", "BEGIN_DATA", *rows, "END_DATA"]
