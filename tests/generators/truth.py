"""``Truth``: one simulated campaign before an instrument reads it, as every generator hands it over."""

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
        Operating hours (n,) from 0; code values 0..1, (n, 3); light at the instrument, (n, 3), cd/m².
    conditions
        The optional columns that are logged, each (n,); NaN is a blank cell.
    session, order, note
        Name of each reading's session; its place in the order of reading, (n,); "lens cap", "shrouded" or "".
    metadata
        The ``# key: value`` lines.
    hidden
        The answer: effect → strength, 1 being a typical size.

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
