"""The ``# key: value`` lines of a CSV of readings: the unit of light, and keys that seem misspelt."""

import re
from collections.abc import Mapping
from difflib import get_close_matches

from lutgen.errors import LutgenError

#: Keys that lutgen reads, here or where the readings are used.
KEYS = (
    *("date", "display", "drive", "instrument", "luminance", "luminance_law", "noise_floor_cd_m2", "noise_relative"),
    *("session_gain", "source", "start_hour", "unit", "units", "white_cd_m2"),
)

#: Smallest similarity (0..1) at which an unknown key counts as a misspelt one: "instument", "start hour", not "noise".
_NEAR = 0.8

_CD_M2 = re.compile(r"cd[_ /]?m(?:2|²|\^2)|nits?", re.IGNORECASE)


def states_unit(metadata: Mapping[str, str], file: str) -> bool:
    """Whether a line ``# unit:`` states cd/m². Raises LutgenError: the line states another unit."""
    stated = {key: text for key, text in metadata.items() if key in {"unit", "units"}}
    for key, text in stated.items():
        if not _CD_M2.fullmatch(text.rstrip(".")):
            raise LutgenError(
                f"{file}: {key} is {text[:40]!r}; light must be in cd/m² (also written cd/m2 or nits). Convert it: "
                "1 fL = 3.426 cd/m²."
            )
    return bool(stated)


def remarks_on_keys(metadata: Mapping[str, str]) -> tuple[str, ...]:
    """Return a remark on each unknown key that is nearly a known one."""
    near = {key: get_close_matches(key[:40], KEYS, n=1, cutoff=_NEAR) for key in metadata if key not in KEYS}
    return tuple(
        f"Line # {key[:40]}: not known to lutgen, and left alone; is {known[0]} meant?"
        for key, known in near.items()
        if known
    )
