"""Small invented session files, one for every feature of the formats; the light of their display is known exactly."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lutgen.colorimetry import LINEAR_TO_XYZ

if TYPE_CHECKING:
    from lutgen.colorimetry import Array

#: The invented display: sRGB primaries, γ 2.2, and black of 0.1 % of white.
GAMMA, LEAK, WHITE_CD_M2 = 2.2, 0.001, 200.0

#: White three times, black twice, greys, ramps and mixtures.
DRIVE = np.array(
    [
        (1, 1, 1),
        *((level, level, level) for level in (0.0, 0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9)),
        (1, 1, 1),
        *(tuple(level * np.eye(3)[channel]) for channel, level in product(range(3), (0.2, 0.4, 0.6, 0.8, 1.0))),
        *product((0.3, 1.0), (0.3, 0.7), (0.0, 0.5)),
        (0, 0, 0),
        (1, 1, 1),
    ],
    dtype=np.float64,
)


def light(drive: Array = DRIVE) -> Array:
    """Return XYZ of the invented display; Y of white is 1."""
    white = LINEAR_TO_XYZ.sum(axis=1)
    return np.asarray((1.0 - LEAK) * drive**GAMMA @ LINEAR_TO_XYZ.T + LEAK * white)


def ti3(
    drive: Array = DRIVE,
    xyz: Array | None = None,
    *,
    keywords: tuple[str, ...] = (f'LUMINANCE_XYZ_CDM2 "190.09 {WHITE_CD_M2} 217.8"', 'NORMALIZED_TO_Y_100 "YES"'),
    calibration: Array | None = None,
    kind: str = "CTI3   ",
    scale: float = 100.0,
    names: tuple[str, ...] = ("XYZ_X", "XYZ_Y", "XYZ_Z"),
    name: str = "invented",
) -> str:
    """Write a CGATS file; ``xyz`` is written without conversion."""
    colours = 100.0 * light(drive) if xyz is None else xyz
    lines = [
        kind,
        "# invented",
        'DESCRIPTOR "an ""invented"" display"',
        'CREATED "Tue May 26 13:21:48 2020"',
        *keywords,
    ]
    lines += [f'BEGIN_ARGYLL_COLPROF_ARGS\n-v -M "{name}" -A "nobody"\nEND_ARGYLL_COLPROF_ARGS'] if name else []
    fields = ("SAMPLE_ID", "RGB_R", "RGB_G", "RGB_B", *names)
    rows = [
        " ".join([str(n), *(f"{v:.7f}" for v in (*(scale * d), *c))])
        for n, (d, c) in enumerate(zip(drive, colours, strict=True))
    ]
    lines += table(fields, rows)
    if calibration is not None:
        lines += ["CAL    ", 'DESCRIPTOR "curves"', "BEGIN_ARGYLL_DISPCAL_ARGS", "-w0.3127,0.329 -b180 -gs"]
        lines += ["END_ARGYLL_DISPCAL_ARGS"]
        lines += table(("RGB_I", "RGB_R", "RGB_G", "RGB_B"), [" ".join(f"{v:.6f}" for v in row) for row in calibration])
    return "\n".join(lines) + "\n"


def table(fields: tuple[str, ...], rows: list[str]) -> list[str]:
    """Write one CGATS table with its counts."""
    head = [f"NUMBER_OF_FIELDS {len(fields)}", "BEGIN_DATA_FORMAT", " ".join(fields), "END_DATA_FORMAT"]
    return [*head, f"NUMBER_OF_SETS {len(rows)}", "BEGIN_DATA", *rows, "END_DATA"]


def curves(*ends: float) -> Array:
    """Return straight calibration curves with these ends."""
    steps = np.linspace(0.0, 1.0, 5)
    return np.column_stack([steps, *(steps * end for end in ends)])
