"""The header of a CSV of readings: names of columns, and what is wrong with them."""

import re
from difflib import get_close_matches

from lutgen.cells import first_doubled
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
_NEAR = 0.7


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
    near = begun or get_close_matches(written, known, n=1, cutoff=_NEAR)
    return near[0] if near else ""
