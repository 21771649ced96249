"""``Truth``: one simulated campaign without instrument noise. Every generator returns this type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Truth:
    """Noise-free readings of a simulated display.

    Attributes
    ----------
    hours, drive, xyz_cd_m2
        Operating hours from 0, (n,); code values 0..1, (n, 3); light at the instrument, (n, 3), cd/m².
    conditions
        The optional columns in the file, each (n,); NaN is a blank cell.
    session, order, note
        For each reading the name of its session, its index in the order of reading, (n,), and "lens cap", "shrouded"
        or "".
    metadata
        The ``# key: value`` lines.
    hidden
        The correct answer: effect → strength; 1 is a typical size.

    """

    hours: NDArray[np.float64]
    drive: NDArray[np.float64]
    xyz_cd_m2: NDArray[np.float64]
    conditions: Mapping[str, NDArray[np.float64]]
    session: tuple[str, ...]
    order: NDArray[np.float64]
    note: tuple[str, ...]
    metadata: Mapping[str, str]
    hidden: Mapping[str, float]
