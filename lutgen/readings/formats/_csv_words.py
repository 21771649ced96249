"""The words of a CSV of readings: names of columns, keys of its metadata, and hours, with their errors."""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from lutgen.cells import first_doubled, number
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError
from lutgen.readings.table import OPTIONAL

TEXT = ("session", "note")
KNOWN = ("hour", "R", "G", "B", "X", "Y", "Z", "x", "y", *OPTIONAL, "order", *TEXT)
NAMES = ("set", "name", "patch", "sample", "sample_id", "note")

#: Units in column names ("X_cdm2", "Y (cd/m²)", "Z nits"); prefixes in column names ("Device R", "CIE X"); other names
#: of columns.
UNIT = re.compile(r"[_ ]?[(\[]?(?:cd[_ /]?m2|cd/m²|nits?)[)\]]?$", re.IGNORECASE)
_WHOSE = re.compile(r"^(?i:device|code|drive|cie|measured|meas)[_ ]?(?=[RGBXYZxy]$)")
_OTHER_NAMES = {
    **{name: name[0] for name in ("RED", "GREEN", "BLUE")},
    **{f"{names}_{name}": name for names in ("RGB", "XYZ") for name in names},
}

#: Smallest similarity (0..1) at which an unknown name counts as a misspelt column: "ambient_lux", "hours", not "gamma".
_NEAR_NAME = 0.7


def plain(cell: str) -> str:
    """Return the name of a column without unit and prefix, one of R, G, B, X, Y, Z for its other names."""
    name = _WHOSE.sub("", UNIT.sub("", cell.strip().strip('"')))
    return _OTHER_NAMES.get(name.upper(), name)


def check_header(header: tuple[str, ...], where: str) -> tuple[str, ...]:
    """Return remarks on unknown columns. Raises LutgenError: a column is missing, doubled or misspelt."""
    columns = [plain(name) for name in header]
    unknown = [name for name in columns if is_unknown(name)]
    for name in unknown:
        if near := _known_name(name):
            raise LutgenError(
                f"{where}: unknown column {name!r} in the header; is {near} meant? Pick one of: {', '.join(KNOWN)}."
            )
    if doubled := first_doubled(name for name in columns if name):
        raise LutgenError(f"{where}: column {doubled!r} appears twice in the header. Name each column once.")
    missing = [name for name in "RGB" if name not in columns]
    if not missing and not {"X", "Y", "Z"} <= {*columns} and not {"x", "y", "Y"} <= {*columns}:
        missing = ["X,Y,Z or x,y,Y"]
    if missing:
        bright = next((name for name in unknown if "Y" not in columns and name.casefold().startswith("lum")), "")
        asked = f" Is {bright[:40]!r} Y in cd/m²? Call it Y." if bright else ""
        raise LutgenError(
            f"{where}: the header lacks {', '.join(missing)}.{asked} Required: R,G,B and X,Y,Z in cd/m² or x,y,Y; "
            "and hour, where readings are of several times. A title above the header begins with #."
        )
    if {"hour", "X", "Z"} <= {*columns} and {"x", "y"} & {*columns}:
        raise LutgenError(
            f"{where}: the header has both X,Y,Z and x,y. Keep one of them: they could contradict each other."
        )
    if not unknown:
        return ()
    listed = ", ".join(name[:40] for name in unknown[:12])
    return (f"{'Columns' if len(unknown) > 1 else 'Column'} {listed}: not known to lutgen, and left alone.",)


def is_unknown(column: str) -> bool:
    """Whether a column has a name, and lutgen does not know it."""
    return bool(column) and column not in KNOWN and column.lower() not in NAMES


def _known_name(name: str) -> str:
    """Return the known column that a name abbreviates or misspells; "" if there is none."""
    known = [each for each in KNOWN if len(each) > 1]
    written = name.casefold()[:40]
    first = written.partition("_")[0]  # "temp_c", "window_share"
    begun = [each for each in known if len(first) >= 4 and each.partition("_")[0].startswith(first)]
    near = begun or get_close_matches(written, known, n=1, cutoff=_NEAR_NAME)
    return near[0] if near else ""


#: Keys that lutgen reads, here or where the readings are used.
KEYS = (
    *("date", "display", "drive", "instrument", "luminance", "luminance_law", "noise_floor_cd_m2", "noise_relative"),
    *("session_gain", "source", "start_hour", "unit", "units", "white_cd_m2"),
)

#: Smallest similarity (0..1) at which an unknown key counts as a misspelt one: "instument", "start hour", not "noise".
_NEAR_KEY = 0.8

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
    near = {key: get_close_matches(key[:40], KEYS, n=1, cutoff=_NEAR_KEY) for key in metadata if key not in KEYS}
    return tuple(
        f"Line # {key[:40]}: not known to lutgen, and left alone; is {known[0]} meant?"
        for key, known in near.items()
        if known
    )


#: Patterns of hours with a point as the separator of thousands: 500, 3.000, 14.000; not 0.500, and not 100.500, which
#: would be 100 500 hours, 11 years.
_THOUSANDS, _BELOW = re.compile(r"[1-9][0-9]?\.[0-9]{3}"), re.compile(r"[0-9]{1,3}")

#: Fewest different hours with a point that show how the file writes hours.
_FEWEST_HOURS = 2


def refuse_thousands(texts: Sequence[str], lines: Sequence[int], file: str) -> None:
    """Raise LutgenError if all hours look as if a point separated thousands: 0, 500, 3.000 and 14.000."""
    dotted = {text for text in texts if _THOUSANDS.fullmatch(text)}
    if len(dotted) < _FEWEST_HOURS or not all(text in dotted or _BELOW.fullmatch(text) for text in texts):
        return
    at = next(place for place, text in enumerate(texts) if text in dotted)
    text = texts[at]
    raise LutgenError(
        f"{file}, line {lines[at]}, column hour: {text} has three decimals, as have the other hours; does the point "
        f"separate thousands? Write {text.replace('.', '')}, or {text}0 if hours and decimals are meant."
    )


def since_start(hours: Array, metadata: Mapping[str, str], file: str) -> Array:
    """Return the hours since the un-aged display: the counter minus ``# start_hour``, if stated."""
    text = metadata.get("start_hour")
    if text is None:
        return hours
    start = number(text)
    if start is None:
        raise LutgenError(
            f"{file}: start_hour is {text[:40]!r}; it is the counter's hour at the first session, such as 2400."
        )
    if hours.min() != start:
        raise LutgenError(
            f"{file}: start_hour is {start:g}, and the smallest hour is {hours.min():g}. They must be the same: "
            f"aging is measured from the first session."
        )
    return hours - start
